"""A kind of texture that can be asked for by name, as data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from asperity.arguments import Argument
from asperity.textures.texture import Texture


@dataclass(frozen=True)
class Kind:
    """A kind of texture that can be asked for by name.

    Attributes:
        name: as on the command line, before the colon.
        summary: one line.
        make: makes the texture from its arguments by name.
        arguments: in the order in which they are listed.
        example: arguments [SI] that show it; none if the defaults do.
        source: where its sizes come from.
    """

    name: str
    summary: str
    make: Callable[..., Texture]
    arguments: tuple[Argument, ...]
    example: Mapping[str, Any] = field(default_factory=dict)
    source: str = ""

    @property
    def required(self) -> tuple[Argument, ...]:
        """The arguments that have no default."""
        return tuple(argument for argument in self.arguments if argument.required)

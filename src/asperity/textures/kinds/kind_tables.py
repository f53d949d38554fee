"""The declarations of the texture kinds in ``kinds.toml``."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from asperity.core.arguments import Argument, read_arguments

_PATH = Path(__file__).with_name("kinds.toml")

KIND_EXAMPLES: dict[str, dict[str, Any]] = tomllib.loads(_PATH.read_text("utf-8"))["examples"]
"""Summary and example arguments [SI] of each kind, by its name."""


def kind_arguments(*names: str) -> tuple[Argument, ...]:
    """Return the arguments in some tables; those of the later ones replace the others."""
    arguments: dict[str, Argument] = {}
    for name in names:
        arguments |= read_arguments(_PATH, name)
    return tuple(arguments.values())

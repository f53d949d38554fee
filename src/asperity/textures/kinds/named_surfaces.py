"""Named synthetic surfaces of physical size: deterministic, periodic, band-limited."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from asperity.core.arguments import SEED, Argument
from asperity.core.errors import ParameterError, find_named, suggest_names
from asperity.textures.kinds.noise import MIN_NODES_PER_WAVE, Patch, low_pass
from asperity.textures.kinds.surface_patches import (
    brush_metal,
    glue_sandpaper,
    lay_tiles,
    plane_wood,
    press_knurl,
    weave_cloth,
)
from asperity.textures.spline.spline_texture import HeightMap
from asperity.textures.texture import TextureKind

_SYNTHESIZERS: dict[str, Callable[..., Patch]] = {
    "cloth": weave_cloth,
    "brushed-metal": brush_metal,
    "sandpaper": glue_sandpaper,
    "wood": plane_wood,
    "knurl": press_knurl,
    "tile": lay_tiles,
}


class NamedSurface(HeightMap):
    """A surface of the library: a periodic height map with a name and parameters.

    Created by :func:`named_surface`. Waves shorter than 4 nodes are removed from the patch, and its
    mean height is set to zero.

    Args:
        name: name in the library.
        parameters: all parameters of the surface, SI units.
        patch: one period, before the low-pass filter.
    """

    kind: ClassVar[str] = "named"

    def __init__(self, name: str, parameters: Mapping[str, Any], patch: Patch) -> None:
        heights, pitch = patch
        smooth = low_pass(heights)
        steps = (f"{name} is synthetic, with typical dimensions, not measured",)
        super().__init__(smooth - smooth.mean(), pitch, periodic=True, preparation=steps)
        self.name = name
        self.parameters = dict(parameters)

    @property
    def cutoff(self) -> tuple[float, float]:
        """Shortest wavelength along x and y [m]."""
        return MIN_NODES_PER_WAVE * self.pitch[0], MIN_NODES_PER_WAVE * self.pitch[1]

    def __repr__(self) -> str:
        arguments = "".join(f", {name}={value!r}" for name, value in self.parameters.items())
        return f"named_surface({self.name!r}{arguments})"

    def describe(self) -> dict[str, Any]:
        """See :class:`Texture`; the kind is the name."""
        names = {"kind": self.name, "cutoff": list(self.cutoff)}
        return super().describe() | names | self.parameters


def named_surface(name: str, **parameters: Any) -> NamedSurface:
    """Return a surface of the library by its name.

    Args:
        name: one of :func:`surface_names`; case does not matter.
        **parameters: parameters of the surface, SI units; ``LIBRARY[name].arguments`` lists them
            with units and defaults.

    Returns:
        A periodic height map, mean height zero, without waves shorter than 4 nodes.

    Raises:
        ParameterError: for an unknown name or parameter (the nearest are offered), or a value
            that cannot be used.

    Example:
        >>> named_surface("sandpaper", grit="P240").parameters["grit"]
        'P240'
        >>> named_surface("cotton")
        Traceback (most recent call last):
        ...
        asperity.core.errors.ParameterError: name is unknown: 'cotton'; known: brushed-metal, cloth, knurl, sandpaper, tile, wood
    """  # noqa: E501  # doctest compares the whole message
    key = str(name).lower().replace("_", "-").replace(" ", "-")
    declared = {argument.name: argument for argument in find_named("name", key, LIBRARY).arguments}
    for unknown in parameters.keys() - declared.keys():
        raise ParameterError(unknown, f"is unknown to {key}; {suggest_names(unknown, declared)}")
    values = {
        argument.name: argument.validate(parameters.get(argument.name, argument.default))
        for argument in declared.values()
    }
    return NamedSurface(key, values, _SYNTHESIZERS[key](**values))


def surface_names() -> tuple[str, ...]:
    """Return the names of the library."""
    return tuple(LIBRARY)


def _load_kind(name: str, table: Mapping[str, Any]) -> TextureKind:
    """Return a kind from its table of ``surfaces.toml``."""
    arguments = [
        Argument(key, **{**row, "choices": tuple(row.get("choices", ()))})
        for key, row in table["arguments"].items()
    ]
    if table["seeded"]:
        arguments.append(SEED)
    factory = partial(named_surface, name)
    return TextureKind(name, table["summary"], factory, tuple(arguments), source=table["source"])


_TABLES = Path(__file__).with_name("surfaces.toml").read_text(encoding="utf-8")
LIBRARY: dict[str, TextureKind] = {
    name: _load_kind(name, table) for name, table in tomllib.loads(_TABLES).items()
}
"""Texture kinds of the named surfaces, with arguments and the source of the dimensions."""

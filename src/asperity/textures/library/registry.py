"""The surfaces that have a name."""

from __future__ import annotations

from functools import partial
from types import ModuleType
from typing import Any

from asperity.errors import ParameterError, nearest_names
from asperity.textures.library import brushed_metal, cloth, knurl, sandpaper, tile, wood
from asperity.textures.library.named import NamedSurface
from asperity.textures.texture import Kind

_DRAWN: dict[str, ModuleType] = {
    "cloth": cloth,
    "brushed-metal": brushed_metal,
    "sandpaper": sandpaper,
    "wood": wood,
    "knurl": knurl,
    "tile": tile,
}


def named_surface(name: str, **parameters: Any) -> NamedSurface:
    """Return a surface of the library by its name.

    Args:
        name: one of :func:`surface_names`; case does not matter.
        **parameters: of that surface, SI units; ``LIBRARY[name].arguments`` lists them with units
            and defaults.

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
        asperity.errors.ParameterError: name is unknown: 'cotton'; known: brushed-metal, cloth, knurl, sandpaper, tile, wood
    """  # noqa: E501  # doctest compares the whole message
    key = str(name).lower().replace("_", "-").replace(" ", "-")
    if key not in _DRAWN:
        raise ParameterError("name", f"is unknown: {name!r}; {nearest_names(str(name), _DRAWN)}")
    module = _DRAWN[key]
    known = {argument.name: argument for argument in module.ARGUMENTS}
    for given in parameters:
        if given not in known:
            raise ParameterError(given, f"is unknown to {key}; {nearest_names(given, known)}")
    values = {
        argument.name: argument.checked(parameters.get(argument.name, argument.default))
        for argument in module.ARGUMENTS
    }
    return NamedSurface(key, values, module.draw(**values))


def surface_names() -> tuple[str, ...]:
    """Return the names of the library."""
    return tuple(_DRAWN)


LIBRARY: dict[str, Kind] = {
    name: Kind(
        name,
        module.SUMMARY,
        partial(named_surface, name),
        module.ARGUMENTS,
        source=module.SOURCE,
    )
    for name, module in _DRAWN.items()
}
"""What can be asked for by name: arguments with units and defaults, and the source of the sizes."""

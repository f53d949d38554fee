"""Registry of named synthetic surfaces."""

from __future__ import annotations

from functools import partial
from types import ModuleType
from typing import Any

from asperity.core.errors import ParameterError, suggest_names
from asperity.textures.library import brushed_metal, cloth, knurl, sandpaper, tile, wood
from asperity.textures.library.named import NamedSurface
from asperity.textures.texture import TextureKind

_MODULES: dict[str, ModuleType] = {
    module.__name__.rpartition(".")[2].replace("_", "-"): module
    for module in (cloth, brushed_metal, sandpaper, wood, knurl, tile)
}


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
    if key not in _MODULES:
        raise ParameterError("name", f"is unknown: {name!r}; {suggest_names(str(name), _MODULES)}")
    module = _MODULES[key]
    declared = {argument.name: argument for argument in module.ARGUMENTS}
    for unknown in parameters.keys() - declared.keys():
        raise ParameterError(unknown, f"is unknown to {key}; {suggest_names(unknown, declared)}")
    values = {
        argument.name: argument.validate(parameters.get(argument.name, argument.default))
        for argument in module.ARGUMENTS
    }
    return NamedSurface(key, values, module.synthesize(**values))


def surface_names() -> tuple[str, ...]:
    """Return the names of the library."""
    return tuple(_MODULES)


LIBRARY: dict[str, TextureKind] = {
    name: TextureKind(
        name, module.SUMMARY, partial(named_surface, name), module.ARGUMENTS, source=module.SOURCE
    )
    for name, module in _MODULES.items()
}
"""Texture kinds of the named surfaces, with arguments and the source of the dimensions."""

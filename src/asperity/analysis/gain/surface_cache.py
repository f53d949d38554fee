"""Results about a surface that are cached between runs.

Every shipped law is k times a function of position: its numbers are computed at 1 N/m, cached
without the stiffness, and scaled, so a cached result equals a fresh one to the last bit. A
user-defined law need not be proportional to k: its results hold at its own stiffness only.
Results that rest on code of the user, in a texture kind or a contact, are not cached: what that
code reads is unknown.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from asperity.core.cache import get_or_compute
from asperity.core.files import content_digest, is_shipped
from asperity.kernels.fuse import kernel_source
from asperity.laws import LAWS, Law
from asperity.surface import Surface

Result = TypeVar("Result")


def is_shipped_law(law: Law) -> bool:
    """Return whether a law belongs to this package: its force is then proportional to k."""
    return LAWS.get(law.letter) is law


def at_unit_stiffness(surface: Surface) -> Surface:
    """Return the surface at 1 N/m; a surface with a user-defined law is returned unchanged."""
    if is_shipped_law(surface.law):
        return surface.to_stiffness(1.0)
    return surface


def stiffness_factor(surface: Surface) -> float:
    """Return by which factor forces exceed those of :func:`at_unit_stiffness`."""
    if is_shipped_law(surface.law):
        return surface.stiffness
    return 1.0


def cached_result(
    name: str, surface: Surface, compute: Callable[[Surface], Result], *extra: str
) -> Result:
    """Return a result about a surface from the cache, or compute and cache it.

    Args:
        name: name of the result.
        surface: the surface; for a shipped law its stiffness does not count.
        compute: computes the result from :func:`at_unit_stiffness`.
        extra: everything else the result depends on.
    """
    content = surface_content(surface, *extra)
    return get_or_compute(name, content, lambda: compute(at_unit_stiffness(surface)))


def surface_content(surface: Surface, *extra: str) -> str | None:
    """Return a digest of a surface, without the stiffness for a shipped law.

    ``None`` where code of the user takes part.
    """
    law = surface.law
    texture = surface.texture.digest
    formula: tuple[str | float, ...] = (law.letter,)
    if not is_shipped_law(law):
        if not is_shipped(type(law.contact)):
            return None
        formula = (kernel_source(law), law.contact.name, surface.stiffness)
    if texture is None:
        return None
    parameters = tuple(surface.law_parameters.items())
    return content_digest(
        texture, formula, surface.max_depth, surface.effective_clamp.name, parameters, *extra
    )

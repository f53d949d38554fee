"""Results about a surface that are cached between runs.

Every law is k times a function of position: its numbers are computed at 1 N/m, cached without the
stiffness, and scaled, so a cached result equals a fresh one to the last bit.
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
    """Return whether a law belongs to this package."""
    return LAWS.get(law.letter) is law


def cached_result(
    name: str, surface: Surface, compute: Callable[[Surface], Result], *extra: str
) -> Result:
    """Return a result about a surface from the cache, or compute and cache it.

    Args:
        name: name of the result.
        surface: the surface; its stiffness does not count.
        compute: computes the result from the surface at 1 N/m.
        extra: everything else the result depends on.
    """
    content = surface_content(surface, *extra)
    return get_or_compute(name, content, lambda: compute(surface.to_stiffness(1.0)))


def surface_content(surface: Surface, *extra: str) -> str | None:
    """Return a digest of a surface without its stiffness; ``None`` where code of the user acts."""
    law = surface.law
    texture = surface.texture.digest
    formula: tuple[str, ...] = (law.letter,)
    if not is_shipped_law(law):
        if not is_shipped(type(law.contact)):
            return None
        formula = (kernel_source(law), law.contact.name)
    if texture is None:
        return None
    parameters = tuple(surface.law_parameters.items())
    return content_digest(
        texture, formula, surface.max_depth, surface.effective_clamp.name, parameters, *extra
    )

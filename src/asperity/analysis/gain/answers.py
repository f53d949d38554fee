"""Answers about a surface that are kept between runs, and what they have to do with its stiffness.

Every shipped law is k times a function of position, so what is known of it at 1 N/m is known at
any stiffness: it is worked out there, kept without stiffness, and scaled. Then a kept answer and a
fresh one are the same to the last bit, whatever the stiffness was when it was kept. A law of one's
own need not be proportional to k, and what its code does is not known: it is worked out each time,
at its own stiffness.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from asperity.kept import content_digest, kept
from asperity.laws import LAWS, Law
from asperity.surface import Surface

Answer = TypeVar("Answer")


def is_shipped_law(law: Law) -> bool:
    """Return whether a law is one of this package: then its force is proportional to k."""
    return LAWS.get(law.letter) is law


def at_unit_stiffness(surface: Surface) -> Surface:
    """Return the surface at 1 N/m; with a law of one's own as it is."""
    return surface.to_stiffness(1.0) if is_shipped_law(surface.law) else surface


def kept_answer(name: str, surface: Surface, make: Callable[[], Answer], *further: str) -> Answer:
    """Return an answer about a surface that does not depend on its stiffness.

    Args:
        name: of what is asked.
        surface: the surface; its stiffness does not count.
        make: works it out.
        further: what else the answer depends on.
    """
    return kept(name, content_but_stiffness(surface, *further), make)


def content_but_stiffness(surface: Surface, *further: str) -> str | None:
    """Return a digest of all of a surface but its stiffness; ``None`` where that is not known."""
    texture = surface.texture.content
    if texture is None or not is_shipped_law(surface.law):
        return None
    parameters = tuple(surface.law_parameters.items())
    return content_digest(
        texture, surface.law.letter, surface.max_depth, surface.acting_clamp, parameters, *further
    )

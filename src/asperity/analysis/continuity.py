"""Is the force continuous in the position of the probe?"""

from __future__ import annotations

import math
from dataclasses import dataclass

from asperity.analysis.bound import Bound
from asperity.derive.facts import law_facts
from asperity.surface import Surface
from asperity.units import engineering


@dataclass(frozen=True)
class Continuity:
    """Whether the force jumps inside the working region.

    Attributes:
        continuous: whether it does not.
        reason: one sentence.
    """

    continuous: bool
    reason: str


def continuity(surface: Surface, q: Bound) -> Continuity:
    """Return whether the force is continuous over the working region.

    The force begins at zero where its formula vanishes with the depth. It can jump further in
    only where the contact point jumps, so only for the nearest contact, and there only if it
    depends on more than the depth, which itself never jumps.

    Args:
        surface: the surface.
        q: its characteristic number; infinite where the depth reaches the medial axis.
    """
    facts = law_facts(surface.law)
    if not facts.begins_at_zero:
        return Continuity(False, "the force jumps where contact begins")
    if surface.law.contact != "nearest":
        return Continuity(True, "force and contact point change without jumps")
    if not facts.looks_at_surface:
        return Continuity(True, "the distance to the surface never jumps")
    if math.isinf(q.lower) and q.at is not None:
        onset = engineering(surface.texture.extremes[1] - q.at[2], "m")
        text = f"the contact point jumps below crests, from {onset} down"
        return Continuity(False, text)
    depth = engineering(surface.max_depth, "m")
    return Continuity(True, f"no medial axis found down to {depth}; the force jumps below it")

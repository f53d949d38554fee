"""What is known of one law on a surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.leak import Leak
from asperity.files import record
from asperity.laws import Law
from asperity.surface import Surface


@dataclass(frozen=True)
class LawRow:
    """What is known of one law on the surface.

    Attributes:
        surface: the surface with this law at the stiffness that was asked for.
        q: characteristic number.
        one_sided: one-sided number q⁺.
        safe_stiffness: the stiffness that the device can still render [N/m]; 0 for q = ∞.
        rule: the rule that gave it, "K₀/q" or "K₀/q⁺".
        conservative: whether the work around every closed path is zero.
        conservative_reason: one sentence.
        leak: the worst simple loop at the stiffness that was asked for.
        continuous: whether the force is continuous.
        continuous_reason: one sentence.
        strength: T, RMS of the oscillating force over sup‖J‖ · l [1]; times l [m] if the surface
            has no period.
        support: S, slope of the mean normal force over sup‖J‖ [1].
        contact_lost: fraction of the scan without contact.
        texture_force: RMS of the oscillating force at the law's own safe stiffness [N].
        verdict: one line.
    """

    surface: Surface
    q: Bound
    one_sided: Bound
    safe_stiffness: float
    rule: str
    conservative: bool
    conservative_reason: str
    leak: Leak
    continuous: bool
    continuous_reason: str
    strength: float
    support: float
    contact_lost: float
    texture_force: float
    verdict: str

    @property
    def law(self) -> Law:
        """The law of this row."""
        return self.surface.law

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        law = {"law": self.law.letter, "name": self.law.name}
        law |= record(self.surface, "law_parameters")
        return law | record(self, without=("surface",))

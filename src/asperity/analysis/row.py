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

    @property
    def limiting(self) -> Bound:
        """The number on which the safe stiffness rests: q⁺ for a conservative law, else q."""
        return self.one_sided if self.conservative else self.q

    @property
    def rule(self) -> str:
        """The rule that gave the safe stiffness, "K₀/q" or "K₀/q⁺"."""
        return "K₀/q⁺" if self.conservative else "K₀/q"

    @property
    def buzzes(self) -> bool:
        """Whether the law may buzz: the stiffness that was asked for is above its limit."""
        return self.safe_stiffness < self.surface.stiffness

    @property
    def leaks(self) -> bool:
        """Whether the law feels alive: it is not conservative."""
        return not self.conservative

    @property
    def jumps(self) -> bool:
        """Whether the force jumps, which clicks."""
        return not self.continuous

    @property
    def textureless(self) -> bool:
        """Whether the law renders no texture."""
        return self.texture_force == 0.0

    @property
    def loses_contact(self) -> bool:
        """Whether contact is lost on a part of the scan."""
        return self.contact_lost > 0.0 and self.law.contact.begins_on_texture

    @property
    def safe_leak(self) -> float:
        """What the worst loop of one period gains at the law's own safe stiffness [J]."""
        return self.leak.worst_per_period * self.safe_stiffness / self.surface.stiffness

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {
            "law": self.law.letter,
            "name": self.law.name,
            **record(self.surface, "law_parameters"),
            **record(self, "q", "one_sided", "safe_stiffness", "rule"),
            **record(self, "conservative", "conservative_reason", "leak"),
            **record(self, "continuous", "continuous_reason", "strength", "support"),
            **record(self, "contact_lost", "texture_force", "verdict"),
        }

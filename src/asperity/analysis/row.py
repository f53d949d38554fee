"""What is known of one law on a surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.leak import Leak
from asperity.analysis.limits.felt import Felt, Tier
from asperity.analysis.passivity.judgement import Allowed, Passivity
from asperity.analysis.passivity.margin import Margin
from asperity.files import record
from asperity.laws import Law
from asperity.surface import Surface


@dataclass(frozen=True)
class LawRow:
    """What is known of one law on the surface.

    Attributes:
        surface: the surface with this law at the stiffness that was asked for; where none was, at
            ``start``, or at the smooth wall's K₀ if no stiffness is known to do.
        q: characteristic number.
        one_sided: one-sided number q⁺.
        passivity: what the device has to do with it: verdict, and up to which stiffness it may be
            rendered; the same as in an :class:`~asperity.analysis.Analysis`.
        margin: the share of what is allowed at which to begin.
        start: the stiffness to begin with [N/m]: margin times what is allowed; 0 if no stiffness is
            known to do.
        felt: whether the texture is felt at ``start``; ``None`` if there is none.
        conservative: whether the work around every closed path is zero.
        conservative_reason: one sentence.
        leak: the worst simple loop at the stiffness that was asked for.
        continuous: whether the force is continuous.
        continuous_reason: one sentence.
        strength: T, RMS of the oscillating force over sup‖J‖ · l [1]; times l [m] if the surface
            has no period.
        support: S, slope of the mean normal force over sup‖J‖ [1].
        contact_lost: fraction of the scan without contact.
        ripple: RMS of the oscillating force per stiffness [m].
        verdict: one line.
    """

    surface: Surface
    q: Bound
    one_sided: Bound
    passivity: Passivity
    margin: Margin
    start: float
    felt: Felt | None
    conservative: bool
    conservative_reason: str
    leak: Leak
    continuous: bool
    continuous_reason: str
    strength: float
    support: float
    contact_lost: float
    ripple: float
    verdict: str

    def __repr__(self) -> str:
        return (
            f"<LawRow {self.law.letter}: start at {self.start:g} N/m, {self.tier or 'none known'}>"
        )

    @property
    def law(self) -> Law:
        """The law of this row."""
        return self.surface.law

    @property
    def allowed(self) -> Allowed:
        """Up to which stiffness the law may be rendered, and how well that is known."""
        return self.passivity.allowed

    @property
    def safe_stiffness(self) -> float:
        """The stiffness of ``allowed`` [N/m], 0 where none is known; its basis says its worth."""
        return self.allowed.stiffness or 0.0

    @property
    def texture_force(self) -> float:
        """RMS of the oscillating force at ``start`` [N]."""
        return self.ripple * self.start

    @property
    def tier(self) -> Tier | None:
        """Whether the texture is felt at ``start``; ``None`` where no stiffness is known."""
        return None if self.felt is None else self.felt.tier

    @property
    def shown_force(self) -> float:
        """RMS of the texture's force that the device resolves, at ``start`` [N]."""
        return 0.0 if self.felt is None else self.felt.shown

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
        return self.ripple == 0.0

    @property
    def loses_contact(self) -> bool:
        """Whether contact is lost on a part of the scan."""
        return self.contact_lost > 0.0 and self.law.contact.begins_on_texture

    @property
    def start_leak(self) -> float:
        """What the worst loop of one period gains at ``start`` [J]."""
        return self.leak.worst_per_period * self.start / self.surface.stiffness

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {
            "law": self.law.letter,
            "name": self.law.name,
            **record(self.surface, "law_parameters"),
            **record(self, "q", "one_sided", "safe_stiffness", "allowed", "margin", "start"),
            "stiffness": self.surface.stiffness,
            **record(self, "felt"),
            "passivity": self.passivity.verdict,
            **record(self, "conservative", "conservative_reason", "leak"),
            **record(self, "continuous", "continuous_reason", "strength", "support"),
            **record(self, "contact_lost", "texture_force", "verdict"),
        }

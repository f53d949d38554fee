"""The row of each law in a comparison: its numbers, verdict and flaws."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.continuity import Continuity
from asperity.analysis.energy.leak import Leak
from asperity.analysis.limits.perceptibility_result import Perceptibility, Tier
from asperity.analysis.limits.perceptibility_sentences import texture_amount_text
from asperity.analysis.passivity.assess_passivity import (
    Passivity,
    buzz_text,
    delivery_text,
    stability_limit_text,
    stiffness_limit_text,
)
from asperity.analysis.passivity.verdict import Margin, StabilityLimit
from asperity.analysis.surface_sentences import leak_energy_text
from asperity.core.files import attributes_to_dict, to_plain_data
from asperity.laws import Law
from asperity.rendering import Rendering
from asperity.surface import Surface


@dataclass(frozen=True)
class LawRow:
    """Results of one law on the surface.

    Attributes:
        surface: the surface with this law at the given stiffness; by default at
            ``recommended_stiffness``, or at the smooth wall's K₀ if no stable stiffness is known.
        q: characteristic number.
        one_sided: one-sided number q⁺.
        passivity: verdict and stability limit on the device; the same as in an
            :class:`~asperity.analysis.Analysis`.
        margin: safety margin below the stability limit.
        recommended_stiffness: margin times stability limit [N/m]; 0 if no stable stiffness is
            known.
        perceptibility: perceptibility at the stiffness of ``surface``; ``None`` where none was
            given and no stable one is known.
        conservative: whether the work around every closed path is zero.
        conservative_reason: one sentence.
        leak: the worst simple loop at the stiffness of ``surface``.
        continuity: whether the force is continuous, and why.
        strength: T, RMS of the oscillating force over sup‖J‖ · l [1]; times l [m] if the surface
            has no period.
        support: S, slope of the mean normal force over sup‖J‖ [1].
        contact_lost: fraction of the scan without contact.
        ripple: RMS of the oscillating force per stiffness [m].
        rendering: how a loop renders the law.
    """

    surface: Surface
    q: Bound
    one_sided: Bound
    passivity: Passivity
    margin: Margin
    recommended_stiffness: float
    perceptibility: Perceptibility | None
    conservative: bool
    conservative_reason: str
    leak: Leak
    continuity: Continuity
    strength: float
    support: float
    contact_lost: float
    ripple: float
    rendering: Rendering

    def __repr__(self) -> str:
        start = f"start at {self.recommended_stiffness:g} N/m"
        return f"<LawRow {self.law.letter}: {start}, {self.tier or 'none known'}>"

    @property
    def law(self) -> Law:
        """The law of this row."""
        return self.surface.law

    @property
    def continuous(self) -> bool:
        """Whether the force is continuous."""
        return self.continuity.continuous

    @property
    def continuous_reason(self) -> str:
        """Why the force is continuous, or not, in one sentence."""
        return self.continuity.reason

    @property
    def stability_limit(self) -> StabilityLimit:
        """Stability limit of the stiffness, and its basis."""
        return self.passivity.stability_limit

    @property
    def texture_force(self) -> float:
        """RMS of the oscillating force [N]; 0 where no stiffness was given and none is known."""
        return 0.0 if self.perceptibility is None else self.ripple * self.surface.stiffness

    @property
    def tier(self) -> Tier | None:
        """Perceptibility tier; ``None`` where no stiffness was given and none is known."""
        return None if self.perceptibility is None else self.perceptibility.tier

    @property
    def resolved_force(self) -> float:
        """RMS of the resolved texture force [N]."""
        return 0.0 if self.perceptibility is None else self.perceptibility.resolved_rms

    @property
    def may_buzz(self) -> bool:
        """Whether the law may buzz: the stiffness of ``surface`` is above the stability limit."""
        return (self.stability_limit.stiffness or 0.0) < self.surface.stiffness

    @property
    def is_textureless(self) -> bool:
        """Whether the law renders no texture."""
        return self.ripple == 0.0

    @property
    def loses_contact(self) -> bool:
        """Whether contact is lost on a part of the scan."""
        return self.contact_lost > 0.0 and self.law.contact.begins_on_texture

    @property
    def verdict(self) -> str:
        """Limit of a law that is quiet, and the artefacts to expect, in one line."""
        quiet = self.conservative and not self._instability
        return "; ".join([*([_passivity_text(self)] if quiet else ()), *self.artefacts])

    @property
    def _instability(self) -> str:
        """How the law may be unstable at its stiffness; empty if nothing is known of it."""
        k = stiffness_limit_text(self.surface.stiffness)
        stability = stability_limit_text(self.stability_limit, self.passivity.loop)
        if self.passivity.verdict == "not passive" and self.conservative:
            return f"not passive at {k}; {stability}"
        if not self.recommended_stiffness:
            return stability
        limit = f"; {stability}" if self.conservative else ""
        return f"may buzz at {k}{limit}" if self.may_buzz else ""

    @cached_property
    def artefacts(self) -> list[str]:
        """Artefacts to expect from the law, each in a few words."""
        parts = [self._instability] if self._instability else []
        if not self.conservative:
            gain = f"feels alive: gains up to {leak_energy_text(self.leak)}"
            parts.append(f"{gain}; {delivery_text(self.passivity.loop)}")
        if not self.continuous:
            parts.append("clicks: " + self.continuous_reason)
        if self.is_textureless:
            parts.append("no texture")
        elif self.perceptibility is not None and self.tier != "felt":
            parts.append(f"{self.tier}: {texture_amount_text(self.perceptibility)}")
        if self.rendering.truncated:
            part = 100.0 * self.rendering.truncated / self.rendering.samples
            parts.append(f"search truncated in {part:.2g} % of samples")
        if self.loses_contact:
            parts.append(f"no contact on {100.0 * self.contact_lost:.0f} % of the scan")
        return parts

    def table_row(self) -> dict[str, Any]:
        """Return the main numbers by name and unit; ``None`` where one is unknown."""
        felt = self.perceptibility
        return {
            "law": self.law.letter,
            "recommended stiffness [N/m]": self.recommended_stiffness or None,
            "stiffness [N/m]": self.surface.stiffness,
            "stability limit [N/m]": self.stability_limit.stiffness,
            "passivity": self.passivity.verdict,
            "q": self.q.value,
            "q method": self.q.method,
            "one-sided q": self.one_sided.value,
            "tier": self.tier,
            "texture force RMS [N]": None if felt is None else self.texture_force,
            "resolved force RMS [N]": None if felt is None else self.resolved_force,
            "conservative": self.conservative,
            "leak [J]": self.leak.energy,
            "continuous": self.continuous,
            "ripple [m]": self.ripple,
            "support": self.support,
            "verdict": self.verdict,
        }

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        before = "q one_sided stability_limit margin recommended_stiffness"
        after = (
            "conservative conservative_reason leak continuous continuous_reason strength support "
            "contact_lost texture_force rendering verdict"
        )
        return {
            "law": self.law.letter,
            "name": self.law.name,
            "law_parameters": to_plain_data(self.surface.law_parameters),
            **attributes_to_dict(self, *before.split()),
            "stiffness": self.surface.stiffness,
            "perceptibility": to_plain_data(self.perceptibility),
            "passivity": self.passivity.verdict,
            **attributes_to_dict(self, *after.split()),
        }


def _passivity_text(row: LawRow) -> str:
    """Return the passivity of a conservative law at its stiffness."""
    passivity = row.passivity
    stiffness = stiffness_limit_text(row.surface.stiffness)
    if passivity.verdict == "bounded" and passivity.buzz is not None:
        return f"passive at {stiffness} but for steps: {buzz_text(passivity.buzz)}"
    if passivity.verdict == "plausible":
        return stability_limit_text(row.stability_limit, passivity.loop)
    return f"{passivity.verdict} at {stiffness}"

"""The row of each law in a comparison, and the law that is recommended among them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.closed_loops import EnergyBalance, Leak, energy_balance
from asperity.analysis.energy.continuity import Continuity
from asperity.analysis.energy.straight_scan import FrictionScan, friction_scan
from asperity.analysis.limits.perceptibility import Perceptibility, Tier
from asperity.analysis.passivity.recommended_stiffness import Margin, StabilityLimit
from asperity.analysis.passivity.verdict import Passivity
from asperity.core.display import Text
from asperity.core.files import attributes_to_dict, to_plain_data
from asperity.devices.device import Datum
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
        press: mean normal force at ``max_depth`` and the stiffness of ``surface`` [N], at which the
            texture is taken and up to which the limit holds.
        holds_at_any_press: whether the limit holds at every depth.
        greatest_press: where a given press is beyond the law at any stiffness, the greatest found
            that is not [N]; else ``None``.
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
    press: float
    holds_at_any_press: bool
    greatest_press: float | None = None
    verdict = Text[str]("Limit of a law that is quiet, and the artefacts to expect, in one line.")
    artefacts = Text[list[str]]("Artefacts to expect from the law, each in a few words.")

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
    def energy_balance(self) -> EnergyBalance:
        """Whether closed paths take no energy, take it from the hand, or give it to the hand."""
        return energy_balance(self.surface)

    @cached_property
    def friction_force(self) -> FrictionScan | None:
        """Friction on a straight scan; ``None`` without friction."""
        return friction_scan(self.surface)

    @property
    def is_sound(self) -> bool:
        """Whether the law is conservative and continuous."""
        return self.conservative and self.continuous

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
    def device_friction(self) -> Datum | None:
        """Dry friction of the device that exceeds the greatest press at which the limit holds."""
        friction = self.passivity.loop.device.data.get("friction")
        if friction is None or self.holds_at_any_press or self.press >= friction.value:
            return None
        return friction

    @property
    def is_hidden_by_friction(self) -> bool:
        """Whether the dry friction of the device, a trusted number, exceeds that press."""
        return self.device_friction is not None and self.device_friction.is_trusted

    @property
    def is_useful(self) -> bool:
        """Whether its texture is felt or borderline at its stiffness, and not hidden by friction.

        The smooth wall, without a texture, is useful unless friction hides it.
        """
        is_faint = self.tier == "not felt" and not self.is_textureless
        return not is_faint and not self.is_hidden_by_friction

    @property
    def is_textureless(self) -> bool:
        """Whether the law renders no texture, nor does friction that varies with the texture."""
        friction = self.surface.contact_friction
        varies = friction is not None and friction.modulation > 0.0
        return self.ripple == 0.0 and not varies

    @property
    def loses_contact(self) -> bool:
        """Whether contact is lost on a part of the scan."""
        return self.contact_lost > 0.0 and self.law.contact.begins_on_texture

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
            "texture force RMS [N]": felt and self.texture_force,
            "resolved force RMS [N]": felt and self.resolved_force,
            "conservative": self.conservative,
            "leak [J]": None if math.isnan(self.leak.energy) else self.leak.energy,
            "continuous": self.continuous,
            "ripple [m]": self.ripple,
            "support": self.support,
            "press [N]": self.press,
            "verdict": self.verdict,
        }

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        before = "q one_sided stability_limit margin recommended_stiffness"
        after = (
            "conservative conservative_reason energy_balance leak continuous continuous_reason "
            "strength support contact_lost texture_force rendering press holds_at_any_press verdict"
        )
        return {
            "law": self.law.letter,
            "name": self.law.name,
            "law_parameters": to_plain_data(self.surface.law_parameters),
            "friction": to_plain_data(self.surface.contact_friction),
            "friction_force": to_plain_data(self.friction_force),
            **attributes_to_dict(self, *before.split()),
            "stiffness": self.surface.stiffness,
            "perceptibility": to_plain_data(self.perceptibility),
            "passivity": self.passivity.verdict,
            **attributes_to_dict(self, *after.split()),
        }


EQUAL_STRENGTH_RATIO = 0.8
"""Laws whose texture forces differ by less than a fifth count as equally strong."""


def textured_rows(rows: Sequence[LawRow]) -> list[LawRow]:
    """Return the rows of the laws with a texture and a known stable stiffness."""
    return [
        row
        for row in rows
        if row.perceptibility is not None and not row.is_textureless and not row.may_buzz
    ]


def recommend(rows: Sequence[LawRow]) -> LawRow | None:
    """Return the recommended law; ``None`` if no law has a texture that is felt.

    A conservative and continuous law gains no energy on any closed path, and its force does not
    jump. Of such laws whose texture is felt (else: borderline, else: unknown), the one with the
    strongest texture at its recommended stiffness is chosen; of nearly equal ones the stiffest.
    Without such a law, the continuous law that is felt (else as before) and leaks least for its
    texture force is chosen. A law that is not felt or hidden by friction, without a known stable
    stiffness, or with a stability limit below the given stiffness, is never recommended.

    Args:
        rows: the laws, with their numbers at the given stiffness or each at its recommended one.
    """
    textured = [row for row in textured_rows(rows) if row.is_useful]
    tiers: tuple[Tier, ...] = ("felt", "borderline", "unknown")
    by_tier = [[row for row in textured if row.tier == tier] for tier in tiers]
    for candidates in by_tier:
        sound = [row for row in candidates if row.is_sound]
        if sound:
            return _strongest(sound)
    for candidates in by_tier:
        if candidates:
            continuous = [row for row in candidates if row.continuous]
            return min(continuous or candidates, key=_relative_leak)
    return None


def nearest_to_felt(rows: Sequence[LawRow]) -> LawRow | None:
    """Return the law whose texture comes nearest to being felt, of sound laws if there are any."""
    textured = textured_rows(rows)
    sound = [row for row in textured if row.is_sound]
    return max(sound or textured, key=lambda row: row.resolved_force, default=None)


def _strongest(rows: Sequence[LawRow]) -> LawRow:
    """Return the strongest law; of nearly equal ones the stiffest with a single-valued contact."""
    strongest = max([row.resolved_force for row in rows])
    equal = [row for row in rows if row.resolved_force >= EQUAL_STRENGTH_RATIO * strongest]
    return max(equal, key=lambda row: (row.law.contact.single_valued, row.recommended_stiffness))


def _relative_leak(row: LawRow) -> float:
    """Return the leak over texture force times length [1]; infinite if it is unknown."""
    if math.isnan(row.leak.energy):
        return math.inf
    return row.leak.worst_per_period / (row.texture_force * row.leak.line.length)

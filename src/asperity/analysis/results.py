"""Results of the analysis of one law and of a comparison of laws, and the recommended law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.leak import Leak
from asperity.analysis.limits.perceptibility import Perceptibility, Tier
from asperity.analysis.passivity.verdict import Margin, Passivity, StabilityLimit
from asperity.core.files import attributes_to_dict, to_plain_data
from asperity.laws import Law
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
        perceptibility: perceptibility at ``recommended_stiffness``; ``None`` if that is 0.
        conservative: whether the work around every closed path is zero.
        conservative_reason: one sentence.
        leak: the worst simple loop at the stiffness of ``surface``.
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
    recommended_stiffness: float
    perceptibility: Perceptibility | None
    conservative: bool
    conservative_reason: str
    leak: Leak
    continuous: bool
    continuous_reason: str
    strength: float
    support: float
    contact_lost: float
    ripple: float
    verdict: str = ""

    def __repr__(self) -> str:
        start = f"start at {self.recommended_stiffness:g} N/m"
        return f"<LawRow {self.law.letter}: {start}, {self.tier or 'none known'}>"

    @property
    def law(self) -> Law:
        """The law of this row."""
        return self.surface.law

    @property
    def stability_limit(self) -> StabilityLimit:
        """Stability limit of the stiffness, and its basis."""
        return self.passivity.stability_limit

    @property
    def safe_stiffness(self) -> float:
        """Stiffness of ``stability_limit`` [N/m], 0 where none is known."""
        return self.stability_limit.stiffness or 0.0

    @property
    def texture_force(self) -> float:
        """RMS of the oscillating force at ``recommended_stiffness`` [N]."""
        return self.ripple * self.recommended_stiffness

    @property
    def tier(self) -> Tier | None:
        """Perceptibility tier at ``recommended_stiffness``; ``None`` where that is 0."""
        return None if self.perceptibility is None else self.perceptibility.tier

    @property
    def resolved_force(self) -> float:
        """RMS of the resolved texture force at ``recommended_stiffness`` [N]."""
        return 0.0 if self.perceptibility is None else self.perceptibility.resolved_rms

    @property
    def may_buzz(self) -> bool:
        """Whether the law may buzz: the stiffness of ``surface`` is above the stability limit."""
        return self.safe_stiffness < self.surface.stiffness

    @property
    def has_leak(self) -> bool:
        """Whether the law feels alive: it is not conservative."""
        return not self.conservative

    @property
    def has_jumps(self) -> bool:
        """Whether the force jumps, which is felt as a click."""
        return not self.continuous

    @property
    def is_textureless(self) -> bool:
        """Whether the law renders no texture."""
        return self.ripple == 0.0

    @property
    def loses_contact(self) -> bool:
        """Whether contact is lost on a part of the scan."""
        return self.contact_lost > 0.0 and self.law.contact.begins_on_texture

    @property
    def recommended_leak(self) -> float:
        """Energy gained on the worst loop of one period at ``recommended_stiffness`` [J]."""
        return self.leak.worst_per_period * self.recommended_stiffness / self.surface.stiffness

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        before = "q one_sided safe_stiffness stability_limit margin recommended_stiffness"
        after = (
            "conservative conservative_reason leak continuous continuous_reason strength support "
            "contact_lost texture_force verdict"
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


EQUAL_STRENGTH_RATIO = 0.8
"""Laws whose texture forces differ by less than a fifth count as equally strong."""


@dataclass(frozen=True)
class Recommendation:
    """The recommended law, and the laws it was chosen from.

    Attributes:
        row: row of the recommended law; ``None`` if no law has a texture that is felt.
        rows: rows of all laws compared.
        is_sound: whether the recommended law is conservative and continuous; else it leaks least.
        textured_rows: rows of the laws with a texture and a known stable stiffness.
        nearest: where no texture is felt, row of the law that comes nearest; else ``None``.
    """

    row: LawRow | None
    rows: tuple[LawRow, ...]
    is_sound: bool
    textured_rows: tuple[LawRow, ...]
    nearest: LawRow | None = None


def recommend(rows: Sequence[LawRow]) -> Recommendation:
    """Return the recommended law.

    A conservative and continuous law gains no energy on any closed path, and its force does not
    jump. Of such laws whose texture is felt (else: borderline), the one with the strongest texture
    at its recommended stiffness is chosen; of nearly equal ones the stiffest. Without such a law,
    the continuous law that is felt (else: borderline) and leaks least for its texture force is
    chosen. A law that is not felt, or without a known stable stiffness, is never recommended.
    """
    textured = tuple(
        row for row in rows if row.perceptibility is not None and not row.is_textureless
    )
    by_tier = [[row for row in textured if row.tier == tier] for tier in ("felt", "borderline")]
    for candidates in by_tier:
        if sound := _sound_rows(candidates):
            return Recommendation(_strongest(sound), tuple(rows), True, textured)
    for candidates in filter(None, by_tier):
        smooth = [row for row in candidates if not row.has_jumps]
        best = min(smooth or candidates, key=_relative_leak)
        return Recommendation(best, tuple(rows), False, textured)
    return Recommendation(None, tuple(rows), False, textured, _nearest_to_perceptible(textured))


def _sound_rows(rows: Sequence[LawRow]) -> list[LawRow]:
    """Return the rows of conservative and continuous laws."""
    return [row for row in rows if not (row.has_leak or row.has_jumps)]


def _nearest_to_perceptible(rows: Sequence[LawRow]) -> LawRow | None:
    """Return the row whose texture comes nearest to being felt, of sound laws if there are any."""
    return max(_sound_rows(rows) or rows, key=lambda row: row.resolved_force, default=None)


def _strongest(rows: Sequence[LawRow]) -> LawRow:
    """Return the strongest law; of nearly equal ones the stiffest with a single-valued contact."""
    strongest = max(row.resolved_force for row in rows)
    equal = [row for row in rows if row.resolved_force >= EQUAL_STRENGTH_RATIO * strongest]
    return max(equal, key=lambda row: (row.law.contact.single_valued, row.recommended_stiffness))


def _relative_leak(row: LawRow) -> float:
    """Return the leak over texture force times length [1], at the recommended stiffness."""
    return row.recommended_leak / (row.texture_force * row.leak.line.length)

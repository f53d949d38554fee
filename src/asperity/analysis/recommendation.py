"""Which of the laws compared to use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from asperity.analysis.row import LawRow

NEARLY = 0.8
"""Laws whose texture forces differ by less than a fifth are taken as equally strong."""


@dataclass(frozen=True)
class Recommendation:
    """The recommended law, and what it was chosen from.

    Attributes:
        row: of the recommended law; ``None`` if of no law a texture is felt at a known stiffness.
        rows: of all laws compared.
        sound: whether the recommended law is conservative and continuous; else it leaks least.
        textured: the laws that render a texture at a known stiffness.
        nearest: where none is felt, the law that comes nearest to it; else ``None``.
    """

    row: LawRow | None
    rows: tuple[LawRow, ...]
    sound: bool
    textured: tuple[LawRow, ...]
    nearest: LawRow | None = None


def recommend(rows: Sequence[LawRow]) -> Recommendation:
    """Return which law to use.

    A law that is conservative and continuous gives no net energy on any closed path and no jump of
    force. Of those that are felt (else: borderline) the one with the strongest texture at the
    stiffness to begin with is recommended, of nearly equal ones the stiffest. Else, of the
    continuous laws that are felt (else: borderline), the one that leaks least for its texture
    force. What is not felt, and a law of which no stiffness is known to do, is never recommended.
    """
    textured = tuple(row for row in rows if row.felt is not None and not row.textureless)
    felt = [row for row in textured if row.tier == "felt"]
    borderline = [row for row in textured if row.tier == "borderline"]
    for some in (felt, borderline):
        sound = [row for row in some if not (row.leaks or row.jumps)]
        if sound:
            return Recommendation(_soundest(sound), tuple(rows), True, textured)
    for some in (felt, borderline):
        if some:
            best = min([row for row in some if not row.jumps] or some, key=_aliveness)
            return Recommendation(best, tuple(rows), False, textured)
    return Recommendation(None, tuple(rows), False, textured, _nearest(textured))


def _nearest(textured: Sequence[LawRow]) -> LawRow | None:
    """Return the law whose texture comes nearest to being felt, sound ones first."""
    sound = [row for row in textured if not (row.leaks or row.jumps)]
    return max(sound or textured, key=lambda row: row.shown_force, default=None)


def _soundest(sound: Sequence[LawRow]) -> LawRow:
    """Return the strongest law; of nearly equal ones the stiffest whose force jumps at no depth."""
    strongest = max(row.shown_force for row in sound)
    equal = [row for row in sound if row.shown_force >= NEARLY * strongest]
    return max(equal, key=lambda row: (row.surface.law.contact.single_valued, row.start))


def _aliveness(row: LawRow) -> float:
    """Leak at the stiffness to begin with, over texture force times length [1]."""
    return row.start_leak / (row.texture_force * row.leak.line.length)

"""From several devices and depths to one answer: on which of them is the texture felt?"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from asperity.analysis.row import LawRow
from asperity.analysis.words.felt import amount
from asperity.units import engineering

_NO_LAW = "no law"


@dataclass(frozen=True)
class Case:
    """A device and a depth, with what was found.

    Attributes:
        device: its name.
        max_depth: to which the surface is pressed [m].
        row: the law that is recommended, or comes nearest; ``None`` if none does.
        recommended: whether it is.
    """

    device: str
    max_depth: float
    row: LawRow | None
    recommended: bool

    @property
    def tier(self) -> str:
        """How well the texture is felt there."""
        return _NO_LAW if self.row is None or self.row.felt is None else self.row.felt.tier


def several_answer(cases: Sequence[Case], lacking: Sequence[str]) -> str:
    """Return where the texture comes out best, with which law, and in how many cases it is felt.

    Args:
        cases: what was compared.
        lacking: ids of devices of which too little is known.
    """
    recommended = [(one, one.row) for one in cases if one.recommended and one.row is not None]
    said = []
    if recommended:
        one, row = max(recommended, key=lambda case: (case[0].tier == "felt", case[1].shown_force))
        depth = engineering(one.max_depth, "m")
        said.append(f"Best on the {one.device}, pressed to {depth}: {_row_text(row)}.")
    if cases:
        found = Counter(one.tier for one in cases)
        order = ("felt", "borderline", "not felt", _NO_LAW)
        counts = [f"{tier} in {found[tier]}" for tier in order if found[tier]]
        said.append(f"Of {len(cases)} case{'s' * (len(cases) > 1)}: {', '.join(counts)}.")
    if lacking:
        said.append(f"No smooth wall is known to have held on {', '.join(lacking)}.")
    return " ".join(said)


def _row_text(row: LawRow) -> str:
    law = f"law {row.law.letter}" + (f" from {engineering(row.start, 'N/m')}" if row.start else "")
    return law if row.felt is None else f"{law}, {row.felt.tier}, {amount(row.felt)}"

"""AXB matching: which of two does the one between them equal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from asperity.studies.design import Answers, Presentation, Steps, StudyDesign
from asperity.studies.kinds.orders import list_pairs, repeated_order
from asperity.studies.statistics.intervals import share_interval
from asperity.studies.statistics.scores import Score, score_cells

ANSWERS = ("1", "3")


def run_axb(design: StudyDesign, participant: int, rng: np.random.Generator) -> Steps:
    """Yield A, X and B, where X equals A or B, as often either way as the repeats allow."""
    pairs, repeats = list_pairs(design), int(design.options["repeats"])
    kinds = [rng.permutation(np.arange(repeats) % 4) for _ in pairs]
    for repeat, index in repeated_order(len(pairs), repeats, participant):
        is_last, is_swapped = divmod(int(kinds[index][repeat]), 2)
        first, last = pairs[index][:: -1 if is_swapped else 1]
        shown = (first, last if is_last else first, last)
        yield Presentation(
            shown, ANSWERS, design.question, correct=ANSWERS[is_last], condition=index
        )


def label_pairs(design: StudyDesign) -> Sequence[dict[str, Any]]:
    """Return the pairs of conditions, which are what is estimated."""
    pairs = list_pairs(design)
    return [{key: f"{first[key]} / {last[key]}" for key in first} for first, last in pairs]


def score_axb(design: StudyDesign, answered: Answers) -> Score:
    """Return the shares of right matches of each pair of conditions."""
    cells = score_cells(
        answered, len(list_pairs(design)),
        lambda found: share_interval(sum(one.is_correct for one in found), len(found)),
    )  # fmt: skip
    return Score("share of right matches", *cells, interval="Wilson score", chance=0.5)

"""AXB matching: which of two does the one between them equal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from asperity.studies.design import Answered, Presentation, StudyDesign
from asperity.studies.kinds.comparison import list_pairs
from asperity.studies.kinds.latin_square import balanced_order
from asperity.studies.kinds.trial_list import TrialList
from asperity.studies.statistics.intervals import share_interval
from asperity.studies.statistics.scores import Score, collect_values, count_values

ANSWERS = ("1", "3")


def run_axb(design: StudyDesign, participant: int, rng: np.random.Generator) -> TrialList:
    """Return a run: A, X and B, where X equals A or B, as often either way as the repeats allow."""
    pairs, repeats = list_pairs(design), int(design.options["repeats"])
    kinds = np.array([rng.permutation(np.arange(repeats) % 4) for _ in pairs])
    trials = []
    for repeat in range(repeats):
        for index in balanced_order(len(pairs), participant * repeats + repeat):
            first, last = (design.conditions[one] for one in pairs[index])
            if kinds[index, repeat] % 2:
                first, last = last, first
            correct = ANSWERS[kinds[index, repeat] // 2]
            shown = (first, first if correct == ANSWERS[0] else last, last)
            trials.append(
                Presentation(shown, ANSWERS, design.question, correct=correct, condition=index)
            )
    return TrialList(trials)


def label_pairs(design: StudyDesign) -> Sequence[dict[str, Any]]:
    """Return the pairs of conditions, which are what is estimated."""
    found = []
    for pair in list_pairs(design):
        first, last = (design.conditions[one] for one in pair)
        found.append({key: f"{first[key]} / {last[key]}" for key in first})
    return found


def score_axb(
    design: StudyDesign, answered: Mapping[str, Sequence[Answered]], _resamples: int
) -> Score:
    """Return the shares of right matches of each pair of conditions."""
    columns = len(list_pairs(design))
    cells = collect_values(answered, columns, lambda one: one.is_correct)
    found = [[share_interval(int(sum(cell)), len(cell)) for cell in row] for row in cells]
    estimates = np.array(found, float).reshape(len(cells), columns, 3)
    estimates = np.moveaxis(estimates, 2, 0)
    return Score(
        "share of right matches", tuple(answered), estimates, count_values(cells, columns),
        interval="Wilson score", chance=0.5,
    )  # fmt: skip

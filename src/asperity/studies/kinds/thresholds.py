"""Thresholds: one of two or three intervals differs, and the participant says which."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.compiled import FloatArray
from asperity.core.errors import ParameterError
from asperity.studies.design import Answers, Presentation, Steps, StudyDesign, TrialRecord
from asperity.studies.kinds.orders import balanced_order
from asperity.studies.kinds.tracks import TRACKS
from asperity.studies.statistics.psychometric import LogLevels
from asperity.studies.statistics.scores import Score, score_cells

_MAX_INTERVALS = 3
_BASES = {"level": 0.0, "difference": 1.0}  # share of the reference


def log_levels(design: StudyDesign) -> LogLevels:
    """Return the logarithmic levels of a design of this kind with all its options.

    Levels are counted from zero, differences from the reference.

    Raises:
        ParameterError: for a range or a reference that cannot be used.
    """
    options = design.options
    (low, high) = design.range
    reference = float(options.get("reference", low))
    base = _BASES[options["scale"]] * reference
    if base >= low:
        words = "must be below the range, whose levels are discriminated from it"
        raise ParameterError("method.reference", words, reference)
    count = int(options["intervals"])
    if count > _MAX_INTERVALS:
        raise ParameterError("method.intervals", f"must be 2 or {_MAX_INTERVALS}", count)
    return LogLevels(low, high, reference, base, 1.0 / count, float(options["lapse"]))


def run_thresholds(design: StudyDesign, participant: int, rng: np.random.Generator) -> Steps:
    """Yield the trials of one condition after another, in the order of a balanced square."""
    levels = log_levels(design)
    options = design.options
    key = str(options["level"])
    count = int(options["intervals"])
    answers = tuple(str(one + 1) for one in range(count))
    for condition in balanced_order(len(design.conditions), participant):
        values = design.conditions[condition]
        track = TRACKS[options["procedure"]](levels, options)
        for place in rng.integers(count, size=int(options["trials"])):
            intervals: list[dict[str, Any]] = [{**values, key: levels.reference}] * count
            intervals[place] = {**values, key: levels.value(track.level())}
            right = answers[place]
            answer = yield Presentation(
                tuple(intervals), answers, design.question, correct=right, condition=condition
            )
            track.record(answer == right)


def level_answers(
    design: StudyDesign, trials: Sequence[TrialRecord]
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the level x of the interval that differs, and whether it was found, for each trial."""
    key = design.options["level"]
    shown = [one.presentation for one in trials]
    values = [float(one.intervals[int(one.correct or 1) - 1][key]) for one in shown]
    x = np.log(np.array(values) - log_levels(design).base)
    return x, np.array([one.is_correct for one in trials], bool)


def score_thresholds(design: StudyDesign, answered: Answers) -> Score:
    """Return the thresholds of each participant in each condition, as logarithms of levels."""
    levels = log_levels(design)
    cells = score_cells(
        answered, len(design.conditions),
        lambda found: levels.estimate_threshold(*level_answers(design, found)),
    )  # fmt: skip
    return Score(
        f"threshold of {design.options['level']}", *cells, is_logarithmic=True,
        interval="posterior of the psychometric function",
    )  # fmt: skip

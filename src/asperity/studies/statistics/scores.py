"""Scores: what a study estimates, for each participant and pooled."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.core.compiled import FloatArray
from asperity.studies.design import Answers, TrialRecord
from asperity.studies.statistics.intervals import LEAST_RESAMPLED, Interval, mean_interval

RESAMPLES = 2000
"""Number of samples of a bootstrap, unless stated otherwise."""


@dataclass(frozen=True)
class Score:
    """Estimates for each participant (row) and each condition or pair of conditions (column).

    Attributes:
        quantity: what is estimated.
        participants: codes of the participants.
        estimates: values, and lower and upper ends of the 95 % intervals of each participant, shape
            (3, participants, columns); those of a logarithmic quantity are natural logarithms.
        counts: numbers of answers.
        is_logarithmic: whether the values are logarithms.
        interval: how the intervals of each participant were found.
        pooled: values whose means are the pooled estimates, where they are not ``values``; they may
            be too skewed to be resampled, as where hardly any choice goes the other way.
        chance: of a share, its value without an effect.
    """

    quantity: str
    participants: tuple[str, ...]
    estimates: FloatArray
    counts: NDArray[np.int_]
    is_logarithmic: bool = False
    interval: str = ""
    pooled: FloatArray | None = None
    chance: float | None = None

    def pool(self, seed: int, resamples: int = RESAMPLES) -> list[Interval]:
        """Return the mean over the participants of each column, with its interval."""
        found = [self._pool(column, seed, resamples) for column in self._units.T]
        if self.chance is None:
            return found
        return [(mean, max(low, 0.0), min(high, 1.0)) for mean, low, high in found]  # shares

    def differences(self, seed: int, resamples: int = RESAMPLES) -> list[Interval]:
        """Return by how much each column but the first differs from the first.

        The differences are within participants. A column with a chance value is compared with it.
        """
        units = self._units
        if self.chance is not None:
            return [self._pool(column - self.chance, seed, resamples) for column in units.T]
        return [self._pool(column - units[:, 0], seed, resamples) for column in units.T[1:]]

    @property
    def values(self) -> FloatArray:
        """The estimates without their intervals."""
        result: FloatArray = self.estimates[0]
        return result

    @property
    def _units(self) -> FloatArray:
        return self.values if self.pooled is None else self.pooled

    def _pool(self, values: FloatArray, seed: int, resamples: int) -> Interval:
        known = values[np.isfinite(values)]
        return mean_interval(known, resamples if self.pooled is None else 0, seed)

    @property
    def pooled_interval(self) -> str:
        """How the pooled intervals are found."""
        if self.pooled is not None or len(self.participants) < LEAST_RESAMPLED:
            return "Student's t over participants"
        return f"studentised bootstrap over participants, {RESAMPLES} samples"

    def to_scale(self, values: FloatArray) -> FloatArray:
        """Return values on the scale of the quantity."""
        with np.errstate(over="ignore"):
            return np.asarray(np.exp(values) if self.is_logarithmic else values)


Cells = tuple[tuple[str, ...], FloatArray, NDArray[np.int_]]
"""Participants, their estimates, and numbers of answers, see :class:`Score`."""
_NOTHING = (math.nan, -math.inf, math.inf)


def score_cells(
    answered: Answers, columns: int, estimate: Callable[[Sequence[TrialRecord]], Interval]
) -> Cells:
    """Return an estimate from the answers of each participant to each condition.

    Args:
        answered: the answers.
        columns: number of conditions, or of their pairs.
        estimate: from one answer or more.
    """
    cells = [
        [[one for one in found if one.presentation.condition == i] for i in range(columns)]
        for found in answered.values()
    ]
    estimates = [[estimate(one) if one else _NOTHING for one in row] for row in cells]
    counts = np.array([[len(one) for one in row] for row in cells], int).reshape(-1, columns)
    return tuple(answered), np.array(estimates).reshape(-1, columns, 3).transpose(2, 0, 1), counts

"""Scores: what a study estimates, for each participant and pooled."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.core.compiled import FloatArray
from asperity.studies.design import Answered
from asperity.studies.statistics.intervals import LEAST_RESAMPLED, mean_interval

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
        pooled: values whose means are the pooled estimates, where they are not ``values``.
        chance: of a share, its value without an effect.
        is_resampled: whether pooled intervals are those of the bootstrap rather than Student's t.
    """

    quantity: str
    participants: tuple[str, ...]
    estimates: FloatArray
    counts: NDArray[np.int_]
    is_logarithmic: bool = False
    interval: str = ""
    pooled: FloatArray | None = None
    chance: float | None = None
    is_resampled: bool = True

    def pool(self, resamples: int, seed: int) -> list[tuple[float, float, float]]:
        """Return the mean over the participants of each column, with its interval."""
        found = [self._pool(column, resamples, seed) for column in self._units.T]
        if self.chance is None:
            return found
        return [(mean, max(low, 0.0), min(high, 1.0)) for mean, low, high in found]  # shares

    def differences(self, resamples: int, seed: int) -> list[tuple[float, float, float]]:
        """Return by how much each column but the first differs from the first.

        The differences are within participants. A column with a chance value is compared with it.
        """
        units = self._units
        if self.chance is not None:
            return [self._pool(column - self.chance, resamples, seed) for column in units.T]
        return [self._pool(column - units[:, 0], resamples, seed) for column in units.T[1:]]

    @property
    def values(self) -> FloatArray:
        """The estimates without their intervals."""
        result: FloatArray = self.estimates[0]
        return result

    @property
    def _units(self) -> FloatArray:
        return self.values if self.pooled is None else self.pooled

    def _pool(self, values: FloatArray, resamples: int, seed: int) -> tuple[float, float, float]:
        known = values[np.isfinite(values)]
        return mean_interval(known, resamples if self.is_resampled else 0, seed)

    def pooled_interval(self, resamples: int) -> str:
        """Return how the pooled intervals are found."""
        if not self.is_resampled or not resamples or len(self._units) < LEAST_RESAMPLED:
            return "Student's t over participants"
        return f"studentised bootstrap over participants, {resamples} samples"

    def to_scale(self, values: FloatArray) -> FloatArray:
        """Return values on the scale of the quantity."""
        with np.errstate(over="ignore"):
            return np.asarray(np.exp(values) if self.is_logarithmic else values)


Cells = list[list[list[float]]]
"""Values of each participant and column."""


def collect_values(
    answered: Mapping[str, Sequence[Answered]], columns: int, value: Callable[[Answered], float]
) -> Cells:
    """Return a value of each answer, by participant and condition."""
    return [
        [[value(one) for one in found if one.presentation.condition == i] for i in range(columns)]
        for found in answered.values()
    ]


def count_values(cells: Cells, columns: int) -> NDArray[np.int_]:
    """Return the numbers of values, shape (participants, columns)."""
    return np.array([[len(one) for one in row] for row in cells], int).reshape(-1, columns)


def repeated_score(
    cells: Cells, columns: int, resamples: int, seed: int
) -> tuple[FloatArray, NDArray[np.int_]]:
    """Return means with intervals, shape (3, participants, columns), and counts of repeated values.

    Args:
        cells: values of each participant and column.
        columns: number of columns.
        resamples: number of bootstrap samples.
        seed: of the samples.
    """
    found = [[mean_interval(np.array(one), resamples, seed) for one in row] for row in cells]
    estimates = np.array(found, float).reshape(-1, columns, 3)
    return np.moveaxis(estimates, 2, 0), count_values(cells, columns)

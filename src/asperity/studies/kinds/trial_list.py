"""Runs whose presentations are known beforehand, and what all runs share."""

from __future__ import annotations

import math
from collections.abc import Sequence

from asperity.core.errors import ParameterError, suggest_names
from asperity.studies.design import Presentation, StudyDesign


def check_answer(presentation: Presentation | None, answer: str) -> None:
    """Check that an answer is allowed.

    Raises:
        ParameterError: otherwise.
    """
    if presentation is None:
        raise ParameterError("answer", "comes after the end of the run", answer)
    if presentation.answers:
        if answer not in presentation.answers:
            hint = suggest_names(answer, presentation.answers)
            raise ParameterError("answer", f"is unknown: {answer!r}; {hint}")
        return
    low, high = presentation.range or (-math.inf, math.inf)
    try:
        is_within = low <= float(answer) <= high and math.isfinite(float(answer))
    except ValueError:
        is_within = False
    if not is_within:
        raise ParameterError("answer", f"must be a number from {low:.6g} to {high:.6g}", answer)


def check_conditions(design: StudyDesign, minimum: int) -> None:
    """Check that a design has enough conditions.

    Raises:
        ParameterError: otherwise.
    """
    if (count := len(design.conditions)) < minimum:
        words = f"must give at least {minimum} conditions for the method {design.kind}"
        raise ParameterError("vary", words, count)


class TrialList:
    """A run of presentations in a given order.

    Args:
        presentations: the presentations.
    """

    def __init__(self, presentations: Sequence[Presentation]) -> None:
        self._presentations, self._place = presentations, 0

    def next(self) -> Presentation | None:
        """Return what to present now; ``None`` at the end."""
        is_over = self._place == len(self._presentations)
        return None if is_over else self._presentations[self._place]

    def answer(self, answer: str) -> None:
        """Go on to the next presentation."""
        check_answer(self.next(), answer)
        self._place += 1


def parse_range(values: Sequence[float]) -> tuple[float, float]:
    """Return the ends of a range.

    Raises:
        ParameterError: unless there are two ascending values.
    """
    if len(values) != 2 or not values[0] < values[1]:
        raise ParameterError("method.range", "must be two ascending values", list(values))
    return float(values[0]), float(values[1])

"""What a study is: its design, orders, what is presented, the run of a method, and its trials."""

from __future__ import annotations

import itertools
import math
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from asperity.core.errors import ParameterError, find_named

SIMULATED_DEVICE = "device"
"""Mark of answers of people at a simulated device, who feel nothing."""


def describe_source(simulated: str) -> str:
    """Return whose answers are recorded, see :attr:`TrialRecord.simulated`.

    Example:
        >>> describe_source(""), describe_source("typical")
        ('people', 'simulated observers (typical)')
    """
    if not simulated:
        return "people"
    if simulated == SIMULATED_DEVICE:
        return "people at a simulated device"
    return f"simulated observers ({simulated})"


Values = Mapping[str, Any]
"""Values of varied keys of a scene [SI]: ``{"surface.law": "A", "texture.amplitude": 1e-4}``."""


@dataclass(frozen=True)
class Presentation:
    """What a participant is given in one trial.

    Attributes:
        intervals: the values of the varied keys in each interval, in the order in which they are
            presented.
        answers: allowed answers; empty where a number is asked for.
        question: the question that is shown.
        range: limits of the number that is asked for.
        adjusts: key whose value the participant changes within ``range``; empty for none.
        correct: the right answer; empty where there is none. It is never shown.
        condition: number of the condition, or of the pair of conditions, in its design.
    """

    intervals: tuple[Values, ...]
    answers: tuple[str, ...]
    question: str
    range: tuple[float, float] | None = None
    adjusts: str | None = None
    correct: str | None = None
    condition: int = 0


@dataclass(frozen=True)
class StudyDesign:
    """The design of a study.

    Attributes:
        kind: kind of the method.
        factors: the values [SI] of each varied key of the scene.
        options: options of the method [SI]; missing ones have their defaults.
        question: the question that participants answer.
        seed: seed of all random choices.
        participants: number of participants that are planned.
        unit: SI unit of the level of the method; empty for a pure number.
    """

    kind: str
    factors: Mapping[str, tuple[Any, ...]]
    options: Mapping[str, Any] = field(default_factory=dict)
    question: str = ""
    seed: int = 0
    participants: int = 1
    unit: str = ""

    @property
    def conditions(self) -> tuple[dict[str, Any], ...]:
        """All combinations of the values of the factors; the last factor varies fastest."""
        names = self.factors.keys()
        values = self.factors.values()
        return tuple([dict(zip(names, row, strict=True)) for row in itertools.product(*values)])

    def check_conditions(self, minimum: int) -> int:
        """Return the number of conditions.

        Raises:
            ParameterError: if it is below a minimum.
        """
        if (count := len(self.conditions)) < minimum:
            reason = f"must give at least {minimum} conditions for the method {self.kind}"
            raise ParameterError("vary", reason, count)
        return count

    @property
    def range(self) -> tuple[float, float]:
        """Ends of the range of the level [SI].

        Raises:
            ParameterError: unless they are two ascending values.
        """
        values = self.options["range"]
        if len(values) != 2 or not values[0] < values[1]:
            raise ParameterError("method.range", "must be two ascending values", list(values))
        return float(values[0]), float(values[1])


Steps = Generator[Presentation, str, None]
"""A method as a generator: it yields what to present, and receives the answer."""


class Method:
    """One run of a method by one participant; the same seed and answers give the same run.

    Args:
        steps: yields presentations, and receives their answers.
    """

    def __init__(self, steps: Steps) -> None:
        self._steps = steps
        self._now = next(steps, None)

    def next(self) -> Presentation | None:
        """Return what to present now, the same until it is answered; ``None`` at the end."""
        return self._now

    def answer(self, answer: str) -> None:
        """Record the answer to what is presented now.

        Args:
            answer: one of the allowed answers, or a number as text.

        Raises:
            ParameterError: for an answer that is not allowed, or after the end.
        """
        _check_answer(self._now, answer)
        try:
            self._now = self._steps.send(answer)
        except StopIteration:
            self._now = None


def _check_answer(presentation: Presentation | None, answer: str) -> None:
    if presentation is None:
        raise ParameterError("answer", "comes after the end of the run", answer)
    if presentation.answers:
        find_named("answer", answer, dict.fromkeys(presentation.answers))
        return
    low, high = presentation.range or (-math.inf, math.inf)
    try:
        is_within = low <= float(answer) <= high and math.isfinite(float(answer))
    except ValueError:
        is_within = False
    if not is_within:
        raise ParameterError("answer", f"must be a number from {low:.6g} to {high:.6g}", answer)


@dataclass(frozen=True)
class TrialRecord:
    """An answered trial.

    Attributes:
        presentation: what was presented.
        answer: as given.
        participant: code of the participant.
        run: number of the sitting, from 1.
        trial: number of the trial, from 1.
        response_time: from the question to the answer [s].
        started: start of the trial, ISO 8601.
        codes: of the stimuli, in place of their values.
        simulated: what was simulated: the name of the observer, or ``device``; empty for a person
            at a real device.
    """

    presentation: Presentation
    answer: str
    participant: str = ""
    run: int = 1
    trial: int = 1
    response_time: float = 0.0
    started: str = ""
    codes: Sequence[str] = ()
    simulated: str = ""

    @property
    def is_correct(self) -> bool:
        """Whether the answer is the right one."""
        return self.answer == self.presentation.correct


Answers = Mapping[str, Sequence[TrialRecord]]
"""Answered trials of each participant."""


def balanced_order(count: int, participant: int) -> list[int]:
    """Return the order of the conditions for a participant.

    The Williams design: participant i has the row (s₀ + i, s₁ + i, …) modulo n, with
    s = 0, n−1, 1, n−2, …. With n even, n participants have each condition once in each place and
    each ordered pair of neighbours once; with n odd, 2n participants do so twice, every second
    n of them in the reverse order.

    Args:
        count: number of conditions n, at least 1.
        participant: number of the participant, from 0.

    References:
        E. J. Williams: Experimental designs balanced for the estimation of residual effects of
        treatments. Australian Journal of Scientific Research A 2 (1949) 149–168.

    Example:
        >>> [balanced_order(4, participant) for participant in range(4)]
        [[0, 3, 1, 2], [1, 0, 2, 3], [2, 1, 3, 0], [3, 2, 0, 1]]
    """
    first = [place // 2 if place % 2 == 0 else count - (place + 1) // 2 for place in range(count)]
    order = [(condition + participant) % count for condition in first]
    is_reversed = count % 2 == 1 and participant // count % 2 == 1
    return order[::-1] if is_reversed else order


def repeated_order(count: int, repeats: int, participant: int) -> Iterator[tuple[int, int]]:
    """Yield repeat and condition: each repeat has all, in the next row of the balanced square."""
    for repeat in range(repeats):
        for condition in balanced_order(count, participant * repeats + repeat):
            yield repeat, condition


def list_pairs(design: StudyDesign) -> list[tuple[dict[str, object], dict[str, object]]]:
    """Return all pairs of conditions.

    Raises:
        ParameterError: for fewer than two conditions.
    """
    design.check_conditions(2)
    return list(itertools.combinations(design.conditions, 2))

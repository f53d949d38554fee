"""What a study is: its design, what is presented, and what a kind of method provides."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from asperity.core.arguments import Argument

if TYPE_CHECKING:
    from asperity.studies.statistics.scores import Score

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
    """

    kind: str
    factors: Mapping[str, tuple[Any, ...]]
    options: Mapping[str, Any] = field(default_factory=dict)
    question: str = ""
    seed: int = 0
    participants: int = 1

    @property
    def conditions(self) -> tuple[dict[str, Any], ...]:
        """All combinations of the values of the factors; the last factor varies fastest."""
        names, values = self.factors.keys(), self.factors.values()
        return tuple(dict(zip(names, one, strict=True)) for one in itertools.product(*values))


class Method(Protocol):
    """One run of a method by one participant; the same seed and answers give the same run."""

    def next(self) -> Presentation | None:
        """Return what to present now; ``None`` when the run is over.

        It is the same until :meth:`answer` is called.
        """

    def answer(self, answer: str) -> None:
        """Record the answer to what is presented now.

        Args:
            answer: one of the allowed answers, or a number as text.

        Raises:
            ParameterError: for an answer that is not allowed, or after the end.
        """


@dataclass(frozen=True)
class Answered:
    """A presentation with its answer, for the statistics.

    Attributes:
        presentation: what was presented.
        answer: the answer.
    """

    presentation: Presentation
    answer: str

    @property
    def is_correct(self) -> bool:
        """Whether the answer is the right one."""
        return self.answer == self.presentation.correct


@dataclass(frozen=True)
class MethodKind:
    """A kind of method.

    Attributes:
        name: name in study files.
        description: a short description.
        arguments: options; a unit "level" stands for that of the level.
        run: makes a run from a design with all options, the number of the participant and random
            numbers.
        label: names of what is estimated, such as conditions or their pairs.
        score: estimates from the answers of each participant and the number of bootstrap samples
            (without any there are no intervals); see
            :class:`~asperity.studies.statistics.scores.Score`.
        consistency: share of repeated questions that a participant answers alike; ``None`` where
            the method has no such share.
        has_function: whether the answers are those of a psychometric function of a level.
    """

    name: str
    description: str
    arguments: tuple[Argument, ...]
    run: Callable[[StudyDesign, int, np.random.Generator], Method]
    label: Callable[[StudyDesign], Sequence[dict[str, Any]]]
    score: Callable[[StudyDesign, Mapping[str, Sequence[Answered]], int], Score]
    consistency: Callable[[Sequence[Answered]], float | None] = lambda _answers: None
    has_function: bool = False

    def complete(self, design: StudyDesign) -> StudyDesign:
        """Return the design with the defaults of the options that it does not state.

        Raises:
            ParameterError: for a required option that is missing.
        """
        from dataclasses import replace

        from asperity.core.errors import ParameterError

        given = {one.name: one.default for one in self.arguments if one.default is not None}
        options = {**given, **design.options}
        for one in self.arguments:
            if one.required and one.name not in options:
                raise ParameterError(f"method.{one.name}", f"is missing: {one.description}")
        return replace(design, options=options)

    def make(self, design: StudyDesign, participant_number: int, seed: int) -> Method:
        """Return a run of the method.

        Args:
            design: the study.
            participant_number: number of the participant, from 0; it sets the order.
            seed: seed of the random choices.

        Raises:
            ParameterError: for options or factors that the method cannot use.
        """
        rng = np.random.default_rng([seed, participant_number])
        return self.run(self.complete(design), participant_number, rng)

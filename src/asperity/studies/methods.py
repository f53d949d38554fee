"""What a kind of method provides, the kinds by name, and the rules of exclusion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core.arguments import Argument, read_arguments
from asperity.studies import pairs
from asperity.studies.design import Answers, Method, Steps, StudyDesign, TrialRecord
from asperity.studies.numeric_answers import run_onset, run_rating, score_onset, score_rating
from asperity.studies.scores import Score
from asperity.studies.thresholds import run_thresholds, score_thresholds


@dataclass(frozen=True)
class MethodKind:
    """A kind of method.

    Attributes:
        name: name in study files.
        description: a short description.
        arguments: options; a unit "level" stands for that of the level.
        run: the method, from a design with all options, the number of the participant and random
            numbers.
        score: estimates from the answers; see
            :class:`~asperity.studies.scores.Score`.
        label: names of what is estimated: conditions, unless their pairs are.
        consistency: share of repeated questions that a participant answers alike; ``None`` where
            the method has no such share.
        has_function: whether the answers are those of a psychometric function of a level.
    """

    name: str
    description: str
    arguments: tuple[Argument, ...]
    run: Callable[[StudyDesign, int, np.random.Generator], Steps]
    score: Callable[[StudyDesign, Answers], Score]
    label: Callable[[StudyDesign], Sequence[dict[str, Any]]] = lambda design: design.conditions
    consistency: Callable[[Sequence[TrialRecord]], float | None] = lambda _answers: None
    has_function: bool = False

    def complete(self, design: StudyDesign) -> StudyDesign:
        """Return the design with the defaults of the options that it does not state."""
        defaults = {
            argument.name: argument.default
            for argument in self.arguments
            if argument.default is not None
        }
        return replace(design, options={**defaults, **design.options})

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
        return Method(self.run(self.complete(design), participant_number, rng))


_FILE = Path(__file__).with_suffix(".toml")


def _options(name: str) -> tuple[Argument, ...]:
    return tuple(read_arguments(_FILE, name).values())


_DETECTION = read_arguments(_FILE, "detection")
_DISCRIMINATION = {
    **_DETECTION,
    "reference": replace(_DETECTION["reference"], default_description="", required=True),
    "intervals": replace(_DETECTION["intervals"], default=3),
    "scale": replace(_DETECTION["scale"], default="difference"),
}

_KINDS = (
    MethodKind(
        "detection",
        "level from which one interval is told from others",
        tuple(_DETECTION.values()),
        run_thresholds,
        score_thresholds,
        has_function=True,
    ),
    MethodKind(
        "discrimination",
        "difference from which one interval is told from others",
        tuple(_DISCRIMINATION.values()),
        run_thresholds,
        score_thresholds,
        has_function=True,
    ),
    MethodKind(
        "comparison",
        "which of two feels more so; Bradley–Terry scores",
        _options("comparison"),
        pairs.run_comparison,
        pairs.score_comparison,
        consistency=pairs.pair_consistency,
    ),
    MethodKind(
        "rating",
        "magnitude estimation or a Likert scale",
        _options("rating"),
        run_rating,
        score_rating,
    ),
    MethodKind(
        "axb",
        "which of two the one between them equals",
        _options("axb"),
        pairs.run_axb,
        pairs.score_axb,
        pairs.label_pairs,
    ),
    MethodKind(
        "onset",
        "a value is raised until it begins, and lowered until it ends",
        _options("onset"),
        run_onset,
        score_onset,
    ),
)
METHODS: dict[str, MethodKind] = {kind.name: kind for kind in _KINDS}
"""The kinds of methods by name."""
EXCLUSIONS = _options("exclusion")
"""Rules by which trials and participants are excluded; they are stated before the study."""

"""What a kind of method provides, the kinds by name, and the rules of exclusion.

Pairs are two conditions, one of which feels more so, or three, one of which equals the third (AXB).
Choices give scores by the model of Bradley and Terry: the condition i is chosen over j with the
chance 1/(1 + exp(θⱼ − θᵢ)).

Answers that are numbers are ratings and onsets. Ratings are magnitude estimation with geometric
means, or Likert scales. An onset is adjusted by the method of limits, with the value in the hand of
the participant, who raises it until it begins, or lowers it until it ends.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import expit

from asperity.core.arguments import Argument, read_arguments
from asperity.core.compiled import FloatArray
from asperity.studies.design import (
    Answers,
    Method,
    Presentation,
    Steps,
    StudyDesign,
    TrialRecord,
    list_pairs,
    repeated_order,
)
from asperity.studies.scores import Interval, Score, mean_interval, score_cells, share_interval
from asperity.studies.thresholds import run_thresholds, score_thresholds

_NORMAL = 1.96  # quantile of the normal distribution
_SCORE_INTERVAL = "Fisher information; half a choice added either way where scores had no bounds"


def run_comparison(design: StudyDesign, participant: int, rng: np.random.Generator) -> Steps:
    """Yield every pair as often as stated, first in either place by turns."""
    pairs = list_pairs(design)
    repeats = int(design.options["repeats"])
    first = rng.integers(2, size=len(pairs))
    for repeat, index in repeated_order(len(pairs), repeats, participant):
        pair = pairs[index][:: -1 if (first[index] + repeat) % 2 else 1]
        yield Presentation(pair, ("1", "2"), design.question, condition=index)


def count_choices(design: StudyDesign, answered: Sequence[TrialRecord]) -> FloatArray:
    """Return how often each condition (row) was chosen over each other (column)."""
    conditions = design.conditions
    wins = np.zeros((len(conditions), len(conditions)))
    for trial in answered:
        first, second = trial.presentation.intervals
        chosen = conditions.index(dict(first))
        other = conditions.index(dict(second))
        if trial.answer == "2":
            chosen, other = other, chosen
        wins[chosen, other] += 1.0
    return wins


def score_comparison(design: StudyDesign, answered: Answers) -> Score:
    """Return the Bradley–Terry scores of the conditions.

    Those of a participant have half a choice either way added to each pair if the participant is
    too consistent for finite scores; their intervals are those of Fisher's information.
    """
    count = len(design.conditions)
    each = np.array([count_choices(design, trials) for trials in answered.values()])
    each = each.reshape(-1, count, count)
    fitted = [fit_scores(wins) for wins in each]
    values, errors = np.array(fitted).reshape(-1, 2, count).swapaxes(0, 1)
    estimates = np.array([values, values - _NORMAL * errors, values + _NORMAL * errors])
    counts = (each + each.swapaxes(1, 2)).sum(axis=2).astype(int)
    pooled = pseudo_values(each) if len(each) else values
    return Score(
        "Bradley–Terry score",
        tuple(answered),
        estimates,
        counts,
        interval=_SCORE_INTERVAL,
        pooled=pooled,
    )


def pair_consistency(answered: Sequence[TrialRecord]) -> float | None:
    """Return the share of repeated pairs that were answered alike; ``None`` without repeats."""
    chosen: dict[int, list[str]] = {}
    for trial in answered:
        values = trial.presentation.intervals[int(trial.answer) - 1]
        chosen.setdefault(trial.presentation.condition, []).append(str(sorted(values.items())))
    alike: list[bool] = []
    for choices in chosen.values():
        alike += [a == b for a, b in itertools.combinations(choices, 2)]
    return sum(alike) / len(alike) if alike else None


def run_axb(design: StudyDesign, participant: int, rng: np.random.Generator) -> Steps:
    """Yield A, X and B, where X equals A or B, as often either way as the repeats allow."""
    pairs = list_pairs(design)
    repeats = int(design.options["repeats"])
    kinds = [rng.permutation(np.arange(repeats) % 4) for _ in pairs]
    for repeat, index in repeated_order(len(pairs), repeats, participant):
        is_last, is_swapped = divmod(int(kinds[index][repeat]), 2)
        first, last = pairs[index][:: -1 if is_swapped else 1]
        shown = (first, last if is_last else first, last)
        right = "3" if is_last else "1"
        yield Presentation(shown, ("1", "3"), design.question, correct=right, condition=index)


def label_pairs(design: StudyDesign) -> Sequence[dict[str, Any]]:
    """Return the pairs of conditions, which are what is estimated."""
    pairs = list_pairs(design)
    return [{key: f"{first[key]} / {last[key]}" for key in first} for first, last in pairs]


def score_axb(design: StudyDesign, answered: Answers) -> Score:
    """Return the shares of right matches of each pair of conditions."""
    cells = score_cells(
        answered,
        len(list_pairs(design)),
        lambda trials: share_interval(sum([t.is_correct for t in trials]), len(trials)),
    )
    return Score("share of right matches", *cells, interval="Wilson score", chance=0.5)


_HALF_WIN = 0.5


def fit_scores(wins: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the scores θ of greatest likelihood, which sum to zero, and their standard errors.

    Where some conditions are never chosen over the others, no finite scores have the greatest
    likelihood; then half a choice either way is added to each pair. The errors are those of
    Fisher's information.

    Args:
        wins: how often each condition (row) was chosen over each other (column), shape (n, n).

    References:
        R. A. Bradley, M. E. Terry: Rank analysis of incomplete block designs. Biometrika 39 (1952)
        324–345; L. R. Ford: Solution of a ranking problem from binary comparisons. American
        Mathematical Monthly 64 (1957) 28–33.

    Example:
        >>> scores, errors = fit_scores(np.array([[0.0, 30.0], [10.0, 0.0]]))
        >>> f"{scores[0] - scores[1]:.4f}"  # ln 3
        '1.0986'
    """
    from scipy.optimize import minimize

    wins = complete_wins(wins)

    def loss(scores: FloatArray) -> tuple[float, FloatArray]:
        value = float((wins * np.logaddexp(0.0, scores - scores[:, None])).sum())
        return value + 0.5 * float(scores.sum()) ** 2, scores.sum() - gradient(wins, scores)

    solution = minimize(loss, np.zeros(len(wins)), jac=True, options={"gtol": 1e-9})
    scores: FloatArray = solution.x - solution.x.mean()
    return scores, np.sqrt(np.diag(covariance(wins, scores)))


def complete_wins(wins: FloatArray) -> FloatArray:
    """Return numbers of choices for which finite scores exist."""
    from scipy.sparse.csgraph import connected_components

    _parts, labels = connected_components(wins > 0.0, connection="strong")
    return wins + _HALF_WIN * (1.0 - np.eye(len(wins))) if labels.any() else wins


def gradient(wins: FloatArray, scores: FloatArray) -> FloatArray:
    """Return the derivative of the logarithm of the likelihood by each score."""
    losing = wins * expit(scores - scores[:, None])
    result: FloatArray = losing.sum(axis=1) - losing.sum(axis=0)
    return result


def covariance(wins: FloatArray, scores: FloatArray) -> FloatArray:
    """Return the covariance of the scores of greatest likelihood, from Fisher's information."""
    chance = expit(scores[:, None] - scores)
    weights = (wins + wins.T) * chance * (1.0 - chance)
    information = np.diag(weights.sum(axis=1)) - weights
    return np.asarray(np.linalg.pinv(information), float)


def pseudo_values(each: FloatArray) -> FloatArray:
    """Return a value of each score for each participant, whose means are the pooled scores.

    A participant's values are θ + N C gᵢ, with the derivative gᵢ of the logarithm of the likelihood
    of the participant's answers at the pooled scores θ of N participants, and their covariance C:
    the infinitesimal jackknife. Their spread is that of participants.

    Args:
        each: choices of each participant, shape (participants, n, n).
    """
    wins = complete_wins(each.sum(axis=0))
    scores, _ = fit_scores(wins)
    steps = np.array([gradient(choices, scores) for choices in each]) @ covariance(wins, scores)
    return np.asarray(scores + len(each) * (steps - steps.mean(axis=0)))


_LIMITS = (1e-6, 1e6)
_MEAN_INTERVAL = "Student's t over repeats"
LIKERT = "likert"  # scale


def run_rating(design: StudyDesign, participant: int, _rng: np.random.Generator) -> Steps:
    """Yield each condition in each repeat, in the next row of a balanced square."""
    points = range(int(design.options["points"]))
    is_likert = design.options["scale"] == LIKERT
    answers: tuple[str, ...] = ()
    limits: tuple[float, float] | None = _LIMITS
    if is_likert:
        answers = tuple([str(point + 1) for point in points])
        limits = None
    count = len(design.conditions)
    for _, condition in repeated_order(count, int(design.options["repeats"]), participant):
        intervals = (design.conditions[condition],)
        yield Presentation(intervals, answers, design.question, limits, condition=condition)


def score_rating(design: StudyDesign, answered: Answers) -> Score:
    """Return mean ratings: arithmetic ones of Likert scales, geometric ones of magnitudes.

    Magnitudes are shifted so that all participants have the same mean (equalised modulus).

    References:
        S. S. Stevens: Psychophysics (1975).
    """
    is_likert = design.options["scale"] == LIKERT
    transform: Callable[[float], float] = float if is_likert else math.log
    cells = score_cells(
        answered,
        len(design.conditions),
        lambda trials: mean_interval(np.array([transform(float(t.answer)) for t in trials])),
    )
    score = Score("rating" if is_likert else "magnitude", *cells, interval=_MEAN_INTERVAL)
    return score if is_likert else _equalise(score)


def _equalise(score: Score) -> Score:
    """Return logarithms of magnitudes, of which all participants have the same mean."""
    known = np.isfinite(score.values)
    means = np.where(known, score.values, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    shifts: FloatArray = means.mean() - means if len(means) else means
    return replace(score, estimates=score.estimates + shifts[:, None], is_logarithmic=True)


_JITTER = 0.25  # of the logarithmic range; a fixed way to the onset could be counted


def run_onset(design: StudyDesign, participant: int, rng: np.random.Generator) -> Steps:
    """Yield ascending and descending series by turns, from scattered ends of the range."""
    count = len(design.conditions)
    series = int(design.options["series"])
    (low, high) = design.range
    key = str(design.options["level"])
    away = (high / low) ** (_JITTER * rng.random((series, count)))
    for turn, condition in repeated_order(count, series, participant):
        is_ascending = (turn + participant) % 2 == 0
        distance = float(away[turn, condition])
        start = low * distance if is_ascending else high / distance
        values = {**design.conditions[condition], key: start}
        yield Presentation(
            (values,), (), design.question, (low, high), adjusts=key, condition=condition
        )


def score_onset(design: StudyDesign, answered: Answers) -> Score:
    """Return the geometric means over ascending and descending series, each with equal weight.

    The two differ systematically (habituation, anticipation), so the values of which the mean is
    taken are those of an ascending series and the descending one with it.
    """
    key = str(design.options["level"])
    middle = math.sqrt(math.prod(design.range))

    def estimate(trials: Sequence[TrialRecord]) -> Interval:
        onsets: tuple[list[float], list[float]] = ([], [])
        for trial in trials:
            is_descending = trial.presentation.intervals[0][key] > middle
            onsets[is_descending].append(math.log(float(trial.answer)))
        return mean_interval(np.array([(a + b) / 2.0 for a, b in zip(*onsets, strict=False)]))

    cells = score_cells(answered, len(design.conditions), estimate)
    interval = "Student's t over pairs of series"
    return Score(
        f"onset of {key}", *cells, is_logarithmic=True, interval=interval, unit=design.unit
    )


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
        run_comparison,
        score_comparison,
        consistency=pair_consistency,
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
        run_axb,
        score_axb,
        label_pairs,
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

"""Thresholds: one of two or three intervals differs, and the participant says which.

A track chooses the levels: the weighted staircase, or the Bayesian method. The threshold and its
interval are those of the posterior of a psychometric function: P(x) = γ + (1 − γ − λ)/(1 +
exp(−s (x − α))) is the share of right answers at the level x, the natural logarithm of an
increment. The threshold α is where the chance of knowing the answer is a half, apart from guesses γ
and lapses λ.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from asperity.core.compiled import FloatArray
from asperity.core.errors import ParameterError
from asperity.studies.design import (
    Answers,
    Presentation,
    Steps,
    StudyDesign,
    TrialRecord,
    balanced_order,
)
from asperity.studies.scores import Interval, Score, score_cells

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
        reason = "must be below the range, whose levels are discriminated from it"
        raise ParameterError("method.reference", reason, reference)
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
    answers = tuple([str(number + 1) for number in range(count)])
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
    values = []
    for presentation in [trial.presentation for trial in trials]:
        different = int(presentation.correct or 1) - 1
        values.append(float(presentation.intervals[different][key]))
    x = np.log(np.array(values) - log_levels(design).base)
    return x, np.array([trial.is_correct for trial in trials], bool)


def score_thresholds(design: StudyDesign, answered: Answers) -> Score:
    """Return the thresholds of each participant in each condition, as logarithms of levels."""
    levels = log_levels(design)
    cells = score_cells(
        answered,
        len(design.conditions),
        lambda trials: levels.estimate_threshold(*level_answers(design, trials)),
    )
    what = f"threshold of {design.options['level']}"
    if levels.base > 0.0:
        what = f"threshold of the increase of {design.options['level']} from the reference"
    return Score(
        what,
        *cells,
        is_logarithmic=True,
        interval="posterior of the psychometric function",
        limits=levels.ends,
        unit=design.unit,
    )


_FASTER = (4.0, 2.0, 2.0)  # multiples of the step before each of the first reversals
_THRESHOLDS = 101
_CANDIDATES = 51
_SLOPES = (-2.0, 3.0, 15)  # logarithm of the slope at the threshold: ends, number


class Staircase:
    """The weighted up-down staircase, which settles where a share p of the answers is right.

    A right answer lowers the level by a step s, a wrong one raises it by s p/(1 − p); where a
    share p is right, the level stays. Before the first reversals the steps are greater.

    Args:
        levels: the range, whose greatest level is the first, and the share of right guesses.
        step: s, in the unit of the levels.
        target: p; it must be above the share of right guesses.

    Raises:
        ParameterError: for a target that a guess reaches.

    References:
        C. Kaernbach: Simple adaptive testing with the weighted up-down method. Perception &
        Psychophysics 49 (1991) 227–229, https://doi.org/10.3758/BF03214307.

    Example:
        >>> track = Staircase(LogLevels(1.0, 10.0, 1.0, 0.0, 0.5, 0.0), step=0.1, target=0.75)
        >>> track.record(True)
        >>> f"{track.level():.3f}"  # ln 10 − 0.4
        '1.903'
    """

    def __init__(self, levels: LogLevels, step: float, target: float) -> None:
        if target <= levels.guess:
            reason = f"must be above {levels.guess:.3g}, the share of right answers of a guess"
            raise ParameterError("method.target", reason, target)
        self._low, self._high = levels.ends
        self._level = self._high
        self._down = step
        self._up = step * target / (1.0 - target)
        self._reversals = 0
        self._last = True

    def level(self) -> float:
        """Return the level to present now."""
        return self._level

    def record(self, correct: bool) -> None:
        """Move the level."""
        self._reversals += correct != self._last
        self._last = correct
        factor = _FASTER[self._reversals] if self._reversals < len(_FASTER) else 1.0
        moved = self._level + factor * (-self._down if correct else self._up)
        self._level = min(max(moved, self._low), self._high)


class BayesianTrack:
    """Levels after which the threshold is expected to be known best: the psi-marginal method.

    It is that of the library SweetSpot. The prior of the threshold is normal, centred in the range
    and half as wide; the slope is marginalised.

    Args:
        levels: the range, and the shares of guesses and lapses.

    Raises:
        ParameterError: if SweetSpot is not installed.

    References:
        N. Prins: The psi-marginal adaptive method. Journal of Vision 13 (2013) 7:3,
        https://doi.org/10.1167/13.7.3.
    """

    def __init__(self, levels: LogLevels) -> None:
        try:
            import SweetSpot as Library
        except ImportError:
            reason = "bayesian needs the library SweetSpot: pip install 'asperity[studies]'"
            raise ParameterError("method.procedure", reason) from None
        low, high = levels.ends
        function = Library.PsychometricFunction(gamma=levels.guess, lambda_=levels.lapse)
        function.Grid(alpha=(low, high, _THRESHOLDS), beta=_SLOPES)
        function.SetPrior(alpha=((low + high) / 2.0, (high - low) / 2.0), beta=(0.0, 1.0))
        candidates = np.linspace(low, high, _CANDIDATES)
        self.procedure = Library.PsiMarginal(
            pf=function, xCandidates=candidates, maxIterations=None, parameterOfInterest="alpha"
        )

    def level(self) -> float:
        """Return the level to present now."""
        return float(self.procedure.PendingValue())

    def record(self, correct: bool) -> None:
        """Update the posterior."""
        self.procedure.Observe(int(correct))


TRACKS: dict[str, Callable[[LogLevels, Mapping[str, Any]], Staircase | BayesianTrack]] = {
    "weighted-up-down": lambda levels, options: Staircase(
        levels, math.log(options["step"]), float(options["target"])
    ),
    "bayesian": lambda levels, _options: BayesianTrack(levels),
}
"""Procedures by name, from the levels and the options of the method."""


USUAL_SLOPE = 4.0
SLOPE_SPREAD = 0.7
"""Prior of the slope: median, and deviation of the logarithm."""
_POSTERIOR_SLOPES = np.geomspace(0.5, 32.0, 25)
_POSTERIOR_THRESHOLDS = 241
_QUANTILES = (0.5, 0.025, 0.975)


@dataclass(frozen=True)
class LogLevels:
    """The levels of a threshold, and what its psychometric function assumes.

    Attributes:
        low: lowest level [SI].
        high: highest level [SI].
        reference: level of the intervals that do not differ [SI].
        base: level from which increments are counted [SI].
        guess: γ.
        lapse: λ.
    """

    low: float
    high: float
    reference: float
    base: float
    guess: float
    lapse: float

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest x."""
        return math.log(self.low - self.base), math.log(self.high - self.base)

    def value(self, x: float) -> float:
        """Return the level [SI] of a logarithm, within the range."""
        return min(max(self.base + math.exp(x), self.low), self.high)

    def probability(
        self, x: FloatArray, threshold: FloatArray | float, slope: FloatArray | float
    ) -> FloatArray:
        """Return P(x)."""
        known: FloatArray = expit(slope * (x - threshold))
        return self.guess + (1.0 - self.guess - self.lapse) * known

    def posterior(
        self, x: FloatArray, right: NDArray[np.bool_]
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return thresholds α, slopes s, and the probability of each pair after the answers.

        Before them, α is as likely anywhere from half the range below its low end to half the range
        above its high end, and ln(s/4) is normal with deviation 0.7.

        Args:
            x: level of each trial.
            right: whether it was answered right.

        Returns:
            The probabilities have the shape (thresholds, slopes), and sum to one.
        """
        low, high = self.ends
        margin = (high - low) / 2.0
        thresholds = np.linspace(low - margin, high + margin, _POSTERIOR_THRESHOLDS)
        chance = self.probability(x[:, None, None], thresholds[:, None], _POSTERIOR_SLOPES)
        with np.errstate(divide="ignore"):  # without lapses a wrong answer may be impossible
            logarithm = np.log(np.where(right[:, None, None], chance, 1.0 - chance)).sum(axis=0)
        logarithm -= 0.5 * np.square(np.log(_POSTERIOR_SLOPES / USUAL_SLOPE) / SLOPE_SPREAD)
        share = np.exp(logarithm - logarithm.max())
        return thresholds, _POSTERIOR_SLOPES, share / share.sum()

    def estimate_threshold(self, x: FloatArray, right: NDArray[np.bool_]) -> Interval:
        """Return the median of the posterior of α, and its central 95 % interval.

        What lies outside the levels is infinite, since it follows from the prior: the median, an
        end on its own side. An end on the other side is the end of the levels.

        References:
            H. H. Schütt et al.: Painfree and accurate Bayesian estimation of psychometric functions
            for (potentially) overdispersed data. Vision Research 122 (2016) 105–123.

        Example:
            >>> levels = LogLevels(1.0, 100.0, 1.0, 0.0, guess=0.5, lapse=0.0)
            >>> x = np.log(np.repeat([5.0, 10.0, 20.0], 400))
            >>> right = np.arange(1200) % 400 < 400 * levels.probability(x, np.log(10.0), 4.0)
            >>> f"{np.exp(levels.estimate_threshold(x, right)[0]):.1f}"
            '10.0'
        """
        thresholds, _, pairs = self.posterior(x, right)
        share = pairs.sum(axis=1)
        below = np.cumsum(share) - 0.5 * share
        middle, low, high = np.interp(_QUANTILES, below, thresholds).tolist()
        lowest, highest = self.ends
        if not lowest < middle < highest:
            middle = math.copysign(math.inf, middle - lowest)
        low = min(low, highest) if low > lowest else -math.inf
        high = max(high, lowest) if high < highest else math.inf
        return middle, low, high

"""Statistics of studies: published scores, known thresholds, and intervals that hold the truth."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.studies.study_cases import answers, design_of

from asperity.studies.kinds.staircase import Staircase
from asperity.studies.statistics.bradley_terry import covariance, fit_scores, pseudo_values
from asperity.studies.statistics.intervals import mean_interval, share_interval
from asperity.studies.statistics.psychometric import (
    LogLevels,
    count_answers,
    fit_psychometric,
    fit_thresholds,
)

# American League 1987: games won (rows) against each other team (columns), in the order
# Milwaukee, Detroit, Toronto, New York, Boston, Cleveland, Baltimore; A. Agresti, Categorical Data
# Analysis, 2nd ed. (2002), table 10.10.
BASEBALL = np.array([
    [0, 7, 9, 7, 7, 9, 11], [6, 0, 7, 5, 11, 9, 9], [4, 6, 0, 7, 7, 8, 12], [6, 8, 6, 0, 6, 7, 10],
    [6, 2, 6, 7, 0, 7, 12], [4, 4, 5, 6, 6, 0, 6], [2, 4, 1, 3, 1, 7, 0],
], float)  # fmt: skip
# H. Turner, D. Firth: Bradley-Terry models in R, Journal of Statistical Software 48 (2012) 9:
# abilities less that of Baltimore, in the same order.
ABILITIES = [1.5814, 1.4364, 1.2945, 1.2476, 1.1077, 0.6839, 0.0]
LEVELS = LogLevels(1e-6, 1e-4, 1e-12, 0.0, guess=0.5, lapse=0.02)


def test_scores_are_those_published_for_baseball() -> None:
    scores = fit_scores(BASEBALL)
    assert scores - scores[-1] == pytest.approx(ABILITIES, abs=5e-5)
    spread = covariance(BASEBALL, scores)
    boston = math.sqrt(spread[4, 4] + spread[6, 6] - 2.0 * spread[4, 6])
    assert boston == pytest.approx(0.3339, abs=5e-5)  # the published standard error


def test_scores_follow_a_permutation_and_see_a_swapped_game() -> None:
    order = np.array([3, 1, 0, 2, 6, 5, 4])
    permuted = fit_scores(BASEBALL[np.ix_(order, order)])
    assert permuted == pytest.approx(fit_scores(BASEBALL)[order], abs=1e-6)
    swapped = BASEBALL.copy()
    swapped[0, 1], swapped[1, 0] = 6, 7
    assert abs(fit_scores(swapped) - fit_scores(BASEBALL)).max() > 0.01


def test_scores_without_a_maximum_stay_finite() -> None:
    scores = fit_scores(np.array([[0.0, 5.0, 5.0], [0.0, 0.0, 5.0], [0.0, 0.0, 0.0]]))
    assert scores[0] > scores[1] > scores[2]
    assert np.all(np.isfinite(scores))


def test_pseudo_values_have_the_mean_of_the_scores_and_the_spread_of_participants() -> None:
    each = np.random.default_rng(1).multinomial(1, BASEBALL.ravel() / BASEBALL.sum(), size=4000)
    each = each.reshape(-1, 7, 7).astype(float)
    scores, values = pseudo_values(each)
    assert values.mean(axis=0) == pytest.approx(scores, abs=1e-9)
    errors = values.std(axis=0, ddof=1) / math.sqrt(len(values))
    expected = np.sqrt(np.diag(covariance(each.sum(axis=0), scores)))
    assert errors == pytest.approx(expected, rel=0.1)  # independent games: no spread beside theirs


def test_a_staircase_settles_at_its_target() -> None:
    rng = np.random.default_rng(2)
    track = Staircase(math.log(1e-4), *LEVELS.ends, step=0.1, target=0.75, guess=0.5)
    right = []
    for _ in range(6000):
        chance = LEVELS.probability(np.array(track.level()), math.log(1e-5), 4.0)
        right.append(bool(rng.random() < chance))
        track.record(right[-1])
    assert np.mean(right[100:]) == pytest.approx(0.75, abs=0.02)


def known_thresholds(count: int, width: float = 1.0) -> int:
    """Return how many intervals, or parts of them, hold the threshold of simulated observers."""
    held = 0
    for seed in range(count):
        rng = np.random.default_rng([seed, 1])
        x = np.log(np.clip(1e-5 * np.exp(rng.normal(0.3, 0.7, 50)), 1e-6, 1e-4)).round(1)
        right = rng.random(50) < LEVELS.probability(x, math.log(1e-5), 4.0)
        middle, low, high = fit_thresholds(LEVELS, np.exp(x), right, 200, seed)
        ends = middle + width * (low - middle), middle + width * (high - middle)
        held += ends[0] <= math.log(1e-5) <= ends[1]
    return held


def test_intervals_of_thresholds_hold_them_and_narrower_ones_do_not() -> None:
    count = 120
    assert held_at_least(known_thresholds(count), count)
    assert not held_at_least(known_thresholds(count, width=0.5), count)


def held_at_least(held: int, count: int) -> bool:
    """Return whether so few would be held once in a thousand times at 95 %."""
    from scipy.stats import binom

    return bool(binom.cdf(held, count, 0.95) > 1e-3)


def test_fits_are_where_the_likelihood_is_greatest() -> None:
    rng = np.random.default_rng(4)
    x = rng.uniform(*LEVELS.ends, 400)
    right = rng.random(400) < LEVELS.probability(x, -11.0, 5.0)
    counts = count_answers(x, right)
    best = fit_psychometric(LEVELS, counts)

    def likelihood(threshold: float, slope: float) -> float:
        chance = LEVELS.probability(counts.x, threshold, slope)
        sum_ = counts.right @ np.log(chance) + (counts.total - counts.right) @ np.log1p(-chance)
        return float(sum_) - 0.5 * math.log(slope / 4.0) ** 2

    for step in ((0.01, 1.0), (-0.01, 1.0), (0.0, 1.02), (0.0, 0.98)):
        assert likelihood(*best) > likelihood(best[0] + step[0], best[1] * step[1])


def test_answers_that_say_nothing_give_unbounded_intervals() -> None:
    right = np.arange(40) % 2 == 0  # as of a guess
    values = np.geomspace(1e-6, 1e-4, 40)
    low, high = fit_thresholds(LEVELS, values, right, 200, 0)[1:]
    assert high == math.inf
    low, high = fit_thresholds(LEVELS, values, right | True, 200, 0)[1:]
    assert low == -math.inf
    assert high < math.log(1e-4)


@pytest.mark.parametrize("count", [5, 12])
def test_intervals_of_means_hold_them(count: int) -> None:
    rng, held, narrow = np.random.default_rng(8), 0, 0
    for seed in range(400):
        values = np.exp(0.3 * rng.standard_normal(count))
        mean, low, high = mean_interval(values, 400, seed)
        error = 1.96 * values.std() / math.sqrt(count)  # the normal distribution: too narrow
        held += low <= math.exp(0.045) <= high
        narrow += abs(mean - math.exp(0.045)) <= error
    assert held_at_least(held, 400)
    assert held < 400 * 0.985
    assert not held_at_least(narrow, 400)


def test_intervals_of_few_or_equal_values_are_unbounded() -> None:
    assert mean_interval(np.array([1.0, 2.0]), 100, 0) == (1.5, -math.inf, math.inf)
    assert mean_interval(np.full(12, 3.0), 100, 0) == (3.0, -math.inf, math.inf)
    assert math.isnan(mean_interval(np.array([]), 100, 0)[0])
    assert math.isnan(share_interval(0, 0)[0])


def test_thresholds_of_laws_come_out() -> None:
    from asperity.studies.methods import METHODS

    design = design_of("detection", trials=400)
    score = METHODS["detection"].score(design, {"P": answers(design)}, 0)
    assert np.exp(score.values[0]) == pytest.approx([5e-6, 1e-5, 1e-5, 1e-5], rel=0.2)
    design = design_of("discrimination", trials=400)
    score = METHODS["discrimination"].score(design, {"P": answers(design)}, 0)
    assert np.exp(score.values[0]) == pytest.approx([5e-6, 1e-5, 1e-5, 1e-5], rel=0.2)


def test_bayesian_thresholds_come_out() -> None:
    pytest.importorskip("SweetSpot")
    from asperity.studies.methods import METHODS

    design = design_of("detection", procedure="bayesian", trials=60)
    score = METHODS["detection"].score(design, {"P": answers(design)}, 0)
    assert np.exp(score.values[0]) == pytest.approx([5e-6, 1e-5, 1e-5, 1e-5], rel=0.5)
    assert score.values[0, 0] < score.values[0, 1:].min()

"""Statistics of studies: published scores, known thresholds, and intervals that hold the truth."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.studies.study_cases import AMPLITUDE, answers, design_of

from asperity.studies.methods import METHODS, covariance, fit_scores, pseudo_values
from asperity.studies.scores import Interval, Score, mean_interval
from asperity.studies.simulated_participants import Observer, simulate_run
from asperity.studies.thresholds import LogLevels, Staircase

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
    scores, _ = fit_scores(BASEBALL)
    assert scores - scores[-1] == pytest.approx(ABILITIES, abs=5e-5)
    spread = covariance(BASEBALL, scores)
    boston = math.sqrt(spread[4, 4] + spread[6, 6] - 2.0 * spread[4, 6])
    assert boston == pytest.approx(0.3339, abs=5e-5)  # the published standard error


def test_scores_follow_a_permutation_and_see_a_swapped_game() -> None:
    order = np.array([3, 1, 0, 2, 6, 5, 4])
    permuted = fit_scores(BASEBALL[np.ix_(order, order)])[0]
    scores = fit_scores(BASEBALL)[0]
    assert permuted == pytest.approx(scores[order], abs=1e-6)
    swapped = BASEBALL.copy()
    swapped[0, 1], swapped[1, 0] = 6, 7
    assert abs(fit_scores(swapped)[0] - scores).max() > 0.01


def test_scores_without_a_maximum_stay_finite() -> None:
    scores, _ = fit_scores(np.array([[0.0, 5.0, 5.0], [0.0, 0.0, 5.0], [0.0, 0.0, 0.0]]))
    assert scores[0] > scores[1] > scores[2]
    assert np.all(np.isfinite(scores))


def test_pseudo_values_have_the_mean_of_the_scores_and_the_spread_of_participants() -> None:
    each = np.random.default_rng(1).multinomial(1, BASEBALL.ravel() / BASEBALL.sum(), size=4000)
    each = each.reshape(-1, 7, 7).astype(float)
    scores, values = fit_scores(each.sum(axis=0))[0], pseudo_values(each)
    assert values.mean(axis=0) == pytest.approx(scores, abs=1e-9)
    errors = values.std(axis=0, ddof=1) / math.sqrt(len(values))
    expected = np.sqrt(np.diag(covariance(each.sum(axis=0), scores)))
    assert errors == pytest.approx(expected, rel=0.1)  # independent games: no spread beside theirs


def test_a_staircase_settles_at_its_target() -> None:
    rng = np.random.default_rng(2)
    track = Staircase(LEVELS, step=0.1, target=0.75)
    right = []
    for _ in range(6000):
        chance = LEVELS.probability(np.array(track.level()), math.log(1e-5), 4.0)
        right.append(bool(rng.random() < chance))
        track.record(right[-1])
    assert np.mean(right[100:]) == pytest.approx(0.75, abs=0.02)


def known_thresholds(count: int, *widths: float) -> list[int]:
    """Return for each width how many parts of intervals hold a simulated observer's threshold."""
    held = [0] * len(widths)
    for seed in range(count):
        rng = np.random.default_rng([seed, 1])
        x = np.log(np.clip(1e-5 * np.exp(rng.normal(0.3, 0.7, 50)), 1e-6, 1e-4))
        right = rng.random(50) < LEVELS.probability(x, math.log(1e-5), 4.0)
        middle, low, high = LEVELS.estimate_threshold(x, right)
        for number, width in enumerate(widths):
            ends = middle + width * (low - middle), middle + width * (high - middle)
            held[number] += ends[0] <= math.log(1e-5) <= ends[1]
    return held


def test_intervals_of_thresholds_hold_them_and_narrower_ones_do_not() -> None:
    count = 250
    whole, narrow = known_thresholds(count, 1.0, 0.5)
    assert held_at_least(whole, count)
    assert not held_at_least(narrow, count)


def held_at_least(held: int, count: int) -> bool:
    """Return whether so few would be held once in a thousand times at 95 %."""
    from scipy.stats import binom

    return bool(binom.cdf(held, count, 0.95) > 1e-3)


def test_the_posterior_is_prior_times_likelihood() -> None:
    rng = np.random.default_rng(4)
    x = rng.uniform(*LEVELS.ends, 30)
    right = rng.random(30) < LEVELS.probability(x, -11.0, 5.0)
    thresholds, slopes, share = LEVELS.posterior(x, right)
    assert share.sum() == pytest.approx(1.0, abs=1e-12)

    def logarithm(threshold: float, slope: float) -> float:
        total = -0.5 * (math.log(slope / 4.0) / 0.7) ** 2
        for one, is_right in zip(x, right, strict=True):
            chance = 0.5 + 0.48 / (1.0 + math.exp(-slope * (one - threshold)))
            total += math.log(chance if is_right else 1.0 - chance)
        return total

    first, second = (120, 10), (135, 14)
    expected = logarithm(thresholds[first[0]], slopes[first[1]]) - logarithm(
        thresholds[second[0]], slopes[second[1]]
    )
    assert math.log(share[first] / share[second]) == pytest.approx(expected, abs=1e-9)


def test_answers_that_say_nothing_give_unbounded_intervals() -> None:
    right = np.arange(40) % 2 == 0  # as of a guess
    x = np.linspace(*LEVELS.ends, 40)
    assert LEVELS.estimate_threshold(x, right)[2] == math.inf
    _, low, high = LEVELS.estimate_threshold(x, np.ones(40, bool))
    assert low == -math.inf
    assert high < math.log(1e-4)


def test_thresholds_outside_the_levels_are_no_numbers() -> None:
    lowest, highest = LEVELS.ends
    right = np.arange(40) % 2 == 0
    assert LEVELS.estimate_threshold(np.full(40, highest), right) == (math.inf, highest, math.inf)
    below = LEVELS.estimate_threshold(np.full(40, lowest), np.ones(40, bool))
    assert below == (-math.inf, -math.inf, lowest)


def test_a_wrong_answer_is_possible_without_lapses() -> None:
    levels = LogLevels(1e-6, 1e-4, 1e-12, 0.0, guess=0.5, lapse=0.0)
    x = np.linspace(*levels.ends, 20)
    assert math.isfinite(levels.estimate_threshold(x, x < x[-1])[2])


def pooled_thresholds(middle: float, seed: int, **observer: float) -> tuple[Interval, Interval]:
    """Return the pooled threshold and the ratio of two equal conditions, of six participants."""
    design = replace(design_of("detection", trials=20), factors={"surface.law": ("A", "C")})
    rng = np.random.default_rng(seed)
    answered = {}
    for number in range(6):
        person = Observer(**{"threshold": float(np.exp(0.3 * rng.standard_normal())), **observer})
        answered[str(number)] = simulate_run(
            design, number, person, lambda values: values[AMPLITUDE] / middle, seed
        )
    score = METHODS["detection"].score(design, answered)
    return score.pool(0)[0], score.differences(0)[0]


@pytest.mark.parametrize(
    ("middle", "observer"), [(1e-3, {}), (3e-7, {}), (1e-5, {"slope": 0.0, "lapse": 1.0})]
)
def test_pooled_thresholds_outside_the_levels_are_open(middle: float, observer: dict) -> None:
    for seed in range(5):
        (threshold, low, high), ratio = pooled_thresholds(middle, seed, **observer)
        assert not math.isfinite(threshold)
        assert low == -math.inf or (middle > 1e-6 and low <= math.log(1e-4))
        assert high == math.inf or (middle < 1e-6 and high >= math.log(1e-6))
        assert not math.isfinite(ratio[0])
        assert ratio[1:] == (-math.inf, math.inf)


def test_pooled_thresholds_within_the_levels_hold_the_truth() -> None:
    held = bounded = 0
    for seed in range(40):
        (_, low, high), (_, least, greatest) = pooled_thresholds(1e-5, seed)
        held += (low <= math.log(1e-5) <= high) + (least <= 0.0 <= greatest)
        bounded += math.isfinite(low) and math.isfinite(high)
    assert held_at_least(held, 80)
    assert bounded >= 24


def test_an_end_is_open_for_one_beyond_it_or_half_without_an_end() -> None:
    def pool(*people: Interval) -> Interval:
        estimates = np.array(people).T[:, :, None]
        counts = np.full((len(people), 1), 20)
        return Score("threshold", ("P",) * len(people), estimates, counts, limits=(-1.0, 1.0)).pool(
            0
        )[0]

    known = [(0.1 * number, -0.9, 0.9) for number in range(4)]
    mean, low, high = pool(*known)
    assert pool(*known[1:], (0.0, -0.9, math.inf)) == pytest.approx((mean, low, high))
    assert pool(*known[2:], (0.0, -0.9, math.inf), (0.1, -math.inf, math.inf)) == pytest.approx(
        (mean, low, math.inf)
    )
    mean, low, high = pool(*known, (math.inf, 0.9, math.inf))
    assert math.isnan(mean)
    assert low == pytest.approx(mean_interval(np.array([0.0, 0.1, 0.2, 0.3, 1.0]))[1])
    assert high == math.inf
    assert pool(*known, (math.nan, -math.inf, math.inf)) == pool(*known)  # gave no answers


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
    outside = mean_interval(np.array([1.0, 2.0, math.inf]), 100, 0)
    assert outside == (math.inf, -math.inf, math.inf)


def test_thresholds_of_laws_come_out() -> None:
    design = design_of("detection", trials=400)
    score = METHODS["detection"].score(design, {"P": answers(design)})
    assert np.exp(score.values[0]) == pytest.approx([5e-6, 1e-5, 1e-5, 1e-5], rel=0.2)
    design = design_of("discrimination", trials=400)
    score = METHODS["discrimination"].score(design, {"P": answers(design)})
    assert np.exp(score.values[0]) == pytest.approx([5e-6, 1e-5, 1e-5, 1e-5], rel=0.2)


def test_bayesian_thresholds_come_out() -> None:
    pytest.importorskip("SweetSpot", reason="not run: no SweetSpot here")
    design = design_of("detection", procedure="bayesian", trials=60)
    score = METHODS["detection"].score(design, {"P": answers(design)})
    assert np.exp(score.values[0]) == pytest.approx([5e-6, 1e-5, 1e-5, 1e-5], rel=0.5)
    assert score.values[0, 0] < score.values[0, 1:].min()

"""Do the intervals of studies hold the truth?

``python -m bench.stress.studies [COUNT]`` simulates that many studies (1000) of each method by
observers whose thresholds and scores are known, and prints the share of 95 % intervals that hold
them, apart for a participant and for the pooled value of twelve. A control whose intervals are half
as wide shows what the shares would be if the intervals were too narrow.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.studies.design import StudyDesign, Values
from asperity.studies.methods import METHODS
from asperity.studies.simulated_participants import Observer, simulate_run
from asperity.studies.thresholds import SLOPE_SPREAD, USUAL_SLOPE

COUNT, PARTICIPANTS, RESAMPLES, SPREAD = 1000, 12, 400, 0.3
LAWS = {"surface.law": ("A", "C", "D", "H")}
SCORES = np.array([0.0, 0.2, 0.4, 0.7])
KEY, LEVELS = "texture.amplitude", {"level": "texture.amplitude", "range": [1e-6, 1e-4]}
UNFELT = {**LEVELS, "reference": 1e-12}
Interval = tuple[float, float, float, float]
"""Truth, estimate and ends."""


def level_strength(values: Values) -> float:
    """Return the level over 10 µm: the threshold of an observer of threshold 1."""
    return float(values[KEY]) / 1e-5


def score_strength(values: Values) -> float:
    """Return the strength of a law."""
    return math.exp(SCORES[LAWS["surface.law"].index(values["surface.law"])])


def threshold_study(
    seed: int, own: Mapping[str, float] | None = None, **options: object
) -> Iterator[Interval]:
    """Yield the threshold of one participant, whose slope is drawn from its prior unless given."""
    rng = np.random.default_rng([seed, 9])
    threshold, slope = np.exp(rng.normal((0.0, math.log(USUAL_SLOPE)), (0.5, SLOPE_SPREAD)))
    observer = Observer(**{"threshold": float(threshold), "slope": float(slope), **(own or {})})
    kind = METHODS["detection"]
    design = StudyDesign("detection", {}, {**UNFELT, **options}, seed=seed)
    design = kind.complete(design)
    answered = simulate_run(design, 0, observer, level_strength, seed)
    estimate, low, high = (float(x) for x in kind.score(design, {"P": answered}).estimates[:, 0, 0])
    yield math.log(1e-5 * observer.threshold), estimate, low, high


def pooled_study(kind_name: str, seed: int, **options: object) -> Iterator[Interval]:
    """Yield the pooled scores of twelve participants that differ, and their differences."""
    kind, rng = METHODS[kind_name], np.random.default_rng([seed, 9])
    factors = {} if "level" in options else LAWS
    design = kind.complete(StudyDesign(kind_name, factors, options, seed=seed))
    answered = {}
    for number in range(PARTICIPANTS):
        observer = Observer(float(np.exp(SPREAD * rng.standard_normal())), slope=2.0)
        strength = level_strength if "level" in options else score_strength
        answered[str(number)] = simulate_run(design, number, observer, strength, seed)
    score = kind.score(design, answered)
    yield from TRUTHS[kind_name](score.differences(seed, RESAMPLES), score.pool(seed, RESAMPLES))


def _score_differences(
    factor: float, differences: list[tuple[float, float, float]], _pooled: object
) -> list[Interval]:
    truth = factor * (SCORES[1:] - SCORES[0])
    return [(float(a), *b) for a, b in zip(truth, differences, strict=True)]


def _onset(_differences: object, pooled: list[tuple[float, float, float]]) -> list[Interval]:
    return [(math.log(1e-5), *pooled[0])]


def _axb(_differences: object, pooled: list[tuple[float, float, float]]) -> list[Interval]:
    # A and C: the chance of a participant whose threshold is that of the middle, over the spread.
    difference = math.exp(SCORES[1]) - math.exp(SCORES[0])
    nodes, weights = np.polynomial.hermite_e.hermegauss(40)
    known = 1.0 / (1.0 + np.exp(-2.0 * (math.log(difference) - SPREAD * nodes)))
    mean = float(weights @ known / weights.sum())
    return [(0.5 + (0.5 - 0.02) * mean, *pooled[0])]


TRUTHS: dict[str, Callable[..., list[Interval]]] = {
    "comparison": partial(_score_differences, 2.0),
    "rating": partial(_score_differences, 1.0),
    "onset": _onset,
    "axb": _axb,
    "detection": _onset,
}
STUDIES: dict[str, Callable[[int], Iterator[Interval]]] = {
    "staircase, 2 intervals": threshold_study,
    "staircase, 3 intervals": lambda seed: threshold_study(seed, intervals=3),
    "staircase, slopes of 2": lambda seed: threshold_study(seed, {"slope": 2.0}),
    "staircase, slopes of 8": lambda seed: threshold_study(seed, {"slope": 8.0}),
    "staircase, 7.5 % wrong": lambda seed: threshold_study(seed, {"lapse": 0.15}),
    "staircase, low threshold": lambda seed: threshold_study(seed, {"threshold": 0.12}),
    "comparison, differences": lambda seed: pooled_study("comparison", seed),
    "rating, ratios": lambda seed: pooled_study("rating", seed),
    "onset, pooled": lambda seed: pooled_study("onset", seed, **LEVELS),
    "AXB, pooled": lambda seed: pooled_study("axb", seed, repeats=8),
    "Bayesian, 2 intervals": lambda seed: threshold_study(seed, procedure="bayesian"),
}
"""Simulated studies of each method."""


def coverage(study: Callable[[int], Iterator[Interval]], count: int) -> tuple[float, float, int]:
    """Return the shares of intervals, and of halved intervals, that hold the truth."""
    found = np.array([one for seed in range(count) for one in study(seed)])
    truth, estimate, low, high = found.T
    held = (low <= truth) & (truth <= high)
    estimate = np.where(np.isfinite(estimate), estimate, np.where(estimate < 0.0, high, low))
    halved = (truth >= (low + estimate) / 2.0) & (truth <= (high + estimate) / 2.0)
    return float(held.mean()), float(halved.mean()), len(found)


def run(console: Console, count: int = COUNT) -> None:
    headings = ("method", "in 95 % intervals", "halved", "intervals", "s")
    table = Table(*headings, title=f"{count} studies")
    for name, study in STUDIES.items():
        start = time.perf_counter()
        held, halved, total = coverage(study, count)
        seconds = f"{time.perf_counter() - start:.0f}"
        table.add_row(name, f"{100 * held:.1f} %", f"{100 * halved:.1f} %", str(total), seconds)
        console.print(name, f"{100 * held:.1f} %")
    console.print(table)


def main() -> None:
    run(Console(), int(sys.argv[1]) if len(sys.argv) > 1 else COUNT)


if __name__ == "__main__":
    main()

"""Section II.B: the six limits, each by what it means and by whether units can change it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from asperity.analysis.gain.characteristic import characteristic_number
from asperity.checks import FloatArray
from asperity.paper.claim import Check, decide, judges, settle
from asperity.paper.plane import SCANNING, random_settings

# Exponents of metre, second and newton.
_UNITS: dict[str, tuple[int, int, int]] = {
    "v": (1, -1, 0),
    "T": (0, 1, 0),
    "l": (1, 0, 0),
    "delta": (1, 0, 0),
    "b": (0, 0, 1),
    "force": (0, 0, 1),
    "A": (1, 0, 0),
    "stiffest": (-1, 0, 1),
    "k": (-1, 0, 1),
    "resonance": (0, -1, 0),
    "alpha": (0, 0, 0),
    "beta": (0, 0, 0),
    "gamma": (0, 0, 0),
    "q": (0, 0, 0),
}
Values = Mapping[str, float]
Sides = Callable[[Values], tuple[float, float]]
_CASES = 400


def same_in_all_units(sides: Sides, seed: int) -> float:
    """Return the share of random cases in which an inequality says the same in other units."""
    draw = np.random.default_rng(seed)
    same = 0
    for _ in range(_CASES):
        values = {name: float(10.0 ** draw.uniform(-2.0, 2.0)) for name in _UNITS}
        scale = 10.0 ** draw.uniform(-3.0, 3.0, 3)
        other = {
            name: value * float(np.prod(scale ** np.array(_UNITS[name])))
            for name, value in values.items()
        }
        left, right = sides(values)
        other_left, other_right = sides(other)
        same += (left < right) == (other_left < other_right)
    return same / _CASES


def _units(printed: Sides, corrected: Sides | None = None, correction: str = "") -> Check:
    """Judge whether an inequality is one between quantities of one dimension."""
    share = same_in_all_units(printed, 1)
    right = None if corrected is None else same_in_all_units(corrected, 1)
    tail = "" if right is None or share == 1.0 else f", corrected in {right:.2f}"
    return decide(
        f"says the same in other units in {share:.2f} of {_CASES} cases{tail}",
        printed=share == 1.0,
        corrected=None if right is None else right == 1.0,
        correction=correction,
        share_as_printed=share,
    )


def _fewest(step: float, length: float) -> int:
    """Return how many points of a grid lie at least in a half-open window of a length."""
    starts = step * (np.arange(200) + 0.5) / 200
    grid = step * np.arange(math.ceil(2.0 * length / step) + 3)
    inside = (grid >= starts[:, None]) & (grid < starts[:, None] + length)
    return int(inside.sum(axis=1).min())


# The six as printed, left and right.
PRINTED: dict[int, Sides] = {
    1: lambda v: (v["alpha"] * v["v"] * v["T"] / v["l"], 1.0),
    2: lambda v: (v["beta"] * v["delta"] / v["l"], 1.0),
    3: lambda v: (v["alpha"] * v["delta"] / v["l"], 1.0),
    4: lambda v: (v["gamma"] * v["b"] / v["l"], v["force"]),
    5: lambda v: (2.0 * math.pi * v["A"] / v["l"], v["stiffest"]),
    6: lambda v: (v["v"] / v["l"], v["resonance"]),
}
CORRECTED: dict[int, Sides] = {
    4: lambda v: (v["gamma"] * v["b"], v["force"]),
    5: lambda v: (v["q"] * v["k"], v["stiffest"]),
}


def _counts(
    sides: Sides, what: str, step: Callable[[Values], float], over: str, seed: int
) -> Check:
    """Judge that an inequality holds exactly if every window holds as many points as wanted.

    The points are ``step`` apart, the window is the value named ``over``.
    """
    draw = np.random.default_rng(seed)
    wrong = 0
    for _ in range(200):
        wanted = int(draw.integers(5, 11))
        values = {name: float(draw.uniform(0.5, 2.0)) for name in _UNITS}
        values |= {"alpha": wanted, "beta": wanted, "gamma": wanted}
        values[over] = step(values) * float(draw.uniform(3.0, 14.0))
        left, right = sides(values)
        wrong += (left < right) != (_fewest(step(values), values[over]) >= wanted)
    return decide(
        f"wrong about whether there are enough {what} in {wrong} of 200 random cases",
        printed=wrong == 0,
        wrong_cases=float(wrong),
    )


@judges("limit-1", "II.B", "Limit 1")
def limit_1() -> Check:
    """Scanning velocity: α v T/l < 1.

    Samples in time.
    """
    counted = _counts(PRINTED[1], "samples in a wave", lambda v: v["v"] * v["T"], "l", 2)
    return settle(counted, _units(PRINTED[1]))


@judges("limit-2", "II.B", "Limit 2")
def limit_2() -> Check:
    """Low speed reconstruction: β δ/l < 1.

    Steps of position.
    """
    counted = _counts(PRINTED[2], "steps of position in a wave", lambda v: v["delta"], "l", 3)
    return settle(counted, _units(PRINTED[2]))


@judges("limit-3", "II.B", "Limit 3")
def limit_3() -> Check:
    """High speed reconstruction: α δ/l < 1, one more limit.

    The same with α: does it ever decide what limit 2 does not?
    """
    draw, alone, merged, count = np.random.default_rng(4), 0, 0, 4000
    for _ in range(count):
        values = {name: float(10.0 ** draw.uniform(-2.0, 1.0)) for name in _UNITS}
        second, third = (left < right for left, right in (PRINTED[n](values) for n in (2, 3)))
        greater = max(values["alpha"], values["beta"])
        merged += (second and third) == (greater * values["delta"] < values["l"])
        values["beta"] = values["alpha"]
        second, third = (left < right for left, right in (PRINTED[n](values) for n in (2, 3)))
        alone += second != third
    return settle(
        _counts(PRINTED[3], "steps of position in a wave", lambda v: v["delta"], "l", 5),
        decide(
            f"with α = β it says something else than limit 2 in {alone} of {count} random cases",
            printed=alone > 0,
            corrected=merged == count,
            correction="2 and 3 are one condition: max(α, β) δ < l",
            cases_in_which_they_differ=float(alone),
        ),
    )


@judges("limit-4", "II.B", "Limit 4")
def limit_4() -> Check:
    """Force reconstruction: γ b/l < A.

    Steps of force.
    """
    return settle(
        _counts(CORRECTED[4], "steps of force in an amplitude (corrected)", lambda v: v["b"],
                "force", 6),
        _units(PRINTED[4], CORRECTED[4],
               "γ b < A_F, the amplitude of the force: the length has no place in it"),
    )  # fmt: skip


@judges("limit-5", "II.B", "Limit 5")
def limit_5() -> Check:
    """Gain: 2πA/l < A₀.

    What the greatest slope of the force of every law is.
    """
    draw, case = np.random.default_rng(8), SCANNING
    worst, best = 0.0, math.inf
    for law in "ABCEG":
        surface = case.surface(law)
        q = characteristic_number(surface)
        if q.at is None:
            continue
        start = _inside(law, draw, 4000)
        small = np.array(q.at) - [0.0, 0.0, 1e-8] + 1e-9 * draw.normal(size=(500, 3)) * [1, 0, 1]
        pairs = np.concatenate([start, np.stack([small[:250], small[250:]])], axis=1)
        forces = [surface.force(points) for points in pairs]
        apart = np.linalg.norm(pairs[1] - pairs[0], axis=1)
        ratio = np.linalg.norm(forces[1] - forces[0], axis=1) / apart / (case.stiffness * q.value)
        worst, best = max(worst, float(ratio.max())), min(best, float(ratio.max()))
    return settle(
        _units(
            PRINTED[5],
            CORRECTED[5],
            "q k <= K₀, the stiffest smooth wall; for A q is close to 2πA/l",
        ),
        decide(
            "the greatest difference of forces of 4250 pairs of probes is, for A, B, C, E, G, "
            f"{best:.6f} to {worst:.6f} q k per length",
            printed=worst <= 1.0 + 1e-6 and best > 0.97,
            greatest_share=worst,
            least_share=best,
        ),
    )


def _inside(law: str, draw: np.random.Generator, count: int) -> FloatArray:
    """Return pairs of probes no deeper than max_depth at either end of short steps, (2, n, 3)."""
    case = SCANNING
    x = draw.uniform(0.0, case.period, count)
    top = case.texture.height(np.column_stack([x, 0 * x])) if law in "ABC" else 0.0 * x
    depth = case.depth * draw.uniform(0.1, 0.9, count)
    if law == "E":
        depth = depth + case.amplitude
    points = np.column_stack([x, 0 * x, top - depth])
    step = case.depth * 1e-3 * draw.normal(size=(count, 3)) * [1, 0, 1]
    return np.stack([points, points + step])


@judges("limit-6", "II.B", "Limit 6")
def limit_6() -> Check:
    """Structure of the device: v/l < F₀.

    The frequency of the force while scanning.
    """
    worst = 0.0
    for case in random_settings(4, 17):
        surface, v = case.surface("C"), 0.07
        period = case.period / v
        time = np.arange(4096) * period * 16 / 4096
        depth = case.amplitude * 1.5
        path = np.column_stack([v * time, 0 * time, np.full(len(time), -depth)])
        for axis in (0, 2):
            force = surface.force(path)[:, axis]
            found = np.abs(np.fft.rfft(force - force.mean()))
            frequency = float(np.argmax(found)) / (period * 16)
            worst = max(worst, abs(frequency * case.period / v - 1.0))
    return settle(
        decide(
            f"the force of C scanned at v is loudest at v/l within {worst:.1e}",
            printed=worst < 1e-9,
            error=worst,
        ),
        _units(PRINTED[6]),
    )

"""Section II.B: the six limits, each by what it means and by whether units can change it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from asperity.checks import FloatArray
from asperity.paper.changes import FORCES, Change, other
from asperity.paper.claim import Check, decide, judges, settle
from asperity.paper.comparisons import steepest_pairs
from asperity.paper.plane import random_settings
from asperity.surface import Surface
from asperity.textures.sinusoid import Sinusoid

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
_SCANS = 100


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


def printing(says: str, number: int, sides: Sides) -> Change:
    """Another inequality in the place of a printed one."""
    return other(says, "PRINTED", lambda was: was | {number: sides})


def held_error(shift: float, length: float, *, reads: bool) -> float:
    """Return how wrong the force of A is along a wave that it gets in steps [1].

    Of its RMS variation. The probe goes at half the greatest depth of a texture with a period of
    that length; the force is held from step to step, or computed where an encoder reads the
    position.
    """
    surface = Surface(Sinusoid(0.1 * length, length), "A", max_depth=length)
    x = np.linspace(0.0, 40.0 * length, 8001)[1:-1]
    at = shift * (np.floor(x / shift + 0.5) if reads else np.floor(x / shift))

    def force(places: FloatArray) -> FloatArray:
        points = np.column_stack([places, 0 * x, np.full(len(x), -0.5 * length)])
        return surface.force(points)[:, 2]

    return float(np.std(force(at) - force(x)) / np.std(force(x)))


def _reconstructs(
    sides: Sides, what: str, step: Callable[[Values], float], seed: int, *, reads: bool
) -> Check:
    """Judge that an inequality holds exactly where the kernel's force is reconstructed well enough.

    Well enough: with less error than from as many samples in a wave as are wanted.
    """
    draw, wrong = np.random.default_rng(seed), 0
    for _ in range(_SCANS):
        wanted = float(draw.uniform(5.0, 10.0))
        values = {name: float(draw.uniform(0.5, 2.0)) for name in _UNITS}
        values |= {"alpha": wanted, "beta": wanted}
        values["l"] = step(values) * wanted * float(draw.choice([0.95, 1.05]))
        enough = held_error(1.0 / wanted, 1.0, reads=reads)
        good = held_error(step(values), values["l"], reads=reads) < enough
        left, right = sides(values)
        wrong += (left < right) != good
    return decide(
        f"wrong about whether the force of A is known better than from as many {what} as wanted in "
        f"{wrong} of {_SCANS} random scans",
        printed=wrong == 0,
        wrong_scans=float(wrong),
    )


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


@judges(
    "limit-1",
    "II.B",
    "Limit 1",
    flipped_by=printing(
        "½ α v T/l < 1", 1, lambda v: (0.5 * v["alpha"] * v["v"] * v["T"] / v["l"], 1.0)
    ),
)
def limit_1() -> Check:
    """Scanning velocity: α v T/l < 1.

    A force that is held from update to update.
    """
    step = lambda v: v["v"] * v["T"]  # noqa: E731 - one
    held = _reconstructs(PRINTED[1], "updates in a wave", step, 2, reads=False)
    return settle(held, _units(PRINTED[1]))


@judges(
    "limit-2",
    "II.B",
    "Limit 2",
    flipped_by=printing("½ β δ/l < 1", 2, lambda v: (0.5 * v["beta"] * v["delta"] / v["l"], 1.0)),
)
def limit_2() -> Check:
    """Low speed reconstruction: β δ/l < 1.

    A force computed where an encoder reads the position.
    """
    read = _reconstructs(
        PRINTED[2], "steps of position in a wave", lambda v: v["delta"], 3, reads=True
    )
    return settle(read, _units(PRINTED[2]))


@judges(
    "limit-3",
    "II.B",
    "Limit 3",
    flipped_by=printing(
        "α (δ + v T)/l < 1",
        3,
        lambda v: (v["alpha"] * (v["delta"] + v["v"] * v["T"]) / v["l"], 1.0),
    ),
)
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


@judges("limit-4", "II.B", "Limit 4", flipped_by=printing("γ b < A", 4, CORRECTED[4]))
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


@judges("limit-5", "II.B", "Limit 5", flipped_by=FORCES)
def limit_5() -> Check:
    """Gain: 2πA/l < A₀.

    What the greatest slope of the force of every law is.
    """
    shares = steepest_pairs(8)
    best, worst = min(shares.values()), max(shares.values())
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
            numbers={f"greatest share for {law}": share for law, share in shares.items()},
        ),
    )


@judges(
    "limit-6",
    "II.B",
    "Limit 6",
    flipped_by=printing("v l < F₀", 6, lambda v: (v["v"] * v["l"], v["resonance"])),
)
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

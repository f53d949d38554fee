"""Section II.B: the six limits, checked by their meaning and by their dimensions."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from asperity.analysis.gain.characteristic import characteristic_number
from asperity.core.checks import FloatArray
from asperity.paper.cases import SCANNING, random_settings
from asperity.paper.claim import Check, check_statement, combine_checks
from asperity.paper.formula_checks import max_difference_quotient
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

_PER_SECOND = (0, -1, 0)
_LENGTH = (1, 0, 0)
_FORCE = (0, 0, 1)
_STIFFNESS = (-1, 0, 1)
_NUMBER = (0, 0, 0)
# Exponents of metre, second and newton of the quantities in the limits.
_DIMENSIONS = {
    "v": (1, -1, 0),
    "T": (0, 1, 0),
    "l": _LENGTH,
    "delta": _LENGTH,
    "b": _FORCE,
    "force": _FORCE,
    "A": _LENGTH,
    "stiffest": _STIFFNESS,
    "k": _STIFFNESS,
    "resonance": _PER_SECOND,
    "alpha": _NUMBER,
    "beta": _NUMBER,
    "gamma": _NUMBER,
    "q": _NUMBER,
}
Quantities = Mapping[str, float]
Inequality = Callable[[Quantities], tuple[float, float]]
_CASES = 400


def _holds(inequality: Inequality, values: Quantities) -> bool:
    left, right = inequality(values)
    return left < right


def unit_invariant_share(inequality: Inequality, seed: int) -> float:
    """Return the share of random cases in which a change of units leaves an inequality as it is."""
    draw = np.random.default_rng(seed)
    same = 0
    for _ in range(_CASES):
        values = {name: float(10.0 ** draw.uniform(-2.0, 2.0)) for name in _DIMENSIONS}
        scale = 10.0 ** draw.uniform(-3.0, 3.0, 3)
        other = {
            name: value * float(np.prod(scale ** np.array(_DIMENSIONS[name])))
            for name, value in values.items()
        }
        same += _holds(inequality, values) == _holds(inequality, other)
    return same / _CASES


def _check_dimensions(number: int) -> Check:
    """Check that both sides of a limit, or of the corrected one, have the same dimension."""
    share = unit_invariant_share(PRINTED_LIMITS[number], 1)
    summary = f"unchanged by other units in {share:.2f} of {_CASES} cases"
    if number not in CORRECTED_LIMITS:
        return check_statement(summary, printed=share == 1.0, share_as_printed=share)
    corrected_share = unit_invariant_share(CORRECTED_LIMITS[number], 1)
    if share < 1.0:
        summary += f", corrected in {corrected_share:.2f}"
    return check_statement(
        summary, printed=share == 1.0, corrected=corrected_share == 1.0, share_as_printed=share
    )


def _min_sample_count(step: float, length: float) -> int:
    """Return the least number of grid points in a half-open window of a given length."""
    starts = step * (np.arange(200) + 0.5) / 200
    grid = step * np.arange(math.ceil(2.0 * length / step) + 3)
    inside = (grid >= starts[:, None]) & (grid < starts[:, None] + length)
    return int(inside.sum(axis=1).min())


# The limits as printed: left and right side.
PRINTED_LIMITS: dict[int, Inequality] = {
    1: lambda v: (v["alpha"] * v["v"] * v["T"] / v["l"], 1.0),
    2: lambda v: (v["beta"] * v["delta"] / v["l"], 1.0),
    3: lambda v: (v["alpha"] * v["delta"] / v["l"], 1.0),
    4: lambda v: (v["gamma"] * v["b"] / v["l"], v["force"]),
    5: lambda v: (2.0 * math.pi * v["A"] / v["l"], v["stiffest"]),
    6: lambda v: (v["v"] / v["l"], v["resonance"]),
}
CORRECTED_LIMITS: dict[int, Inequality] = {
    4: lambda v: (v["gamma"] * v["b"], v["force"]),
    5: lambda v: (v["q"] * v["k"], v["stiffest"]),
}


def reconstruction_error(step: float, length: float, *, is_quantized: bool) -> float:
    """Return the RMS error of A's force along a sampled sinusoid, over its RMS variation.

    The probe moves along a texture of period ``length`` at half the greatest depth. The force is
    held from step to step, or computed at the position that an encoder reads (``is_quantized``).
    """
    surface = Surface(Sinusoid(0.1 * length, length), "A", max_depth=length)
    x = np.linspace(0.0, 40.0 * length, 8001)[1:-1]
    at = step * (np.floor(x / step + 0.5) if is_quantized else np.floor(x / step))

    def force(positions: FloatArray) -> FloatArray:
        points = np.column_stack([positions, 0 * x, np.full(len(x), -0.5 * length)])
        return surface.force(points)[:, 2]

    return float(np.std(force(at) - force(x)) / np.std(force(x)))


def check_reconstruction(number: int, *, is_quantized: bool) -> Check:
    """Check that a limit holds exactly where the kernel's force is reconstructed well enough.

    That is, with a smaller error than from the required number of samples per period, of a force
    that is held from update to update, or is computed at the position that an encoder reads.
    """
    draw = np.random.default_rng(number + 1)
    wrong = 0
    for _ in range(100):
        wanted = float(draw.uniform(5.0, 10.0))
        values = {name: float(draw.uniform(0.5, 2.0)) for name in _DIMENSIONS}
        values |= {"alpha": wanted, "beta": wanted}
        step = values["delta"] if is_quantized else values["v"] * values["T"]
        values["l"] = step * wanted * float(draw.choice([0.95, 1.05]))
        enough = reconstruction_error(1.0 / wanted, 1.0, is_quantized=is_quantized)
        good = reconstruction_error(step, values["l"], is_quantized=is_quantized) < enough
        wrong += _holds(PRINTED_LIMITS[number], values) != good
    scans = check_statement(printed=wrong == 0, wrong_scans=float(wrong))
    return combine_checks(scans, _check_dimensions(number))


def _check_sample_count(inequality: Inequality, step: str, window: str, seed: int) -> Check:
    """Check that an inequality holds exactly if every window contains enough samples.

    ``step`` and ``window`` are the names of the distance of samples and of the window's length.
    """
    draw = np.random.default_rng(seed)
    wrong = 0
    for _ in range(200):
        wanted = int(draw.integers(5, 11))
        values = {name: float(draw.uniform(0.5, 2.0)) for name in _DIMENSIONS}
        values |= {"alpha": wanted, "beta": wanted, "gamma": wanted}
        values[window] = values[step] * float(draw.uniform(3.0, 14.0))
        is_enough = _min_sample_count(values[step], values[window]) >= wanted
        wrong += _holds(inequality, values) != is_enough
    return check_statement(printed=wrong == 0, wrong_cases=float(wrong))


def limit_3() -> Check:
    """High speed reconstruction: α δ/l < 1, one more limit.

    With α in place of β; checked for cases in which it differs from limit 2.
    """
    rng = np.random.default_rng(4)
    differing = 0
    merged = 0
    second = PRINTED_LIMITS[2]
    third = PRINTED_LIMITS[3]
    for _ in range(4000):
        values = {name: float(10.0 ** rng.uniform(-2.0, 1.0)) for name in _DIMENSIONS}
        greater = max(values["alpha"], values["beta"])
        merged += (_holds(second, values) and _holds(third, values)) == (
            greater * values["delta"] < values["l"]
        )
        values["beta"] = values["alpha"]
        differing += _holds(second, values) != _holds(third, values)
    samples = _check_sample_count(third, "delta", "l", 5)
    difference = check_statement(
        printed=differing > 0, corrected=merged == 4000, cases_in_which_they_differ=float(differing)
    )
    return combine_checks(samples, difference)


def limit_4() -> Check:
    """Force reconstruction: γ b/l < A.

    Checked with steps of force.
    """
    count = _check_sample_count(CORRECTED_LIMITS[4], "b", "force", 6)
    return combine_checks(count, _check_dimensions(4))


def check_slopes(seed: int, before: str, after: str, dimensions: Sequence[int] = ()) -> Check:
    """Check that the difference quotients of the force of five laws reach q k and no more.

    Taken over 4000 random pairs of probes, both no deeper than ``max_depth``, and 250 pairs close
    to the witness of q.

    Args:
        seed: of the random pairs.
        before: text before the range of the greatest quotients over q k.
        after: text after it.
        dimensions: numbers of limits whose dimensions are checked, too.
    """
    rng = np.random.default_rng(seed)
    case = SCANNING
    shares = {}
    for law in "ABCEG":
        surface = case.surface(law)
        q = characteristic_number(surface)
        start = _random_pairs(law, rng, 4000)
        close = np.array(q.at) - [0.0, 0.0, 1e-8] + 1e-9 * rng.normal(size=(500, 3)) * [1, 0, 1]
        pairs = np.concatenate([start, np.stack([close[:250], close[250:]])], axis=1)
        shares[law] = max_difference_quotient(surface, pairs) / (case.stiffness * q.value)
    best = min(shares.values())
    worst = max(shares.values())
    slopes = check_statement(
        f"{before} {best:.6f} to {worst:.6f} {after}",
        printed=worst <= 1.0 + 1e-6 and best > 0.97,
        numbers={f"greatest share for {law}": share for law, share in shares.items()},
    )
    return combine_checks(*map(_check_dimensions, dimensions), slopes)


def _random_pairs(law: str, rng: np.random.Generator, count: int) -> FloatArray:
    """Return the ends of short random steps, no deeper than ``max_depth``, shape (2, n, 3)."""
    case = SCANNING
    x = rng.uniform(0.0, case.period, count)
    top = case.texture.height(np.column_stack([x, 0 * x])) if law in "ABC" else 0.0 * x
    depth = case.depth * rng.uniform(0.1, 0.9, count)
    if law == "E":
        depth = depth + case.amplitude
    points = np.column_stack([x, 0 * x, top - depth])
    step = case.depth * 1e-3 * rng.normal(size=(count, 3)) * [1, 0, 1]
    return np.stack([points, points + step])


def limit_6() -> Check:
    """Structure of the device: v/l < F₀.

    Checked with the frequency of the force while scanning.
    """
    error = 0.0
    for case in random_settings(4, 17):
        surface = case.surface("C")
        v = 0.07
        duration = 16 * case.period / v
        time = np.arange(4096) * duration / 4096
        path = np.column_stack([v * time, 0 * time, np.full(len(time), -1.5 * case.amplitude)])
        for force in surface.force(path)[:, [0, 2]].T:
            spectrum = np.abs(np.fft.rfft(force - force.mean()))
            frequency = float(np.argmax(spectrum)) / duration
            error = max(error, abs(frequency * case.period / v - 1.0))
    return combine_checks(check_statement(printed=error < 1e-9, error=error), _check_dimensions(6))

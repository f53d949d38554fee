"""The sine of batches: its error over all angles, and the vectorized loops that it enables."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable

import mpmath
import numpy as np
import pytest

from asperity import Sinusoid, Surface
from asperity.kernels import batch_sine, fuse
from asperity.kernels import point_loops as probe_loops
from asperity.laws import LAWS
from asperity.laws.clamps import NONE

ERROR = 6e-16
LARGEST = 2.0 * math.pi * 1e6  # [rad], one million turns
ROUND_OFF = 2.0**-53
LIBRARY = r"@(llvm\.)?(sin|cos|sincos)[.(]"  # calls of the C library's sine and cosine


def angles() -> list[float]:
    """Return angles of all sizes and signs, and neighbours of multiples of π/4 (cancellation)."""
    rng = np.random.default_rng(3)
    sizes = [0.0, 1e-300, 1e-9, 0.1, 1.0, 10.0, 1e3, 1e5, LARGEST]
    result = [sign * size for size in sizes for sign in (1.0, -1.0)]
    result += list(rng.uniform(-4.0, 4.0, 4000)) + list(rng.uniform(-LARGEST, LARGEST, 4000))
    multiples = rng.integers(-8_000_000, 8_000_000, 1000)
    neighbours = np.nextafter(multiples * (math.pi / 4.0), rng.choice([-1e9, 1e9], 1000))
    return [*result, *neighbours]


Pairs = Callable[[list[float]], Iterable[tuple[float, float]]]


def without_fused_multiply_add(values: list[float]) -> Iterable[tuple[float, float]]:
    """Return sines and cosines as on a processor without fused multiply-add."""
    return ((batch_sine.sine(x), batch_sine.cosine(x)) for x in values)


def compiled_on_this_processor(values: list[float]) -> Iterable[tuple[float, float]]:
    """Return the compiled ones: height and slope of a wave of 1 m whose angle is exactly x."""
    wave = Sinusoid(amplitude=1.0, period=2.0 * math.pi)
    assert wave.arguments == (1.0, 1.0, 0.0, 0.0)
    xy = np.column_stack([values, np.zeros(len(values))])
    return zip(wave.height(xy), wave.gradient(xy)[:, 0], strict=True)


def max_error(values: list[float], pairs: Pairs = without_fused_multiply_add) -> float:
    """Return the greatest error of sine and cosine."""
    with mpmath.workdps(50):
        results = zip(values, pairs(values), strict=True)
        return float(
            max(max(abs(mpmath.sin(x) - s), abs(mpmath.cos(x) - c)) for x, (s, c) in results)
        )


@pytest.mark.parametrize("pairs", [without_fused_multiply_add, compiled_on_this_processor])
def test_sine_and_cosine_are_accurate_to_rounding(pairs: Pairs) -> None:
    assert max_error(angles(), pairs) < ERROR


def test_missing_part_of_pi_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batch_sine, "PART_2", 0.0)
    assert max_error(angles()) > 1e-13


def test_wrong_coefficient_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batch_sine, "INVERSE", 0.63)
    assert max_error(angles()) > 1e-13


def test_error_beyond_a_million_turns_grows_with_the_angle() -> None:
    rng = np.random.default_rng(4)
    for size in 10.0 ** rng.uniform(7.0, 14.0, 2000):
        assert max_error([-size, size]) < ERROR + 4.0 * ROUND_OFF * size


@pytest.mark.parametrize("angle", [1e15, 1e16, 3.1e17, 1e30, 1e300])
def test_sine_of_huge_angles_stays_bounded(angle: float) -> None:
    for x in (angle, -angle):
        assert abs(batch_sine.sine(x)) < 1.0 + 1e-15
        assert abs(batch_sine.cosine(x)) < 1.0 + 1e-15


def llvm_code(surface: Surface, loop: object) -> str:
    """Return the optimised LLVM code of a batch of forces."""
    points = np.array([[0.0, 0.0, -1e-3]])
    loop(points, np.empty((1, 3)), surface.texture.arguments, surface.law_arguments)  # type: ignore[operator]  # Numba is untyped
    (llvm,) = loop.inspect_llvm().values()  # type: ignore[attr-defined]  # likewise
    return str(llvm)


@pytest.mark.usefixtures("empty_code_cache")
@pytest.mark.parametrize("letter", ["B", "C", "A", "G"])
def test_batch_on_a_sinusoid_is_vectorized(letter: str) -> None:
    surface = Surface(Sinusoid(amplitude=0.4e-3, period=1e-3), law=letter)
    text = llvm_code(surface, surface._loops.force_batch)
    assert "fmul <" in text
    assert not re.search(LIBRARY, text)
    single = fuse.fuse_on_texture(LAWS[letter], surface.texture.sampler, NONE, (probe_loops,))
    assert re.search(LIBRARY, llvm_code(surface, single.force_batch))


def test_batch_and_scalar_loops_agree() -> None:
    surface = Surface(Sinusoid(amplitude=0.4e-3, period=1e-3, phase=0.2, direction=(0.6, 0.8)), "B")
    points = np.random.default_rng(5).uniform(-0.1, 0.1, (4099, 3))
    points[:, 2] = np.random.default_rng(6).uniform(-1e-3, 0.5e-3, 4099)
    single = fuse.fuse_on_texture(surface.law, surface.texture.sampler, NONE, (probe_loops,))
    out = np.empty_like(points)
    single.force_batch(points, out, surface.texture.arguments, surface.law_arguments)
    difference = np.abs(surface.force(points) - out).max()
    size = surface.stiffness * 1.4e-3
    assert 0.0 < difference < 20.0 * ERROR * size

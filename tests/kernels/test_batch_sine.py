"""The sine of batches: its error over all angles, and the loops that it lets go several at once."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import mpmath
import numpy as np
import pytest

from asperity import Sinusoid, Surface
from asperity.clamps import NONE
from asperity.kernels import batch_sine, fuse
from asperity.kernels.loops import point_loops as probe_loops
from asperity.laws import LAWS

ERROR = 6e-16
LARGEST = 2.0 * math.pi * 1e6  # [rad], a million turns
ROUND_OFF = 2.0**-53
LIBRARY = r"@(llvm\.)?(sin|cos|sincos)[.(]"  # calls of its sine, or of sine and cosine at once


def angles() -> list[float]:
    """Angles of all sizes and signs, and those beside multiples of π/4, where parts cancel."""
    rng = np.random.default_rng(3)
    sizes = [0.0, 1e-300, 1e-9, 0.1, 1.0, 10.0, 1e3, 1e5, LARGEST]
    found = [sign * size for size in sizes for sign in (1.0, -1.0)]
    found += list(rng.uniform(-4.0, 4.0, 4000)) + list(rng.uniform(-LARGEST, LARGEST, 4000))
    turns = rng.integers(-8_000_000, 8_000_000, 1000)
    beside = np.nextafter(turns * (math.pi / 4.0), rng.choice([-1e9, 1e9], 1000))
    return [*found, *beside]


Pairs = Callable[[list[float]], Iterable[tuple[float, float]]]


def rounded_twice(given: list[float]) -> Iterable[tuple[float, float]]:
    """Return sines and cosines as on a processor that cannot fuse products and sums."""
    return ((batch_sine.sine(x), batch_sine.cosine(x)) for x in given)


def on_this_processor(given: list[float]) -> Iterable[tuple[float, float]]:
    """Return the compiled ones: height and slope of a wave of 1 m whose angle is x to the bit."""
    wave = Sinusoid(amplitude=1.0, period=2.0 * math.pi)
    assert wave.arguments == (1.0, 1.0, 0.0, 0.0)
    xy = np.column_stack([given, np.zeros(len(given))])
    return zip(wave.height(xy), wave.gradient(xy)[:, 0], strict=True)


def worst(given: list[float], pairs: Pairs = rounded_twice) -> float:
    """Return the greatest error of sine and cosine."""
    with mpmath.workdps(50):
        found = zip(given, pairs(given), strict=True)
        return float(
            max(max(abs(mpmath.sin(x) - s), abs(mpmath.cos(x) - c)) for x, (s, c) in found)
        )


@pytest.mark.parametrize("pairs", [rounded_twice, on_this_processor])
def test_sine_and_cosine_are_exact_to_six_units_of_the_sixteenth_digit(pairs: Pairs) -> None:
    assert worst(angles(), pairs) < ERROR


def test_a_part_of_pi_that_is_missing_would_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batch_sine, "PART_2", 0.0)
    assert worst(angles()) > 1e-13


def test_a_coefficient_that_is_off_would_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batch_sine, "INVERSE", 0.63)
    assert worst(angles()) > 1e-13


def test_beyond_a_million_turns_the_angle_loses_two_bits() -> None:
    rng = np.random.default_rng(4)
    for size in 10.0 ** rng.uniform(7.0, 14.0, 2000):
        assert worst([-size, size]) < ERROR + 4.0 * ROUND_OFF * size


@pytest.mark.parametrize("angle", [1e15, 1e16, 3.1e17, 1e30, 1e300])
def test_an_angle_without_meaning_has_a_sine_between_the_crests(angle: float) -> None:
    for x in (angle, -angle):
        assert abs(batch_sine.sine(x)) < 1.0 + 1e-15
        assert abs(batch_sine.cosine(x)) < 1.0 + 1e-15


@pytest.fixture
def compiled_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """No kept code: code from the cache cannot be looked at."""
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path))
    fuse._load_module.cache_clear()
    fuse.fuse_surface.cache_clear()
    yield
    fuse._load_module.cache_clear()
    fuse.fuse_surface.cache_clear()


def code(surface: Surface, loop: object) -> str:
    """Return the optimised code of a batch of forces."""
    points = np.array([[0.0, 0.0, -1e-3]])
    loop(points, np.empty((1, 3)), surface.texture.arguments, surface.law_arguments)  # type: ignore[operator]  # Numba is untyped
    (text,) = loop.inspect_llvm().values()  # type: ignore[attr-defined]  # likewise
    return str(text)


@pytest.mark.usefixtures("compiled_anew")
@pytest.mark.parametrize("letter", ["B", "C", "A", "G"])
def test_a_batch_on_a_wave_goes_many_points_at_once(letter: str) -> None:
    surface = Surface(Sinusoid(amplitude=0.4e-3, period=1e-3), law=letter)
    text = code(surface, surface._loops.force_batch)
    assert "fmul <" in text
    assert not re.search(LIBRARY, text)
    single = fuse.fuse_on_texture(LAWS[letter], surface.texture.sampler, NONE, (probe_loops,))
    assert re.search(LIBRARY, code(surface, single.force_batch))


def test_batch_and_single_points_agree() -> None:
    surface = Surface(Sinusoid(amplitude=0.4e-3, period=1e-3, phase=0.2, direction=(0.6, 0.8)), "B")
    points = np.random.default_rng(5).uniform(-0.1, 0.1, (4099, 3))
    points[:, 2] = np.random.default_rng(6).uniform(-1e-3, 0.5e-3, 4099)
    single = fuse.fuse_on_texture(surface.law, surface.texture.sampler, NONE, (probe_loops,))
    out = np.empty_like(points)
    single.force_batch(points, out, surface.texture.arguments, surface.law_arguments)
    difference = np.abs(surface.force(points) - out).max()
    size = surface.stiffness * 1.4e-3
    assert 0.0 < difference < 20.0 * ERROR * size

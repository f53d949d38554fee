"""S- and L-filter against the transmission of the standard, 2^-(λc/λ)²."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.measured.filters import ALPHA, gaussian_filter
from asperity.measured.preparation import prepare
from asperity.measured.reading import RawSurface

P = 1e-6
N = 401
# Half waves per profile: each wave ends in a crest or trough at both borders.
WAVES = [2, 5, 16, 40, 81, 150]


def transmission(wavelength: float, cutoff: float) -> float:
    """Return the transmission of the Gaussian low-pass: one half at the cut-off."""
    return float(2.0 ** -((cutoff / wavelength) ** 2))


def wave(waves: int, n: int = N) -> Any:
    return 1e-6 * np.cos(np.pi * waves * np.arange(n) / (n - 1))


def filter_only(heights: Any, **arguments: Any) -> Any:
    """Prepare with form 0, which subtracts only the mean, so that only the filters act."""
    raw = RawSurface(heights, (P,) * heights.ndim, "test", ())
    return prepare(raw, form=0, **arguments)


def test_alpha_is_the_constant_of_the_standard() -> None:
    assert pytest.approx(0.4697186393498257, rel=1e-15) == ALPHA
    assert np.exp(-np.pi * ALPHA**2) == pytest.approx(0.5, rel=1e-15)


@pytest.mark.parametrize("waves", WAVES)
@pytest.mark.parametrize("cutoff", [4e-6, 2.5e-5])
def test_s_filter_of_a_profile(waves: int, cutoff: float) -> None:
    before = wave(waves)
    length = 2 * (N - 1) * P / waves
    filtered = filter_only(before, s_cutoff=cutoff).heights
    mean = before.mean()  # form 0 subtracts it, and the filter keeps a constant
    expected = transmission(length, cutoff) * before - mean
    assert np.max(np.abs(filtered - expected)) < 1e-12 * 1e-6


@pytest.mark.parametrize("waves", WAVES)
def test_s_and_l_filter_of_a_profile(waves: int) -> None:
    short, long = 4e-6, 5e-5
    before = wave(waves)
    length = 2 * (N - 1) * P / waves
    filtered = filter_only(before, s_cutoff=short, l_cutoff=long).heights
    expected = transmission(length, short) * (1 - transmission(length, long)) * before
    assert np.max(np.abs(filtered - expected)) < 1e-12 * 1e-6
    wrong = transmission(length, short) * (1 - transmission(length, 1.001 * long)) * before
    if 0.01 < transmission(length, long) < 0.99:  # negative control
        assert np.max(np.abs(filtered - wrong)) > 1e-6 * 1e-6


def test_l_filter_of_a_map_with_unequal_pitch() -> None:
    ny, nx, px, py, short, long = 81, 121, 1e-6, 2e-6, 8e-6, 3e-5
    y, x = np.mgrid[:ny, :nx]
    kx, ky = 7 / (2 * (nx - 1) * px), 9 / (2 * (ny - 1) * py)  # waves per metre
    before = 1e-6 * np.cos(2 * np.pi * kx * px * x) * np.cos(2 * np.pi * ky * py * y)
    raw = RawSurface(before, (px, py), "test", ())
    filtered = prepare(raw, form=0, s_cutoff=short, l_cutoff=long).heights
    square = kx**2 + ky**2
    expected = 2.0 ** -(short**2 * square) * (1 - 2.0 ** -(long**2 * square)) * before
    assert np.max(np.abs(filtered - expected)) < 1e-12 * 1e-6


def test_transmission_at_the_cutoff_is_one_half() -> None:
    wave_at_cutoff = wave(20)  # wavelength 40 µm
    np.testing.assert_allclose(
        gaussian_filter(wave_at_cutoff, (P,), 4e-5), wave_at_cutoff / 2, atol=1e-18
    )


def test_input_is_not_changed() -> None:
    heights = np.random.default_rng(2).standard_normal((9, 8))
    before = heights.copy()
    gaussian_filter(heights, (1.0, 1.0), 3.0)
    np.testing.assert_array_equal(heights, before)


def test_steps_state_both_filters() -> None:
    steps = filter_only(wave(5), s_cutoff=4e-6, l_cutoff=8e-5).steps
    assert steps[2] == "filtered: Gaussian ISO 16610-21, cut-off 4 µm"
    assert steps[3] == "waviness removed: Gaussian L-filter ISO 16610-21, cut-off 80 µm"


@pytest.mark.parametrize(
    ("shape", "l_cutoff", "words"),
    [
        ((401,), 80e-6, None),  # 400 µm: five section lengths, exactly
        ((401,), 81e-6, "400 µm are 4.94 section lengths of 81 µm, ISO 21920-3 takes 5"),
        ((101, 401), 100e-6, None),  # the shorter side is 100 µm
        ((401, 101), 101e-6, "100 µm wide, ISO 25178-3 takes at least 101 µm"),
    ],
)
def test_a_trace_too_short_for_the_l_filter_is_reported(
    shape: tuple[int, ...], l_cutoff: float, words: str | None
) -> None:
    heights = 1e-6 * np.random.default_rng(1).standard_normal(shape)
    raw = RawSurface(heights, (1e-6,) * len(shape), "rough", ())
    warnings = [step for step in prepare(raw, l_cutoff=l_cutoff).steps if "for this L" in step]
    assert len(warnings) == (words is not None)
    assert all(warning.endswith(words or "") for warning in warnings)


@pytest.mark.parametrize(
    ("l_cutoff", "match"),
    [
        (4e-6, "must be longer than s_cutoff, 4 µm"),
        (1e-6, "must be longer than s_cutoff"),
        (1e-3, "must be at most the surface's length, 400 µm"),
        (0.0, "must be positive"),
        (-1e-5, "must be positive"),
        (np.nan, "must be finite"),
        (np.inf, "must be finite"),
        ("1e-4", "needs a unit: write 1e-4mm"),
    ],
)
def test_invalid_l_cutoffs_are_refused(l_cutoff: Any, match: str) -> None:
    with pytest.raises(ParameterError, match=match) as caught:
        filter_only(wave(5), s_cutoff=4e-6, l_cutoff=l_cutoff)
    assert caught.value.argument == "l_cutoff"


def test_l_cutoff_must_exceed_the_default_cutoff() -> None:
    with pytest.raises(ParameterError, match="l_cutoff must be longer than s_cutoff, 4 µm"):
        filter_only(wave(5), l_cutoff=3e-6)

"""Polynomial form against a least-squares fit of monomials by another solver."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.measured.form import fit_form, subtract_form
from asperity.measured.preparation import prepare
from asperity.measured.reading import RawSurface


def monomials(shape: tuple[int, int], degree: int) -> Any:
    y, x = np.mgrid[-1 : 1 : shape[0] * 1j, -1 : 1 : shape[1] * 1j]
    powers = [(a, b) for a in range(degree + 1) for b in range(degree + 1 - a)]
    return np.stack([x**a * y**b for a, b in powers], axis=-1)


def rough(shape: tuple[int, ...], seed: int = 3) -> Any:
    return np.random.default_rng(seed).standard_normal(shape)


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 5])
@pytest.mark.parametrize("holes", [False, True])
def test_fit_is_the_least_squares_polynomial(degree: int, holes: bool) -> None:
    heights = rough((37, 52)) + monomials((37, 52), 6) @ rough((28,), 4)
    if holes:
        heights[5:19, 30:] = np.nan  # at the border, so that the basis is not orthogonal
        heights[rough(heights.shape, 6) > 1.8] = np.nan
    valid = ~np.isnan(heights)
    basis = monomials(heights.shape, degree)
    coefficients, *_ = np.linalg.lstsq(basis[valid], heights[valid], rcond=None)
    fitted = fit_form(heights, degree).evaluate()
    np.testing.assert_allclose(fitted, basis @ coefficients, atol=1e-10)


@pytest.mark.parametrize("degree", [0, 1, 2, 4, 7, 10])
def test_form_removes_polynomials_up_to_its_degree_only(degree: int) -> None:
    shape = (40, 61)
    y, x = np.mgrid[-1:1:40j, -1:1:61j]
    inside = monomials(shape, degree) @ rough((monomials((2, 2), degree).shape[-1],), degree)
    heights = 1e3 + inside
    subtract_form(heights, fit_form(heights, degree), (1.0, 1.0))
    assert np.max(np.abs(heights)) < 1e-9
    above = x ** (degree + 1) + 0 * y
    subtract_form(above, fit_form(above, degree), (1.0, 1.0))
    assert np.max(np.abs(above)) > 1e-4


@pytest.mark.parametrize("degree", [1, 2, 6])
def test_form_of_a_profile(degree: int) -> None:
    x = np.linspace(-1, 1, 200)
    heights = rough((200,)) + np.polyval(rough((9,), 1), x)
    heights[20:50] = np.nan
    valid = ~np.isnan(heights)
    expected = np.polyval(np.polyfit(x[valid], heights[valid], degree), x)
    np.testing.assert_allclose(fit_form(heights, degree).evaluate(), expected, atol=1e-9)


def test_fit_is_accurate_for_an_ill_conditioned_basis() -> None:
    """With two fifths of a profile missing, the normal equations need iterative refinement."""
    heights = np.random.default_rng(1).standard_normal(300)
    heights[180:] = np.nan
    x = np.linspace(-1, 1, 300)
    fitted = np.polynomial.Chebyshev.fit(x[:180], heights[:180], 6)  # uses singular values
    form = fit_form(heights, 6).evaluate()[:180]
    assert np.max(np.abs(form - fitted(x[:180]))) < 1e-13


def test_step_states_size_and_slopes_of_the_form() -> None:
    y, x = np.mgrid[:41, :61]
    px, py = 1e-6, 3e-6
    u, v = (x - 30) * px, (y - 20) * py
    bow = 5e-6 + 0.02 * u - 0.004 * v + 300.0 * u**2
    bow[30:, :40] = np.nan
    prepared = prepare(RawSurface(bow, (px, py), "bow", ()), form=2)
    assert np.max(np.abs(prepared.heights)) < 1e-18
    rms, span = np.nanstd(bow) * 1e9, (np.nanmax(bow) - np.nanmin(bow)) * 1e6
    assert prepared.steps[0] == (
        "form removed: subtracted the least-squares polynomial of degree 2, its RMS"
        f" {rms:.4g} nm, peak to valley {span:.4g} µm, slopes in the middle 0.02 and -0.004"
    )


def test_degree_zero_keeps_the_tilt() -> None:
    ramp = np.linspace(0.0, 1e-4, 50)
    prepared = prepare(RawSurface(ramp, (1e-5,), "ramp", ()), form=0, s_cutoff=2e-5)
    assert np.ptp(prepared.heights) > 0.9e-4
    assert abs(prepared.heights.mean()) < 1e-18
    assert prepared.steps[0] == "mean height 50 µm subtracted; not levelled"


@pytest.mark.parametrize("degree", [-1, 11, 1.5, np.nan, np.inf, True, "2"])
def test_invalid_degrees_are_refused(degree: Any) -> None:
    with pytest.raises(ParameterError, match="form must be a whole number from 0 to 10"):
        prepare(RawSurface(rough((60, 60)), (1e-6, 1e-6), "test", ()), form=degree)


def test_degree_is_limited_by_the_number_of_points() -> None:
    with pytest.raises(ParameterError, match="form must be at most 4 for 10 points along"):
        fit_form(rough((10, 300)), 5)
    fit_form(rough((10, 300)), 4)
    diagonal = np.full((40, 40), np.nan)
    diagonal[np.arange(40), np.arange(40)] = 1.0
    with pytest.raises(ParameterError, match="form of degree 1 is not determined"):
        fit_form(diagonal, 1)

"""Certified numbers of laws that break somewhere, and of laws of one's own; bad arguments."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import eigh
from tests.analysis.gain.bound_checks import as_sum, check, evaluated, fixed

from asperity.analysis import characteristic_number, one_sided_number
from asperity.analysis.bounds.bound import Bound
from asperity.analysis.bounds.sampling import worst_deflection
from asperity.analysis.gain.characteristic import curl_number
from asperity.analysis.gain.medial_axis import crest_curvature, gain_above_crest, sharpest_crest
from asperity.analysis.gain.theorems import largest_singular_value
from asperity.core.errors import ParameterError
from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures import Profile, Sinusoid

# --- the medial axis ------------------------------------------------------------------------------


def test_law_d_around_the_depths_where_its_number_changes() -> None:
    """Of y it leaves 1 at 1/2, and becomes infinite at 1."""
    wave = Sinusoid(0.2e-3, 2e-3, 0.3)
    radius = wave.period**2 / (4 * math.pi**2 * wave.amplitude)
    for texture, method in ((wave, "closed form"), (as_sum(wave), "certified")):
        for y in (0.3, 0.5 - 1e-9, 0.5 + 1e-6, 0.9, 0.999):
            surface = Surface(texture, "D", max_depth=y * radius)
            bound = characteristic_number(surface, tolerance=1e-6)
            expected = max(1.0, y / (1.0 - y))
            assert bound.lower <= expected * (1.0 + 1e-9)
            assert expected * (1.0 - 1e-9) <= bound.upper
            check(surface, bound, "norm", 1e-6)
        for y in (1.0 + 1e-9, 3.0):
            bound = characteristic_number(Surface(texture, "D", max_depth=y * radius))
            assert (bound.lower, bound.upper, bound.method) == (math.inf, math.inf, method)
            assert bound.at == pytest.approx(sharpest_crest(wave).centre, rel=1e-6)


def test_at_the_very_centre_of_curvature_the_number_is_one_or_the_other() -> None:
    for scale in (1.0 - 4e-16, 1.0, 1.0 + 4e-16):
        wave = Sinusoid(0.8e-3, 1e-3)
        depth = scale * wave.period**2 / (4 * math.pi**2 * wave.amplitude)
        bound = characteristic_number(Surface(wave, "D", max_depth=depth))
        assert bound.upper > 1e12
        # To the last digit of the distance all points within 1e-5 l are equally near, and there the
        # curvature is up to 1e-9 less than at the crest.
        assert bound.lower > 1e9
        assert bound.method == "closed form"


def test_at_the_radius_of_the_crest_itself_the_force_jumps() -> None:
    texture = as_sum(Sinusoid(0.8e-3, 1e-3))
    crest = sharpest_crest(texture)
    assert crest is not None
    bound = characteristic_number(Surface(texture, "D", max_depth=crest.radius))
    assert (bound.lower, bound.upper, bound.at) == (math.inf, math.inf, crest.centre)
    less = characteristic_number(Surface(texture, "D", max_depth=crest.radius * (1.0 - 1e-6)))
    assert less.lower < math.inf


def test_a_gap_is_relative_to_what_is_attained() -> None:
    found = [Bound(*ends, "certified").gap for ends in ((2.0, 3.0), (0.0, 3.0), (-1.0, 3.0))]
    assert found == [0.5, math.inf, math.inf]
    assert Bound(math.inf, math.inf, "certified").gap == 0.0


def test_the_worst_deflection_is_as_long_as_it_can_be_and_against_the_slope() -> None:
    surface = Surface(WAVE, "F", max_deflection=0.3e-3)
    found = worst_deflection(surface, np.array([[3.0, -4.0], [0.0, 2e-9], [0.0, 0.0]]))
    np.testing.assert_allclose(found[:2] / 0.3e-3, [[-0.6, 0.8], [0.0, -1.0]], rtol=1e-15)
    assert np.hypot(*found[2]) == pytest.approx(0.3e-3, rel=1e-15)


def test_law_d_has_a_number_above_each_height() -> None:
    """y/(1 - y) where the height is y radii below the top of the sharpest crest."""
    wave = Sinusoid(0.2e-3, 2e-3, 0.3)
    radius = wave.period**2 / (4 * math.pi**2 * wave.amplitude)
    for y, expected in ((-0.2, 1.0), (0.3, 1.0), (0.7, 7.0 / 3.0), (0.99, 99.0), (1.1, math.inf)):
        height = wave.amplitude - y * radius
        for texture in (wave, as_sum(wave)):
            found = gain_above_crest(Surface(texture, "D"), height)
            assert found == pytest.approx(expected, rel=1e-6)
    # A radius below the digits of the height: it jumps below the crest, and above is nothing.
    sharp = Surface(Sinusoid(1.0, 1e-9), "D")
    assert [gain_above_crest(sharp, height) for height in (0.9, 1.1)] == [math.inf, 1.0]


def test_crest_curvature_is_the_greatest_eigenvalue_of_minus_the_shape() -> None:
    """S = G⁻¹ H / s as a generalised eigenvalue problem, at generic slopes and bends."""
    derivatives = np.random.default_rng(45).normal(size=(200, 6))
    found = crest_curvature(derivatives)
    for (_h, hx, hy, hxx, hxy, hyy), value in zip(derivatives, found, strict=True):
        metric = np.array([[1.0 + hx * hx, hx * hy], [hx * hy, 1.0 + hy * hy]])
        hessian = np.array([[hxx, hxy], [hxy, hyy]]) / math.sqrt(1.0 + hx * hx + hy * hy)
        assert value == pytest.approx(-eigh(hessian, metric)[0][0], rel=1e-10, abs=1e-12)


ridged = st.lists(st.floats(-1.0, 1.0), min_size=8, max_size=24)


@fixed(30)
@given(ridged, st.booleans())
def test_down_to_the_least_radius_every_foot_is_the_nearest_point(
    heights: list[float], periodic: bool
) -> None:
    """The ball below the sharpest crest is free, and so is every ball of that radius."""
    texture = Profile(1e-4 * np.array(heights), 1e-4, periodic=periodic)
    crest = sharpest_crest(texture)
    if crest is None:
        return
    x = np.concatenate([texture.domain.points(np.linspace(0, 1, 200)[:, None]), [crest.point[:2]]])
    h, slope = texture.height(x), texture.gradient(x)[:, 0]
    normal = np.column_stack([-slope, 0 * slope, np.ones(len(x))])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    radius = crest.min_radius
    closest_points = np.column_stack([x, h])
    for share in (0.5, 1.0 - 1e-9):
        below = closest_points - share * radius * normal
        away = np.linalg.norm(texture.nearest(below) - below, axis=1)
        assert (away >= share * radius * (1.0 - 1e-9)).all()


def test_beyond_the_least_radius_a_foot_is_none() -> None:
    """The negative control of the theorem: 5 per cent deeper than the sharpest crest allows."""
    texture = Profile(1e-4 * np.random.default_rng(99).normal(size=11), 1e-4)
    crest = sharpest_crest(texture)
    assert crest is not None
    below = np.array([crest.point]) + 1.05 * (np.array([crest.centre]) - np.array([crest.point]))
    away = float(np.linalg.norm(texture.nearest(below) - below))
    assert away < 1.05 * crest.radius * (1.0 - 1e-4)


@pytest.mark.parametrize("continuity", [0.5, 1.0, 3.0])
def test_law_h_has_the_number_of_law_d_until_it_splits(continuity: float) -> None:
    wave = Sinusoid(0.2e-3, 2e-3, 0.3)
    radius = wave.period**2 / (4 * math.pi**2 * wave.amplitude)
    for y in (0.1, 0.6, 0.7, 2.0):
        surface = Surface(wave, "H", max_depth=y * radius, continuity=continuity)
        bound = characteristic_number(surface)
        alone = y / (1.0 - y) if y < 1.0 else math.inf
        expected = max(1.0, min(alone, continuity))
        assert bound.method == "theorem"
        assert bound.upper == pytest.approx(expected, rel=1e-9)
        check(surface, bound, "norm", 1e-6)


# --- laws of one's own ----------------------------------------------------------------------------


def own(force: Any, contact: Any = "vertical", **options: Any) -> Law:
    return Law("Own", "own", contact, force, **options)


WAVE = Sinusoid(0.3e-3, 1e-3, 0.4, (1.0, 2.0))


def test_a_copy_of_a_shipped_law_has_its_number() -> None:
    """By branch and bound over depth or not, against the closed form of the shipped one."""
    copies = {
        "A": own(lambda c: c.k * c.depth * c.e_z),
        "B": own(lambda c: c.k * c.depth * c.normal),
        "C": own(lambda c: c.k * c.depth * c.w),
        "G": own(lambda c: c.k * c.depth * c.normal, "nominal"),
    }
    for letter, law in copies.items():
        expected = characteristic_number(Surface(WAVE, letter, max_depth=0.2e-3)).upper
        surface = Surface(WAVE, law, max_depth=0.2e-3)
        bound = characteristic_number(surface, tolerance=1e-5)
        assert bound.method == "certified"
        assert bound.lower <= expected * (1.0 + 1e-12)
        assert expected <= bound.upper * (1.0 + 1e-12)
        check(surface, bound, "norm", 1e-5)


def test_a_copy_of_law_d_has_its_number_above_the_medial_axis() -> None:
    law = own(lambda c: c.k * c.toward, "nearest")
    radius = WAVE.period**2 / (4 * math.pi**2 * WAVE.amplitude)
    surface = Surface(WAVE, law, max_depth=0.7 * radius)
    bound = characteristic_number(surface)
    assert bound.lower <= 7.0 / 3.0 * (1.0 + 1e-9)
    assert bound.upper >= 7.0 / 3.0
    check(surface, bound, "norm", 1e-3)
    beyond = characteristic_number(Surface(WAVE, law, max_depth=1.2 * radius))
    assert (beyond.upper, beyond.method) == (math.inf, "sampled")
    assert "medial axis" in beyond.note
    assert beyond.lower > 100.0


def test_a_stiffening_law_is_greatest_inside_the_depth_range() -> None:
    """f_z = k δ (1 - δ/D)²: its derivative is greatest at an end, its curl is not."""

    def soft(c: Any) -> Any:
        return c.k * c.depth * (1 - c.depth / c.parameter("depth_0")) ** 2 * c.e_z

    surface = Surface(WAVE, own(soft, parameters={"depth_0": 1e-3}), max_depth=1e-3)
    slope = 2 * math.pi * 0.3
    bound = curl_number(surface)
    assert bound.upper == pytest.approx(slope, rel=2e-3)  # at depth zero
    check(surface, bound, "curl", 1e-3)
    hard = Surface(WAVE, own(lambda c: c.k * 1e3 * c.depth**2 * c.e_z), max_depth=1e-3)
    assert curl_number(hard).upper == pytest.approx(2.0 * slope, rel=2e-3)


def test_an_own_law_with_state_over_all_sticks_and_slips() -> None:
    def sticky(c: Any) -> Any:
        return c.k * c.depth * (c.e_z - c.tangential(c.deflection) / c.parameter("max_deflection"))

    law = own(sticky, "nominal", stateful=True, parameters={"max_deflection": 1e-3})
    surface = Surface(WAVE, law, max_depth=0.5e-3)
    # Every phase and angle is as bad as every other: no cell can be dropped early.
    bound = characteristic_number(surface, tolerance=2e-2)
    # a = D/d_max = 1/2 and b = 1.
    exact = float(largest_singular_value(np.array([0.5]), np.array([1.0]))[0])
    assert bound.lower <= exact * (1.0 + 1e-12)
    assert exact <= bound.upper
    assert bound.deflection is not None
    check(surface, bound, "norm", 2e-2)


@pytest.mark.parametrize(
    ("force", "contact", "reason"),
    [
        (lambda c: c.k * c.depth * sp.Max(c.depth, 1e-4) * c.e_z, "vertical", "piecewise"),
        (lambda c: c.k * c.depth * sp.Abs(c.h) * 1e3 * c.e_z, "vertical", "compared"),
        (lambda c: c.k * c.depth * (2 + c.position[0]) * c.e_z, "vertical", "position"),
        (lambda c: c.k * c.depth * (2 + sp.erf(c.h)) * c.e_z, "vertical", "erf"),
        (lambda c: c.k * c.depth * 2 ** (c.h * 1e3) * c.e_z, "vertical", "pow"),
    ],
)
def test_a_law_without_interval_kernel_is_sampled(force: Any, contact: Any, reason: str) -> None:
    surface = Surface(WAVE, own(force, contact), max_depth=0.2e-3)
    bound = characteristic_number(surface)
    assert (bound.method, bound.upper) == ("sampled", math.inf)
    assert reason in bound.note
    assert evaluated(surface, bound, "norm") == pytest.approx(bound.lower, rel=1e-12)


def test_a_force_with_nan_is_not_certified() -> None:
    law = own(lambda c: c.k * c.depth * (c.h / 1e-3) ** sp.Rational(3, 2) * c.e_z)
    surface = Surface(WAVE, law, max_depth=0.2e-3)
    bound = characteristic_number(surface, work_limit=20_000)
    assert bound.upper == math.inf
    assert "limit" in bound.note


# --- bad arguments --------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [characteristic_number, one_sided_number, curl_number])
@pytest.mark.parametrize(
    ("options", "argument"),
    [
        ({"tolerance": 0.0}, "tolerance"),
        ({"tolerance": -1e-3}, "tolerance"),
        ({"tolerance": math.nan}, "tolerance"),
        ({"tolerance": "fine"}, "tolerance"),
        ({"work_limit": 0}, "work_limit"),
        ({"work_limit": math.inf}, "work_limit"),
        ({"extent": 5.0}, "extent"),
        ({"extent": (1.0,)}, "extent"),
        ({"extent": (1.0, 2.0, 3.0)}, "extent"),
        ({"extent": "ab"}, "extent"),
        ({"extent": ("a", 1.0)}, "extent"),
        ({"extent": (1.0, 0.0)}, "extent"),
        ({"extent": (math.inf, 1.0)}, "extent"),
    ],
)
def test_bad_arguments_are_named(number: Any, options: dict[str, Any], argument: str) -> None:
    with pytest.raises(ParameterError, match=argument + " must"):
        number(Surface(WAVE, "B"), **options)


@pytest.mark.parametrize("number", [characteristic_number, one_sided_number, curl_number])
def test_a_texture_is_no_surface(number: Any) -> None:
    with pytest.raises(ParameterError, match=r"^surface must be a Surface"):
        number(WAVE)


def test_laws_without_such_a_number_are_refused() -> None:
    with pytest.raises(ParameterError, match="has state"):
        curl_number(Surface(WAVE, "F"))
    split = own(lambda c: 2 * c.k * c.toward, "split", parameters={"continuity": 1.0})
    with pytest.raises(ParameterError, match="split contact"):
        characteristic_number(Surface(WAVE, split))

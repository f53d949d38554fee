"""Certified numbers of laws with singular depths and of user-defined laws; invalid arguments."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import eigh
from tests.analysis.gain.bound_checks import (
    as_fourier,
    check_bound,
    deterministic_settings,
    value_at_witness,
)

from asperity.analysis import characteristic_number, one_sided_number
from asperity.analysis.bounds.bound import Bound
from asperity.analysis.bounds.sampling import worst_deflection
from asperity.analysis.gain.characteristic import curl_number
from asperity.analysis.gain.medial_axis import crest_curvature, gain_above_crest, sharpest_crest
from asperity.analysis.gain.proofs import largest_singular_value
from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid, plane_waves

# --- the medial axis ------------------------------------------------------------------------------


def test_number_of_law_d_around_its_critical_depths() -> None:
    """With y = D/radius the number exceeds 1 from y = 1/2 on and is infinite from y = 1 on."""
    wave = Sinusoid(0.2e-3, 2e-3, 0.3)
    radius = wave.period**2 / (4 * math.pi**2 * wave.amplitude)
    for texture, method in ((wave, "closed form"), (as_fourier(wave), "certified")):
        for y in (0.3, 0.5 - 1e-9, 0.5 + 1e-6, 0.9, 0.999):
            surface = Surface(texture, "D", max_depth=y * radius)
            bound = characteristic_number(surface, tolerance=1e-6)
            expected = max(1.0, y / (1.0 - y))
            assert bound.lower <= expected * (1.0 + 1e-9)
            assert expected * (1.0 - 1e-9) <= bound.upper
            check_bound(surface, bound, "norm", 1e-6)
        for y in (1.0 + 1e-9, 3.0):
            bound = characteristic_number(Surface(texture, "D", max_depth=y * radius))
            assert (bound.lower, bound.upper, bound.method) == (math.inf, math.inf, method)
            assert bound.at == pytest.approx(sharpest_crest(wave).centre, rel=1e-6)


def test_number_of_law_d_at_the_centre_of_curvature_is_very_large() -> None:
    for scale in (1.0 - 4e-16, 1.0, 1.0 + 4e-16):
        wave = Sinusoid(0.8e-3, 1e-3)
        depth = scale * wave.period**2 / (4 * math.pi**2 * wave.amplitude)
        bound = characteristic_number(Surface(wave, "D", max_depth=depth))
        assert bound.upper > 1e12
        # To the last digit of the distance all points within 1e-5 l are equally near; there the
        # curvature is up to 1e-9 less than at the crest.
        assert bound.lower > 1e9
        assert bound.method == "closed form"


def test_number_of_law_d_at_the_crest_radius_is_infinite() -> None:
    texture = as_fourier(Sinusoid(0.8e-3, 1e-3))
    crest = sharpest_crest(texture)
    assert crest is not None
    bound = characteristic_number(Surface(texture, "D", max_depth=crest.radius))
    assert (bound.lower, bound.upper, bound.at) == (math.inf, math.inf, crest.centre)
    less = characteristic_number(Surface(texture, "D", max_depth=crest.radius * (1.0 - 1e-6)))
    assert less.lower < math.inf


def test_gap_is_relative_to_the_lower_bound() -> None:
    result = [Bound(*ends, "certified").gap for ends in ((2.0, 3.0), (0.0, 3.0), (-1.0, 3.0))]
    assert result == [0.5, math.inf, math.inf]
    assert Bound(math.inf, math.inf, "certified").gap == 0.0


def test_worst_deflection_has_maximum_length_against_the_slope() -> None:
    surface = Surface(WAVE, "F", max_deflection=0.3e-3)
    deflection = worst_deflection(surface, np.array([[3.0, -4.0], [0.0, 2e-9], [0.0, 0.0]]))
    np.testing.assert_allclose(deflection[:2] / 0.3e-3, [[-0.6, 0.8], [0.0, -1.0]], rtol=1e-15)
    assert np.hypot(*deflection[2]) == pytest.approx(0.3e-3, rel=1e-15)


@pytest.mark.parametrize(("friction", "depth"), [(0.8, 1e-3), (0.3, 0.2e-3), (1.7, 0.4e-3)])
def test_certificate_of_law_f_is_rounded_outwards(friction: float, depth: float) -> None:
    """Without modulation every point attains the number, so the bound leaves no room inwards."""
    flat = Surface(
        WAVE, "F", max_depth=depth, friction=friction, max_deflection=0.3e-3, modulation_depth=0.0
    )
    bound = characteristic_number(flat)
    with mpmath.workdps(40):
        a, b = (
            mpmath.mpf(friction) * mpmath.mpf(depth) / 2 / mpmath.mpf(0.3e-3),
            mpmath.mpf(friction) / 2,
        )
        t = 1 + a**2 + b**2
        exact = mpmath.sqrt((t + mpmath.sqrt(t**2 - 4 * a**2)) / 2)
        assert mpmath.mpf(bound.upper) >= exact
    assert bound.upper == pytest.approx(float(exact), rel=1e-12)


def test_shallow_map_of_law_g_needs_few_cells() -> None:
    """Nowhere above the floor q = 1, which every point attains: 95 s before, 1 s since."""
    heights = 1e-8 * np.random.default_rng(1).normal(size=(650, 650))
    shallow = HeightMap(heights, 5e-6, periodic=True)
    surface = Surface(shallow, "G", max_depth=shallow.peak_to_valley)
    bound = characteristic_number(surface, work_limit=20_000)  # of 422 500 cells
    assert (bound.lower, bound.method) == (1.0, "certified")
    assert bound.upper == pytest.approx(1.0, rel=1e-12)


def test_gain_of_law_d_above_a_height() -> None:
    """The gain is y/(1 - y) at a height y radii below the top of the sharpest crest."""
    wave = Sinusoid(0.2e-3, 2e-3, 0.3)
    radius = wave.period**2 / (4 * math.pi**2 * wave.amplitude)
    for y, expected in ((-0.2, 1.0), (0.3, 1.0), (0.7, 7.0 / 3.0), (0.99, 99.0), (1.1, math.inf)):
        height = wave.amplitude - y * radius
        for texture in (wave, as_fourier(wave)):
            gain = gain_above_crest(Surface(texture, "D"), height)
            assert gain == pytest.approx(expected, rel=1e-6)
    # A radius below the resolution of the height: a jump below the crest, no contact above it.
    sharp = Surface(Sinusoid(1.0, 1e-9), "D")
    assert [gain_above_crest(sharp, height) for height in (0.9, 1.1)] == [math.inf, 1.0]


def test_crest_curvature_is_the_largest_eigenvalue_of_minus_the_shape_operator() -> None:
    """S = G⁻¹ H / s as a generalised eigenvalue problem, at generic slopes and Hessians."""
    derivatives = np.random.default_rng(45).normal(size=(200, 6))
    curvature = crest_curvature(derivatives)
    for (_h, hx, hy, hxx, hxy, hyy), value in zip(derivatives, curvature, strict=True):
        metric = np.array([[1.0 + hx * hx, hx * hy], [hx * hy, 1.0 + hy * hy]])
        hessian = np.array([[hxx, hxy], [hxy, hyy]]) / math.sqrt(1.0 + hx * hx + hy * hy)
        assert value == pytest.approx(-eigh(hessian, metric)[0][0], rel=1e-10, abs=1e-12)


ridged = st.lists(st.floats(-1.0, 1.0), min_size=8, max_size=24)


@deterministic_settings(30)
@given(ridged, st.booleans())
def test_points_above_the_smallest_radius_have_a_unique_closest_point(
    heights: list[float], periodic: bool
) -> None:
    """The ball below the sharpest crest and every ball of that radius contain no surface."""
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


def test_beyond_the_smallest_radius_another_point_is_closer() -> None:
    """Negative control: 5 % below the centre of curvature of the sharpest crest."""
    texture = Profile(1e-4 * np.random.default_rng(99).normal(size=11), 1e-4)
    crest = sharpest_crest(texture)
    assert crest is not None
    below = np.array([crest.point]) + 1.05 * (np.array([crest.centre]) - np.array([crest.point]))
    away = float(np.linalg.norm(texture.nearest(below) - below))
    assert away < 1.05 * crest.radius * (1.0 - 1e-4)


@pytest.mark.parametrize("continuity", [0.5, 1.0, 3.0])
def test_number_of_law_h_is_that_of_law_d_up_to_its_continuity(continuity: float) -> None:
    wave = Sinusoid(0.2e-3, 2e-3, 0.3)
    radius = wave.period**2 / (4 * math.pi**2 * wave.amplitude)
    for y in (0.1, 0.6, 0.7, 2.0):
        surface = Surface(wave, "H", max_depth=y * radius, continuity=continuity)
        bound = characteristic_number(surface)
        alone = y / (1.0 - y) if y < 1.0 else math.inf
        expected = max(1.0, min(alone, continuity))
        assert bound.method == "theorem"
        assert bound.upper == pytest.approx(expected, rel=1e-9)
        check_bound(surface, bound, "norm", 1e-6)


# --- user-defined laws ----------------------------------------------------------------------------


def user_law(force: Any, contact: Any = "vertical", **options: Any) -> Law:
    return Law("Own", "own", contact, force, **options)


WAVE = Sinusoid(0.3e-3, 1e-3, 0.4, (1.0, 2.0))


def test_copy_of_a_shipped_law_has_the_same_number() -> None:
    """The number from branch and bound is compared with the closed form of the shipped law."""
    copies = {
        "A": user_law(lambda c: c.k * c.depth * c.e_z),
        "B": user_law(lambda c: c.k * c.depth * c.normal),
        "C": user_law(lambda c: c.k * c.depth * c.w),
        "G": user_law(lambda c: c.k * c.depth * c.normal, "nominal"),
    }
    for letter, law in copies.items():
        expected = characteristic_number(Surface(WAVE, letter, max_depth=0.2e-3)).upper
        surface = Surface(WAVE, law, max_depth=0.2e-3)
        bound = characteristic_number(surface, tolerance=1e-5)
        assert bound.method == "certified"
        assert bound.lower <= expected * (1.0 + 1e-12)
        assert expected <= bound.upper * (1.0 + 1e-12)
        check_bound(surface, bound, "norm", 1e-5)


GRADED = user_law(
    lambda c: c.k * c.depth * (1 + sp.sin(3000 * c.position[0]) / 2) * c.e_z, "nominal"
)


def test_number_of_a_law_that_uses_the_position_is_that_of_all_places() -> None:
    bound = characteristic_number(Surface(WAVE, GRADED, max_depth=0.4e-3))
    # f_z = k δ g: the norm of its gradient is |(δ g', g)|.
    x = np.linspace(0.0, 2.0 * math.pi / 3000.0, 10_001)
    gradient = np.hypot(0.4e-3 * 1500 * np.cos(3000 * x), 1.0 + np.sin(3000 * x) / 2)
    assert bound.method == "sampled"
    assert bound.lower == pytest.approx(gradient.max(), rel=1e-6)


def test_places_of_independent_phases_are_looked_up_for_witnesses_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each takes milliseconds."""
    looked_up = []
    intact = plane_waves.nearest_phases

    def look_up(basis: FloatArray, target: FloatArray) -> FloatArray:
        looked_up.append(target)
        return intact(basis, target)

    monkeypatch.setattr(plane_waves, "nearest_phases", look_up)
    wave = np.array([2000.0, 1000.0])
    waves = Fourier([1e-4, 4e-5], [wave, math.sqrt(2.0) * wave], [0.0, 0.3])
    assert characteristic_number(Surface(waves, GRADED, max_depth=0.2e-3)).method == "sampled"
    assert 1 <= len(looked_up) <= 10


def test_copy_of_law_d_is_certified_above_the_medial_axis_only() -> None:
    law = user_law(lambda c: c.k * c.toward, "nearest")
    radius = WAVE.period**2 / (4 * math.pi**2 * WAVE.amplitude)
    surface = Surface(WAVE, law, max_depth=0.7 * radius)
    bound = characteristic_number(surface)
    assert bound.lower <= 7.0 / 3.0 * (1.0 + 1e-9)
    assert bound.upper >= 7.0 / 3.0
    check_bound(surface, bound, "norm", 1e-3)
    beyond = characteristic_number(Surface(WAVE, law, max_depth=1.2 * radius))
    assert (beyond.upper, beyond.method) == (math.inf, "sampled")
    assert "medial axis" in beyond.note
    assert beyond.lower > 100.0


def test_curl_number_of_laws_not_affine_in_depth() -> None:
    """For f_z = k δ (1 - δ/D)² the curl is largest at depth zero; for f_z ∝ δ² at full depth."""

    def softening_force(c: Any) -> Any:
        return c.k * c.depth * (1 - c.depth / c.parameter("depth_0")) ** 2 * c.e_z

    surface = Surface(WAVE, user_law(softening_force, parameters={"depth_0": 1e-3}), max_depth=1e-3)
    slope = 2 * math.pi * 0.3
    bound = curl_number(surface)
    assert bound.upper == pytest.approx(slope, rel=2e-3)  # at depth zero
    check_bound(surface, bound, "curl", 1e-3)
    hard = Surface(WAVE, user_law(lambda c: c.k * 1e3 * c.depth**2 * c.e_z), max_depth=1e-3)
    assert curl_number(hard).upper == pytest.approx(2.0 * slope, rel=2e-3)


def test_user_defined_law_with_state_covers_stick_and_slip() -> None:
    def anchored_force(c: Any) -> Any:
        return c.k * c.depth * (c.e_z - c.tangential(c.deflection) / c.parameter("max_deflection"))

    law = user_law(anchored_force, "nominal", stateful=True, parameters={"max_deflection": 1e-3})
    surface = Surface(WAVE, law, max_depth=0.5e-3)
    # All phases and angles have the same value: no cell can be pruned early.
    bound = characteristic_number(surface, tolerance=2e-2)
    # a = D/d_max = 1/2 and b = 1.
    exact = float(largest_singular_value(np.array([0.5]), np.array([1.0]))[0])
    assert bound.lower <= exact * (1.0 + 1e-12)
    assert exact <= bound.upper
    assert bound.deflection is not None
    check_bound(surface, bound, "norm", 2e-2)


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
def test_law_without_interval_kernel_is_sampled(force: Any, contact: Any, reason: str) -> None:
    surface = Surface(WAVE, user_law(force, contact), max_depth=0.2e-3)
    bound = characteristic_number(surface)
    assert (bound.method, bound.upper) == ("sampled", math.inf)
    assert reason in bound.note
    assert value_at_witness(surface, bound, "norm") == pytest.approx(bound.lower, rel=1e-12)


def test_force_with_nan_is_not_certified() -> None:
    law = user_law(lambda c: c.k * c.depth * (c.h / 1e-3) ** sp.Rational(3, 2) * c.e_z)
    surface = Surface(WAVE, law, max_depth=0.2e-3)
    bound = characteristic_number(surface, work_limit=20_000)
    assert bound.upper == math.inf
    assert "limit" in bound.note


# --- invalid arguments ----------------------------------------------------------------------------


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
def test_error_messages_name_the_invalid_argument(
    number: Any, options: dict[str, Any], argument: str
) -> None:
    with pytest.raises(ParameterError, match=argument + " must"):
        number(Surface(WAVE, "B"), **options)


@pytest.mark.parametrize("number", [characteristic_number, one_sided_number, curl_number])
def test_texture_instead_of_surface_raises(number: Any) -> None:
    with pytest.raises(ParameterError, match=r"^surface must be a Surface"):
        number(WAVE)


def test_laws_without_the_number_raise() -> None:
    with pytest.raises(ParameterError, match="has state"):
        curl_number(Surface(WAVE, "F"))
    split = user_law(lambda c: 2 * c.k * c.toward, "split", parameters={"continuity": 1.0})
    with pytest.raises(ParameterError, match="split contact"):
        characteristic_number(Surface(WAVE, split))

"""The worst simple loop against integrals of the curl that can be done by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import dblquad

from asperity.analysis import loop_work
from asperity.analysis.energy.curl_columns import (
    column_polygon,
    curl_integral_bounds,
    sample_curl_integrals,
)
from asperity.analysis.energy.leak import in_plane_loop, orient_loop, worst_loop
from asperity.core.errors import ParameterError
from asperity.surface import Surface
from asperity.textures.kinds.fourier import Fourier
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import HeightMap

K, A, L, D = 1000.0, 0.1e-3, 2e-3, 0.3e-3
TEXTURE = Sinusoid(A, L, direction=(3.0, 4.0))


def leak(letter: str, **arguments: float) -> float:
    return worst_loop(Surface(TEXTURE, letter, K, D, **arguments)).energy


def test_a_leaks_the_total_rise_times_the_depth() -> None:
    """∬ k h'⁺ over one period and the depth: k D · 2A."""
    found = worst_loop(Surface(TEXTURE, "A", K, D))
    exact = 2 * K * D * A
    assert found.energy <= exact * (1 + 1e-12)
    assert found.energy == pytest.approx(exact, rel=2e-5)
    assert exact <= found.upper_per_period <= exact * (1 + 1e-4)


def test_g_leaks_the_integral_of_its_curl() -> None:
    g = 2 * math.pi * A / L

    def curl(depth: float, x: float) -> float:
        c, s = math.cos(2 * math.pi * x / L), math.sin(2 * math.pi * x / L)
        slope, hessian = g * c, -g * 2 * math.pi / L * s
        w = math.sqrt(1 + slope**2)
        return K * (slope / w + depth * slope * hessian / w**3)

    expected = dblquad(lambda d, x: max(curl(d, x), 0.0), 0, L, 0, D, epsabs=1e-14)[0]
    assert leak("G") == pytest.approx(expected, rel=2e-3)  # 8 levels of depth


def test_e_leaks_the_integral_of_its_curl() -> None:
    """By the closest point: curl = k n_t, area (1 + δκ) ds dδ; shallow, so no ridge."""
    depth = 0.05e-3
    texture = Sinusoid(A, L)
    x = (np.arange(4000) + 0.5) * L / 4000
    derivatives = texture.derivatives(np.column_stack([x, 0 * x]))
    slope, hessian = derivatives[:, 1], derivatives[:, 3]
    s = np.sqrt(1 + slope**2)
    kappa = hessian / s**3
    # ∫ over the depth of (1 + δκ), with ds = s dx.
    integrand = K * np.abs(slope / s) * s * (depth + 0.5 * depth**2 * kappa)
    expected = 0.5 * integrand.sum() * L / 4000
    found = worst_loop(Surface(texture, "E", K, depth)).energy
    assert found == pytest.approx(expected, rel=5e-3)


def test_friction_leak_is_reproduced_by_its_vertices() -> None:
    surface = Surface(TEXTURE, "F", K, D)
    result = worst_loop(surface)
    assert loop_work(surface, result.vertices) == pytest.approx(result.energy, rel=1e-9)
    # Constant modulation: the paper's (27).
    still = worst_loop(Surface(TEXTURE, "F", K, D, modulation_depth=0.0))
    assert still.energy == pytest.approx(K * 0.8 * 0.5 * D * 1e-3 / 2, rel=1e-5)


def test_conservative_laws_leak_nothing_by_theorem() -> None:
    result = worst_loop(Surface(TEXTURE, "C", K, D))
    assert (result.energy, result.method) == (0.0, "theorem")
    assert (result.vertices.shape, result.length, result.per_length) == ((0, 3), 0.0, 0.0)


def test_a_loop_that_gains_nothing_has_no_vertices() -> None:
    """No friction, no curl; a single vertex; columns that are all empty."""
    for depth in np.linspace(0.1e-3, 1e-3, 8):  # at some of them rounding leaves 1e-20 J
        still = worst_loop(Surface(TEXTURE, "F", K, depth, friction=0.0))
        assert (still.energy, still.upper_per_period) == (0.0, math.inf)
        assert (still.vertices.shape, still.length, still.critical_speed(1.0)) == ((0, 3), 0.0, 0.0)
    assert worst_loop(Surface(TEXTURE, "F", K, D, friction=1e-6)).energy > 0.0
    vertices, energy = orient_loop(Surface(TEXTURE, "A", K, D), np.zeros((1, 3)))
    assert (vertices.shape, energy) == ((0, 3), 0.0)
    level = np.full(5, -D)
    assert column_polygon(TEXTURE.scan_line().points(5), level, level, periodic=True).shape == (
        0,
        3,
    )


@pytest.mark.parametrize("letter", "CW")
def test_a_field_without_curl_is_measured_as_zero(letter: str) -> None:
    """Negative control: the integrals of the curl are zero by theorem."""
    surface = Surface(TEXTURE, letter, K, D)
    line = TEXTURE.scan_line()
    assert max(sample_curl_integrals(surface, line)) < 1e-12 * K * D * A
    bounds = curl_integral_bounds(surface, line)
    assert bounds is not None
    assert max(high for _low, high in bounds) < 1e-6 * K * D * A


def test_a_loop_through_the_curl_of_one_sign_gains_that_energy() -> None:
    """A gains on the rising flank: down along the crest's side and up along the trough's."""
    texture = Sinusoid(A, L)
    surface = Surface(texture, "A", K, D)
    x = np.linspace(-L / 4, L / 4, 400)
    h = texture.height(np.column_stack([x, 0 * x]))
    top = np.column_stack([x, 0 * x, h])
    bottom = np.column_stack([x, 0 * x, h - D])[::-1]
    gained = abs(loop_work(surface, np.concatenate([top, bottom])))
    assert gained == pytest.approx(worst_loop(surface).energy, rel=1e-4)


def test_maps_are_searched_along_several_lines() -> None:
    """A ridge near one edge: the middle line of the map does not see it."""
    y, x = np.mgrid[:41, :41]
    heights = 1e-4 * np.exp(-((x - 20.0) ** 2 + (y - 33.0) ** 2) / 18.0)
    surface = Surface(HeightMap(heights, 1e-4), "A", K, 1e-4)
    result = worst_loop(surface)
    assert 3.2e-3 < result.line.start[1] < 3.4e-3
    # One rise to the top of the hump; the nearest line passes within 0.06 mm of it.
    assert result.energy == pytest.approx(K * 1e-4 * 1e-4, rel=0.03)


def test_scan_direction_is_the_profile_s_own() -> None:
    wave = Fourier([A, A / 2], [[0.0, 3000.0], [0.0, 6000.0]])
    line = worst_loop(Surface(wave, "A", K, D)).line
    np.testing.assert_allclose(np.abs(line.direction), [0.0, 1.0])


@pytest.mark.parametrize("letter", "ABEFG")
def test_the_vertices_reproduce_the_energy(letter: str) -> None:
    surface = Surface(Sinusoid(A, L), letter, K, D)
    found = worst_loop(surface)
    assert found.energy > 0.0
    assert found.energy <= found.upper_per_period
    # E's quadrature stops at 1e-4 of the work of an edge.
    tolerance = 1e-4 if letter == "E" else 1e-9
    assert loop_work(surface, found.vertices) == pytest.approx(found.energy, rel=tolerance)


@pytest.mark.parametrize("letter", "ABG")
def test_the_bound_is_tight(letter: str) -> None:
    """Lowered by twice the gap, the bound would be below what the polygon attains."""
    found = worst_loop(Surface(Fourier([A, A / 2], [3000.0, 6000.0], [0.3, 1.0]), letter, K, D))
    assert found.method == "certified"
    gap = found.upper_per_period / found.energy - 1.0
    assert 0.0 <= gap < 1e-3
    assert found.upper_per_period * (1 - 2 * gap) < found.energy


def test_a_polygon_leaves_out_the_widest_gap() -> None:
    """Columns 0, 2, 6 and 7 of a period of 8: from 5 on, over the period's end, to 11."""
    x, full = np.arange(9.0), np.array([1, 0, 1, 0, 0, 0, 1, 1, 1])
    found = column_polygon(np.column_stack([x, 0.0 * x]), np.zeros(9), -1.0 * full, periodic=True)
    assert (found[:, 0].min(), found[:, 0].max()) == (5.0, 11.0)
    assert set(found[found[:, 2] < 0.0, 0]) == {6.0, 7.0, 8.0, 10.0}


@pytest.mark.parametrize("power", [2, 3])
def test_a_law_that_is_not_affine_in_depth_is_certified_too(power: int) -> None:
    """The curl of k δⁿ e_z/Dⁿ⁻¹ is n k δⁿ⁻¹ h'/Dⁿ⁻¹, over the depth k D h', the flank 2A k D."""
    from asperity.laws import Law

    law = Law(
        "Q", "power", "vertical",
        lambda c: c.k * c.depth * (c.depth / c.parameter("size")) ** (power - 1) * c.e_z,
        parameters={"size": D},
    )  # fmt: skip
    found = worst_loop(Surface(Sinusoid(A, L), law, K, D))
    exact = 2 * K * D * A
    assert found.method == "certified"
    assert exact <= found.upper_per_period <= exact * 1.01
    assert found.energy == pytest.approx(exact, rel=1e-3)


def test_damping_absorbs_the_loop_above_the_speed() -> None:
    """W = σ₀ v L: on a loop of length L viscous loss at speed v is σ₀ v L."""
    found = worst_loop(Surface(Sinusoid(A, L), "A", K, D))
    edges = np.linalg.norm(np.roll(found.vertices, -1, axis=0) - found.vertices, axis=1)
    assert found.length == pytest.approx(edges.sum(), rel=1e-12)
    assert found.critical_speed(2.0) * 2.0 * edges.sum() == pytest.approx(found.energy, rel=1e-12)
    with pytest.raises(ParameterError, match="damping"):
        found.critical_speed(0.0)


def test_force_shading_pushes_along_an_asymmetric_profile_only() -> None:
    """The mean is -k D ⟨h'/√(1 + h'²)⟩: zero by symmetry for a sinusoid."""
    numbers = np.arange(1.0, 6.0)
    saw = Fourier(A / numbers, 2 * np.pi / L * numbers)
    x = (np.arange(20_000) + 0.5) * L / 20_000
    slope = saw.gradient(np.column_stack([x, 0 * x]))[:, 0]
    expected = -K * D * np.mean(slope / np.sqrt(1 + slope**2))
    thrust = worst_loop(Surface(saw, "G", K, D)).thrust
    assert abs(expected) > 0.04 * K * D
    assert thrust == pytest.approx(expected, rel=1e-9)
    assert worst_loop(Surface(Sinusoid(A, L), "G", K, D)).thrust == pytest.approx(0.0, abs=1e-12)


def test_friction_gains_at_constant_depth_where_modulation_changes() -> None:
    surface = Surface(Sinusoid(0.8e-3, 2e-3), "F", K, 0.8e-3)
    found = in_plane_loop(surface, surface.texture.scan_line())
    assert found.energy > 0.3e-3
    assert np.ptp(found.vertices[1:, 2]) == 0.0
    assert loop_work(surface, found.vertices) == pytest.approx(found.energy, rel=1e-9)
    # Without modulation the field in the plane has no curl.
    plain = Surface(Sinusoid(0.8e-3, 2e-3), "F", K, 0.8e-3, modulation_depth=0.0)
    assert abs(in_plane_loop(plain, plain.texture.scan_line()).energy) < 1e-9


def test_the_plane_can_be_turned() -> None:
    y = np.mgrid[:24, :24][0]
    waves = HeightMap(2e-5 * np.sin(2 * np.pi * y / 24), 1e-4, periodic=True)
    surface = Surface(waves, "A", K, 1e-4)
    along, across = worst_loop(surface, (0.0, 1.0)), worst_loop(surface, (1.0, 0.0))
    assert along.energy == pytest.approx(2 * K * 1e-4 * 2e-5, rel=1e-3)
    assert along.upper_per_period < 2 * K * 1e-4 * 2e-5 * 1.001
    assert across.energy < 1e-9 * along.energy
    with pytest.raises(ParameterError, match="direction"):
        worst_loop(surface, (0.0, 0.0))


def test_the_bound_is_one_per_period() -> None:
    """A simple loop around four periods gains four times as much: a comb whose back is outside."""
    surface = Surface(Sinusoid(A, L), "A", K, D)
    found = worst_loop(surface)
    teeth = [found.vertices + np.array([i * L, 0.0, 0.0]) for i in range(4)]
    # Each begins where the last one ended, a period further on, on the surface itself.
    comb = np.concatenate([np.concatenate([tooth, tooth[:1]]) for tooth in teeth])
    path = np.concatenate([comb, [[x, 0.0, 2e-3] for x in comb[::-1, 0][[0, -1]]]])
    gained = loop_work(surface, path)
    assert gained == pytest.approx(4.0 * found.energy, rel=1e-6)
    assert found.upper_per_period < gained <= 4.0 * found.upper_per_period

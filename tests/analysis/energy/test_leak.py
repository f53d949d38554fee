"""The worst simple loop compared with curl integrals computed by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import dblquad

from asperity.analysis import loop_work
from asperity.analysis.energy.curl_columns import (
    column_polygon,
    curl_integral_bounds,
    sample_curl_integrals,
)
from asperity.analysis.energy.leak import in_plane_loop, orient_loop, worst_loop
from asperity.core.errors import ParameterError
from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures.kinds.fourier import Fourier
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import HeightMap, Profile

K, A, L, D = 1000.0, 0.1e-3, 2e-3, 0.3e-3
TEXTURE = Sinusoid(A, L, direction=(3.0, 4.0))


def loop_energy(letter: str, **arguments: float) -> float:
    return worst_loop(Surface(TEXTURE, letter, K, D, **arguments)).energy


def test_leak_of_law_a_is_the_total_rise_times_the_depth() -> None:
    """∬ k h'⁺ over one period and the depth is k D · 2A."""
    loop = worst_loop(Surface(TEXTURE, "A", K, D))
    exact = 2 * K * D * A
    assert loop.energy <= exact * (1 + 1e-12)
    assert loop.energy == pytest.approx(exact, rel=2e-5)
    assert exact <= loop.upper_per_period <= exact * (1 + 1e-4)


def test_leak_of_law_g_is_the_integral_of_its_curl() -> None:
    g = 2 * math.pi * A / L

    def curl(depth: float, x: float) -> float:
        c, s = math.cos(2 * math.pi * x / L), math.sin(2 * math.pi * x / L)
        slope, hessian = g * c, -g * 2 * math.pi / L * s
        w = math.sqrt(1 + slope**2)
        return K * (slope / w + depth * slope * hessian / w**3)

    expected = dblquad(lambda d, x: max(curl(d, x), 0.0), 0, L, 0, D, epsabs=1e-14)[0]
    assert loop_energy("G") == pytest.approx(expected, rel=2e-3)  # 8 levels of depth


def test_leak_of_law_e_is_the_integral_of_its_curl() -> None:
    """In closest-point coordinates curl = k n_t, area (1 + δκ) ds dδ; the depth excludes ridges."""
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
    energy = worst_loop(Surface(texture, "E", K, depth)).energy
    assert energy == pytest.approx(expected, rel=5e-3)


def test_friction_leak_is_reproduced_by_its_vertices() -> None:
    surface = Surface(TEXTURE, "F", K, D)
    result = worst_loop(surface)
    assert loop_work(surface, result.vertices) == pytest.approx(result.energy, rel=1e-9)
    # Constant modulation: the paper's (27).
    still = worst_loop(Surface(TEXTURE, "F", K, D, modulation_depth=0.0))
    assert still.energy == pytest.approx(K * 0.8 * 0.5 * D * 1e-3 / 2, rel=1e-5)


def test_conservative_laws_have_zero_leak_by_theorem() -> None:
    result = worst_loop(Surface(TEXTURE, "C", K, D))
    assert (result.energy, result.method) == (0.0, "theorem")
    assert (result.vertices.shape, result.length, result.per_length) == ((0, 3), 0.0, 0.0)


def test_loop_without_energy_gain_has_no_vertices() -> None:
    """Covers zero friction, a single vertex, and columns that are all empty."""
    for depth in np.linspace(0.1e-3, 1e-3, 4):  # rounding leaves 1e-20 J at some depths
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
def test_curl_integrals_of_conservative_laws_are_zero(letter: str) -> None:
    """Negative control: the integrals of the curl are zero by theorem."""
    surface = Surface(TEXTURE, letter, K, D)
    line = TEXTURE.scan_line()
    assert max(sample_curl_integrals(surface, line)) < 1e-12 * K * D * A
    bounds = curl_integral_bounds(surface, line)
    assert bounds is not None
    assert max(high for _low, high in bounds) < 1e-6 * K * D * A


def test_loop_around_one_flank_gains_the_energy_of_the_leak() -> None:
    """Law A gains on the rising flank: down on the side of the crest, up on that of the trough."""
    texture = Sinusoid(A, L)
    surface = Surface(texture, "A", K, D)
    x = np.linspace(-L / 4, L / 4, 400)
    h = texture.height(np.column_stack([x, 0 * x]))
    top = np.column_stack([x, 0 * x, h])
    bottom = np.column_stack([x, 0 * x, h - D])[::-1]
    energy = abs(loop_work(surface, np.concatenate([top, bottom])))
    assert energy == pytest.approx(worst_loop(surface).energy, rel=1e-4)


def test_maps_are_searched_along_parallel_lines() -> None:
    """The centre line of the map misses a hump near one edge."""
    y, x = np.mgrid[:41, :41]
    heights = 1e-4 * np.exp(-((x - 20.0) ** 2 + (y - 33.0) ** 2) / 18.0)
    surface = Surface(HeightMap(heights, 1e-4), "A", K, 1e-4)
    result = worst_loop(surface, (1.0, 0.0))
    assert 3.2e-3 < result.line.start[1] < 3.4e-3
    # One rise to the top of the hump; the nearest line passes within 0.06 mm of it.
    assert result.energy == pytest.approx(K * 1e-4 * 1e-4, rel=0.03)


def test_worst_line_may_gain_in_one_direction_only() -> None:
    """A step up of 100 µm, which has no way down, against a hump of 60 µm with both flanks."""
    y, x = np.mgrid[:41, :41]
    step = 1e-4 * 0.5 * (1.0 + np.tanh((x - 20.0) / 4.0)) * np.exp(-((y - 33.0) ** 2) / 18.0)
    hump = 6e-5 * np.exp(-((x - 20.0) ** 2 + (y - 8.0) ** 2) / 18.0)
    result = worst_loop(Surface(HeightMap(step + hump, 1e-4), "A", K, 1e-4), (1.0, 0.0))
    assert 3.1e-3 < result.line.start[1] < 3.5e-3
    assert result.energy == pytest.approx(K * 1e-4 * 1e-4, rel=0.05)


def test_scan_direction_of_a_profile_is_its_own_direction() -> None:
    wave = Fourier([A, A / 2], [[0.0, 3000.0], [0.0, 6000.0]])
    line = worst_loop(Surface(wave, "A", K, D)).line
    np.testing.assert_allclose(np.abs(line.direction), [0.0, 1.0])


@pytest.mark.parametrize("letter", "ABEFG")
def test_work_along_the_vertices_equals_the_energy(letter: str) -> None:
    surface = Surface(Sinusoid(A, L), letter, K, D)
    loop = worst_loop(surface)
    assert loop.energy > 0.0
    assert loop.energy <= loop.upper_per_period
    # E's quadrature stops at 1e-4 of the work of an edge.
    tolerance = 1e-4 if letter == "E" else 1e-9
    assert loop_work(surface, loop.vertices) == pytest.approx(loop.energy, rel=tolerance)


@pytest.mark.parametrize("letter", "ABG")
def test_upper_bound_is_tight(letter: str) -> None:
    """The bound minus twice the gap is below the energy of the polygon."""
    loop = worst_loop(Surface(Fourier([A, A / 2], [3000.0, 6000.0], [0.3, 1.0]), letter, K, D))
    assert loop.method == "certified"
    gap = loop.upper_per_period / loop.energy - 1.0
    assert 0.0 <= gap < 1e-3
    assert loop.upper_per_period * (1 - 2 * gap) < loop.energy


def test_column_polygon_leaves_out_the_widest_gap() -> None:
    """Columns 0, 2, 6 and 7 of a period of 8 give a polygon from 5 across the end to 11."""
    x, full = np.arange(9.0), np.array([1, 0, 1, 0, 0, 0, 1, 1, 1])
    polygon = column_polygon(np.column_stack([x, 0.0 * x]), np.zeros(9), -1.0 * full, periodic=True)
    assert (polygon[:, 0].min(), polygon[:, 0].max()) == (5.0, 11.0)
    assert set(polygon[polygon[:, 2] < 0.0, 0]) == {6.0, 7.0, 8.0, 10.0}


@pytest.mark.parametrize("power", [2, 3])
def test_leak_of_a_law_not_affine_in_depth_is_certified(power: int) -> None:
    """The curl of k δⁿ e_z/Dⁿ⁻¹ is n k δⁿ⁻¹ h'/Dⁿ⁻¹; its integral over a flank is 2A k D."""
    law = Law(
        "Q",
        "power",
        "vertical",
        lambda c: c.k * c.depth * (c.depth / c.parameter("size")) ** (power - 1) * c.e_z,
        parameters={"size": D},
    )
    loop = worst_loop(Surface(Sinusoid(A, L), law, K, D))
    exact = 2 * K * D * A
    assert loop.method == "certified"
    assert exact <= loop.upper_per_period <= exact * 1.01
    assert loop.energy == pytest.approx(exact, rel=1e-3)


def test_force_that_jumps_where_contact_begins_gains_along_the_surface() -> None:
    """Along e_x it is k s h' there, and constant below: in and out of a rising flank, 2 A k s."""
    size = 2e-5
    law = Law(
        "Q",
        "sandpaper",
        "nominal",
        lambda c: c.k * (-c.parameter("size") * c.tangential(c.slope) + c.depth * c.e_z),
        parameters={"size": size},
    )
    surface = Surface(Sinusoid(A, L), law, K, D)
    loop = worst_loop(surface)
    assert (loop.method, loop.upper_per_period) == ("sampled", math.inf)
    assert loop.energy == pytest.approx(2 * A * K * size, rel=1e-3)
    assert loop_work(surface, loop.vertices) == pytest.approx(loop.energy, rel=1e-9)


def test_errors_at_kinks_are_no_gain() -> None:
    """A god-object whose pull saturates has a potential, but its curl is not proved to be zero."""
    law = Law(
        "Q",
        "saturating",
        "nearest",
        lambda c: c.k * c.toward * sp.Piecewise((1, c.depth < 2e-4), (2e-4 / c.depth, True)),
    )
    loop = worst_loop(Surface(Sinusoid(A, 1e-3), law, K, 4e-4))
    assert (loop.method, loop.energy, loop.absorbing.found) == ("sampled", 0.0, 0.0)


def test_critical_speed_balances_the_leak_with_damping() -> None:
    """On a loop of length L at speed v the viscous loss is σ₀ v L."""
    loop = worst_loop(Surface(Sinusoid(A, L), "A", K, D))
    edges = np.linalg.norm(np.roll(loop.vertices, -1, axis=0) - loop.vertices, axis=1)
    assert loop.length == pytest.approx(edges.sum(), rel=1e-12)
    densest = loop.absorbing
    assert loop.critical_speed(2.0) * 2.0 * densest.length == pytest.approx(
        densest.energy, rel=1e-12
    )
    assert densest.found > 1.2 * loop.energy / loop.length
    with pytest.raises(ParameterError, match="damping"):
        loop.critical_speed(0.0)


def test_thrust_of_force_shading_is_zero_on_symmetric_profiles() -> None:
    """The mean thrust is -k D ⟨h'/√(1 + h'²)⟩, which is zero by symmetry for a sinusoid."""
    numbers = np.arange(1.0, 6.0)
    saw = Fourier(A / numbers, 2 * np.pi / L * numbers)
    x = (np.arange(20_000) + 0.5) * L / 20_000
    slope = saw.gradient(np.column_stack([x, 0 * x]))[:, 0]
    expected = -K * D * np.mean(slope / np.sqrt(1 + slope**2))
    thrust = worst_loop(Surface(saw, "G", K, D)).thrust
    assert abs(expected) > 0.04 * K * D
    assert thrust == pytest.approx(expected, rel=1e-9)
    assert worst_loop(Surface(Sinusoid(A, L), "G", K, D)).thrust == pytest.approx(0.0, abs=1e-12)


def test_friction_leaks_at_constant_depth_only_with_modulation() -> None:
    surface = Surface(Sinusoid(0.8e-3, 2e-3), "F", K, 0.8e-3)
    loop = in_plane_loop(surface, surface.texture.scan_line())
    assert loop.energy > 0.3e-3
    assert np.ptp(loop.vertices[1:, 2]) == 0.0
    assert loop_work(surface, loop.vertices) == pytest.approx(loop.energy, rel=1e-9)
    # Without modulation the field in the plane has no curl.
    plain = Surface(Sinusoid(0.8e-3, 2e-3), "F", K, 0.8e-3, modulation_depth=0.0)
    assert abs(in_plane_loop(plain, plain.texture.scan_line()).energy) < 1e-9


def test_leak_plane_follows_the_direction_argument() -> None:
    y = np.mgrid[:24, :24][0]
    waves = HeightMap(2e-5 * np.sin(2 * np.pi * y / 24), 1e-4, periodic=True)
    surface = Surface(waves, "A", K, 1e-4)
    along, across = worst_loop(surface, (0.0, 1.0)), worst_loop(surface, (1.0, 0.0))
    assert along.energy == pytest.approx(2 * K * 1e-4 * 2e-5, rel=1e-3)
    assert along.upper_per_period < 2 * K * 1e-4 * 2e-5 * 1.001
    assert across.energy < 1e-9 * along.energy
    with pytest.raises(ParameterError, match="direction"):
        worst_loop(surface, (0.0, 0.0))


def test_upper_bound_is_per_period() -> None:
    """A loop around four periods (a comb closed outside contact) gains four times the energy."""
    surface = Surface(Sinusoid(A, L), "A", K, D)
    loop = worst_loop(surface)
    teeth = [loop.vertices + np.array([i * L, 0.0, 0.0]) for i in range(4)]
    # Each tooth starts one period after the previous one, at its end on the surface.
    comb = np.concatenate([np.concatenate([tooth, tooth[:1]]) for tooth in teeth])
    path = np.concatenate([comb, [[x, 0.0, 2e-3] for x in comb[::-1, 0][[0, -1]]]])
    energy = loop_work(surface, path)
    assert energy == pytest.approx(4.0 * loop.energy, rel=1e-6)
    assert loop.upper_per_period < energy <= 4.0 * loop.upper_per_period


@pytest.mark.parametrize("periodic", [True, False])
def test_mean_thrust_of_a_conservative_field_is_zero_over_a_period(periodic: bool) -> None:
    """A finite line ends at another height than it begins: its mean force says nothing."""
    x = np.arange(16) / 16
    profile = Profile(A * np.sin(2 * np.pi * x + 0.4), L / 16, periodic=periodic)
    loop = worst_loop(Surface(profile, "C", K, D))
    assert (loop.energy, loop.thrust) == (0.0, 0.0 if periodic else None)


@pytest.mark.parametrize("letter", ["A", "B"])
@pytest.mark.parametrize(("amplitude", "depth"), [(0.8e-3, 8e-8), (4e-3, 4e-9), (0.2e-3, 2e-9)])
def test_shallow_region_of_a_high_texture_keeps_its_proved_bounds(
    letter: str, amplitude: float, depth: float
) -> None:
    """Straight edges of the loop found pass deeper than the region: 2 k A D, k D² (1 - 1/S)."""
    surface = Surface(Sinusoid(amplitude, 2e-3), letter, 1000.0, depth)
    found = worst_loop(surface)
    s = math.hypot(1.0, 2.0 * math.pi * amplitude / 2e-3)
    exact = {"A": 2000.0 * amplitude * depth, "B": 1000.0 * depth**2 * (1.0 - 1.0 / s)}[letter]
    sharp = 1000.0 * depth * {"A": math.sqrt(s * s - 1.0) / s, "B": (s - 1.0) / (s + 1.0)}[letter]
    assert found.energy <= found.upper_per_period == pytest.approx(exact, rel=4e-2)
    assert found.absorbing.found <= found.absorbing.upper == pytest.approx(sharp, rel=1e-6)

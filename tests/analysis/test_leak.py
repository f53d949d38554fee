"""The worst simple loop against integrals of the curl that can be done by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import dblquad

from asperity.analysis import loop_work
from asperity.analysis.columns import curl_integral, sampled_sides
from asperity.analysis.leak import worst_loop
from asperity.surface import Surface
from asperity.textures.fourier import Fourier
from asperity.textures.heightmap import HeightMap
from asperity.textures.sinusoid import Sinusoid

K, A, L, D = 1000.0, 0.1e-3, 2e-3, 0.3e-3
TEXTURE = Sinusoid(A, L, direction=(3.0, 4.0))


def leak(letter: str, **arguments: float) -> float:
    return worst_loop(Surface(TEXTURE, letter, K, D, **arguments)).energy  # type: ignore[arg-type]


def test_a_leaks_the_total_rise_times_the_depth() -> None:
    """∬ k h'⁺ over one period and the depth: k D · 2A."""
    found = worst_loop(Surface(TEXTURE, "A", K, D))
    exact = 2 * K * D * A
    assert found.energy <= exact * (1 + 1e-12)
    assert found.energy == pytest.approx(exact, rel=2e-5)
    assert exact <= found.upper <= exact * (1 + 1e-4)


def test_g_leaks_the_integral_of_its_curl() -> None:
    g = 2 * math.pi * A / L

    def curl(depth: float, x: float) -> float:
        c, s = math.cos(2 * math.pi * x / L), math.sin(2 * math.pi * x / L)
        slope, bend = g * c, -g * 2 * math.pi / L * s
        w = math.sqrt(1 + slope**2)
        return K * (slope / w + depth * slope * bend / w**3)

    expected = dblquad(lambda d, x: max(curl(d, x), 0.0), 0, L, 0, D, epsabs=1e-14)[0]
    assert leak("G") == pytest.approx(expected, rel=2e-3)  # 8 levels of depth


def test_e_leaks_the_integral_of_its_curl() -> None:
    """In coordinates of the foot: curl = k n_t, area (1 + δκ) ds dδ; shallow, so no ridge."""
    depth = 0.05e-3
    texture = Sinusoid(A, L)
    x = (np.arange(4000) + 0.5) * L / 4000
    derivatives = texture.derivatives(np.column_stack([x, 0 * x]))
    slope, bend = derivatives[:, 1], derivatives[:, 3]
    s = np.sqrt(1 + slope**2)
    kappa = bend / s**3
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


@pytest.mark.parametrize("letter", "CW")
def test_a_field_without_curl_is_measured_as_zero(letter: str) -> None:
    """Negative control: the integrals of the curl are zero where the theorem says so."""
    surface = Surface(TEXTURE, letter, K, D)
    line = TEXTURE.scan_line()
    assert max(sampled_sides(surface, line)) < 1e-12 * K * D * A
    bounds = curl_integral(surface, line)
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

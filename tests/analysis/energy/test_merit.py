"""Strength and support compared with MATH section 6 and with scans computed by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from asperity.analysis.energy.straight_scan import merit, parallel_line_points
from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures.domain import ScanLine
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import HeightMap
from asperity.textures.texture import Texture

PERIOD = 2e-3
WAVE = Sinusoid(0.2 * PERIOD, PERIOD, direction=(1.0, 1.0))
# Depth 0.25 l below the troughs: z = -0.45 l for every contact.
BELOW_CREST, BELOW_NOMINAL = 0.65 * PERIOD, 0.45 * PERIOD


@pytest.mark.parametrize(
    ("letter", "strength", "support"),
    [
        ("A", 0.088, 0.62),
        ("B", 0.062, 0.15),
        ("C", 0.084, 0.19),
        ("D", 0.0, 0.0),
        ("E", 0.072, 0.85),
        ("G", 0.080, 0.22),
        ("H", 0.117, 0.89),
    ],
)
def test_reference_values_of_strength_and_support(
    letter: str, strength: float, support: float
) -> None:
    """Values of MATH section 6; for G it prints a support of .21, the value is 0.2190."""
    depth = BELOW_NOMINAL if letter == "G" else BELOW_CREST
    result = merit(Surface(WAVE, letter, max_depth=depth))
    assert result.strength == pytest.approx(strength, abs=6e-4)
    assert result.support == pytest.approx(support, abs=6e-3)
    assert result.contact_lost == 0.0


def test_merit_of_law_a_by_hand() -> None:
    result = merit(Surface(WAVE, "A", max_depth=BELOW_CREST))
    gain = math.hypot(1.0, 2 * math.pi * 0.2)
    assert result.gain == pytest.approx(gain, rel=1e-12)
    assert result.ripple == pytest.approx(WAVE.amplitude / math.sqrt(2), rel=1e-9)
    assert result.support == pytest.approx(1.0 / gain, rel=1e-12)


def test_support_of_law_g_by_hand() -> None:
    """The support is ⟨1/√(1 + g²)⟩ / max(1, y) with g = G₁ cos and y = D K."""
    result = merit(Surface(WAVE, "G", max_depth=BELOW_NOMINAL))
    slope = 2 * math.pi * 0.2 * np.cos(2 * math.pi * (np.arange(1000) + 0.5) / 1000)
    y = BELOW_NOMINAL * 4 * math.pi**2 * WAVE.amplitude / PERIOD**2
    assert result.support == pytest.approx(float(np.mean(1 / np.sqrt(1 + slope**2))) / y, rel=1e-9)


def test_support_is_the_slope_of_the_mean_force() -> None:
    for letter in "BE":
        forces = []
        for depth in (BELOW_CREST * 0.999, BELOW_CREST * 1.001):
            t = (np.arange(4000) + 0.5) / 4000 * PERIOD
            points = np.column_stack(
                [np.outer(t, WAVE.direction), np.full(4000, WAVE.amplitude - depth)]
            )
            forces.append(Surface(WAVE, letter, stiffness=1.0).force(points)[:, 2].mean())
        slope = (forces[1] - forces[0]) / (0.002 * BELOW_CREST)
        result = merit(Surface(WAVE, letter, max_depth=BELOW_CREST))
        assert result.support * result.gain == pytest.approx(slope, rel=1e-4)


def test_smooth_wall_has_no_texture() -> None:
    result = merit(Surface(WAVE, "W", max_depth=1e-3))
    assert (result.strength, result.support) == (0.0, 1.0)


def test_contact_lost_is_the_fraction_out_of_contact() -> None:
    """At half the amplitude below the crest, contact holds where sin > 1/2, a third of the line."""
    result = merit(Surface(WAVE, "A", max_depth=0.5 * WAVE.amplitude))
    assert result.contact_lost == pytest.approx(2 / 3, abs=1e-3)


def test_strength_of_a_map_is_in_metres() -> None:
    """The heights are cosines of x alone, so every parallel line has the same sinusoid."""
    x = np.arange(41) / 40
    heights = np.tile(1e-4 * np.cos(2 * np.pi * 2 * x), (41, 1))
    result = merit(Surface(HeightMap(heights, 1e-4), "A", max_depth=4e-4))
    assert result.ripple == pytest.approx(1e-4 / math.sqrt(2), rel=1e-3)
    assert result.strength == pytest.approx(result.ripple / result.gain, rel=1e-12)


def test_constant_force_has_zero_strength_and_support():
    law = Law("K", "constant", "vertical", lambda c: c.k * 1e-3 * c.e_z)
    result = merit(Surface(Sinusoid(0.2e-3, 1e-3), law))
    assert (result.gain, result.strength, result.support) == (0.0, 0.0, 0.0)


def test_small_ripple_on_a_large_force_is_resolved() -> None:
    """An amplitude of 100 nm at a depth of 1 mm still has ripple A/√2."""
    faint = Sinusoid(1e-7, PERIOD)
    result = merit(Surface(faint, "A", max_depth=1e-3))
    assert result.ripple == pytest.approx(1e-7 / math.sqrt(2), rel=1e-6)


RIDGES = np.cos(np.arange(33) * 0.7) * np.linspace(0.2, 1.0, 25)[:, None]
SLOPED = HeightMap(5e-5 * RIDGES + 2e-5 * np.arange(25)[:, None], 1e-4)


@pytest.mark.parametrize("letter", ["A", "C", "F"])
@pytest.mark.parametrize("texture", [SLOPED, WAVE], ids=["map", "wave"])
def test_ripple_subtracts_the_mean_of_each_parallel_line(letter: str, texture: Texture) -> None:
    """All three force components count; the lines of a map are evenly spaced across it."""
    surface = Surface(texture, letter, 800.0, max_depth=1e-3, max_deflection=0.3e-3)
    line, high = texture.scan_line(), surface.law.contact.extremes(texture)[1]
    across = [np.zeros(2)]
    if not texture.is_profile:
        across = [np.array([0.0, (i + 0.5) / 16 * 2.4e-3]) for i in range(16)]
    t = (np.arange(2048) + 0.5) / 2048 * line.length
    squares, slopes = [], []
    for shift in across:
        xy = line.start * (len(across) == 1) + t[:, None] * line.direction + shift
        points = np.column_stack([xy, np.full(len(t), high - 1e-3)])
        trailing = np.tile(0.3e-3 * line.direction, (len(t), 1)) if letter == "F" else None
        force, jacobian = surface.force_and_jacobian(points, trailing)
        squares.append(force.var(axis=0).sum())
        slopes.append(-jacobian[:, 2, 2].mean())
    result = merit(surface)
    assert result.ripple == pytest.approx(math.sqrt(np.mean(squares)) / 800.0, rel=2e-3)
    assert result.support * result.gain == pytest.approx(np.mean(slopes) / 800.0, rel=1e-9)
    assert result.height == pytest.approx(high - 1e-3, rel=1e-12)


def test_parallel_lines_are_evenly_spaced_over_the_domain() -> None:
    """Also for a periodic map, and for a scan along y."""
    periodic = HeightMap(5e-5 * RIDGES[:24, :32], 1e-4, periodic=True)
    lines = parallel_line_points(periodic, periodic.scan_line(), 8)
    assert lines.shape == (16, 8, 2)
    spread = np.sort(lines[:, 0, 1] % 2.4e-3)
    np.testing.assert_allclose(spread, (np.arange(16) + 0.5) / 16 * 2.4e-3, atol=1e-12)
    upward = ScanLine(np.array([0.4e-3, 0.2e-3]), np.array([0.0, 1.0]), 2.4e-3, periodic=False)
    lines = parallel_line_points(SLOPED, upward, 8)
    np.testing.assert_allclose(lines[:, 0, 0], (np.arange(16) + 0.5) / 16 * 3.2e-3, atol=1e-12)


def test_numbers_of_a_user_defined_law_do_not_depend_on_its_stiffness() -> None:
    """Shipped laws are scanned at unit stiffness, a law of unknown formula at its own."""
    user_law = Law("V", "own", "vertical", lambda c: c.k * c.depth * c.w)
    own, shipped = (
        merit(Surface(WAVE, law, stiffness, BELOW_CREST))
        for law, stiffness in ((user_law, 700.0), ("C", 1.0))
    )
    for name in ("strength", "support", "ripple", "gain"):
        assert getattr(own, name) == pytest.approx(getattr(shipped, name), rel=2e-3), name

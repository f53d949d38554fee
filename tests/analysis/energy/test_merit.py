"""Strength and support against MATH section 6, and against scans done by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from asperity.analysis.energy.merit import merit, parallel_line_points
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
def test_reference_points(letter: str, strength: float, support: float) -> None:
    """MATH section 6; for G it prints a support of .21, the value is 0.2190."""
    depth = BELOW_NOMINAL if letter == "G" else BELOW_CREST
    found = merit(Surface(WAVE, letter, max_depth=depth))
    assert found.strength == pytest.approx(strength, abs=6e-4)
    assert found.support == pytest.approx(support, abs=6e-3)
    assert found.contact_lost == 0.0


def test_a_by_hand() -> None:
    found = merit(Surface(WAVE, "A", max_depth=BELOW_CREST))
    gain = math.hypot(1.0, 2 * math.pi * 0.2)
    assert found.gain == pytest.approx(gain, rel=1e-12)
    assert found.ripple == pytest.approx(WAVE.amplitude / math.sqrt(2), rel=1e-9)
    assert found.support == pytest.approx(1.0 / gain, rel=1e-12)


def test_g_by_hand() -> None:
    """⟨1/√(1 + g²)⟩ over max(1, y), g = G₁ cos, y = D K."""
    found = merit(Surface(WAVE, "G", max_depth=BELOW_NOMINAL))
    slope = 2 * math.pi * 0.2 * np.cos(2 * math.pi * (np.arange(1000) + 0.5) / 1000)
    y = BELOW_NOMINAL * 4 * math.pi**2 * WAVE.amplitude / PERIOD**2
    assert found.support == pytest.approx(float(np.mean(1 / np.sqrt(1 + slope**2))) / y, rel=1e-9)


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
        found = merit(Surface(WAVE, letter, max_depth=BELOW_CREST))
        assert found.support * found.gain == pytest.approx(slope, rel=1e-4)


def test_smooth_wall_has_no_texture() -> None:
    found = merit(Surface(WAVE, "W", max_depth=1e-3))
    assert (found.strength, found.support) == (0.0, 1.0)


def test_lost_contact_is_counted() -> None:
    """Pressed to half the amplitude below the crest, contact lasts where sin > 1/2: a third."""
    found = merit(Surface(WAVE, "A", max_depth=0.5 * WAVE.amplitude))
    assert found.contact_lost == pytest.approx(2 / 3, abs=1e-3)


def test_a_map_has_strength_in_metres() -> None:
    """Heights in cosines of x alone: every parallel line sees the same sinusoid, mirrored."""
    x = np.arange(41) / 40
    heights = np.tile(1e-4 * np.cos(2 * np.pi * 2 * x), (41, 1))
    found = merit(Surface(HeightMap(heights, 1e-4), "A", max_depth=4e-4))
    assert found.ripple == pytest.approx(1e-4 / math.sqrt(2), rel=1e-3)
    assert found.strength == pytest.approx(found.ripple / found.gain, rel=1e-12)


def test_a_force_that_nowhere_varies_has_neither_strength_nor_support():
    law = Law("K", "constant", "vertical", lambda c: c.k * 1e-3 * c.e_z)
    found = merit(Surface(Sinusoid(0.2e-3, 1e-3), law))
    assert (found.gain, found.strength, found.support) == (0.0, 0.0, 0.0)


def test_a_faint_ripple_on_a_large_force_counts() -> None:
    """A hundred nanometres under a millimetre: the ripple is A/√2 all the same."""
    faint = Sinusoid(1e-7, PERIOD)
    found = merit(Surface(faint, "A", max_depth=1e-3))
    assert found.ripple == pytest.approx(1e-7 / math.sqrt(2), rel=1e-6)


RIDGES = np.cos(np.arange(33) * 0.7) * np.linspace(0.2, 1.0, 25)[:, None]
SLOPED = HeightMap(5e-5 * RIDGES + 2e-5 * np.arange(25)[:, None], 1e-4)


@pytest.mark.parametrize("letter", ["A", "C", "F"])
@pytest.mark.parametrize("texture", [SLOPED, WAVE], ids=["map", "wave"])
def test_ripple_of_parallel_lines_each_with_its_own_mean(letter: str, texture: Texture) -> None:
    """All three components count; the lines of a map are spread evenly from border to border."""
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
    found = merit(surface)
    assert found.ripple == pytest.approx(math.sqrt(np.mean(squares)) / 800.0, rel=2e-3)
    assert found.support * found.gain == pytest.approx(np.mean(slopes) / 800.0, rel=1e-9)
    assert found.height == pytest.approx(high - 1e-3, rel=1e-12)


def test_lines_of_a_map_are_those_of_its_domain() -> None:
    """Of a map that begins elsewhere and repeats, too, and across whichever way the scan goes."""
    periodic = HeightMap(5e-5 * RIDGES[:24, :32], 1e-4, periodic=True)
    lines = parallel_line_points(periodic, periodic.scan_line(), 8)
    assert lines.shape == (16, 8, 2)
    spread = np.sort(lines[:, 0, 1] % 2.4e-3)
    np.testing.assert_allclose(spread, (np.arange(16) + 0.5) / 16 * 2.4e-3, atol=1e-12)
    upward = ScanLine(np.array([0.4e-3, 0.2e-3]), np.array([0.0, 1.0]), 2.4e-3, periodic=False)
    lines = parallel_line_points(SLOPED, upward, 8)
    np.testing.assert_allclose(lines[:, 0, 0], (np.arange(16) + 0.5) / 16 * 3.2e-3, atol=1e-12)

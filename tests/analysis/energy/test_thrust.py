"""The mean thrust, the loop search for the nearest contact, and their witnesses."""

from __future__ import annotations

import math

import numpy as np
import pytest

from asperity.analysis import loop_work
from asperity.analysis.energy import leak
from asperity.analysis.energy.absorbing_friction import region_floor
from asperity.analysis.energy.curl_columns import (
    curl_region_loop,
    plane_curl,
    positive_interval,
    sample_curl_integrals,
)
from asperity.analysis.energy.leak import worst_loop
from asperity.surface import Surface
from asperity.textures.domain import ScanLine
from asperity.textures.kinds.fourier import Fourier

K, L, D = 1000.0, 2e-3, 0.3e-3
KEY = 2 * math.pi / L
# An asymmetric profile along an oblique line.
ACROSS = np.array([0.6, 0.8])
SAW = Fourier([0.05e-3, 0.025e-3], np.outer([KEY, 2 * KEY], ACROSS), [0.0, 0.4])


def mean_thrust_by_sampling(
    surface: Surface, direction: np.ndarray, start: np.ndarray, length: float
) -> float:
    """Return the mean of f · t on a line at z = max h - D, or -D on the nominal contact."""
    t = (np.arange(20_000) + 0.5) / 20_000 * length
    xy = start + t[:, None] * direction
    height = surface.law.contact.extremes(surface.texture)[1] - D
    force = surface.force(np.column_stack([xy, np.full(len(t), height)]))
    return float((force[:, :2] @ direction).mean())


@pytest.mark.parametrize("letter", ["A", "B", "G", "E"])
def test_thrust_is_the_mean_tangential_force_along_the_line(letter: str) -> None:
    surface = Surface(SAW, letter, K, D)
    loop = worst_loop(surface)
    expected = mean_thrust_by_sampling(
        surface, loop.line.direction, loop.line.start, loop.line.length
    )
    assert loop.thrust == pytest.approx(expected, abs=1e-7 * K * D)
    assert letter != "G" or abs(expected) > 1e-3 * K * D


@pytest.mark.parametrize("letter", ["D", "H"])
def test_mean_thrust_of_laws_on_the_nearest_contact(letter: str) -> None:
    """The line is half a period long, so that the mean is not zero."""
    surface = Surface(SAW, letter, K, D)
    line = ScanLine(np.zeros(2), ACROSS, 0.5 * L, periodic=False)
    expected = mean_thrust_by_sampling(surface, ACROSS, np.zeros(2), 0.5 * L)
    assert abs(expected) > 5e-3 * K * D
    assert leak._mean_thrust(surface, line) == pytest.approx(expected, rel=1e-4)


def test_region_depth_is_at_distance_max_depth_from_the_surface() -> None:
    surface = Surface(SAW, "E", K, D)
    xy = np.random.default_rng(0).uniform(0.0, L, (50, 2))
    points = np.column_stack([xy, region_floor(surface, xy)])
    distance = np.linalg.norm(SAW.nearest(points) - points, axis=1)
    assert (distance <= D).all()
    assert distance == pytest.approx(D, rel=1e-4)


def test_work_around_outlines_equals_their_estimates() -> None:
    """∬|curl| of one sign from the grid, the work around the polygon and dense samples."""
    surface = Surface(SAW, "E", K, D)
    line = SAW.scan_line()
    outlines = list(leak._nearest_outlines(surface, line))
    t = (np.arange(400) + 0.5) / 400 * line.length
    xy = line.start + t[:, None] * line.direction
    tops = SAW.height(xy)
    depth = tops - region_floor(surface, xy)
    total = np.zeros(2)
    for part in (np.arange(100) + 0.5) / 100:
        points = np.column_stack([xy, tops - part * depth])
        curl = plane_curl(surface.jacobian(points), line) * depth
        total += [np.maximum(curl, 0.0).mean(), np.maximum(-curl, 0.0).mean()]
    for (estimate, polygon, outline_line), expected in zip(
        outlines, total * line.length / 100, strict=True
    ):
        assert outline_line is line
        assert estimate == pytest.approx(expected, rel=0.03)
        _vertices, work = leak.orient_loop(surface, polygon)
        assert work == pytest.approx(expected, rel=0.01)


def test_worst_loop_uses_the_outline_with_the_largest_estimate(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    surface = Surface(SAW, "E", K, D)
    small, large = (
        np.array([[0, 0, -D], [x, 0, -D], [x, 0, -0.5 * D]]) for x in (0.1 * L, 0.3 * L)
    )
    line = SAW.scan_line()
    outlines = [(1.0, small, line), (3.0, large, line), (2.0, small, line)]
    monkeypatch.setattr(leak, "_nearest_outlines", lambda _surface, _line: iter(outlines))
    assert np.ptp(worst_loop(surface).vertices[:, 0]) == pytest.approx(0.3 * L)


def test_positive_interval_is_the_longest_of_each_column() -> None:
    """Cases: a long then a short interval, positive from the top, to the bottom, nowhere."""
    levels = [0.0, 1.0, 2.0, 3.0, 4.0]
    columns = [
        [-1.0, 1.0, 1.0, -1.0, 0.5],
        [2.0, -2.0, -1.0, -1.0, -1.0],
        [-1.0, -1.0, -1.0, 1.0, 1.0],
        [-1.0, -1.0, 0.0, -1.0, -1.0],
    ]
    top, bottom = positive_interval(levels, np.array(columns).T)
    np.testing.assert_allclose(top, [0.5, 0.0, 2.5, 0.0])
    np.testing.assert_allclose(bottom, [2.5, 0.5, 4.0, 0.0])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_columns_below_the_surface_gain_the_curl_inside(sign: float) -> None:
    """On steep flanks the curl of G changes sign with depth: columns start below the surface."""
    surface = Surface(Fourier([0.3e-3, 0.15e-3], [3000.0, 6000.0], [0.3, 1.0]), "G", K, 1e-3)
    line = surface.texture.scan_line()
    vertices = curl_region_loop(surface, line, sign)
    depth = surface.texture.height(np.ascontiguousarray(vertices[:, :2])) - vertices[:, 2]
    assert (np.abs(depth - 0.5e-3) < 0.4e-3).sum() > 100
    energy, estimates = loop_work(surface, vertices), sample_curl_integrals(surface, line)
    assert abs(energy) == pytest.approx(estimates[0 if sign > 0.0 else 1], rel=1e-4)

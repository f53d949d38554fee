"""Loops between two heights of each column of a plane grid."""

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from asperity.certification import loop_search
from asperity.certification.column_loops import find_circulations, find_column_loops
from asperity.certification.region import Region, RendererCalls
from asperity.certification.renderers import FunctionRenderer
from asperity.certification.resolution import Resolution
from asperity.core.checks import FloatArray


@pytest.mark.parametrize("seed", range(5))
def test_heights_are_those_of_the_best_sum_of_neighbours(seed: int) -> None:
    random = np.random.default_rng(seed)
    columns, rows = 30, 12
    circulations = random.normal(size=(columns, rows))
    circulations[::4, 8:] = np.nan  # outside of the region
    circulations[5, :3] = np.nan
    circulations[9] = -1.0
    loops = find_column_loops(np.eye(3), circulations)
    for column, values in enumerate(circulations):
        inside = np.flatnonzero(np.isfinite(values))
        best = 0.0
        for start in inside:
            best = max(best, float(np.nancumsum(values[start:]).max()))
        assert loops.works[column] == pytest.approx(best, abs=1e-12)
        low = rows * loops.forwards[column]
        high = rows * loops.backwards[column]
        if best == 0.0:
            assert low == high == inside[0] + 0.5
            continue
        assert np.nansum(values[max(round(low), 0) : round(high)]) == pytest.approx(best, abs=1e-12)
        # At the border of the region a way is a cell beyond it, where the path is cut.
        assert inside[0] - 1 <= low < high <= inside[-1] + 2
        assert round(low) != inside[0]
        assert round(high) != inside[-1] + 1


def test_ways_pass_neither_gaps_within_columns_nor_columns_without_a_common_height() -> None:
    circulations = np.full((6, 9), np.nan)
    circulations[:4, :3] = 1.0
    circulations[:4, 5:] = -1.0
    circulations[:4, 7] = 2.5  # less than the lower part
    circulations[4:, 5:] = 1.0  # as much, in fewer columns
    loops = find_column_loops(np.eye(3), circulations)
    assert loops.works.tolist() == [3.0, 3.0, 3.0, 3.0, 0.0, 0.0]
    circulations[3, 3:5] = -1e-3  # joins all
    joined = find_column_loops(np.eye(3), circulations)
    assert joined.works.tolist() == pytest.approx([3.0, 3.0, 3.0, 3.498, 4.0, 4.0])


def test_ways_along_one_height_enclose_no_area() -> None:
    circulations = np.full((4, 3), -1.0)
    loops = find_column_loops(np.eye(3), circulations)
    assert not loops.encloses_area(0, 4)
    circulations[2, 1] = 1.0
    loops = find_column_loops(np.eye(3), circulations)
    assert loops.encloses_area(0, 4)
    assert loops.encloses_area(2, 3)
    assert not loops.encloses_area(2, 2)


def test_loop_follows_the_border_of_the_region_between_the_nodes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A constant curl c gains c times the area: that of the region between two waves."""
    monkeypatch.setattr(loop_search, "time", SimpleNamespace(monotonic=lambda: 0.0))
    monkeypatch.setattr(RendererCalls, "rate", 1e5)

    def force(points: FloatArray) -> FloatArray:
        return 1e3 * points[:, 2:] * [1.0, 0.0, 0.0]

    def inside(points: FloatArray) -> NDArray[np.bool_]:
        wave = 0.5e-3 * np.sin(6e3 * points[:, 0])
        return np.asarray(np.abs(points[:, 2] - wave) < 0.3e-3)

    corner = np.full(3, 1e-3)
    calls = RendererCalls(FunctionRenderer(force), Region(-corner, corner, inside))
    resolution = Resolution(0.0, (0.0, 0.0, 0.0), 0.0, 1e-7)
    search = loop_search.LoopSearch(calls, resolution, 0.0, seed=0)
    plane = np.array([[-1e-3, 0.0, -1e-3], [2e-3, 0.0, 0.0], [0.0, 0.0, 2e-3]])
    search._record_columns(-find_circulations(calls, plane, 80), plane)
    assert search.best is not None
    area = 0.6e-3 * 2e-3
    assert 0.95 * 1e3 * area < search.best.energy <= 1e3 * area


def two_walls(points: FloatArray) -> FloatArray:
    """Return the force of walls of 800 and 1200 N/m beside each other [N]."""
    stiffness = np.where(points[:, 0] > 0.13e-3, 1200.0, 800.0)
    return stiffness[:, None] * np.maximum(-points[:, 2:], 0.0) * [0.0, 0.0, 1.0]


def roof(points: FloatArray) -> FloatArray:
    """Return the force of a potential |x| (1 + z): it jumps, and no closed path gains [N]."""
    x, _y, z = (1e3 * points).T
    return np.column_stack([-0.2 * np.sign(x - 0.13) * (1.0 + z), 0.0 * x, -0.2 * np.abs(x - 0.13)])


@pytest.mark.parametrize("cells", [32, 81])
def test_gain_within_one_column_is_found(cells: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Into the soft wall, out of the stiff one beside it; a potential with an edge gains none."""
    monkeypatch.setattr(loop_search, "time", SimpleNamespace(monotonic=lambda: 0.0))
    monkeypatch.setattr(RendererCalls, "rate", 1e5)
    corner = np.array([1e-3, 1e-3, 0.5e-3])
    plane = np.array([[-1e-3, 0.0, -0.5e-3], [2e-3, 0.0, 0.0], [0.0, 0.0, 1e-3]])
    gains = []
    for force in (two_walls, roof):
        calls = RendererCalls(FunctionRenderer(force), Region(-corner, corner))
        resolution = Resolution(0.0, (0.0, 0.0, 0.0), 0.0, 1e-7)
        search = loop_search.LoopSearch(calls, resolution, 0.0, seed=0)
        circulations = find_circulations(calls, plane, cells)
        for sign in (1.0, -1.0):
            search._record_columns(sign * circulations, plane)
        gains.append(0.0 if search.best is None else search.best.energy)
    exact = 0.5 * (1200.0 - 800.0) * 0.5e-3**2
    assert 0.9 * exact < gains[0] <= 1.000001 * exact
    assert gains[1] == 0.0


@pytest.mark.parametrize(("last", "counts"), [(0.1, False), (1.1, True)])
def test_works_that_agree_by_chance_are_refined_once_more(
    monkeypatch: pytest.MonkeyPatch, last: float, counts: bool
) -> None:
    corner = np.ones(3)
    calls = RendererCalls(FunctionRenderer(np.zeros_like), Region(-corner, corner))
    resolution = Resolution(0.0, (0.0, 0.0, 0.0), 0.0, 1e-7)
    search = loop_search.LoopSearch(calls, resolution, 0.0, seed=0)
    works = iter([1.0, 1.05, 1.1, last, last])
    monkeypatch.setattr(search, "_turn_works", lambda _path: (np.array([next(works)]), np.zeros(1)))
    assert search.measure(np.eye(3)).counts is counts


def vortex_force(points: FloatArray) -> FloatArray:
    """Return a force that circulates around a vertical tube off the axes of the region [N]."""
    across = (points[:, 0] + points[:, 1]) / math.sqrt(2.0) - 3e-4
    along = (points[:, 0] - points[:, 1]) / math.sqrt(2.0)
    height = points[:, 2] - 2e-4
    size = 1e3 * np.exp(-(across**2 + height**2) / (2e-4) ** 2 - along**2 / (1e-4) ** 2)
    horizontal = -size * height / math.sqrt(2.0)
    return np.stack([horizontal, horizontal, size * across], axis=1)


def test_planes_climb_to_an_oblique_circulation(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock stands still and the rate is stated, so that nothing depends on the machine."""
    monkeypatch.setattr(loop_search, "time", SimpleNamespace(monotonic=lambda: 0.0))
    monkeypatch.setattr(RendererCalls, "rate", 1e6)
    corner = np.full(3, 1e-3)
    calls = RendererCalls(FunctionRenderer(vortex_force), Region(-corner, corner))
    resolution = Resolution(0.0, (0.0, 0.0, 0.0), 0.0, 1e-7)
    search = loop_search.LoopSearch(calls, resolution, 0.0, seed=0)
    search._search_planes(3.0)
    # The curl of the plane through the axis is positive within the radius: its work is 2πk a²/e.
    expected = 2.0 * math.pi * 1e3 * (2e-4) ** 2 / math.e
    assert search.best is not None
    assert search.densest is not None
    assert 0.99 * expected < search.best.energy <= 1.001 * expected
    assert search.densest.density >= search.best.density


RADIUS = 5e-4
RING = 8e-5
"""Radius of a ring in which a force goes round, and its thickness [m]."""


def ring_force(points: FloatArray) -> FloatArray:
    """Return a force of 1 N at most that goes round in a thin ring [N]."""
    radius = np.hypot(points[:, 0], points[:, 1])
    size = np.exp(-((radius - RADIUS) ** 2 + points[:, 2] ** 2) / RING**2) / (radius + 1e-9)
    return np.stack([-size * points[:, 1], size * points[:, 0], 0.0 * size], axis=1)


def test_polygons_get_vertices_to_wind_twice_in_a_ring(monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight vertices make little more than a turn; the clock counts how often it is asked."""
    monkeypatch.setattr(loop_search, "time", SimpleNamespace(monotonic=itertools.count().__next__))
    monkeypatch.setattr(RendererCalls, "rate", 1e6)
    corner = np.full(3, 1e-3)
    calls = RendererCalls(FunctionRenderer(ring_force), Region(-corner, corner))
    calls.approaches = True
    search = loop_search.LoopSearch(calls, Resolution(0.0, (0.0, 0.0, 0.0), 0.0, 1e-7), 0.0, seed=0)
    search._search_polygons(1500.0)
    assert search.best is not None
    assert search.best.energy > 1.8 * 2.0 * math.pi * RADIUS

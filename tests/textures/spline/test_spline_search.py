"""Narrowing of boxes and the certificate: dropped cells contain no closer point."""

from __future__ import annotations

import math

import numpy as np
import pytest

from asperity.contacts import closest_search, distance_bounds
from asperity.core.checks import FloatArray
from asperity.textures import HeightMap
from asperity.textures.spline import heightmap_sampler as heightmap
from asperity.textures.spline import spline_pruning as pruning
from asperity.textures.spline import spline_search as search
from asperity.textures.spline.bspline_kernels import SplineArguments, cell_counts
from asperity.textures.spline.pyramid import plane_pyramid

PITCH = (50e-6, 70e-6)
Point = tuple[float, float, float, float, float, float]
Ball = tuple[float, float, float, float]
Window = tuple[int, int, int, int]  # first and last column and row of cells


def rough_map(seed: int, height: float = 60e-6) -> HeightMap:
    """Return a random map of 25 x 38 nodes, correlated over a few nodes."""
    from scipy.ndimage import gaussian_filter

    noise = gaussian_filter(np.random.default_rng(seed).standard_normal((25, 38)), 2.0)
    return HeightMap(height * noise / noise.std(), PITCH, origin=(1e-3, -2e-3))


def cells(texture: HeightMap) -> tuple[int, int]:
    return cell_counts(texture.arguments)


def min_squared_distances(texture: HeightMap, probe: FloatArray, finer: int = 8) -> FloatArray:
    """Return the minimum of φ on a grid in each cell, shape (ny, nx)."""
    nx, ny = cells(texture)
    share = (np.arange(finer) + 0.5) / finer
    x = texture.origin[0] + PITCH[0] * (np.arange(nx)[:, None] + share).ravel()
    y = texture.origin[1] + PITCH[1] * (np.arange(ny)[:, None] + share).ravel()
    xy = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    phi = ((np.column_stack([xy, texture.height(xy)]) - probe) ** 2).sum(axis=1)
    return phi.reshape(ny, finer, nx, finer).min(axis=(1, 3))


def is_empty(window: Window) -> bool:
    return window[0] > window[1] or window[2] > window[3]


def shrink_to_cells(ball: Ball, gap: float, window: Window, record: SplineArguments) -> Window:
    """Return the cells that have a coefficient below the ball's r²."""
    x, y, z, threshold = ball
    u, v = (x - record.x0) * record.ix, (y - record.y0) * record.iy
    return pruning.shrink_to_cells(u, v, z, threshold, gap, *window, record)


def shrink_to_boxes(ball: Ball, level: int, window: Window, record: SplineArguments) -> Window:
    """Return the boxes of a level whose least and greatest height reach into the ball."""
    frame = search.search_frame(ball[0], ball[1], record)
    side = 1 << level
    columns, rows = [], []
    for i in range(window[2], window[3] + 1, side):
        for j in range(window[0], window[1] + 1, side):
            east, north = min(j + side, window[1] + 1), min(i + side, window[3] + 1)
            box = (float(j), float(east), float(i), float(north))
            bounds = search.enclose_box(box, record)
            if closest_search.distance_to_box(ball, frame, box, bounds) < ball[3]:
                columns += [j, east - 1]
                rows += [i, north - 1]
    return (min(columns), max(columns), min(rows), max(rows)) if rows else (1, 0, 1, 0)


def is_unique_minimum(
    x: float, y: float, z: float, best: Point, window: Window, record: SplineArguments
) -> bool:
    """Return whether the bounds of second and third derivatives certify a minimum."""
    west, east, south, north = map(float, window)
    box = (west, east + 1.0, south, north + 1.0)
    frame = search.search_frame(x, y, record)
    minimum = closest_search.minimum_at((x, y, z), frame, best, record)
    bounds = search.enclose_box(box, record)
    return closest_search.excludes_box((x, y, z, best[2]), frame, minimum, box, bounds, record)


def min_outside(phi: FloatArray, left: Window) -> float:
    """Return the minimum of φ over the cells outside a window."""
    west, east, south, north = left
    rest = phi.copy()
    if not is_empty(left):
        rest[south : north + 1, west : east + 1] = np.inf
    return float(rest.min())


def random_probes(texture: HeightMap, rng: np.random.Generator, count: int) -> FloatArray:
    nx, ny = cells(texture)
    xy = texture.origin + rng.uniform(-0.1, 1.1, (count, 2)) * np.array([nx, ny]) * PITCH
    below = rng.uniform(-0.1e-3, 0.7e-3, count)
    return np.column_stack([xy, texture.height(xy) - below])


@pytest.mark.parametrize("method", ["cells", "boxes"])
def test_dropped_cells_contain_no_closer_point(method: str) -> None:
    """For any g and best point; the negative control uses a smaller threshold."""
    rng = np.random.default_rng(51)
    dropped, lost = 0, 0
    for seed in range(4):
        texture = rough_map(seed)
        nx, ny = cells(texture)
        whole = (0, nx - 1, 0, ny - 1)
        for probe in random_probes(texture, rng, 25):
            phi = min_squared_distances(texture, probe)
            threshold = float(phi.min()) * rng.uniform(0.9, 1.3)
            g = rng.choice([1.0, 0.9, -0.3]) * float(texture.height(probe[None, :2])[0] - probe[2])
            level = int(rng.integers(1, 4))
            for share in (1.0, 0.8):
                ball = (*map(float, probe), share * threshold)
                if method == "cells":
                    left = shrink_to_cells(ball, g, whole, texture.arguments)
                else:
                    left = shrink_to_boxes(ball, level, whole, texture.arguments)
                least = min_outside(phi, left)
                if share == 1.0:
                    assert least >= threshold
                    dropped += least < np.inf
                else:
                    lost += least < threshold
    assert dropped > 50
    assert lost > 5


def find_minimum(probe: FloatArray, start: FloatArray, texture: SplineArguments) -> Point:
    """Return the local minimum of φ reached by descent from a start."""
    return distance_bounds.descend(*map(float, probe), *map(float, start), texture)


@pytest.fixture(autouse=True)
def linked_sampler(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bind the sampler as the linker does."""
    monkeypatch.setattr(distance_bounds, "sample_hessian", heightmap.sample_hessian)
    monkeypatch.setattr(distance_bounds, "evaluation_cost", closest_search.evaluation_cost)
    monkeypatch.setattr(closest_search, "sample_hessian", heightmap.sample_hessian)


def test_unique_minimum_is_the_closest_point() -> None:
    """A certified unique minimum has no closer point; the control ignores third derivatives."""
    rng = np.random.default_rng(52)
    claims, wrong = [], 0
    for seed in range(4):
        texture = rough_map(seed)
        record = texture.arguments
        weakened = record._replace(boxes=record.boxes * np.array([1, 1, 1, 0, 1], np.float32))
        nx, ny = cells(texture)
        for probe in random_probes(texture, rng, 40):
            best = find_minimum(probe, probe[:2] + rng.normal(0.0, 2e-4, 2), record)
            j = math.floor((best[0] - record.x0) * record.ix)
            i = math.floor((best[1] - record.y0) * record.iy)
            wide = rng.integers(1, 9, 4)
            part = (
                max(j - wide[0], 0),
                min(j + wide[1], nx - 1),
                max(i - wide[2], 0),
                min(i + wide[3], ny - 1),
            )
            west, east, south, north = part
            phi = min_squared_distances(texture, probe)[south : north + 1, west : east + 1]
            inside = west <= j <= east and south <= i <= north
            closer = inside and phi.min() < best[2] * (1.0 - 1e-12)
            claims.append(is_unique_minimum(*map(float, probe), best, part, record))
            assert not (claims[-1] and closer)
            assert inside or not claims[-1]
            wrong += closer and is_unique_minimum(*map(float, probe), best, part, weakened)
    assert 0.1 < np.mean(claims) < 0.9
    assert wrong > 3


# --- tight examples -------------------------------------------------------------------------------

CENTRE = (10.3, 9.6)  # in cells


def record_of(c: FloatArray) -> SplineArguments:
    """Return the sampler record of a map with given coefficients [m] and a pitch of 1 m."""
    nodes, levels = plane_pyramid(c, (1.0, 1.0))
    return SplineArguments(c, 1.0, 1.0, 0.0, 0.0, False, nodes, levels)


def cubic_map(turned: bool, second: float, third: float) -> SplineArguments:
    """Return h = second t²/2 + third t³/6 along x or y with t = 0 at the centre, as a spline."""
    t = np.arange(-1, 22) - CENTRE[turned]
    line = second * (t**2 / 2 - 1 / 6) + third * (t**3 - t) / 6
    return record_of(np.add.outer(line, 0 * t) if turned else np.add.outer(0 * t, line))


def test_cell_above_the_probe_stays_in_the_window() -> None:
    """The probe is between four nodes, half a cell² farther away than the closest point."""
    left = shrink_to_cells(
        (10.5, 9.5, -3.0, 9.0 + 0.01), 3.0, (0, 19, 0, 19), record_of(np.zeros((23, 23)))
    )
    west, east, south, north = left
    assert west <= 10 <= east
    assert south <= 9 <= north


def test_one_coefficient_keeps_sixteen_cells() -> None:
    c = np.zeros((23, 23))
    c[9, 12] = -0.1
    threshold = 9.0 - 0.67  # slightly less than the coefficient of a flat map above the probe
    left = shrink_to_cells((11.0, 8.0, -3.0, threshold), 3.0, (0, 19, 0, 19), record_of(c))
    assert left == (9, 12, 6, 9)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("back", [False, True])
def test_unique_minimum_is_certified_close_to_the_exact_range(
    turned: bool, sign: float, back: bool
) -> None:
    """ψ = (1 - g b) t² - g c t³/3 increases up to a limit; it is 0 again at 3 (1 - g b)/g c."""
    g, b, c = 5.0, 0.08, 0.06
    record = cubic_map(turned, -sign * b, -sign * c * (-1.0 if back else 1.0))
    best = (*CENTRE, g * g, 0.0, 0.0, 0.0)
    exact = 3.0 * (1.0 - g * b) / (g * c)
    claimed = []
    for cells_ in range(1, 9):
        j, i = 10, 9
        part = [j, j, i, i]
        part[(2 if turned else 0) + (0 if back else 1)] += -cells_ if back else cells_
        claimed.append(is_unique_minimum(*CENTRE, -sign * g, best, tuple(part), record))
    end = (CENTRE[turned] - (9 if turned else 10)) if back else 1 - CENTRE[turned] % 1
    reach = end + np.arange(1, 9)
    assert not any(claim for claim, r in zip(claimed, reach, strict=True) if r > exact)
    assert all(claim for claim, r in zip(claimed, reach, strict=True) if r < 0.8 * exact)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_saddle_is_not_a_unique_minimum(sign: float) -> None:
    for share, expected in ((0.95, True), (1.05, False)):
        record = cubic_map(False, -sign * share / 5.0, 0.0)
        best = (*CENTRE, 25.0, 0.0, 0.0, 0.0)
        assert is_unique_minimum(*CENTRE, -sign * 5.0, best, (9, 11, 8, 10), record) == expected


def test_point_with_a_gradient_is_not_a_unique_minimum() -> None:
    texture = rough_map(5, 10e-6)
    probe = np.array([1.9e-3, -1.2e-3, -0.1e-3])
    best = find_minimum(probe, probe[:2], texture.arguments)
    j = math.floor((best[0] - 1e-3) / PITCH[0])
    i = math.floor((best[1] + 2e-3) / PITCH[1])
    part = (j - 3, j + 3, i - 3, i + 3)
    assert is_unique_minimum(*probe, best, part, texture.arguments)
    x = best[0] + 1e-9
    h, hx, hy = heightmap.sample_gradient(x, best[1], texture.arguments)
    phi = (x - probe[0]) ** 2 + (best[1] - probe[1]) ** 2 + (h - probe[2]) ** 2
    beside = (x, best[1], phi, h, hx, hy)
    assert not is_unique_minimum(*probe, beside, part, texture.arguments)


def test_min_increase_is_the_double_integral_of_the_second_derivative() -> None:
    rng = np.random.default_rng(53)
    for _ in range(30):
        start, rate, r = rng.uniform(0.1, 2.0), rng.uniform(0.1, 3.0), rng.uniform(0.1, 3.0)
        least = start - rng.exponential()
        t = np.linspace(0.0, r, 20_001)
        second = np.maximum(start - rate * t, least)
        exact = np.trapezoid((r - t) * second, t)
        assert distance_bounds.min_increase(start, least, rate, r) == pytest.approx(exact, abs=1e-6)
    assert distance_bounds.min_increase(1.0, -3.0, 0.0, 2.0) == 2.0


def test_window_is_empty_for_a_shallow_probe_only() -> None:
    """Deep below a crest across the map, both flanks are equally close."""
    x = PITCH[0] * (np.arange(38) - 18.5)
    texture = HeightMap(np.tile(-2.0 * np.abs(x), (25, 1)), PITCH)
    for depth, shallow in ((0.05e-3, True), (0.6e-3, False)):
        probe = np.array([18.5 * PITCH[0] + 1e-8, 12.3 * PITCH[1], -depth])
        best = find_minimum(probe, probe[:2] + np.array([2e-4, 0.0]), texture.arguments)
        ball = (*map(float, probe), best[2] * (1.0 - 1e-13))
        whole = (0.0, 37.0, 0.0, 24.0)
        left, budget = search.narrow_box(ball, best[3] - ball[2], whole, 600.0, texture.arguments)
        window = (int(left[0]), int(left[1]) - 1, int(left[2]), int(left[3]) - 1)
        certified = is_unique_minimum(*ball[:3], best, window, texture.arguments)
        assert (is_empty(window) or certified) == shallow
        assert 580.0 < budget < 600.0
        if not shallow:
            assert window[0] < 15
            assert window[1] > 21

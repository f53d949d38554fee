"""The globally nearest point against exhaustive search."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from asperity.textures import Fourier, HeightMap, Profile, Sinusoid, Texture

Check = Callable[..., Any]


def direction_of(texture: Texture) -> np.ndarray | None:
    """Return the direction along which a profile varies."""
    span = texture.domain.spans[0]
    return span / np.hypot(*span) if texture.is_profile else None


def squared_distance(texture: Texture, p: np.ndarray, xy: np.ndarray) -> np.ndarray:
    return ((xy - p[:2]) ** 2).sum(axis=1) + (texture.height(xy) - p[2]) ** 2


def polished(texture: Texture, p: np.ndarray, start: np.ndarray, scale: float) -> float:
    """Return the least distance near a start, by SciPy's quasi-Newton method."""
    direction = direction_of(texture)
    frame = np.eye(2) if direction is None else direction[None, :]

    def objective(u: np.ndarray) -> tuple[float, np.ndarray]:
        xy = start + scale * u @ frame
        gap = texture.height(xy[None, :])[0] - p[2]
        slope = texture.gradient(xy[None, :])[0]
        value = ((xy - p[:2]) @ (xy - p[:2]) + gap**2) / scale**2
        return value, 2.0 * frame @ (xy - p[:2] + gap * slope) / scale

    found = minimize(objective, np.zeros(len(frame)), jac=True, options={"gtol": 1e-10})
    return scale * float(np.sqrt(found.fun))


def exhaustive(texture: Texture, p: np.ndarray) -> float:
    """Return the distance of p: a dense grid over all that can be nearest, the best polished."""
    reach = float(np.abs(texture.height(p[None, :2])[0] - p[2]))
    direction = direction_of(texture)
    ticks = np.linspace(-reach, reach, 161 if direction is None else 8001)
    if direction is None:
        xy = p[:2] + np.stack(np.meshgrid(ticks, ticks), -1).reshape(-1, 2)
    else:
        xy = p[:2] + ticks[:, None] * direction
    values = squared_distance(texture, p, xy)
    grid = values.reshape(len(ticks), -1)
    lower = np.ones_like(grid, dtype=bool)
    for axis in range(grid.ndim):
        for shift in (-1, 1):
            lower &= grid <= np.roll(grid, shift, axis)
    candidates = np.flatnonzero(lower)
    candidates = candidates[np.argsort(values[candidates])[:6]]
    scale = max(reach / 80.0, 1e-9)
    polishes = [polished(texture, p, xy[c], scale) for c in candidates]
    return min(float(np.sqrt(values.min())), *polishes)


def probes(texture: Texture, scatter: Check) -> np.ndarray:
    """Return shallow, deep and very deep probes, and some outside of the body, (n, 3)."""
    xy = scatter(texture, 28, seed=21, stretch=1.5)
    size = texture.peak_to_valley
    depth = np.repeat([0.02, 0.3, 1.0, 3.0, -0.05, -0.5, -2.0], 4) * size
    rng = np.random.default_rng(22)
    return np.column_stack([xy, texture.height(xy) - depth * rng.uniform(0.7, 1.3, 28)])


def distances(texture: Texture, points: np.ndarray) -> np.ndarray:
    feet = texture.nearest(points)
    np.testing.assert_allclose(texture.height(feet[:, :2]), feet[:, 2], rtol=0, atol=1e-18)
    return np.asarray(np.linalg.norm(feet - points, axis=1))


def test_no_surface_point_is_nearer(texture: Texture, scatter: Check):
    points = probes(texture, scatter)
    found = distances(texture, points)
    best = np.array([exhaustive(texture, p) for p in points])
    extent = np.hypot(*texture.domain.spans[0])
    assert (found - best).max() <= 1e-12 * extent
    assert np.abs(found - best).max() <= 1e-9 * extent  # the exhaustive search found it as well


@pytest.mark.parametrize(
    "texture", ["steep sinusoid", "fourier", "steep map", "periodic profile"], indirect=True
)
def test_a_local_search_from_above_would_not_do(texture: Texture, scatter: Check):
    """The negative control: on the same points Newton's method from above stays behind."""
    points = probes(texture, scatter)
    found = distances(texture, points)
    scale = texture.peak_to_valley / 10.0
    local = np.array([polished(texture, p, p[:2], scale) for p in points])
    assert (local - found > 1e-3 * texture.peak_to_valley).sum() >= 2


def test_the_foot_lies_along_the_normal(texture: Texture, scatter: Check):
    points = probes(texture, scatter)
    feet = texture.nearest(points)
    slope = texture.gradient(feet[:, :2])
    tangents = np.stack([np.eye(2)[[0] * len(feet)], np.eye(2)[[1] * len(feet)]], 1)
    tangents = np.concatenate([tangents, slope[:, :, None]], axis=2)
    away = (feet - points) / np.linalg.norm(feet - points, axis=1)[:, None]
    along = np.einsum("nij,nj->ni", tangents, away) / np.linalg.norm(tangents, axis=2)
    assert np.abs(along).max() < 1e-7


def test_a_point_of_the_surface_is_its_own_foot(texture: Texture, scatter: Check):
    xy = scatter(texture, 20, seed=23)
    points = np.column_stack([xy, texture.height(xy)])
    assert distances(texture, points).max() <= 1e-15
    lifted = points + np.array([0.0, 0.0, 1e-9])
    assert distances(texture, lifted).max() <= 1e-9 * (1 + 1e-6)


def test_distances_change_no_faster_than_the_probe(texture: Texture, scatter: Check):
    """1-Lipschitz, across ridges and the borders of cells."""
    start, end = np.column_stack([scatter(texture, 2, seed=24), [-1e-4, -9e-4]])
    path = start + np.linspace(0.0, 1.0, 400)[:, None] * (end - start)
    step = np.linalg.norm(end - start) / 399
    assert np.abs(np.diff(distances(texture, path))).max() <= step * (1 + 1e-9)


PERIODIC = ["sinusoid", "steep sinusoid", "fourier", "periodic map", "periodic profile"]


@pytest.mark.parametrize("texture", PERIODIC, indirect=True)
def test_the_foot_repeats_with_the_texture(texture: Texture, scatter: Check):
    points = probes(texture, scatter)
    span = np.append(texture.domain.spans[-1], 0.0)
    ahead = distances(texture, points + 3 * span)
    np.testing.assert_allclose(ahead, distances(texture, points), rtol=0, atol=1e-14)


@pytest.mark.parametrize("kind", ["profile", "map"])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_wall_many_cells_away_is_nearer_than_the_top(kind: str, side: int):
    """In a plateau, 10 cells below its top and 8 from its wall: all cells between are searched."""
    plateau = np.where(np.arange(60) < 30, 40e-4, 0.0)[::-side]
    texture: Texture = Profile(plateau, 1e-4)
    if kind == "map":
        texture = HeightMap(np.tile(plateau, (6, 1)), 1e-4)
    probe = np.array([29.5e-4 + side * 8e-4, 2.3e-4, 30e-4])
    found = distances(texture, probe[None, :])[0]
    assert found == pytest.approx(exhaustive(texture, probe), rel=1e-9)
    assert found < 8.5e-4


# --- ties -----------------------------------------------------------------------------------------

RIDGE = 1e-4 * np.array([0.0, 1.0, 0.0, -3.0, 0.0, 5.0, 0.0, -3.0, 0.0, 1.0, 0.0])
SYMMETRIC: dict[str, tuple[Texture, tuple[float, float]]] = {
    "sinusoid": (Sinusoid(0.8e-3, 1e-3), (0.25e-3, 0.0)),
    "fourier": (
        Fourier([4e-4, 4e-4], [[6000.0, 0.0], [0.0, 6000.0]], [np.pi / 2, np.pi / 2]),
        (0.0, 0.0),
    ),
    "map": (HeightMap(np.add.outer(RIDGE, RIDGE), 2e-4), (1e-3, 1e-3)),
    "profile": (Profile(RIDGE, 2e-4), (1e-3, 0.0)),
}


@pytest.mark.parametrize(("texture", "crest"), SYMMETRIC.values(), ids=list(SYMMETRIC))
def test_a_tie_below_a_crest_is_broken_the_same_way_every_time(
    texture: Texture, crest: tuple[float, float]
):
    high = texture.height([crest])[0]
    depth = np.concatenate([np.linspace(1e-9, 1.2e-3, 40), [1e-12, 3e-3]])
    points = np.column_stack([np.tile(crest, (42, 1)), high - depth])
    feet = texture.nearest(points)
    assert np.isfinite(feet).all()
    np.testing.assert_array_equal(texture.nearest(points[::-1])[::-1], feet)
    np.testing.assert_array_equal(texture.nearest(points[5:6])[0], feet[5])
    aside = np.linalg.norm(feet[:, :2] - crest, axis=1)
    assert aside[0] < 1e-9
    assert aside[30] > 1e-5  # beyond the focal point the foot has left the axis
    best = [exhaustive(texture, p) for p in points[::6]]
    found = np.linalg.norm(feet - points, axis=1)[::6]
    np.testing.assert_allclose(found, best, rtol=0, atol=1e-12)


@pytest.mark.parametrize(("texture", "crest"), SYMMETRIC.values(), ids=list(SYMMETRIC))
def test_above_a_trough_the_tie_is_the_same_upside_down(
    texture: Texture, crest: tuple[float, float]
):
    del crest
    low = texture.extremes[0]
    xy = texture.domain.points(np.full((1, len(texture.domain.spans)), 0.5))
    points = np.column_stack([np.tile(xy, (20, 1)), low + np.linspace(0.0, 3e-3, 20)])
    feet = texture.nearest(points)
    assert np.isfinite(feet).all()
    best = [exhaustive(texture, p) for p in points]
    found = np.linalg.norm(feet - points, axis=1)
    np.testing.assert_allclose(found, best, rtol=0, atol=1e-12)


# --- the same functions, not compiled -------------------------------------------------------------


@pytest.mark.parametrize(
    "texture", ["steep sinusoid", "fourier", "map", "periodic profile"], indirect=True
)
def test_the_plain_functions_find_the_same(texture: Texture, scatter: Check, plain: Check):
    points = probes(texture, scatter)[::3]
    compiled = texture.nearest(points)
    np.testing.assert_allclose(plain(texture).nearest(points), compiled, rtol=0, atol=1e-13)

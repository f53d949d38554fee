"""The globally closest point against exhaustive search."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid, Texture

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))
search = importlib.import_module("bench.stress.nearest_exhaustive")

Check = Callable[..., Any]


def profile_direction(texture: Texture) -> np.ndarray | None:
    """Return the direction along which a profile varies."""
    span = texture.domain.spans[0]
    return span / np.hypot(*span) if texture.is_profile else None


def squared_distance(texture: Texture, p: np.ndarray, xy: np.ndarray) -> np.ndarray:
    return ((xy - p[:2]) ** 2).sum(axis=1) + (texture.height(xy) - p[2]) ** 2


def refine_distance(texture: Texture, p: np.ndarray, start: np.ndarray, scale: float) -> float:
    """Return the least distance near a start, by SciPy's quasi-Newton method."""
    direction = profile_direction(texture)
    frame = np.eye(2) if direction is None else direction[None, :]

    def objective(u: np.ndarray) -> tuple[float, np.ndarray]:
        xy = start + scale * u @ frame
        gap = texture.height(xy[None, :])[0] - p[2]
        slope = texture.gradient(xy[None, :])[0]
        value = ((xy - p[:2]) @ (xy - p[:2]) + gap**2) / scale**2
        return value, 2.0 * frame @ (xy - p[:2] + gap * slope) / scale

    result = minimize(objective, np.zeros(len(frame)), jac=True, options={"gtol": 1e-10})
    return scale * float(np.sqrt(result.fun))


def exhaustive_distance(texture: Texture, p: np.ndarray) -> float:
    """Return the distance of p by a dense grid over all candidates, the best of them refined."""
    reach = float(np.abs(texture.height(p[None, :2])[0] - p[2]))
    direction = profile_direction(texture)
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
    refined = [refine_distance(texture, p, xy[c], scale) for c in candidates]
    return min(float(np.sqrt(values.min())), *refined)


def probes(texture: Texture, scatter: Check) -> np.ndarray:
    """Return shallow, deep and very deep probes and some above the surface, (n, 3)."""
    xy = scatter(texture, 28, seed=21, stretch=1.5)
    size = texture.peak_to_valley
    depth = np.repeat([0.02, 0.3, 1.0, 3.0, -0.05, -0.5, -2.0], 4) * size
    rng = np.random.default_rng(22)
    return np.column_stack([xy, texture.height(xy) - depth * rng.uniform(0.7, 1.3, 28)])


def distances(texture: Texture, points: np.ndarray) -> np.ndarray:
    closest = texture.nearest(points)
    np.testing.assert_allclose(texture.height(closest[:, :2]), closest[:, 2], rtol=0, atol=1e-18)
    return np.asarray(np.linalg.norm(closest - points, axis=1))


def test_no_surface_point_is_closer(texture: Texture, scatter: Check):
    points = probes(texture, scatter)
    distance = distances(texture, points)
    expected = np.array([exhaustive_distance(texture, p) for p in points])
    extent = np.hypot(*texture.domain.spans[0])
    assert (distance - expected).max() <= 1e-12 * extent
    assert (
        np.abs(distance - expected).max() <= 1e-9 * extent
    )  # the exhaustive search is accurate as well


@pytest.mark.parametrize("kind", search.CASES)
def test_closest_point_agrees_with_exhaustive_search(kind: str):
    """On random probes (``python -m bench.stress.nearest_exhaustive`` tries 1e5 of each kind).

    Negative control: a local search from the probe's x, y misses some of them.
    """
    if kind.startswith("bullet") and not search.REAL.exists():
        pytest.skip(f"{search.REAL.name} is missing")
    case = search.CASES[kind]()
    points = search.probes(case, 2500, seed=77)
    extent = search.texture_extent(case.texture)
    distance, expected = distances(case.texture, points), search.search_exhaustively(case, points)
    assert np.abs(distance - expected).max() <= search.TOLERANCE * extent
    local = search.local_minima(case.texture, points, points[:, :2].copy(), case.step)
    assert (local - distance > 1e-5 * extent).sum() >= 5


@pytest.mark.parametrize(
    "texture", ["steep sinusoid", "fourier", "steep map", "periodic profile"], indirect=True
)
def test_local_search_from_above_is_not_enough(texture: Texture, scatter: Check):
    """Negative control: Newton's method from above the probe finds farther points."""
    points = probes(texture, scatter)
    distance = distances(texture, points)
    scale = texture.peak_to_valley / 10.0
    local = np.array([refine_distance(texture, p, p[:2], scale) for p in points])
    assert (local - distance > 1e-3 * texture.peak_to_valley).sum() >= 2


def test_closest_point_lies_along_the_normal(texture: Texture, scatter: Check):
    points = probes(texture, scatter)
    closest = texture.nearest(points)
    slope = texture.gradient(closest[:, :2])
    tangents = np.stack([np.eye(2)[[0] * len(closest)], np.eye(2)[[1] * len(closest)]], 1)
    tangents = np.concatenate([tangents, slope[:, :, None]], axis=2)
    offset = (closest - points) / np.linalg.norm(closest - points, axis=1)[:, None]
    along = np.einsum("nij,nj->ni", tangents, offset) / np.linalg.norm(tangents, axis=2)
    assert np.abs(along).max() < 1e-7


def test_surface_point_is_its_own_closest_point(texture: Texture, scatter: Check):
    xy = scatter(texture, 20, seed=23)
    points = np.column_stack([xy, texture.height(xy)])
    assert distances(texture, points).max() <= 1e-15
    lifted = points + np.array([0.0, 0.0, 1e-9])
    assert distances(texture, lifted).max() <= 1e-9 * (1 + 1e-6)


def test_distance_is_lipschitz_along_a_path(texture: Texture, scatter: Check):
    """With constant 1, across ridges and borders of cells."""
    start, end = np.column_stack([scatter(texture, 2, seed=24), [-1e-4, -9e-4]])
    path = start + np.linspace(0.0, 1.0, 400)[:, None] * (end - start)
    step = np.linalg.norm(end - start) / 399
    assert np.abs(np.diff(distances(texture, path))).max() <= step * (1 + 1e-9)


PERIODIC = ["sinusoid", "steep sinusoid", "fourier", "periodic map", "periodic profile"]


@pytest.mark.parametrize("texture", PERIODIC, indirect=True)
def test_distance_has_the_period_of_the_texture(texture: Texture, scatter: Check):
    points = probes(texture, scatter)
    span = np.append(texture.domain.spans[-1], 0.0)
    shifted = distances(texture, points + 3 * span)
    np.testing.assert_allclose(shifted, distances(texture, points), rtol=0, atol=1e-14)


@pytest.mark.parametrize("kind", ["profile", "map"])
@pytest.mark.parametrize("side", [-1, 1])
def test_wall_many_cells_away_is_found(kind: str, side: int):
    """Inside a plateau, 10 cells below its top and 8 from its wall: the search spans many cells."""
    plateau = np.where(np.arange(60) < 30, 40e-4, 0.0)[::-side]
    texture: Texture = Profile(plateau, 1e-4)
    if kind == "map":
        texture = HeightMap(np.tile(plateau, (6, 1)), 1e-4)
    probe = np.array([29.5e-4 + side * 8e-4, 2.3e-4, 30e-4])
    distance = distances(texture, probe[None, :])[0]
    assert distance == pytest.approx(exhaustive_distance(texture, probe), rel=1e-9)
    assert distance < 8.5e-4


def border_points(texture: Texture) -> np.ndarray:
    """Return points (n, 2) on nodes, on borders of search boxes, and on mirror lines."""
    spans = texture.domain.spans
    pitch = getattr(texture, "pitch", 1e-4)
    step = np.broadcast_to(pitch, len(spans)) if np.ndim(pitch) < 2 else pitch
    directions = spans / np.hypot(*spans.T)[:, None]
    ticks = [np.arange(-12, 13) * 0.5 * length for length in step]
    mesh = np.stack(np.meshgrid(*ticks), axis=-1).reshape(-1, len(spans))
    edge = np.random.default_rng(28).random((60, len(spans)))
    edge[::2, 0] = np.repeat([0.0, 0.5, 1.0], 10)
    edge[1::2, -1] = np.repeat([0.0, 0.5, 1.0], 10)
    inner = texture.domain.origin + mesh @ directions
    return np.concatenate([inner, texture.domain.points(edge)])


def test_closest_point_on_a_box_border_is_found(texture: Texture):
    """A probe at some depth along the normal of a surface point is no farther than that depth."""
    xy = border_points(texture)
    slope = texture.gradient(xy)
    down = np.column_stack([slope, -np.ones(len(xy))])
    down /= np.linalg.norm(down, axis=1)[:, None]
    surface = np.column_stack([xy, texture.height(xy)])
    extent = search.texture_extent(texture)
    for fraction in (1e-6, 1e-3, 0.02, 0.1, 0.3, 1.0, -0.02, -0.3):
        depth = fraction * texture.peak_to_valley
        distance = distances(texture, surface + depth * down)
        assert (distance - abs(depth)).max() <= 1e-15 + 1e-12 * extent


def test_far_probes_have_finite_closest_points(texture: Texture):
    """Metres away from a texture of millimetres, across thousands of copies, without NaN."""
    offsets = np.array([[3.0, -2.0], [0.011, 0.013], [-40.0, 5.0]])
    for z in (-1e3, -0.3, 0.2, 5e2, 1e12):
        points = np.column_stack([texture.domain.origin + offsets, np.full(3, z)])
        distance = distances(texture, points)
        low, high = texture.extremes
        nearest, farthest = sorted((abs(z - low), abs(z - high)))
        assert (distance >= nearest * (1 - 1e-12)).all()
        assert (distance <= farthest * (1 + 1e-12)).all()


def test_force_of_law_d_points_to_the_closest_point(texture: Texture, scatter: Check):
    """The search returns height and slope at the point, in mirrored copies too."""
    xy = scatter(texture, 300, seed=26, stretch=4.0)
    depth = np.random.default_rng(27).uniform(0.02, 1.0, 300) * texture.peak_to_valley
    points = np.column_stack([xy, texture.height(xy) - depth])
    spring = 800.0 * (texture.nearest(points) - points)
    force = Surface(texture, "D", stiffness=800.0).force(points)
    scale = 800.0 * np.maximum(np.abs(points[:, 2]), depth)
    assert (np.linalg.norm(force - spring, axis=1) / scale).max() < 1e-10


# --- no allocation --------------------------------------------------------------------------------

# Numba counts allocations only if enabled by the environment before it starts.
_COUNT_ALLOCATIONS = """
import json, sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from numba import njit
from numba.core.runtime import rtsys
from asperity.surface import Surface
from bench.stress.nearest_exhaustive import CASES, probes

@njit
def allocating_batch(points, out, texture):
    for i in range(points.shape[0]):
        patch = np.empty((4, 4))
        patch[i % 4, 0] = points[i, 0]
        out[i, 0] = patch[i % 4, 0]

def allocations(loop, *arguments):
    before = rtsys.get_allocation_stats().alloc
    loop(*arguments)
    return rtsys.get_allocation_stats().alloc - before

answer = {}
for kind in sys.argv[2:]:
    case = CASES[kind]()
    points = probes(case, 400)
    surface = Surface(case.texture, "D")
    texture, law = case.texture.arguments, surface.law_arguments
    loops = {
        "nearest": (case.texture._loops.nearest_batch, np.empty((400, 2)), texture),
        "force": (surface._loops.force_batch, np.empty((400, 3)), texture, law),
        "control": (allocating_batch, np.empty((400, 2)), 0.0),
    }
    for name, (loop, out, *rest) in loops.items():
        loop(points[:1], out, *rest)
        one = allocations(loop, points[:1], out, *rest)
        answer[f"{kind} {name}"] = allocations(loop, points, out, *rest) - one
print(json.dumps(answer))
"""


def test_queries_do_not_allocate():
    """For closest points and forces; the control allocates once per query and is detected."""
    kinds = ["sinusoid", "Fourier, 1-D", "Fourier, 2-D", "map, finite", "map, periodic", "square"]
    process = subprocess.run(
        [sys.executable, "-c", _COUNT_ALLOCATIONS, str(ROOT), *kinds],
        env={**os.environ, "NUMBA_NRT_STATS": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    counts = json.loads(process.stdout)
    assert len(counts) == 3 * len(kinds)
    for name, count in counts.items():
        assert count == (399 if name.endswith("control") else 0), name


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
def test_ties_below_a_crest_are_resolved_reproducibly(texture: Texture, crest: tuple[float, float]):
    height = texture.height([crest])[0]
    depth = np.concatenate([np.linspace(1e-9, 1.2e-3, 40), [1e-12, 3e-3]])
    points = np.column_stack([np.tile(crest, (42, 1)), height - depth])
    closest = texture.nearest(points)
    assert np.isfinite(closest).all()
    np.testing.assert_array_equal(texture.nearest(points[::-1])[::-1], closest)
    np.testing.assert_array_equal(texture.nearest(points[5:6])[0], closest[5])
    offset = np.linalg.norm(closest[:, :2] - crest, axis=1)
    assert offset[0] < 1e-9
    assert offset[30] > 1e-5  # beyond the focal point it has left the axis
    expected = [exhaustive_distance(texture, p) for p in points[::6]]
    distance = np.linalg.norm(closest - points, axis=1)[::6]
    np.testing.assert_allclose(distance, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize(("texture", "crest"), SYMMETRIC.values(), ids=list(SYMMETRIC))
def test_ties_above_a_trough_give_the_closest_point(texture: Texture, crest: tuple[float, float]):
    del crest
    bottom = texture.extremes[0]
    xy = texture.domain.points(np.full((1, len(texture.domain.spans)), 0.5))
    points = np.column_stack([np.tile(xy, (20, 1)), bottom + np.linspace(0.0, 3e-3, 20)])
    closest = texture.nearest(points)
    assert np.isfinite(closest).all()
    expected = [exhaustive_distance(texture, p) for p in points]
    distance = np.linalg.norm(closest - points, axis=1)
    np.testing.assert_allclose(distance, expected, rtol=0, atol=1e-12)


# --- the same functions as plain Python -----------------------------------------------------------


@pytest.mark.parametrize(
    "texture", ["steep sinusoid", "fourier", "map", "periodic profile"], indirect=True
)
def test_plain_python_agrees_with_compiled_search(texture: Texture, scatter: Check, plain: Check):
    points = probes(texture, scatter)[::3]
    compiled = texture.nearest(points)
    np.testing.assert_allclose(plain(texture).nearest(points), compiled, rtol=0, atol=1e-13)


def test_closest_point_near_mirror_lines_of_a_finite_map() -> None:
    """A point exactly on the border of two boxes is a candidate in both, not in none."""
    heights = 5e-5 * np.random.default_rng(3).normal(size=(7, 8))
    texture = HeightMap(heights, (1e-4, 1.3e-4))
    rng = np.random.default_rng(0)
    n = 1500
    for line in (0.0, 7e-4):
        z = rng.uniform(-6e-4, -1e-4, n)
        on = np.column_stack([np.full(n, line), rng.uniform(-1.5e-3, 1.5e-3, n), z])
        beside = on + np.array([1e-12, 0.0, 0.0])
        distances = [np.linalg.norm(texture.nearest(p) - p, axis=1) for p in (on, beside)]
        np.testing.assert_allclose(distances[0], distances[1], rtol=0.0, atol=1e-11)

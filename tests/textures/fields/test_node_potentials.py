"""Depths at columns of nodes: those of a search from scratch, whatever came before."""

from __future__ import annotations

import math

import numpy as np
import pytest

from asperity.core.checks import FloatArray
from asperity.kernels.fuse import fuse_surface
from asperity.laws import LAWS
from asperity.laws.clamps import NONE
from asperity.textures.fields import node_potentials
from asperity.textures.fields.bake import BakeGoal, BakePlan
from asperity.textures.fields.field_grid import FieldGrid
from asperity.textures.fields.node_potentials import (
    compute_potentials,
    lattice_columns,
    split_columns,
    wrong_nodes,
)
from asperity.textures.kinds.fourier import Fourier
from asperity.textures.kinds.named_surfaces import named_surface
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import HeightMap, Profile
from asperity.textures.texture import Texture

RNG = np.random.default_rng(5)
ROUGH = RNG.normal(size=(9, 10))
TEXTURES = {
    "sinusoid": Sinusoid(0.3e-3, 1e-3, phase=0.6, direction=(3.0, -1.0)),
    "profile": Profile(8e-5 * ROUGH[0], 1e-4, origin=2e-4),
    "ridges": HeightMap(6e-5 * ROUGH, (1e-4, 1.3e-4), periodic=True, origin=(1e-4, -2e-4)),
    "finite map": HeightMap(5e-5 * ROUGH, (1e-4, 1.3e-4)),
    "waves": Fourier([5e-5, 4e-5, 3e-5], [[9e3, 0.0], [3e3, 8e3], [-6e3, 1.6e4]], [0.3, 1, 2]),
    "cloth": named_surface("cloth"),
}
DEPTH, MARGIN = 2e-4, 6e-5


def exact_depths(texture: Texture, continuity: float, points: FloatArray) -> FloatArray:
    """Return √(2U), or the negative distance [m], and the number of atoms, (n, 2), from scratch."""
    out = np.empty((len(points), 3))
    loops = fuse_surface(LAWS["H"], texture.sampler, NONE)
    loops.split_batch(points, out, continuity, texture.arguments)
    distance = np.linalg.norm(texture.nearest(points) - points, axis=1)
    outside = points[:, 2] >= texture.height(points[:, :2])
    depth = np.where(outside, -np.minimum(distance, MARGIN), np.sqrt(2.0 * out[:, 0]))
    return np.column_stack([depth, out[:, 1]])


def random_columns(
    texture: Texture, count: int, levels: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return x, y (count, 2), rising z, and all nodes (count levels, 3), some of them outside.

    A third of the columns are on a border, where pairs of closest points of a mirrored map merge.
    """
    parts = RNG.uniform(-0.5, 1.5, (count, len(texture.domain.spans)))
    parts[::3, -1] = 0.0
    xy = texture.domain.points(parts)
    low, high = texture.extremes
    z = np.linspace(low - DEPTH, high + 8e-5, levels)
    points = np.empty((count, levels, 3))
    points[..., :2], points[..., 2] = xy[:, None], z
    return xy, z, points.reshape(-1, 3)


@pytest.mark.parametrize("name", TEXTURES)
@pytest.mark.parametrize("continuity", [1.0, 4.0])
def test_columns_equal_searches_from_scratch(name: str, continuity: float) -> None:
    texture = TEXTURES[name]
    xy, z, points = random_columns(texture, 60, 25)
    found = np.empty((len(xy), len(z)), np.float32)
    split_columns(texture, continuity)(xy, z, MARGIN, found)
    value, atoms = exact_depths(texture, continuity, points).T
    np.testing.assert_allclose(found.ravel(), value, rtol=2.0**-23, atol=1e-12)
    assert (value == -MARGIN).any()
    assert ((value < 0.0) & (value > -MARGIN)).any()
    if name in ("ridges", "waves", "cloth"):
        assert (atoms >= 3).mean() > 0.003
    # Negative control: the closest point alone, without a split, has another potential.
    single = np.linalg.norm(texture.nearest(points) - points, axis=1)
    assert np.abs(np.where(value > 0.0, single - value, 0.0)).max() > 1e-3 * value.max()


def test_result_does_not_depend_on_the_levels_between() -> None:
    """A start from far above leads to the same depth as one from the level above."""
    texture = TEXTURES["ridges"]
    xy, z, _points = random_columns(texture, 30, 41)
    fine, coarse = np.empty((30, 41), np.float32), np.empty((30, 5), np.float32)
    columns = split_columns(texture, 1.0)
    columns(xy, z, MARGIN, fine)
    columns(xy, np.ascontiguousarray(z[::10]), MARGIN, coarse)
    np.testing.assert_allclose(fine[:, ::10], coarse, rtol=2.0**-23, atol=1e-12)


@pytest.mark.parametrize("name", ["profile", "finite map"])
def test_grid_holds_the_depth_of_each_node(name: str) -> None:
    texture = TEXTURES[name]
    grid = FieldGrid.fit(texture.domain, texture.extremes, DEPTH, 0.0, MARGIN / 2.75)
    offsets = grid.offsets()
    seen: list[float] = []
    found = compute_potentials(split_columns(texture, 1.0), grid, seen.append)
    assert found.shape == grid.node_counts
    assert seen[-1] == 1.0
    for index in RNG.integers(0, grid.node_counts, (50, len(grid.node_counts))):
        (xy,) = grid.positions(index[None, :-1])
        point = np.array([[*xy, grid.height(index[-1])]])
        value = max(exact_depths(texture, 1.0, point)[0, 0], -grid.margin) - offsets[index[-1]]
        assert found[tuple(index)] == pytest.approx(value, rel=1e-6, abs=1e-11)


# --- depths from a lattice ------------------------------------------------------------------------


def small_grid(texture: Texture, depth: float = DEPTH) -> FieldGrid:
    return FieldGrid.fit(texture.domain, texture.extremes, depth, 0.0, MARGIN / 3.0, 1.2)


@pytest.mark.parametrize(("continuity", "depth"), [(1.0, DEPTH), (4.0, DEPTH), (1.0, 30 * DEPTH)])
@pytest.mark.parametrize("name", ["profile", "ridges", "finite map", "cloth"])
def test_columns_from_a_lattice_are_mostly_exact_and_never_less_deep(
    name: str, continuity: float, depth: float
) -> None:
    """Their points are points of the surface, so the potential is that of some weights."""
    texture = TEXTURES[name]
    grid = small_grid(texture, depth)
    xy = texture.domain.points(RNG.uniform(size=(80, len(texture.domain.spans))))
    z = grid.height(np.arange(grid.levels, dtype=float))
    exact = np.empty((len(xy), len(z)))
    found = np.empty_like(exact)
    split_columns(texture, continuity)(xy, z, grid.margin, exact)
    quick, thorough = lattice_columns(texture, continuity, grid)
    quick(xy, z, grid.margin, found)
    inside = exact > 0.0
    difference = (found - exact)[inside] / max(grid.spacing)
    assert difference.min() > -1e-5
    assert (difference < 1e-5).mean() > 0.98
    assert difference.max() < 0.2
    outside = (exact <= 0.0) & (exact > -grid.margin)
    assert np.abs(found - exact)[outside].max() < 0.2 * max(grid.spacing)
    better = np.empty_like(exact)
    thorough(xy, z, grid.margin, better)
    rest = (better - exact)[inside] / max(grid.spacing)
    assert rest.min() > -1e-5
    assert (rest > 1e-5).sum() <= (difference > 1e-5).sum()


@pytest.mark.parametrize("name", ["profile", "ridges", "finite map"])
def test_nodes_of_wrong_depth_are_found_and_replaced(name: str) -> None:
    texture = TEXTURES[name]
    grid = small_grid(texture)
    columns = split_columns(texture, 1.0)
    exact = compute_potentials(columns, grid)
    assert not wrong_nodes(exact + grid.offsets(), grid, 1.0).any()
    step = max(grid.spacing)

    def disturbed(xy: FloatArray, z: FloatArray, margin: float, out: np.ndarray) -> None:
        columns(xy, z, margin, out)
        deeper = (np.arange(out.size) % 97 == 5).reshape(out.shape) & (out > 3.0 * step)
        out[deeper] += 0.5 * step

    spoilt = compute_potentials(disturbed, grid)
    assert (spoilt != exact).mean() > 0.004
    found = compute_potentials(disturbed, grid, repairs=[columns])
    np.testing.assert_allclose(found, exact, atol=1e-10)


def test_fields_are_repaired_with_proof_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = BakePlan(TEXTURES["ridges"], DEPTH, 1.0, BakeGoal(max_gain=math.inf))
    monkeypatch.setattr(node_potentials, "lattice_columns", lambda *_: [plan.columns])
    wanted = plan.trial(MARGIN / 3.0, None).accuracy

    def disturbed(xy: FloatArray, z: FloatArray, margin: float, out: np.ndarray) -> None:
        plan.columns(xy, z, margin, out)
        out[(np.arange(out.size) % 97 == 5).reshape(out.shape) & (out > MARGIN)] += MARGIN / 6.0

    monkeypatch.setattr(node_potentials, "lattice_columns", lambda *_: [disturbed])
    found = plan.trial(MARGIN / 3.0, None).accuracy
    assert found.largest == pytest.approx(wanted.largest, rel=1e-5)
    assert found.rms == pytest.approx(wanted.rms, rel=1e-5)

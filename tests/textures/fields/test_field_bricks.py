"""Fields in bricks of 16 bits: what is rounded, and that what is rounded is what is certified."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import asperity as asp
from asperity.textures.fields import bake as baking
from asperity.textures.fields import field_record as record
from asperity.textures.fields import field_sampler as kernels
from asperity.textures.fields.field_bricks import BRICK_BYTES, empty_bricks
from asperity.textures.fields.field_certificate import certify_gain
from asperity.textures.fields.field_grid import FieldGrid, SingleArray
from asperity.textures.fields.field_record import (
    BRICK_LEVELS,
    BRICK_STEP,
    BRICK_VALUES,
    MIRRORED,
    PERIODIC,
    ZERO,
    FieldArguments,
)
from asperity.textures.spline.spline_texture import HeightMap

STEPS = np.array([[1.1e-5, 0.3e-5], [-0.2e-5, 0.9e-5]])
SHAPES = [
    ((7,), PERIODIC),
    ((8,), MIRRORED),
    ((7, 6), PERIODIC),
    ((8, 5), MIRRORED),
    ((9, 8), ZERO),
]
LEVELS = 17
SURFACE = asp.Surface(
    HeightMap(5e-5 * np.random.default_rng(3).normal(size=(7, 8)), (1e-4, 1.3e-4), periodic=True),
    "H",
    900.0,
    max_depth=2e-4,
)


def random_depths(grid: FieldGrid) -> SingleArray:
    """Return random depths in columns of random ends; some are empty."""
    rng = np.random.default_rng(len(grid.cells) + grid.border)
    dense = rng.uniform(1e-4, 3e-4, grid.node_counts).astype(np.float32)
    end = rng.integers(0, grid.levels - 1, grid.node_counts[:-1])
    first = rng.integers(0, 9, end.shape) if grid.border == ZERO else np.zeros(end.shape, int)
    levels = np.arange(grid.levels)
    outside = (levels >= end[..., None]) | (levels < first[..., None])
    dense[outside] = -np.float32(grid.margin)
    return dense


def in_columns(field: FieldArguments) -> FieldArguments:
    """Return the record of a field in bricks with its coefficients one by one."""
    rows = record.field_rows(field)
    width = record.field_width(field)
    places = np.arange(rows * width * field.levels).reshape(rows, width, field.levels)
    table = np.empty((rows, width, 4), np.int32)
    values = np.empty(places.size, np.float32)
    for i, j, m in np.ndindex(places.shape):
        exact = record.brick_coefficient(i, j, m, field)
        values[places[i, j, m]] = exact
        assert values[places[i, j, m]] == exact  # in single precision, too
        table[i, j] = places[i, j, 0], 0, field.levels, record.field_reach(i, j, field)
    return field._replace(c=values, columns=table, **FieldArguments._field_defaults)


@pytest.mark.parametrize(("cells", "border"), SHAPES)
def test_coefficients_are_rounded_by_half_a_step(cells: tuple[int, ...], border: int) -> None:
    """At nodes that are stored twice, on both sides of a seam, to the same number."""
    grid = FieldGrid(STEPS[: len(cells)], cells, np.zeros(2), LEVELS, 8e-6, -1e-5, 3, border)
    depths = random_depths(grid)
    field = grid.arguments(depths)
    bricks = grid.to_bricks(depths, field)
    assert (record.field_rows(bricks), record.field_width(bricks)) == field.columns.shape[:2]
    half = 0.5 * record.largest_step(bricks)
    assert 0.0 < half < 3e-4 / 60_000
    stored = [grid.stored_nodes(axis) for axis in range(len(cells))]
    found: dict[tuple[int, ...], list[float]] = {}
    for i, j in np.ndindex(*field.columns.shape[:2]):
        place = (int(stored[0][j]), *[int(nodes[i]) for nodes in stored[1:]])
        exact = [record.column_triple(i, j, m, field)[1] for m in range(1, LEVELS - 1)]
        rounded = [record.field_triple(i, j, m, bricks)[1] for m in range(1, LEVELS - 1)]
        np.testing.assert_allclose(rounded, exact, rtol=0.0, atol=half)
        assert found.setdefault(place, rounded) == rounded
    assert record.largest_coefficient(bricks) == pytest.approx(float(field.c.max()), abs=half)


@pytest.mark.parametrize(("cells", "border"), SHAPES)
def test_sums_over_bricks_have_the_bits_of_those_over_columns(
    cells: tuple[int, ...], border: int
) -> None:
    grid = FieldGrid(STEPS[: len(cells)], cells, np.zeros(2), LEVELS, 8e-6, -1e-5, 3, border)
    depths = random_depths(grid)
    bricks = grid.to_bricks(depths, grid.arguments(depths))._replace(lift=0.7e-5)
    columns = in_columns(bricks)
    points = np.random.default_rng(1).uniform([-2e-4, -2e-4, -4e-5], [2e-4, 2e-4, 1e-4], (300, 3))
    forces = [kernels.field_slope(x, y, z, bricks) for x, y, z in points.tolist()]
    assert forces == [kernels.field_slope(x, y, z, columns) for x, y, z in points.tolist()]
    assert np.count_nonzero(forces) > 20
    bricks.bricks[1:, BRICK_VALUES:] ^= 1
    assert forces != [kernels.field_slope(x, y, z, bricks) for x, y, z in points.tolist()]


def test_bricks_are_lines_of_the_cache() -> None:
    for count in (1, 2, 7, 100):
        bricks = empty_bricks(count)
        assert bricks.shape == (count, 32)
        assert bricks.nbytes == 64 * count
        assert bricks.ctypes.data % 64 == 0
    assert BRICK_VALUES + 4 * BRICK_LEVELS == 32


@pytest.fixture(name="large")
def _large(monkeypatch: pytest.MonkeyPatch) -> asp.Surface:
    """A baked surface whose small field is stored like a large one."""
    monkeypatch.setattr(baking, "BRICK_BYTES", 0)
    return asp.bake(SURFACE, 1.5e-5, press=1e-6)


def test_what_is_certified_is_the_rounded_field(large: asp.Surface) -> None:
    field: Any = large.texture
    assert len(field.arguments.bricks) > 0 == field.arguments.c.size
    assert 1.0 < field.gain.upper <= 1.15
    points = field.domain.points(np.random.default_rng(5).uniform(size=(20_000, 2)))
    z = np.random.default_rng(6).uniform(-3e-4, 1e-4, len(points))
    probes = np.column_stack([points, z])
    jacobians = large.jacobian(probes) / large.stiffness
    assert np.linalg.norm(jacobians, 2, axis=(1, 2)).max() <= field.gain.upper
    # Negative control: the certificate sees the last bits of the bricks, 200 steps above all.
    numbers = certify_gain(field.grid, field.arguments)
    assert numbers == (field.gain, field.one_sided)
    rough = field.arguments._replace(bricks=field.arguments.bricks.copy())
    rough.bricks[1:, BRICK_VALUES::3] ^= 128
    assert certify_gain(field.grid, rough)[0].upper > field.gain.upper + 0.01


def test_rounding_changes_the_force_by_little(monkeypatch: pytest.MonkeyPatch) -> None:
    """By the steps of the bricks over the spacing of nodes, times the depth: about 1e-5."""
    exact: Any = asp.bake(SURFACE, 1.5e-5, press=1e-6, max_gain=None)
    monkeypatch.setattr(baking, "BRICK_BYTES", 0)
    rounded: Any = asp.bake(SURFACE, 1.5e-5, press=1e-6, max_gain=None)
    points = np.random.default_rng(2).uniform([0.0, 0.0, -3e-4], [9e-4, 8e-4, 1e-4], (2000, 3))
    forces = exact.force(points)
    difference = np.linalg.norm(rounded.force(points) - forces, axis=1).max()
    assert 0.0 < difference < 1e-4 * np.linalg.norm(forces, axis=1).max()
    accuracy = rounded.texture.accuracy
    assert accuracy.share == pytest.approx(exact.texture.accuracy.share, rel=1e-3)
    assert accuracy.bound > exact.texture.accuracy.bound
    assert (len(exact.texture.arguments.bricks), BRICK_BYTES) == (0, 2**24)


def test_file_holds_the_bricks(large: Any, tmp_path: Path) -> None:
    path = tmp_path / "a.field"
    asp.save_field(path, large.texture)
    again: Any = asp.Surface(path, "H", large.stiffness, max_depth=large.max_depth)
    np.testing.assert_array_equal(again.texture.arguments.bricks, large.texture.arguments.bricks)
    assert again.texture.digest == large.texture.digest
    assert again.texture.bytes < 0.75 * 4 * again.texture.nodes
    points = np.random.default_rng(2).uniform([0.0, 0.0, -3e-4], [9e-4, 8e-4, 1e-4], (200, 3))
    np.testing.assert_array_equal(again.force(points), large.force(points))
    assert (again.texture.arguments.bricks[:, BRICK_STEP] >= 0).all()
    assert path.read_bytes()[8] == 4
    for field in (again.texture, pickle.loads(pickle.dumps(large.texture))):
        assert field.arguments.bricks.ctypes.data % 64 == 0

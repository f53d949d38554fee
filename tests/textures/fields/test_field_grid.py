"""Node positions of a baked field of law H and its proved error bounds, by hand."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from asperity.analysis.split.baked_field import FieldGrid, curvature_bounds

from asperity.analysis.split import baked_field as potential_grid
from asperity.analysis.split import baked_field as potential_table
from asperity.core.units import round_up
from asperity.kernels import fuse
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import HeightMap

WAVE = Sinusoid(0.1e-3, 1e-3)


def grid(steps: list[list[float]], cells: tuple[int, ...], *, periodic: bool = True) -> FieldGrid:
    return FieldGrid(np.array(steps), cells, np.array([1e-3, 2e-3]), 6, 0.1, 5.0, periodic)


@pytest.mark.parametrize("resolution", [0.7e-4, 1e-4, 3e-4, 1.0])
def test_node_spacing_is_at_most_the_resolution(resolution: float) -> None:
    surface = Surface(WAVE, "H", max_depth=0.35e-3)
    fitted = FieldGrid.fit(surface, resolution)
    along, rise = fitted.spacing
    for spacing, length, count in (
        (along, 1e-3, fitted.cells[0]),
        (rise, 0.55e-3, fitted.levels - 3),
    ):
        assert spacing <= resolution * (1 + 1e-12)
        assert count >= 4
        assert count == 4 or length / (count - 1) > resolution * (1 - 1e-12)
        assert spacing * count == pytest.approx(length, rel=1e-12)
    # The floor is halfway between the two lowest levels, two levels are above the highest point.
    low, next_one = fitted.height(0), fitted.height(1)
    assert 0.5 * (low + next_one) == pytest.approx(-0.1e-3 - 0.35e-3, rel=1e-12)
    above = fitted.height(np.arange(fitted.levels)) > WAVE.extremes[1]
    np.testing.assert_array_equal(np.flatnonzero(above), [fitted.levels - 2, fitted.levels - 1])
    assert fitted.height(fitted.levels - 2) == pytest.approx(0.1e-3 + 0.5 * rise, rel=1e-9)


def test_border_nodes_are_periodic_or_mirrored() -> None:
    steps = [[0.1, 0.0]]
    assert grid(steps, (4,)).nodes(0).tolist() == [3, 0, 1, 2, 3, 0, 1]
    assert grid(steps, (4,), periodic=False).nodes(0).tolist() == [1, 0, 1, 2, 3, 4, 3]
    assert grid([[0.1, 0.0], [0.0, 0.2]], (4, 5)).shape == (7, 8, 6)


def test_error_bounds_by_hand() -> None:
    """Variances: a quarter of the sum of squared steps plus a twelfth of each squared step."""
    gradient, potential = grid([[0.3, 0.0], [0.0, 0.2]], (4, 4)).error_bounds(2.0)
    squares = np.array([0.09, 0.04, 0.01])
    assert potential == pytest.approx(0.5 * 2.0 * 0.25 * 0.14, rel=1e-12)
    parts = 2.0 * np.sqrt(0.25 * 0.14 + squares / 12.0)
    assert gradient == pytest.approx(math.sqrt(float(parts @ parts)), rel=1e-12)


def test_oblique_steps_increase_the_error_bound() -> None:
    """The gradient from its components along unit steps at 60 degrees is at most √2 longer."""
    upright, _ = grid([[0.1, 0.0], [0.0, 0.1]], (4, 4)).error_bounds(1.0)
    oblique_steps = [[0.1, 0.0], [0.05, 0.1 * math.sqrt(0.75)]]
    oblique, _ = grid(oblique_steps, (4, 4)).error_bounds(1.0)
    directions = np.array(oblique_steps) / 0.1
    longest = 1.0 / np.linalg.svd(directions, compute_uv=False)[-1]
    assert longest == pytest.approx(math.sqrt(2.0), rel=1e-12)
    assert oblique == pytest.approx(longest * upright, rel=1e-12)


@pytest.mark.parametrize("periodic", [True, False])
@pytest.mark.parametrize("stiffer", [0, 1])
def test_curvature_bounds_are_the_maximum_over_all_batches(
    periodic: bool, stiffer: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every column is searched once; positive and negative eigenvalues each by their maximum."""
    seen: list[int] = []

    def hull_batch(first: int, last: int, out: np.ndarray, _table: object) -> None:
        seen.extend(range(first, last))
        for side in range(2):
            size = (3.0 if side == stiffer else 1.0) + (1.0 if first == 16 else 0.0)
            out[side] = (size + 0.5, size, first, 0.5, 2.0)

    monkeypatch.setattr(fuse, "fuse_module", lambda *_: SimpleNamespace(hull_batch=hull_batch))
    field_grid = grid([[0.1, 0.0], [0.0, 0.2]], (40, 4), periodic=periodic)
    table = field_grid.kernel_arguments(np.full((7, 43, 6), 2.0))
    norm, positive = curvature_bounds(field_grid, table)
    assert sorted(seen) == list(range(40 if periodic else 41))
    rounding = potential_grid._DIFFERENCE_ROUNDING * 2.0 / 0.1**2
    assert rounding > 0.0
    assert (norm.lower, norm.upper) == (4.0, 4.5 + rounding)
    size = 4.0 if stiffer == 0 else 2.0
    assert (positive.lower, positive.upper) == (size, size + 0.5 + rounding)
    # The witness is at node (16, ½) and level 2.
    position = (1e-3 + 16 * 0.1, 2e-3 + 0.5 * 0.2, 5.0 + 1.5 * 0.1)
    assert norm.at == pytest.approx(position)
    assert positive.at == pytest.approx(position)


def test_kernel_arguments_contain_the_position_of_the_first_node() -> None:
    field_grid = grid([[0.1, 0.0], [0.0, 0.2]], (4, 4), periodic=False)
    table = field_grid.kernel_arguments(np.zeros((7, 7, 6)))
    position = np.array([1e-3 + 0.25, 2e-3 + 0.3])
    rates = np.array([[table.m00, table.m01], [table.m10, table.m11]])
    np.testing.assert_allclose(rates @ (position - [table.x0, table.y0]), [2.5, 1.5], rtol=1e-12)
    assert table.z0 == pytest.approx(5.0 - 0.05)
    assert field_grid.bytes == 8 * 7 * 7 * 6


def test_grid_of_a_finite_map_starts_at_its_corner() -> None:
    texture = HeightMap(1e-5 * np.random.default_rng(0).normal(size=(9, 12)), 1e-4)
    fitted = FieldGrid.fit(Surface(texture, "H", max_depth=1e-4), 0.9e-4)
    assert not fitted.periodic
    np.testing.assert_allclose(fitted.start, texture.domain.origin)
    ends = fitted.start + np.array(fitted.cells) @ fitted.steps
    np.testing.assert_allclose(ends, texture.domain.origin + texture.domain.spans.sum(axis=0))


# --- resolution -----------------------------------------------------------------------------------


@pytest.mark.parametrize("max_bytes", [3_000, 40_000, 10**6])
def test_finest_resolution_that_fits_is_accurate_to_three_digits(max_bytes: int) -> None:
    """On a wave of 1 mm and on one of 4 km, whose node spacing exceeds 1 m."""
    for size in (1.0, 4e6):
        texture = Sinusoid(0.1e-3 * size, 1e-3 * size)
        surface = Surface(texture, "H", max_depth=0.35e-3 * size)
        finest = potential_table._finest_resolution(surface, max_bytes)
        assert FieldGrid.fit(surface, finest).bytes <= max_bytes
        assert FieldGrid.fit(surface, finest / 1.002).bytes > max_bytes


def test_round_up_of_the_resolution_never_decreases() -> None:
    for value in 10.0 ** np.random.default_rng(3).uniform(-8.0, 2.0, 300):
        result = round_up(value)
        unit = 10.0 ** (math.floor(math.log10(value)) - 2)
        assert value <= result <= value + unit * (1.0 + 1e-9)
        assert abs(result / unit - round(result / unit)) < 1e-6


@pytest.mark.parametrize(("limit", "criterion"), [(2**28, "waves"), (10_000, "bytes")])
def test_default_grid_has_64_nodes_per_wave_or_the_size_limit(limit: int, criterion: str) -> None:
    surface = Surface(WAVE, "H", max_depth=0.35e-3)
    slope, hessian = WAVE.bounds
    fitted = potential_table._default_grid(surface, limit)
    if criterion == "waves":
        finest = 2.0 * math.pi * slope / hessian / 64
        assert fitted.shape == FieldGrid.fit(surface, finest).shape
    else:
        assert fitted.bytes <= limit < FieldGrid.fit(surface, 0.99 * min(fitted.spacing)).bytes
    # At most a million nodes of eight bytes; a flat surface has no shortest wave.
    flat = Surface(HeightMap(np.zeros((4, 5)), 1e-4), "H", max_depth=1e-4)
    assert 7e6 < potential_table._default_grid(flat, 2**28).bytes <= 8e6


def test_half_of_the_random_probes_are_near_the_surface() -> None:
    """4096 probes lie within two nodes of the surface, 4096 in the whole field above the floor."""
    texture = HeightMap(1e-5 * np.random.default_rng(0).normal(size=(9, 12)), 1e-4)
    surface = Surface(texture, "H", max_depth=1e-4)
    grid = FieldGrid.fit(surface, 0.2e-4)
    points = potential_table._random_probes(surface, grid)
    assert points.shape == (8192, 3)
    above = (points[:, 2] - texture.height(points[:, :2])) / grid.level_spacing
    assert np.abs(above[:4096]).max() <= 2.0 + 1e-9
    assert above[:4096].min() < -1.99
    assert above[:4096].max() > 1.99
    assert points[:, 2].min() >= grid.floor
    rest = points[4096:, 2]
    assert rest.max() > texture.extremes[1] - 0.01 * np.ptp(rest)
    assert rest.min() < grid.floor + 0.01 * np.ptp(rest)
    parts = (points[:, :2] - texture.domain.origin) @ np.linalg.inv(texture.domain.spans)
    assert 0.0 <= parts.min() < 0.01
    assert 0.99 < parts.max() <= 1.0

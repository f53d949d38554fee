"""Where the nodes of a tabulated law H are, and what is proved from them, by hand."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from asperity.analysis.split import baked_field as potential_grid
from asperity.analysis.split import baked_field as potential_table
from asperity.analysis.split.baked_field import FieldGrid, curvature_bounds
from asperity.core.units import round_up
from asperity.kernels import fuse
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import HeightMap

WAVE = Sinusoid(0.1e-3, 1e-3)


def grid(steps: list[list[float]], cells: tuple[int, ...], *, periodic: bool = True) -> FieldGrid:
    return FieldGrid(np.array(steps), cells, np.array([1e-3, 2e-3]), 6, 0.1, 5.0, periodic)


@pytest.mark.parametrize("resolution", [0.7e-4, 1e-4, 3e-4, 1.0])
def test_nodes_are_at_most_the_resolution_apart(resolution: float) -> None:
    surface = Surface(WAVE, "H", max_depth=0.35e-3)
    found = FieldGrid.fit(surface, resolution)
    along, rise = found.spacing
    for spacing, length, count in (
        (along, 1e-3, found.cells[0]),
        (rise, 0.55e-3, found.levels - 3),
    ):
        assert spacing <= resolution * (1 + 1e-12)
        assert count >= 4
        assert count == 4 or length / (count - 1) > resolution * (1 - 1e-12)
        assert spacing * count == pytest.approx(length, rel=1e-12)
    # The floor is halfway between the two lowest levels, two levels are above the highest point.
    low, next_one = found.height(0), found.height(1)
    assert 0.5 * (low + next_one) == pytest.approx(-0.1e-3 - 0.35e-3, rel=1e-12)
    above = found.height(np.arange(found.levels)) > WAVE.extremes[1]
    np.testing.assert_array_equal(np.flatnonzero(above), [found.levels - 2, found.levels - 1])
    assert found.height(found.levels - 2) == pytest.approx(0.1e-3 + 0.5 * rise, rel=1e-9)


def test_borders_repeat_or_are_mirrored() -> None:
    steps = [[0.1, 0.0]]
    assert grid(steps, (4,)).nodes(0).tolist() == [3, 0, 1, 2, 3, 0, 1]
    assert grid(steps, (4,), periodic=False).nodes(0).tolist() == [1, 0, 1, 2, 3, 4, 3]
    assert grid([[0.1, 0.0], [0.0, 0.2]], (4, 5)).shape == (7, 8, 6)


def test_the_proved_errors_by_hand() -> None:
    """Variance of a quarter of each squared step, and a twelfth of the step's own."""
    gradient, potential = grid([[0.3, 0.0], [0.0, 0.2]], (4, 4)).error_bounds(2.0)
    squares = np.array([0.09, 0.04, 0.01])
    assert potential == pytest.approx(0.5 * 2.0 * 0.25 * 0.14, rel=1e-12)
    parts = 2.0 * np.sqrt(0.25 * 0.14 + squares / 12.0)
    assert gradient == pytest.approx(math.sqrt(float(parts @ parts)), rel=1e-12)


def test_steps_that_lean_enlarge_the_error() -> None:
    """A gradient is solved for from its parts along unit steps at 60 degrees: at most √2 longer."""
    upright, _ = grid([[0.1, 0.0], [0.0, 0.1]], (4, 4)).error_bounds(1.0)
    lean = [[0.1, 0.0], [0.05, 0.1 * math.sqrt(0.75)]]
    leaning, _ = grid(lean, (4, 4)).error_bounds(1.0)
    directions = np.array(lean) / 0.1
    longest = 1.0 / np.linalg.svd(directions, compute_uv=False)[-1]
    assert longest == pytest.approx(math.sqrt(2.0), rel=1e-12)
    assert leaning == pytest.approx(longest * upright, rel=1e-12)


@pytest.mark.parametrize("periodic", [True, False])
@pytest.mark.parametrize("stiffer", [0, 1])
def test_the_greatest_of_all_parts_counts(
    periodic: bool, stiffer: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every column is searched once; positive and negative eigenvalues each by their greatest."""
    seen: list[int] = []

    def hull_batch(first: int, last: int, out: np.ndarray, _table: object) -> None:
        seen.extend(range(first, last))
        for side in range(2):
            size = (3.0 if side == stiffer else 1.0) + (1.0 if first == 16 else 0.0)
            out[side] = (size + 0.5, size, first, 0.5, 2.0)

    monkeypatch.setattr(fuse, "fuse_module", lambda *_: SimpleNamespace(hull_batch=hull_batch))
    own = grid([[0.1, 0.0], [0.0, 0.2]], (40, 4), periodic=periodic)
    table = own.kernel_arguments(np.full((7, 43, 6), 2.0))
    norm, positive = curvature_bounds(own, table)
    assert sorted(seen) == list(range(40 if periodic else 41))
    rounding = potential_grid._DIFFERENCE_ROUNDING * 2.0 / 0.1**2
    assert rounding > 0.0
    assert (norm.lower, norm.upper) == (4.0, 4.5 + rounding)
    size = 4.0 if stiffer == 0 else 2.0
    assert (positive.lower, positive.upper) == (size, size + 0.5 + rounding)
    # At the node (16, ½) and level 2: where the witness was found.
    place = (1e-3 + 16 * 0.1, 2e-3 + 0.5 * 0.2, 5.0 + 1.5 * 0.1)
    assert norm.at == pytest.approx(place)
    assert positive.at == pytest.approx(place)


def test_the_table_is_given_the_place_of_its_first_node() -> None:
    own = grid([[0.1, 0.0], [0.0, 0.2]], (4, 4), periodic=False)
    table = own.kernel_arguments(np.zeros((7, 7, 6)))
    place = np.array([1e-3 + 0.25, 2e-3 + 0.3])
    rates = np.array([[table.m00, table.m01], [table.m10, table.m11]])
    np.testing.assert_allclose(rates @ (place - [table.x0, table.y0]), [2.5, 1.5], rtol=1e-12)
    assert table.z0 == pytest.approx(5.0 - 0.05)
    assert own.bytes == 8 * 7 * 7 * 6


def test_a_map_that_ends_is_fitted_from_its_corner() -> None:
    texture = HeightMap(1e-5 * np.random.default_rng(0).normal(size=(9, 12)), 1e-4)
    found = FieldGrid.fit(Surface(texture, "H", max_depth=1e-4), 0.9e-4)
    assert not found.periodic
    np.testing.assert_allclose(found.start, texture.domain.origin)
    ends = found.start + np.array(found.cells) @ found.steps
    np.testing.assert_allclose(ends, texture.domain.origin + texture.domain.spans.sum(axis=0))


# --- how fine a table is --------------------------------------------------------------------------


@pytest.mark.parametrize("most", [3_000, 40_000, 10**6])
def test_the_finest_resolution_that_fits_is_found_to_three_digits(most: int) -> None:
    """On a wave of 1 mm, and on one of 4 km, whose nodes are farther apart than 1 m."""
    for size in (1.0, 4e6):
        texture = Sinusoid(0.1e-3 * size, 1e-3 * size)
        surface = Surface(texture, "H", max_depth=0.35e-3 * size)
        found = potential_table._finest_resolution(surface, most)
        assert FieldGrid.fit(surface, found).bytes <= most
        assert FieldGrid.fit(surface, found / 1.002).bytes > most


def test_three_digits_are_never_finer() -> None:
    for value in 10.0 ** np.random.default_rng(3).uniform(-8.0, 2.0, 300):
        found = round_up(value)
        unit = 10.0 ** (math.floor(math.log10(value)) - 2)
        assert value <= found <= value + unit * (1.0 + 1e-9)
        assert abs(found / unit - round(found / unit)) < 1e-6


@pytest.mark.parametrize(("limit", "counted"), [(2**28, "waves"), (10_000, "bytes")])
def test_the_default_is_64_nodes_a_wave_or_the_size_limit(limit: int, counted: str) -> None:
    surface = Surface(WAVE, "H", max_depth=0.35e-3)
    slope, hessian = WAVE.bounds
    found = potential_table._default_grid(surface, limit)
    if counted == "waves":
        finest = 2.0 * math.pi * slope / hessian / 64
        assert found.shape == FieldGrid.fit(surface, finest).shape
    else:
        assert found.bytes <= limit < FieldGrid.fit(surface, 0.99 * min(found.spacing)).bytes
    # A million nodes of eight bytes, however much is allowed; a flat surface has no shortest wave.
    flat = Surface(HeightMap(np.zeros((4, 5)), 1e-4), "H", max_depth=1e-4)
    assert 7e6 < potential_table._default_grid(flat, 2**28).bytes <= 8e6


def test_half_of_the_probes_are_near_the_surface() -> None:
    """4096 within two nodes of it, as many all over; none below the floor, all over the table."""
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

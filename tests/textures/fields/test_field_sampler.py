"""The force kernels of a baked field against half the square of a B-spline of a dense array."""

from __future__ import annotations

import itertools
import math

import numba
import numpy as np
import pytest
from scipy.interpolate import BSpline

from asperity.core.checks import FloatArray
from asperity.textures.fields import field_sampler as kernels
from asperity.textures.fields.field_grid import FieldGrid, SingleArray
from asperity.textures.fields.field_record import MIRRORED, PERIODIC, ZERO, FieldArguments
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.bspline_kernels import fold_coordinate

WAVE = Sinusoid(1e-4, 1e-3)
STEPS = np.array([[1.1e-5, 0.3e-5], [-0.2e-5, 0.9e-5]])
BORDERS = [PERIODIC, MIRRORED, ZERO]
AXES = [1, 2]


def random_field(axes: int, border: int) -> tuple[FieldGrid, SingleArray, FieldArguments]:
    """Return a grid of random depths in columns of random ends, some of them empty."""
    rng = np.random.default_rng(10 * axes + border)
    cells = (7, 5)[:axes]
    grid = FieldGrid(STEPS[:axes], cells, np.array([2e-5, -1e-5]), 12, 0.8e-5, -1.4e-5, 3, border)
    dense = rng.uniform(1e-4, 3e-4, grid.node_counts).astype(np.float32)
    levels = np.arange(grid.levels)
    plane = grid.node_counts[:-1]
    first = rng.integers(0, 4, plane) if border == ZERO else np.zeros(plane, int)
    end = rng.integers(0, grid.levels - 1, plane)  # two levels are above every body
    outside = (levels < first[..., None]) | (levels >= end[..., None])
    outside |= rng.uniform(size=dense.shape) < 0.1
    dense[outside] = -np.float32(grid.margin)
    return grid, dense, grid.arguments(dense)._replace(lift=0.7e-5)


def basis(t: FloatArray, order: int) -> FloatArray:
    """Return the quadratic B-spline at t, or its first or second derivative."""
    a, inner = np.abs(t), np.abs(t) < 0.5
    if order == 0:
        values = np.where(inner, 0.75 - t * t, 0.5 * (1.5 - a) ** 2)
    elif order == 1:
        values = np.where(inner, -2.0 * t, np.sign(t) * (a - 1.5))
    else:
        values = np.where(inner, -2.0, 1.0)
    return np.where(a < 1.5, values, 0.0)


def dense_spline(
    grid: FieldGrid, dense: FloatArray, nodes: FloatArray, orders: tuple[int, ...]
) -> FloatArray:
    """Return a derivative by the coordinates in nodes (n, d + 1), by a sum over all nodes."""
    result = np.broadcast_to(dense.astype(float), (len(nodes), *dense.shape))
    for axis, order in enumerate(orders):
        count = dense.shape[axis]
        weights = np.zeros((len(nodes), count))
        for place in range(-6 * count, 7 * count):
            node = place
            if axis < len(orders) - 1 and grid.border == PERIODIC:
                node = place % count
            elif axis < len(orders) - 1 and grid.border == MIRRORED:
                node = place % (2 * count - 2)
                node = min(node, 2 * count - 2 - node)
            if 0 <= node < count:
                weights[:, node] += basis(nodes[:, axis] - place, order)
        result = np.einsum("nk...,nk->n...", result, weights)
    return np.asarray(result)


def derivatives(
    grid: FieldGrid, dense: FloatArray, points: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return T, ∇T and Hess T at points above the floor, by :func:`dense_spline`."""
    axes = len(grid.cells)
    rates = np.zeros((axes + 1, 3))
    rates[:axes, :2] = np.linalg.pinv(grid.steps).T
    rates[axes, 2] = 1.0 / grid.level_spacing
    nodes = (points - [*grid.start, grid.height(0)]) @ rates.T
    unit = np.eye(axes + 1, dtype=int)
    coefficients = np.maximum(dense + grid.margin, 0.0).astype(float)  # summed in single precision
    value = dense_spline(grid, coefficients, nodes, (0,) * (axes + 1)) - grid.margin
    first = np.stack([dense_spline(grid, coefficients, nodes, tuple(row)) for row in unit], axis=-1)
    second = np.empty((len(points), axes + 1, axes + 1))
    for a, b in itertools.product(range(axes + 1), repeat=2):
        second[:, a, b] = dense_spline(grid, coefficients, nodes, tuple(unit[a] + unit[b]))
    slope, inside = first @ rates, value > 0.0
    hessian = slope[:, :, None] * slope[:, None] + value[:, None, None] * (rates.T @ second @ rates)
    return (
        np.where(inside, 0.5 * value**2, 0.0),
        np.where(inside[:, None], value[:, None] * slope, 0.0),
        np.where(inside[:, None, None], hessian, 0.0),
    )


def random_points(grid: FieldGrid, count: int) -> FloatArray:
    """Return points above the floor, also far beyond the border and above the last level."""
    rng = np.random.default_rng(5)
    nodes = rng.uniform(-2.5, 3.5, (count, len(grid.cells))) * grid.cells
    across = rng.uniform(-1e-4, 1e-4, (count, 1)) * [-STEPS[0, 1], STEPS[0, 0]]
    xy = grid.positions(nodes) + (across if len(grid.cells) == 1 else 0.0)
    top = grid.height(grid.levels + 1)
    return np.column_stack([xy, rng.uniform(grid.floor, top, count)])


@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.parametrize("axes", AXES)
def test_columns_equal_a_spline_of_the_dense_array(axes: int, border: int) -> None:
    grid, dense, arguments = random_field(axes, border)
    points = random_points(grid, 400)
    if border == ZERO:  # beyond its last node a closed body has no force
        points[:200, :2] = grid.positions(
            np.random.default_rng(6).uniform(0.0, 1.0, (200, axes)) * grid.cells
        )
        dense = dense.copy()
        for axis in range(axes):
            np.moveaxis(dense, axis, 0)[[0, 1, -2, -1]] = -np.float32(grid.margin)
        arguments = grid.arguments(dense)
    value, slope, hessian = derivatives(grid, dense, points)
    assert np.count_nonzero(value) > (50 if border != ZERO else 4)
    found = np.array([kernels.field_expansion(*p, arguments) for p in points])
    gradient = np.array([kernels.field_gradient(*p, arguments) for p in points])
    size, spacing = float(dense.max()) ** 2, min(grid.spacing)
    np.testing.assert_allclose(found[:, 0], value, atol=1e-13 * size)
    np.testing.assert_allclose(gradient, slope, atol=1e-12 * size / spacing)
    entries = hessian[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]
    np.testing.assert_allclose(found[:, 1:], entries, atol=1e-11 * size / spacing**2)


@pytest.mark.parametrize("border", [PERIODIC, MIRRORED])
@pytest.mark.parametrize("axes", AXES)
def test_field_below_the_floor_is_that_above_the_bottom(axes: int, border: int) -> None:
    """T(floor - d) = T(floor - ψ) + g, by its definition with F = 6 spacings."""
    grid, dense, arguments = random_field(axes, border)
    points = random_points(grid, 300)
    size, depth = 6.0 * grid.level_spacing, np.linspace(0.0, 9.0, 300) * grid.level_spacing
    r = np.minimum(depth / size, 1.0)
    rest = depth - size * r
    points[:, 2] = grid.floor - size * (r - 0.5 * r * r)
    value, slope, _hessian = derivatives(grid, dense, points)
    below = points.copy()
    below[:, 2] = grid.floor - depth
    found = np.array([kernels.field_expansion(*p, arguments) for p in below])
    gradient = np.array([kernels.field_gradient(*p, arguments) for p in below])
    rate, lift = 1.0 - r, arguments.lift
    added = size * r * r * (0.5 * lift + size * r * (0.5 - r / 8.0))
    lower_slope = lift * r + size * (1.5 * r**2 - 0.5 * r**3)
    inside, scale = value > 0.0, float(dense.max()) ** 2
    assert 30 < np.count_nonzero(inside) <= 300
    expected = np.where(inside, value + added + (lower_slope + 0.5 * rest) * rest, 0.0)
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-12 * scale)
    slope[:, 2] = np.where(inside, rate * slope[:, 2] - lower_slope - rest, 0.0)
    np.testing.assert_allclose(gradient, slope, atol=1e-11 * scale / min(grid.spacing))
    # The second derivative along z is the difference of the slope, and 1 far below.
    step = 1e-9
    shift = np.array([0.0, 0.0, step])
    ends = [
        np.array([kernels.field_gradient(*p, arguments)[2] for p in below + sign * shift])
        for sign in (1.0, -1.0)
    ]
    numeric = (ends[0] - ends[1]) / (2.0 * step)
    assert np.quantile(np.abs(numeric - found[:, 6]), 0.95) < 1e-5
    np.testing.assert_array_equal(found[(r == 1.0) & inside, 6], 1.0)


def test_a_closed_body_has_no_force_beyond_its_last_node() -> None:
    grid, dense, arguments = random_field(2, ZERO)
    for u, v in ((-0.1, 2.0), (7.1, 2.0), (3.0, -0.1), (3.0, 5.1)):
        x, y = grid.positions(np.array([u, v]))
        assert kernels.field_gradient(x, y, 0.0, arguments) == (0.0, 0.0, 0.0)
        assert kernels.field_expansion(x, y, 0.0, arguments) == (0.0,) * 7
    # Nor is its floor a wall where the body ends above it.
    x, y = grid.positions(np.array([3.0, 2.0]))
    hollow = grid.arguments(np.where(np.arange(12) < 3, -grid.margin, dense).astype(np.float32))
    assert kernels.field_expansion(x, y, grid.floor - 1e-3, hollow)[6] == 0.0


@pytest.mark.parametrize("border", BORDERS)
def test_force_is_zero_above_the_height_of_the_sampler(border: int) -> None:
    """Two levels below it some force is not."""
    grid, _dense, arguments = random_field(2, border)
    forces = []
    for x, y, _z in random_points(grid, 200):
        top = kernels.sample_height(x, y, arguments)
        assert top <= grid.height(grid.levels - 0.5) + 1e-12
        assert not any(kernels.field_gradient(x, y, top + 1e-15, arguments))
        forces.append(kernels.field_gradient(x, y, top - 2.0 * grid.level_spacing, arguments))
    assert np.any(forces)


@pytest.mark.parametrize("border", BORDERS)
def test_no_place_however_far_is_outside_of_the_table(border: int) -> None:
    """Rounding may leave nothing of a place far away: its force is that of some place inside."""
    for u in [sign * m * 10.0**e for sign in (-1, 1) for m in (1.2345, 7.1) for e in range(308)]:
        assert 0.0 <= kernels.field_fold(u, 7, border)[0] <= 7.0
    near, sign = kernels.field_fold(-0.25, 7, border)
    assert (near, sign) == {PERIODIC: (6.75, 1.0), MIRRORED: (0.25, -1.0), ZERO: (0.0, 0.0)}[border]


def test_compiled_places_that_are_not_numbers_are_inside_of_the_table() -> None:
    fold = numba.njit(fold_coordinate)
    for u in (math.nan, math.inf, -math.inf):
        for periodic in (True, False):
            assert fold(u, 7, periodic)[0] == 0.0


def test_functions_of_the_contact_repeat_gradient_and_potential() -> None:
    _grid, _dense, arguments = random_field(2, PERIODIC)
    p = (3e-5, 1e-5, -2e-5)
    gradient = np.array(kernels.field_gradient(*p, arguments))
    value, *hessian = kernels.field_expansion(*p, arguments)
    assert gradient.any()
    np.testing.assert_array_equal(kernels.split_contact(*p, 1.0, arguments), -gradient)
    warm = kernels.split_contact_energy(*p, 1.0, np.zeros(3), arguments)
    np.testing.assert_array_equal(warm[:3], -gradient)
    closest = kernels.closest_point_within_budget(*p, 0.0, 0.0, 9.0, arguments)
    np.testing.assert_array_equal(closest, [*(p - gradient), 0.0, 0.0, 0.0, 1.0])
    assert kernels.split_energy(*p, 1.0, arguments) == (value, 1, 0.0)
    derivative = kernels.split_derivative(*p, 1.0, arguments)
    np.testing.assert_array_equal(derivative, [*-gradient, *-np.array(hessian)])


# --- weights --------------------------------------------------------------------------------------


def test_spline_weights_and_their_derivatives() -> None:
    for t in (-0.5, -0.2, 0.0, 0.37, 0.5):
        weights = np.array(kernels.quadratic_weights(t))
        slopes = np.array(kernels.quadratic_weight_slopes(t))
        assert weights.sum() == pytest.approx(1.0, rel=1e-15)
        assert weights @ [-1.0, 0.0, 1.0] == pytest.approx(t, abs=1e-15)
        assert weights @ [1.0, 0.0, 1.0] == pytest.approx(t * t + 0.25, rel=1e-15)
        assert slopes.sum() == pytest.approx(0.0, abs=1e-15)
        assert slopes @ [-1.0, 0.0, 1.0] == pytest.approx(1.0, rel=1e-15)
        assert slopes @ [1.0, 0.0, 1.0] == pytest.approx(2.0 * t, abs=1e-15)


def test_places_below_the_floor_are_above_the_bottom() -> None:
    grid, _dense, arguments = random_field(1, PERIODIC)
    for z in (grid.floor, 0.0, 1e-4):
        assert kernels.field_level(z, arguments) == (z, 0.0)
    side = grid.level_spacing
    for depth, place, part in ((3.0, 2.25, 0.5), (6.0, 3.0, 1.0), (600.0, 3.0, 100.0)):
        found = kernels.field_level(grid.floor - depth * side, arguments)
        assert found == pytest.approx((grid.floor - place * side, part), rel=1e-12)


def stretched_field() -> tuple[FieldGrid, SingleArray, FieldArguments]:
    """Return a grid whose four lowest cells grow with depth, and random depths that grow too."""
    knots = np.array([-9e-5, -5e-5, -3e-5, -1.4e-5, -0.6e-5])
    start = np.array([2e-5, -1e-5])
    grid = FieldGrid(STEPS, (7, 5), start, 12, 0.8e-5, -3e-5, 1, PERIODIC, knots)
    rng = np.random.default_rng(4)
    depths = 1e-4 - grid.height(np.arange(12)) + rng.uniform(0.0, 3e-5, grid.node_counts)
    return grid, depths, grid.arguments((depths - grid.offsets()).astype(np.float32))


def test_stretched_spline_is_that_of_its_knots() -> None:
    """By SciPy's B-splines along z, and from cell to cell with the same value and slope."""
    grid, depths, arguments = stretched_field()
    top = grid.knots[-1] + grid.level_spacing * np.arange(1, 10)
    knots = np.concatenate([[-1.7e-4], grid.knots, top])
    places = np.array([[3.0, 2.0]])
    xy = grid.positions(places)[0]
    # At a node of the plane the weights are 1/8, 3/4, 1/8 along both axes.
    share = np.array([0.125, 0.75, 0.125])
    column = np.einsum("ijk,i,j->k", depths[2:5, 1:4], share, share)
    spline = BSpline(knots, column, 2)
    for z in np.append(np.linspace(-2.9e-5, 3e-5, 60), grid.knots[2:]):
        *gradient, energy = kernels.field_slope(xy[0], xy[1], z, arguments)
        depth = float(spline(z))
        assert energy == pytest.approx(0.5 * depth**2, rel=1e-6)
        assert gradient[2] == pytest.approx(depth * float(spline(z, 1)), rel=1e-5, abs=1e-10)
        value, _xx, _xy, _xz, _yy, _yz, zz = kernels.field_expansion(xy[0], xy[1], z, arguments)
        assert value == pytest.approx(energy, rel=1e-12)
        if np.abs(z - knots).min() > 1e-12:
            expected = float(spline(z, 1)) ** 2 + depth * float(spline(z, 2))
            assert zz == pytest.approx(expected, rel=1e-3, abs=1e-3)


def test_small_coefficients_are_stored_of_deep_levels() -> None:
    """A depth of 25 mm in single precision would be wrong by a nanometre."""
    domain = WAVE.domain
    grid = FieldGrid.fit(domain, (-1e-4, 1e-4), 25e-3, 0.0, 2e-5, 1.25)
    depths = np.broadcast_to(1e-4 - grid.height(np.arange(grid.levels)), grid.node_counts)
    arguments = grid.arguments((depths - grid.offsets()).astype(np.float32))
    assert arguments.c.max() < 4e-4
    for z in np.linspace(-25e-3, 0.0, 40):
        *gradient, energy = kernels.field_slope(3.3e-4, 0.0, float(z), arguments)
        assert energy == pytest.approx(0.5 * (1e-4 - z) ** 2, rel=1e-7)
        assert gradient[2] == pytest.approx(z - 1e-4, rel=1e-6)


@pytest.mark.parametrize("border", BORDERS)
def test_fold_returns_a_coordinate_inside_and_its_sign(border: int) -> None:
    cells = 6
    for u in np.linspace(-20.0, 20.0, 401):
        inside, sign = kernels.field_fold(u, cells, border)
        assert 0.0 <= inside <= cells
        if 0.0 <= u <= cells:
            assert (inside, sign) == (u, 1.0)
        elif border == ZERO:
            assert sign == 0.0
        else:
            period = cells if border == PERIODIC else 2 * cells
            turns = (u - sign * inside) / period
            assert turns == pytest.approx(round(turns), abs=1e-12)
            assert sign == 1.0 or border == MIRRORED

"""Nodes of a baked field, what it stores of them, and its proved error bounds, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from asperity.textures.fields.field_grid import FieldGrid
from asperity.textures.fields.field_record import END, FIRST, MIRRORED, PERIODIC, REACH, ZERO
from asperity.textures.fields.node_potentials import smooth
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import HeightMap

WAVE = Sinusoid(0.1e-3, 1e-3)
SQUARE = [[0.1, 0.0], [0.0, 0.2]]


def grid(steps: list[list[float]], cells: tuple[int, ...], border: int = PERIODIC) -> FieldGrid:
    return FieldGrid(np.array(steps), cells, np.array([1e-3, 2e-3]), 6, 0.1, 5.0, 1, border)


@pytest.mark.parametrize("resolution", [1e-5, 0.7e-4])
def test_levels_below_the_surface_are_ever_farther_apart(resolution: float) -> None:
    fitted = FieldGrid.fit(WAVE.domain, WAVE.extremes, 25e-3, 1e-4, resolution, 1.2)
    sides = np.diff(fitted.knots)[::-1]
    assert sides[0] == pytest.approx(resolution)
    count = fitted.stretched - fitted.below - 1
    ratios = sides[1:count] / sides[: count - 1]
    assert ratios == pytest.approx(ratios[0])
    assert 1.0 < ratios[0] <= 1.2
    assert sides[count:] == pytest.approx(sides[count - 1])
    assert fitted.knots[fitted.below + 1] == pytest.approx(fitted.floor)
    assert fitted.floor == pytest.approx(-0.1e-3 - 25e-3)
    # Equal cells reach down to the lowest place, but for less than one of them.
    assert -0.1e-3 - resolution < fitted.knots[-2] <= -0.1e-3 + 1e-12
    # A mean of a linear depth is itself.
    depths = -fitted.height(np.arange(fitted.levels))
    means = (depths - fitted.offsets()).astype(np.float32)[None]
    before = means.copy()
    smooth(means, np.full(means.shape, 255, np.uint8), fitted)
    np.testing.assert_allclose(means[0, :-1], before[0, :-1], atol=1e-3 * resolution)


@pytest.mark.parametrize("fade", [0.0, 1e-4])
@pytest.mark.parametrize("resolution", [3e-4, 1.0])
def test_node_spacing_is_at_most_the_resolution(resolution: float, fade: float) -> None:
    fitted = FieldGrid.fit(WAVE.domain, WAVE.extremes, 0.35e-3, fade, resolution)
    assert not fitted.stretched
    along, rise = fitted.spacing
    above = fitted.height(np.arange(fitted.levels)) > WAVE.extremes[1]
    first_above = int(above.argmax())
    for spacing, length, count in (
        (along, 1e-3, fitted.cells[0]),
        (rise, 0.55e-3, first_above - fitted.below - 1),
    ):
        assert spacing <= resolution * (1 + 1e-12)
        assert count >= 4
        assert count == 4 or length / (count - 1) > resolution * (1 - 1e-12)
        assert spacing * count == pytest.approx(length, rel=1e-12)
    # The floor is halfway between two levels, above at least two cells and those of the fade.
    around = fitted.height(fitted.below), fitted.height(fitted.below + 1)
    assert 0.5 * sum(around) == pytest.approx(fitted.floor, rel=1e-12)
    assert fitted.floor == pytest.approx(-0.1e-3 - 0.35e-3, rel=1e-12)
    assert fitted.below == max(2, math.ceil(fade / rise))
    # Above the highest point the levels reach the margin, in which the depth is negative.
    assert fitted.margin == pytest.approx(2.75 * max(along, rise))
    assert fitted.height(first_above) == pytest.approx(0.1e-3 + 0.5 * rise, rel=1e-9)
    highest = fitted.height(fitted.levels - 1)
    assert 0.1e-3 + fitted.margin <= highest < 0.1e-3 + fitted.margin + 1.5 * rise


def test_grid_of_a_closed_body_has_three_nodes_of_margin_around_its_box() -> None:
    lower, upper = np.array([-1.0, 2.0, 0.3]), np.array([0.5, 2.9, 1.27])
    fitted = FieldGrid.around(lower, upper, 0.1)
    assert fitted.border == ZERO
    assert fitted.spacing == pytest.approx((0.1, 0.1, 0.1), rel=1e-12)
    counts = np.array(fitted.node_counts) - 1
    first = np.array([*fitted.start, fitted.height(0)])
    assert (lower - first > 0.2999).all()
    assert (first + 0.1 * counts - upper > 0.2999).all()
    assert (counts * 0.1 <= upper - lower + 0.7 + 1e-12).all()


def test_nodes_beyond_a_border_repeat_are_mirrored_or_missing() -> None:
    steps = [[0.1, 0.0]]
    assert grid(steps, (4,)).stored_nodes(0).tolist() == [3, 0, 1, 2, 3, 0, 1]
    assert grid(steps, (4,), MIRRORED).stored_nodes(0).tolist() == [1, 0, 1, 2, 3, 4, 3]
    assert grid(steps, (4,), ZERO).stored_nodes(0).tolist() == [-1, 0, 1, 2, 3, 4, -1]
    assert grid(SQUARE, (4, 5)).node_counts == (4, 5, 6)
    assert grid(SQUARE, (4, 5), MIRRORED).node_counts == (5, 6, 6)


def test_columns_hold_only_what_is_inside_of_the_margin() -> None:
    """And the reach of a column is the greatest end of positive depth around it."""
    fitted = grid(SQUARE, (5, 4), ZERO)
    margin = fitted.margin
    assert margin == pytest.approx(0.55)
    dense = np.full(fitted.node_counts, -margin, np.float32)
    dense[2, 3, 1:5] = 1.0, -0.3, 2.0, -0.5
    dense[4, 0, :3] = 3.0, -0.4, -0.54
    arguments = fitted.arguments(dense)
    assert arguments.c.dtype == np.float32
    # Of the margin a twentieth is cut off.
    expected = margin + np.array([1.0, -0.3, 2.0, -0.5, 3.0, -0.4])
    np.testing.assert_allclose(np.sort(arguments.c), np.sort(expected), rtol=1e-6)
    table = arguments.columns
    assert table.shape == (4 + 3, 5 + 3, 4)
    ends = np.zeros((7, 8))
    ends[3 + 1, 2 + 1], ends[0 + 1, 4 + 1] = 5, 2
    np.testing.assert_array_equal(table[..., END], ends)
    assert table[4, 3, FIRST] == 1
    reach = np.zeros((7, 8))
    reach[0:3, 4:7], reach[3:6, 2:5] = 1, 4
    np.testing.assert_array_equal(table[..., REACH], reach)


def test_arguments_contain_the_position_of_the_first_node() -> None:
    fitted = grid(SQUARE, (4, 4), MIRRORED)
    arguments = fitted.arguments(np.full((5, 5, 6), -1.0, np.float32))
    assert arguments.c.size == 0
    position = np.array([1e-3 + 0.25, 2e-3 + 0.3])
    rates = np.array([[arguments.m00, arguments.m01], [arguments.m10, arguments.m11]])
    place = rates @ (position - [arguments.x0, arguments.y0])
    np.testing.assert_allclose(place, [2.5, 1.5], rtol=1e-12)
    assert arguments.z0 == pytest.approx(5.0 - 0.15)
    assert arguments.below == 1
    assert arguments.margin == pytest.approx(0.55)
    assert (arguments.levels, arguments.border) == (6, MIRRORED)


@pytest.mark.parametrize("passes", [0, 6, 15])
def test_contact_begins_within_the_bound_and_near_it_at_worst(passes: int) -> None:
    """A half-space seen by the worst points of a mean square: one far inside, the others outside.

    With a weight w of points at a distance σ/√w inside, S is positive up to the bound.
    """
    fitted = grid([[0.1, 0.0], [0.0, 0.1]], (4, 4))
    bound = fitted.onset_bound(passes)
    shares = np.linspace(1e-3, 1.0, 1000)
    heights = np.linspace(0.0, 3.0 * bound, 3001)[:, None]
    distances = math.sqrt(fitted.spread(passes)) / np.sqrt(shares)
    inside = np.maximum(distances - heights, -fitted.margin)
    means = shares * inside + (1.0 - shares) * np.maximum(-heights, -fitted.margin)
    highest = heights[(means > 1e-12).any(axis=1)].max()
    assert 0.99 * bound < highest <= bound


# --- error bounds ---------------------------------------------------------------------------------


@pytest.mark.parametrize("passes", [0, 1, 3])
def test_error_bounds_by_hand(passes: int) -> None:
    """Variances: a quarter of a squared step, as much for each pass, and a quarter along it.

    The slope of the depth grows by 2 (1/40 + 3/2040) 0.3/0.1 in a pass along each other axis.
    """
    fitted = grid([[0.3, 0.0], [0.0, 0.2]], (4, 4))
    gradient, potential = fitted.error_bounds(2.0, passes)
    squares = np.array([0.09, 0.04, 0.01])
    spread = (0.25 + 0.25 * passes) * 0.14
    reach = (1.5 + passes) * math.sqrt(0.14)
    assert potential == pytest.approx(max(1.5 * spread, reach * math.sqrt(spread)), rel=1e-12)
    slope = (1.0 + 6.0 * (1.0 / 40.0 + 3.0 / 2040.0)) ** (2 * passes)
    parts = 3.0 * (spread + squares / 4.0) / np.sqrt(squares) + slope * math.sqrt(spread)
    assert gradient == pytest.approx(math.sqrt(float(parts @ parts)), rel=1e-12)


def test_error_bounds_include_single_precision() -> None:
    fitted = grid([[0.3, 0.0], [0.0, 0.2]], (4, 4))
    rounding = 13.0 * 3.0 * 2.0**-24
    gradient, potential = fitted.error_bounds(1.0, 2, 3.0)
    exact_gradient, exact_potential = fitted.error_bounds(1.0, 2)
    assert potential - exact_potential == pytest.approx(3.0 * rounding, rel=1e-6)
    slope = (1.0 + 6.0 * (1.0 / 40.0 + 3.0 / 2040.0)) ** 4
    parts = rounding * (slope + 6.0 / np.array([0.3, 0.2, 0.1]))
    assert 0.0 < gradient - exact_gradient <= math.sqrt(float(parts @ parts)) * (1.0 + 1e-6)


def test_oblique_steps_increase_the_error_bound() -> None:
    """The gradient from its components along unit steps at 60 degrees is at most √2 longer."""
    upright, _ = grid([[0.1, 0.0], [0.0, 0.1]], (4, 4)).error_bounds(1.0)
    oblique_steps = [[0.1, 0.0], [0.05, 0.1 * math.sqrt(0.75)]]
    oblique, _ = grid(oblique_steps, (4, 4)).error_bounds(1.0)
    directions = np.array(oblique_steps) / 0.1
    longest = 1.0 / np.linalg.svd(directions, compute_uv=False)[-1]
    assert longest == pytest.approx(math.sqrt(2.0), rel=1e-12)
    assert oblique == pytest.approx(longest * upright, rel=1e-12)


def test_grid_of_a_finite_map_starts_at_its_corner() -> None:
    texture = HeightMap(1e-5 * np.random.default_rng(0).normal(size=(9, 12)), 1e-4)
    fitted = FieldGrid.fit(texture.domain, texture.extremes, 1e-4, 0.0, 0.9e-4)
    assert fitted.border == MIRRORED
    np.testing.assert_allclose(fitted.start, texture.domain.origin)
    ends = fitted.start + np.array(fitted.cells) @ fitted.steps
    np.testing.assert_allclose(ends, texture.domain.origin + texture.domain.spans.sum(axis=0))

"""Smoothing of a field's nodes: a mean of shifted copies of the exact potential."""

from __future__ import annotations

import numpy as np
import pytest

import asperity as asp
from asperity.analysis.split.split_state import split_state
from asperity.core.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.fields.bake import BakeGoal, bake_texture
from asperity.textures.fields.field_grid import FieldGrid, SingleArray
from asperity.textures.fields.field_sampler import MIRRORED, PERIODIC, ZERO
from asperity.textures.fields.node_potentials import compute_potentials, smooth, split_columns
from asperity.textures.fields.potential_field import PotentialField
from asperity.textures.spline.spline_texture import HeightMap, Profile
from asperity.textures.texture import Texture

K = 900.0
DEPTH = 1e-4
_ROUGH = np.random.default_rng(11).normal(size=(6, 7))
TEXTURES: dict[str, Texture] = {
    "profile": Profile(8e-5 * _ROUGH[0], 1e-4),
    "map": HeightMap(5e-5 * _ROUGH, (1e-4, 1.3e-4), periodic=True),
    "finite map": HeightMap(5e-5 * _ROUGH, (1e-4, 1.3e-4)),
}


def potentials_of(name: str, c: float) -> tuple[FieldGrid, SingleArray]:
    texture = TEXTURES[name]
    grid = FieldGrid.fit(texture.domain, texture.extremes, DEPTH, 2.5e-5, 3).extend_down(3)
    return grid, compute_potentials(split_columns(texture, c), grid)


def second_differences(grid: FieldGrid, potentials: FloatArray) -> list[FloatArray]:
    """Return those along each axis [1], also across the borders."""
    result = []
    for axis, spacing in enumerate(grid.spacing):
        rows = np.moveaxis(potentials.astype(float), axis, 0)
        if axis < len(grid.cells):
            rows = rows[grid.stored_nodes(axis)]
        result.append(np.diff(rows, 2, axis=0) / spacing**2)
    return result


@pytest.mark.parametrize("c", [1.0, 4.0])
@pytest.mark.parametrize("name", TEXTURES)
def test_second_differences_stay_within_the_bounds_of_the_law(name: str, c: float) -> None:
    """-c <= second differences <= 1 after each pass, to single precision; both nearly attained."""
    grid, potentials = potentials_of(name, c)
    rounding = 4.0 * float(potentials.max()) * 2.0**-23 / min(grid.spacing) ** 2
    lows = []
    for passes in range(4):
        parts = second_differences(grid, potentials)
        low, high = min(part.min() for part in parts), max(part.max() for part in parts)
        assert -c - rounding <= low
        assert 0.98 < high <= 1.0 + rounding
        lows.append(low)
        if passes < 3:
            potentials = smooth(potentials, grid)
    assert lows[0] < -0.8 * c
    assert (np.diff(lows) > -rounding).all()  # a mean is gentler than what it is of


@pytest.mark.parametrize("border", [PERIODIC, MIRRORED, ZERO])
@pytest.mark.parametrize("axes", [1, 2])
def test_a_pass_is_a_mean_of_a_node_and_its_neighbours(axes: int, border: int) -> None:
    """Against a plain sum; the lowest level is lost, and zero is above the highest."""
    steps = np.array([[1.0, 0.2], [0.0, 1.0]])[:axes]
    grid = FieldGrid(steps, (5, 4)[:axes], np.zeros(2), 6, 1.0, 0.0, border)
    values = np.random.default_rng(2).uniform(size=grid.node_counts).astype(np.float32)
    expected = values.astype(float)
    for axis in range(axes):
        places = grid.stored_nodes(axis)[: expected.shape[axis] + 2]
        wide = np.take(expected, places, axis=axis)
        missing = [-1 if k == axis else 1 for k in range(expected.ndim)]
        wide = np.where((places < 0).reshape(missing), 0.0, wide)
        a, b, d = (np.take(wide, np.arange(k, wide.shape[axis] - 2 + k), axis) for k in range(3))
        expected = 0.125 * a + 0.75 * b + 0.125 * d
    wide = np.concatenate([expected, np.zeros_like(expected[..., :1])], axis=-1)
    expected = 0.125 * wide[..., :-2] + 0.75 * wide[..., 1:-1] + 0.125 * wide[..., 2:]
    np.testing.assert_allclose(smooth(values, grid), expected, rtol=1e-6)


def smoothed_field(name: str, passes: int) -> PotentialField:
    """Return a field that is smoothed so often: the gain asked for is one that cannot be."""
    goal = BakeGoal(max_gain=0.5)
    assert goal.passes >= passes
    texture = TEXTURES[name]

    class Fixed(BakeGoal):
        @property
        def passes(self) -> int:
            return passes

    return bake_texture(texture, DEPTH, resolution=2.5e-5, goal=Fixed(max_gain=0.5))


@pytest.mark.parametrize("name", TEXTURES)
def test_smoothed_fields_keep_their_bounds_and_stay_inside_their_grid(name: str) -> None:
    """Each pass spreads the potential one level upwards; above them the force is zero."""
    texture, rng = TEXTURES[name], np.random.default_rng(4)
    exact = Surface(texture, "H", K, max_depth=DEPTH)
    gains, differences = [], []
    for passes in range(4):
        field = smoothed_field(name, passes)
        surface = exact.to_texture(field)
        assert field.passes == passes
        spans = texture.domain.spans
        xy = texture.domain.points(rng.uniform(-1.0, 2.0, (4000, len(spans))))
        top = texture.extremes[1] + (passes + 1) * field.grid.level_spacing
        points = np.column_stack([xy, rng.uniform(texture.extremes[0] - DEPTH, top, len(xy))])
        error = np.linalg.norm(surface.force(points) - exact.force(points), axis=1) / K
        assert error.max() <= field.accuracy.bound
        states = [split_state(each, points).potential / K for each in (surface, exact)]
        difference = np.abs(states[0] - states[1]).max()
        assert difference <= field.accuracy.potential_bound
        assert difference > 0.7 * field.accuracy.potential_bound
        # Of the two levels above the surface, each pass fills one of the margin.
        columns = field.arguments.columns
        assert columns[..., 2].max() <= field.grid.levels - 2
        points[:, 2] = top * (1.0 + 1e-9)
        assert not surface.force(points).any()
        points[:, 2] = top - rng.uniform(0.0, 2.0, len(points)) * field.grid.level_spacing
        step = 1e-9
        numeric = np.stack(
            [
                (surface.force(points + step * v) - surface.force(points - step * v)) / (2 * step)
                for v in np.eye(3)
            ],
            axis=-1,
        )
        error = np.linalg.norm(numeric - surface.jacobian(points), axis=(1, 2)) / K
        assert np.quantile(error, 0.99) < 1e-5
        gains.append(field.gain.upper)
        differences.append(field.accuracy.rms)
    assert gains == sorted(gains, reverse=True)
    assert gains[-1] < gains[0] - 0.05
    assert differences == sorted(differences)


def test_smoothing_stops_at_the_gain_asked_for() -> None:
    surface = Surface(TEXTURES["map"], "H", K, max_depth=DEPTH)
    fields = {gain: asp.bake(surface, 2.5e-5, max_gain=gain).texture for gain in (2.0, 1.2, None)}
    passes = {gain: field.passes for gain, field in fields.items()}
    assert passes[None] == passes[2.0] == 0 < passes[1.2]
    assert fields[1.2].gain.upper <= 1.2 < fields[None].gain.upper
    fewer = smoothed_field("map", passes[1.2] - 1)
    assert fewer.gain.upper > 1.2
    assert "smoothed" in fields[1.2].preparation[-1]

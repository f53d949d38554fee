"""Smoothing of a field's nodes: means of the exact depth around cells of too great a gain."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from scipy.ndimage import maximum_filter

import asperity as asp
from asperity.analysis.energy.field_energy import split_state
from asperity.surface import Surface
from asperity.textures.fields.bake import BakeGoal, bake_texture
from asperity.textures.fields.field_grid import RAMP, FieldGrid
from asperity.textures.fields.field_record import MIRRORED, PERIODIC, ZERO
from asperity.textures.fields.node_potentials import smooth, spread_marks
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


@pytest.mark.parametrize("border", [PERIODIC, MIRRORED, ZERO])
@pytest.mark.parametrize("axes", [1, 2])
def test_a_pass_is_a_mean_of_a_node_and_its_neighbours(axes: int, border: int) -> None:
    """Against plain sums; along z the lowest level stays, and the highest continues."""
    steps = np.array([[1.0, 0.2], [0.0, 1.0]])[:axes]
    grid = FieldGrid(steps, (5, 4)[:axes], np.zeros(2), 6, 1.0, 0.0, 1, border)
    values = np.random.default_rng(2).uniform(size=grid.node_counts).astype(np.float32)
    weights = np.random.default_rng(3).integers(0, 256, grid.node_counts, np.uint8)
    expected, share = values.astype(float), weights / (8.0 * 255.0)
    for axis in range(axes):
        places = grid.stored_nodes(axis)[: expected.shape[axis] + 2]
        nearest = np.clip(np.arange(len(places)) - 1, 0, expected.shape[axis] - 1)
        wide = np.take(expected, np.where(places < 0, nearest, places), axis=axis)
        a, b, d = (np.take(wide, np.arange(k, wide.shape[axis] - 2 + k), axis) for k in range(3))
        expected = b + share * (a - 2.0 * b + d)
    wide = np.concatenate([expected, expected[..., -1:]], axis=-1)
    change = wide[..., :-2] - 2.0 * wide[..., 1:-1] + wide[..., 2:]
    expected[..., 1:] += share[..., 1:] * change
    smooth(values, weights, grid)
    np.testing.assert_allclose(values, expected, rtol=1e-6)


@pytest.mark.parametrize("border", [PERIODIC, MIRRORED, ZERO])
def test_weights_fall_slowly_from_marked_nodes(border: int) -> None:
    """The bound of the error relies on their differences; no node beyond the cells changes."""
    marks = (np.random.default_rng(5).uniform(size=(40, 30, 20)) < 2e-4).astype(np.uint8)
    marks[0, 3, 2] = marks[39, 20, 17] = 1
    weights, cells = spread_marks(marks, border)
    assert (weights[marks > 0] == 255).all()
    assert (weights == 0).mean() > 0.5
    wide = np.pad(weights.astype(int), [(1, 1)] * 3, "wrap" if border == PERIODIC else "edge")
    for axis in range(3):
        steps = np.abs(np.diff(wide, axis=axis))
        if axis == 2:
            steps = np.abs(np.diff(weights.astype(int), axis=axis))
        assert steps.max() <= 255 / RAMP + 3
    near = maximum_filter(weights > 0, 3, mode="wrap" if border == PERIODIC else "nearest")
    assert (cells[..., 1:-1][near[..., 1:-1]] > 0).all()


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
def test_smoothed_fields_keep_their_bounds(name: str) -> None:
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
        assert np.abs(states[0] - states[1]).max() <= field.accuracy.potential_bound
        # Below the surface a field of a former kind was wrong by a tenth of its spacing already.
        onset = np.abs(np.sqrt(2.0 * states[0]) - np.sqrt(2.0 * states[1]))
        assert onset[states[1] > 0.0].max() < (0.5 + passes) * field.grid.level_spacing
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
    bake = partial(asp.bake, surface, 2.5e-5, press=1e-6)
    fields = {gain: bake(max_gain=gain).texture for gain in (2.0, 1.2, None)}
    passes = {gain: field.passes for gain, field in fields.items()}
    assert passes[None] == passes[2.0] == 0 < passes[1.2]
    assert fields[1.2].gain.upper <= 1.2 < fields[None].gain.upper
    fewer = smoothed_field("map", passes[1.2] - 1)
    assert fewer.gain.upper > 1.2
    assert "smoothed" in fields[1.2].preparation[-1]

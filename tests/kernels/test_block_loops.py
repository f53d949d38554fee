"""Points that are sampled in blocks: the same forces as one by one, at every count and place."""

from __future__ import annotations

import numpy as np
import pytest

from asperity import HeightMap, Surface
from asperity.checks import FloatArray
from asperity.contacts.memory import new_memory
from asperity.contacts.sampler import BLOCK, BLOCK_ROWS
from asperity.kernels import block_loops
from asperity.laws import LAWS
from asperity.textures.samplers import heightmap, heightmap_block

PITCH = (40e-6, 70e-6)


def a_map(periodic: bool) -> HeightMap:
    heights = np.random.default_rng(4).uniform(-1e-4, 1e-4, (9, 14))
    return HeightMap(heights, PITCH, periodic=periodic, origin=(1e-3, -2e-3))


def places(texture: HeightMap, count: int) -> FloatArray:
    """Points on the map, on its nodes and several lengths away, in the body and above."""
    rng = np.random.default_rng(count)
    length = np.array([14, 9]) * PITCH
    xy = texture.origin + length * rng.uniform(-2.5, 3.5, (count, 2))
    xy[::3] = texture.origin + np.array(PITCH) * rng.integers(-14, 28, (len(xy[::3]), 2))
    return np.column_stack([xy, rng.uniform(-2e-4, 1.2e-4, count)])


@pytest.mark.parametrize("periodic", [False, True])
def test_a_block_samples_what_the_map_does(periodic: bool) -> None:
    texture = a_map(periodic)
    points = places(texture, BLOCK)
    known = np.full((BLOCK_ROWS, BLOCK), np.nan)
    heightmap_block.sample_block(np.ascontiguousarray(points.T), BLOCK, known, texture.arguments)
    for k, (x, y, _z) in enumerate(points):
        here = heightmap_block.block_point(known, k, texture.arguments)
        exact = np.array(heightmap.curvature(x, y, texture.arguments))
        size = np.abs(exact) + np.array([1e-4, 1.0, 1.0, 1e4, 1e4, 1e4])
        found = heightmap_block.curvature(x, y, here)
        assert np.all(np.abs(found - exact) <= 1e-13 * size)
        assert heightmap_block.slope(x, y, here) == found[:3]
        assert heightmap_block.height(x, y, here) == found[0]


@pytest.mark.parametrize("law", ["A", "B"])
def test_forces_of_blocks_are_those_of_single_points(law: str) -> None:
    surface = Surface(a_map(periodic=False), law, stiffness=1000.0)
    assert "take_block" in vars(surface._loops)
    for count in (1, BLOCK - 1, BLOCK, 2 * BLOCK + 3):
        points = places(surface.texture, count)
        alone, told = np.empty((count, 3)), np.empty((count, 2))
        arguments = (surface.texture.arguments, surface.law_arguments)
        surface._path_loops.path_batch(points, alone, told, new_memory(1.0), *arguments)
        assert count == 1 or np.abs(alone).max() > 0.0
        np.testing.assert_allclose(surface.force(points), alone, rtol=1e-12, atol=1e-12)
        force = np.full((count, 3), np.nan)
        jacobian = np.full((count, 3, 3), np.nan)
        surface._loops.jacobian_batch(points, force, jacobian, *arguments)
        np.testing.assert_allclose(force, alone, rtol=1e-12, atol=1e-12)
        one_by_one = np.array([surface.jacobian(point) for point in points])
        np.testing.assert_array_equal(jacobian, one_by_one)


def test_a_law_that_asks_elsewhere_is_not_given_blocks() -> None:
    for law in "WDEFH":
        assert "take_block" not in vars(Surface(a_map(periodic=True), LAWS[law])._loops)
    assert block_loops.KERNELS.loops == ("force_batch", "jacobian_batch")

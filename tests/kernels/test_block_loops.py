"""Loops over blocks of points: accuracy, and results independent of the other points."""

from __future__ import annotations

import re

import mpmath
import numpy as np
import pytest
from llvmlite import binding  # type: ignore[import-untyped]  # it has no types
from tests.helpers.reference import exact_force

from asperity import HeightMap, Sinusoid, Surface
from asperity.contacts.warm_start import new_warm_start
from asperity.core.checks import FloatArray
from asperity.kernels import block_loops
from asperity.kernels.block_loops import BLOCK
from asperity.laws import LAWS
from asperity.textures.spline import heightmap_block_sampler as heightmap_block
from asperity.textures.spline import heightmap_sampler as heightmap
from asperity.textures.texture import Texture

PITCH = (40e-6, 70e-6)
WAVE = Sinusoid(amplitude=0.4e-3, period=1e-3, phase=0.2, direction=(0.6, 0.8))
EPS = 2.0**-52


def height_map(periodic: bool) -> HeightMap:
    heights = np.random.default_rng(4).uniform(-1e-4, 1e-4, (9, 14))
    return HeightMap(heights, PITCH, periodic=periodic, origin=(1e-3, -2e-3))


def random_points(texture: HeightMap, count: int) -> FloatArray:
    """Return points on the map, on its nodes and several lengths away, inside and above."""
    rng = np.random.default_rng(count)
    length = np.array([14, 9]) * PITCH
    xy = texture.origin + length * rng.uniform(-2.5, 3.5, (count, 2))
    xy[::3] = texture.origin + np.array(PITCH) * rng.integers(-14, 28, (len(xy[::3]), 2))
    return np.column_stack([xy, rng.uniform(-2e-4, 1.2e-4, count)])


@pytest.mark.parametrize("periodic", [False, True])
def test_block_sampler_agrees_with_scalar_sampler(
    periodic: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    texture = height_map(periodic)
    points = random_points(texture, BLOCK)[:, :2]
    expected = np.array([heightmap.sample_hessian(x, y, texture.arguments) for x, y in points])
    scale = np.abs(expected) + np.array([1e-4, 1.0, 1.0, 1e4, 1e4, 1e4])
    for name in heightmap_block.KERNELS.provides:
        monkeypatch.setattr(heightmap, name, getattr(heightmap_block, name))
    samples = [heightmap.sample_hessian(x, y, texture.arguments) for x, y in points]
    assert np.all(np.abs(samples - expected) <= 1e-13 * scale)
    for (x, y), values in zip(points, samples, strict=True):
        assert heightmap.sample_gradient(x, y, texture.arguments) == values[:3]
        assert heightmap.sample_height(x, y, texture.arguments) == values[0]


@pytest.mark.parametrize("law", ["A", "B"])
def test_block_forces_agree_with_scalar_forces(law: str) -> None:
    surface = Surface(height_map(periodic=False), law, stiffness=1000.0)
    assert "store_block" in vars(surface._loops)
    for count in (1, BLOCK - 1, BLOCK, 2 * BLOCK + 3):
        points = random_points(surface.texture, count)
        expected, bounds = np.empty((count, 3)), np.empty((count, 2))
        arguments = (surface.texture.arguments, surface.law_arguments)
        surface._path_loops.path_batch(points, expected, bounds, new_warm_start(1.0), *arguments)
        assert count == 1 or np.abs(expected).max() > 0.0
        np.testing.assert_allclose(surface.force(points), expected, rtol=1e-12, atol=1e-12)
        force = np.full((count, 3), np.nan)
        jacobian = np.full((count, 3, 3), np.nan)
        surface._loops.jacobian_batch(points, force, jacobian, *arguments)
        np.testing.assert_allclose(force, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("texture", [WAVE, height_map(False), height_map(True)])
@pytest.mark.parametrize("law", "ABCG")
def test_result_of_a_point_does_not_depend_on_its_block(law: str, texture: Texture) -> None:
    """Bitwise equal as a single point, in a full block, or in a partial one, fused or not."""
    surface = Surface(texture, law)
    points = random_points(height_map(False), 2 * BLOCK + 7)
    forces, jacobians = surface.force(points), surface.jacobian(points)
    single_forces = np.array([surface.force(point) for point in points])
    assert np.count_nonzero(single_forces) > BLOCK
    np.testing.assert_array_equal(forces, single_forces)
    np.testing.assert_array_equal(jacobians, [surface.jacobian(point) for point in points])
    for first in range(1, 9):
        np.testing.assert_array_equal(surface.force(points[first:]), forces[first:])


@pytest.mark.parametrize("law", "ABCG")
def test_batch_agrees_with_the_definition_to_rounding(law: str) -> None:
    """Relative to the heights and to the position, whose rounding affects that within a cell."""
    texture = height_map(periodic=False)
    surface = Surface(texture, law, stiffness=1.0)
    points = random_points(texture, 3 * BLOCK)
    max_slope = np.abs(texture.gradient(points[:, :2])).max()
    scale = np.abs(texture.heights).max() + np.abs(points[:, 2])
    tolerances = (
        2.0 * EPS * (scale + max_slope * np.abs(points[:, :2]).max(axis=1)) * (1.0 + max_slope)
    )
    for force, point, error in zip(surface.force(points), points, tolerances, strict=True):
        expected = exact_force(surface, point)
        assert mpmath.norm(mpmath.matrix(force.tolist()) - expected) <= error


def test_extreme_positions_do_not_affect_other_points() -> None:
    surface = Surface(height_map(periodic=False), "B")
    near = [1.1e-3, -1.9e-3]
    far = np.array([[1.7e308, -1.7e308], [-1e300, 1e17], [1e-4, 1.7e308], [-1e18, 1e-4], near])
    points = np.tile(np.column_stack([far, np.full(5, -1e-2)]), (12, 1))
    forces = surface.force(points)
    assert (forces[:, 2] > 0.0).all()
    np.testing.assert_array_equal(forces, [surface.force(point) for point in points])


def test_only_laws_sampled_above_the_probe_use_blocks() -> None:
    for law in "WDEFH":
        assert "store_block" not in vars(Surface(height_map(periodic=True), LAWS[law])._loops)
    assert block_loops.KERNELS.loops == ("force_batch", "jacobian_batch")


def has_feature(name: str) -> bool:
    """Return whether the processor for which code is compiled has a feature."""
    return bool(dict(binding.get_host_cpu_features()).get(name, False))


@pytest.mark.usefixtures("empty_code_cache")
@pytest.mark.parametrize("texture", [WAVE, height_map(False)])
@pytest.mark.parametrize("law", "ABCG")
def test_batches_are_vectorized_and_fused_unlike_scalar_loops(law: str, texture: Texture) -> None:
    surface = Surface(texture, law)
    arguments = (texture.arguments, surface.law_arguments)
    points, out = np.zeros((1, 3)), np.empty((1, 3))
    surface._loops.force_batch(points, out, *arguments)
    (llvm,) = surface._loops.force_batch.inspect_llvm().values()
    # Law G loads the coefficients of a map in contact only, which takes the masks of AVX-512.
    is_vectorized = law != "G" or texture is WAVE or has_feature("avx512f")
    assert bool(re.search(r"<\d+ x double> @llvm\.fmuladd", llvm)) == is_vectorized
    assert texture is not WAVE or "gather" not in llvm  # points are loaded contiguously
    surface._path_loops.path_batch(points, out, np.empty((1, 2)), new_warm_start(1.0), *arguments)
    has_fma = has_feature("fma")
    # Of the path loops only those with the batch sine use fused multiply-add.
    path = (surface._path_loops.path_batch, has_fma and texture is WAVE)
    for loop, is_fused in ((surface._loops.force_batch, has_fma), path):
        (assembly,) = loop.inspect_asm().values()
        assert bool(re.search(r"\bvfn?m(add|sub)", assembly)) == is_fused

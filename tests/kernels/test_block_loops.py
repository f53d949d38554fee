"""Points that go in blocks: the force by its definition, alone as in company, wherever they are."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import mpmath
import numpy as np
import pytest
from llvmlite import binding  # type: ignore[import-untyped]  # it has no types

from asperity import HeightMap, Sinusoid, Surface
from asperity.contacts.warm_start import new_warm_start
from asperity.core.checks import FloatArray
from asperity.kernels import fuse
from asperity.kernels.loops import block_loops
from asperity.kernels.loops.block_loops import BLOCK
from asperity.laws import LAWS
from asperity.reference import exact_force
from asperity.textures.spline import heightmap_block_sampler as heightmap_block
from asperity.textures.spline import heightmap_sampler as heightmap
from asperity.textures.texture import Texture

PITCH = (40e-6, 70e-6)
WAVE = Sinusoid(amplitude=0.4e-3, period=1e-3, phase=0.2, direction=(0.6, 0.8))
EPS = 2.0**-52


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
def test_a_block_samples_what_the_map_does(periodic: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    texture = a_map(periodic)
    points = places(texture, BLOCK)[:, :2]
    exact = np.array([heightmap.sample_hessian(x, y, texture.arguments) for x, y in points])
    size = np.abs(exact) + np.array([1e-4, 1.0, 1.0, 1e4, 1e4, 1e4])
    for name in heightmap_block.KERNELS.provides:
        monkeypatch.setattr(heightmap, name, getattr(heightmap_block, name))
    found = [heightmap.sample_hessian(x, y, texture.arguments) for x, y in points]
    assert np.all(np.abs(found - exact) <= 1e-13 * size)
    for (x, y), values in zip(points, found, strict=True):
        assert heightmap.sample_gradient(x, y, texture.arguments) == values[:3]
        assert heightmap.sample_height(x, y, texture.arguments) == values[0]


@pytest.mark.parametrize("law", ["A", "B"])
def test_forces_of_blocks_are_those_of_single_points(law: str) -> None:
    surface = Surface(a_map(periodic=False), law, stiffness=1000.0)
    assert "store_block" in vars(surface._loops)
    for count in (1, BLOCK - 1, BLOCK, 2 * BLOCK + 3):
        points = places(surface.texture, count)
        alone, told = np.empty((count, 3)), np.empty((count, 2))
        arguments = (surface.texture.arguments, surface.law_arguments)
        surface._path_loops.path_batch(points, alone, told, new_warm_start(1.0), *arguments)
        assert count == 1 or np.abs(alone).max() > 0.0
        np.testing.assert_allclose(surface.force(points), alone, rtol=1e-12, atol=1e-12)
        force = np.full((count, 3), np.nan)
        jacobian = np.full((count, 3, 3), np.nan)
        surface._loops.jacobian_batch(points, force, jacobian, *arguments)
        np.testing.assert_allclose(force, alone, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("texture", [WAVE, a_map(False), a_map(True)])
@pytest.mark.parametrize("law", "ABCG")
def test_a_point_has_the_same_bits_in_any_company(law: str, texture: Texture) -> None:
    """Fused or not: of a point that goes alone, in a full block, or in the rest of one."""
    surface = Surface(texture, law)
    points = places(a_map(False), 2 * BLOCK + 7)
    forces, jacobians = surface.force(points), surface.jacobian(points)
    alone = np.array([surface.force(point) for point in points])
    assert np.count_nonzero(alone) > BLOCK
    np.testing.assert_array_equal(forces, alone)
    np.testing.assert_array_equal(jacobians, [surface.jacobian(point) for point in points])
    for first in range(1, 9):
        np.testing.assert_array_equal(surface.force(points[first:]), forces[first:])


@pytest.mark.parametrize("law", "ABCG")
def test_a_batch_is_the_definition_to_few_roundings(law: str) -> None:
    """Of its size, and where the point is: a place in a cell has the roundings of its distance."""
    texture = a_map(periodic=False)
    surface = Surface(texture, law, stiffness=1.0)
    points = places(texture, 3 * BLOCK)
    steep = np.abs(texture.gradient(points[:, :2])).max()
    size = np.abs(texture.heights).max() + np.abs(points[:, 2])
    allowed = 2.0 * EPS * (size + steep * np.abs(points[:, :2]).max(axis=1)) * (1.0 + steep)
    for force, point, error in zip(surface.force(points), points, allowed, strict=True):
        exact = exact_force(surface, point)
        assert mpmath.norm(mpmath.matrix(force.tolist()) - exact) <= error


def test_points_beyond_all_cells_are_on_the_map_and_spoil_no_others() -> None:
    surface = Surface(a_map(periodic=False), "B")
    near = [1.1e-3, -1.9e-3]
    far = np.array([[1.7e308, -1.7e308], [-1e300, 1e17], [1e-4, 1.7e308], [-1e18, 1e-4], near])
    points = np.tile(np.column_stack([far, np.full(5, -1e-2)]), (12, 1))
    forces = surface.force(points)
    assert (forces[:, 2] > 0.0).all()
    np.testing.assert_array_equal(forces, [surface.force(point) for point in points])


def test_a_law_that_asks_elsewhere_is_not_given_blocks() -> None:
    for law in "WDEFH":
        assert "store_block" not in vars(Surface(a_map(periodic=True), LAWS[law])._loops)
    assert block_loops.KERNELS.loops == ("force_batch", "jacobian_batch")


@pytest.fixture
def compiled_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """No kept code: code from the cache cannot be looked at."""
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path))
    for known in (fuse._load_module, fuse.fuse_surface, fuse.fuse_path):
        known.cache_clear()
    yield
    for known in (fuse._load_module, fuse.fuse_surface, fuse.fuse_path):
        known.cache_clear()


@pytest.mark.usefixtures("compiled_anew")
@pytest.mark.parametrize("texture", [WAVE, a_map(False)])
@pytest.mark.parametrize("law", "ABCG")
def test_batches_go_many_at_a_time_and_fuse_and_scalar_loops_do_not(
    law: str, texture: Texture
) -> None:
    surface = Surface(texture, law)
    arguments = (texture.arguments, surface.law_arguments)
    points, out = np.zeros((1, 3)), np.empty((1, 3))
    surface._loops.force_batch(points, out, *arguments)
    (text,) = surface._loops.force_batch.inspect_llvm().values()
    assert re.search(r"<\d+ x double> @llvm\.fmuladd", text)
    assert texture is not WAVE or "gather" not in text  # points are loaded side by side
    surface._path_loops.path_batch(points, out, np.empty((1, 2)), new_warm_start(1.0), *arguments)
    has = dict(binding.get_host_cpu_features()).get("fma", False)
    # A path without a warm start uses the sine of batches, which fuses; nothing else does.
    path = (surface._path_loops.path_batch, has and texture is WAVE)
    for loop, fuses in ((surface._loops.force_batch, has), path):
        (code,) = loop.inspect_asm().values()
        assert bool(re.search(r"\bvfn?m(add|sub)", code)) == fuses

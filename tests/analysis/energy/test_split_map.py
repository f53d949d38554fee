"""Law H on maps: accuracy, borders, a measured surface, allocation and threads."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import asperity as asp
from asperity.analysis.energy.field_energy import split_state
from asperity.contacts import split_evaluation, split_optimality, split_solver
from asperity.surface import Surface
from asperity.textures.spline.spline_texture import HeightMap
from asperity.textures.texture import Texture

DATA = Path(__file__).parents[4] / "shared" / "data"
needs_data = pytest.mark.skipif(
    not DATA.is_dir(), reason="the real surfaces of ../shared/data are not there"
)
K = 500.0
_NODES = np.arange(12) / 6.0 * np.pi


@cache
def _texture(name: str) -> Texture:
    if name == "egg crate":  # four crests around a trough: up to four atoms at once
        return HeightMap(2e-4 * np.outer(np.cos(_NODES), np.cos(_NODES)), 8e-5, periodic=True)
    if name == "measured":
        texture = asp.load_texture(DATA / "sample-land.x3p", magnify=20, s_cutoff=10e-6)
        assert isinstance(texture, HeightMap)
        return texture
    rough = 6e-5 * np.random.default_rng(3).normal(size=(9, 11))
    return HeightMap(rough, (1e-4, 1.2e-4), origin=(-3e-4, 2e-4))


NAMES = ["egg crate", "rough", pytest.param("measured", marks=needs_data)]


def _probes(texture: Texture, count: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    xy = texture.domain.points(rng.uniform(size=(count, 2)))
    depth = min(texture.peak_to_valley, 1e-3) * 10 ** rng.uniform(-2, 0.0, count)
    return np.column_stack([xy, texture.height(xy) - depth])


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("c", [0.5, 1.0, 4.0])
def test_force_is_lipschitz_and_certified(name: str, c: float) -> None:
    """Random pairs and pairs that straddle jumps of the nearest point; law D fails there."""
    texture, rng = _texture(name), np.random.default_rng(5)
    a = _probes(texture, 250)
    b = a + rng.normal(size=a.shape) * 10 ** rng.uniform(-9, -4, (len(a), 1))
    low, high = a.copy(), a + rng.normal(size=a.shape) * [2e-4, 2e-4, 0.0]
    point_low, point_high = texture.nearest(low), texture.nearest(high)
    for _ in range(24):
        middle = 0.5 * (low + high)
        closest_point = texture.nearest(middle)
        to_low = np.linalg.norm(closest_point - point_low, axis=1, keepdims=True)
        left = to_low < np.linalg.norm(closest_point - point_high, axis=1, keepdims=True)
        low, point_low = np.where(left, middle, low), np.where(left, closest_point, point_low)
        high, point_high = np.where(left, high, middle), np.where(left, point_high, closest_point)
    a, b = np.concatenate([a, low]), np.concatenate([b, high])
    apart = np.linalg.norm(b - a, axis=1)
    worst = {}
    for letter in "DH":
        surface = Surface(texture, letter, K, continuity=c)
        change = np.linalg.norm(surface.force(b) - surface.force(a), axis=1)
        worst[letter] = np.max(change - K * max(1.0, c) * apart * (1.0 + 1e-6))
    assert worst["H"] <= 1e-10 * K * 1e-3
    assert worst["D"] > 1e-3 * K * 1e-3
    state = split_state(Surface(texture, "H", K, continuity=c), a)
    assert state.gap.max() <= 1e-12 * state.potential.max()


def test_maps_have_up_to_four_atoms() -> None:
    points = _probes(_texture("rough"), 8000, seed=1)
    state = split_state(Surface(_texture("rough"), "H", K), points)
    inside, *atoms = np.bincount(state.atoms)
    assert inside == 0
    assert len(atoms) == 4
    assert min(atoms) > 5


@pytest.mark.parametrize("name", ["egg crate", "rough"])
def test_jacobian_against_differences(name: str) -> None:
    c = 2.0
    surface = Surface(_texture(name), "H", K, continuity=c)
    points, step = _probes(surface.texture, 300, seed=2), 1e-10
    numeric = np.stack(
        [
            (surface.force(points + step * v) - surface.force(points - step * v)) / (2 * step)
            for v in np.eye(3)
        ],
        axis=-1,
    )
    exact = surface.jacobian(points)
    error = np.linalg.norm(exact - numeric, axis=(1, 2)) / K
    assert np.quantile(error, 0.97) < 1e-4
    values = np.linalg.eigvalsh(-exact / K)
    assert values.max() <= 1.0 + 1e-9
    assert values.min() >= -c - 1e-9


def test_interpreted_solver_agrees_with_the_compiled_solver(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In plain Python an index out of range is an error."""
    texture = _texture("egg crate")

    def hessian(x: float, y: float, _texture: object) -> tuple[float, ...]:
        return tuple(texture.derivatives(np.array([[x, y]]))[0].tolist())

    def closest(x: float, y: float, z: float, *_start: object) -> tuple[float, ...]:
        fx, fy, _h = texture.nearest([[x, y, z]])[0].tolist()
        return fx, fy, *hessian(fx, fy, None)[:3], 0.0, 1.0

    monkeypatch.setattr(split_optimality, "sample_hessian", hessian)
    monkeypatch.setattr(split_solver, "closest_point_within_budget", closest)
    for module in (split_optimality, split_solver):
        monkeypatch.setattr(module, "sample_height", lambda *place: hessian(*place)[0])
        monkeypatch.setattr(module, "evaluation_cost", lambda _texture: 1.0)
    surface = Surface(texture, "H", K, continuity=2.0)
    points = _probes(texture, 40, seed=9)
    assert set(split_state(surface, points).atoms) > {1, 2}
    for p, force, jacobian in zip(
        points, surface.force(points), surface.jacobian(points), strict=True
    ):
        *pull, xx, xy, xz, yy, yz, zz = split_evaluation.split_derivative(*p.tolist(), 2.0, None)
        np.testing.assert_allclose(K * np.array(pull), force, rtol=0, atol=1e-12 * K)
        matrix = K * np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        np.testing.assert_allclose(matrix, jacobian, rtol=0, atol=1e-6 * K)


def test_finite_map_is_mirrored_at_its_border() -> None:
    """The force is mirrored across the border, and has no component across it on the border."""
    surface = Surface(_texture("rough"), "H", K)
    (x0, y0), spans = surface.texture.domain.origin, surface.texture.domain.spans
    rng = np.random.default_rng(6)
    points = _probes(surface.texture, 200, seed=3)
    points[:, 0] = x0 + rng.uniform(0.0, 1.5e-4, 200)
    mirrored = points * [-1.0, 1.0, 1.0] + [2.0 * x0, 0.0, 0.0]
    np.testing.assert_allclose(
        surface.force(mirrored), surface.force(points) * [-1.0, 1.0, 1.0], atol=1e-12 * K
    )
    border = points.copy()
    border[:, 1] = y0 + spans[1, 1]
    inside = surface.texture.height(border[:, :2]) > border[:, 2]
    force = surface.force(border)[inside]
    assert inside.sum() > 50
    assert np.abs(force[:, 1]).max() < 1e-12 * K
    assert np.abs(force[:, 0]).max() > 1e-6 * K


def _allocations(run: Callable[[], object]) -> int:
    """Return the number of arrays that compiled code allocates in a call."""
    from numba.core.runtime import _nrt_python, rtsys

    enabled = _nrt_python.memsys_stats_enabled()
    _nrt_python.memsys_enable_stats()
    try:
        before = rtsys.get_allocation_stats().alloc
        run()
        return int(rtsys.get_allocation_stats().alloc - before)
    finally:
        if not enabled:
            _nrt_python.memsys_disable_stats()


@pytest.mark.parametrize("kind", ["map", "sinusoid"])
def test_force_loop_allocates_no_arrays(kind: str) -> None:
    texture = _texture("rough") if kind == "map" else asp.Sinusoid(4e-4, 1e-3)
    surface, points = Surface(texture, "H", K), np.zeros((200, 3))
    points[:, :2] = np.random.default_rng(0).uniform(0.0, 1e-3, (200, 2))
    points[:, 2] = texture.extremes[0]
    out, arguments = np.empty((200, 3)), (texture.arguments, surface.law_arguments)
    surface.force(points[:1])  # compile
    assert _allocations(lambda: surface._loops.force_batch(points, out, *arguments)) == 0
    assert out.any()


def test_allocations_are_counted() -> None:
    from numba import njit

    @njit
    def allocating(count: int) -> float:
        total = 0.0
        for i in range(count):
            total += np.full(3, float(i)).sum()
        return total

    allocating(1)
    assert _allocations(lambda: allocating(50)) >= 50


def test_parallel_threads_give_the_same_forces() -> None:
    surface = Surface(_texture("rough"), "H", K)
    parts = [_probes(surface.texture, 200, seed) for seed in range(8)]
    sequential = [surface.force(part) for part in parts]
    with ThreadPoolExecutor(max_workers=4) as pool:
        parallel = list(pool.map(surface.force, parts * 3))
    for index, force in enumerate(parallel):
        np.testing.assert_array_equal(force, sequential[index % 8])

"""Shared fixtures: generic textures, explicit formulas, interpreted kernels, differences."""

from __future__ import annotations

import gc
import math
import os
import signal
import zlib
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from types import SimpleNamespace
from typing import Any

os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1")  # as the program does

import numpy as np
import pytest

from asperity.core import cache
from asperity.kernels import fuse
from asperity.kernels.link import INTRINSIC_MODULES
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid, Texture

LETTERS = "WABCDEFG"

# Generic geometry: no texture is aligned with an axis or symmetric about the origin.
_WAVES = [[2100.0, 300.0], [-500.0, 1700.0], [1600.0, 2000.0], [4700.0, -1100.0]]
_ROUGH = np.random.default_rng(20240501).normal(size=(7, 9))


def _map(scale: float, periodic: bool) -> HeightMap:
    return HeightMap(scale * _ROUGH, (3e-4, 4e-4), periodic=periodic, origin=(-1.3e-3, 0.7e-3))


TEXTURES: dict[str, Callable[[], Texture]] = {
    "sinusoid": lambda: Sinusoid(0.4e-3, 1.5e-3, phase=0.7, direction=(2.0, 1.0)),
    "steep sinusoid": lambda: Sinusoid(3e-3, 1e-3, phase=0.3, direction=(1.0, -3.0)),
    "fourier": lambda: Fourier([4e-4, 3e-4, 1.6e-4, 1e-4], _WAVES, [0.4, 1.1, -0.6, 2.0]),
    "fourier profile": lambda: Fourier(
        [2e-4, -1e-4], [[1200.0, -900.0], [2800.0, -2100.0]], [0.2, 0.9]
    ),
    "map": lambda: _map(1e-4, periodic=False),
    "steep map": lambda: _map(1.2e-3, periodic=False),
    "periodic map": lambda: _map(1e-4, periodic=True),
    "profile": lambda: Profile(1e-4 * _ROUGH[0], 3e-4, origin=-0.7e-3),
    "periodic profile": lambda: Profile(1.5e-3 * _ROUGH[1], 3e-4, periodic=True, origin=0.4e-3),
}


def pytest_configure(config: pytest.Config) -> None:
    """Use a cache of the test suite, in ``.pytest_cache``, and take interrupts.

    A shell starts a job in the background with interrupts ignored, and programs inherit that.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    cache = getattr(config, "cache", None)  # missing with -p no:cacheprovider
    if cache is not None and "ASPERITY_CACHE_DIR" not in os.environ:
        os.environ["ASPERITY_CACHE_DIR"] = str(cache.mkdir("asperity"))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Return one worker more than cores: tests of loops and pages wait most of their time."""
    return (os.cpu_count() or 1) + 1


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run the pages of the lab first, which one worker does while the others compute."""
    items.sort(key=lambda item: not item.nodeid.startswith("tests/lab/"))


def pytest_collection_finish() -> None:
    """Collect garbage less often: compilers create many objects, of which few are garbage."""
    gc.freeze()
    gc.set_threshold(20_000, 10, 10)


@pytest.fixture(autouse=True)
def uncached_results(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compute results without the cache, since a test may change the code.

    Tests of the cache have the marker ``@pytest.mark.caches_results``.
    """
    if request.node.get_closest_marker("caches_results") is None:
        monkeypatch.setattr(cache, "_result_key", lambda _name, _content: None)


@pytest.fixture(autouse=True)
def one_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Start no worker processes in commands, since the tests run in parallel."""
    monkeypatch.setattr("asperity.cli.options.available_cores", lambda: 1)


@pytest.fixture(autouse=True)
def own_random_numbers(request: pytest.FixtureRequest) -> None:
    """Seed ``RNG`` of a module for each test: which tests ran before it in a process varies."""
    generator = getattr(getattr(request.node, "module", None), "RNG", None)
    if generator is not None:
        seed = zlib.crc32(request.node.nodeid.encode())
        generator.bit_generator.state = np.random.default_rng(seed).bit_generator.state


@pytest.fixture(scope="session")
def reading_worker() -> Iterator[Callable[..., int]]:
    """Replace ``isolation.run_subprocess`` by a process that reads one file after the other.

    Third-party readers take two seconds to import, which each file would cost. The limits are those
    of a process for each file. The process starts with the first file.
    """
    from bench.stress.fuzz_child import ReadingWorker

    with ExitStack() as stack:
        workers: list[ReadingWorker] = []

        def read(*task: Any) -> int:
            if not workers:
                workers.append(stack.enter_context(ReadingWorker()))
            return workers[0].start(*task)

        yield read


@pytest.fixture(autouse=True)
def shared_reading_process(
    request: pytest.FixtureRequest,
    monkeypatch: pytest.MonkeyPatch,
    reading_worker: Callable[..., int],
) -> None:
    """Read all files of third-party readers in one process.

    Tests with the marker ``@pytest.mark.starts_readers`` start a process for each file, as the
    program does.
    """
    if request.node.get_closest_marker("starts_readers") is None:
        monkeypatch.setattr("asperity.measured.reading.isolation.run_subprocess", reading_worker)


@pytest.fixture(params=list(TEXTURES))
def texture(request: pytest.FixtureRequest) -> Texture:
    """Return a texture of each kind in turn; ``indirect`` parameters select some of them."""
    return TEXTURES[request.param]()


@pytest.fixture(scope="session")
def make_texture() -> Callable[[str], Texture]:
    """Return a function that creates a texture by its name in ``TEXTURES``."""
    return lambda name: TEXTURES[name]()


# --- points ---------------------------------------------------------------------------------------


def _scatter(texture: Texture, count: int, seed: int, stretch: float = 1.0) -> np.ndarray:
    """Return random points (count, 2), at random heights along y for a profile too."""
    rng = np.random.default_rng(seed)
    domain = texture.domain
    fractions = 0.5 + stretch * (rng.random((count, len(domain.spans))) - 0.5)
    points = domain.points(fractions)
    if texture.is_profile:
        along = domain.spans[0] / np.hypot(*domain.spans[0])
        points = points + rng.normal(size=(count, 1)) * 1e-3 * np.array([-along[1], along[0]])
    return points


@pytest.fixture(scope="session")
def scatter() -> Callable[..., np.ndarray]:
    """``scatter(texture, count, seed, stretch)``: random points (n, 2) over the domain."""
    return _scatter


@pytest.fixture(scope="session")
def inside() -> Callable[..., np.ndarray]:
    """``inside(texture, count, seed, deepest)``: probes (n, 3) below the surface and below 0."""

    def probes(texture: Texture, count: int, seed: int, deepest: float) -> np.ndarray:
        xy = _scatter(texture, count, seed)
        depth = deepest * np.random.default_rng(seed + 1).uniform(0.02, 1.0, count)
        return np.column_stack([xy, np.minimum(texture.height(xy), 0.0) - depth])

    return probes


# --- explicit formulas of the laws (MATH, sections 2 and 3) ---------------------------------------


def _force_by_hand(
    letter: str,
    *,
    k: float,
    depth: float,
    g: Any,
    d: Any = (0.0, 0.0),
    m: float = 0.0,
    friction: float = 0.8,
    max_deflection: float = 1e-3,
) -> np.ndarray:
    """Return the force from the depth, the slope g, the deflection d and the modulation m."""
    hx, hy = g
    s = math.sqrt(1.0 + hx * hx + hy * hy)
    up, w = np.array([0.0, 0.0, 1.0]), np.array([-hx, -hy, 1.0])
    if letter in {"W", "A", "E"}:
        return k * depth * up
    if letter in {"B", "D", "G"}:
        return k * depth * w / s
    if letter == "C":
        return k * depth * w
    dragged = np.array([d[0], d[1], 0.0]) / max_deflection
    return k * depth * (up - friction * (1.0 - m) * dragged)


def _normal_derivative(g: Any, hessian: np.ndarray) -> np.ndarray:
    """Return N = ∂n/∂(x, y), shape (3, 2), n = w / |w|."""
    w = np.array([-g[0], -g[1], 1.0])
    s = np.sqrt(w @ w)
    w_by_point = np.vstack([-hessian, np.zeros(2)])
    return (np.eye(3) - np.outer(w, w) / s**2) @ w_by_point / s


def _jacobian_by_hand(
    letter: str, *, k: float, depth: float, g: Any, hessian: np.ndarray, **state: Any
) -> np.ndarray:
    """Return ∂f/∂p of MATH section 3; D by the principal curvatures of the surface."""
    g, up = np.asarray(g, float), np.array([0.0, 0.0, 1.0])
    w = np.array([-g[0], -g[1], 1.0])
    s = np.sqrt(w @ w)
    n = w / s
    lateral = np.eye(3)[:2]
    if letter == "D":
        return _god_object_by_curvatures(k, depth, g, hessian)
    if letter == "F":
        return _friction_by_hand(k, depth, **state)
    turning = depth * _normal_derivative(g, hessian) @ lateral
    return {
        "W": -k * np.outer(up, up),
        "A": -k * np.outer(up, w),
        "B": -k * (s * np.outer(n, n) - turning),
        "C": -k * (np.outer(w, w) + depth * lateral.T @ hessian @ lateral),
        "E": -k * np.outer(up, n),
        "G": -k * (np.outer(n, up) - turning),
    }[letter]


def _friction_by_hand(
    k: float,
    depth: float,
    *,
    d: Any,
    m: float,
    m_slope: Any,
    sliding: bool = False,
    friction: float = 0.8,
    max_deflection: float = 1e-3,
) -> np.ndarray:
    d = np.asarray(d, float)
    follow = np.eye(2)
    if sliding and d.any():
        follow -= np.outer(d, d) / (d @ d)
    scale = friction / max_deflection
    jacobian = np.diag([0.0, 0.0, -k])
    jacobian[:2, 2] = k * scale * (1.0 - m) * d
    jacobian[:2, :2] = -k * depth * scale * ((1.0 - m) * follow - np.outer(d, m_slope))
    return jacobian


def _god_object_by_curvatures(
    k: float, depth: float, g: np.ndarray, hessian: np.ndarray
) -> np.ndarray:
    from scipy.linalg import eigh

    n = np.array([-g[0], -g[1], 1.0]) / np.sqrt(1.0 + g @ g)
    first, second = np.eye(2) + np.outer(g, g), hessian * n[2]
    curvatures, directions = eigh(second, first)
    jacobian = np.outer(n, n)
    for curvature, direction in zip(curvatures, directions.T, strict=True):
        tangent = np.array([*direction, g @ direction])
        jacobian += depth * curvature / (1.0 + depth * curvature) * np.outer(tangent, tangent)
    return -k * jacobian


@pytest.fixture(scope="session")
def force_by_hand() -> Callable[..., np.ndarray]:
    """Return the explicit formula of the force: ``force_by_hand(letter, k=..., ...)``."""
    return _force_by_hand


@pytest.fixture(scope="session")
def jacobian_by_hand() -> Callable[..., np.ndarray]:
    """Return the explicit formula of the Jacobian: ``jacobian_by_hand(letter, k=..., ...)``."""
    return _jacobian_by_hand


# --- interpreted kernels --------------------------------------------------------------------------


def _run_source(source: str) -> SimpleNamespace:
    """Execute the source of a fused module as Python, without compilation."""
    head, compiled_only = "from __future__", ("@", "from numba", "from asperity_fused_")
    text = source
    for module in INTRINSIC_MODULES.values():
        text = text.replace(
            f"from {module} ", "from asperity.core.compiled "
        )  # Python's own versions
    lines = [line for line in text.splitlines() if not line.startswith((head, *compiled_only))]
    lines.insert(0, f"{head} import annotations")
    lines = [line for line in lines if "njit(" not in line and "code_store" not in line]
    names: dict[str, Any] = {}
    exec(compile("\n".join(lines), "<plain kernels>", "exec"), names)
    return SimpleNamespace(**names, fused_source=source)


@pytest.fixture
def interpreted(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[], Any]], Any]:
    """``interpreted(make)``: result of a function that fuses kernels, run as interpreted Python."""

    def run(make: Callable[[], Any]) -> Any:
        clear_fused_kernels()
        try:
            with monkeypatch.context() as patch:
                patch.setattr(fuse, "load_fused", _run_source)
                return make()
        finally:
            clear_fused_kernels()

    return run


def clear_fused_kernels() -> None:
    """Clear the caches of fused kernels; loaded modules are not unloaded."""
    for name, member in vars(fuse).items():
        if name.startswith("fuse_") and hasattr(member, "cache_clear"):
            member.cache_clear()


@pytest.fixture
def plain(interpreted: Callable[[Callable[[], Any]], Any]) -> Callable[[Any], Any]:
    """``plain(surface)`` or ``plain(texture)``: the same object with interpreted kernels."""

    def interpret(surface_or_texture: Any) -> Any:
        assert interpreted(lambda: surface_or_texture._loops) is not None  # cached from now on
        if isinstance(surface_or_texture, Surface) and "_loops" not in vars(
            surface_or_texture.texture
        ):
            interpret(surface_or_texture.texture)
        return surface_or_texture

    return interpret


# --- differences ----------------------------------------------------------------------------------


def _differences(f: Callable[[np.ndarray], np.ndarray], points: np.ndarray, step: float) -> Any:
    """Return ∂f/∂p by central differences of fourth order, along the last axis of the result."""
    columns = []
    for axis in range(points.shape[1]):
        offset = np.zeros(points.shape[1])
        offset[axis] = step
        near = f(points + offset) - f(points - offset)
        far = f(points + 2 * offset) - f(points - 2 * offset)
        columns.append((8.0 * near - far) / (12.0 * step))
    return np.stack(columns, axis=-1)


@pytest.fixture(scope="session")
def differences() -> Callable[..., np.ndarray]:
    """``differences(f, points, step)``: derivative of a batched function, fourth order."""
    return _differences


# --- properties of every texture ------------------------------------------------------------------


def _check_derivatives(texture: Texture, xy: np.ndarray, step: float) -> None:
    gradient, hessian = texture.gradient(xy), texture.hessian(xy)
    numeric = _differences(texture.height, xy, step)
    slope, curvature = texture.bounds
    assert np.abs(gradient - numeric).max() <= 1e-8 * slope
    assert np.abs(hessian - _differences(texture.gradient, xy, step)).max() <= 1e-8 * curvature
    derivatives = texture.derivatives(xy)
    np.testing.assert_array_equal(derivatives[:, 0], texture.height(xy))
    np.testing.assert_array_equal(derivatives[:, 1:3], gradient)
    np.testing.assert_array_equal(derivatives[:, [3, 4, 4, 5]].reshape(-1, 2, 2), hessian)


@pytest.fixture(scope="session")
def check_derivatives() -> Callable[..., None]:
    """``check_derivatives(texture, xy, step)``: assert that derivatives match the height."""
    return _check_derivatives


@pytest.fixture
def wave(make_texture: Callable[..., Any]) -> Sinusoid:
    """Return the generic sinusoid."""
    return make_texture("sinusoid")


def _grid(texture: Texture, per_side: int) -> np.ndarray:
    ticks = (np.arange(per_side) + 0.5) / per_side
    axes = [ticks] * len(texture.domain.spans)
    return texture.domain.points(np.stack(np.meshgrid(*axes), -1).reshape(-1, len(axes)))


def _find_maximum(texture: Texture, sign: float, per_side: int) -> float:
    """Return the maximum of sign·h: the best points of a dense grid, refined by SciPy."""
    from scipy.optimize import minimize

    xy = _grid(texture, per_side)
    values = sign * texture.height(xy)
    scale, size = np.hypot(*texture.domain.spans[0]) / per_side, texture.peak_to_valley
    best = float(values.max())
    for start in xy[np.argsort(values)[-8:]]:

        def objective(u: np.ndarray, start: np.ndarray = start) -> float:
            return float(-sign * texture.height((start + scale * u)[None, :])[0] / size)

        def slope(u: np.ndarray, start: np.ndarray = start) -> np.ndarray:
            return -sign * scale * texture.gradient((start + scale * u)[None, :])[0] / size

        result = minimize(objective, np.zeros(2), jac=slope, method="BFGS", options={"gtol": 1e-10})
        best = max(best, -float(result.fun) * size)
    return best


@pytest.fixture(scope="session")
def sampled_extremes() -> Callable[..., tuple[float, float]]:
    """``sampled_extremes(texture, per_side)``: extremes by sampling, without a certificate."""
    return lambda texture, per_side: (
        -_find_maximum(texture, -1.0, per_side),
        _find_maximum(texture, 1.0, per_side),
    )


@pytest.fixture(scope="session")
def sampled_bounds() -> Callable[..., tuple[float, float]]:
    """``sampled_bounds(texture, per_side)``: maximum |∇h| and ‖Hess h‖ on a dense grid."""

    def measure(texture: Texture, per_side: int) -> tuple[float, float]:
        xy = _grid(texture, per_side)
        slope = np.hypot(*texture.gradient(xy).T).max()
        return float(slope), float(np.abs(np.linalg.eigvalsh(texture.hessian(xy))).max())

    return measure

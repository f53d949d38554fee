"""Law H as a baked potential field: exactly conservative, fast, with a certified gain."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field, replace
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.passivity.verdict import recommend_stiffness
from asperity.contacts.split.potential_spline import PotentialSpline
from asperity.core.checks import FloatArray, Points, check_points, check_positive
from asperity.core.errors import ParameterError
from asperity.core.processes import available_cores
from asperity.core.units import round_up
from asperity.devices import Device, load_device
from asperity.laws.h_split_god_object import LAW as SPLIT_GOD_OBJECT
from asperity.surface import Surface

Progress = Callable[[float], None]

_MIN_STEPS = 4
_NODES_PER_BLOCK = 20_000
# Rounding of a second difference of coefficients, in units of their size, counted generously.
_DIFFERENCE_ROUNDING = 32.0 * float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class FieldGrid:
    """The nodes of a baked field.

    Attributes:
        steps: from node to node along each axis of the texture [m], shape (d, 2).
        cells: number of steps along each of them.
        start: the first node [m], shape (2,).
        levels: number of nodes along z, the last two of them above the highest point.
        level_spacing: distance of the levels [m].
        floor: z halfway between the two lowest levels [m], the bottom of the spline's cells.
        periodic: whether the field repeats; else it is mirrored at its border.
    """

    steps: FloatArray
    cells: tuple[int, ...]
    start: FloatArray
    levels: int
    level_spacing: float
    floor: float
    periodic: bool

    @staticmethod
    def fit(surface: Surface, resolution: float) -> FieldGrid:
        """Return the coarsest grid whose nodes are at most the resolution apart."""
        domain, (low, high) = surface.texture.domain, surface.texture.extremes
        lengths = np.hypot(*domain.spans.T)
        cells = [max(math.ceil(length / resolution), _MIN_STEPS) for length in lengths]
        floor = low - surface.max_depth
        inside = max(math.ceil((high - floor) / resolution), _MIN_STEPS)
        return FieldGrid(
            steps=domain.spans / np.array(cells)[:, None],
            cells=tuple(cells),
            start=domain.origin,
            levels=inside + 3,
            level_spacing=(high - floor) / inside,
            floor=floor,
            periodic=domain.periodic,
        )

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of stored nodes along each axis, z last."""
        return (*(count + 3 for count in self.cells), self.levels)

    @property
    def spacing(self) -> tuple[float, ...]:
        """Distance of the nodes along each axis [m], z last."""
        return (*(float(length) for length in np.hypot(*self.steps.T)), self.level_spacing)

    @property
    def bytes(self) -> int:
        """Size of the coefficients."""
        return 8 * math.prod(self.shape)

    def height(self, level: Any) -> Any:
        """Return z of a level [m]."""
        return self.floor + (level - 0.5) * self.level_spacing

    def nodes(self, axis: int) -> NDArray[np.intp]:
        """Return the indices of the stored nodes along an axis, repeated or mirrored at borders."""
        count = self.cells[axis]
        index = np.arange(-1, count + 2)
        if self.periodic:
            return np.asarray(index % count, dtype=np.intp)
        return np.asarray(count - np.abs(count - np.abs(index)), dtype=np.intp)

    def kernel_arguments(self, coefficients: FloatArray) -> PotentialSpline:
        """Return the kernel arguments for the potential at the nodes."""
        x0, y0 = (float(value) for value in self.start)
        rates = np.zeros((2, 2))
        # Rows of the pseudo-inverse's transpose: nodes per metre along each axis.
        rates[: len(self.cells)] = np.linalg.pinv(self.steps).T
        (m00, m01), (m10, m11) = rates.tolist()
        z0 = float(self.height(0))
        inverse = (m00, m01, m10, m11)
        return PotentialSpline(
            coefficients, x0, y0, z0, *inverse, 1.0 / self.level_spacing, not self.periodic
        )

    def error_bounds(self, gain: float) -> tuple[float, float]:
        """Return proved bounds of |∇U_T - ∇U| [m] and of |U_T - U| [m²].

        A derivative of U_T along a step is the mean of that derivative of U over points around the
        probe, its potential the mean of U over other points. Both have the probe as their mean;
        along each axis the variance is 1/4 of a squared step, in the first case at most 1/3 along
        the step itself (a linear B-spline, at most 1/4, and the step's own 1/12).

        Args:
            gain: Lipschitz constant of ∇U [1].
        """
        square = np.square(self.spacing)
        spread = 0.25 * square.sum()
        components = gain * np.sqrt(spread + square / 12.0)
        rates = np.linalg.pinv(self.steps).T * np.hypot(*self.steps.T)[:, None]
        # Derivatives along non-orthogonal steps amplify an error of the gradient.
        skew = max(1.0, float(np.linalg.norm(rates, 2)))
        return skew * float(np.linalg.norm(components)), 0.5 * gain * float(spread)


def compute_potentials(surface: Surface, grid: FieldGrid, progress: Progress | None) -> FloatArray:
    """Return U [m²] at the nodes in kernel order, with borders repeated or mirrored."""
    axes = [np.unique(grid.nodes(axis)) for axis in range(len(grid.cells))]
    flat = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    columns = np.zeros((len(flat), grid.levels))
    at_once = max(_NODES_PER_BLOCK // grid.levels, 1)
    parts = [slice(first, first + at_once) for first in range(0, len(flat), at_once)]

    def fill(part: slice) -> None:
        columns[part] = _column_potentials(surface, grid, flat[part])

    if parts:
        fill(parts[0])  # compiled before the threads start
    _run_in_threads(fill, parts[1:], progress)
    stored = columns.reshape(*(len(axis) for axis in axes), grid.levels)
    for axis in range(len(axes)):
        stored = np.take(stored, grid.nodes(axis), axis=axis)
    # By second axis, first axis, z; a profile has no second axis.
    stored = stored[None] if len(axes) == 1 else np.swapaxes(stored, 0, 1)
    return np.ascontiguousarray(stored)


def _column_potentials(surface: Surface, grid: FieldGrid, index: NDArray[np.intp]) -> FloatArray:
    """Return U [m²] at all levels above nodes of the plane, shape (n, levels)."""
    xy = grid.start + index @ grid.steps
    z = grid.height(np.arange(grid.levels))
    points = np.empty((len(xy), grid.levels, 3))
    points[:, :, :2] = xy[:, None]
    points[:, :, 2] = z
    out = np.empty((points[..., 0].size, 3))
    surface._loops.split_batch(
        points.reshape(-1, 3), out, surface.continuity, surface.texture.arguments
    )
    return np.ascontiguousarray(out[:, 0].reshape(len(xy), grid.levels))


def _run_in_threads(
    function: Callable[[Any], None], parts: Sequence[Any], progress: Progress | None
) -> None:
    """Apply a function to the parts in threads; the compiled loops release the GIL."""
    with ThreadPoolExecutor(max_workers=available_cores()) as pool:
        for done, future in enumerate(as_completed(pool.submit(function, part) for part in parts)):
            future.result()
            if progress is not None:
                progress((done + 1) / len(parts))
    if progress is not None and not parts:
        progress(1.0)


def curvature_bounds(grid: FieldGrid, field: PotentialSpline) -> tuple[Bound, Bound]:
    """Return certified bounds of sup ‖Hess U_T‖ and of its greatest eigenvalue.

    ``upper`` comes from the hull of the second differences of the coefficients, ``lower`` is
    attained from inside a corner of a cell of the spline.
    """
    from asperity.contacts.split import potential_hull as hull
    from asperity.contacts.split import potential_spline as spline
    from asperity.kernels.fuse import fuse_module

    loops = fuse_module(hull, spline)
    width = grid.cells[0] + (0 if grid.periodic else 1)
    parts = [(first, min(first + 16, width)) for first in range(0, width, 16)]
    found = np.zeros((len(parts), 2, 5))

    def search(part: int) -> None:
        loops.hull_batch(*parts[part], found[part], field)

    search(0)
    _run_in_threads(search, range(1, len(parts)), None)
    rounding = _DIFFERENCE_ROUNDING * float(field.c.max()) / min(grid.spacing) ** 2
    best = found[np.argmax(found[:, :, 1], axis=0), [0, 1]]
    upper = found[:, :, 0].max(axis=0) + rounding
    positive, negative = (_curvature_bound(grid, float(upper[i]), best[i]) for i in range(2))
    larger = positive if positive.lower >= negative.lower else negative
    norm = Bound(larger.lower, float(upper.max()), "certified", larger.at, larger.note)
    return norm, positive


def _curvature_bound(grid: FieldGrid, upper: float, maximum: FloatArray) -> Bound:
    u, v, w = (float(value) for value in maximum[2:])
    xy = grid.start + np.array([u, v])[: len(grid.cells)] @ grid.steps
    at = (float(xy[0]), float(xy[1]), float(grid.height(w)))
    note = "hull of the second differences of the field; attained on one side of a knot"
    return Bound(float(maximum[1]), upper, "certified", at, note)


DEFAULT_MAX_BYTES = 2**28
# Default number of nodes, with at most _MAX_NODES_PER_WAVE.
_DEFAULT_NODES = 1_000_000
_MAX_NODES_PER_WAVE = 64  # nodes per shortest wave
_ERROR_POINTS = 4096


@dataclass(frozen=True)
class BakedField:
    """Law H baked on a grid of nodes: a potential field close to the exact one.

    The potential is a quadratic B-spline whose coefficients are the exact potential at the nodes,
    U_T(p) = Σ U(p_n) β(p - p_n), and the force its exact gradient. So it is conservative and
    continuous, a flat wall retains its stiffness, and there is no force farther than 1.5 nodes
    outside the body. Below ``floor`` the field continues with its value and slope there and the
    curvature of the flat wall: still conservative and continuous, but without a bound.

    Attributes:
        surface: the exact surface.
        spacing: distance of the nodes [m] along each axis of the texture, then z.
        shape: number of stored nodes along each of them.
        floor: z [m] down to which the numbers hold, min h - max_depth.
        lipschitz: certified sup‖J‖/k for z >= floor, the characteristic number of the field.
        one_sided: certified sup λ_max(-J)/k there, which decides for a conservative law.
        error: greatest force error [N] against the exact law, measured at random points.
        error_bound: greatest force error [N], proved for all z >= floor.
        potential_error_bound: greatest energy error [J], proved for all z >= floor.
    """

    surface: Surface
    spacing: tuple[float, ...]
    shape: tuple[int, ...]
    floor: float
    lipschitz: Bound
    one_sided: Bound
    error: float
    error_bound: float
    potential_error_bound: float
    _coefficients: PotentialSpline = field(repr=False, compare=False)

    def __repr__(self) -> str:
        nodes = " x ".join(str(count) for count in self.shape)
        return f"<BakedField of law H, {nodes} nodes, q at most {self.lipschitz.value:.4g}>"

    @property
    def resolution(self) -> float:
        """Greatest distance of nodes [m]."""
        return max(self.spacing)

    @property
    def bytes(self) -> int:
        """Size of the coefficients in memory."""
        return 8 * math.prod(self.shape)

    def force(self, points: ArrayLike) -> FloatArray:
        """Return the force on the probe [N], shape (n, 3).

        Args:
            points: probe positions [m], shape (n, 3), or (3,) for one: then the result has no first
                axis either.

        Raises:
            ParameterError: for another shape, or positions that are not finite.
        """
        probes = check_points("points", points, 3, "m")
        out = np.empty((probes.count, 3))
        self._loops.potential_force_batch(
            probes.rows, out, self.surface.stiffness, self._coefficients
        )
        return probes.restore_shape(out)

    def potential(self, points: ArrayLike) -> FloatArray:
        """Return the energy [J], shape (n,); see :meth:`force`."""
        probes, values = self._expansion(points)
        return probes.restore_shape(self.surface.stiffness * values[:, 0])

    def jacobian(self, points: ArrayLike) -> FloatArray:
        """Return J = -k Hess U_T [N/m], shape (n, 3, 3); see :meth:`force`."""
        probes, values = self._expansion(points)
        second = values[:, [1, 2, 3, 2, 4, 5, 3, 5, 6]].reshape(-1, 3, 3)
        return probes.restore_shape(-self.surface.stiffness * second)

    def safe_stiffness(self, device: str | os.PathLike[str] | Device) -> float:
        """Return the stability limit [N/m] of the field on a device; 0 if none is known.

        For the basis of such a limit see
        :class:`~asperity.analysis.passivity.verdict.StabilityLimit`.

        Args:
            device: id of the catalogue, TOML file, or a :class:`~asperity.devices.Device`.

        Raises:
            ParameterError: for an unknown device.
        """
        numbers = (self.lipschitz, self.one_sided)
        recommended = recommend_stiffness(self.surface, load_device(device), *numbers)
        return recommended.stability_limit.stiffness or 0.0

    @property
    def _loops(self) -> ModuleType:
        from asperity.contacts.split import potential_spline as spline
        from asperity.kernels.fuse import fuse_module

        return fuse_module(spline)

    def _expansion(self, points: ArrayLike) -> tuple[Points, FloatArray]:
        probes = check_points("points", points, 3, "m")
        out = np.empty((probes.count, 7))
        self._loops.expansion_batch(probes.rows, out, self._coefficients)
        return probes, out


def bake(
    surface: Surface,
    resolution: float | None = None,
    *,
    max_bytes: int = DEFAULT_MAX_BYTES,
    progress: Progress | None = None,
) -> BakedField:
    """Bake law H of a surface as a potential field: a force takes some ten nanoseconds.

    Args:
        surface: a surface with law H; the field extends down to min h - max_depth.
        resolution: greatest distance of the nodes [m]; by default for about a million nodes, but
            at most 64 for each of the shortest waves.
        max_bytes: greatest size of the field.
        progress: called with the finished fraction, from 0 to 1.

    Raises:
        ParameterError: for another law, a texture that neither repeats nor has a border, or a
            field larger than ``max_bytes``; the message states its size and what fits.

    Reference:
        MATH section 6, evaluation (c).

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> steep = Surface(Sinusoid(amplitude=0.4e-3, period=1e-3), "H", max_depth=0.5e-3)
        >>> field = bake(steep, resolution=10e-6)
        >>> field.shape, round(field.lipschitz.value, 2)
        ((103, 133), 1.07)
    """
    if surface.law is not SPLIT_GOD_OBJECT:
        raise ParameterError("surface", f"must have law H to be baked, not {surface.law}")
    texture = surface.texture
    if not (texture.domain.periodic or texture.is_mirrored):
        raise ParameterError(
            "surface", "has a texture that never repeats: no finite field represents it"
        )
    limit = int(check_positive("max_bytes", max_bytes, "byte"))
    if resolution is None:
        grid = _default_grid(surface, limit)
    else:
        grid = FieldGrid.fit(surface, check_positive("resolution", resolution, "m"))
        _check_size(surface, grid, limit)
    return _bake_on_grid(surface, grid, compute_potentials(surface, grid, progress))


def _default_grid(surface: Surface, limit: int) -> FieldGrid:
    slope, hessian = surface.texture.bounds
    finest = 2.0 * math.pi * slope / hessian / _MAX_NODES_PER_WAVE if hessian > 0.0 else 0.0
    fitting = _finest_resolution(surface, min(8 * _DEFAULT_NODES, limit))
    return FieldGrid.fit(surface, max(fitting, finest))


def _finest_resolution(surface: Surface, max_bytes: int) -> float:
    """Return the finest resolution [m] of a field within a size, to three digits."""
    coarse = max(FieldGrid.fit(surface, math.inf).spacing)
    while FieldGrid.fit(surface, 0.5 * coarse).bytes <= max_bytes and coarse > 1e-12:
        coarse *= 0.5
    fine = 0.5 * coarse
    while coarse > 1.001 * fine:
        middle = math.sqrt(fine * coarse)
        fits = FieldGrid.fit(surface, middle).bytes <= max_bytes
        fine, coarse = (fine, middle) if fits else (middle, coarse)
    return coarse


def _check_size(surface: Surface, grid: FieldGrid, limit: int) -> None:
    if grid.bytes <= limit:
        return
    nodes = " x ".join(str(count) for count in grid.shape)
    least = FieldGrid.fit(surface, math.inf)
    if least.bytes > limit:
        fits = f"even the coarsest one takes {least.bytes} byte"
    else:
        # Rounded up, so that the resolution in the message fits.
        fits = f"{round_up(_finest_resolution(surface, limit)):.3g} m fits"
    raise ParameterError(
        "resolution",
        f"would need a field of {nodes} nodes, {grid.bytes / 1e6:,.1f} MB, more than max_bytes = "
        f"{limit / 1e6:,.1f} MB; {fits}",
        max(grid.spacing),
    )


def _bake_on_grid(surface: Surface, grid: FieldGrid, coefficients: FloatArray) -> BakedField:
    entries = grid.kernel_arguments(coefficients)
    lipschitz, one_sided = curvature_bounds(grid, entries)
    force, energy = grid.error_bounds(max(1.0, surface.parameter("continuity")))
    baked = BakedField(
        surface=surface,
        spacing=grid.spacing,
        shape=grid.shape,
        floor=grid.floor,
        lipschitz=lipschitz,
        one_sided=one_sided,
        error=math.nan,
        error_bound=surface.stiffness * force,
        potential_error_bound=surface.stiffness * energy,
        _coefficients=entries,
    )
    points = _random_probes(surface, grid)
    difference = baked.force(points) - surface.force(points)
    return replace(baked, error=float(np.linalg.norm(difference, axis=1).max()))


def _random_probes(surface: Surface, grid: FieldGrid) -> FloatArray:
    """Return random points of the field, half of them within two nodes of the surface."""
    rng = np.random.default_rng(0)
    xy = surface.texture.domain.points(rng.uniform(size=(2 * _ERROR_POINTS, len(grid.cells))))
    top = surface.texture.extremes[1]
    z = rng.uniform(grid.floor, top, len(xy))
    near = slice(None, _ERROR_POINTS)
    z[near] = surface.texture.height(xy[near])
    z[near] += 2.0 * grid.level_spacing * rng.uniform(-1.0, 1.0, _ERROR_POINTS)
    return np.column_stack([xy, np.maximum(z, grid.floor)])

"""Law H as a baked potential field: exactly conservative, fast, with a certified gain."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field, replace
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.passivity.recommended_stiffness import recommend_stiffness
from asperity.analysis.split.field_grid import (
    FieldGrid,
    Progress,
    compute_potentials,
    curvature_bounds,
)
from asperity.contacts.split.potential_spline import PotentialSpline
from asperity.core.checks import FloatArray, Points, check_points, check_positive
from asperity.core.errors import ParameterError
from asperity.devices import Device, load_device
from asperity.laws.h_split_god_object import LAW as SPLIT_GOD_OBJECT
from asperity.surface import Surface

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
        fits = f"{_round_up_digits(_finest_resolution(surface, limit)):.3g} m fits"
    raise ParameterError(
        "resolution",
        f"would need a field of {nodes} nodes, {grid.bytes / 1e6:,.1f} MB, more than max_bytes = "
        f"{limit / 1e6:,.1f} MB; {fits}",
        max(grid.spacing),
    )


def _round_up_digits(value: float) -> float:
    """Return the value rounded up to three digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.ceil(value / unit) * unit


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

"""Law H from a table, for the tightest loops: exactly conservative, with a certified gain."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field, replace
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.passivity.allowed import allowed_stiffness
from asperity.analysis.split.potential_grid import Grid, Progress, curvatures, potentials
from asperity.checks import FloatArray, Points, positive
from asperity.checks import points as read_points
from asperity.contacts.split.spline import PotentialTable
from asperity.devices import Device, load_device
from asperity.errors import ParameterError
from asperity.laws.h_split_god_object import LAW as SPLIT_GOD_OBJECT
from asperity.surface import Surface

DEFAULT_MAX_BYTES = 2**28
# Unless told otherwise, a table has about this many nodes, but no finer ones than there is use for.
_DEFAULT_NODES = 1_000_000
_FINEST = 64  # nodes per shortest wave
_ERROR_POINTS = 4096


@dataclass(frozen=True)
class TabulatedSurface:
    """Law H on a grid of nodes: a force field of its own, close to the exact one.

    The potential is a quadratic B-spline whose coefficients are the exact potential at the nodes,
    U_T(p) = Σ U(p_n) β(p - p_n), and the force its exact gradient. So it is conservative and
    continuous, a flat wall keeps its stiffness, and there is no force farther than 1.5 nodes
    outside the body. Below ``floor`` the table goes on with its value and slope there and the
    curvature of the flat wall: conservative and continuous still, but without a bound.

    Attributes:
        surface: the exact surface.
        spacing: distance of the nodes [m] along each axis of the texture, then z.
        shape: number of stored nodes along each of them.
        floor: z [m] down to which the numbers hold, min h - max_depth.
        lipschitz: certified sup‖J‖/k for z >= floor, the characteristic number of the table.
        one_sided: certified sup λ_max(-J)/k there, which decides for a conservative law.
        error: greatest difference of force to the exact law [N] at random points, measured.
        error_bound: the same [N], proved for all z >= floor.
        potential_error_bound: greatest difference of energy [J], proved likewise.
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
    _table: PotentialTable = field(repr=False, compare=False)

    def __repr__(self) -> str:
        nodes = " x ".join(str(count) for count in self.shape)
        return f"<TabulatedSurface of law H, {nodes} nodes, q at most {self.lipschitz.value:.4g}>"

    @property
    def resolution(self) -> float:
        """Greatest distance of nodes [m]."""
        return max(self.spacing)

    @property
    def bytes(self) -> int:
        """Size of the table in memory."""
        return 8 * math.prod(self.shape)

    def force(self, points: ArrayLike) -> FloatArray:
        """Return the force on the probe [N], shape (n, 3).

        Args:
            points: probe positions [m], shape (n, 3), or (3,) for one: then the answer has no first
                axis either.

        Raises:
            ParameterError: for another shape, or positions that are not finite.
        """
        probes = read_points("points", points, 3, "m")
        out = np.empty((probes.count, 3))
        self._loops.table_force_batch(probes.rows, out, self.surface.stiffness, self._table)
        return probes.answer(out)

    def potential(self, points: ArrayLike) -> FloatArray:
        """Return the energy [J], shape (n,); see :meth:`force`."""
        probes, values = self._expansion(points)
        return probes.answer(self.surface.stiffness * values[:, 0])

    def jacobian(self, points: ArrayLike) -> FloatArray:
        """Return J = -k Hess U_T [N/m], shape (n, 3, 3); see :meth:`force`."""
        probes, values = self._expansion(points)
        second = values[:, [1, 2, 3, 2, 4, 5, 3, 5, 6]].reshape(-1, 3, 3)
        return probes.answer(-self.surface.stiffness * second)

    def safe_stiffness(self, device: str | os.PathLike[str] | Device) -> float:
        """Return the stiffness [N/m] up to which a device renders the table; 0 if none is known.

        It is as good as what is known of the device: see
        :class:`~asperity.analysis.passivity.judgement.Allowed`.

        Args:
            device: id of the catalogue, TOML file, or a :class:`~asperity.devices.Device`.

        Raises:
            ParameterError: for an unknown device.
        """
        numbers = (self.lipschitz, self.one_sided)
        found, _wall = allowed_stiffness(self.surface, load_device(device), *numbers)
        return found.stiffness or 0.0

    @property
    def _loops(self) -> ModuleType:
        from asperity.contacts.split import spline
        from asperity.kernels.fuse import fuse_module

        return fuse_module(spline)

    def _expansion(self, points: ArrayLike) -> tuple[Points, FloatArray]:
        probes = read_points("points", points, 3, "m")
        out = np.empty((probes.count, 7))
        self._loops.expansion_batch(probes.rows, out, self._table)
        return probes, out


def tabulate(
    surface: Surface,
    resolution: float | None = None,
    *,
    max_bytes: int = DEFAULT_MAX_BYTES,
    progress: Progress | None = None,
) -> TabulatedSurface:
    """Return law H of a surface as a table: a force in some ten nanoseconds.

    Args:
        surface: a surface with law H; the table reaches down to min h - max_depth.
        resolution: greatest distance of the nodes [m]; by default such that there are about a
            million nodes, but at most 64 for each of the shortest waves.
        max_bytes: the table is refused if it would be larger.
        progress: called with the finished fraction, from 0 to 1.

    Raises:
        ParameterError: for another law, a texture that neither repeats nor has a border, or a
            table that would be larger than ``max_bytes``: it says how large, and what fits.

    Reference:
        MATH section 6, evaluation (c).

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> steep = Surface(Sinusoid(amplitude=0.4e-3, period=1e-3), "H", max_depth=0.5e-3)
        >>> table = tabulate(steep, resolution=10e-6)
        >>> table.shape, round(table.lipschitz.value, 2)
        ((103, 133), 1.07)
    """
    if surface.law is not SPLIT_GOD_OBJECT:
        raise ParameterError("surface", f"must have law H to be tabulated, not {surface.law}")
    texture = surface.texture
    if not (texture.domain.periodic or texture.ends):
        raise ParameterError("surface", "has a texture that never repeats: no table holds it")
    limit = int(positive("max_bytes", max_bytes, "byte"))
    if resolution is None:
        grid = _default_grid(surface, limit)
    else:
        grid = Grid.fit(surface, positive("resolution", resolution, "m"))
        _refuse_if_too_large(surface, grid, limit)
    return _tabulated(surface, grid, potentials(surface, grid, progress))


def _default_grid(surface: Surface, limit: int) -> Grid:
    slope, bend = surface.texture.bounds
    finest = 2.0 * math.pi * slope / bend / _FINEST if bend > 0.0 else 0.0
    return Grid.fit(surface, max(_resolution_for(surface, min(8 * _DEFAULT_NODES, limit)), finest))


def _resolution_for(surface: Surface, most_bytes: int) -> float:
    """Return the finest resolution [m] whose table is not larger, to three digits."""
    coarse = max(Grid.fit(surface, math.inf).spacing)
    while Grid.fit(surface, 0.5 * coarse).bytes <= most_bytes and coarse > 1e-12:
        coarse *= 0.5
    fine = 0.5 * coarse
    while coarse > 1.001 * fine:
        middle = math.sqrt(fine * coarse)
        if Grid.fit(surface, middle).bytes <= most_bytes:
            coarse = middle
        else:
            fine = middle
    return coarse


def _refuse_if_too_large(surface: Surface, grid: Grid, limit: int) -> None:
    if grid.bytes <= limit:
        return
    nodes = " x ".join(str(count) for count in grid.shape)
    least = Grid.fit(surface, math.inf)
    if least.bytes > limit:
        fits = f"even the coarsest one takes {least.bytes} byte"
    else:
        # Rounded up, so that what is named does fit.
        fits = f"{_rounded_up(_resolution_for(surface, limit)):.3g} m fits"
    raise ParameterError(
        "resolution",
        f"would need a table of {nodes} nodes, {grid.bytes / 1e6:,.1f} MB, more than max_bytes = "
        f"{limit / 1e6:,.1f} MB; {fits}",
        max(grid.spacing),
    )


def _rounded_up(value: float) -> float:
    """Return a number of three digits that is not smaller."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.ceil(value / unit) * unit


def _tabulated(surface: Surface, grid: Grid, coefficients: FloatArray) -> TabulatedSurface:
    entries = grid.table(coefficients)
    lipschitz, one_sided = curvatures(grid, entries)
    force, energy = grid.error_bounds(max(1.0, surface.parameter("continuity")))
    table = TabulatedSurface(
        surface=surface,
        spacing=grid.spacing,
        shape=grid.shape,
        floor=grid.floor,
        lipschitz=lipschitz,
        one_sided=one_sided,
        error=math.nan,
        error_bound=surface.stiffness * force,
        potential_error_bound=surface.stiffness * energy,
        _table=entries,
    )
    points = _probes(surface, grid)
    difference = table.force(points) - surface.force(points)
    return replace(table, error=float(np.linalg.norm(difference, axis=1).max()))


def _probes(surface: Surface, grid: Grid) -> FloatArray:
    """Return random points over the table, half of them within two nodes of the surface."""
    rng = np.random.default_rng(0)
    xy = surface.texture.domain.points(rng.uniform(size=(2 * _ERROR_POINTS, len(grid.cells))))
    top = surface.texture.extremes[1]
    z = rng.uniform(grid.floor, top, len(xy))
    near = slice(None, _ERROR_POINTS)
    z[near] = surface.texture.height(xy[near])
    z[near] += 2.0 * grid.rise * rng.uniform(-1.0, 1.0, _ERROR_POINTS)
    return np.column_stack([xy, np.maximum(z, grid.floor)])

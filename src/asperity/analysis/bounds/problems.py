"""Problems over cells: a measure of J.

A law's own generated kernel, evaluated on Taylor models, encloses J on whole cells.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any

import numpy as np

from asperity.analysis.bounds.bound import JacobianMeasure
from asperity.analysis.bounds.branch_and_bound import Contacts, Problem
from asperity.analysis.bounds.sampling import contact_jacobians
from asperity.contacts.contact import parameter_name
from asperity.core.checks import FloatArray
from asperity.enclosures.cells import (
    ANGLE_COORDINATE,
    DEPTH_COORDINATE,
    DERIVATIVE_NAMES,
    LENGTH_COORDINATE,
    Cells,
    ProductCells,
    anchor_enclosures,
    cells_with_deflection,
    cells_with_depth,
)
from asperity.enclosures.taylor import TaylorMath, TaylorModel, TaylorNumber
from asperity.kernels.fuse import uses_position
from asperity.laws import Law
from asperity.surface import Surface

Entries = Sequence[Sequence[Any]]
# Numbers of J/k below this are not resolved: a flat surface has no relative gap.
RESOLUTION = 1e-9


class MatrixProblem(Problem):
    """The greatest measure of matrices that are functions of the height derivatives.

    Args:
        cells: of the texture.
        names: names of the needed derivatives.
        measure: the measure.
        floor: see :class:`Problem`.
    """

    def __init__(
        self,
        cells: Cells,
        names: Sequence[str],
        measure: JacobianMeasure,
        floor: float = RESOLUTION,
    ) -> None:
        self.cells = cells
        self.floor = floor
        self._names = names
        self._measure = measure

    @abstractmethod
    def matrices(self, models: dict[str, TaylorNumber]) -> list[Entries]:
        """Return 3 × 3 entries from the derivatives' models, several if the greatest counts."""

    @abstractmethod
    def exact_matrices(self, coordinates: FloatArray) -> list[FloatArray]:
        """Return the same matrices at coordinates (n, d), each of shape (n, 3, 3)."""

    def upper_bounds(self, centres: FloatArray, half: FloatArray, threshold: float) -> FloatArray:
        """See :class:`Problem`."""
        n = len(centres)
        d = len(half)
        best = np.full(n, -np.inf)
        with np.errstate(all="ignore"):
            models = self.cells.enclosures(centres, half, self._names)
            for entries in self.matrices(models):
                c, g, e = stack_entries(entries, n, d)
                best = np.maximum(best, self._measure.upper_bounds(c, g, e, threshold))
        return best

    def values(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Problem`."""
        with np.errstate(all="ignore"):
            values = [
                self._measure.accurate(matrices) for matrices in self.exact_matrices(coordinates)
            ]
        return np.asarray(np.max(values, axis=0))


def stack_entries(entries: Entries, n: int, d: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return centres (n, 3, 3), gradients (d, n, 3, 3) and errors (n, 3, 3) of matrices."""
    c = np.zeros((n, 3, 3))
    g = np.zeros((d, n, 3, 3))
    e = np.zeros((n, 3, 3))
    for i, row in enumerate(entries):
        for j, entry in enumerate(row):
            if isinstance(entry, TaylorModel):
                c[:, i, j] = entry.c
                g[:, :, i, j] = entry.g
                e[:, i, j] = entry.e
            else:
                c[:, i, j] = entry
    return c, g, e


def law_kernel(
    law: Law, name: str = "law_jacobian", math: type[TaylorMath] | ModuleType = TaylorMath
) -> tuple[Callable[..., Any], tuple[str, ...]]:
    """Return one of a law's generated kernels for Taylor models or arrays, and its arguments.

    Raises:
        TypeError: when called, if the kernel branches on comparisons, as pieces and max() do.
    """
    from asperity.kernels.fuse import kernel_source

    source = kernel_source(law)
    space: dict[str, Any] = {"math": math}
    exec(compile(source, f"<law {law.letter}>", "exec"), space)
    kernel = space[name]
    return kernel, kernel.__code__.co_varnames[: kernel.__code__.co_argcount]


def law_constants(surface: Surface) -> dict[str, float]:
    """Return the arguments of a kernel that are constant over the surface; k is 1."""
    _k, middle, half = surface.law_arguments[:3]
    own = {parameter_name(name): value for name, value in surface.law_parameters.items()}
    return {"k": 1.0, "h_mid": middle, "h_half": half, **own}


class LawKernel:
    """The Jacobian over k of a law, or with its depth held by a clamp.

    Args:
        surface: the surface.
        name: the generated kernel, ``law_jacobian`` or ``law_jacobian_saturated``.
        math: the ``math`` module of the kernel: enclosures, or NumPy for arrays.
    """

    def __init__(
        self,
        surface: Surface,
        name: str = "law_jacobian",
        math: type[TaylorMath] | ModuleType = TaylorMath,
    ) -> None:
        self._function, self._arguments = law_kernel(surface.law, name, math)
        self._constants = law_constants(surface)
        self.names = [name for name in DERIVATIVE_NAMES if name in self._arguments]

    def rows_at_depth(self, values: dict[str, Any], depth: Any) -> Entries:
        """Return the rows of J/k from the height's derivatives, and the state of an anchor.

        Raises:
            TypeError: for a kernel that takes anything else, or branches on comparisons.
        """
        known = {**self._constants, **values, DEPTH_COORDINATE: depth}
        if not known.keys() >= set(self._arguments):
            raise TypeError("the force depends on the position itself")
        entries = self._function(**{name: known[name] for name in self._arguments})[-9:]
        return [entries[0:3], entries[3:6], entries[6:9]]


class LawProblem(MatrixProblem):
    """A measure of J/k itself, over contacts, depths in [0, D] and states of an anchor.

    At a fixed contact most Jacobians are affine in the depth, and a convex measure is then
    greatest at an end; else the depth is an additional coordinate.
    """

    def __init__(self, surface: Surface, cells: Cells, measure: JacobianMeasure) -> None:
        self._surface = surface
        self._kernel = LawKernel(surface)
        depth = surface.max_depth
        self._depths = (0.0, depth) if surface.facts.affine_in_depth else (None,)
        if surface.law.stateful:
            level = None if self._depths[0] is not None else depth
            self._max_deflection = surface.parameter("max_deflection")
            cells = cells_with_deflection(cells, self._max_deflection, level)
        elif self._depths[0] is None:
            cells = cells_with_depth(cells, depth)
        self._sliding_states = (False, True) if surface.law.stateful else (False,)
        super().__init__(cells, self._kernel.names, measure)

    def matrices(self, models: dict[str, TaylorNumber]) -> list[Entries]:
        """See :class:`MatrixProblem`."""
        result = []
        for sliding in self._sliding_states:
            state = {}
            if self._surface.law.stateful:
                state = anchor_enclosures(models, self._max_deflection, sliding=sliding)
            for end in self._depths:
                depth = models[DEPTH_COORDINATE] if end is None else end
                result.append(self._kernel.rows_at_depth({**models, **state}, depth))
        return result

    def contacts(self, coordinates: FloatArray) -> list[Contacts]:
        """Return every depth and state evaluated at given coordinates."""
        n = len(coordinates)
        further: dict[str, FloatArray] = {}
        if isinstance(self.cells, ProductCells):
            further = self.cells.extra_coordinates(coordinates)
        result = []
        for sliding in self._sliding_states:
            deflection = np.zeros((n, 2))
            if self._surface.law.stateful:
                length = np.full(n, self._max_deflection) if sliding else further[LENGTH_COORDINATE]
                unit = np.stack(
                    [np.cos(further[ANGLE_COORDINATE]), np.sin(further[ANGLE_COORDINATE])], axis=-1
                )
                deflection = length[:, None] * unit
            for end in self._depths:
                depth = further[DEPTH_COORDINATE] if end is None else np.full(n, end)
                result.append(Contacts(depth, deflection, sliding))
        return result

    def exact_matrices(self, coordinates: FloatArray) -> list[FloatArray]:
        """See :class:`MatrixProblem`."""
        derivatives = self.cells.derivatives(coordinates)
        xy = np.zeros((len(coordinates), 2))
        if uses_position(self._surface.law) and self.cells.are_places:
            xy = self.cells.to_plane(coordinates)
        return [
            contact_jacobians(
                self._surface, xy, at.depth, derivatives, at.deflection, sliding=at.sliding
            )
            for at in self.contacts(coordinates)
        ]


# Just below max_depth, so that rounding does not put the probe above it.
_JUST_BELOW = 1.0 + 1e-9
# The coordinate of the depth below max_depth [m]; no valid parameter name, so no law declares it.
DEPTH_BELOW_CLAMP = "depth below clamp"


class ClampKernel:
    """A law's Jacobian over k where its clamp acts, for Taylor models or arrays.

    Args:
        surface: a surface whose clamp acts and whose law has no state.
        math: the ``math`` module of the kernels: enclosures, or NumPy for arrays.

    Raises:
        TypeError: when called, for a law whose kernel branches on comparisons.
    """

    def __init__(self, surface: Surface, math: type[TaylorMath] | ModuleType = TaylorMath) -> None:
        self._surface = surface
        self._full = LawKernel(surface, "law_jacobian", math)
        self._clamped = LawKernel(surface, "law_jacobian_saturated", math)
        used = {*self._full.names, *self._clamped.names}
        self.names = [name for name in DERIVATIVE_NAMES if name in used]

    def rows_at_depth(self, derivatives: dict[str, Any], depth: Any) -> Entries:
        """Return the rows above a backing wall, from the height's derivatives at a depth [m]."""
        clamp = self._surface.effective_clamp
        clamped = self._clamped.rows_at_depth(derivatives, self._surface.max_depth)
        if clamp.holds_whole_force:
            return clamped
        full = self._full.rows_at_depth(derivatives, depth)
        return [(clamped if i in clamp.held_components else full)[i] for i in range(3)]

    def zone_rows(self, derivatives: dict[str, Any]) -> list[Entries]:
        """Return the rows where a convex measure is greatest in the whole zone."""
        surface = self._surface
        if DEPTH_BELOW_CLAMP in derivatives:
            return [
                self.rows_at_depth(derivatives, derivatives[DEPTH_BELOW_CLAMP] + surface.max_depth)
            ]
        clamp = surface.effective_clamp
        depths = [surface.max_depth]
        if not clamp.holds_whole_force:
            depths.append(surface.clamped_depth)
        above = [self.rows_at_depth(derivatives, depth) for depth in depths]
        below = [[x, y, [*z[:2], z[2] - 1.0]] for x, y, z in above if clamp.has_backing_wall]
        return above + below


class ClampProblem(MatrixProblem):
    """A measure of J/k where a clamp acts.

    Args:
        surface: a surface whose clamp acts and whose law has no state.
        cells: of the texture.
        measure: the measure.
        floor: the number above the zone; smaller values are irrelevant.
    """

    def __init__(
        self, surface: Surface, cells: Cells, measure: JacobianMeasure, floor: float
    ) -> None:
        if not (surface.effective_clamp.holds_whole_force or surface.facts.affine_in_depth):
            cells = ProductCells(
                cells, {DEPTH_BELOW_CLAMP: surface.clamped_depth - surface.max_depth}
            )
        self._models = ClampKernel(surface)
        self._numbers = ClampKernel(surface, np)
        super().__init__(cells, self._models.names, measure, floor)

    def matrices(self, models: dict[str, TaylorNumber]) -> list[Entries]:
        """See :class:`MatrixProblem`."""
        return self._models.zone_rows(models)

    def exact_matrices(self, coordinates: FloatArray) -> list[FloatArray]:
        """See :class:`MatrixProblem`."""
        derivatives = self.cells.derivatives(coordinates).T
        known: dict[str, Any] = dict(zip(DERIVATIVE_NAMES, derivatives, strict=True))
        if isinstance(self.cells, ProductCells):
            known |= self.cells.extra_coordinates(coordinates)
        rows = self._numbers.zone_rows(known)
        return [stack_entries(entries, len(coordinates), 0)[0] for entries in rows]

    def depths(self, at: FloatArray, surface: Surface) -> tuple[float, ...]:
        """Return depths [m] at which the surface renders these matrices, at least nearly."""
        near = _JUST_BELOW * surface.max_depth
        if isinstance(self.cells, ProductCells):
            below = float(self.cells.extra_coordinates(at[None])[DEPTH_BELOW_CLAMP][0])
            return (max(near, surface.max_depth + below),)
        # Deeper by max_depth every point is below the floor of a backing wall.
        beyond = surface.max_depth if surface.effective_clamp.holds_whole_force else 0.0
        return near, surface.clamped_depth + beyond

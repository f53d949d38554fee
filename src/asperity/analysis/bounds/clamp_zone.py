"""The Jacobian below max_depth, where a clamp limits the depth, from a law's own kernels.

Whole: the law's at max_depth, with a constant depth. Backed: the same, further down with the
wall's -k e_z e_zᵀ. Lateral: its x and y rows likewise, its z row at the probe's own depth. The
first two do not change with the depth, so their numbers hold at every depth.
"""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np

from asperity.analysis.bounds.measures import JacobianMeasure
from asperity.analysis.bounds.problems import (
    Entries,
    MatrixProblem,
    as_rows,
    law_constants,
    law_kernel,
)
from asperity.core.checks import FloatArray
from asperity.enclosures.cells import DEPTH_COORDINATE, DERIVATIVE_NAMES, Cells, ProductCells
from asperity.enclosures.taylor import TaylorMath, TaylorNumber
from asperity.surface import Surface

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
        self._constants = law_constants(surface)
        self._jacobian_kernel = law_kernel(surface.law, "law_jacobian", math)
        self._saturated_kernel = law_kernel(surface.law, "law_jacobian_saturated", math)
        arguments = {*self._jacobian_kernel[1], *self._saturated_kernel[1]}
        self.names = [name for name in DERIVATIVE_NAMES if name in arguments]

    def rows_at_depth(self, derivatives: dict[str, Any], depth: Any) -> Entries:
        """Return the rows above a backing wall, from the height's derivatives at a depth [m]."""
        clamped = as_rows(
            self._evaluate_kernel(self._saturated_kernel, derivatives, self._surface.max_depth)
        )
        clamp = self._surface.effective_clamp
        if clamp.holds_whole_force:
            return clamped
        full = as_rows(self._evaluate_kernel(self._jacobian_kernel, derivatives, depth)[3:])
        return [(clamped if i in clamp.held_components else full)[i] for i in range(3)]

    def zone_rows(self, derivatives: dict[str, Any]) -> list[Entries]:
        """Return the rows where a convex measure is greatest in the whole zone."""
        surface = self._surface
        if DEPTH_BELOW_CLAMP in derivatives:
            return [
                self.rows_at_depth(derivatives, derivatives[DEPTH_BELOW_CLAMP] + surface.max_depth)
            ]
        clamp, depths = surface.effective_clamp, [surface.max_depth]
        if not clamp.holds_whole_force:
            depths.append(surface.clamped_depth)
        above = [self.rows_at_depth(derivatives, depth) for depth in depths]
        below = [[x, y, [*z[:2], z[2] - 1.0]] for x, y, z in above if clamp.has_backing_wall]
        return above + below

    def _evaluate_kernel(
        self,
        kernel: tuple[Callable[..., Any], tuple[str, ...]],
        derivatives: dict[str, Any],
        depth: Any,
    ) -> Any:
        function, arguments = kernel
        values = {**self._constants, **derivatives, DEPTH_COORDINATE: depth}
        if not values.keys() >= set(arguments):
            raise TypeError("the force depends on the position itself, or on an anchor")
        return function(**{name: values[name] for name in arguments})


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
        self._models, self._numbers = ClampKernel(surface), ClampKernel(surface, np)
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
        result = []
        for entries in self._numbers.zone_rows(known):
            matrices = np.empty((len(coordinates), 3, 3))
            for i, row in enumerate(entries):
                for j, entry in enumerate(row):
                    matrices[:, i, j] = entry
            result.append(matrices)
        return result

    def depths(self, at: FloatArray, surface: Surface) -> tuple[float, ...]:
        """Return depths [m] at which the surface renders these matrices, at least nearly."""
        near = _JUST_BELOW * surface.max_depth
        if isinstance(self.cells, ProductCells):
            below = float(self.cells.extra_coordinates(at[None])[DEPTH_BELOW_CLAMP][0])
            return (max(near, surface.max_depth + below),)
        # Deeper by max_depth every point is below the floor of a backing wall.
        beyond = surface.max_depth if surface.effective_clamp.holds_whole_force else 0.0
        return near, surface.clamped_depth + beyond

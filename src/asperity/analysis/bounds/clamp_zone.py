"""The Jacobian below max_depth, where a clamp holds the depth, from a law's own kernels.

Whole: the law's at max_depth, as if the depth did not change. Backed: the same, and further down
with the wall's -k e_z e_zᵀ. Lateral: its x and y rows likewise, its z row at the probe's own depth.
The first two do not change with the depth, so what holds for them holds at every depth.
"""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np

from asperity.analysis.bounds.measures import Number as MatrixNumber
from asperity.analysis.bounds.problems import (
    Entries,
    MatrixProblem,
    law_constants,
    law_kernel,
    rows_of,
)
from asperity.checks import FloatArray
from asperity.enclosures.cells import NAMES, Cells
from asperity.enclosures.products import DEPTH, ProductCells
from asperity.enclosures.taylor import Number, TaylorMath
from asperity.surface import Surface

# Just below max_depth, so that rounding does not put the probe above it.
_JUST_BELOW = 1.0 + 1e-9
# The depth below max_depth [m], where it is a coordinate of its own.
BELOW = "below"


class ZoneKernel:
    """A law's Jacobian over k where its clamp acts, for Taylor models or arrays.

    Args:
        surface: a surface whose clamp acts and whose law has no state.
        math: what ``math`` is to the kernels: enclosures, or NumPy for arrays.

    Raises:
        TypeError: when called, for a law whose kernel decides by comparing.
    """

    def __init__(self, surface: Surface, math: type[TaylorMath] | ModuleType = TaylorMath) -> None:
        self._surface = surface
        self._constants = law_constants(surface)
        self._full = law_kernel(surface.law, "law_jacobian", math)
        self._held = law_kernel(surface.law, "law_jacobian_saturated", math)
        arguments = {*self._full[1], *self._held[1]}
        self.names = [name for name in NAMES if name in arguments]

    def at(self, known: dict[str, Any], depth: Any) -> Entries:
        """Return the rows above a backing wall, from the height's derivatives at a depth [m]."""
        held = rows_of(self._called(self._held, known, self._surface.max_depth))
        if self._surface.acting_clamp != "lateral":
            return held
        full = rows_of(self._called(self._full, known, depth)[3:])
        return [held[0], held[1], full[2]]

    def every(self, known: dict[str, Any]) -> list[Entries]:
        """Return the rows of which a convex measure is greatest in the whole zone."""
        surface = self._surface
        if BELOW in known:
            return [self.at(known, known[BELOW] + surface.max_depth)]
        top = self.at(known, surface.max_depth)
        if surface.acting_clamp == "lateral":
            return [top, self.at(known, surface.clamped_depth)]
        if surface.acting_clamp == "whole":
            return [top]
        return [top, [top[0], top[1], [*top[2][:2], top[2][2] - 1.0]]]

    def _called(
        self, kernel: tuple[Callable[..., Any], tuple[str, ...]], known: dict[str, Any], depth: Any
    ) -> Any:
        function, arguments = kernel
        values = {**self._constants, **known, DEPTH: depth}
        if not values.keys() >= set(arguments):
            raise TypeError("the force depends on the position itself, or on an anchor")
        return function(**{name: values[name] for name in arguments})


class ZoneProblem(MatrixProblem):
    """A measure of J/k where a clamp acts.

    Args:
        surface: a surface whose clamp acts and whose law has no state.
        cells: of the texture.
        number: the measure.
        floor: what is known of the number above the zone: less does not matter.
    """

    def __init__(self, surface: Surface, cells: Cells, number: MatrixNumber, floor: float) -> None:
        if surface.acting_clamp == "lateral" and not surface.facts.affine_in_depth:
            cells = ProductCells(cells, {BELOW: surface.clamped_depth - surface.max_depth})
        self._models, self._numbers = ZoneKernel(surface), ZoneKernel(surface, np)
        super().__init__(cells, self._models.names, number, floor)

    def matrices(self, models: dict[str, Number]) -> list[Entries]:
        """See :class:`MatrixProblem`."""
        return self._models.every(models)

    def exact(self, coordinates: FloatArray) -> list[FloatArray]:
        """See :class:`MatrixProblem`."""
        derivatives = self.cells.derivatives(coordinates).T
        known: dict[str, Any] = dict(zip(NAMES, derivatives, strict=True))
        if isinstance(self.cells, ProductCells):
            known |= self.cells.further(coordinates)
        result = []
        for entries in self._numbers.every(known):
            matrices = np.empty((len(coordinates), 3, 3))
            for i, row in enumerate(entries):
                for j, entry in enumerate(row):
                    matrices[:, i, j] = entry
            result.append(matrices)
        return result

    def depths(self, at: FloatArray, surface: Surface) -> tuple[float, ...]:
        """Return depths [m] at which the surface itself renders these matrices, or nearly so."""
        near = _JUST_BELOW * surface.max_depth
        if isinstance(self.cells, ProductCells):
            return (max(near, surface.max_depth + float(self.cells.further(at[None])[BELOW][0])),)
        if surface.acting_clamp == "lateral":
            return near, surface.clamped_depth
        # Deeper than that everything is below the floor of a backed clamp.
        return near, surface.clamped_depth + surface.max_depth

"""Problems over cells that depend on the surface alone: slope, normal and crest curvature."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from asperity.analysis.bounds.bound import NORM, ONE_SIDED
from asperity.analysis.bounds.problems import RESOLUTION, Entries, MatrixProblem, stack_entries
from asperity.core.checks import FloatArray
from asperity.enclosures.cells import DERIVATIVE_NAMES, Cells
from asperity.enclosures.taylor import TaylorMath, TaylorNumber


class SurfaceProblem(MatrixProblem):
    """The greatest measure of a matrix that is a formula in derivatives of the height alone."""

    @abstractmethod
    def formula(self, derivatives: Sequence[Any], root: Callable[[Any], Any]) -> Entries:
        """Return rows of entries from derivatives and a square root, of models or of arrays.

        Entries that are left out are zero.
        """

    def matrices(self, models: dict[str, TaylorNumber]) -> list[Entries]:
        """See :class:`MatrixProblem`."""
        return [self.formula([models[name] for name in self._names], TaylorMath.sqrt)]

    def exact_matrices(self, coordinates: FloatArray) -> list[FloatArray]:
        """See :class:`MatrixProblem`."""
        derivatives = self.cells.derivatives(coordinates).T[1 : 1 + len(self._names)]
        return [stack_entries(self.formula(list(derivatives), np.sqrt), len(coordinates), 0)[0]]


class SlopeProblem(SurfaceProblem):
    """The greatest slope |∇h|.

    Args:
        cells: of the texture.
        offset: the 1 in √(1 + |∇h|²), whose gap counts; 0 for the slope alone.
    """

    def __init__(self, cells: Cells, offset: float) -> None:
        self._offset = offset
        super().__init__(cells, DERIVATIVE_NAMES[1:3], NORM)

    def formula(self, derivatives: Sequence[Any], _root: Callable[[Any], Any]) -> Entries:
        """See :class:`SurfaceProblem`."""
        return [[part] for part in derivatives]

    def prune_threshold(self, best: float, tolerance: float) -> float:
        """See :class:`Problem`."""
        whole = math.hypot(self._offset, best) * (1.0 + tolerance)
        return math.sqrt((whole - self._offset) * (whole + self._offset))


class NormalChangeProblem(SurfaceProblem):
    """The greatest ‖∂n/∂(x, y)‖, the change of the surface normal [1/m]."""

    def __init__(self, cells: Cells, floor: float) -> None:
        super().__init__(cells, DERIVATIVE_NAMES[1:], NORM, floor)

    def formula(self, derivatives: Sequence[Any], root: Callable[[Any], Any]) -> Entries:
        """∂n/∂x and ∂n/∂y as columns: (∂w - n (n · ∂w))/s with w = (-h_x, -h_y, 1)."""
        hx, hy, hxx, hxy, hyy = derivatives
        s = root(1.0 + hx * hx + hy * hy)
        square = 1.0 / (s * s)
        columns = []
        for a, b in ((hxx, hxy), (hxy, hyy)):
            along = (hx * a + hy * b) * square
            columns.append([(hx * along - a) / s, (hy * along - b) / s, -along / s])
        return [[column[row] for column in columns] for row in range(3)]


class CrestProblem(SurfaceProblem):
    """The greatest downward curvature of the surface [1/m].

    Args:
        cells: of the texture.
        depth: depth [m] if only law D's number down to it is needed; then curvatures up to
            1/(2 depth), and differences that do not change the number, are irrelevant.
    """

    def __init__(self, cells: Cells, depth: float | None = None) -> None:
        self._depth = depth
        floor = RESOLUTION if depth is None else 0.5 / depth
        # The missing third curvature is zero, which is never the greatest at a crest.
        super().__init__(cells, DERIVATIVE_NAMES[1:], ONE_SIDED, floor)

    def formula(self, derivatives: Sequence[Any], root: Callable[[Any], Any]) -> Entries:
        """G^(-1/2) H G^(-1/2)/s, whose eigenvalues are the principal curvatures; G = I + g gᵀ.

        G^(-1/2) = I - g gᵀ/(s (1 + s)).
        """
        hx, hy, hxx, hxy, hyy = derivatives
        square = 1.0 + hx * hx + hy * hy
        s = root(square)
        share = 1.0 / (square + s)
        a = 1.0 - hx * hx * share
        b = -(hx * hy * share)
        c = 1.0 - hy * hy * share
        # Columns of H G^(-1/2), then G^(-1/2) from the left.
        p = hxx * a + hxy * b
        q = hxx * b + hxy * c
        r = hxy * a + hyy * b
        t = hxy * b + hyy * c
        return [
            [(a * p + b * r) / s, (a * q + b * t) / s],
            [(b * p + c * r) / s, (b * q + c * t) / s],
        ]

    def upper_bounds(self, centres: FloatArray, half: FloatArray, threshold: float) -> FloatArray:
        """See :class:`Problem`: S = G⁻¹ H / s with G >= 1, s >= 1, so no curvature is above ‖H‖."""
        return np.minimum(super().upper_bounds(centres, half, threshold), self.cells.hessian_bound)

    def prune_threshold(self, best: float, tolerance: float) -> float:
        """See :class:`Problem`: y/(1 - y) within the tolerance, y = depth times curvature."""
        if self._depth is None:
            return super().prune_threshold(best, tolerance)
        y = self._depth * best
        if y >= 1.0:
            return math.inf
        number = max(y / (1.0 - y), 1.0) * (1.0 + tolerance)
        return number / (1.0 + number) / self._depth

"""Cells with more coordinates than the plane has: the depth, and the state of an anchor."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from asperity.checks import FloatArray
from asperity.enclosures.cells import CHEAP_GAPS, GAPS, SAMPLES, Cells, spread
from asperity.enclosures.taylor import Number, Taylor, TaylorMath


class ProductCells(Cells):
    """Cells times an interval of each further coordinate.

    Args:
        flat: the cells of the texture.
        further: names of the coordinates with their greatest values; they begin at zero.
    """

    def __init__(self, flat: Cells, further: dict[str, float]) -> None:
        self._flat, self._further = flat, further
        self.most = flat.most
        self._tops = np.array(list(further.values()))
        self.dimensions = flat.dimensions + len(further)
        self.gap = max(flat.gap, GAPS.get(self.dimensions, 1e-3))
        own = CHEAP_GAPS.get(self.dimensions, 1e-6)
        self.cheap_gap = None if flat.cheap_gap is None else max(flat.cheap_gap, own)

    def start(self) -> tuple[Iterator[FloatArray], FloatArray]:
        """See :class:`Cells`."""
        chunks, half = self._flat.start()
        level = 0.5 * self._tops
        deep = (np.hstack([centres, np.tile(level, (len(centres), 1))]) for centres in chunks)
        return deep, np.concatenate([half, level])

    def samples(self, count: int = SAMPLES) -> FloatArray:
        """See :class:`Cells`."""
        flat = self._flat.samples(count)
        return np.hstack([flat, spread(len(flat), len(self._tops)) * self._tops])

    def models(
        self, centres: FloatArray, half: FloatArray, names: Sequence[str]
    ) -> dict[str, Number]:
        """See :class:`Cells`; the further coordinates come with the derivatives."""
        n, flat = len(centres), self._flat.dimensions
        result: dict[str, Number] = {}
        for name, model in self._flat.models(centres[:, :flat], half[:flat], names).items():
            result[name] = self._lifted(model) if isinstance(model, Taylor) else model
        for axis, name in enumerate(self._further, start=flat):
            slopes = np.zeros((self.dimensions, n))
            slopes[axis] = half[axis]
            result[name] = Taylor(centres[:, axis], slopes, np.zeros(n))
        return result

    def _lifted(self, model: Taylor) -> Taylor:
        still = np.zeros((len(self._further), len(model.c)))
        return Taylor(model.c, np.concatenate([model.g, still]), model.e)

    def further(self, coordinates: FloatArray) -> dict[str, FloatArray]:
        """Return the further coordinates by name."""
        first = self._flat.dimensions
        return {
            name: np.ascontiguousarray(coordinates[:, axis])
            for axis, name in enumerate(self._further, start=first)
        }

    def derivatives(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return self._flat.derivatives(coordinates[:, : self._flat.dimensions])

    def plane(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return self._flat.plane(coordinates[:, : self._flat.dimensions])

    def chunk(self) -> int:
        """See :class:`Cells`."""
        return self._flat.chunk()

    def inside(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        first = self._flat.dimensions
        flat = self._flat.inside(coordinates[:, :first])
        return np.hstack([flat, np.clip(coordinates[:, first:], 0.0, self._tops)])


DEPTH = "depth"
LENGTH, ANGLE = "deflection_length", "deflection_angle"


def with_depth(cells: Cells, depth: float) -> ProductCells:
    """Return cells whose last coordinate is the depth [m]."""
    return ProductCells(cells, {DEPTH: depth})


def with_deflection(cells: Cells, longest: float, depth: float | None) -> ProductCells:
    """Return cells with length [m] and angle of a deflection, and the depth [m] if given."""
    further = {LENGTH: longest, ANGLE: 2.0 * math.pi}
    return ProductCells(cells, further if depth is None else {**further, DEPTH: depth})


def anchor_models(models: dict[str, Number], longest: float, *, sliding: bool) -> dict[str, Number]:
    """Return what a kernel takes of an anchor's state: d, and ∂d/∂p_xy = I, or I - u uᵀ if dragged.

    A dragged anchor is deflected as far as it can be.
    """
    angle = models[ANGLE]
    ux, uy = TaylorMath.cos(angle), TaylorMath.sin(angle)
    length = longest if sliding else models[LENGTH]
    state: dict[str, Number] = {"dx": length * ux, "dy": length * uy}
    if not sliding:
        return {**state, "sxx": 1.0, "sxy": 0.0, "syy": 1.0}
    return {**state, "sxx": uy * uy, "sxy": -(ux * uy), "syy": ux * ux}

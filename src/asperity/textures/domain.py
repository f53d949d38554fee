"""The domain of a texture, which represents all of it, and its scan line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from asperity.core.checks import FloatArray

GridValues = tuple[FloatArray, tuple[float, float], bool]
"""Values on a grid, its spacing (x, y) [m], and whether it covers a whole period."""


@dataclass(frozen=True)
class Domain:
    """A region of the plane that represents the whole texture.

    Attributes:
        origin: one corner [m], shape (2,).
        spans: edge vectors [m], shape (1, 2) for a profile, (2, 2) for a map.
        periodic: whether the texture repeats along every span.
        description: phrase for tables.
    """

    origin: FloatArray
    spans: FloatArray
    periodic: bool
    description: str

    def points(self, fractions: FloatArray) -> FloatArray:
        """Return the points (n, 2) [m] at fractions (n, d) of the spans."""
        return np.ascontiguousarray(self.origin + fractions @ self.spans)

    def expand(self, margin: float) -> Domain:
        """Return the region extended by a margin [m] on every side."""
        unit = self.spans / np.hypot(*self.spans.T)[:, None]
        spans = self.spans + 2.0 * margin * unit
        return replace(self, origin=self.origin - margin * unit.sum(axis=0), spans=spans)

    def orthogonal_spans(self) -> tuple[FloatArray, bool]:
        """Return orthogonal spans [m], and whether the texture is periodic along them."""
        if len(self.spans) == 1:
            return self.spans, self.periodic
        along = self.spans[0] / np.hypot(*self.spans[0])
        across = self.spans[1] - float(self.spans[1] @ along) * along
        skew = float(np.hypot(*(self.spans[1] - across)))
        square = skew < 1e-9 * float(np.hypot(*across))
        return np.array([self.spans[0], across]), self.periodic and square

    def grid(self, counts: Sequence[int], max_count: int | None = None) -> GridValues:
        """Return equally spaced points along orthogonal spans.

        Args:
            counts: points along each span.
            max_count: greatest number of points along each side, taken from the middle of the grid.

        Returns:
            Points [m], shape (ny, nx, 2), (1, nx, 2) for a profile; spacing (x, y) [m]; whether
            they cover a whole period.
        """
        spans, repeats = self.orthogonal_spans()
        sides = np.hypot(*spans.T)
        number = np.array(counts, dtype=np.intp)
        # A finite map has nodes at both ends; a periodic one does not repeat its first node.
        steps = sides / (number if self.periodic else number - 1)
        first = np.zeros_like(number)
        if max_count is not None and number.max() > max_count:
            repeats = False
            first = np.maximum((number - max_count) // 2, 0)
            number = np.minimum(number, max_count)
        ticks = [
            (start + np.arange(count)) * step / side
            for start, count, step, side in zip(first, number, steps, sides, strict=True)
        ]
        points = self.origin + np.stack(np.meshgrid(*ticks), axis=-1) @ spans
        points = points[None] if len(ticks) == 1 else points
        return points, (float(steps[0]), float(steps[-1])), repeats


@dataclass(frozen=True)
class ScanLine:
    """A straight line over the texture.

    Attributes:
        start: first point [m], shape (2,).
        direction: unit vector, shape (2,).
        length: one period, or the extent [m].
        periodic: whether the texture repeats after this length.
    """

    start: FloatArray
    direction: FloatArray
    length: float
    periodic: bool

    def points(self, count: int) -> FloatArray:
        """Return points (count, 2) [m] in the middle of equal steps."""
        steps = (np.arange(count) + 0.5) * (self.length / count)
        return np.ascontiguousarray(self.start + steps[:, None] * self.direction)

"""What cells of a texture offer."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence

import numpy as np

from asperity.checks import FloatArray
from asperity.enclosures.taylor import Number

NAMES = ("h", "hx", "hy", "hxx", "hxy", "hyy")
# How often each name is differentiated by x and by y.
ORDERS = {"h": (0, 0), "hx": (1, 0), "hy": (0, 1), "hxx": (2, 0), "hxy": (1, 1), "hyy": (0, 2)}
CHUNK = 16_384
SAMPLES = 4096
EPS = float(np.finfo(float).eps)
# By the number of coordinates.
GAPS = {1: 1e-6, 2: 1e-6, 3: 1e-4}
CHEAP_GAPS = {1: 1e-10, 2: 1e-9, 3: 1e-7}


class Cells(ABC):
    """Cells of a texture: boxes in its own coordinates, all of one level equally large.

    Attributes:
        dimensions: how many coordinates they have.
        gap: the relative gap that is reached in reasonable time.
        cheap_gap: a smaller one that is worth a try.
        most: cells beyond which halving them tells little more; as many as asked for by default.
        bend: proved bound of ‖Hess h‖₂ over all of them [1/m], where it is worth a look.
    """

    dimensions: int
    gap: float
    cheap_gap: float | None = None
    most: int | None = None
    bend: float = math.inf

    @abstractmethod
    def start(self) -> tuple[Iterator[FloatArray], FloatArray]:
        """Return the centres of the first cells, chunk by chunk (n, d), and their half widths."""

    @abstractmethod
    def samples(self, count: int = SAMPLES) -> FloatArray:
        """Return coordinates (n, d) spread over all cells, to begin with."""

    @abstractmethod
    def models(
        self, centres: FloatArray, half: FloatArray, names: Sequence[str]
    ) -> dict[str, Number]:
        """Return enclosures of the named height derivatives on cells."""

    @abstractmethod
    def derivatives(self, coordinates: FloatArray) -> FloatArray:
        """Return h, h_x, h_y, h_xx, h_xy, h_yy, shape (n, 6), at coordinates (n, d)."""

    @abstractmethod
    def plane(self, coordinates: FloatArray) -> FloatArray:
        """Return points of the plane [m], shape (n, 2), with these coordinates."""

    def chunk(self) -> int:
        """Return how many cells to look at in one go."""
        return CHUNK

    def inside(self, coordinates: FloatArray) -> FloatArray:
        """Return the coordinates, moved into the region where it has a border."""
        return coordinates


def spread(count: int, dimensions: int) -> FloatArray:
    """Return points (n, d) spread evenly over the unit cube (Roberts' generalised golden ratio)."""
    ratio = 2.0
    for _ in range(64):
        ratio = (1.0 + ratio) ** (1.0 / (dimensions + 1))
    steps = ratio ** -np.arange(1.0, dimensions + 1.0)
    return np.asarray((0.5 + np.arange(1, count + 1)[:, None] * steps) % 1.0)

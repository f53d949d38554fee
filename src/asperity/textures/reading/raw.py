"""A surface as its file gives it, before any preparation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MAX_POINTS = 2**27
"""Most points that a surface may have: 1 GiB of heights."""


@dataclass(frozen=True, eq=False)
class RawSurface:
    """Heights as a file gives them, in metres.

    Row i, column j lies at y = i * pitch[1], x = j * pitch[0].

    Attributes:
        heights: [m], shape (ny, nx) for a map, (n,) for a profile; NaN is a missing point.
        pitch: distance of neighbouring points [m], (px, py) or (px,) for a profile;
            None where the file has none (NPY, text matrix).
        source: name of the file.
        notes: what was assumed or is odd about the file, one sentence each.
        has_units: True where the file says that its heights are lengths;
            False where metres were assumed.

    Example:
        >>> flat = RawSurface(np.zeros((4, 5)), (1e-6, 1e-6), "flat.npy", ())
        >>> flat.heights.shape, flat.is_profile
        ((4, 5), False)
    """

    heights: NDArray[np.float64]
    pitch: tuple[float, ...] | None
    source: str
    notes: tuple[str, ...]
    has_units: bool = True

    @property
    def is_profile(self) -> bool:
        """True for a profile h(x), False for a map h(x, y)."""
        return self.heights.ndim == 1

"""A surface as its file gives it, before any preparation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from asperity.errors import ParameterError

MAX_POINTS = 2**27
"""Most points that a surface may have: 1 GiB of heights."""


@dataclass(frozen=True, eq=False)
class RawSurface:
    """Heights as a file gives them, in metres unless the file has no unit of length.

    Row i, column j lies at y = i * pitch[1], x = j * pitch[0].

    Attributes:
        heights: [m], shape (ny, nx) for a map, (n,) for a profile; NaN is a missing point.
        pitch: distance of neighbouring points [m], (px, py) or (px,) for a profile;
            None where the file has none (NPY, text matrix, image).
        source: name of the file.
        notes: what was assumed or is odd about the file, one sentence each.
        has_units: True where the file says that its heights are lengths;
            False where metres were assumed, which ``read_surface`` notes.
        relative: True where the heights are no lengths at all (an image's pixel values):
            they become lengths only by a height range.
        per_pitch: True where the heights are multiples of the pitch (an integrated normal
            map, whose slopes have no unit): ``in_metres`` makes lengths of them. Such a surface
            is ``relative`` until then.

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
    relative: bool = False
    per_pitch: bool = False

    @property
    def is_profile(self) -> bool:
        """True for a profile h(x), False for a map h(x, y)."""
        return self.heights.ndim == 1

    def in_metres(self, pitch: float | Sequence[float] | None) -> RawSurface:
        """Return the surface with heights that are multiples of the pitch made lengths.

        Any other surface, and any surface while the pitch is not known, is returned as it is.

        Args:
            pitch: distance of the points [m] as the user gave it, or None.

        Raises:
            ParameterError: different pitches along x and y, which give the slopes of a normal
                map no common unit; or a pitch that is not positive.

        Example:
            >>> slopes = RawSurface(np.eye(4), None, "n.png", (), relative=True, per_pitch=True)
            >>> metres = slopes.in_metres(2e-5)
            >>> float(metres.heights.max()), metres.relative
            (2e-05, False)
        """
        if not self.per_pitch or pitch is None:
            return self
        values = np.atleast_1d(np.asarray(pitch, dtype=np.float64))
        if values.size == 0 or not (np.isfinite(values).all() and np.all(values > 0)):
            raise ParameterError("pitch", "must be positive and finite [m]", pitch)
        if np.any(values != values[0]):
            raise ParameterError(
                "pitch", "must be the same along x and y for an integrated normal map [m]", pitch
            )
        return replace(
            self,
            heights=self.heights * float(values[0]),
            has_units=True,
            relative=False,
            per_pitch=False,
        )

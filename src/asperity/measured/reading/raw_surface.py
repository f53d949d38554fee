"""A surface as read from a file, before any preparation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.core.memory import require_memory

MAX_POINTS = 2**27
"""Maximum number of points of a surface: 1 GiB of heights."""


@dataclass(frozen=True, eq=False)
class RawSurface:
    """Heights read from a file, in metres unless the file has no unit of length.

    Row i, column j lies at y = i * pitch[1], x = j * pitch[0].

    Attributes:
        heights: [m], shape (ny, nx) for a map, (n,) for a profile; NaN is a missing point.
        pitch: distance of neighbouring points [m], (px, py) or (px,) for a profile;
            None if the file has none (NPY, text matrix, image).
        source: name of the file.
        notes: assumptions and peculiarities of the file, one sentence each.
        has_units: whether the unit of the heights is known; if not, metres are assumed, which
            ``read_surface`` notes.
        relative: whether the heights are not lengths (pixel values of an image): a height range
            converts them to lengths.
        per_pitch: whether the heights are multiples of the pitch (an integrated normal map,
            whose slopes have no unit): ``in_metres`` converts them to lengths. Such a surface
            is ``relative`` until then.

    Example:
        >>> flat = RawSurface(np.zeros((4, 5)), (1e-6, 1e-6), "flat.npy", ())
        >>> flat.heights.shape, flat.is_profile
        ((4, 5), False)
    """

    heights: FloatArray
    pitch: tuple[float, ...] | None
    source: str
    notes: tuple[str, ...]
    has_units: bool = True
    relative: bool = False
    per_pitch: bool = False

    @property
    def is_profile(self) -> bool:
        """Whether the surface is a profile h(x) rather than a map h(x, y)."""
        return self.heights.ndim == 1

    def in_metres(self, pitch: float | Sequence[float] | None) -> RawSurface:
        """Return the surface with heights that are multiples of the pitch converted to lengths.

        Any other surface, and any surface without a pitch, is returned unchanged.

        Args:
            pitch: distance of the points [m] given by the user, or None.

        Raises:
            ParameterError: the pitches along x and y differ, so that the slopes of a normal map
                have no common unit; or a pitch is not positive.

        Example:
            >>> slopes = RawSurface(np.eye(4), None, "n.to_png", (), relative=True, per_pitch=True)
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
            requirement = "must be the same along x and y for an integrated normal map [m]"
            raise ParameterError("pitch", requirement, pitch)
        heights = self.heights * float(values[0])
        return replace(self, heights=heights, has_units=True, relative=False, per_pitch=False)


def check_point_count(*counts: int) -> None:
    """Refuse a grid that is too large, before any memory is allocated.

    Args:
        counts: number of points along x, or along x and y.

    Raises:
        SurfaceFileError: there are too many points, or not enough memory for them.
    """
    if math.prod(counts) > MAX_POINTS:
        size = " x ".join(map(str, counts))
        raise SurfaceFileError(f"{size} points; at most {MAX_POINTS} are read")
    require_memory(*counts)


def mask_missing(values: NDArray[Any], code: float) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Return the values with NaN for each that equals the code of a missing point, and the note.

    Example:
        >>> mask_missing(np.array([1.0, -9999.0]), -9999.0)
        (array([ 1., nan]), ('1 points hold -9999, which marks a missing point',))
    """
    missing = values.astype(np.float64, copy=False) == code
    if not missing.any():
        return values, ()
    note = f"{int(missing.sum())} points hold {code:g}, which marks a missing point"
    return np.where(missing, np.nan, values), (note,)

"""Recognition of normal maps, which hold slopes rather than heights."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray

_LENGTH_TOLERANCE = 0.1  # deviation of a normal's length from 1: 8 bits, resampling, compression
_MIN_FRACTION = 0.95  # share of the pixels that must be unit normals
_MIN_MEAN_UPWARD = 0.5  # mean upward component: surfaces are rarely steeper than 60°


def is_normal_map(values: NDArray[Any]) -> bool:
    """Whether three channels are unit normals, 2 c / max - 1, that point up (blue).

    Args:
        values: pixels, shape (rows, columns, channels).

    Example:
        >>> flat = np.full((4, 4, 3), (128, 128, 255), dtype=np.uint8)
        >>> is_normal_map(flat), is_normal_map(flat[..., ::-1]), is_normal_map(flat[..., :1])
        (True, False, False)
    """
    if values.shape[-1] != 3 or values.dtype.kind not in "iuf":
        return False
    # A sample is enough: a normal map is one everywhere.
    step = max(1, int(np.sqrt(values[..., 0].size / 2**20)))
    normals = _decode_normals(values[::step, ::step])
    with np.errstate(over="ignore", invalid="ignore"):
        length = np.sqrt(np.sum(normals**2, axis=-1))
        unit = np.abs(length - 1.0) < _LENGTH_TOLERANCE
    upward = normals[..., 2] > 0.0
    blue = float(np.mean(np.where(unit, normals[..., 2], 0.0))) > _MIN_MEAN_UPWARD
    return bool(np.mean(unit & upward) >= _MIN_FRACTION) and blue


def _decode_normals(values: NDArray[Any]) -> FloatArray:
    """Return the normals; integers span -1 to 1, floats do so or span 0 to 1."""
    if values.dtype.kind == "f":
        with np.errstate(invalid="ignore", over="ignore"):
            normals = values.astype(np.float64)
            signed = np.nanmin(normals, initial=0.0) < 0.0
            return normals if signed else 2.0 * normals - 1.0
    limits = np.iinfo(values.dtype)
    return (values.astype(np.float64) - limits.min) * (2.0 / (limits.max - limits.min)) - 1.0

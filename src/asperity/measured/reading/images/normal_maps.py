"""Normal maps: recognise them, and integrate their slopes to heights."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import SurfaceFileError

_LENGTH_TOLERANCE = 0.1  # deviation of a normal's length from 1: 8 bits, resampling, compression
_MIN_FRACTION = 0.95  # share of the pixels that must be unit normals
_MIN_MEAN_UPWARD = 0.5  # mean upward component: surfaces are rarely steeper than 60°
_MAX_COMPONENT = 4.0  # a larger component is no normal, even after lossy compression
_MAX_SLOPE = 20.0  # normals nearer to the horizon do not define a height


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


def integrate_normal_map(values: NDArray[Any]) -> tuple[FloatArray, tuple[str, ...]]:
    """Integrate the slopes of a normal map by least squares, with a mirrored border.

    The heights minimise the squared mismatch between the difference of neighbouring heights and
    the integral of the slope between them (fourth order in the pixel); the normal equations
    are a Poisson equation that the cosine transform solves exactly. The green channel points up
    (OpenGL) or down (Direct3D) the image, depending on the program: the better fit decides.

    Args:
        values: pixels, shape (rows, columns, 3).

    Returns:
        Heights in units of the pixel pitch, mean 0, and notes with the error of integration.

    Raises:
        SurfaceFileError: too small, or not finite.

    Reference:
        Frankot and Chellappa, A method for enforcing integrability in shape from shading
        algorithms, 1988; here with differences instead of derivatives of a Fourier series.
    """
    if min(values.shape[:2]) < 4:
        raise SurfaceFileError("a normal map of less than 4 x 4 pixels cannot be integrated")
    normals = _decode_normals(values)
    wrong = ~(np.abs(normals) < _MAX_COMPONENT)  # NaN too
    if wrong.any():
        count = int(wrong.any(axis=-1).sum())
        raise SurfaceFileError(f"the normal map has {count} pixels that are no normals")
    # The slope at the horizon is infinite: it is bounded, with a note.
    up = np.maximum(normals[..., 2], 1.0 / _MAX_SLOPE)
    bounded = int(np.count_nonzero(normals[..., 2] < 1.0 / _MAX_SLOPE))
    along_x = _integrate_steps(-normals[..., 0] / up, axis=1)
    along_y = _integrate_steps(normals[..., 1] / up, axis=0)
    kinds = {"up (OpenGL)": along_y, "down (Direct3D)": -along_y}
    # RMS height gained along the square of one pixel: 0 for slopes of a surface.
    change = np.diff(along_x, axis=0)
    fits = {kind: _rms(change - np.diff(y, axis=1)) for kind, y in kinds.items()}
    kind = min(fits, key=lambda k: fits[k])
    heights = _solve_poisson(along_x, kinds[kind])
    notes = [
        _describe_mismatch(heights, along_x, kinds[kind]),
        f"green channel read as pointing {kind}, which fits {_describe_preference(fits)}",
    ]
    if bounded:
        notes.append(f"{bounded} normals near or below the horizon: slope set to {_MAX_SLOPE:g}")
    return heights, tuple(notes)


def _describe_mismatch(heights: FloatArray, along_x: FloatArray, along_y: FloatArray) -> str:
    """Return the integration error: the part of the slopes that no heights can have."""
    mismatch = _rms(np.diff(heights, axis=1) - along_x, np.diff(heights, axis=0) - along_y)
    total = _rms(along_x, along_y)
    share = f" ({mismatch / total:.3g} of their RMS {total:.3g})" if total > 0 else ""
    return (
        "normal map integrated by least squares with a mirrored border: heights are multiples"
        f" of the pixel pitch; RMS mismatch of the slopes {mismatch:.3g}{share}"
    )


def _describe_preference(fits: dict[str, float]) -> str:
    low, high = sorted(fits.values())
    if high <= low * 1.1:
        return "as well as the other direction: check which one your program writes"
    return f"better (curl {low:.2g} against {high:.2g})"


def _decode_normals(values: NDArray[Any]) -> FloatArray:
    """Return the normals; integers span -1 to 1, floats do so or span 0 to 1."""
    if values.dtype.kind == "f":
        with np.errstate(invalid="ignore", over="ignore"):
            normals = values.astype(np.float64)
            signed = np.nanmin(normals, initial=0.0) < 0.0
            return normals if signed else 2.0 * normals - 1.0
    limits = np.iinfo(values.dtype)
    return (values.astype(np.float64) - limits.min) * (2.0 / (limits.max - limits.min)) - 1.0


def _integrate_steps(slope: FloatArray, axis: int) -> FloatArray:
    """Integrate a slope from each pixel to the next: exact for cubic slopes."""
    inner = np.moveaxis(slope, axis, 0)
    before, after = 2 * inner[:1] - inner[1:2], 2 * inner[-1:] - inner[-2:-1]
    wide = np.concatenate((before, inner, after))
    steps = (13.0 * (wide[1:-2] + wide[2:-1]) - wide[:-3] - wide[3:]) / 24.0
    return np.moveaxis(steps, 0, axis)


def _rms(*parts: FloatArray) -> float:
    count = sum(part.size for part in parts)
    return float(np.sqrt(sum(float(np.sum(part**2)) for part in parts) / count))


def _solve_poisson(along_x: FloatArray, along_y: FloatArray) -> FloatArray:
    """Solve the normal equations of h[j + 1] - h[j] = step, one-sided at the border."""
    from scipy.fft import dctn, idctn

    rows, columns = along_x.shape[0], along_y.shape[1]
    # Minus the divergence of the steps; border pixels have a step on one side only.
    right = -np.diff(along_x, axis=1, prepend=0.0, append=0.0)
    right -= np.diff(along_y, axis=0, prepend=0.0, append=0.0)
    spectrum = dctn(right, type=2)
    eigen_x = 2.0 - 2.0 * np.cos(np.pi * np.arange(columns) / columns)
    eigen_y = 2.0 - 2.0 * np.cos(np.pi * np.arange(rows) / rows)
    eigen = eigen_y[:, None] + eigen_x
    eigen[0, 0] = 1.0
    spectrum[0, 0] = 0.0  # the mean height, which slopes do not determine
    spectrum /= eigen
    return np.asarray(idctn(spectrum, type=2, overwrite_x=True))

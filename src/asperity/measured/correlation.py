"""How far a map looks like itself: autocorrelation length and texture aspect ratio."""

from __future__ import annotations

import math

import numpy as np

from asperity.checks import FloatArray

LEVEL = 0.2
"""What the autocorrelation falls to at the length (the default of ISO 25178-2)."""

MOST_POINTS = 2**22
"""Of a map whose autocorrelation is computed: it takes some twenty times their memory."""

_DIRECTIONS = 180


def correlation(
    heights: FloatArray, pitch: tuple[float, float]
) -> tuple[float | None, float | None]:
    """Return the autocorrelation length Sal [m] and the texture aspect ratio Str [1] of a map.

    f(t) = ⟨z(r) z(r + t)⟩ / ⟨z²⟩, the mean over all pairs of measured points at that distance. Sal
    is the least distance at which f has fallen to 0.2, over all directions, Str its ratio to the
    greatest: near 1 for a surface that looks alike along all directions, near 0 for one with a lay.

    f is computed by the Fourier transform up to half of each side, and read along a direction for
    each degree by bilinear interpolation, every half pitch.

    Args:
        heights: [m], shape (ny, nx); NaN where missing.
        pitch: (px, py) [m].

    Returns:
        Sal, None if f falls to 0.2 along no direction within half of the map; Str, None if it does
        not along each; both None for a flat map or one of more than MOST_POINTS.

    Reference:
        ISO 25178-2:2021, 4.3.2 and 4.3.3.

    Example:
        >>> x, y = np.meshgrid(np.arange(200), np.arange(200))
        >>> wave = np.cos(2 * np.pi * x / 40) * np.cos(2 * np.pi * y / 80)
        >>> [round(value, 2) for value in correlation(wave, (1.0, 1.0))]
        [8.5, 0.51]
    """
    if heights.size > MOST_POINTS or np.nanmax(heights) == np.nanmin(heights):
        return None, None
    distances = _distances(_autocorrelation(heights), heights.shape, pitch)
    found = [distance for distance in distances if distance is not None]
    shortest = min(found, default=None)
    if shortest is None or len(found) < len(distances):
        return shortest, None
    return shortest, shortest / max(found)


def _autocorrelation(heights: FloatArray) -> FloatArray:
    """Return f at the distances up to half of the map, wrapped as by a Fourier transform."""
    from scipy.fft import irfft2, next_fast_len, rfft2

    known = ~np.isnan(heights)
    z = np.where(known, heights - np.nanmean(heights), 0.0)
    # So many zeros that no distance up to half of the map meets itself around the border.
    shape = tuple(next_fast_len(n + n // 2 + 1, real=True) for n in heights.shape)
    products, pairs = (
        irfft2(np.abs(rfft2(part, shape)) ** 2, shape) for part in (z, known.astype(np.float64))
    )
    products /= np.maximum(pairs, 0.5)  # none, but for rounding, where no two points are so far
    return np.asarray(products / products[0, 0])


def _distances(
    f: FloatArray, shape: tuple[int, ...], pitch: tuple[float, float]
) -> list[float | None]:
    """Return the distance [m] at which f falls to the level, along each direction."""
    from scipy.ndimage import map_coordinates

    half = [(n // 2) * p for n, p in zip(shape[::-1], pitch, strict=True)]
    step = 0.5 * min(pitch)
    found: list[float | None] = []
    for angle in np.arange(_DIRECTIONS) * math.pi / _DIRECTIONS:
        way = math.cos(angle), math.sin(angle)
        far = min(side / max(abs(part), 1e-12) for side, part in zip(half, way, strict=True))
        along = np.arange(0.0, far + 0.5 * step, step)
        places = [along * way[1] / pitch[1], along * way[0] / pitch[0]]
        values = map_coordinates(f, places, order=1, mode="grid-wrap")
        low = int(np.argmax(values < LEVEL))
        if values[low] >= LEVEL:
            found.append(None)
            continue
        share = (values[low - 1] - LEVEL) / (values[low - 1] - values[low])
        found.append(float(along[low - 1] + share * step))
    return found

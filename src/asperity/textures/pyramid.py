"""Pyramids of certified bounds over the cells of a spline, for the search of nearest points.

A box of the finest level has one cell of a profile, or two by two of a map; each further level
has boxes of twice the side. A box knows five numbers, rounded outward to single precision: a lower
and an upper bound of the height [m], a bound of the second derivatives times the pitch [1], a bound
of the third derivatives times the pitch squared [1], and one of the second derivatives times the
pitch where they bend the surface like a crest: of the greatest eigenvalue of -Hess h, at least 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray

# Cells of a map that are worked on together: so many fit the caches.
_ROWS, _COLUMNS = 128, 512
# Room for rounding: of a few operations in single precision, of what they work on.
_ROOM = 1e-6

# Of a box.
NUMBERS = 5

Single = NDArray[np.float32]
Pyramid = tuple[Single, NDArray[np.int64]]
# Bernstein coefficients, and how many neighbours along each axis belong to a box.
Part = tuple[Single, tuple[int, ...]]


def line_pyramid(c: FloatArray, pitch: float) -> Pyramid:
    """Return the pyramid of a profile.

    Args:
        c: B-spline coefficients [m], shape (n + 3,).
        pitch: of the nodes [m].

    Returns:
        The boxes of all levels, shape (boxes, 5), and for each level, from the finest on, the
        number of its first box and its number of boxes, shape (levels, 2).
    """
    middle, spread = _range(c)
    second = _largest(np.diff(c, 2), (1,), 1)
    third = _largest(np.diff(c, 3), (0,), 1)
    dent = _falling(np.diff(c, 2), (1,), 1)
    low, high = _extent(c - middle, (3,), 1, spread)
    return _levels(_outward(middle, [low, high, second / pitch, third / pitch, dent / pitch]))


def plane_pyramid(c: FloatArray, pitch: tuple[float, float]) -> Pyramid:
    """Return the pyramid of a map.

    Args:
        c: B-spline coefficients [m], shape (ny + 3, nx + 3).
        pitch: p_x, p_y [m]; the pitch in the bounds of derivatives is p_x.

    Returns:
        The boxes of all levels, shape (boxes, 5), and for each level, from the finest on, the
        number of its first box and its numbers of rows and columns, shape (levels, 3).
    """
    middle, spread = _range(c)
    rows = []
    for i in range(0, c.shape[0] - 3, _ROWS):
        tiles = []
        for j in range(0, c.shape[1] - 3, _COLUMNS):
            tile = c[i : i + _ROWS + 3, j : j + _COLUMNS + 3] - middle
            # An odd last cell gets a straight neighbour.
            odd = [(0, (size - 3) % 2) for size in tile.shape]
            tile = np.pad(tile, odd, mode="reflect", reflect_type="odd")
            tiles.append(_outward(middle, _plane_bounds(tile, pitch, spread)))
        rows.append(np.concatenate(tiles, axis=1))
    return _levels(np.concatenate(rows))


def _plane_bounds(c: FloatArray, pitch: tuple[float, float], spread: float) -> list[FloatArray]:
    """Return the five bounds of every two by two cells, the lower one negated."""
    xx, yy, xy = np.diff(c, 2, axis=1), np.diff(c, 2, axis=0), np.diff(np.diff(c, axis=0), axis=1)
    aspect = pitch[0] / pitch[1]
    fxx, fyy = _largest(xx, (3, 1), 2), aspect**2 * _largest(yy, (1, 3), 2)
    fxy = aspect * _largest(xy, (2, 2), 2)
    bend = np.minimum(np.maximum(fxx, fyy) + fxy, np.sqrt(fxx**2 + 2.0 * fxy**2 + fyy**2))
    # ‖D³h‖ is at most the root of the sum of the squares of all eight derivatives.
    twist = _largest(np.diff(xx, axis=1), (3, 0), 2) ** 2
    twist += 3.0 * (aspect * _largest(np.diff(xx, axis=0), (2, 1), 2)) ** 2
    twist += 3.0 * (aspect**2 * _largest(np.diff(yy, axis=1), (1, 2), 2)) ** 2
    twist += (aspect**3 * _largest(np.diff(yy, axis=0), (0, 3), 2)) ** 2
    # Gershgorin's discs of -Hess h.
    dent = np.maximum(_falling(xx, (3, 1), 2), aspect**2 * _falling(yy, (1, 3), 2)) + fxy
    low, high = _extent(c, (3, 3), 2, spread)
    return [
        low,
        high,
        bend / pitch[0],
        np.sqrt(twist) / pitch[0],
        np.minimum(dent, bend) / pitch[0],
    ]


def _range(c: FloatArray) -> tuple[float, float]:
    """Return the middle of the values and how far they are from it."""
    low, high = float(c.min()), float(c.max())
    middle = 0.5 * (low + high)
    return middle, max(high - middle, middle - low)


def _largest(c: FloatArray, degrees: tuple[int, ...], cells: int) -> FloatArray:
    """Return bounds of the absolute value of a spline over boxes of so many cells a side.

    Args:
        c: B-spline coefficients.
        degrees: of the spline along each axis.
        cells: how many cells make a box.
    """
    single = c.astype(np.float32)
    parts = _bernstein(single, degrees, cells)
    found = _greatest([(np.abs(part), widths) for part, widths in parts], cells)
    return found + _ROOM * float(np.abs(single).max())


def _falling(c: FloatArray, degrees: tuple[int, ...], cells: int) -> FloatArray:
    """Return the greatest value of a negated spline over boxes of so many cells a side, or 0."""
    single = c.astype(np.float32)
    found = _greatest(
        [(-part, widths) for part, widths in _bernstein(single, degrees, cells)], cells
    )
    return np.maximum(found, 0.0) + _ROOM * float(np.abs(single).max())


def _extent(
    c: FloatArray, degrees: tuple[int, ...], cells: int, spread: float
) -> tuple[FloatArray, FloatArray]:
    """Return the lower bounds of a spline over boxes, negated, and the upper ones."""
    parts = _bernstein(c.astype(np.float32), degrees, cells)
    below = _greatest([(-part, widths) for part, widths in parts], cells)
    return below + _ROOM * spread, _greatest(parts, cells) + _ROOM * spread


def _bernstein(c: Single, degrees: tuple[int, ...], cells: int) -> list[Part]:
    """Return the Bernstein coefficients of a spline: in their hull it lies, cell by cell.

    A cell has those of its two nodes along an axis, shared with its neighbours, and inner ones.
    """
    parts: list[Part] = [(c, ())]
    for axis, degree in enumerate(degrees):
        parts = [
            (np.moveaxis(values, 0, axis), (*widths, cells + shared))
            for part, widths in parts
            for values, shared in _along(np.moveaxis(part, axis, 0), degree)
        ]
    return parts


def _along(c: Single, degree: int) -> list[tuple[Single, int]]:
    """Return Bernstein coefficients along the first axis, and 1 for those of nodes, else 0."""
    if degree == 3:
        third = (c[2:-1] - c[1:-2]) * np.float32(1.0 / 3.0)
        node = (c[:-2] + c[2:] + np.float32(4.0) * c[1:-1]) * np.float32(1.0 / 6.0)
        return [(node, 1), (c[1:-2] + third, 0), (c[2:-1] - third, 0)]
    if degree == 2:
        return [(np.float32(0.5) * (c[:-1] + c[1:]), 1), (c[1:-1], 0)]
    return [(c, degree)]


def _greatest(parts: list[Part], step: int) -> FloatArray:
    """Return the greatest of the neighbours in every box, over all parts."""
    result: Single | None = None
    for values, widths in parts:
        boxes = values
        for axis, width in enumerate(widths):
            boxes = _windows(boxes, axis, width, step)
        result = boxes if result is None else np.maximum(result, boxes, out=result)
    assert result is not None
    return result.astype(np.float64)


def _windows(values: Single, axis: int, width: int, step: int) -> Single:
    """Return the greatest of every ``width`` neighbours along an axis, at every ``step``-th."""
    values = np.moveaxis(values, axis, 0)
    count = (len(values) - width) // step + 1
    result = values[: step * count : step].copy()
    for shift in range(1, width):
        np.maximum(result, values[shift : shift + step * count : step][:count], out=result)
    return np.moveaxis(result, 0, axis)


def _outward(middle: float, bounds: list[FloatArray]) -> Single:
    """Return the bounds in single precision, rounded up; heights from zero on, not the middle."""
    low, high, *derivatives = bounds
    together = np.stack([low - middle, high + middle, *derivatives], axis=-1)
    return np.nextafter(together.astype(np.float32), np.float32(np.inf))


def _levels(finest: Single) -> Pyramid:
    """Return all levels, each the greatest of two (by two) boxes of the one before."""
    level, shape = finest, finest.shape[:-1]
    parts, starts = [finest.reshape(-1, NUMBERS)], [(0, *shape)]
    while max(shape) > 1:
        for axis in range(len(shape)):
            odd = [(0, 0)] * level.ndim
            odd[axis] = (0, level.shape[axis] % 2)
            level = _pairs(np.pad(level, odd, mode="edge"), axis)
        shape = level.shape[:-1]
        starts.append((starts[-1][0] + len(parts[-1]), *shape))
        parts.append(level.reshape(-1, NUMBERS))
    boxes = np.concatenate(parts)
    boxes[:, 0] *= -1.0
    return np.ascontiguousarray(boxes), np.array(starts, dtype=np.int64)


def _pairs(level: Single, axis: int) -> Single:
    """Return the greater of every two neighbours along an axis."""
    values = np.moveaxis(level, axis, 0)
    return np.ascontiguousarray(np.moveaxis(np.maximum(values[::2], values[1::2]), 0, axis))

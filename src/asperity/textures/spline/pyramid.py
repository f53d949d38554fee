"""Pyramids of certified bounds over the cells of a spline, and lattices, for closest points.

A box of the finest level has one cell of a profile, or two by two cells of a map; each further
level has boxes of twice the side. A box has five numbers, rounded outward to single precision: a
lower and an upper bound of the height [m], a bound of the second derivatives times the pitch [1], a
bound of the third derivatives times the squared pitch [1], and a bound of the greatest eigenvalue
of -Hess h times the pitch, at least 0, which is the curvature of crests.

A lattice, from which most closest points are found, stands beside it; see ``lattice_search``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.processes import run_in_threads
from asperity.textures.spline import lattice_search
from asperity.textures.spline.bspline_kernels import SplineArguments
from asperity.textures.spline.lattice_search import LatticeArguments
from asperity.textures.texture import Texture

# Cells of a map that are processed together, so that they fit the processor caches.
_TILE_ROWS = 128
_TILE_COLUMNS = 512
# Relative rounding error of a few operations in single precision.
_ROUNDING_ALLOWANCE = 1e-6

BOUNDS_PER_BOX = 5

Float32Array = NDArray[np.float32]
Pyramid = tuple[Float32Array, NDArray[np.int64]]
# Bernstein coefficients, and the number of neighbours along each axis that belong to a box.
BernsteinPart = tuple[Float32Array, tuple[int, ...]]


def line_pyramid(c: FloatArray, pitch: float) -> Pyramid:
    """Return the pyramid of a profile, as of a map with one row of boxes.

    Args:
        c: B-spline coefficients [m], shape (n + 3,).
        pitch: of the nodes [m].

    Returns:
        See :func:`plane_pyramid`.
    """
    middle, spread = _midrange(c)
    # An odd last cell gets a neighbour by odd reflection.
    c = np.pad(c - middle, (0, (len(c) - 3) % 2), mode="reflect", reflect_type="odd")
    second = _upper_bounds(np.abs, np.diff(c, 2), (1,), 2)
    third = _upper_bounds(np.abs, np.diff(c, 3), (0,), 2)
    crest = _upper_bounds(np.negative, np.diff(c, 2), (1,), 2)
    low, high = _height_bounds(c, (3,), 2, spread)
    bounds = [low, high, second / pitch, third / pitch, crest / pitch]
    boxes, levels = _build_levels(_round_outward(middle, bounds))
    return boxes, np.insert(levels, 1, 1, axis=1)


def plane_pyramid(c: FloatArray, pitch: tuple[float, float]) -> Pyramid:
    """Return the pyramid of a map.

    Args:
        c: B-spline coefficients [m], shape (ny + 3, nx + 3).
        pitch: p_x, p_y [m]; the pitch in the bounds of derivatives is p_x.

    Returns:
        The boxes of all levels, shape (boxes, 5), and for each level, from the finest on, the
        index of its first box and its numbers of rows and columns, shape (levels, 3).
    """
    middle, spread = _midrange(c)
    rows = []
    for i in range(0, c.shape[0] - 3, _TILE_ROWS):
        tiles = []
        for j in range(0, c.shape[1] - 3, _TILE_COLUMNS):
            tile = c[i : i + _TILE_ROWS + 3, j : j + _TILE_COLUMNS + 3] - middle
            # An odd last cell gets a neighbour by odd reflection.
            odd = [(0, (size - 3) % 2) for size in tile.shape]
            tile = np.pad(tile, odd, mode="reflect", reflect_type="odd")
            tiles.append(_round_outward(middle, _plane_bounds(tile, pitch, spread)))
        rows.append(np.concatenate(tiles, axis=1))
    return _build_levels(np.concatenate(rows))


def _plane_bounds(c: FloatArray, pitch: tuple[float, float], spread: float) -> list[FloatArray]:
    """Return the five bounds of every two by two cells, the lower one negated."""
    xx = np.diff(c, 2, axis=1)
    yy = np.diff(c, 2, axis=0)
    xy = np.diff(np.diff(c, axis=0), axis=1)
    aspect = pitch[0] / pitch[1]
    fxx = _upper_bounds(np.abs, xx, (3, 1), 2)
    fyy = aspect**2 * _upper_bounds(np.abs, yy, (1, 3), 2)
    fxy = aspect * _upper_bounds(np.abs, xy, (2, 2), 2)
    second = np.minimum(np.maximum(fxx, fyy) + fxy, np.sqrt(fxx**2 + 2.0 * fxy**2 + fyy**2))
    # ‖D³h‖ is at most the root of the sum of the squares of all eight derivatives.
    third = _upper_bounds(np.abs, np.diff(xx, axis=1), (3, 0), 2) ** 2
    third += 3.0 * (aspect * _upper_bounds(np.abs, np.diff(xx, axis=0), (2, 1), 2)) ** 2
    third += 3.0 * (aspect**2 * _upper_bounds(np.abs, np.diff(yy, axis=1), (1, 2), 2)) ** 2
    third += (aspect**3 * _upper_bounds(np.abs, np.diff(yy, axis=0), (0, 3), 2)) ** 2
    # Gershgorin's discs of -Hess h.
    crest_x = _upper_bounds(np.negative, xx, (3, 1), 2)
    crest_y = aspect**2 * _upper_bounds(np.negative, yy, (1, 3), 2)
    crest = np.maximum(crest_x, crest_y) + fxy
    low, high = _height_bounds(c, (3, 3), 2, spread)
    derivatives = second, np.sqrt(third), np.minimum(crest, second)
    return [low, high, *(bound / pitch[0] for bound in derivatives)]


def _midrange(c: FloatArray) -> tuple[float, float]:
    """Return the middle of the range of the values and half of the range."""
    low = float(c.min())
    high = float(c.max())
    middle = 0.5 * (low + high)
    return middle, max(high - middle, middle - low)


def _upper_bounds(
    function: np.ufunc, c: FloatArray, degrees: tuple[int, ...], cells: int
) -> FloatArray:
    """Return upper bounds, at least 0, of the absolute or the negated value of a spline over boxes.

    Args:
        function: ``np.abs`` or ``np.negative``.
        c: B-spline coefficients.
        degrees: degrees of the spline along each axis.
        cells: cells along the side of a box.
    """
    single = c.astype(np.float32)
    greatest = _max_over_boxes(function, _bernstein_coefficients(single, degrees, cells), cells)
    return np.maximum(greatest, 0.0) + _ROUNDING_ALLOWANCE * float(np.abs(single).max())


def _height_bounds(
    c: FloatArray, degrees: tuple[int, ...], cells: int, spread: float
) -> tuple[FloatArray, FloatArray]:
    """Return the lower bounds of a spline over boxes, negated, and the upper ones."""
    parts = _bernstein_coefficients(c.astype(np.float32), degrees, cells)
    allowance = _ROUNDING_ALLOWANCE * spread
    low, high = (_max_over_boxes(sign, parts, cells) for sign in (np.negative, np.positive))
    return low + allowance, high + allowance


def _bernstein_coefficients(
    c: Float32Array, degrees: tuple[int, ...], cells: int
) -> list[BernsteinPart]:
    """Return the Bernstein coefficients of a spline, whose hull contains it, cell by cell.

    Along an axis a cell has coefficients at its two nodes, shared with its neighbours, and inner
    ones.
    """
    parts: list[BernsteinPart] = [(c, ())]
    for axis, degree in enumerate(degrees):
        parts = [
            (np.moveaxis(values, 0, axis), (*widths, cells + shared))
            for part, widths in parts
            for values, shared in _bernstein_along_axis(np.moveaxis(part, axis, 0), degree)
        ]
    return parts


def _bernstein_along_axis(c: Float32Array, degree: int) -> list[tuple[Float32Array, int]]:
    """Return Bernstein coefficients along the first axis, with 1 for those at nodes, else 0."""
    if degree == 3:
        third = (c[2:-1] - c[1:-2]) * np.float32(1.0 / 3.0)
        node = (c[:-2] + c[2:] + np.float32(4.0) * c[1:-1]) * np.float32(1.0 / 6.0)
        return [(node, 1), (c[1:-2] + third, 0), (c[2:-1] - third, 0)]
    if degree == 2:
        return [(np.float32(0.5) * (c[:-1] + c[1:]), 1), (c[1:-1], 0)]
    return [(c, degree)]


def _max_over_boxes(function: np.ufunc, parts: list[BernsteinPart], step: int) -> FloatArray:
    """Return the maximum of a function over each box and over all parts."""
    greatest = []
    for values, widths in parts:
        boxes = function(values)
        for axis, width in enumerate(widths):
            boxes = _window_max(boxes, axis, width, step)
        greatest.append(boxes)
    return np.asarray(np.max(greatest, axis=0), dtype=np.float64)


def _window_max(values: Float32Array, axis: int, width: int, step: int) -> Float32Array:
    """Return the maximum of ``width`` neighbours along an axis, at every ``step``-th value."""
    values = np.moveaxis(values, axis, 0)
    count = (len(values) - width) // step + 1
    result = values[: step * count : step].copy()
    for shift in range(1, width):
        np.maximum(result, values[shift : shift + step * count : step][:count], out=result)
    return np.moveaxis(result, 0, axis)


def _round_outward(middle: float, bounds: list[FloatArray]) -> Float32Array:
    """Return the bounds in single precision, rounded up, with the middle added to the heights."""
    low, high, *derivatives = bounds
    together = np.stack([low - middle, high + middle, *derivatives], axis=-1)
    return np.nextafter(together.astype(np.float32), np.float32(np.inf))


def _build_levels(finest: Float32Array) -> Pyramid:
    """Return all levels; each box is the maximum of two (by two) boxes of the finer level."""
    level = finest
    shape = finest.shape[:-1]
    parts = [finest.reshape(-1, BOUNDS_PER_BOX)]
    starts = [(0, *shape)]
    while max(shape) > 1:
        for axis in range(len(shape)):
            odd = [(0, 0)] * level.ndim
            odd[axis] = (0, level.shape[axis] % 2)
            level = _window_max(np.pad(level, odd, mode="edge"), axis, 2, 2)
        shape = level.shape[:-1]
        starts.append((starts[-1][0] + len(parts[-1]), *shape))
        parts.append(level.reshape(-1, BOUNDS_PER_BOX))
    boxes = np.concatenate(parts)
    boxes[:, 0] *= -1.0
    return np.ascontiguousarray(boxes), np.array(starts, dtype=np.int64)


# Least number of places beyond the borders of the texture.
_LEAST_PADDING = 5
# Nodes of the lattice per node of the spline, at least, and the most from one place to the next.
_NODES_PER_PITCH = 2.0
_MAX_STRIDE = 4


def build_lattice(
    spline: Texture, pitches: Sequence[float], spacing: Sequence[float], z: FloatArray
) -> LatticeArguments:
    """Return the record of a spline with a lattice.

    Args:
        spline: the texture.
        pitches: distance of its nodes along each axis [m].
        spacing: greatest distance of the places along each axis [m].
        z: of the levels, rising [m].
    """
    low, top = spline.extremes
    lengths = np.hypot(*spline.domain.spans.T)
    counts = np.ceil(lengths / spacing)
    nodes = _NODES_PER_PITCH * lengths / (counts * pitches)
    stride = min(math.ceil(float(nodes.max())), _MAX_STRIDE)
    sides = lengths / (stride * counts)
    # A point farther away than one above the lowest level is not the closest; nor is one much
    # farther away than the deepest place, where the texture repeats.
    reach = min(math.sqrt((top - low) * (top + low - 2.0 * z[0])), lengths.max() / len(lengths))
    reach = max(reach, top - low)
    x, *others = [
        _axis_nodes(start, side, int(count), stride, reach)
        for start, side, count in zip(spline.domain.origin, sides, counts, strict=False)
    ]
    y = others[0] if others else spline.domain.origin[1:]
    points = np.stack(np.meshgrid(x, y), axis=-1)
    heights = spline.height(points.reshape(-1, 2)).reshape(points.shape[:2])
    rows = (len(y) - 1) // stride + 1
    columns = (len(x) - 1) // stride + 1
    numbers = dict(zip(SplineArguments._fields, spline.arguments, strict=True))
    lattice = LatticeArguments(
        **numbers,
        heights=heights,
        nearest=np.empty((len(z), rows, columns), np.int32),
        first_x=float(x[0]),
        first_y=float(y[0]),
        z=z,
        stride=stride,
        side_x=float(sides[0]),
        side_y=float(sides[-1]),
    )
    _fill_levels(lattice)
    return lattice


def _axis_nodes(start: float, side: float, count: int, stride: int, reach: float) -> FloatArray:
    """Return the nodes along an axis [m]: those of the texture and as many places as it reaches."""
    padding = math.ceil(reach / (stride * side)) + _LEAST_PADDING
    nodes = np.arange(-padding * stride, (count + padding) * stride + 1)
    return np.asarray(start + side * nodes)


def _fill_levels(lattice: LatticeArguments) -> None:
    """Write the nearest nodes of each level, in threads."""
    from asperity.kernels.fuse import fuse_module

    loops = fuse_module(lattice_search)
    rows, columns = lattice.heights.shape
    longer = max(rows, columns)

    def fill(level: int) -> None:
        loops.nearest_nodes(
            lattice.heights,
            lattice.z[level],
            lattice.stride,
            lattice.side_x,
            lattice.side_y,
            np.empty((rows + 1, longer)),
            np.empty((rows, lattice.nearest.shape[2]), np.int32),
            np.empty(longer, np.int32),
            np.empty(longer + 1),
            lattice.nearest[level],
        )

    run_in_threads(fill, range(len(lattice.nearest)), None)

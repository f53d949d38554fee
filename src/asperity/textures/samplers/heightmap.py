"""h = Σ c_ij β(x/p_x - j) β(y/p_y - i), a bicubic B-spline."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.compiled import EPS, Kernels
from asperity.contacts.nearest.plane_search import descend, judge, next_box
from asperity.contacts.sampler import PASSED, SLACK
from asperity.contacts.sampler import PlanePoint as Point
from asperity.textures.samplers.spline import (
    Four,
    box_bounds,
    cell_at,
    dot4,
    foreseeable,
    nearest_copy,
    reach_of,
    saddle_margin,
    tile_frame,
    weights,
    weights_first,
    weights_second,
)

KERNELS = Kernels(
    provides=("cells_of", "curvature", "foot", "height", "search_plane", "slope"),
    requires=(
        "descend", "judge", "next_box",
        "box_bounds", "cell_at", "dot4", "foreseeable", "nearest_copy", "reach_of", "saddle_margin",
        "tile_frame", "weights", "weights_first", "weights_second",
    ),
    called=("foot", "search_tile", "search_tree"),
    shared=("search_plane",),
)  # fmt: skip


# Level of the widest boxes by which a square is judged in which φ is convex.
WIDEST = 5


class HeightMapArguments(NamedTuple):
    """What the functions below receive of a map.

    Attributes:
        c: coefficients [m], with one extra row and column before the first cell and two after the
            last.
        ix: nodes per metre along x.
        iy: along y.
        x0: the first node [m].
        y0: likewise.
        periodic: whether the map repeats.
        nodes: bounds of the boxes of the pyramid, see :mod:`asperity.textures.pyramid`.
        levels: where its levels begin in them.
    """

    c: FloatArray
    ix: float
    iy: float
    x0: float
    y0: float
    periodic: bool
    nodes: NDArray[np.float32]
    levels: NDArray[np.int64]


def cells_of(c: FloatArray) -> tuple[int, int]:
    """Return the number of cells along x and y."""
    return c.shape[1] - 3, c.shape[0] - 3


def row_of(c: FloatArray, i: int, j: int, w: Four) -> float:
    """Return the weighted sum of four coefficients of row i from column j on."""
    return dot4(w, (c[i, j], c[i, j + 1], c[i, j + 2], c[i, j + 3]))


def rows_of(c: FloatArray, i: int, j: int, w: Four) -> Four:
    """Return the weighted sums of four rows from i on."""
    return (
        row_of(c, i, j, w), row_of(c, i + 1, j, w), row_of(c, i + 2, j, w), row_of(c, i + 3, j, w),
    )  # fmt: skip


def height(x: float, y: float, texture: HeightMapArguments) -> float:
    """Return h [m]."""
    nx, ny = cells_of(texture.c)
    j, t, _sx = cell_at(x, texture.x0, texture.ix, nx, texture.periodic)
    i, r, _sy = cell_at(y, texture.y0, texture.iy, ny, texture.periodic)
    return dot4(weights(r), rows_of(texture.c, i, j, weights(t)))


def slope(x: float, y: float, texture: HeightMapArguments) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    nx, ny = cells_of(texture.c)
    j, t, sx = cell_at(x, texture.x0, texture.ix, nx, texture.periodic)
    i, r, sy = cell_at(y, texture.y0, texture.iy, ny, texture.periodic)
    rows = rows_of(texture.c, i, j, weights(t))
    w = weights(r)
    hx = sx * texture.ix * dot4(w, rows_of(texture.c, i, j, weights_first(t)))
    return dot4(w, rows), hx, sy * texture.iy * dot4(weights_first(r), rows)


def curvature(
    x: float, y: float, texture: HeightMapArguments
) -> tuple[float, float, float, float, float, float]:
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    nx, ny = cells_of(texture.c)
    j, t, sx = cell_at(x, texture.x0, texture.ix, nx, texture.periodic)
    i, r, sy = cell_at(y, texture.y0, texture.iy, ny, texture.periodic)
    rows = rows_of(texture.c, i, j, weights(t))
    first = rows_of(texture.c, i, j, weights_first(t))
    second = rows_of(texture.c, i, j, weights_second(t))
    w = weights(r)
    d = weights_first(r)
    return (
        dot4(w, rows),
        sx * texture.ix * dot4(w, first),
        sy * texture.iy * dot4(d, rows),
        texture.ix * texture.ix * dot4(w, second),
        sx * sy * texture.ix * texture.iy * dot4(d, first),
        texture.iy * texture.iy * dot4(weights_second(r), rows),
    )


def foot(
    x: float, y: float, z: float, texture: HeightMapArguments
) -> tuple[float, float, float, float, float]:
    """Return X, Y of the globally nearest surface point, and h, h_x, h_y there.

    Downhill from the probe, then whatever can be nearer.
    """
    best = descend(x, y, z, x, y, texture)
    best, _left = search_plane(x, y, z, best, 1.0 - SLACK * EPS, np.inf, texture)
    return best[0], best[1], best[3], best[4], best[5]


def search_plane(
    x: float, y: float, z: float, best: Point, keep: float, left: float,
    texture: HeightMapArguments,
) -> tuple[Point, float]:  # fmt: skip
    """Return the best point after a search of all copies of the map, and the looks left.

    Only points within the distance of the best can be nearer. The plane is tiled by copies of the
    map, every other one mirrored if it is finite; each is searched from the coarsest boxes of the
    pyramid down. See ``plane_search`` for ``keep`` and ``left``.
    """
    nx, ny = cells_of(texture.c)
    tile_i = math.floor((y - texture.y0) * texture.iy / ny)
    tile_j = math.floor((x - texture.x0) * texture.ix / nx)
    best, left = search_tile(x, y, z, tile_i, tile_j, best, keep, left, texture)
    reach = reach_of(z, best[2], texture.nodes)
    # Of the copies of a point only the nearest counts.
    reach_x = min(reach, nearest_copy(nx / texture.ix, texture.periodic))
    reach_y = min(reach, nearest_copy(ny / texture.iy, texture.periodic))
    i_first = math.floor((y - reach_y - texture.y0) * texture.iy / ny)
    i_last = math.floor((y + reach_y - texture.y0) * texture.iy / ny)
    j_first = math.floor((x - reach_x - texture.x0) * texture.ix / nx)
    j_last = math.floor((x + reach_x - texture.x0) * texture.ix / nx)
    for i in range(i_first, i_last + 1):
        for j in range(j_first, j_last + 1):
            if (i != tile_i or j != tile_j) and left > 0.0:
                best, left = search_tile(x, y, z, i, j, best, keep, left, texture)
    return best, left


def search_tile(
    x: float, y: float, z: float, tile_i: int, tile_j: int, best: Point, keep: float, left: float,
    texture: HeightMapArguments,
) -> tuple[Point, float]:  # fmt: skip
    """Return the best point after a search of one copy of the map, and the looks left.

    Probe and best point are moved to where they are seen from the map itself.
    """
    nx, ny = cells_of(texture.c)
    reach = reach_of(z, best[2], texture.nodes)
    turn_x, shift_x = tile_frame(tile_j, nx, texture.ix, texture.x0, texture.periodic)
    turn_y, shift_y = tile_frame(tile_i, ny, texture.iy, texture.y0, texture.periodic)
    x = turn_x * x + shift_x
    y = turn_y * y + shift_y
    found = (
        turn_x * best[0] + shift_x, turn_y * best[1] + shift_y, best[2],
        best[3], turn_x * best[4], turn_y * best[5],
    )  # fmt: skip
    u = (found[0] - texture.x0) * texture.ix
    v = (found[1] - texture.y0) * texture.iy
    half = convex_half(z, u, v, texture)
    settled = (u - half, u + half, v - half, v + half)
    # Boxes of two by two cells that are within reach.
    j_low = max(math.floor((x - reach - texture.x0) * texture.ix), 0) >> 1
    j_high = min(math.floor((x + reach - texture.x0) * texture.ix), nx - 1) >> 1
    i_low = max(math.floor((y - reach - texture.y0) * texture.iy), 0) >> 1
    i_high = min(math.floor((y + reach - texture.y0) * texture.iy), ny - 1) >> 1
    top = 1
    while top < texture.levels.shape[0] and ((i_high - i_low) | (j_high - j_low)) >> (top - 1) > 0:
        top += 1
    for i in range(i_low >> (top - 1), (i_high >> (top - 1)) + 1):
        for j in range(j_low >> (top - 1), (j_high >> (top - 1)) + 1):
            if left > 0.0:
                found, left = search_tree(x, y, z, top, i, j, found, settled, keep, left, texture)
    if found[2] >= best[2]:
        return best, left
    return (
        turn_x * (found[0] - shift_x), turn_y * (found[1] - shift_y), found[2],
        found[3], turn_x * found[4], turn_y * found[5],
    ), left  # fmt: skip


def convex_half(z: float, u: float, v: float, texture: HeightMapArguments) -> float:
    """Return half the side [cells] of a square around a minimum of φ in which φ is convex, or 0.

    (u, v) is the minimum [cells]. As far as the square is on the map, no other point is nearer. It
    is no wider than a box of the level by which it is judged, and lies in four of them at most.
    """
    nx, ny = cells_of(texture.c)
    if u < 0.0 or v < 0.0 or u > nx or v > ny:
        return 0.0
    for level in range(min(WIDEST, texture.levels.shape[0]), 0, -1):
        side = float(1 << level)
        half = 0.5 * side
        first = texture.levels[level - 1, 0]
        columns = texture.levels[level - 1, 2]
        i_last = min(int((v + half) / side), texture.levels[level - 1, 1] - 1)
        j_last = min(int((u + half) / side), columns - 1)
        margin = 1.0
        for i in range(int(max(v - half, 0.0) / side), i_last + 1):
            for j in range(int(max(u - half, 0.0) / side), j_last + 1):
                k = first + i * columns + j
                margin = min(margin, saddle_margin(z, texture.nodes, k, texture.ix))
        # Room for a minimum that is known to rounding.
        if margin > 1e-3:
            return half
    return 0.0


def search_tree(
    x: float, y: float, z: float, top: int, i: int, j: int, best: Point, settled: Four, keep: float,
    left: float, texture: HeightMapArguments,
) -> tuple[Point, float]:  # fmt: skip
    """Return the best point after a search of box (i, j) of level top, and the looks left.

    The sides of the box are 2^top cells. ``settled`` are the ends along x and y [cells] of a square
    in which nothing is nearer than the best point.
    """
    ix = texture.ix
    x0 = texture.x0
    y0 = texture.y0
    px = 1.0 / ix
    py = 1.0 / texture.iy
    u = (x - x0) * ix
    v = (y - y0) * texture.iy
    west, east, south, north = settled
    level = top
    side = 2.0**top
    low = high = bend = twist = 0.0
    while level <= top and left > 0.0:
        left -= PASSED
        i_end = min((i + 1) * side, texture.c.shape[0] - 3.0)
        j_end = min((j + 1) * side, texture.c.shape[1] - 3.0)
        deeper = i * side < i_end and j * side < j_end
        if j * side >= west and j_end <= east and i * side >= south and i_end <= north:
            deeper = False
        if deeper:
            if level > 0:
                k = texture.levels[level - 1, 0] + i * texture.levels[level - 1, 2] + j
                low, high, bend, twist = box_bounds(texture.nodes, k)
            near_x = max(j * side - u, u - j_end, 0.0) * px
            near_y = max(i * side - v, v - i_end, 0.0) * py
            gap = max(low - z, z - high, 0.0)
            deeper = near_x * near_x + near_y * near_y + gap * gap < best[2] * keep
        if deeper and (level <= 1 or foreseeable(z, low, high, bend, twist, side, ix)):
            best, deeper, left = judge(
                x, y, z, x0 + 0.5 * (j * side + j_end) * px, y0 + 0.5 * (i * side + i_end) * py,
                0.5 * (j_end - j * side) * px, 0.5 * (i_end - i * side) * py,
                bend * ix, twist * ix * ix, best, keep, left, texture,
            )  # fmt: skip
            deeper = deeper and level > -20
        if deeper:
            level -= 1
            side *= 0.5
            i = 2 * i + (1 if v >= (2 * i + 1) * side else 0)
            j = 2 * j + (1 if u >= (2 * j + 1) * side else 0)
        else:
            level, side, i, j = next_box(level, side, i, j, top, u, v)
    return best, left

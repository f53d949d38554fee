"""The nearest point of a map: windows of cells are made narrow, and what is left is searched."""

import math

import numpy as np

from asperity.compiled import EPS, Kernels, local_array
from asperity.contacts.nearest.plane_search import descend, go_down, judge, next_box
from asperity.contacts.sampler import PASSED, SLACK
from asperity.contacts.sampler import PlanePoint as Point
from asperity.textures.samplers.heightmap import HeightMapArguments, cells_of
from asperity.textures.samplers.heightmap_cells import (
    Basin,
    basin_at,
    is_near,
    least_in_row,
    rises_in,
)
from asperity.textures.samplers.heightmap_window import Window, is_empty, narrowed
from asperity.textures.samplers.spline import (
    box_bounds,
    foreseeable,
    nearest_copy,
    reach_of,
    tile_frame,
)

KERNELS = Kernels(
    provides=("foot", "search_plane"),
    requires=(
        "basin_at", "cells_of", "descend", "go_down", "is_empty", "is_near", "judge",
        "least_in_row", "narrowed", "next_box", "rises_in",
        "box_bounds", "foreseeable", "nearest_copy", "reach_of", "tile_frame",
    ),
    called=("foot", "search_cell", "search_tile", "search_tree"),
    shared=("search_plane",),
    merged=("search_rows", "search_window"),
    iterates=True,
)  # fmt: skip

# A window of so few cells, and so few along x, is searched cell by cell.
FEW_CELLS = 1000
NARROW = 64
# So many looks take the coefficients of a row, of each cell in it, and those of one that is cut.
ROW = 0.4
CELL = 0.075
CUT = 2.0
# Cells from a minimum in which ψ may rise from it, and in which there is hardly another one.
NEAR = 2.5
BESIDE = 1.0


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
    map, every other one mirrored if it is finite; what ``narrowed`` leaves of each is searched from
    the coarsest boxes of the pyramid down. See ``plane_search`` for ``keep`` and ``left``.
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
    window, left = narrowed(
        x, y, z, found, keep,
        (
            max(math.floor((x - reach - texture.x0) * texture.ix), 0),
            min(math.floor((x + reach - texture.x0) * texture.ix), nx - 1),
            max(math.floor((y - reach - texture.y0) * texture.iy), 0),
            min(math.floor((y + reach - texture.y0) * texture.iy), ny - 1),
        ),
        left, texture,
    )  # fmt: skip
    if is_empty(window):
        return best, left
    found, left = search_window(x, y, z, found, window, keep, left, texture)
    if found[2] >= best[2]:
        return best, left
    return (
        turn_x * (found[0] - shift_x), turn_y * (found[1] - shift_y), found[2],
        found[3], turn_x * found[4], turn_y * found[5],
    ), left  # fmt: skip


def search_window(
    x: float, y: float, z: float, best: Point, window: Window, keep: float, left: float,
    texture: HeightMapArguments,
) -> tuple[Point, float]:  # fmt: skip
    """Return the best point after a search of a window, and the looks left.

    Cell by cell if they are few, else from the level on of which it has at most two by two boxes.
    """
    west, east, south, north = window
    if (east - west + 1) * (north - south + 1) <= FEW_CELLS and east - west < NARROW:
        return search_rows(x, y, z, best, window, keep, left, texture)
    top = 1
    span = ((east >> 1) - (west >> 1)) | ((north >> 1) - (south >> 1))
    while top < texture.levels.shape[0] and span >> (top - 1) > 0:
        top += 1
    for i in range(south >> top, (north >> top) + 1):
        for j in range(west >> top, (east >> top) + 1):
            if left > 0.0:
                best, left = search_tree(x, y, z, top, i, j, best, window, keep, left, texture)
    return best, left


def search_rows(
    x: float, y: float, z: float, best: Point, window: Window, keep: float, left: float,
    texture: HeightMapArguments,
) -> tuple[Point, float]:  # fmt: skip
    """Return the best point after a search of the open cells of a window, and the looks left."""
    west, east, south, north = window
    least = local_array((64,))
    # Whole registers, as far as there are cells.
    nx, _ny = cells_of(texture.c)
    count = min((east - west + 8) & -8, nx)
    first = min(west, nx - count)
    near = basin_at(z, best, texture)
    other = near
    cost = ROW + CELL * count
    for i in range(south, north + 1):
        left = left - cost if left > cost else 0.0
        if left > 0.0:
            least_in_row(x, y, z, i, first, count, least, texture)
            for j in range(west, east + 1):
                if left > 0.0 and least[j - first] < best[2] * keep:
                    best, near, other, left = search_cell(
                        x, y, z, i, j, best, near, other, window, keep, left, texture
                    )
    return best, left


def search_cell(
    x: float, y: float, z: float, i: int, j: int, best: Point, near: Basin, other: Basin,
    window: Window, keep: float, left: float, texture: HeightMapArguments,
) -> tuple[Point, Basin, Basin, float]:  # fmt: skip
    """Return the best point after a search of an open cell, two minima, and the looks left.

    Mostly φ rises there from one of them: the best point, and the one that was found last.
    """
    if is_near(near, i, j, NEAR):
        left -= CUT
        if rises_in(x, y, z, best[2] * keep, near, i, j, texture):
            return best, near, other, left
    if left > 0.0 and is_near(other, i, j, NEAR):
        left -= CUT
        if rises_in(x, y, z, best[2] * keep, other, i, j, texture):
            return best, near, other, left
    if left > 0.0 and not (is_near(near, i, j, BESIDE) or is_near(other, i, j, BESIDE)):
        start_x = texture.x0 + (j + 0.5) / texture.ix
        start_y = texture.y0 + (i + 0.5) / texture.iy
        found, left = go_down(x, y, z, start_x, start_y, left - 1.0, texture)
        other = basin_at(z, found, texture)
        if found[2] < best[2]:
            best = found
            near = other
        if left > 0.0 and is_near(other, i, j, NEAR):
            left -= CUT
            if rises_in(x, y, z, best[2] * keep, other, i, j, texture):
                return best, near, other, left
    if left > 0.0:
        best, left = search_tree(x, y, z, 0, i, j, best, window, keep, left, texture)
    return best, near, other, left


def search_tree(
    x: float, y: float, z: float, top: int, i: int, j: int, best: Point, window: Window,
    keep: float, left: float, texture: HeightMapArguments,
) -> tuple[Point, float]:  # fmt: skip
    """Return the best point after a search of box (i, j) of level top, and the looks left.

    The sides of the box are 2^top cells; what lies outside of the window need not be searched.
    """
    west, east, south, north = window
    ix = texture.ix
    x0 = texture.x0
    y0 = texture.y0
    px = 1.0 / ix
    py = 1.0 / texture.iy
    u = (x - x0) * ix
    v = (y - y0) * texture.iy
    level = top
    side = 2.0**top
    low, high, bend, twist = box_bounds(
        texture.nodes, texture.levels[0, 0] + (i >> 1) * texture.levels[0, 2] + (j >> 1)
    )  # what counts in cells and their parts, if those are what the search begins with
    while level <= top and left > 0.0:
        left -= PASSED
        i_end = min((i + 1) * side, texture.c.shape[0] - 3.0)
        j_end = min((j + 1) * side, texture.c.shape[1] - 3.0)
        inside = max(j * side, west) < min(j_end, east + 1)
        deeper = inside and max(i * side, south) < min(i_end, north + 1)
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

"""Boxes of cells of a spline, for the closest point of profiles and height maps.

Box coordinates are cells, and the plane is tiled by copies of the map, every other one mirrored
if it is finite. Bounds of a box come from the pyramid (``pyramid``), sharper ones from the
coefficients (``spline_pruning``): a box is narrowed to the cells around the best point and few
others, and mostly the certificate of the best point covers them. Other boxes are divided into
cells, of which those are left that may hold a closer point.

A profile is a map with one row of cells of width 0, whose rows of coefficients are all the same.
"""

import math

import numpy as np

from asperity.contacts.closest_search import MAX_BOXES, push_box, split_box
from asperity.contacts.sampler_interface import (
    DESCEND,
    DIVIDE,
    EXPAND,
    PRUNED_BOX_COST,
    Ball,
    Bounds,
    Box,
    Frame,
    Minimum,
)
from asperity.core.compiled import EVERY_FUNCTION, SQRT_EPS, FloatArray, Kernels, local_array
from asperity.textures.spline.bspline_kernels import (
    SplineArguments,
    cell_counts,
    cell_sides,
    fold_cells,
    probe_cells,
    unfold_cells,
)
from asperity.textures.spline.spline_pruning import min_coefficients_in_row, shrink_to_cells

KERNELS = Kernels(provides=EVERY_FUNCTION)

# Greatest number of coefficients, along x and in all, of a box that is narrowed by coefficients.
MAX_COLUMNS = 64
MAX_COEFFICIENTS = 1200
# Greatest number of cells, along x and in all, of a box that is divided into cells at once.
MAX_CELL_COLUMNS = 32
MAX_CELLS = 600
# Costs, in evaluations: of a coefficient as a share of that of a pruned box, of narrowing at all,
# of the Bernstein coefficients of a row and of each of its cells.
COEFFICIENT_COST = 1.0 / 16.0
NARROWING_COST = 3.0
ROW_COST = 0.4
CELL_COST = 0.075


def search_frame(x: float, y: float, texture: SplineArguments) -> Frame:
    """Return cells from the first node, along a profile through the probe."""
    side_x, side_y = cell_sides(texture)
    y0 = texture.y0 if side_y > 0.0 else y
    return texture.x0, y0, 1.0, 0.0, side_x, side_y


def search_region(x: float, y: float, z: float, square: float, texture: SplineArguments) -> Box:
    """Return the cells within the lateral reach of a ball.

    It follows from the extremes of the whole surface, which are in the last box of the pyramid. Of
    the copies of a point only the closest counts.
    """
    nx, ny = cell_counts(texture)
    side_x, side_y = cell_sides(texture)
    last = texture.boxes.shape[0] - 1
    low = float(texture.boxes[last, 0])
    high = float(texture.boxes[last, 1])
    gap = max(low - z, z - high, 0.0)
    reach = math.sqrt(max(square - gap * gap, 0.0))
    west, east = cells_within(x - texture.x0, reach, nx, side_x, texture.periodic)
    if side_y == 0.0:
        return west, east, 0.0, 1.0
    south, north = cells_within(y - texture.y0, reach, ny, side_y, texture.periodic)
    return west, east, south, north


def cells_within(
    at: float, reach: float, cells: int, side: float, periodic: bool
) -> tuple[float, float]:
    """Return the first and the last border of the cells within a distance along an axis.

    Mirrored copies of a point may all be one length away; a small share allows for rounding.
    """
    farthest = cells * side * (0.5 if periodic else 1.0) * (1.0 + 0.07 * SQRT_EPS)
    reach = min(reach, farthest)
    return float(math.floor((at - reach) / side)), math.floor((at + reach) / side) + 1.0


def box_middle(low: float, high: float, axis: int, texture: SplineArguments) -> float:
    """Return the border of a copy in a range of cells, or between two cells near its middle."""
    middle = 0.5 * (low + high)
    if high - low <= 1.0:
        return middle
    nx, ny = cell_counts(texture)
    cells = nx if axis == 0 else ny
    border = float(cells * math.floor(middle / cells + 0.5))
    return border if low < border < high else float(math.floor(middle))


def enclose_box(box: Box, texture: SplineArguments) -> Bounds:
    """Return the bounds of the boxes of the pyramid that cover a box."""
    nx, ny = cell_counts(texture)
    west, east, _sign, _shift = fold_cells(box[0], box[1], nx, texture.periodic)
    south, north, _sign, _shift = fold_cells(box[2], box[3], ny, texture.periodic)
    size = max(east - west, north - south)
    level = 0
    while size >> level > 4 and level < texture.levels.shape[0] - 1:
        level += 1
    low = np.inf
    high = -np.inf
    hessian = third = crest = 0.0
    cells = level + 1  # a box of the finest level has two by two
    for i in range(south >> cells, (north >> cells) + 1):
        row = texture.levels[level, 0] + i * texture.levels[level, 2]
        for k in range(row + (west >> cells), row + (east >> cells) + 1):
            low = min(low, float(texture.boxes[k, 0]))
            high = max(high, float(texture.boxes[k, 1]))
            hessian = max(hessian, float(texture.boxes[k, 2]))
            third = max(third, float(texture.boxes[k, 3]))
            crest = max(crest, float(texture.boxes[k, 4]))
    ix = texture.ix
    side = max(box[1] - box[0], box[3] - box[2])
    effort = EXPAND
    if side > 1.0:
        effort = DIVIDE
    elif box[1] - box[0] == 1.0:
        effort = DESCEND
    return low, high, hessian * ix, third * ix * ix, crest * ix, effort


def narrow_box(
    ball: Ball, gap: float, box: Box, left: float, texture: SplineArguments
) -> tuple[Box, float]:
    """Return the part of a box whose cells have a coefficient of ψ below the ball's r²."""
    west, east, south, north = box
    columns = east - west + 3.0
    count = columns * (north - south + 3.0)
    cost = PRUNED_BOX_COST * COEFFICIENT_COST * count + NARROWING_COST
    is_cell = max(east - west, north - south) <= 1.0
    if is_cell or columns > MAX_COLUMNS or count > MAX_COEFFICIENTS or cost > left:
        return box, left
    nx, ny = cell_counts(texture)
    first_j, last_j, sign_u, shift_u = fold_cells(west, east, nx, texture.periodic)
    first_i, last_i, sign_v, shift_v = fold_cells(south, north, ny, texture.periodic)
    if sign_u * sign_v == 0.0:
        return box, left
    u, v = probe_cells(ball, texture)
    first_j, last_j, first_i, last_i = shrink_to_cells(
        sign_u * u + shift_u,
        sign_v * v + shift_v,
        ball[2],
        ball[3],
        gap,
        first_j,
        last_j,
        first_i,
        last_i,
        texture,
    )
    left -= cost
    if first_j > last_j or first_i > last_i:
        return (1.0, 0.0, 1.0, 0.0), left
    west, east = unfold_cells(first_j, last_j, sign_u, shift_u)
    south, north = unfold_cells(first_i, last_i, sign_v, shift_v)
    return (west, east, south, north), left


def divide_box(
    ball: Ball,
    frame: Frame,
    minimum: Minimum,
    box: Box,
    stack: FloatArray,
    count: int,
    left: float,
    texture: SplineArguments,
) -> tuple[int, float]:
    """Put the cells of a box that may hold a closer point on the stack, or quarters of others."""
    columns = box[1] - box[0]
    cells = columns * (box[3] - box[2])
    nx, ny = cell_counts(texture)
    first_j, last_j, sign_u, shift_u = fold_cells(box[0], box[1], nx, texture.periodic)
    first_i, last_i, sign_v, shift_v = fold_cells(box[2], box[3], ny, texture.periodic)
    is_large = cells > MAX_CELLS or columns > MAX_CELL_COLUMNS
    if cells <= 1.0 or is_large or sign_u * sign_v == 0.0:
        return split_box(frame, minimum, box, stack, count, texture), left
    u, v = probe_cells(ball, texture)
    least = local_array((64,))
    # Whole vector registers, as far as there are cells.
    width = min((last_j - first_j + 8) & -8, nx)
    first = min(first_j, nx - width)
    cost = ROW_COST + CELL_COST * width
    total = count
    for i in range(first_i, last_i + 1):
        left = left - cost if left > cost else 0.0
        if left > 0.0:
            min_coefficients_in_row(
                sign_u * u + shift_u, sign_v * v + shift_v, ball[2], i, first, width, least, texture
            )
            for j in range(first_j, last_j + 1):
                if least[j - first] < ball[3]:
                    if total >= MAX_BOXES:
                        return split_box(frame, minimum, box, stack, count, texture), left
                    west, east = unfold_cells(j, j, sign_u, shift_u)
                    south, north = unfold_cells(i, i, sign_v, shift_v)
                    cell = (west, east, south, north)
                    total = push_box(cell, least[j - first], stack, total)
    return total, left

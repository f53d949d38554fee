"""Globally closest point of a height map: narrow the window of cells, then search the rest."""

import math

from asperity.contacts.closest.plane_search import descend_within_budget, evaluate_box, next_box
from asperity.contacts.sampler_interface import PRUNED_BOX_COST
from asperity.contacts.sampler_interface import PlanePoint as Point
from asperity.core.compiled import EVERY_FUNCTION, Kernels, local_array
from asperity.textures.spline.bspline_kernels import (
    box_bounds,
    lateral_reach,
    max_copy_distance,
    tile_transform,
)
from asperity.textures.spline.heightmap_pruning import (
    CertifiedMinimum,
    Window,
    can_prune_cell,
    certified_minimum_at,
    is_empty,
    is_within,
    may_hold_point,
    min_coefficients_in_row,
    narrow_window,
)
from asperity.textures.spline.heightmap_sampler import HeightMapArguments, cell_counts

KERNELS = Kernels(provides=EVERY_FUNCTION, shared=("search_plane",), iterates=True)

# A window with at most so many cells, and cells along x, is searched cell by cell.
MAX_ROW_SEARCH_CELLS = 600
MAX_ROW_SEARCH_COLUMNS = 32
# Level of the boxes by which a larger one is searched.
BOX_LEVEL = 3
# Costs, in evaluations: of the coefficients of a row, of each of its cells, of subdividing a cell.
ROW_COST = 0.4
CELL_COST = 0.075
SUBDIVISION_COST = 2.0
# Distance [cells] from a minimum within which it may prune a cell, and within which a second
# minimum is unlikely.
NEAR_DISTANCE = 2.5
ADJACENT_DISTANCE = 1.0

# The probe x, y, z, and the pruning factor of ``plane_search``.
Query = tuple[float, float, float, float]


def search_plane(
    x: float, y: float, z: float, best: Point, pruning_factor: float, budget: float,
    texture: HeightMapArguments,
) -> tuple[Point, float]:  # fmt: skip
    """Return the best point after a search of all copies of the map, and the remaining budget.

    Only points within the distance of the best one can be closer. The plane is tiled by copies of
    the map, every other one mirrored if it is finite; what ``narrow_window`` leaves of each copy is
    searched by boxes, rows and cells. The parameters are those of ``plane_search``.
    """
    nx, ny = cell_counts(texture.c)
    query = (x, y, z, pruning_factor)
    tile_i = math.floor((y - texture.y0) * texture.iy / ny)
    tile_j = math.floor((x - texture.x0) * texture.ix / nx)
    best, budget = search_tile(query, tile_i, tile_j, best, budget, texture)
    reach = lateral_reach(z, best[2], texture.boxes)
    # Of the copies of a point only the closest counts.
    reach_x = min(reach, max_copy_distance(nx / texture.ix, texture.periodic))
    reach_y = min(reach, max_copy_distance(ny / texture.iy, texture.periodic))
    i_first = math.floor((y - reach_y - texture.y0) * texture.iy / ny)
    i_last = math.floor((y + reach_y - texture.y0) * texture.iy / ny)
    j_first = math.floor((x - reach_x - texture.x0) * texture.ix / nx)
    j_last = math.floor((x + reach_x - texture.x0) * texture.ix / nx)
    for i in range(i_first, i_last + 1):
        for j in range(j_first, j_last + 1):
            if (i != tile_i or j != tile_j) and budget > 0.0:
                best, budget = search_tile(query, i, j, best, budget, texture)
    return best, budget


def search_tile(
    query: Query, tile_i: int, tile_j: int, best: Point, budget: float, texture: HeightMapArguments
) -> tuple[Point, float]:
    """Return the best point after a search of one copy of the map, and the remaining budget.

    The probe and the best point are transformed into the coordinates of the map itself.
    """
    x, y, z, pruning_factor = query
    nx, ny = cell_counts(texture.c)
    reach = lateral_reach(z, best[2], texture.boxes)
    sign_x, shift_x = tile_transform(tile_j, nx, texture.ix, texture.x0, texture.periodic)
    sign_y, shift_y = tile_transform(tile_i, ny, texture.iy, texture.y0, texture.periodic)
    x = sign_x * x + shift_x
    y = sign_y * y + shift_y
    query = (x, y, z, pruning_factor)
    found = (
        sign_x * best[0] + shift_x, sign_y * best[1] + shift_y, best[2],
        best[3], sign_x * best[4], sign_y * best[5],
    )  # fmt: skip
    window = (
        max(math.floor((x - reach - texture.x0) * texture.ix), 0),
        min(math.floor((x + reach - texture.x0) * texture.ix), nx - 1),
        max(math.floor((y - reach - texture.y0) * texture.iy), 0),
        min(math.floor((y + reach - texture.y0) * texture.iy), ny - 1),
    )
    window, budget = narrow_window(query, found, window, budget, texture)
    if is_empty(window):
        return best, budget
    found, budget = search_window(query, found, window, budget, texture)
    if found[2] >= best[2]:
        return best, budget
    return (
        sign_x * (found[0] - shift_x), sign_y * (found[1] - shift_y), found[2],
        found[3], sign_x * found[4], sign_y * found[5],
    ), budget  # fmt: skip


def search_window(
    query: Query, best: Point, window: Window, budget: float, texture: HeightMapArguments
) -> tuple[Point, float]:
    """Return the best point after a search of a window, and the remaining budget.

    A small window is searched cell by cell, of a larger one the boxes that may hold a closer point.
    """
    x, y, z, pruning_factor = query
    west, east, south, north = window
    count = (east - west + 1) * (north - south + 1)
    if count <= MAX_ROW_SEARCH_CELLS and east - west < MAX_ROW_SEARCH_COLUMNS:
        return search_rows(query, best, window, budget, texture)
    level = min(BOX_LEVEL, texture.levels.shape[0])
    for i in range(south >> level, (north >> level) + 1):
        for j in range(west >> level, (east >> level) + 1):
            budget -= PRUNED_BOX_COST
            ball = (x, y, z, best[2] * pruning_factor)
            if budget > 0.0 and may_hold_point(ball, level, i, j, texture):
                part = (
                    max(west, j << level), min(east, ((j + 1) << level) - 1),
                    max(south, i << level), min(north, ((i + 1) << level) - 1),
                )  # fmt: skip
                best, budget = search_rows(query, best, part, budget, texture)
    return best, max(budget, 0.0)


def search_rows(
    query: Query, best: Point, window: Window, budget: float, texture: HeightMapArguments
) -> tuple[Point, float]:
    """Return the best point after a search of a window cell by cell, and the remaining budget."""
    x, y, z, pruning_factor = query
    west, east, south, north = window
    least = local_array((64,))
    # Whole vector registers, as far as there are cells.
    nx, _ny = cell_counts(texture.c)
    count = min((east - west + 8) & -8, nx)
    first = min(west, nx - count)
    near = certified_minimum_at(z, best, texture)
    last = near
    cost = ROW_COST + CELL_COST * count
    for i in range(south, north + 1):
        budget = budget - cost if budget > cost else 0.0
        if budget > 0.0:
            min_coefficients_in_row(x, y, z, i, first, count, least, texture)
            for j in range(west, east + 1):
                if budget > 0.0 and least[j - first] < best[2] * pruning_factor:
                    best, near, last, budget = search_cell(
                        query, i, j, best, near, last, budget, texture
                    )
    return best, budget


def search_cell(
    query: Query, i: int, j: int, best: Point, near: CertifiedMinimum, last: CertifiedMinimum,
    budget: float, texture: HeightMapArguments,
) -> tuple[Point, CertifiedMinimum, CertifiedMinimum, float]:  # fmt: skip
    """Return the best point after a search of a cell, two minima, and the remaining budget.

    The two minima, at the best point and at the one found last, mostly prune the cell.
    """
    x, y, z, pruning_factor = query
    ball = (x, y, z, best[2] * pruning_factor)
    if is_within(near, i, j, NEAR_DISTANCE):
        budget -= SUBDIVISION_COST
        if can_prune_cell(ball, near, i, j, texture):
            return best, near, last, budget
    if budget > 0.0 and is_within(last, i, j, NEAR_DISTANCE):
        budget -= SUBDIVISION_COST
        if can_prune_cell(ball, last, i, j, texture):
            return best, near, last, budget
    if budget > 0.0 and not (
        is_within(near, i, j, ADJACENT_DISTANCE) or is_within(last, i, j, ADJACENT_DISTANCE)
    ):
        start_x = texture.x0 + (j + 0.5) / texture.ix
        start_y = texture.y0 + (i + 0.5) / texture.iy
        found, budget = descend_within_budget(x, y, z, start_x, start_y, budget - 1.0, texture)
        last = certified_minimum_at(z, found, texture)
        if found[2] < best[2]:
            best = found
            near = last
        if budget > 0.0 and is_within(last, i, j, NEAR_DISTANCE):
            budget -= SUBDIVISION_COST
            if can_prune_cell((x, y, z, best[2] * pruning_factor), last, i, j, texture):
                return best, near, last, budget
    if budget > 0.0:
        best, budget = search_parts(query, i, j, best, budget, texture)
    return best, near, last, budget


def search_parts(
    query: Query, i: int, j: int, best: Point, budget: float, texture: HeightMapArguments
) -> tuple[Point, float]:
    """Return the best point after a search of cell (i, j) and its parts, and the remaining budget.

    Parts of level -n have sides of 2^-n cells.
    """
    x, y, z, pruning_factor = query
    ix = texture.ix
    px = 1.0 / ix
    py = 1.0 / texture.iy
    u = (x - texture.x0) * ix
    v = (y - texture.y0) * texture.iy
    k = texture.levels[0, 0] + (i >> 1) * texture.levels[0, 2] + (j >> 1)
    low, high, hessian, third = box_bounds(texture.boxes, k)
    gap = max(low - z, z - high, 0.0)
    level = 0
    side = 1.0
    while level <= 0 and budget > 0.0:
        budget -= PRUNED_BOX_COST
        half = 0.5 * side
        middle_x = j * side + half
        middle_y = i * side + half
        near_x = max(abs(middle_x - u) - half, 0.0) * px
        near_y = max(abs(middle_y - v) - half, 0.0) * py
        deeper = near_x * near_x + near_y * near_y + gap * gap < best[2] * pruning_factor
        if deeper:
            best, deeper, budget = evaluate_box(
                x, y, z, texture.x0 + middle_x * px, texture.y0 + middle_y * py, half * px,
                half * py, hessian * ix, third * ix * ix, best, pruning_factor, budget, texture,
            )  # fmt: skip
            deeper = deeper and level > -20
        level, side, i, j = next_box(deeper, level, side, i, j, 0, u, v)
    return best, budget

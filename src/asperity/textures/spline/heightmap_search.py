"""Globally closest point of a height map: narrow the window of cells, then search the rest."""

import math

from asperity.contacts.closest.plane_search import descend_within_budget, evaluate_box, next_box
from asperity.contacts.sampler_interface import PRUNED_BOX_COST
from asperity.contacts.sampler_interface import PlanePoint as Point
from asperity.core.compiled import EVERY_FUNCTION, Kernels, local_array
from asperity.textures.spline.bspline_kernels import (
    box_bounds,
    is_taylor_conclusive,
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
    min_coefficients_in_row,
    narrow_window,
)
from asperity.textures.spline.heightmap_sampler import HeightMapArguments, cell_counts

KERNELS = Kernels(
    provides=EVERY_FUNCTION,
    not_inlined=("search_cell", "search_tile", "search_tree"),
    shared=("search_plane",),
    merged=("search_rows", "search_window"),
    iterates=True,
)

# A window with at most so many cells, and cells along x, is searched cell by cell.
MAX_ROW_SEARCH_CELLS = 4000
MAX_ROW_SEARCH_COLUMNS = 64
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
    searched from the coarsest boxes of the pyramid down. The parameters are those of
    ``plane_search``.
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

    A small window is searched cell by cell, a larger one from the level down at which it has at
    most two by two boxes.
    """
    west, east, south, north = window
    count = (east - west + 1) * (north - south + 1)
    if count <= MAX_ROW_SEARCH_CELLS and east - west < MAX_ROW_SEARCH_COLUMNS:
        return search_rows(query, best, window, budget, texture)
    top = 1
    span = ((east >> 1) - (west >> 1)) | ((north >> 1) - (south >> 1))
    while top < texture.levels.shape[0] and span >> (top - 1) > 0:
        top += 1
    for i in range(south >> top, (north >> top) + 1):
        for j in range(west >> top, (east >> top) + 1):
            if budget > 0.0:
                best, budget = search_tree(query, top, i, j, best, window, budget, texture)
    return best, budget


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
        best, budget = search_tree(query, 0, i, j, best, (j, j, i, i), budget, texture)
    return best, near, last, budget


def search_tree(
    query: Query, top: int, i: int, j: int, best: Point, window: Window, budget: float,
    texture: HeightMapArguments,
) -> tuple[Point, float]:  # fmt: skip
    """Return the best point after a search of box (i, j) of level top, and the remaining budget.

    The sides of the box are 2^top cells; parts outside the window are skipped.
    """
    x, y, z, pruning_factor = query
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
    low, high, hessian, third = box_bounds(
        texture.boxes, texture.levels[0, 0] + (i >> 1) * texture.levels[0, 2] + (j >> 1)
    )  # for cells and their parts, if the search starts with those
    while level <= top and budget > 0.0:
        budget -= PRUNED_BOX_COST
        i_end = min((i + 1) * side, texture.c.shape[0] - 3.0)
        j_end = min((j + 1) * side, texture.c.shape[1] - 3.0)
        inside = max(j * side, west) < min(j_end, east + 1)
        deeper = inside and max(i * side, south) < min(i_end, north + 1)
        if deeper:
            if level > 0:
                k = texture.levels[level - 1, 0] + i * texture.levels[level - 1, 2] + j
                low, high, hessian, third = box_bounds(texture.boxes, k)
            near_x = max(j * side - u, u - j_end, 0.0) * px
            near_y = max(i * side - v, v - i_end, 0.0) * py
            gap = max(low - z, z - high, 0.0)
            deeper = near_x * near_x + near_y * near_y + gap * gap < best[2] * pruning_factor
        if deeper and (level <= 1 or is_taylor_conclusive(z, low, high, hessian, third, side, ix)):
            best, deeper, budget = evaluate_box(
                x, y, z, x0 + 0.5 * (j * side + j_end) * px, y0 + 0.5 * (i * side + i_end) * py,
                0.5 * (j_end - j * side) * px, 0.5 * (i_end - i * side) * py,
                hessian * ix, third * ix * ix, best, pruning_factor, budget, texture,
            )  # fmt: skip
            deeper = deeper and level > -20
        level, side, i, j = next_box(deeper, level, side, i, j, top, u, v)
    return best, budget

"""h = Σ c_j β(x/p_x - j), a cubic B-spline profile; constant along y."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.contacts.closest.line_search import (
    descend,
    evaluate_box,
    next_interval,
    search_line_within_budget,
)
from asperity.contacts.sampler_interface import (
    PRUNED_BOX_COST,
    ROUNDING_SLACK,
    ClosestPoint,
    Derivatives,
)
from asperity.contacts.sampler_interface import LinePoint as Point
from asperity.core.compiled import EPS, EVERY_FUNCTION, FloatArray, Kernels
from asperity.textures.spline.bspline_kernels import (
    Vector4,
    box_bounds,
    bspline_first_weights,
    bspline_second_weights,
    bspline_weights,
    dot4,
    find_cell,
    is_taylor_conclusive,
    lateral_reach,
    max_copy_distance,
    tile_transform,
)

KERNELS = Kernels(provides=EVERY_FUNCTION, shared=("closest_point", "search_line"))


class ProfileArguments(NamedTuple):
    """Record of a profile passed to the functions below.

    Attributes:
        c: coefficients [m], with one extra before the first cell and two after the last.
        ix: nodes per metre.
        x0: the first node [m].
        periodic: whether the profile repeats.
        boxes: bounds of the boxes of the pyramid, see :mod:`asperity.textures.spline.pyramid`.
        levels: index of the first box and number of boxes of each level.
    """

    c: FloatArray
    ix: float
    x0: float
    periodic: bool
    boxes: NDArray[np.float32]
    levels: NDArray[np.int64]


def local_coefficients(x: float, texture: ProfileArguments) -> tuple[Vector4, float, float]:
    """Return the four coefficients at x, the position in its cell and the sign of the slope."""
    c = texture.c
    j, t, sign = find_cell(x, texture.x0, texture.ix, c.size - 3, texture.periodic)
    return (c[j], c[j + 1], c[j + 2], c[j + 3]), t, sign


def sample_height(x: float, y: float, texture: ProfileArguments) -> float:
    """Return h [m]."""
    c, t, _sign = local_coefficients(x, texture)
    return dot4(bspline_weights(t), c)


def sample_gradient(x: float, y: float, texture: ProfileArguments) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    c, t, sign = local_coefficients(x, texture)
    return dot4(bspline_weights(t), c), sign * texture.ix * dot4(bspline_first_weights(t), c), 0.0


def sample_hessian(x: float, y: float, texture: ProfileArguments) -> Derivatives:
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    c, t, sign = local_coefficients(x, texture)
    hx = sign * texture.ix * dot4(bspline_first_weights(t), c)
    hxx = texture.ix * texture.ix * dot4(bspline_second_weights(t), c)
    return dot4(bspline_weights(t), c), hx, 0.0, hxx, 0.0, 0.0


def sample_profile(x: float, texture: ProfileArguments) -> tuple[float, float, float]:
    """Return h [m], h' [1], h'' [1/m]."""
    h, h1, _hy, h2, _hxy, _hyy = sample_hessian(x, 0.0, texture)
    return h, h1, h2


def closest_point(x: float, y: float, z: float, texture: ProfileArguments) -> ClosestPoint:
    """Return X, Y of the globally closest surface point, and h, h_x, h_y there; Y = y.

    Descend from the probe, then search everything that may be closer.
    """
    best = descend(x, z, x, texture)
    best, _budget = search_line(x, z, best, 1.0 - ROUNDING_SLACK * EPS, np.inf, texture)
    return best[0], y, best[2], best[3], 0.0


def closest_point_within_budget(
    x: float, y: float, z: float, start_x: float, start_y: float, budget: float,
    texture: ProfileArguments,
) -> tuple[float, float, float, float, float, float, float]:  # fmt: skip
    """Return the closest point found within a budget; see ``contacts.sampler_interface``."""
    best, gap, evaluations = search_line_within_budget(x, z, start_x, budget, texture)
    return best[0], y, best[2], best[3], 0.0, gap, evaluations


# The probe x, z, and the pruning factor of ``line_search``.
Query = tuple[float, float, float]


def search_line(
    x: float, z: float, best: Point, pruning_factor: float, budget: float, texture: ProfileArguments
) -> tuple[Point, float]:
    """Return the best point after a search of all copies of the profile, and the remaining budget.

    Only points within the distance of the best one can be closer. The line is tiled by copies of
    the profile, every other one mirrored if it is finite; each is searched from the coarsest
    intervals of the pyramid down.
    """
    cells = texture.c.size - 3
    query = (x, z, pruning_factor)
    middle = math.floor((x - texture.x0) * texture.ix / cells)
    best, budget = search_tile(query, middle, best, budget, texture)
    # Of the copies of a point only the closest counts.
    reach = min(
        lateral_reach(z, best[1], texture.boxes),
        max_copy_distance(cells / texture.ix, texture.periodic),
    )
    first = math.floor((x - reach - texture.x0) * texture.ix / cells)
    last = math.floor((x + reach - texture.x0) * texture.ix / cells)
    for tile in range(first, last + 1):
        if tile != middle and budget > 0.0:
            best, budget = search_tile(query, tile, best, budget, texture)
    return best, budget


def search_tile(
    query: Query, tile: int, best: Point, budget: float, texture: ProfileArguments
) -> tuple[Point, float]:
    """Return the best point after a search of one copy of the profile, and the remaining budget.

    The probe and the best point are transformed into the coordinates of the profile itself.
    """
    x, z, pruning_factor = query
    cells = texture.c.size - 3
    reach = lateral_reach(z, best[1], texture.boxes)
    sign, shift = tile_transform(tile, cells, texture.ix, texture.x0, texture.periodic)
    x = sign * x + shift
    query = (x, z, pruning_factor)
    found = (sign * best[0] + shift, best[1], best[2], sign * best[3])
    low = max(math.floor((x - reach - texture.x0) * texture.ix), 0)
    high = min(math.floor((x + reach - texture.x0) * texture.ix), cells - 1)
    top = 0
    while top < texture.levels.shape[0] - 1 and (high - low) >> top > 0:
        top += 1
    for i in range(low >> top, (high >> top) + 1):
        if budget > 0.0:
            found, budget = search_tree(query, top, i, found, budget, texture)
    if found[1] < best[1]:
        return (sign * (found[0] - shift), found[1], found[2], sign * found[3]), budget
    return best, budget


def search_tree(
    query: Query, top: int, i: int, best: Point, budget: float, texture: ProfileArguments
) -> tuple[Point, float]:
    """Return the best point after a search of interval i of level top, and the remaining budget.

    The interval is 2^top cells long.
    """
    x, z, pruning_factor = query
    ix = texture.ix
    x0 = texture.x0
    cells = float(texture.c.size - 3)
    pitch = 1.0 / ix
    u = (x - x0) * ix
    level = top
    side = 2.0**top
    low = high = hessian = third = 0.0
    while level <= top and budget > 0.0:
        budget -= PRUNED_BOX_COST
        start = i * side
        end = min(start + side, cells)
        deeper = start < end
        if deeper:
            if level >= 0:
                low, high, hessian, third = box_bounds(texture.boxes, texture.levels[level, 0] + i)
            near = max(start - u, u - end, 0.0) * pitch
            gap = max(low - z, z - high, 0.0)
            deeper = near * near + gap * gap < best[1] * pruning_factor
        if deeper and (level <= 0 or is_taylor_conclusive(z, low, high, hessian, third, side, ix)):
            best, deeper, budget = evaluate_box(
                x, z, x0 + 0.5 * (start + end) * pitch, 0.5 * (end - start) * pitch,
                hessian * ix, third * ix * ix, best, pruning_factor, budget, texture,
            )  # fmt: skip
            deeper = deeper and level > -20
        level, side, i = next_interval(deeper, level, side, i, top, u)
    return best, budget

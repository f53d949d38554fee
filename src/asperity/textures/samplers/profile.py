"""h = Σ c_j β(x/p_x - j), a cubic B-spline profile; constant along y."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.compiled import EPS, Kernels
from asperity.contacts.nearest.line_search import descend, judge, next_part
from asperity.contacts.nearest.line_within import line_within
from asperity.contacts.sampler import PASSED, SLACK
from asperity.contacts.sampler import LinePoint as Point
from asperity.textures.samplers.spline import (
    Four,
    box_bounds,
    cell_at,
    dot4,
    foreseeable,
    nearest_copy,
    reach_of,
    tile_frame,
    weights,
    weights_first,
    weights_second,
)

KERNELS = Kernels(
    provides=("along", "curvature", "foot", "foot_within", "height", "search_line", "slope"),
    requires=(
        "descend", "judge", "line_within", "next_part",
        "box_bounds", "cell_at", "dot4", "foreseeable", "nearest_copy", "reach_of", "tile_frame",
        "weights", "weights_first", "weights_second",
    ),
    called=("foot", "search_tile", "search_tree"),
    shared=("search_line",),
)  # fmt: skip


class ProfileArguments(NamedTuple):
    """What the functions below receive of a profile.

    Attributes:
        c: coefficients [m], with one extra before the first cell and two after the last.
        ix: nodes per metre.
        x0: the first node [m].
        periodic: whether the profile repeats.
        nodes: bounds of the boxes of the pyramid, see :mod:`asperity.textures.pyramid`.
        levels: where its levels begin in them.
    """

    c: FloatArray
    ix: float
    x0: float
    periodic: bool
    nodes: NDArray[np.float32]
    levels: NDArray[np.int64]


def spline_at(x: float, texture: ProfileArguments) -> tuple[Four, float, float]:
    """Return the four coefficients that count at x, the place in its cell and the slope's sign."""
    c = texture.c
    j, t, sign = cell_at(x, texture.x0, texture.ix, c.size - 3, texture.periodic)
    return (c[j], c[j + 1], c[j + 2], c[j + 3]), t, sign


def height(x: float, y: float, texture: ProfileArguments) -> float:
    """Return h [m]."""
    c, t, _sign = spline_at(x, texture)
    return dot4(weights(t), c)


def slope(x: float, y: float, texture: ProfileArguments) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    c, t, sign = spline_at(x, texture)
    return dot4(weights(t), c), sign * texture.ix * dot4(weights_first(t), c), 0.0


def curvature(
    x: float, y: float, texture: ProfileArguments
) -> tuple[float, float, float, float, float, float]:
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    c, t, sign = spline_at(x, texture)
    hx = sign * texture.ix * dot4(weights_first(t), c)
    hxx = texture.ix * texture.ix * dot4(weights_second(t), c)
    return dot4(weights(t), c), hx, 0.0, hxx, 0.0, 0.0


def along(x: float, texture: ProfileArguments) -> tuple[float, float, float]:
    """Return h [m], h' [1], h'' [1/m]."""
    h, h1, _hy, h2, _hxy, _hyy = curvature(x, 0.0, texture)
    return h, h1, h2


def foot(
    x: float, y: float, z: float, texture: ProfileArguments
) -> tuple[float, float, float, float, float]:
    """Return X, Y of the globally nearest surface point, and h, h_x, h_y there; Y = y.

    Downhill from the probe, then whatever can be nearer.
    """
    best = descend(x, z, x, texture)
    best, _left = search_line(x, z, best, 1.0 - SLACK * EPS, np.inf, texture)
    return best[0], y, best[2], best[3], 0.0


def foot_within(
    x: float, y: float, z: float, start_x: float, start_y: float, budget: float,
    texture: ProfileArguments,
) -> tuple[float, float, float, float, float, float, float]:  # fmt: skip
    """Return the foot as far as a budget of looks finds it; see ``contacts.sampler``."""
    best, gap, looks = line_within(x, z, start_x, budget, texture)
    return best[0], y, best[2], best[3], 0.0, gap, looks


def search_line(
    x: float, z: float, best: Point, keep: float, left: float, texture: ProfileArguments
) -> tuple[Point, float]:
    """Return the best point after a search of all copies of the profile, and the looks left.

    Only points within the distance of the best can be nearer. The line is tiled by copies of the
    profile, every other one mirrored if it is finite; each is searched from the coarsest intervals
    of the pyramid down.
    """
    cells = texture.c.size - 3
    middle = math.floor((x - texture.x0) * texture.ix / cells)
    best, left = search_tile(x, z, middle, best, keep, left, texture)
    # Of the copies of a point only the nearest counts.
    reach = min(
        reach_of(z, best[1], texture.nodes), nearest_copy(cells / texture.ix, texture.periodic)
    )
    first = math.floor((x - reach - texture.x0) * texture.ix / cells)
    last = math.floor((x + reach - texture.x0) * texture.ix / cells)
    for tile in range(first, last + 1):
        if tile != middle and left > 0.0:
            best, left = search_tile(x, z, tile, best, keep, left, texture)
    return best, left


def search_tile(
    x: float, z: float, tile: int, best: Point, keep: float, left: float, texture: ProfileArguments
) -> tuple[Point, float]:
    """Return the best point after a search of one copy of the profile, and the looks left.

    Probe and best point are moved to where they are seen from the profile itself.
    """
    cells = texture.c.size - 3
    reach = reach_of(z, best[1], texture.nodes)
    turn, shift = tile_frame(tile, cells, texture.ix, texture.x0, texture.periodic)
    x = turn * x + shift
    found = (turn * best[0] + shift, best[1], best[2], turn * best[3])
    low = max(math.floor((x - reach - texture.x0) * texture.ix), 0)
    high = min(math.floor((x + reach - texture.x0) * texture.ix), cells - 1)
    top = 0
    while top < texture.levels.shape[0] - 1 and (high - low) >> top > 0:
        top += 1
    for i in range(low >> top, (high >> top) + 1):
        if left > 0.0:
            found, left = search_tree(x, z, top, i, found, keep, left, texture)
    if found[1] < best[1]:
        return (turn * (found[0] - shift), found[1], found[2], turn * found[3]), left
    return best, left


def search_tree(
    x: float, z: float, top: int, i: int, best: Point, keep: float, left: float,
    texture: ProfileArguments,
) -> tuple[Point, float]:  # fmt: skip
    """Return the best point after a search of interval i of level top, and the looks left.

    The interval is 2^top cells long.
    """
    ix = texture.ix
    x0 = texture.x0
    cells = float(texture.c.size - 3)
    pitch = 1.0 / ix
    u = (x - x0) * ix
    level = top
    side = 2.0**top
    low = high = bend = twist = 0.0
    while level <= top and left > 0.0:
        left -= PASSED
        start = i * side
        end = min(start + side, cells)
        deeper = start < end
        if deeper:
            if level >= 0:
                low, high, bend, twist = box_bounds(texture.nodes, texture.levels[level, 0] + i)
            near = max(start - u, u - end, 0.0) * pitch
            gap = max(low - z, z - high, 0.0)
            deeper = near * near + gap * gap < best[1] * keep
        if deeper and (level <= 0 or foreseeable(z, low, high, bend, twist, side, ix)):
            best, deeper, left = judge(
                x, z, x0 + 0.5 * (start + end) * pitch, 0.5 * (end - start) * pitch,
                bend * ix, twist * ix * ix, best, keep, left, texture,
            )  # fmt: skip
            deeper = deeper and level > -20
        if deeper:
            level -= 1
            side *= 0.5
            i = 2 * i + (1 if u >= (2 * i + 1) * side else 0)
        else:
            level, side, i = next_part(level, side, i, top, u)
    return best, left

"""Which cells of a map can hold a point nearer than the best one: windows, made narrow.

With φ, the squared distance, as in ``plane_search``: for every number g it is nowhere below

    ψ = (X - x)² + (Y - y)² + 2 g (h - z) - g²,

because (h - z)² >= 2 g (h - z) - g². With g = h - z at a minimum of φ, ψ touches φ there and is
level, too. And ψ is a bicubic spline: X² has the coefficients p_x² (j² - 1/3), so those of ψ follow
from those of h one by one. Where none of the sixteen that count in a cell is less than φ of the
best, the cell holds no nearer point. So only the cells about the minimum remain, and nothing in
them is nearer if ψ rises from it along all straight lines; its second derivatives are those of
2 (I + g Hess h).

A window is the first and last column and row of its cells; it is empty if a last one is before the
first.
"""

import math

import numpy as np

from asperity.compiled import EPS, Kernels, local_array
from asperity.contacts.nearest.plane_search import eigenvalues
from asperity.contacts.sampler import PASSED
from asperity.contacts.sampler import PlanePoint as Point
from asperity.textures.samplers.heightmap import HeightMapArguments, curvature
from asperity.textures.samplers.spline import box_bounds

KERNELS = Kernels(
    provides=("cells_within", "is_empty", "narrowed"),
    requires=("box_bounds", "curvature", "eigenvalues"),
    merged=("boxes_within", "narrowed", "rises"),
)

# Cells a side of a window that is looked at as boxes, and boxes a side, at first and at most.
FEW = 20
BOXES = 5
MANY_BOXES = 8
# Coefficients along x and in all of a window whose coefficients are looked at.
NARROW = 64
MANY = 1200
# Coefficients take so much of the time of a box.
SWIFT = 1.0 / 16.0

Window = tuple[int, int, int, int]


def is_empty(window: Window) -> bool:
    """Return whether a window has no cells."""
    return window[0] > window[1] or window[2] > window[3]


def narrowed(
    x: float, y: float, z: float, best: Point, keep: float, window: Window, left: float,
    texture: HeightMapArguments,
) -> tuple[Window, float]:  # fmt: skip
    """Return the part of a window that is still to be searched, and the looks left."""
    enough = best[2] * keep
    size = max(window[1] - window[0], window[3] - window[2])
    level = 1
    while size >> level >= BOXES:
        level += 1
    level = min(level, texture.levels.shape[0])
    while size >= FEW and level > 0 and size >> level < MANY_BOXES and left > 8.0:
        window = boxes_within(x, y, z, enough, level, window, texture)
        left -= PASSED * ((size >> level) + 1) ** 2
        size = max(window[1] - window[0], window[3] - window[2])
        level -= 1
    west, east, south, north = window
    count = (east - west + 4) * (north - south + 4)
    cost = PASSED * SWIFT * count + 3.0
    if is_empty(window) or east - west + 4 > NARROW or count > MANY or left <= cost:
        return window, left
    window = cells_within(x, y, z, best[3] - z, enough, window, texture)
    if is_empty(window) or rises(x, y, z, best, window, texture):
        return (0, -1, 0, -1), left - cost
    return window, left - cost


def boxes_within(
    x: float, y: float, z: float, enough: float, level: int, window: Window,
    texture: HeightMapArguments,
) -> Window:  # fmt: skip
    """Return the part of a window with the boxes of a level in which φ may be less than enough."""
    west, east, south, north = window
    half = 0.5 * 2.0**level
    u = (x - texture.x0) * texture.ix
    v = (y - texture.y0) * texture.iy
    first_i = north
    first_j = east
    last_i = last_j = -1
    for i in range(south >> level, (north >> level) + 1):
        away_y = max(abs((2 * i + 1) * half - v) - half, 0.0) / texture.iy
        row = texture.levels[level - 1, 0] + i * texture.levels[level - 1, 2]
        for j in range(west >> level, (east >> level) + 1):
            away_x = max(abs((2 * j + 1) * half - u) - half, 0.0) / texture.ix
            low, high, _bend, _twist = box_bounds(texture.nodes, row + j)
            gap = max(low - z, z - high, 0.0)
            if away_x * away_x + away_y * away_y + gap * gap < enough:
                first_i = min(first_i, i)
                first_j = min(first_j, j)
                last_i = i
                last_j = max(last_j, j)
    return (
        max(west, first_j << level), min(east, ((last_j + 1) << level) - 1),
        max(south, first_i << level), min(north, ((last_i + 1) << level) - 1),
    )  # fmt: skip


def cells_within(
    x: float, y: float, z: float, gap: float, enough: float, window: Window,
    texture: HeightMapArguments,
) -> Window:  # fmt: skip
    """Return the part of a window with the cells in which a coefficient of ψ is less than enough.

    It has at most ``NARROW`` coefficients along x.
    """
    # What is known not to be negative lets the compiler use vector registers.
    west = max(window[0], 0)
    east = window[1]
    south = max(window[2], 0)
    north = window[3]
    columns = local_array((64,))
    c = texture.c
    used = east - west + 4
    count = min((used + 7) & -8, c.shape[1] - west)  # whole registers, as far as there are numbers
    px = 1.0 / texture.ix
    py = 1.0 / texture.iy
    for m in range(count):
        away = west + m - 1 - (x - texture.x0) * texture.ix
        columns[m] = (away * away - 1.0 / 3.0) * px * px
    for m in range(used, count):
        columns[m] = np.inf
    first_i = north + 4
    first_j = east + 4
    last_i = last_j = -1
    for i in range(south, north + 4):
        away = i - 1 - (y - texture.y0) * texture.iy
        rest = enough + gap * gap - (away * away - 1.0 / 3.0) * py * py
        less = 0
        for m in range(count):
            if columns[m] + 2.0 * gap * (c[i, west + m] - z) < rest:
                less += 1
        if less > 0:
            first_i = min(first_i, i)
            last_i = i
            for m in range(count):
                if columns[m] + 2.0 * gap * (c[i, west + m] - z) < rest:
                    first_j = min(first_j, west + m)
                    last_j = max(last_j, west + m)
    return max(west, first_j - 3), min(east, last_j), max(south, first_i - 3), min(north, last_i)


def rises(
    x: float, y: float, z: float, best: Point, window: Window, texture: HeightMapArguments
) -> bool:
    """Return whether ψ rises from the best point along all straight lines within a window.

    From its second derivatives at the point, how fast they can fall, and how far at most.
    """
    west, east, south, north = window
    gap = best[3] - z
    u = (best[0] - texture.x0) * texture.ix
    v = (best[1] - texture.y0) * texture.iy
    # A point that is not level to rounding is no minimum.
    slope_x = best[0] - x + gap * best[4]
    slope_y = best[1] - y + gap * best[5]
    level = 10.0 * (slope_x * slope_x + slope_y * slope_y) <= EPS * best[2]
    if not level or u < west or u > east + 1 or v < south or v > north + 1:
        return False
    # Below the surface only crests are bent towards the probe.
    bound = 4 if gap > 0.0 else 2
    bend = 0.0
    twist = 0.0
    for i in range(south >> 1, (north >> 1) + 1):
        row = texture.levels[0, 0] + i * texture.levels[0, 2]
        for j in range(west >> 1, (east >> 1) + 1):
            bend = max(bend, float(texture.nodes[row + j, bound]))
            twist = max(twist, float(texture.nodes[row + j, 3]))
    least = 1.0 - abs(gap) * bend * texture.ix
    if least > 1e-3:
        return True
    _h, _hx, _hy, hxx, hxy, hyy = curvature(best[0], best[1], texture)
    low, _high = eigenvalues(1.0 + gap * hxx, gap * hxy, 1.0 + gap * hyy)
    rate = abs(gap) * twist * texture.ix * texture.ix
    dx = max(u - west, east + 1 - u) / texture.ix
    dy = max(v - south, north + 1 - v) / texture.iy
    r = math.sqrt(dx * dx + dy * dy)
    return risen(low, least, rate, r) > 1e-3 * r * r


def risen(start: float, least: float, rate: float, r: float) -> float:
    """Return by how much a function rises at least over a length r on which it is level at first.

    Its second derivative is at first the start, falls at the rate at most, and is never below the
    least.
    """
    t = min(max((start - least) / max(rate, 1e-300), 0.0), r)
    rest = r - t
    return t * (start * (r - 0.5 * t) - rate * t * (0.5 * r - t / 3.0)) + 0.5 * least * rest * rest

"""Certified search for the closest point of a surface: branch and bound over boxes.

A box is a rectangle of the plane; that of a profile or of parallel waves is a segment of a line,
a box with one degenerate axis. A texture kind states bounds of the surface on a box,
``enclose_box``. It may provide more of the functions at the end, whose defaults hold for every
kind: where the search begins and what its coordinates are, sharper bounds, and how a box is
narrowed or divided. The boxes that are left lie on a stack, with lower bounds of φ, the one
nearest to the best point on top.

Taylor's formula decides boxes far from all local minima of φ (``distance_bounds``). Around a
minimum a certificate does. For every number g, φ is nowhere below

    ψ = |(X, Y) - (x, y)|² + 2 g (h - z) - g²,

because (h - z)² >= 2 g (h - z) - g². With g = h - z at the minimum, ψ touches φ there, and its
gradient is zero there too. Its second derivatives are those of 2 (I + g Hess h), so bounds of
Hess h and D³h show how far around the minimum nothing is closer.

A search counts evaluations of the surface: an evaluation of a sum of many waves counts as several
(``evaluation_cost``), and eight pruned boxes count as one. What is farther than ``factor`` times
the squared distance of the best point is pruned; the factor is 1 less rounding for the closest
point itself. The search is truncated once the evaluations that are left are used up.

Three quarters of a budget are for the closest point itself. If they do not suffice, the rest is
for passes over everything that can be closer; each pass prunes what is closer than the best point
by less than a fraction of its distance. The first fraction is a quarter, so that the pass ends
after few evaluations; each further pass prunes a quarter of what the one before did. The last
completed pass bounds the error. The work grows with the accuracy, as in a best-first search.
"""

import math

import numpy as np

from asperity.contacts.distance_bounds import (
    can_prune,
    descend,
    descend_within_budget,
    min_increase,
    supporting_bound,
    symmetric_eigenvalues,
    taylor_remainders,
)
from asperity.contacts.sampler_interface import (
    DESCEND,
    DIVIDE,
    EXPAND,
    PRUNED_BOX_COST,
    ROUNDING_SLACK,
    Ball,
    Bounds,
    Box,
    ClosestPoint,
    Derivatives,
    Frame,
    Minimum,
    Point,
    enclose_box,
    sample_hessian,
)
from asperity.core.compiled import EPS, EVERY_FUNCTION, SQRT_EPS, FloatArray, Kernels, local_array

KERNELS = Kernels(
    provides=EVERY_FUNCTION,
    shared=("closest_point", "closest_point_within_budget", "search_boxes"),
    iterates=True,
)

# Least size of a box that is divided, as a share of the search region. Dividing one box after the
# other down to it takes 90 of the 256 rows of the stack.
MIN_SHARE = 2.0**-30
# Greatest number of boxes on the stack after a box is divided into more than four, and that which
# leaves rows for four.
MAX_BOXES = 150
FULL_STACK = 252


def closest_point(x: float, y: float, z: float, texture: object) -> ClosestPoint:
    """Return X, Y of the globally closest surface point, and h, h_x, h_y there.

    Descend from the probe, then search everything that may be closer.
    """
    best = descend(x, y, z, x, y, texture)
    best, _left = search_boxes(x, y, z, best, 1.0 - ROUNDING_SLACK * EPS, np.inf, texture)
    return best[0], best[1], best[3], best[4], best[5]


def closest_point_within_budget(
    x: float, y: float, z: float, start_x: float, start_y: float, budget: float, texture: object
) -> tuple[float, float, float, float, float, float, float]:
    """Return the closest point found within a budget; see ``sampler_interface``."""
    frame = search_frame(x, y, texture)
    if frame[5] == 0.0:  # a line through the probe
        along = (start_x - x) * frame[2] + (start_y - y) * frame[3]
        start_x = x + along * frame[2]
        start_y = y + along * frame[3]
    best, left = descend_within_budget(x, y, z, start_x, start_y, 0.75 * budget, texture)
    best, left = search_boxes(x, y, z, best, 1.0 - ROUNDING_SLACK * EPS, left, texture)
    share = 0.0 if left > 0.0 else 1.0
    left += 0.25 * budget
    # At most as many passes as there are digits; none after a complete search.
    while left > 0.0 and share > 4.0 * EPS:
        root = 1.0 - 0.25 * share
        best, left = search_boxes(x, y, z, best, root * root, left, texture)
        if left > 0.0:
            share *= 0.25
    error_bound = share * math.sqrt(best[2])
    return best[0], best[1], best[3], best[4], best[5], error_bound, budget - left


def search_boxes(
    x: float, y: float, z: float, best: Point, factor: float, left: float, texture: object
) -> tuple[Point, float]:
    """Return the best point after a search of all that can be closer, and the evaluations left."""
    stack = local_array((256, 5))
    frame = search_frame(x, y, texture)
    west, east, south, north = search_region(x, y, z, best[2], texture)
    smallest = MIN_SHARE * max((east - west) * frame[4], (north - south) * frame[5])
    count = push_box((west, east, south, north), 0.0, stack, 0)
    near = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    last = near
    has_minimum = False
    while count > 0 and left > 0.0:
        count -= 1
        left -= PRUNED_BOX_COST
        ball = (x, y, z, best[2] * factor)
        if stack[count, 4] >= ball[3]:
            continue
        box = (stack[count, 0], stack[count, 1], stack[count, 2], stack[count, 3])
        box, left = narrow_box(ball, best[3] - z, box, left, texture)
        west, east, south, north = box
        if west > east or south > north:
            continue
        if not has_minimum:  # it takes an evaluation, which most shallow probes do not need
            near = minimum_at((x, y, z), frame, best, texture)
            last = near
            has_minimum = True
        best, near, last, is_open, left = examine_box(
            (x, y, z), factor, frame, box, best, near, last, left, texture
        )
        side = max((east - west) * frame[4], (north - south) * frame[5])
        if is_open and side > smallest:
            if count > FULL_STACK:  # the search is truncated
                return best, 0.0
            ball = (x, y, z, best[2] * factor)
            count, left = divide_box(ball, frame, near, box, stack, count, left, texture)
    return best, left


def examine_box(
    probe: tuple[float, float, float],
    factor: float,
    frame: Frame,
    box: Box,
    best: Point,
    near: Minimum,
    last: Minimum,
    left: float,
    texture: object,
) -> tuple[Point, Minimum, Minimum, bool, float]:
    """Examine a box: return the best point, two minima, whether to divide it, evaluations left.

    The two minima, at the best point and at the one found last, mostly exclude a box near them.
    """
    x, y, z = probe
    ball = (x, y, z, best[2] * factor)
    bounds = enclose_box(box, texture)
    is_excluded = excludes_box(ball, frame, near, box, bounds, texture)
    if not is_excluded and (last[0] != near[0] or last[1] != near[1]):
        is_excluded = excludes_box(ball, frame, last, box, bounds, texture)
    if is_excluded:
        return best, near, last, False, left
    if distance_to_box(ball, frame, box, bounds) >= ball[3]:
        return best, near, last, False, left
    effort = effort_of_box(z, frame, box, bounds)
    if effort == DIVIDE:
        return best, near, last, True, left
    reach = 0.5 * max(box[1] - box[0], box[3] - box[2])
    if effort == DESCEND and min(outside_box(near, box), outside_box(last, box)) > reach:
        cx, cy = box_centre(frame, box)
        found, left = descend_within_budget(x, y, z, cx, cy, left, texture)
        last = minimum_at(probe, frame, found, texture)
        if found[2] < best[2]:
            best = found
            near = last
            ball = (x, y, z, best[2] * factor)
        if left <= 0.0:
            return best, near, last, True, left
        if excludes_box(ball, frame, last, box, bounds, texture):
            return best, near, last, False, left
    return expand_and_prune(ball, frame, box, bounds, best, near, last, left, texture)


def expand_and_prune(
    ball: Ball,
    frame: Frame,
    box: Box,
    bounds: Bounds,
    best: Point,
    near: Minimum,
    last: Minimum,
    left: float,
    texture: object,
) -> tuple[Point, Minimum, Minimum, bool, float]:
    """Decide a box by Taylor's formula at its centre; see ``examine_box``."""
    x, y, z, threshold = ball
    cx, cy = box_centre(frame, box)
    du, dv = to_frame(cx - x, cy - y, frame)
    a = 0.5 * (box[1] - box[0]) * frame[4]
    b = 0.5 * (box[3] - box[2]) * frame[5]
    r = math.sqrt(a * a + b * b)
    derivatives, remainders, left = expand_box(cx, cy, z, r, bounds, left, texture)
    h, hu, hv, huu, huv, hvv = derivatives
    change, tangent_error, third = remainders
    gap = h - z
    offset = (du, dv, gap)
    q = (1.0 + hu * hu + gap * huu, hu * hv + gap * huv, 1.0 + hv * hv + gap * hvv)
    low, _high = symmetric_eigenvalues(q[0], q[1], q[2])
    if can_prune(offset, hu, hv, q, low, change, tangent_error, a, b, threshold) or (
        supporting_bound(offset, derivatives, third, a, b) >= threshold
    ):
        return best, near, last, False, left
    if low <= change or left <= 0.0:
        return best, near, last, True, left
    det = q[0] * q[2] - q[1] * q[1]
    su = (q[1] * (dv + gap * hv) - q[2] * (du + gap * hu)) / det
    sv = (q[1] * (du + gap * hu) - q[0] * (dv + gap * hv)) / det
    # Convex in the box: the only minimum is where Newton's method leads, or not in the box.
    error = 1e-6 * r + 0.5 * change * r / low
    # A minimum on the border of the box counts, as on the mirror lines of a finite map.
    if abs(su) > a + error or abs(sv) > b + error:
        return best, near, last, False, left
    start_x = cx + su * frame[2] - sv * frame[3]
    start_y = cy + su * frame[3] + sv * frame[2]
    if outside_box(near, box) <= 0.0:
        start_x = best[0]
        start_y = best[1]
    found, left = descend_within_budget(x, y, z, start_x, start_y, left, texture)
    last = minimum_at((x, y, z), frame, found, texture)
    slack = 0.035 * SQRT_EPS * max(box[1] - box[0], box[3] - box[2])
    if found[2] < best[2]:
        best = found
        near = last
    return best, near, last, outside_box(last, box) > slack, left


def minimum_at(
    probe: tuple[float, float, float], frame: Frame, point: Point, texture: object
) -> Minimum:
    """Return what certificates need of a local minimum of φ."""
    x, y, z = probe
    px, py, phi, h, hx, hy = point
    gap = h - z
    slope_x = px - x + gap * hx
    slope_y = py - y + gap * hy
    _h, _hx, _hy, hxx, hxy, hyy = sample_hessian(px, py, texture)
    low, _high = symmetric_eigenvalues(1.0 + gap * hxx, gap * hxy, 1.0 + gap * hyy)
    # A point whose gradient is not zero to rounding is no minimum.
    if 10.0 * (slope_x * slope_x + slope_y * slope_y) > EPS * phi:
        low = -np.inf
    along, across = to_frame(px - frame[0], py - frame[1], frame)
    v = across / frame[5] if frame[5] > 0.0 else 0.0
    return along / frame[4], v, gap, low, hxx, hxy, hyy


def excludes_box(
    ball: Ball, frame: Frame, minimum: Minimum, box: Box, bounds: Bounds, texture: object
) -> bool:
    """Return whether a local minimum of φ certifies that no point of a box is closer."""
    u, v, gap, low, _hxx, _hxy, _hyy = minimum
    if outside_box(minimum, box) > 0.0:
        return can_prune_near(ball, minimum, box, texture)
    a = max(u - box[0], box[1] - u) * frame[4]
    b = max(v - box[2], box[3] - v) * frame[5]
    r = math.sqrt(a * a + b * b)
    _low, _high, hessian, third, crest, _effort = bounds
    # Below the surface only crests curve towards the probe.
    least = 1.0 - abs(gap) * (crest if gap > 0.0 else hessian)
    if low > 0.0 and min_increase(low, least, abs(gap) * third, r) > 1e-3 * r * r:
        return True
    return can_prune_near(ball, minimum, box, texture)


def to_frame(dx: float, dy: float, frame: Frame) -> tuple[float, float]:
    """Return the components of a vector along the axes of the boxes [m]."""
    return dx * frame[2] + dy * frame[3], dy * frame[2] - dx * frame[3]


def box_centre(frame: Frame, box: Box) -> tuple[float, float]:
    """Return the centre of a box [m]."""
    x0, y0, ux, uy, pitch_u, pitch_v = frame
    along = 0.5 * (box[0] + box[1]) * pitch_u
    across = 0.5 * (box[2] + box[3]) * pitch_v
    return x0 + along * ux - across * uy, y0 + along * uy + across * ux


def outside_box(minimum: Minimum, box: Box) -> float:
    """Return how far a minimum is outside of a box along an axis; not positive inside."""
    u = minimum[0]
    v = minimum[1]
    return max(box[0] - u, u - box[1], box[2] - v, v - box[3])


def distance_to_box(ball: Ball, frame: Frame, box: Box, bounds: Bounds) -> float:
    """Return the squared distance of the probe from a box with its least and greatest height."""
    cx, cy = box_centre(frame, box)
    du, dv = to_frame(cx - ball[0], cy - ball[1], frame)
    du = max(abs(du) - 0.5 * (box[1] - box[0]) * frame[4], 0.0)
    dv = max(abs(dv) - 0.5 * (box[3] - box[2]) * frame[5], 0.0)
    gap = max(bounds[0] - ball[2], ball[2] - bounds[1], 0.0)
    return du * du + dv * dv + gap * gap


def effort_of_box(z: float, frame: Frame, box: Box, bounds: Bounds) -> int:
    """Return what the kind states, or to expand: where Taylor's formula may decide a large box.

    That is, where Q changes by less than 1 on a surface that is not very steep.
    """
    low, high, hessian, third, _crest, effort = bounds
    side = max((box[1] - box[0]) * frame[4], (box[3] - box[2]) * frame[5])
    gap = max(abs(low - z), abs(high - z))
    if effort == DIVIDE and (gap * third + 3.0 * hessian) * side < 1.0:
        return EXPAND
    return effort


def push_box(box: Box, bound: float, stack: FloatArray, count: int) -> int:
    """Put a box and a lower bound of φ in it on the stack; return the number of boxes."""
    for k in range(4):
        stack[count, k] = box[k]
    stack[count, 4] = bound
    return count + 1


def split_box(
    frame: Frame, minimum: Minimum, box: Box, stack: FloatArray, count: int, texture: object
) -> int:
    """Put the halves or quarters of a box on the stack, the one nearest to a minimum on top.

    An axis is halved unless the other is more than twice as long, or no number lies between its
    ends: a box that cannot be halved is as small as rounding. Return the number of boxes.
    """
    west, east, south, north = box
    width = (east - west) * frame[4]
    height = (north - south) * frame[5]
    middle_u = box_middle(west, east, 0, texture) if width > 0.5 * height else east
    middle_v = box_middle(south, north, 1, texture) if height > 0.5 * width else north
    if middle_u <= west:
        middle_u = east
    if middle_v <= south:
        middle_v = north
    if middle_u == east and middle_v == north:
        return count
    right = minimum[0] >= middle_u
    upper = minimum[1] >= middle_v
    for k in range(4):
        # From the part opposite to the minimum to its own.
        is_right = right == (k % 2 == 1)
        is_upper = upper == (k // 2 == 1)
        part = (
            middle_u if is_right else west,
            east if is_right else middle_u,
            middle_v if is_upper else south,
            north if is_upper else middle_v,
        )
        if not ((is_right and middle_u == east) or (is_upper and middle_v == north)):
            count = push_box(part, 0.0, stack, count)
    return count


# --- defaults of what a texture kind may provide --------------------------------------------------


def evaluation_cost(texture: object) -> float:
    """Return 1; a texture kind that takes longer provides its own cost."""
    return 1.0


def search_frame(x: float, y: float, texture: object) -> Frame:
    """Return metres from the probe, along x and y."""
    return x, y, 1.0, 0.0, 1.0, 1.0


def search_region(x: float, y: float, z: float, square: float, texture: object) -> Box:
    """Return the square around a ball."""
    reach = math.sqrt(square)
    return -reach, reach, -reach, reach


def narrow_box(ball: Ball, gap: float, box: Box, left: float, texture: object) -> tuple[Box, float]:
    """Return the whole box."""
    return box, left


def can_prune_near(ball: Ball, minimum: Minimum, box: Box, texture: object) -> bool:
    """Return False."""
    return False


def expand_box(
    x: float, y: float, z: float, r: float, bounds: Bounds, left: float, texture: object
) -> tuple[Derivatives, tuple[float, float, float], float]:
    """Return the derivatives at the centre, and remainders from the bounds of the box."""
    derivatives = sample_hessian(x, y, texture)
    h, hx, hy, hxx, hxy, hyy = derivatives
    slope = math.sqrt(hx * hx + hy * hy)
    norm = math.sqrt(hxx * hxx + 2.0 * hxy * hxy + hyy * hyy)
    change, tangent_error = taylor_remainders(r, h - z, slope, norm, bounds[2], bounds[3])
    return derivatives, (change, tangent_error, bounds[3]), left - evaluation_cost(texture)


def divide_box(
    ball: Ball,
    frame: Frame,
    minimum: Minimum,
    box: Box,
    stack: FloatArray,
    count: int,
    left: float,
    texture: object,
) -> tuple[int, float]:
    """Put halves or quarters on the stack."""
    return split_box(frame, minimum, box, stack, count, texture), left


def box_middle(low: float, high: float, axis: int, texture: object) -> float:
    """Return the middle."""
    return 0.5 * (low + high)

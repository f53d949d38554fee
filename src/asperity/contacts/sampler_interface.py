"""Interface between compiled code and a texture: the functions of its sampler.

A texture kind implements these functions in its sampler modules and declares that they provide
them; the linker binds the calls of contacts and searches to the implementations. ``texture`` is
the record (NamedTuple) that the kind declares; it is passed on unchanged.

For the search of closest points a kind states bounds, ``enclose_box``. It may provide more, which
:mod:`asperity.contacts.closest_search` has defaults of:

* ``search_frame`` returns the coordinates of the boxes of a probe: the point (0, 0) [m], the
  direction of the first axis, and the units of both axes [m]; that of the second is 0 on a line.
* ``search_region`` returns a box with every surface point whose squared distance [m²] is less.
* ``narrow_box`` returns the part of a box that may hold a point of a ball, and the evaluations
  left. It is empty if a first border is greater than the last one. The gap is h - z at the best
  point.
* ``can_prune_near`` returns whether no point of a box near a local minimum of the distance is in a
  ball.
* ``expand_box`` returns derivatives at the centre of a box of half-diagonal r along its axes, and
  remainders. They bound how far Q is from its value at the centre, how far h is from the tangent
  plane [m], and ‖D³h‖ [1/m²]; the last value is the evaluations left.
* ``divide_box`` puts the parts of a box that may hold a point of a ball on the stack, and returns
  the number of boxes on the stack and the evaluations left. The minimum is the best point.
* ``box_middle`` returns where an axis of a box is halved.
"""

from __future__ import annotations

_SECOND_DERIVATIVES = frozenset(("hxx", "hxy", "hyy"))
_FIRST_DERIVATIVES = frozenset(("hx", "hy"))


def sampler_call(needed: frozenset[str], point: str) -> list[str]:
    """Return the line of code that samples the needed ones of h, hx, ..., hyy at a point."""
    if needed & _SECOND_DERIVATIVES:
        return [f"h, hx, hy, hxx, hxy, hyy = sample_hessian({point}, texture)"]
    if needed & _FIRST_DERIVATIVES:
        return [f"h, hx, hy = sample_gradient({point}, texture)"]
    return [f"h = sample_height({point}, texture)"] if "h" in needed else []


# A search prunes what is closer than the best by fewer rounding units; see ``closest_search``.
ROUNDING_SLACK = 450.0
# Cost of a pruned box in evaluations of the surface.
PRUNED_BOX_COST = 0.125

# What to do with a box that cannot be excluded: divide it, unless Taylor's formula may decide it;
# expand it by Taylor's formula at its centre; find a local minimum downhill from there first, if
# none near the box is known.
DIVIDE = 0
EXPAND = 1
DESCEND = 2

# h, h_x, h_y, h_xx, h_xy, h_yy, and a closest point X, Y, h, h_x, h_y.
Derivatives = tuple[float, float, float, float, float, float]
ClosestPoint = tuple[float, float, float, float, float]
# A point of the surface: X, Y, φ, h, h_x, h_y.
Point = tuple[float, float, float, float, float, float]
# A probe and the square of the radius of a ball around it: x, y, z [m], r² [m²].
Ball = tuple[float, float, float, float]
# A box of the plane: west, east, south, north; its coordinates and its bounds.
Box = tuple[float, float, float, float]
Frame = tuple[float, float, float, float, float, float]
Bounds = tuple[float, float, float, float, float, int]
# A local minimum of φ: its box coordinates, h - z, the smaller eigenvalue of I + (h - z) Hess h,
# h_xx, h_xy, h_yy.
Minimum = tuple[float, float, float, float, float, float, float]

SAMPLER_FUNCTIONS = {
    "sample_height": "heights",
    "sample_gradient": "slopes",
    "sample_hessian": "second derivatives",
    "closest_point": "closest points",
}
"""What each function samples, for messages."""


def sample_height(x: float, y: float, texture: object) -> float:
    """Return h [m]."""
    raise NotImplementedError  # the linker binds calls to the implementation


def sample_gradient(x: float, y: float, texture: object) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    raise NotImplementedError  # the linker binds calls to the implementation


def sample_hessian(x: float, y: float, texture: object) -> Derivatives:
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    raise NotImplementedError  # the linker binds calls to the implementation


def closest_point(x: float, y: float, z: float, texture: object) -> ClosestPoint:
    """Return X, Y of the globally closest surface point [m], and h [m], h_x, h_y [1] there."""
    raise NotImplementedError  # the linker binds calls to the implementation


def closest_point_within_budget(
    x: float, y: float, z: float, start_x: float, start_y: float, budget: float, texture: object
) -> tuple[float, float, float, float, float, float, float]:
    """Return the closest point found within an evaluation budget, error bound and evaluations.

    The values are X, Y, h, h_x, h_y, error bound, evaluations. No point of the surface is closer
    than this one by more than the error bound [m]; it is 0 unless the search was truncated. The
    search descends from a start; it is short if the start is near the closest point.
    """
    raise NotImplementedError  # the linker binds calls to the implementation


def evaluation_cost(texture: object) -> float:
    """Return the cost of one evaluation of the surface: its time over that of a map.

    Budgets limit time. The searches provide 1 for kinds that do not define it.
    """
    raise NotImplementedError  # the linker binds calls to the implementation


def enclose_box(box: Box, texture: object) -> Bounds:
    """Return bounds of the surface on a box, in the coordinates of ``search_frame``.

    They are the least and the greatest height [m], infinite if unknown, K >= ‖Hess h‖ [1/m],
    T >= ‖D³h‖ [1/m²], a bound of the greatest eigenvalue of -Hess h, at least 0 and at most K, and
    what to do with the box: ``DIVIDE``, ``EXPAND`` or ``DESCEND``.
    """
    raise NotImplementedError  # the linker binds calls to the implementation

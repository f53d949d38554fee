"""Interface between compiled code and a texture: the functions of its sampler.

A texture kind implements these functions in its sampler modules and declares that they provide
them; the linker binds the calls of contacts and searches to the implementations. ``texture`` is
the record (NamedTuple) that the kind declares; it is passed on unchanged.
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


# A search prunes what is closer than the best by fewer rounding units; see ``search_plane``.
ROUNDING_SLACK = 450.0
# Cost of a pruned box of the pyramid in evaluations of the surface.
PRUNED_BOX_COST = 0.125

# A point of the surface, X, Y, φ, h, h_x, h_y, and one of a profile, X, φ, h, h'.
PlanePoint = tuple[float, float, float, float, float, float]
LinePoint = tuple[float, float, float, float]

# h, h_x, h_y, h_xx, h_xy, h_yy, and a closest point X, Y, h, h_x, h_y.
Derivatives = tuple[float, float, float, float, float, float]
ClosestPoint = tuple[float, float, float, float, float]

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


def search_plane(
    x: float, y: float, z: float, best: PlanePoint, factor: float, left: float, texture: object
) -> tuple[PlanePoint, float]:
    """Return the best point after a search of everything that can be closer, and what is left.

    Boxes are pruned whose squared distance is nowhere less than ``factor`` times that of the best
    point. The search is truncated once ``left``, the number of evaluations, is used up.
    """
    raise NotImplementedError  # the linker binds calls to the implementation


def search_line(
    x: float, z: float, best: LinePoint, factor: float, left: float, texture: object
) -> tuple[LinePoint, float]:
    """Return the same for a profile; see :func:`search_plane`."""
    raise NotImplementedError  # the linker binds calls to the implementation


def sample_profile(x: float, texture: object) -> tuple[float, float, float]:
    """Return h [m], h' [1], h'' [1/m] of a texture whose heights vary along one line only."""
    raise NotImplementedError  # the linker binds calls to the implementation

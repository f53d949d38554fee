"""What compiled code asks of a texture: the functions of its sampler.

The functions are the interface alone. A texture kind defines them in its sampler and provides
them; the linker binds the calls of contacts and searches to them. ``texture`` is the record
(NamedTuple) that the kind declares: whatever it holds, it is passed on whole.
"""

from __future__ import annotations

_SECOND = frozenset(("hxx", "hxy", "hyy"))
_FIRST = frozenset(("hx", "hy"))


def sampled(wanted: frozenset[str], place: str) -> list[str]:
    """Return the line of code that samples what is wanted of h, hx, ..., hyy at a place."""
    if wanted & _SECOND:
        return [f"h, hx, hy, hxx, hxy, hyy = curvature({place}, texture)"]
    if wanted & _FIRST:
        return [f"h, hx, hy = slope({place}, texture)"]
    return [f"h = height({place}, texture)"] if "h" in wanted else []


# A search drops what is not nearer than the best by so many units of rounding; see
# ``search_plane``.
SLACK = 450.0
# A box that is passed without a look at the surface costs so many looks.
PASSED = 0.125

# A point of the surface, X, Y, φ, h, h_x, h_y, and one of a profile, X, φ, h, h'.
PlanePoint = tuple[float, float, float, float, float, float]
LinePoint = tuple[float, float, float, float]

OFFERED = {
    "height": "heights",
    "slope": "slopes",
    "curvature": "second derivatives",
    "foot": "nearest points",
}
"""What each function offers, in words."""


def height(x: float, y: float, texture: object) -> float:
    """Return h [m]."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def slope(x: float, y: float, texture: object) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def curvature(
    x: float, y: float, texture: object
) -> tuple[float, float, float, float, float, float]:
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def foot(x: float, y: float, z: float, texture: object) -> tuple[float, float, float, float, float]:
    """Return X, Y of the globally nearest surface point [m], and h [m], h_x, h_y [1] there."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def foot_within(
    x: float, y: float, z: float, start_x: float, start_y: float, budget: float, texture: object
) -> tuple[float, float, float, float, float, float, float]:
    """Return a foot as far as a budget of looks finds it: X, Y, h, h_x, h_y, the gap, the looks.

    No point of the surface is nearer than this one by more than the gap [m]; it is 0 unless the
    budget was used up. The search goes downhill from a start: near the foot, it is short.
    """
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def look_cost(texture: object) -> float:
    """Return the looks that one evaluation of the surface counts as: its time over that of a map.

    Budgets are of time. Searches bring 1 along, for kinds that do not provide it.
    """
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def search_plane(
    x: float, y: float, z: float, best: PlanePoint, keep: float, left: float, texture: object
) -> tuple[PlanePoint, float]:
    """Return the best point after a search of all that can be nearer, and the looks left.

    Dropped is what has nowhere less than ``keep`` times the square of the best's distance. If no
    looks are left the search did not come to its end.
    """
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def search_line(
    x: float, z: float, best: LinePoint, keep: float, left: float, texture: object
) -> tuple[LinePoint, float]:
    """Do the same of a profile."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def along(x: float, texture: object) -> tuple[float, float, float]:
    """Return h [m], h' [1], h'' [1/m] along a line: of kinds whose heights vary along it only."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it

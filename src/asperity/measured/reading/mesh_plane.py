"""The plane that a mesh patch lies over, and the axes in it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.errors import SurfaceFileError

_FLAT_TURN = 0.02  # a turn that saves less area than this is not worth turning the axes


@dataclass(frozen=True, eq=False)
class Plane:
    """An orthonormal frame: rows are the x axis, the y axis and the normal.

    Attributes:
        centre: area-weighted centre of the mesh [m], shape (3,).
        axes: shape (3, 3).
        notes: where the plane is.
    """

    centre: NDArray[np.float64]
    axes: NDArray[np.float64]
    notes: tuple[str, ...]

    @property
    def normal(self) -> NDArray[np.float64]:
        """The unit normal, on the side that the triangles face."""
        return np.asarray(self.axes[2])

    def local(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points, shape (..., 3), in the frame [m]."""
        return np.asarray((points - self.centre) @ self.axes.T)


def best_plane(
    corners: NDArray[np.float64], cross: NDArray[np.float64], areas: NDArray[np.float64]
) -> Plane:
    """Fit the plane with the least mean square distance of the surface (not of its vertices).

    The second moment of a triangle about a point is exact from its corners and centre:
    integral of v v^T = area / 12 (sum of v_i v_i^T + 9 c c^T).

    Args:
        corners: triangles [m], shape (n, 3, 3).
        cross: twice their area vectors [m²], shape (n, 3).
        areas: their areas [m²], shape (n,).

    Returns:
        The plane; x is the file's x axis as far as the plane allows, turned in the plane
        so that the patch fits its rectangle.

    Raises:
        SurfaceFileError: the triangles face all ways, as those of a closed body.
    """
    total = float(areas.sum())
    centre = areas @ corners.mean(axis=1) / total
    moved = corners - centre
    middle = moved.mean(axis=1)
    moment = np.einsum("n,nki,nkj->ij", areas, moved, moved)
    moment += 9.0 * np.einsum("n,ni,nj->ij", areas, middle, middle)
    normal = np.linalg.eigh(moment)[1][:, 0]
    facing = 0.5 * cross.sum(axis=0) @ normal
    if abs(facing) < 1e-6 * total:
        raise SurfaceFileError(
            f"its triangles ({1e6 * total:.4g} mm²) face all ways, as those of a closed body;"
            " cut off the textured side"
        )
    normal = normal * math.copysign(1.0, facing)
    axes = _frame(normal)
    angle = _turn(moved.reshape(-1, 3) @ axes[:2].T)
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    axes[:2] = turn @ axes[:2]
    return Plane(centre, axes, (_sentence(normal, angle),))


def _frame(normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return axes with this normal and x along the file's x, or y where that is the normal."""
    first = np.eye(3)[0 if abs(normal[0]) < 0.9 else 1]
    x = first - (first @ normal) * normal
    x /= np.linalg.norm(x)
    return np.stack((x, np.cross(normal, x), normal))


def _sentence(normal: NDArray[np.float64], angle: float) -> str:
    text = ", ".join(f"{value:.4g}" for value in normal + 0.0)
    turned = f", axes turned by {math.degrees(angle):.3g}° in it" if angle else ""
    return f"heights are over the mesh's best plane, normal ({text}){turned}"


def _turn(points: NDArray[np.float64]) -> float:
    """Return the angle, within 45°, of the smallest rectangle around the points; 0 where as good.

    One side of the smallest rectangle lies on an edge of the convex hull.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = points[ConvexHull(points).vertices]
    except QhullError:  # no extent across: the caller finds that out
        return 0.0
    edges = np.roll(hull, -1, axis=0) - hull
    angles = np.arctan2(edges[:, 1], edges[:, 0])
    angles = (angles + math.pi / 4) % (math.pi / 2) - math.pi / 4
    best, least = 0.0, _rectangle(hull, 0.0) * (1 - _FLAT_TURN)
    for angle in angles:
        area = _rectangle(hull, float(angle))
        if area < least:
            best, least = float(angle), area
    return best


def _rectangle(hull: NDArray[np.float64], angle: float) -> float:
    c, s = math.cos(angle), math.sin(angle)
    return float(np.ptp(c * hull[:, 0] + s * hull[:, 1]) * np.ptp(c * hull[:, 1] - s * hull[:, 0]))

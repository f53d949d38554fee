"""Read STL and OBJ meshes as a height field over their best plane.

The plane that a mesh patch lies over, and the axes in it.
"""

from __future__ import annotations

import io
import math
import re
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.errors import ParameterError, SurfaceFileError
from asperity.measured.reading.child import in_child
from asperity.measured.reading.mesh_raster import Grid, rasterise
from asperity.measured.reading.quiet import guarded
from asperity.measured.reading.raw import RawSurface
from asperity.measured.reading.reader import Reader, ReadingOptions, SurfaceFile, naming

_STL_HEADER, _STL_RECORD = 84, 50
_STL_TEXT = re.compile(rb"\s*solid\b[^\n]*\n\s*(facet\s+normal\b|endsolid\b)", re.IGNORECASE)
_OBJ_LINE = re.compile(rb"(#|v |vn |vt |vp |f |o |g |s |l |mtllib |usemtl |o$|g$)")
_OBJ_VERTEX = re.compile(rb"^v[ \t]+[-+.0-9]", re.MULTILINE)
_OBJ_FACE = re.compile(rb"^f[ \t]+-?[0-9]", re.MULTILINE)
_LONGEST = 1.0  # [m]; a texture that one touches is rather smaller
_OBJ_FACE_LINE = re.compile(rb"^f[ \t]+([^\r\n]*)", re.MULTILINE)
_OBJ_ZERO = re.compile(rb"[+-]?0+(/|$)")  # corners are counted from 1, or from -1 backwards
_CLOSED = 0.25  # share of overhanging area from which a mesh looks like a whole body


def mesh_kind(content: bytes) -> str | None:
    r"""Return "STL" or "OBJ" where the content is one, else None.

    Args:
        content: the bytes of the file.

    Example:
        >>> mesh_kind(b"solid x\nfacet normal 0 0 1\n"), mesh_kind(b"v 1 2 3\nf 1 1 1\n")
        ('STL', 'OBJ')
        >>> mesh_kind(b"1 2 3\n")
    """
    if _STL_TEXT.match(content[:4096]) or _is_binary_stl(content):
        return "STL"
    lines = (line.strip() for line in content[:65536].splitlines())
    first = next((line for line in lines if line and not line.startswith(b"#")), b"")
    if _OBJ_LINE.match(first) and _OBJ_VERTEX.search(content) and _OBJ_FACE.search(content):
        return "OBJ"
    return None


def _is_binary_stl(content: bytes) -> bool:
    """A binary STL has no magic: its number of triangles gives its size."""
    if len(content) < _STL_HEADER + _STL_RECORD:
        return False
    (count,) = struct.unpack_from("<I", content, 80)
    return bool(len(content) == _STL_HEADER + _STL_RECORD * count)


def mesh_reader(kind: str) -> Reader:
    """Return the reader of "STL" or "OBJ".

    Heights [m] are over the patch's least-squares plane, on a grid whose pitch is about the median
    edge; NaN at holes. A unit is required, which neither format has. What is damaged, overhanging
    or folded is refused.
    """

    def read(file: SurfaceFile, options: ReadingOptions) -> RawSurface | None:
        if options.metres is None:
            raise ParameterError(
                "unit",
                f"is required: {file.name} is an {kind} file, which has no unit; say what its"
                " coordinates are in, such as 'mm'",
            )
        binary = kind == "STL" and _is_binary_stl(file.content)
        return (_read_binary if binary else read_mesh_text)(file, options)

    return Reader(f"an {kind} mesh", lambda file: mesh_kind(file.content) == kind, read, ("unit",))


@naming
def _read_binary(file: SurfaceFile, options: ReadingOptions) -> RawSurface:
    return _surface(_binary_stl(file.content) * (options.metres or 1.0), file.name)


@in_child
@naming
def read_mesh_text(file: SurfaceFile, options: ReadingOptions) -> RawSurface:
    """Read an OBJ or an STL in text, which trimesh parses."""
    content = file.content
    triangles = _parsed(content, mesh_kind(content) or "STL")
    return _surface(_finite(triangles) * (options.metres or 1.0), file.name)


def _binary_stl(content: bytes) -> NDArray[np.float64]:
    """Return the corners of the triangles, shape (n, 3, 3); the normals in the file are ignored."""
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
    return _finite(np.frombuffer(content, record, offset=_STL_HEADER)["corners"])


def _finite(triangles: NDArray[Any]) -> NDArray[np.float64]:
    with np.errstate(invalid="ignore"):  # what is no number is refused below
        corners = triangles.astype(np.float64)
    if not np.isfinite(corners).all():
        raise SurfaceFileError("has corners that are not finite numbers")
    return corners


def _parsed(content: bytes, kind: str) -> NDArray[np.float64]:
    import trimesh

    options: dict[str, Any] = {"skip_materials": True} if kind == "OBJ" else {}
    with guarded(f"damaged {kind} mesh", "trimesh"):
        loaded: Any = trimesh.load(
            io.BytesIO(content), file_type=kind.lower(), process=False, **options
        )
        meshes = [loaded] if isinstance(loaded, trimesh.Trimesh) else loaded.dump()
        parts = [np.asarray(part.triangles, dtype=np.float64) for part in meshes]
        triangles = np.concatenate(parts) if parts else np.empty((0, 3, 3))
    if triangles.ndim != 3 or triangles.shape[1:] != (3, 3):
        raise SurfaceFileError(f"damaged {kind} mesh (its faces are no triangles)")
    expected = _faces_of_obj(content) if kind == "OBJ" else content.lower().count(b"facet normal")
    if len(triangles) != expected:  # trimesh leaves out what it does not understand
        raise SurfaceFileError(
            f"damaged or truncated {kind} mesh ({len(triangles)} of {expected} triangles are sound)"
        )
    return triangles


def _faces_of_obj(content: bytes) -> int:
    """Count the triangles that the faces of an OBJ ask for."""
    count = 0
    for match in _OBJ_FACE_LINE.finditer(content.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")):
        corners = match.group(1).partition(b"#")[0].split()
        if len(corners) < 3 or any(_OBJ_ZERO.match(corner) for corner in corners):
            raise SurfaceFileError(
                f"damaged OBJ mesh (the face {match.group().decode('latin-1')[:40]!r})"
            )
        count += len(corners) - 2
    return count


def _surface(corners: NDArray[np.float64], name: str) -> RawSurface:
    notes: list[str] = []
    with np.errstate(over="ignore", invalid="ignore"):
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas = 0.5 * np.linalg.norm(cross, axis=1)
    if not np.isfinite(areas).all():
        raise SurfaceFileError("has triangles too large for floating-point numbers")
    kept = areas > 0.0
    if not kept.all():
        notes.append(f"{int((~kept).sum())} triangles without area ignored")
        corners, cross, areas = corners[kept], cross[kept], areas[kept]
    if len(corners) < 2:
        raise SurfaceFileError(f"a mesh of {len(corners)} triangles is no surface")
    plane = best_plane(corners, cross, areas)
    _check_overhangs(cross, areas, plane)
    grid = rasterise(plane.local(corners))
    notes.extend(plane.notes)
    notes.extend(grid.notes)
    _check_folds(grid)
    longest = max(n * p for n, p in zip(grid.heights.shape[::-1], grid.pitch, strict=True))
    if longest > _LONGEST:
        notes.append(f"the patch is {longest:.3g} m long: check the unit")
    return RawSurface(grid.heights, grid.pitch, name, tuple(notes))


def _check_overhangs(cross: NDArray[np.float64], areas: NDArray[np.float64], plane: Plane) -> None:
    away = cross @ plane.normal < 0.0
    if not away.any():
        return
    area, total = float(areas[away].sum()), float(areas.sum())
    advice = (
        "it looks like a whole body: cut off the textured side"
        if area > _CLOSED * total
        else "a height field has one height at each place: cut them off"
    )
    raise SurfaceFileError(
        f"{int(away.sum())} triangles overhang, {1e6 * area:.4g} mm² or {area / total:.2%} of the"
        f" surface; {advice}"
    )


def _check_folds(grid: Grid) -> None:
    if grid.folded:
        area = grid.folded * grid.pitch[0] * grid.pitch[1]
        raise SurfaceFileError(
            f"the mesh lies above itself at {grid.folded} grid points, about {1e6 * area:.4g} mm²;"
            " a height field has one height at each place"
        )


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

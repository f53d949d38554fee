"""Read STL and OBJ meshes as heights on a regular grid over their least-squares plane."""

from __future__ import annotations

import io
import math
import re
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.reader import RawSurface, ReadingOptions, SurfaceFile
from asperity.measured.reading.isolation import reject_on_error

_STL_HEADER = 84
_STL_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
_STL_TEXT = re.compile(rb"\s*solid\b[^\n]*\n\s*(facet\s+normal\b|endsolid\b)", re.IGNORECASE)
_OBJ_LINE = re.compile(rb"(#|v |vn |vt |vp |f |o |g |s |l |mtllib |usemtl |o$|g$)")
_OBJ_VERTEX = re.compile(rb"^v[ \t]+[-+.0-9]", re.MULTILINE)
_OBJ_FACE = re.compile(rb"^f[ \t]+-?[0-9]", re.MULTILINE)
_MAX_EXPECTED_LENGTH = 1.0  # [m]; a longer patch has probably another unit
_OBJ_FACE_LINE = re.compile(rb"^f[ \t]+([^\r\n]*)", re.MULTILINE)
_OBJ_ZERO = re.compile(rb"[+-]?0+(/|$)")  # indices of corners start at 1, or at -1 backwards
_FINE_STEP = 1e-3  # of coordinates over the height, which needs no note
_CLOSED_BODY_FRACTION = 0.25  # share of overhanging area that suggests a closed body


def is_binary_stl(file: SurfaceFile) -> bool:
    """Whether the number of triangles in the header of a file matches its size."""
    if len(file.head) < _STL_HEADER + _STL_RECORD.itemsize:
        return False
    (count,) = struct.unpack_from("<I", file.head, 80)
    return bool(file.path.stat().st_size == _STL_HEADER + _STL_RECORD.itemsize * count)


def is_text_stl(file: SurfaceFile) -> bool:
    """Whether a file starts as an STL in text."""
    return _STL_TEXT.match(file.head) is not None


def is_obj(file: SurfaceFile) -> bool:
    """Whether a file starts as an OBJ, and has vertices and faces."""
    content = file.content
    lines = [line.strip() for line in content[:65536].splitlines()]
    lines = [line for line in lines if line and not line.startswith(b"#")]
    is_start = bool(lines) and _OBJ_LINE.match(lines[0]) is not None
    return is_start and bool(_OBJ_VERTEX.search(content) and _OBJ_FACE.search(content))


def read_mesh(file: SurfaceFile, options: ReadingOptions) -> RawSurface:
    """Read a mesh; trimesh parses text.

    Heights [m] are over the least-squares plane of the patch, on a grid whose pitch is about the
    median edge; NaN at holes.

    Raises:
        ParameterError: no unit is given; neither format has one.
        SurfaceFileError: the mesh is damaged, overhanging or folded.
    """
    is_binary = is_binary_stl(file)
    mesh_format = "STL" if is_binary or is_text_stl(file) else "OBJ"
    unit = options.metres_per_unit
    if unit is None:
        raise ParameterError(
            "unit",
            f"is required: {file.name} is an {mesh_format} file, which has no unit; say what its"
            " coordinates are in, such as 'mm'",
        )
    if is_binary:
        corners = np.frombuffer(file.content, _STL_RECORD, offset=_STL_HEADER)["corners"]
    else:
        corners = _parse_text_mesh(file.content, mesh_format)
    with np.errstate(invalid="ignore"):  # refused below
        corners = corners.astype(np.float64)
    if not np.isfinite(corners).all():
        raise SurfaceFileError("has corners that are not finite numbers")
    return _to_surface(corners * unit, file.name, unit * find_precision(corners))


def _parse_text_mesh(content: bytes, mesh_format: str) -> FloatArray:
    import trimesh

    options: dict[str, Any] = {"file_type": mesh_format.lower(), "process": False}
    if mesh_format == "OBJ":
        options["skip_materials"] = True
    with reject_on_error(f"damaged {mesh_format} mesh"):
        loaded: Any = trimesh.load(io.BytesIO(content), **options)
        meshes = [loaded] if isinstance(loaded, trimesh.Trimesh) else loaded.dump()
        parts = [np.asarray(part.triangles, dtype=np.float64) for part in meshes]
        triangles = np.concatenate([np.empty((0, 3, 3)), *parts])
    if triangles.shape[1:] != (3, 3):  # a vertex has two coordinates
        raise SurfaceFileError(f"damaged {mesh_format} mesh (its faces are no triangles)")
    if mesh_format == "OBJ":
        expected = _count_obj_triangles(content)
    else:
        expected = content.lower().count(b"facet normal")
    if len(triangles) != expected:  # trimesh ignores faces that it cannot parse
        fault = f"{len(triangles)} of {expected} triangles are sound"
        raise SurfaceFileError(f"damaged or truncated {mesh_format} mesh ({fault})")
    return triangles


def _count_obj_triangles(content: bytes) -> int:
    """Return the number of triangles in the faces of an OBJ."""
    count = 0
    for match in _OBJ_FACE_LINE.finditer(content.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")):
        corners = match.group(1).partition(b"#")[0].split()
        if len(corners) < 3 or any(_OBJ_ZERO.match(corner) for corner in corners):
            face = match.group().decode("latin-1")[:40]
            raise SurfaceFileError(f"damaged OBJ mesh (the face {face!r})")
        count += len(corners) - 2
    return count


def find_precision(coordinates: FloatArray) -> float:
    """Return the greatest step of coordinates that are numbers in single precision, else 0.

    Far from the origin these steps are coarse: 0.1 µm at 1 m.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        single = coordinates.astype(np.float32)
    if not np.array_equal(single, coordinates):
        return 0.0
    return float(np.spacing(np.abs(single).max(initial=0.0)))


def precision_notes(step: float, height: float) -> tuple[str, ...]:
    """Return what to note where the steps of coordinates [m] matter for a height [m]."""
    if step <= _FINE_STEP * height:
        return ()
    share = f"{100.0 * step / height:.2f} % of the height" if height else "of no height"
    words = f"in single precision, in steps of {1e6 * step:.3g} µm, {share}"
    return (f"its coordinates are far from the origin for numbers {words}: move it there first",)


def _to_surface(corners: FloatArray, name: str, step: float) -> RawSurface:
    notes: list[str] = []
    with np.errstate(over="ignore", invalid="ignore"):
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas = 0.5 * np.linalg.norm(cross, axis=1)
    if not np.isfinite(areas).all():
        raise SurfaceFileError("has triangles too large for floating-point numbers")
    valid = areas > 0.0
    if not valid.all():
        notes.append(f"{int((~valid).sum())} triangles without area ignored")
        corners = corners[valid]
        cross = cross[valid]
        areas = areas[valid]
    if len(corners) < 2:
        raise SurfaceFileError(f"a mesh of {len(corners)} triangles is no surface")
    centre, axes, note = fit_plane(corners, cross, areas)
    _check_overhangs(areas, cross @ axes[2] < 0.0)
    heights, pitch, grid_notes = rasterise((corners - centre) @ axes.T)
    notes.extend(
        (note, *grid_notes, *precision_notes(step, float(np.ptp(heights[np.isfinite(heights)]))))
    )
    longest = max(np.array(heights.shape[::-1]) * pitch)
    if longest > _MAX_EXPECTED_LENGTH:
        notes.append(f"the patch is {longest:.3g} m long: check the unit")
    return RawSurface(heights, pitch, name, tuple(notes))


def _check_overhangs(areas: FloatArray, overhanging: NDArray[np.bool_]) -> None:
    if not overhanging.any():
        return
    area = float(areas[overhanging].sum())
    total = float(areas.sum())
    advice = "a height field has one height at each point: cut them off"
    if area > _CLOSED_BODY_FRACTION * total:
        advice = "it looks like a whole body: cut off the textured side"
    raise SurfaceFileError(
        f"{int(overhanging.sum())} triangles overhang, "
        f"{1e6 * area:.4g} mm² or {100.0 * area / total:.2f} % of the surface"
        f"; {advice}"
    )


_MIN_AREA_SAVING = 0.02  # least relative saving of area for which the axes are turned


def fit_plane(
    corners: FloatArray, cross: FloatArray, areas: FloatArray
) -> tuple[FloatArray, FloatArray, str]:
    """Return the plane with the least mean square distance from the surface (not its vertices).

    The second moment of a triangle about a point is exact from its corners and centre:
    integral of v v^T = area / 12 (sum of v_i v_i^T + 9 c c^T).

    Args:
        corners: triangles [m], shape (n, 3, 3).
        cross: twice their area vectors [m²], shape (n, 3).
        areas: their areas [m²], shape (n,).

    Returns:
        The area-weighted centre [m], shape (3,); the x axis, the y axis and the normal on the side
        that the triangles face, shape (3, 3); and a description of the plane. x is the projection
        of the file's x axis, turned in the plane so that the patch fits its rectangle.

    Raises:
        SurfaceFileError: the triangles face in all directions, as those of a closed body.
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
        fault = "face in all directions, as those of a closed body; cut off the textured side"
        raise SurfaceFileError(f"its triangles ({1e6 * total:.4g} mm²) {fault}")
    normal = normal * math.copysign(1.0, facing)
    axes = _plane_axes(normal)
    angle = _min_rectangle_angle(moved.reshape(-1, 3) @ axes[:2].T)
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    axes[:2] = turn @ axes[:2]
    numbers = ", ".join([f"{value:.4g}" for value in normal + 0.0])
    note = f"heights are over the mesh's best plane, normal ({numbers})"
    if angle:
        note += f", axes turned by {math.degrees(angle):.3g}° in it"
    return centre, axes, note


def _plane_axes(normal: FloatArray) -> FloatArray:
    """Return axes with this normal; x is the projected x of the file, or y if x is the normal."""
    first = np.eye(3)[int(abs(normal[0]) >= 0.9)]
    x = first - (first @ normal) * normal
    x /= np.linalg.norm(x)
    return np.stack((x, np.cross(normal, x), normal))


def _min_rectangle_angle(points: FloatArray) -> float:
    """Return the angle, within 45°, of the smallest enclosing rectangle; 0 if it is as good.

    One side of the smallest rectangle lies on an edge of the convex hull.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = points[ConvexHull(points).vertices]
    except QhullError:  # no extent across, which the caller refuses
        return 0.0
    edges = np.roll(hull, -1, axis=0) - hull
    angles = np.arctan2(edges[:, 1], edges[:, 0])
    angles = (angles + math.pi / 4) % (math.pi / 2) - math.pi / 4
    areas = [
        np.ptp(c * hull[:, 0] + s * hull[:, 1]) * np.ptp(c * hull[:, 1] - s * hull[:, 0])
        for c, s in zip(np.cos([0.0, *angles]), np.sin([0.0, *angles]), strict=True)
    ]
    best = int(np.argmin(areas[1:]))
    if areas[best + 1] >= areas[0] * (1 - _MIN_AREA_SAVING):
        return 0.0
    return float(angles[best])


_MAX_POINTS = 2**25
_BASE_POINT_LIMIT = 2**22  # grid points allowed for any mesh
_POINTS_PER_TRIANGLE = 64  # and for each triangle: a regular grid has half a point per triangle
_MIN_SIDE = 4
_MAX_TRIM = 1000  # rows and columns trimmed: for ragged borders, not for large holes
_BLOCK = 2**20  # grid points tested at a time
_EDGE_TOLERANCE = 1e-9  # barycentric distance within which a point on an edge belongs to a triangle
_RIM_TOLERANCE = 0.1  # the same for points outside all triangles: a tilted patch has a ragged rim
_FOLD_TOLERANCE = 1e-6  # heights that differ by less, relative to the patch's size, are equal


def rasterise(corners: FloatArray) -> tuple[FloatArray, tuple[float, float], tuple[str, ...]]:
    """Return the heights of triangles on a grid, interpolated linearly in each.

    The pitch is about the median, over the triangles, of the shortest edge: on a triangulated
    grid that is its pitch, on long thin triangles (a ruled surface) their width.

    Args:
        corners: triangles [m], shape (n, 3, 3), z the height.

    Returns:
        Heights [m], shape (ny, nx), NaN outside all triangles; the pitch (px, py) [m]; and notes on
        the grid and its deviation from the mesh. The first and last points of the grid, before
        ragged borders are cut off, lie on the patch's borders.

    Raises:
        SurfaceFileError: the mesh is too coarse or too uneven for a grid, or lies above itself.
    """
    flat = corners[..., :2]
    edges = np.linalg.norm(flat - np.roll(flat, 1, axis=1), axis=-1)
    target = float(np.median(edges.min(axis=1)))
    low = flat.min(axis=(0, 1))
    extent = flat.max(axis=(0, 1)) - low
    if not (target > 0.0 and np.all(extent > 0.0)):
        raise SurfaceFileError("the mesh stands on edge over its best plane")
    cells = _grid_steps(extent, target, len(corners))
    pitch = extent / cells
    shape = (int(cells[1]) + 1, int(cells[0]) + 1)
    local = (corners - (*low, 0.0)) / (*pitch, 1.0)
    lowest, highest = _extreme_heights(local, shape, _EDGE_TOLERANCE)
    known = np.isfinite(lowest)
    spread = np.where(known, highest, 0.0) - np.where(known, lowest, 0.0)
    n_folded = int(np.count_nonzero(spread > _FOLD_TOLERANCE * float(extent.max())))
    if n_folded:
        raise SurfaceFileError(
            f"the mesh lies above itself at {n_folded} grid points, about"
            f" {1e6 * n_folded * pitch.prod():.4g} mm²; a height field has one height at each point"
        )
    if not known.all():
        rim, _ = _extreme_heights(local, shape, _RIM_TOLERANCE)
        lowest = np.where(known, lowest, rim)
    covered = np.where(np.isfinite(lowest), lowest, np.nan)
    heights, trimmed = _trim_border(covered)
    px = float(pitch[0])
    py = float(pitch[1])
    note = (
        f"{len(corners)} triangles resampled at {shape[1]} x {shape[0]} points,"
        f" pitch {1e6 * px:.5g} x {1e6 * py:.5g} µm from the median edge ({1e6 * target:.5g} µm)"
    )
    return heights, (px, py), (*trimmed, note, _describe_fit(covered, local.reshape(-1, 3)))


def _grid_steps(extent: FloatArray, target_pitch: float, n_triangles: int) -> FloatArray:
    """Return the number of grid steps along x and y, refused if too few or too many."""
    cells = np.maximum(np.rint(extent / target_pitch), 1.0)
    if np.any(cells + 1 < _MIN_SIDE):
        raise SurfaceFileError(
            f"too coarse a mesh: {cells[0] + 1:.0f} x {cells[1] + 1:.0f} points at the median edge"
            f" of {1e3 * target_pitch:.4g} mm; at least {_MIN_SIDE} x {_MIN_SIDE} are expected"
        )
    limit = max(_BASE_POINT_LIMIT, min(_POINTS_PER_TRIANGLE * n_triangles, _MAX_POINTS))
    if float(np.prod(cells + 1)) > limit:
        raise SurfaceFileError(
            f"too uneven a mesh: the median edge of {1e3 * target_pitch:.4g} mm requires"
            f" {np.prod(cells + 1):.3g} grid points, at most {limit} are allowed; remesh it evenly"
        )
    return np.asarray(cells)


def _extreme_heights(
    corners: FloatArray, shape: tuple[int, int], tolerance: float
) -> tuple[FloatArray, FloatArray]:
    """Return the least and the greatest height at each grid point; corners in grid units."""
    lowest = np.full(shape, np.inf)
    highest = np.full(shape, -np.inf)
    flat = corners[..., :2]
    size = np.array([shape[1], shape[0]])
    margin = tolerance * (1.0 + np.ptp(flat, axis=1))
    first = np.clip(np.ceil(flat.min(axis=1) - margin), 0, size - 1).astype(np.int64)
    last = np.clip(np.floor(flat.max(axis=1) + margin), 0, size - 1).astype(np.int64)
    width = np.maximum(last - first + 1, 0)
    counts = width[:, 0] * width[:, 1]
    if float(np.sum(counts, dtype=np.float64)) > 64.0 * shape[0] * shape[1] + 2.0**24:
        raise SurfaceFileError("too uneven a mesh: its triangles overlap many times; remesh it")
    splits = np.searchsorted(np.cumsum(counts), np.arange(_BLOCK, counts.sum(), _BLOCK))
    for part in np.split(np.arange(len(corners)), np.unique(splits)):
        _sample_triangles(corners[part], first[part], width[part], tolerance, lowest, highest)
    return lowest, highest


def _sample_triangles(
    corners: FloatArray,
    first: NDArray[np.int64],
    width: NDArray[np.int64],
    tolerance: float,
    lowest: FloatArray,
    highest: FloatArray,
) -> None:
    """Sample some triangles at the grid points of their bounding boxes."""
    counts = width[:, 0] * width[:, 1]
    which = np.repeat(np.arange(len(corners)), counts)
    index = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    row, column = np.divmod(index, width[which, 0])
    column = column + first[which, 0]
    row = row + first[which, 1]
    a = corners[which, 0]
    b = corners[which, 1]
    c = corners[which, 2]
    # Barycentric coordinates from areas; a vertical triangle has none.
    area = _cross(b - a, c - a)
    upright = np.abs(area) > 1e-12
    p = np.stack((column, row, np.zeros(len(row))), axis=1).astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        u = _cross(p - a, c - a) / area
        v = _cross(b - a, p - a) / area
        z = a[:, 2] + u * (b[:, 2] - a[:, 2]) + v * (c[:, 2] - a[:, 2])
        inside = upright & (u >= -tolerance) & (v >= -tolerance) & (u + v <= 1.0 + tolerance)
    at = (row[inside], column[inside])
    np.minimum.at(lowest, at, z[inside])
    np.maximum.at(highest, at, z[inside])


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _trim_border(heights: FloatArray) -> tuple[FloatArray, tuple[str, ...]]:
    """Return the heights without border rows and columns of which more than half is missing."""
    rows = slice(0, heights.shape[0])
    columns = slice(0, heights.shape[1])
    missing = np.isnan(heights)
    for _ in range(min(sum(heights.shape) // 10, _MAX_TRIM)):
        if min(rows.stop - rows.start, columns.stop - columns.start) <= _MIN_SIDE:
            break
        part = missing[rows, columns]
        sides = (part[0], part[-1], part[:, 0], part[:, -1])
        shares = [float(side.mean()) for side in sides]
        worst = int(np.argmax(shares))
        if shares[worst] <= 0.5:
            break
        rows = slice(rows.start + (worst == 0), rows.stop - (worst == 1))
        columns = slice(columns.start + (worst == 2), columns.stop - (worst == 3))
    inner = np.ascontiguousarray(heights[rows, columns])
    if inner.shape == heights.shape:
        return inner, ()
    size = f"{inner.shape[1]} x {inner.shape[0]}"
    return inner, (f"ragged border cut off: {size} points of the grid are left",)


def _describe_fit(heights: FloatArray, vertices: FloatArray) -> str:
    """Return the deviation of vertices (in grid units) from the bilinear grid, in words."""
    rows, columns = heights.shape
    j = np.clip(np.floor(vertices[:, 0]).astype(np.int64), 0, columns - 2)
    i = np.clip(np.floor(vertices[:, 1]).astype(np.int64), 0, rows - 2)
    u = vertices[:, 0] - j
    v = vertices[:, 1] - i
    near = (1 - u) * heights[i, j] + u * heights[i, j + 1]
    far = (1 - u) * heights[i + 1, j] + u * heights[i + 1, j + 1]
    error = vertices[:, 2] - ((1 - v) * near + v * far)
    error = error[np.isfinite(error)]
    if not len(error):
        return "no vertex lies where the grid has heights"
    return (
        f"the mesh's vertices are within {1e6 * np.abs(error).max():.3g} µm of the resampled grid"
        f" (RMS {1e6 * np.sqrt(np.mean(error**2)):.3g} µm)"
    )

"""Heights of the triangles of a mesh on a regular grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import SurfaceFileError

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
    most = max(_BASE_POINT_LIMIT, min(_POINTS_PER_TRIANGLE * n_triangles, _MAX_POINTS))
    if float(np.prod(cells + 1)) > most:
        raise SurfaceFileError(
            f"too uneven a mesh: the median edge of {1e3 * target_pitch:.4g} mm requires"
            f" {np.prod(cells + 1):.3g} grid points, at most {most} are allowed; remesh it evenly"
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
    a, b, c = (corners[which, k] for k in range(3))
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

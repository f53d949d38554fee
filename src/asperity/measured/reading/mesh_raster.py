"""Sample triangles on a regular grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.errors import SurfaceFileError

_MOST = 2**25
_ALWAYS = 2**22  # grid points that any mesh may have
_EACH = 64  # and beyond, for each triangle: a regular grid has half a point for each
_LEAST = 4
_MOST_CUT = 1000  # rows and columns: a border is ragged, a patch that is half a hole is not cut
_BLOCK = 2**20  # grid points that are tested at a time
_EDGE = 1e-9  # a grid point this close to a triangle's edge, in parts of it, belongs to it
_RIM = 0.1  # and a point that no triangle covers, this close: a tilted patch has a ragged rim
_FOLD = 1e-6  # heights that differ by less, in parts of the patch's size, are the same


@dataclass(frozen=True, eq=False)
class Grid:
    """Heights on a grid.

    Attributes:
        heights: [m], shape (ny, nx), NaN where no triangle is.
        pitch: (px, py) [m].
        folded: number of grid points with two different heights.
        notes: how the grid was chosen and how well it follows the mesh.
    """

    heights: NDArray[np.float64]
    pitch: tuple[float, float]
    folded: int
    notes: tuple[str, ...]


def rasterise(corners: NDArray[np.float64]) -> Grid:
    """Interpolate linearly in each triangle.

    The pitch is about the median, over the triangles, of the shortest edge: on a triangulated
    grid that is its pitch, on long thin triangles (a ruled surface) their width.

    Args:
        corners: triangles [m], shape (n, 3, 3), z the height.

    Returns:
        The grid, whose first and last points lie on the patch's borders.

    Raises:
        SurfaceFileError: too coarse or too uneven a mesh for a grid.
    """
    flat = corners[..., :2]
    edges = np.linalg.norm(flat - np.roll(flat, 1, axis=1), axis=-1)
    target = float(np.median(edges.min(axis=1)))
    low = flat.min(axis=(0, 1))
    extent = flat.max(axis=(0, 1)) - low
    if not (target > 0.0 and np.all(extent > 0.0)):
        raise SurfaceFileError("the mesh stands on edge over its best plane")
    cells = _cells(extent, target, len(corners))
    pitch = extent / cells
    shape = (int(cells[1]) + 1, int(cells[0]) + 1)
    local = (corners - (*low, 0.0)) / (*pitch, 1.0)
    lowest, highest = _extremes(local, shape, _EDGE)
    known = np.isfinite(lowest)
    spread = np.where(known, highest, 0.0) - np.where(known, lowest, 0.0)
    folded = int(np.count_nonzero(spread > _FOLD * float(extent.max())))
    if not known.all():
        rim, _ = _extremes(local, shape, _RIM)
        lowest = np.where(known, lowest, rim)
    heights, trimmed = _trimmed(np.where(np.isfinite(lowest), lowest, np.nan))
    px, py = float(pitch[0]), float(pitch[1])
    notes = (
        *trimmed,
        f"{len(corners)} triangles resampled at {shape[1]} x {shape[0]} points,"
        f" pitch {1e6 * px:.5g} x {1e6 * py:.5g} µm from the median edge ({1e6 * target:.5g} µm)",
        _fit(
            np.where(np.isfinite(lowest), lowest, np.nan),
            (corners.reshape(-1, 3) - (*low, 0.0)) / (px, py, 1.0),
        ),
    )
    return Grid(heights, (px, py), folded, notes)


def _cells(extent: NDArray[np.float64], target: float, triangles: int) -> NDArray[np.float64]:
    """Return the number of grid steps along x and y, refused where too few or too many."""
    cells = np.maximum(np.rint(extent / target), 1.0)
    if np.any(cells + 1 < _LEAST):
        raise SurfaceFileError(
            f"too coarse a mesh: {cells[0] + 1:.0f} x {cells[1] + 1:.0f} points at the median edge"
            f" of {1e3 * target:.4g} mm; at least {_LEAST} x {_LEAST} are expected"
        )
    most = max(_ALWAYS, min(_EACH * triangles, _MOST))
    if float(np.prod(cells + 1)) > most:
        raise SurfaceFileError(
            f"too uneven a mesh: the median edge of {1e3 * target:.4g} mm asks for"
            f" {np.prod(cells + 1):.3g} grid points, at most {most} are made; remesh it evenly"
        )
    return np.asarray(cells)


def _extremes(
    corners: NDArray[np.float64], shape: tuple[int, int], slack: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lowest and the highest height at each grid point; corners in grid units."""
    lowest = np.full(shape, np.inf)
    highest = np.full(shape, -np.inf)
    flat = corners[..., :2]
    size = np.array([shape[1], shape[0]])
    more = slack * (1.0 + np.ptp(flat, axis=1))
    first = np.clip(np.ceil(flat.min(axis=1) - more), 0, size - 1).astype(np.int64)
    last = np.clip(np.floor(flat.max(axis=1) + more), 0, size - 1).astype(np.int64)
    width = np.maximum(last - first + 1, 0)
    counts = width[:, 0] * width[:, 1]
    if float(np.sum(counts, dtype=np.float64)) > 64.0 * shape[0] * shape[1] + 2.0**24:
        raise SurfaceFileError("too uneven a mesh: its triangles overlap many times; remesh it")
    ends = np.cumsum(counts)
    start = 0
    while start < len(corners):
        offset = int(ends[start - 1]) if start else 0
        stop = max(int(np.searchsorted(ends, offset + _BLOCK)), start + 1)
        part = slice(start, stop)
        _sample(corners[part], first[part], width[part], slack, lowest, highest)
        start = stop
    return lowest, highest


def _sample(
    corners: NDArray[np.float64],
    first: NDArray[np.int64],
    width: NDArray[np.int64],
    slack: float,
    lowest: NDArray[np.float64],
    highest: NDArray[np.float64],
) -> None:
    """Sample some triangles at the grid points of their bounding boxes."""
    counts = width[:, 0] * width[:, 1]
    which = np.repeat(np.arange(len(corners)), counts)
    index = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    row, column = np.divmod(index, width[which, 0])
    column, row = column + first[which, 0], row + first[which, 1]
    a, b, c = (corners[which, k] for k in range(3))
    # Barycentric coordinates from areas; a triangle on edge has none and no height to give.
    area = _cross(b - a, c - a)
    upright = np.abs(area) > 1e-12
    p = np.stack((column, row, np.zeros(len(row))), axis=1).astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        u, v = _cross(p - a, c - a) / area, _cross(b - a, p - a) / area
        z = a[:, 2] + u * (b[:, 2] - a[:, 2]) + v * (c[:, 2] - a[:, 2])
        inside = upright & (u >= -slack) & (v >= -slack) & (u + v <= 1.0 + slack)
    at = (row[inside], column[inside])
    np.minimum.at(lowest, at, z[inside])
    np.maximum.at(highest, at, z[inside])


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _trimmed(heights: NDArray[np.float64]) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Cut rows and columns off the border while more than half of one is missing."""
    rows, columns = slice(0, heights.shape[0]), slice(0, heights.shape[1])
    missing = np.isnan(heights)
    for _ in range(min(sum(heights.shape) // 10, _MOST_CUT)):
        if min(rows.stop - rows.start, columns.stop - columns.start) <= _LEAST:
            break
        inner = missing[rows, columns]
        sides = (inner[0], inner[-1], inner[:, 0], inner[:, -1])
        shares = [float(side.mean()) for side in sides]
        worst = int(np.argmax(shares))
        if shares[worst] <= 0.5:
            break
        rows = slice(rows.start + (worst == 0), rows.stop - (worst == 1))
        columns = slice(columns.start + (worst == 2), columns.stop - (worst == 3))
    kept = np.ascontiguousarray(heights[rows, columns])
    if kept.shape == heights.shape:
        return kept, ()
    size = f"{kept.shape[1]} x {kept.shape[0]}"
    return kept, (f"ragged border cut off: {size} points of the grid are left",)


def _fit(heights: NDArray[np.float64], vertices: NDArray[np.float64]) -> str:
    """Say how far the mesh's vertices are from the grid's bilinear surface; in grid units."""
    rows, columns = heights.shape
    j = np.clip(np.floor(vertices[:, 0]).astype(np.int64), 0, columns - 2)
    i = np.clip(np.floor(vertices[:, 1]).astype(np.int64), 0, rows - 2)
    u, v = vertices[:, 0] - j, vertices[:, 1] - i
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

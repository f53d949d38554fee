"""The data behind the pictures of an analysis: which plane, which column, seen from above."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from asperity.analysis.bounds.bound import Bound, spectral_norm
from asperity.analysis.bounds.sampling import highest_point
from asperity.analysis.results.analyze import Analysis
from asperity.core.checks import FloatArray
from asperity.report.pictures.law_pictures import Window
from asperity.report.pictures.scan_plane import ScanSegment, choose_segment, feature_length
from asperity.report.pictures.surface_pictures import MapGrid, map_grid
from asperity.surface import Surface

# A picture shows the whole loop or the whole line if that is no longer than so many features.
_MAX_FEATURES = 4.0
_MARGIN = 0.05
_COLUMN_POINTS = 600
# Cells of a map along its longer side, and what the map may cost, in heights found in that time.
_TOP_CELLS = 260
_TOP_BUDGET = 1.7e7
# Just inside the surface, where the Jacobian is its limit.
_RELATIVE_OFFSET = 1e-6
TOP_VIEW_DEPTHS = (_RELATIVE_OFFSET, 0.25, 0.5, 0.75, 1.0)


def working_depth(surface: Surface, points: FloatArray) -> FloatArray:
    """Return the depth (n,) [m] of points (n, 3) that bounds the working region."""
    return surface.law.contact.depth(surface.texture, points)


def witness_point(analysis: Analysis) -> FloatArray:
    """Return the point (3,) [m] of the figures: the witness of q, or its onset.

    Without a witness it is the point at max_depth below the highest point.
    """
    if analysis.q.at is not None:
        return np.array(analysis.q.at)
    surface = analysis.surface
    xy = highest_point(surface.texture)
    top = surface.law.contact.contact_height(surface.texture, xy[None])[0]
    return np.array([*xy, top - surface.max_depth])


def loop_window(analysis: Analysis) -> Window:
    """Return the part of the plane that contains the loop, or its richest part if it is long."""
    leak = analysis.leak
    surface = analysis.surface
    length = _feature_size(surface)
    if not len(leak.vertices):
        return gain_window(analysis)
    along = (leak.vertices[:, :2] - leak.line.start) @ leak.line.direction
    low = float(along.min())
    high = float(along.max())
    if high - low <= _MAX_FEATURES * length:
        margin = _MARGIN * (high - low)
        segment = ScanSegment(leak.line, low - margin, high - low + 2.0 * margin)
    else:
        z = leak.vertices[:, 2]
        start = _largest_area_start(along, z, low, high, 2.0 * length)
        segment = ScanSegment(leak.line, start, 2.0 * length)
    return _fit_window(surface, segment, leak.vertices[:, 2])


def _largest_area_start(
    along: FloatArray, z: FloatArray, low: float, high: float, length: float
) -> float:
    """Return the start of the interval of a length in which a polygon encloses most area."""
    middle = 0.5 * (along + np.roll(along, -1))
    area = 0.5 * (z + np.roll(z, -1)) * (np.roll(along, -1) - along)
    counts = max(1, int(4.0 * (high - low) / length))
    edges = np.linspace(low, high, counts + 1)
    enclosed, _edges = np.histogram(middle, edges, weights=area)
    window = min(4, counts)
    sums = np.convolve(enclosed, np.ones(window), mode="valid")
    start = float(edges[int(np.argmax(np.abs(sums)))])
    return min(max(start, low), max(high - length, low))


def gain_window(analysis: Analysis) -> Window:
    """Return the part of the vertical plane through the witness of q, along the loop's line."""
    surface = analysis.surface
    line = analysis.leak.line
    texture = surface.texture
    at = witness_point(analysis)
    across = np.array([-line.direction[1], line.direction[0]])
    offset = float((at[:2] - line.start) @ across)
    shifted = replace(line, start=line.start + offset * across)
    place = float((at[:2] - shifted.start) @ line.direction)
    length = _feature_size(surface)
    own = choose_segment(texture, length, _MAX_FEATURES * length)
    if own.length >= own.line.length and own.line.length == line.length:
        # A whole period: the witness is shifted into it.
        return _fit_window(surface, ScanSegment(shifted, 0.0, own.length), at[2:])
    size = 2.0 * length
    start = place - 0.5 * size
    if not line.periodic and line.length > size:
        start = min(max(start, 0.0), line.length - size)
    return _fit_window(surface, ScanSegment(shifted, start, size), at[2:])


def project_on_window(window: Window, point: FloatArray) -> tuple[float, float] | None:
    """Return the coordinates (t, z) [m] of a point in a window; ``None`` for a point outside.

    On a periodic line the point is shifted by whole periods.
    """
    segment = window.segment
    along, aside = segment.project(point[:2])
    if segment.line.periodic and not 0.0 <= along <= segment.length:
        along %= segment.line.length
    if aside > 1e-6 * segment.length or not 0.0 <= along <= segment.length:
        return None
    return along, float(point[2])


def _feature_size(surface: Surface) -> float:
    """Return the length [m] of a feature, at least 0.75 times the height of the working region."""
    texture = surface.texture
    size = texture.peak_to_valley + surface.max_depth
    return max(feature_length(texture), 0.75 * size)


def _fit_window(surface: Surface, segment: ScanSegment, required_heights: FloatArray) -> Window:
    """Return the window that contains surface, working region and required heights."""
    xy = segment.xy(segment.distances(1000))
    heights = surface.texture.height(xy)
    tops = surface.law.contact.contact_height(surface.texture, xy)
    low = float(min(tops.min() - surface.max_depth, heights.min(), required_heights.min()))
    high = float(max(tops.max(), heights.max(), required_heights.max()))
    margin = _MARGIN * (high - low)
    return Window(segment, low - margin, high + margin)


@dataclass(frozen=True)
class DepthProfile:
    """Singular values of J/k on the line down to the witness of q.

    Attributes:
        depth: by the law's own contact [m], shape (n,).
        values: singular values of J/k, greatest first, shape (n, 3).
        start: point at depth 0 [m], shape (3,).
        direction: unit vector downwards along the column, shape (3,).
        witness_depth: depth of the witness [m].
    """

    depth: FloatArray
    values: FloatArray
    start: FloatArray
    direction: FloatArray
    witness_depth: float


def witness_profile(analysis: Analysis) -> DepthProfile:
    """Return the line through the witness: vertical, or along the normal of the closest point."""
    surface = analysis.surface
    bound = analysis.q
    at = witness_point(analysis)
    place, below = surface.law.contact.depth_axis(surface.texture, at)
    reach = surface.max_depth * np.linspace(0.0, 1.0, _COLUMN_POINTS)
    reach[0] = _RELATIVE_OFFSET * surface.max_depth
    points = place + reach[:, None] * below
    jacobians = surface.jacobian(points, **_witness_state(surface, bound, len(points)))
    values = np.asarray(np.linalg.svd(jacobians / surface.stiffness, compute_uv=False))
    return DepthProfile(reach, values, place, below, float((at - place) @ below))


def _witness_state(surface: Surface, bound: Bound, count: int) -> dict[str, FloatArray]:
    """Return the state of the witness, for a law that has one."""
    if not surface.law.stateful or bound.deflection is None:
        return {}
    return {
        "deflection": np.tile(np.array(bound.deflection), (count, 1)),
        "sliding": np.full(count, bound.sliding),
    }


def top_view(analysis: Analysis) -> tuple[MapGrid, FloatArray]:
    """Return a grid, of a map, and the greatest ‖J‖/k at five depths below each of its points."""
    surface = analysis.surface
    cost = len(TOP_VIEW_DEPTHS) * surface.law.contact.relative_cost
    grid = map_grid(surface.texture, min(_TOP_CELLS, math.isqrt(int(_TOP_BUDGET / cost))))
    tops = surface.law.contact.contact_height(surface.texture, grid.xy)
    best = np.zeros(len(grid.xy))
    for part in TOP_VIEW_DEPTHS:
        points = np.column_stack([grid.xy, tops - part * surface.max_depth])
        jacobians = surface.jacobian(points, **_witness_state(surface, analysis.q, len(points)))
        best = np.maximum(best, spectral_norm(jacobians) / surface.stiffness)
    return grid, best.reshape(grid.shape)

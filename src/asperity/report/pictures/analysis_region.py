"""The data behind the pictures of an analysis: which plane, which column, seen from above."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from asperity.analysis.analysis_result import Analysis
from asperity.analysis.bounds.bound import Bound
from asperity.analysis.bounds.measures import spectral_norm
from asperity.analysis.bounds.sampling import highest_point
from asperity.checks import FloatArray
from asperity.report.pictures.field_picture import Window
from asperity.report.pictures.surface_picture import MapGrid, map_grid
from asperity.report.pictures.vertical_cut import Stretch, feature_length, stretch_of
from asperity.surface import Surface
from asperity.textures.texture import ScanLine

# A picture shows the whole loop or the whole line if that is no longer than so many features.
_MOST_FEATURES = 4.0
_MARGIN = 0.05
_COLUMN_POINTS = 600
# Cells of a map along its longer side, and what the map may cost, in heights found in that time.
_TOP_CELLS, _TOP_BUDGET = 260, 1.7e7
# Just inside the surface, where the Jacobian is its limit.
_INSIDE = 1e-6
TOP_LEVELS = (_INSIDE, 0.25, 0.5, 0.75, 1.0)


def working_depth(surface: Surface, points: FloatArray) -> FloatArray:
    """Return the depth (n,) [m] of points (n, 3) by which the working region is bounded."""
    return surface.law.contact.depth(surface.texture, points)


def witness(analysis: Analysis) -> FloatArray:
    """Return the point (3,) [m] that the pictures go through: the witness of q, or its onset.

    Where q has none it is the point at max_depth below the highest point.
    """
    if analysis.q.at is not None:
        return np.array(analysis.q.at)
    surface = analysis.surface
    xy = highest_point(surface.texture)
    top = surface.law.contact.begin(surface.texture, xy[None])[0]
    return np.array([*xy, top - surface.max_depth])


def loop_window(analysis: Analysis) -> Window:
    """Return the part of the loop's plane that shows it, or where it gains most if it is long."""
    leak, surface = analysis.leak, analysis.surface
    length = _features(surface)
    if not len(leak.vertices):
        return gain_window(analysis)
    along = (leak.vertices[:, :2] - leak.line.start) @ leak.line.direction
    low, high = float(along.min()), float(along.max())
    if high - low <= _MOST_FEATURES * length:
        margin = _MARGIN * (high - low)
        stretch = Stretch(leak.line, low - margin, high - low + 2.0 * margin)
    else:
        z = leak.vertices[:, 2]
        start = _widest_part(along, z, low, high, 2.0 * length)
        stretch = Stretch(leak.line, start, 2.0 * length)
    return _window(surface, stretch, leak.vertices[:, 2])


def _widest_part(along: FloatArray, z: FloatArray, low: float, high: float, length: float) -> float:
    """Return where the part of that length begins in which a polygon encloses most area."""
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
    surface, line = analysis.surface, analysis.leak.line
    texture = surface.texture
    at = witness(analysis)
    across = np.array([-line.direction[1], line.direction[0]])
    shifted = ScanLine(
        line.start + float((at[:2] - line.start) @ across) * across,
        line.direction,
        line.length,
        line.periodic,
    )
    place = float((at[:2] - shifted.start) @ line.direction)
    length = _features(surface)
    own = stretch_of(texture, length, _MOST_FEATURES * length)
    if own.length >= own.line.length and own.line.length == line.length:
        # A whole line: the witness is moved into it by whole periods.
        return _window(surface, Stretch(shifted, 0.0, own.length), at[2:])
    size = 2.0 * length
    start = place - 0.5 * size
    if not line.periodic and line.length > size:
        start = min(max(start, 0.0), line.length - size)
    return _window(surface, Stretch(shifted, start, size), at[2:])


def in_window(window: Window, at: FloatArray) -> tuple[float, float] | None:
    """Return the place (t, z) [m] of a point in a window; ``None`` if it lies outside its plane.

    On a line that repeats the point is moved by whole periods.
    """
    stretch = window.stretch
    first = stretch.xy(np.zeros(1))[0]
    offset = at[:2] - first
    along = float(offset @ stretch.line.direction)
    aside = float(np.linalg.norm(offset - along * stretch.line.direction))
    if stretch.line.periodic and not 0.0 <= along <= stretch.length:
        along %= stretch.line.length
    if aside > 1e-6 * stretch.length or not 0.0 <= along <= stretch.length:
        return None
    return along, float(at[2])


def _features(surface: Surface) -> float:
    """Return the length [m] of a feature, at least what makes the working region half as wide."""
    texture = surface.texture
    size = texture.peak_to_valley + surface.max_depth
    return max(feature_length(texture), 0.75 * size)


def _window(surface: Surface, stretch: Stretch, show: FloatArray) -> Window:
    """Return the window that holds surface and working region, and heights that must be seen."""
    xy = stretch.xy(stretch.steps(1000))
    heights = surface.texture.height(xy)
    tops = surface.law.contact.begin(surface.texture, xy)
    low = float(min(tops.min() - surface.max_depth, heights.min(), show.min()))
    high = float(max(tops.max(), heights.max(), show.max()))
    margin = _MARGIN * (high - low)
    return Window(stretch, low - margin, high + margin)


@dataclass(frozen=True)
class Column:
    """The singular values of J/k on the way down to the witness of q.

    Attributes:
        depth: by the law's own contact [m], shape (n,).
        values: singular values of J/k, greatest first, shape (n, 3).
        place: where the column begins, at depth 0 [m], shape (3,).
        below: unit vector downwards along the column, shape (3,).
        witness: depth of the witness [m].
    """

    depth: FloatArray
    values: FloatArray
    place: FloatArray
    below: FloatArray
    witness: float


def witness_column(analysis: Analysis) -> Column:
    """Return the column through the witness: vertical, or along the normal of the nearest point."""
    surface, bound = analysis.surface, analysis.q
    at = witness(analysis)
    place, below = surface.law.contact.column(surface.texture, at)
    reach = surface.max_depth * np.linspace(0.0, 1.0, _COLUMN_POINTS)
    reach[0] = _INSIDE * surface.max_depth
    points = place + reach[:, None] * below
    jacobians = surface.jacobian(points, **_state(surface, bound, len(points)))
    values = np.asarray(np.linalg.svd(jacobians / surface.stiffness, compute_uv=False))
    return Column(reach, values, place, below, float((at - place) @ below))


def _state(surface: Surface, bound: Bound, count: int) -> dict[str, FloatArray]:
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
    affordable = math.isqrt(int(_TOP_BUDGET / (len(TOP_LEVELS) * surface.law.contact.cost)))
    grid = map_grid(surface.texture, min(_TOP_CELLS, affordable))
    tops = surface.law.contact.begin(surface.texture, grid.xy)
    best = np.zeros(len(grid.xy))
    for part in TOP_LEVELS:
        points = np.column_stack([grid.xy, tops - part * surface.max_depth])
        jacobians = surface.jacobian(points, **_state(surface, analysis.q, len(points)))
        best = np.maximum(best, spectral_norm(jacobians) / surface.stiffness)
    return grid, best.reshape(grid.shape)

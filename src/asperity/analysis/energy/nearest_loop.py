"""The loop around the curl of one sign for a law on the nearest contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asperity.analysis.energy.columns import comb, plane_curl, positive_interval
from asperity.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.texture import ScanLine

# Columns along the line and levels of depth, for profiles and for maps.
_GRID = {True: (512, 96), False: (160, 24)}
_BISECTIONS = 16


@dataclass(frozen=True)
class Outline:
    """A polygon around the curl of one sign.

    Attributes:
        promise: ∬|curl| inside, by the grid [J]; the work around the polygon tells exactly.
        vertices: (n, 3) [m].
        line: whose plane it lies in.
    """

    promise: float
    vertices: FloatArray
    line: ScanLine


def nearest_outlines(surface: Surface, line: ScanLine) -> list[Outline]:
    """Return the polygons around the regions of either sign of the curl in a vertical plane.

    The region is where the distance to the surface is at most max_depth. The distance grows on
    the way down, so a column ends where it first exceeds max_depth; in each column the longest
    interval of the sign is taken.
    """
    columns, levels = _GRID[surface.texture.is_profile]
    along = np.linspace(0.0, line.length, columns + 1)
    xy = np.ascontiguousarray(line.start + along[:, None] * line.direction)
    tops = surface.texture.height(xy)
    reach = _reach(surface, xy, tops)
    parts: FloatArray = np.linspace(0.0, 1.0, levels + 1)
    # At the surface itself the sign is that just below it.
    inside = np.maximum(parts, 0.5 / levels)
    points = np.concatenate([np.column_stack([xy, tops - part * reach]) for part in inside])
    curls = plane_curl(surface.jacobian(points), line).reshape(levels + 1, -1)
    area = reach * line.length / (columns * levels)
    outlines = []
    for sign in (1.0, -1.0):
        top, bottom = positive_interval(parts, sign * curls)
        chosen = (parts[:, None] >= top) & (parts[:, None] <= bottom) & (sign * curls > 0.0)
        promise = float((np.where(chosen, np.abs(curls), 0.0) * area).sum())
        low, high = tops - bottom * reach, tops - top * reach
        outlines.append(Outline(promise, comb(xy, high, low, periodic=line.periodic), line))
    return outlines


def _reach(surface: Surface, xy: FloatArray, tops: FloatArray) -> FloatArray:
    """Return how far below the surface the distance to it is max_depth [m], by bisection."""
    # Deeper than the lowest point by max_depth, no point is near enough.
    low = np.full(len(tops), 0.0)
    high = tops - surface.texture.extremes[0] + surface.max_depth
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        points = np.column_stack([xy, tops - middle])
        feet = surface.texture.nearest(points)
        near = np.linalg.norm(feet - points, axis=1) <= surface.max_depth
        low, high = np.where(near, middle, low), np.where(near, high, middle)
    return low

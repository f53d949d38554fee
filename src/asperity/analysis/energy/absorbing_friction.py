"""The search for the closed path of greatest energy per length, f_c* = sup W/length.

A path in a vertical plane is a polygon of points (t, u): distance along the plane, and height above
the floor of the working region, so that u >= 0 keeps it inside. Ellipses of many sizes in many
places are compared; the best of them are improved by a quasi-Newton method with the exact gradient
of the discrete W/length. The work of what is returned is integrated adaptively: a search maximizes
the error of its own quadrature too.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from asperity.analysis.energy.closed_loops import AbsorbingFriction, polygon_length
from asperity.analysis.energy.field_energy import loop_work, shortest_wavelength
from asperity.analysis.gain.theorems import residual_bound
from asperity.core.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.texture import ScanLine

LOOP_TOLERANCE = 1e-12
"""Relative error of the work of an edge."""
NEAREST_TOLERANCE = 1e-4
"""The same where each force requires a closest-point search."""
# Of the absolute work of a path: errors of a coarse integral, at kinks too, and of a fine one.
_DOUBTFUL_SHARE = 1e-2
_ROUNDING_SHARE = 1e-9
# Ellipses that are compared and how many of the best are improved: on profiles and where each force
# requires a closest-point search, and on other maps.
_ELLIPSES = {True: (2048, 2), False: (16_384, 4)}
_ELLIPSE_POINTS = 32
# Points of a path that are free, points for each of them at which it is integrated, vertices of the
# polygon that is returned, and quasi-Newton steps.
_FREE_POINTS = 48
_VERTICES = 768
_REFINEMENT = 4
_STEPS = 400
# A climb ends when so many steps raise the value by less than this share.
_STALLED_STEPS = 10
_STALLED_GAIN = 1e-5
_MEMORY = 10
_HALVINGS = 6
_FIRST_STEP = 0.02
# Half widths of the ellipses in shortest wavelengths: the points of a longer path would not resolve
# the force on it.
_WIDTHS = (0.1, 2.0)
_FLOOR_COLUMNS = 1025
_DEPTH_BISECTIONS = 16


def region_floor(surface: Surface, xy: FloatArray) -> FloatArray:
    """Return the lowest z [m] of the working region at points (n, 2) of the plane.

    For a contact that searches for its point, that is where the distance to the surface first
    exceeds max_depth.
    """
    contact = surface.law.contact
    if contact.is_above_probe:
        return contact.contact_height(surface.texture, xy) - surface.clamped_depth
    heights: FloatArray = surface.texture.height(xy)
    # max_depth below the lowest point, the distance is at least max_depth.
    low = np.full(len(heights), 0.0)
    high = heights - surface.texture.extremes[0] + surface.max_depth
    for _ in range(_DEPTH_BISECTIONS):
        middle = 0.5 * (low + high)
        points = np.column_stack([xy, heights - middle])
        closest = surface.texture.nearest(points)
        near = np.linalg.norm(closest - points, axis=1) <= surface.max_depth
        low = np.where(near, middle, low)
        high = np.where(near, high, middle)
    return np.asarray(heights - low)


def path_work(surface: Surface, path: FloatArray) -> float:
    """Return the work around a closed path [J].

    Where each force requires a search the edges are integrated coarsely. If that is no more than
    errors can be, they are integrated again, and what rounding can be is none.
    """
    if not surface.law.contact.requires_search:
        return loop_work(surface, path, LOOP_TOLERANCE)
    work = loop_work(surface, path, NEAREST_TOLERANCE)
    edges = np.linalg.norm(np.roll(path, -1, axis=0) - path, axis=1)
    scale = float(np.linalg.norm(surface.force(path), axis=1) @ edges)
    if abs(work) > _DOUBTFUL_SHARE * scale:
        return work
    work = loop_work(surface, path, LOOP_TOLERANCE)
    return work if abs(work) > _ROUNDING_SHARE * scale else 0.0


def find_absorbing_friction(
    surface: Surface, line: ScanLine, worst: FloatArray
) -> AbsorbingFriction:
    """Return the greatest W/length found, with its path, and the proved bound.

    On a profile the plane of the line is searched; on a map one plane for each ellipse, through a
    random place in a random direction.

    Args:
        surface: a surface whose law has no state and curl.
        line: a line across the surface.
        worst: another path to compare with, vertices (n, 3) [m].
    """
    is_profile = surface.texture.is_profile
    count, groups = _ELLIPSES[is_profile or surface.law.contact.requires_search]
    planes = 1 if is_profile else count
    paths = [worst] if len(worst) else []
    paths += [_improve(*start) for start in _best_ellipses(surface, line, count, groups)]
    best = AbsorbingFriction(0.0, residual_bound(surface), 0.0, np.zeros((0, 3)), planes)
    for path in paths:
        work = path_work(surface, path)
        length = polygon_length(path)
        # Straight edges of a loop may pass below the region, where more may be gained.
        density = min(abs(work) / length, best.upper)
        if density > best.found:
            vertices = np.ascontiguousarray(path if work > 0.0 else path[::-1])
            best = AbsorbingFriction(density, best.upper, density * length, vertices, planes)
    return best


@dataclass(frozen=True)
class _Ellipses:
    """Ellipses in vertical planes.

    Attributes:
        centres: points of the planes [m], shape (count, 2).
        directions: directions of the planes, shape (count, 2).
        widths: half widths [m], shape (count,).
        along: distances from the centre along the plane [m], shape (count, n).
        points: the paths [m], shape (count, n, 3).
    """

    centres: FloatArray
    directions: FloatArray
    widths: FloatArray
    along: FloatArray
    points: FloatArray

    def densities(self, surface: Surface) -> FloatArray:
        """Return W/length of each path by trapezoids [N]."""
        forces = surface.force(self.points.reshape(-1, 3)).reshape(self.points.shape)
        steps = np.roll(self.points, -1, axis=1) - self.points
        pull = 0.5 * (forces + np.roll(forces, -1, axis=1))
        work = np.einsum("lpi,lpi->l", pull, steps)
        return np.asarray(work / np.linalg.norm(steps, axis=2).sum(axis=1))


def _random_ellipses(surface: Surface, line: ScanLine, count: int) -> _Ellipses:
    """Return ellipses of many sizes in the working region, cut off at its floor."""
    rng = np.random.default_rng(0)
    directions = np.tile(line.direction, (count, 1))
    centres = line.start + rng.uniform(0.0, line.length, (count, 1)) * line.direction
    if not surface.texture.is_profile:
        angles = rng.uniform(0.0, math.pi, count)
        directions = np.column_stack([np.cos(angles), np.sin(angles)])
        centres = surface.texture.domain.points(rng.uniform(size=(count, 2)))
    wave = min(shortest_wavelength(surface), line.length)
    least = np.log([[_WIDTHS[0] * wave], [0.1 * surface.max_depth]])
    most = np.log([[min(_WIDTHS[1] * wave, 0.5 * line.length)], [surface.max_depth]])
    widths, heights = np.exp(rng.uniform(least, most, (2, count)))
    phases = 2.0 * math.pi * np.arange(_ELLIPSE_POINTS) / _ELLIPSE_POINTS
    along = widths[:, None] * np.cos(phases)
    middle = rng.uniform(0.0, surface.max_depth, (count, 1))
    above = np.maximum(middle + heights[:, None] * np.sin(phases), 0.0)
    xy = centres[:, None] + along[..., None] * directions[:, None]
    # Right below its surface a vertical depth of max_depth is never out of the region.
    top = surface.law.contact.contact_height(surface.texture, xy.reshape(-1, 2))
    z = top.reshape(above.shape) - surface.max_depth + above
    return _Ellipses(centres, directions, widths, along, np.concatenate([xy, z[..., None]], axis=2))


def _best_ellipses(
    surface: Surface, line: ScanLine, count: int, group_count: int
) -> list[tuple[_Plane, FloatArray]]:
    """Return planes, and paths in them (2, n) [m], the best of each group of ellipses."""
    ellipses = _random_ellipses(surface, line, count)
    densities = ellipses.densities(surface)
    groups = np.abs(densities).reshape(group_count, -1)
    starts = []
    for index in groups.argmax(axis=1) + np.arange(group_count) * groups.shape[1]:
        turn = 1 if densities[index] > 0.0 else -1
        reach = 2.0 * float(ellipses.widths[index])
        plane = _make_plane(surface, ellipses.centres[index], ellipses.directions[index], reach)
        along = ellipses.along[index]
        above = ellipses.points[index, :, 2] - np.interp(along, plane.columns, plane.floor)
        starts.append((plane, np.stack([along, np.maximum(above, 0.0)])[:, ::turn]))
    return starts


@dataclass(frozen=True)
class _Plane:
    """A vertical plane with the floor of the working region.

    Attributes:
        surface: the surface.
        line: origin and direction; the length is that of the columns.
        columns: distances along it [m], shape (c,).
        floor: z of the floor there [m], shape (c,).
        slope: its derivative, shape (c,).
        refinement: fine points from free points, shape (m, n).
    """

    surface: Surface
    line: ScanLine
    columns: FloatArray
    floor: FloatArray
    slope: FloatArray
    refinement: FloatArray

    def points(self, curve: FloatArray) -> FloatArray:
        """Return points (n, 3) of coordinates t and z, shape (2, n) [m]."""
        return np.column_stack(
            [self.line.start + curve[0][:, None] * self.line.direction, curve[1]]
        )

    def curve(self, free: FloatArray) -> FloatArray:
        """Return t and z of the polygon, shape (2, m), from free points (t, u), shape (2, n)."""
        t, u = free @ self.refinement.T
        return np.stack([t, np.interp(t, self.columns, self.floor) + u])

    def density(self, free: FloatArray) -> tuple[float, FloatArray]:
        """Return W/length of the polygon by the midpoint rule [N], and its gradient [N/m]."""
        curve = self.curve(free)
        step = _next_columns(curve) - curve
        forces, jacobians = self.surface.force_and_jacobian(self.points(curve + 0.5 * step))
        axes = np.array([[*self.line.direction, 0.0], [0.0, 0.0, 1.0]])
        force = axes @ forces.T
        turn = 0.5 * np.einsum("ai,mij,bj,am->bm", axes, jacobians, axes, step)
        pull = force - turn
        push = force + turn
        lengths = np.maximum(np.hypot(*step), np.finfo(float).tiny)
        length = float(lengths.sum())
        density = float((force * step).sum()) / length
        unit = step / lengths
        slopes = _last_columns(push) - pull - density * (_last_columns(unit) - unit)
        slopes[0] += np.interp(curve[0], self.columns, self.slope) * slopes[1]
        return density, slopes @ self.refinement / length


def _next_columns(values: FloatArray) -> FloatArray:
    """Return the columns (2, n) of a closed path turned by one: each has that of the next point."""
    return np.concatenate([values[:, 1:], values[:, :1]], axis=1)


def _last_columns(values: FloatArray) -> FloatArray:
    """Return the columns (2, n) of a closed path turned by one: each has that of the last point."""
    return np.concatenate([values[:, -1:], values[:, :-1]], axis=1)


def _make_plane(
    surface: Surface, centre: FloatArray, direction: FloatArray, reach: float
) -> _Plane:
    columns: FloatArray = np.linspace(-reach, reach, _FLOOR_COLUMNS)
    floor = region_floor(surface, np.ascontiguousarray(centre + columns[:, None] * direction))
    slope = np.gradient(floor, columns)
    refinement = _hat_functions(_REFINEMENT)
    line = ScanLine(centre, direction, 2.0 * reach, periodic=False)
    return _Plane(surface, line, columns, floor, slope, refinement)


def _hat_functions(parts: int) -> FloatArray:
    """Return the matrix that interpolates a number of points for each free point of a path."""
    where = np.arange(_FREE_POINTS * parts) / parts
    distance = np.abs(where[:, None] - np.arange(_FREE_POINTS))
    return np.asarray(np.maximum(1.0 - np.minimum(distance, _FREE_POINTS - distance), 0.0))


def _improve(plane: _Plane, path: FloatArray) -> FloatArray:
    """Return the polygon (n, 3) [m] of greatest W/length that is reached from a path."""
    count = path.shape[1]
    where = np.arange(_FREE_POINTS) * (count / _FREE_POINTS)
    rows = [np.interp(where, np.arange(count), row, period=count) for row in path]
    sizes = np.array([[plane.columns[-1]], [plane.surface.max_depth]])

    def evaluate(scaled: FloatArray) -> tuple[float, FloatArray]:
        density, slopes = plane.density(scaled * sizes)
        return density, slopes * sizes

    low = np.array([[-1.0], [0.0]])
    high = np.array([[1.0], [math.inf]])
    free = _climb(evaluate, np.stack(rows) / sizes, low, high) * sizes
    along, above = free @ _hat_functions(_VERTICES // _FREE_POINTS).T
    points = plane.points(np.stack([along, above]))
    points[:, 2] += region_floor(plane.surface, np.ascontiguousarray(points[:, :2]))
    return points


def _climb(
    evaluate: Callable[[FloatArray], tuple[float, FloatArray]],
    start: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> FloatArray:
    """Return where a function within bounds is greatest, by limited-memory BFGS steps."""
    x = np.clip(start, low, high)
    value, slope = evaluate(x)
    pairs: deque[_Pair] = deque(maxlen=_MEMORY)
    before = value
    for count in range(_STEPS):
        if count % _STALLED_STEPS == 0:
            if count and value < before + _STALLED_GAIN * abs(value):
                break
            before = value
        is_free = ~((x <= low) & (slope < 0.0) | (x >= high) & (slope > 0.0))
        direction = _quasi_newton_direction(slope * is_free, pairs) * is_free
        for _ in range(_HALVINGS):
            trial = np.clip(x + direction, low, high)
            reached, trial_slope = evaluate(trial)
            if reached > value:
                break
            direction = 0.25 * direction
        else:
            if not pairs:
                break
            pairs.clear()
            continue
        step = trial - x
        change = slope - trial_slope
        product = float((step * change).sum())
        if product > 0.0:
            pairs.append(_Pair(step, change, product))
        x, value, slope = trial, reached, trial_slope
    return x


class _Pair(NamedTuple):
    """A step with the change of the slope on it.

    Attributes:
        step: shape (2, n).
        change: slope before less slope after, shape (2, n).
        product: sum of step times change, positive.
    """

    step: FloatArray
    change: FloatArray
    product: float


def _quasi_newton_direction(slope: FloatArray, pairs: deque[_Pair]) -> FloatArray:
    """Return the inverse Hessian times the slope, from steps and the changes of slope on them."""
    if not pairs:
        return np.asarray(slope * (_FIRST_STEP / max(float(np.abs(slope).max()), 1e-300)))
    direction = slope.copy()
    shares = []
    for step, change, product in reversed(pairs):
        share = float((step * direction).sum()) / product
        direction -= share * change
        shares.append(share)
    _step, change, product = pairs[-1]
    direction *= product / float((change * change).sum())
    for (step, change, product), share in zip(pairs, reversed(shares), strict=True):
        direction += step * (share - float((change * direction).sum()) / product)
    return direction

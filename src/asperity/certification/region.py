"""The region in which a renderer is tried, and the calls of a renderer in it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.certification.renderers import Renderer, RendererError
from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError

Predicate = Callable[[FloatArray], NDArray[np.bool_]]
"""Whether points [m], shape (n, 3), belong to a region, shape (n,)."""

_REACH = 0.1
"""Distance from the origin [m] within which a surface is looked for."""
_BORDER_HALVINGS = 8
_LEVELS = 24
_OVERHEAD = 1e-6
_APPROACH = np.append(np.linspace(0.0, 1.0, 13), [1.0, 1.0, 1.0])
"""Shares of an approach: steps, and a rest in which a proxy settles."""
_HALF_WIDTH = 5e-3
_DEPTH = 1e-3
"""Half the width of a region that was found, and its depth below the lowest contact [m]."""


@dataclass(frozen=True)
class Region:
    """A box, or the part of it in which a predicate holds.

    Attributes:
        low: least coordinates [m], shape (3,).
        high: greatest coordinates [m], shape (3,).
        predicate: whether points of the box belong to the region; ``None`` for all.
    """

    low: FloatArray
    high: FloatArray
    predicate: Predicate | None = None

    @property
    def size(self) -> FloatArray:
        """Lengths of the box [m], shape (3,)."""
        return self.high - self.low

    def contains(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return whether points [m], shape (n, 3), are in the region, shape (n,)."""
        slack = 1e-12 * self.size
        is_high_enough = (points >= self.low - slack).all(axis=1)
        is_low_enough = (points <= self.high + slack).all(axis=1)
        inside = np.asarray(is_high_enough & is_low_enough)
        if self.predicate is not None:
            inside[inside] = self.predicate(points[inside])
        return inside

    def points(self, fractions: FloatArray) -> FloatArray:
        """Return the points at fractions of the box, shape (n, 3)."""
        return self.low + fractions * self.size

    def clip(self, points: FloatArray) -> FloatArray:
        """Return the points of the box closest to points [m], shape (..., 3) both."""
        return np.clip(points, self.low, self.high)

    def lowest_points(self, points: FloatArray) -> FloatArray:
        """Return the lowest points of the region above points [m], shape (n, 3) both."""
        columns = np.repeat(points[:, None], _LEVELS, axis=1)
        columns[..., 2] = np.linspace(points[:, 2], self.high[2], _LEVELS, axis=1)
        first = np.argmax(self.contains(columns.reshape(-1, 3)).reshape(-1, _LEVELS), axis=1)
        rows = np.arange(len(points))
        return self.limit(columns[rows, first], columns[rows, np.maximum(first - 1, 0)])

    def limit(self, starts: FloatArray, ends: FloatArray) -> FloatArray:
        """Return the ends of steps [m], or where they leave the region, shape (..., 3).

        Args:
            starts: points of the region, shape (..., 3).
            ends: as many.
        """
        limited = self.clip(ends).reshape(-1, 3)
        beyond = np.flatnonzero(~self.contains(limited))
        inside = starts.reshape(-1, 3)[beyond]
        outside = limited[beyond]
        for _ in range(_BORDER_HALVINGS if len(beyond) else 0):
            middle = 0.5 * (inside + outside)
            is_inside = self.contains(middle)[:, None]
            inside = np.where(is_inside, middle, inside)
            outside = np.where(is_inside, outside, middle)
        limited[beyond] = inside
        return limited.reshape(ends.shape)


class RendererCalls:
    """Counted calls of a renderer in a region, with the extremes of all answers.

    Args:
        renderer: the renderer.
        region: where it is tried.

    Attributes:
        calls: number of forces computed.
        seconds: time that they took [s].
        largest_force: greatest magnitude [N].
        largest_at: where it occurred [m].
        invalid_at: where a force was not finite for the first time [m]; ``None`` if all were.
        approaches: whether each force is preceded by an approach, for a renderer with memory.
    """

    def __init__(self, renderer: Renderer, region: Region) -> None:
        self.renderer = renderer
        self.region = region
        self.calls = 0
        self.seconds = 0.0
        self.largest_force = 0.0
        self.largest_at: FloatArray | None = None
        self.invalid_at: FloatArray | None = None
        self.approaches = False

    @property
    def rate(self) -> float:
        """Calls per second so far, with what a search does for each [Hz]."""
        return self.calls / (self.seconds + _OVERHEAD * self.calls + 1e-6)

    @property
    def per_force(self) -> int:
        """Calls per force: those of an approach count for a renderer with memory."""
        return len(_APPROACH) + 1 if self.approaches else 1

    def along(self, paths: FloatArray) -> FloatArray:
        """Return forces along paths, each after a reset, shape (n, m, 3); NaN if not finite."""
        if not len(paths):
            return paths
        began = time.perf_counter()
        forces = np.array(self.renderer.forces(np.ascontiguousarray(paths)), dtype=np.float64)
        self.seconds += time.perf_counter() - began
        if forces.shape != paths.shape:
            raise RendererError(f"returned forces of shape {forces.shape}, not {paths.shape}")
        self.calls += forces.size // 3
        self._record(paths.reshape(-1, 3), forces.reshape(-1, 3))
        return forces

    def at(self, points: FloatArray) -> FloatArray:
        """Return the force at points, each after a reset, shape (n, 3)."""
        return self.along(points[:, None])[:, 0]

    def on_curves(self, curves: FloatArray) -> FloatArray:
        """Return forces on curves, which a renderer with memory walks, shape (n, m, 3) both."""
        if self.approaches:
            return self.along(curves)
        return self.at(curves.reshape(-1, 3)).reshape(curves.shape)

    def inside_on_curves(self, curves: FloatArray) -> FloatArray:
        """Return forces on curves in the region, NaN elsewhere; see ``on_curves``."""
        inside = self.region.contains(curves.reshape(-1, 3)).reshape(curves.shape[:2])
        if self.approaches:
            return np.where(inside[:, :, None], self.along(curves), np.nan)
        forces = np.full(curves.shape, np.nan)
        forces[inside] = self.at(curves[inside])
        return forces

    def after(self, approaches: FloatArray, starts: FloatArray, points: FloatArray) -> FloatArray:
        """Return the forces at points [N], shape (n, m, 3).

        A renderer with memory walks after a reset in small steps from its approach to its start,
        rests there, and steps to the point.

        Args:
            approaches: where the approach begins [m], shape (n, 3).
            starts: where it ends [m], shape (n, 3).
            points: [m], shape (n, m, 3).
        """
        if not self.approaches:
            return self.at(points.reshape(-1, 3)).reshape(points.shape)
        paths = [
            approach_paths(approaches, starts, points[:, index]) for index in range(points.shape[1])
        ]
        forces = self.along(np.concatenate(paths))[:, -1]
        return np.swapaxes(forces.reshape(points.shape[1], -1, 3), 0, 1)

    def _record(self, points: FloatArray, forces: FloatArray) -> None:
        invalid = ~np.isfinite(forces).all(axis=1)
        if invalid.any():
            if self.invalid_at is None:
                self.invalid_at = points[np.argmax(invalid)].copy()
            forces[invalid] = np.nan
        magnitudes = np.where(invalid, 0.0, np.sqrt(np.square(forces).sum(axis=1)))
        index = int(np.argmax(magnitudes))
        if magnitudes[index] > self.largest_force:
            self.largest_force = float(magnitudes[index])
            self.largest_at = points[index].copy()


def approach_paths(approaches: FloatArray, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Return paths from approaches by starts to ends, shape (n, 3) each, as shape (n, k, 3)."""
    walks = approaches[:, None] + _APPROACH[:, None] * (starts - approaches)[:, None]
    return np.concatenate([walks, ends[:, None]], axis=1)


def step_changes(forces: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the changes of forces in the last step of paths [N], shape (n, m, 3).

    Returns:
        The changes, shape (n, 3), and their magnitudes beyond the change in the rest before, since
        the force of a renderer with memory may change without a step, shape (n,).
    """
    steps = np.diff(forces[:, -3:], axis=1)
    rests, sizes = np.sqrt(np.square(steps).sum(axis=2)).T
    return steps[:, 1], sizes - rests


def contact_heights(calls: RendererCalls, xy: FloatArray, low: float, high: float) -> FloatArray:
    """Return where the force begins below points of the plane [m], shape (n,); NaN if nowhere.

    Args:
        calls: the renderer.
        xy: [m], shape (n, 2).
        low: lowest height [m].
        high: highest height [m].
    """
    heights = np.linspace(high, low, 65)
    columns = np.empty((len(xy), len(heights), 3))
    columns[..., :2] = xy[:, None]
    columns[..., 2] = heights
    forces = calls.at(columns.reshape(-1, 3)).reshape(columns.shape)
    touches = (forces != 0.0).any(axis=2)
    first = np.argmax(touches, axis=1)
    above = heights[np.maximum(first - 1, 0)]
    below = heights[first]
    for _ in range(40):
        middle = 0.5 * (above + below)
        force = calls.at(np.column_stack([xy, middle]))
        is_touching = (force != 0.0).any(axis=1)
        below = np.where(is_touching, middle, below)
        above = np.where(is_touching, above, middle)
    return np.where(touches.any(axis=1), np.round(below, 13) + 0.0, np.nan)  # no -0


def find_region(renderer: Renderer) -> Region:
    """Return a box around the place where the force begins near the z axis.

    Raises:
        ParameterError: if there is no force within 0.1 m of the origin.
    """
    everywhere = Region(np.full(3, -_REACH), np.full(3, _REACH))
    calls = RendererCalls(renderer, everywhere)
    side = np.linspace(-_HALF_WIDTH, _HALF_WIDTH, 5)
    xy = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    heights = contact_heights(calls, xy, -_REACH, _REACH)
    if np.isnan(heights).all():
        raise ParameterError("region", "is needed: no force was found within 0.1 m of the origin")
    bottom = float(np.nanmin(heights)) - _DEPTH
    top = float(np.nanmax(heights)) + 0.1 * _DEPTH
    width = _HALF_WIDTH
    return Region(np.array([-width, -width, bottom]), np.array([width, width, top]))

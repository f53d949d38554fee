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
        """Calls per second so far [Hz]."""
        return self.calls / max(self.seconds, 1e-6)

    def along(self, paths: FloatArray) -> FloatArray:
        """Return forces along paths, each after a reset, shape (n, m, 3); NaN if not finite."""
        began = time.perf_counter()
        forces = np.array(self.renderer.forces(np.ascontiguousarray(paths)), dtype=np.float64)
        self.seconds += time.perf_counter() - began
        if forces.shape != paths.shape:
            raise RendererError(f"returned forces of shape {forces.shape}, not {paths.shape}")
        self.calls += forces.size // 3
        self._record(paths.reshape(-1, 3), forces.reshape(-1, 3))
        return forces

    def at(self, points: FloatArray, offsets: FloatArray | None = None) -> FloatArray:
        """Return the force at points, shape (n, 3).

        Args:
            points: [m], shape (n, 3).
            offsets: where the approach of a renderer with memory begins, relative to the point [m];
                by default at the point itself.
        """
        if offsets is None or not self.approaches:
            return self.along(points[:, None])[:, 0]
        return self.along(np.stack([points + offsets, points], axis=1))[:, 1]

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

"""Search for closed loops on which a renderer gains energy, and their work under refinement.

For a renderer without memory the circulation of the cells of a plane grid is computed; the cells of
one sign, walked around, gain the sum of their circulations. For a renderer with memory, polygons
are improved by random steps, walked until the work of a turn is steady.

**The work of a loop is what it tends to under refinement.** Its error is the larger of the last two
changes on doubling the points; a loop counts only if its work exceeds five times its error. Without
refinement, a search over loops maximizes the error of quadrature and finds gains in conservative
fields.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.certification.climbing import climb
from asperity.certification.region import RendererCalls
from asperity.certification.resolution import Resolution
from asperity.core.checks import FloatArray
from asperity.core.files import Serializable

TURNS = 3
"""Turns of a loop of a renderer with memory; the last one counts."""
_ERRORS_PER_WORK = 5.0
_ROUNDING = 1e-8
_COARSE_CELLS = 36
_FINE_CELLS = 128
_REFINED = 6
_POLYGONS = 64
_VERTICES = 6
_SIDE_POINTS = 24
_LOOP_POINTS = 512
_MAX_SIDES = 20_000


@dataclass(frozen=True)
class ClosedLoop(Serializable):
    """A closed path on which the renderer gains energy.

    Attributes:
        energy: work of the force on the hand in a turn, trapezoidal, refined [J].
        error: larger of its last two changes on doubling the points, and what noise and steps of
            the renderer explain [J].
        length: of the path [m].
        path: vertices [m], shape (n, 3); the last is joined to the first.
        turns: turns after which the work is that of a turn; 1 without memory.
        held_energy: work in a turn with the force held between samples at the stated speed and
            rate: it contains ½ Σ Δf·Δp, which vanishes with the period of the samples [J].
        held_speed: the speed [m/s].
        held_rate: the rate [Hz].
    """

    energy: float
    error: float
    length: float
    path: FloatArray
    turns: int = 1
    held_energy: float = math.nan
    held_speed: float = 0.1
    held_rate: float = 1000.0

    @property
    def counts(self) -> bool:
        """Whether the gain exceeds its error enough to be one."""
        return self.energy > _ERRORS_PER_WORK * self.error

    @property
    def density(self) -> float:
        """Energy per length of path [N]: the dry friction that absorbs it."""
        return self.energy / self.length

    def critical_speed(self, damping: float) -> float:
        """Return v* [m/s]: below this speed viscous damping [N s/m] absorbs less than the gain."""
        return self.density / damping


class LoopSearch:
    """Search for the loop of greatest energy.

    Args:
        calls: the renderer in its region.
        resolution: its noise and steps.
        gain: the gain found [N/m], with which steps of position explain changes of force.
        seed: of the random numbers.

    Attributes:
        best: the loop of greatest energy; ``None`` for none.
        rejected: number of loops whose gain was within its error.
    """

    def __init__(
        self, calls: RendererCalls, resolution: Resolution, gain: float, seed: int
    ) -> None:
        self.calls = calls
        self.best: ClosedLoop | None = None
        self.rejected = 0
        self._unknown_force = resolution.explained(gain)
        self._random = np.random.default_rng(seed)

    def run(self, deadline: float) -> None:
        """Search until a time of the monotonic clock [s]."""
        while True:
            if self.calls.approaches:
                self._search_polygons(deadline)
            else:
                self._search_planes(deadline)
            if time.monotonic() >= deadline:
                return

    # --- grids of planes ---

    def _search_planes(self, deadline: float) -> None:
        """Try planes at random on a coarse grid, and the best ones on a fine grid."""
        budget = self.calls.rate * max(deadline - time.monotonic(), 0.0)
        cells = int(min(_COARSE_CELLS, max(6.0, math.sqrt(budget / 80.0))))
        fine_cells = int(min(_FINE_CELLS, max(cells, 0.3 * math.sqrt(budget))))
        planes = [self._random_plane() for _ in range(4 * _REFINED)]
        energies = []
        for plane in planes:
            circulations = self._circulations(plane, cells)
            positive = circulations[circulations > 0.0].sum()
            negative = -circulations[circulations < 0.0].sum()
            energies.append(max(positive, negative))
            if time.monotonic() >= deadline:
                break
        for index in np.argsort(energies)[::-1][:_REFINED]:
            self._walk_around(planes[index], fine_cells)
            if time.monotonic() >= deadline:
                break

    def _random_plane(self) -> FloatArray:
        """Return corner and two sides of a rectangle in the region, shape (3, 3).

        Most planes are vertical, along the axes or at any angle; some are horizontal.
        """
        region = self.calls.region
        size = region.size
        at = region.points(self._random.uniform(size=3))
        kind = int(self._random.integers(8))
        if kind == 7:
            corner = np.array([region.low[0], region.low[1], at[2]])
            return np.array([corner, [size[0], 0.0, 0.0], [0.0, size[1], 0.0]])
        angle = self._random.uniform(0.0, math.pi)
        if kind < 6:
            angle = 0.5 * math.pi * (kind % 2)
        direction = np.array([math.cos(angle), math.sin(angle), 0.0])
        start, end = _chord(region.low[:2], region.high[:2], at[:2], direction[:2])
        corner = np.array([*(at[:2] + start * direction[:2]), region.low[2]])
        return np.array([corner, (end - start) * direction, [0.0, 0.0, size[2]]])

    def _circulations(self, plane: FloatArray, cells: int) -> FloatArray:
        """Return the work around each cell of a grid, zero outside of the region, shape (n, n)."""
        corner, side, height = plane
        nodes = np.arange(cells + 1.0) / cells
        middles = nodes[:-1] + 0.5 / cells
        along = corner + middles[:, None, None] * side + nodes[None, :, None] * height
        up = corner + nodes[:, None, None] * side + middles[None, :, None] * height
        work_along = self.calls.at(along.reshape(-1, 3)).reshape(along.shape) @ side / cells
        work_up = self.calls.at(up.reshape(-1, 3)).reshape(up.shape) @ height / cells
        work = work_along[:, :-1] + work_up[1:] - work_along[:, 1:] - work_up[:-1]
        corners = corner + nodes[:, None, None] * side + nodes[None, :, None] * height
        inside = self.calls.region.contains(corners.reshape(-1, 3)).reshape(cells + 1, cells + 1)
        whole = inside[:-1, :-1] & inside[1:, :-1] & inside[:-1, 1:] & inside[1:, 1:]
        return np.where(whole & np.isfinite(work), work, 0.0)

    def _walk_around(self, plane: FloatArray, cells: int) -> None:
        """Record the loop around all cells of one sign, joined by ways there and back."""
        from scipy import ndimage

        circulations = self._circulations(plane, cells)
        threshold = 1e-3 * np.abs(circulations).max()
        for sign in (1, -1):
            labels, count = ndimage.label(sign * circulations > threshold)
            energies = ndimage.sum(sign * circulations, labels, np.arange(1, count + 1))
            outlines: list[FloatArray] = []
            for label in np.argsort(energies)[::-1] + 1:
                for outline in cell_outlines(labels == label):
                    vertices = outline[::sign] / cells
                    outlines.append(plane[0] + vertices @ plane[1:])
                if sum(map(len, outlines)) > _MAX_SIDES:
                    break
            self._record_outlines(outlines)

    def _record_outlines(self, outlines: list[FloatArray]) -> None:
        """Record the loop that consists of the outlines which gain more than their error."""
        parts = []
        for outline in outlines:
            part = self.measure(outline)
            if part.counts:
                parts.append(part)
        self.rejected += len(outlines) - len(parts)
        if not parts:
            return
        parts.sort(key=lambda part: -part.energy)
        energy = sum(part.energy for part in parts)
        if self.best is not None and energy <= self.best.energy:
            return
        path = parts[0].path
        for part in parts[1:]:  # from the first vertex there, around it, and back
            path = np.concatenate([path, path[:1], part.path, part.path[:1]])
        path = path if len(parts) == 1 else np.concatenate([path, path[:1]])
        error = sum(part.error for part in parts)
        self.best = ClosedLoop(energy, error, _length(path), path)

    # --- polygons of a renderer with memory ---

    def _search_polygons(self, deadline: float) -> None:
        """Improve polygons by random steps."""
        polygons, _energies = climb(
            self._random_polygons(),
            self._polygon_works,
            lambda: time.monotonic() >= deadline,
            self._random,
            spread=0.3,
            selects=True,
        )
        for polygon in polygons[:_REFINED]:
            loop = self.measure(self.calls.region.points(polygon))
            if not loop.counts:
                self.rejected += 1
            elif self.best is None or loop.energy > self.best.energy:
                self.best = loop

    def _random_polygons(self) -> FloatArray:
        """Return polygons in vertical planes as fractions of the region, of many sizes."""
        angle = self._random.uniform(0.0, math.pi, (_POLYGONS, 1))
        angle[::2] = 0.5 * math.pi * self._random.integers(2, size=(len(angle[::2]), 1))
        along = self._random.uniform(-0.5, 0.5, (_POLYGONS, _VERTICES))
        along *= 10.0 ** self._random.uniform(-1.0, 0.3, (_POLYGONS, 1))
        centre = self._random.uniform(size=(2, _POLYGONS, 1))
        x = centre[0] + along * np.cos(angle)
        y = centre[1] + along * np.sin(angle)
        z = self._random.uniform(size=(_POLYGONS, _VERTICES))
        return np.asarray(np.clip(np.stack([x, y, z], axis=2), 0.0, 1.0))

    def _polygon_works(self, polygons: FloatArray) -> FloatArray:
        """Return the work of the last turn of each polygon [J], shape (polygons,)."""
        corners = self.calls.region.points(polygons)
        following = np.roll(corners, -1, axis=1)
        shares = np.arange(_SIDE_POINTS)[:, None] / _SIDE_POINTS
        paths = corners[:, :, None] + shares * (following - corners)[:, :, None]
        paths = paths.reshape(len(polygons), -1, 3)
        energies: FloatArray = self._turn_works(paths)[0]
        return energies

    def _turn_works(self, curves: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the works of the last turn and of the one before [J], shape (curves,) each."""
        turns = np.concatenate([np.tile(curves, (1, TURNS, 1)), curves[:, :1]], axis=1)
        forces = self.calls.along(turns)
        steps = np.diff(turns, axis=1)
        works = (0.5 * (forces[:, 1:] + forces[:, :-1]) * steps).sum(axis=2)
        works = works.reshape(len(curves), TURNS, -1).sum(axis=2)
        inside = self.calls.region.contains(curves.reshape(-1, 3)).reshape(curves.shape[:2])
        is_valid = np.asarray(inside.all(axis=1)) & np.isfinite(works).all(axis=1)
        works = np.where(is_valid[:, None], works, -np.inf)
        return works[:, -1], works[:, -2]

    # --- work under refinement ---

    def measure(self, vertices: FloatArray) -> ClosedLoop:
        """Return the loop through vertices with its work at one, two and four times the points."""
        length = _length(vertices)
        works = []
        doubt = 0.0
        for factor in (1, 2, 4):
            path = subdivide(vertices, length / (_LOOP_POINTS * factor), 2 * factor)
            if self.calls.approaches:
                last, previous = self._turn_works(path[None])
                work = float(last[0])
                doubt = abs(work - float(previous[0]))
            else:
                work, doubt = self._middle_work(path)
            works.append(work)
        first, second, third = works
        changes = max(abs(second - first), abs(third - second), doubt)
        error = math.inf
        if math.isfinite(changes):
            unknown = self._unknown_force + _ROUNDING * self.calls.largest_force
            error = changes + unknown * length / _ERRORS_PER_WORK
        turns = TURNS if self.calls.approaches else 1
        return ClosedLoop(third, error, length, vertices, turns)

    def _middle_work(self, path: FloatArray) -> tuple[float, float]:
        """Return the work with the force at the middle of each side, and what jumps make of it.

        Where the force jumps within a side, doubling the points may change nothing by chance. A
        jump is a change between neighbours that exceeds twice those beside it.
        """
        steps = np.roll(path, -1, axis=0) - path
        forces = self.calls.at(path + 0.5 * steps)
        changes = np.sqrt(np.square(np.roll(forces, -1, axis=0) - forces).sum(axis=1))
        smooth = 2.0 * (np.roll(changes, 1) + np.roll(changes, -1))
        jumps = np.maximum(changes - smooth, 0.0)
        doubt = jumps * np.sqrt(np.square(steps).sum(axis=1))
        return float((forces * steps).sum()), float(doubt.sum())

    def walking_spread(self, loop: ClosedLoop) -> tuple[float, FloatArray]:
        """Return how much the forces of a walk around a loop differ from those after a reset.

        Returns:
            The greatest difference [N], beyond what noise and steps explain, and where it is [m].
        """
        path = resample(loop.path, 4 * _LOOP_POINTS)
        changes = self.calls.along(np.tile(path, (2, 1))[None])[0, len(path) :] - self.calls.at(
            path
        )
        sizes = np.nan_to_num(np.sqrt(np.square(changes).sum(axis=1)))
        index = int(np.argmax(sizes))
        threshold = self._unknown_force + 1e-9 * self.calls.largest_force
        return float(sizes[index]) if sizes[index] > threshold else 0.0, path[index]

    def held_work(self, loop: ClosedLoop) -> ClosedLoop:
        """Return the loop with its held-force work."""
        spacing = loop.held_speed / loop.held_rate
        count = max(8, min(round(loop.length / spacing), 200_000))
        path = resample(loop.path, count)
        turns = np.concatenate([np.tile(path, (loop.turns, 1)), path[:1]])
        forces = self.calls.along(turns[None])[0]
        work = float((forces[:-1] * np.diff(turns, axis=0))[-count:].sum())
        return ClosedLoop(
            loop.energy,
            loop.error,
            loop.length,
            loop.path,
            loop.turns,
            work,
            loop.held_speed,
            loop.held_rate,
        )


def cell_outlines(cells: NDArray[np.bool_]) -> list[FloatArray]:
    """Return the outlines of a set of cells, counter-clockwise around them, shape (n, 2) each.

    Straight runs have no vertices between their ends.
    """
    padded = np.pad(cells, 1)
    following: dict[tuple[int, int], list[tuple[int, int]]] = {}
    # Each side with a cell on its left and none on its right, as its first and second node.
    for i, j in np.argwhere(cells).tolist():
        if not padded[i + 1, j]:
            following.setdefault((i, j), []).append((i + 1, j))
        if not padded[i + 2, j + 1]:
            following.setdefault((i + 1, j), []).append((i + 1, j + 1))
        if not padded[i + 1, j + 2]:
            following.setdefault((i + 1, j + 1), []).append((i, j + 1))
        if not padded[i, j + 1]:
            following.setdefault((i, j + 1), []).append((i, j))
    outlines = []
    while following:
        node = next(iter(following))
        nodes = []
        while node in following:
            nodes.append(node)
            targets = following[node]
            target = targets.pop()
            if not targets:
                del following[node]
            node = target
        corners = np.array(nodes, dtype=float)
        turn = np.diff(np.concatenate([corners[-1:], corners, corners[:1]]), 2, axis=0)
        outlines.append(corners[(turn != 0.0).any(axis=1)])
    return outlines


def subdivide(vertices: FloatArray, spacing: float, least: int) -> FloatArray:
    """Return a closed path with each side divided into equal parts, at least so many.

    Args:
        vertices: [m], shape (n, 3).
        spacing: greatest length of a part [m].
        least: number of parts of each side, at least.
    """
    following = np.roll(vertices, -1, axis=0)
    lengths = np.sqrt(np.square(following - vertices).sum(axis=1))
    counts = np.maximum(np.ceil(lengths / spacing).astype(int), least)
    sides = np.repeat(np.arange(len(vertices)), counts)
    starts = np.cumsum(counts) - counts
    shares = (np.arange(len(sides)) - starts[sides]) / counts[sides]
    return np.asarray(vertices[sides] + shares[:, None] * (following - vertices)[sides])


def resample(vertices: FloatArray, count: int) -> FloatArray:
    """Return a closed path as equally spaced points, shape (count, 3)."""
    closed = np.concatenate([vertices, vertices[:1]])
    lengths = np.sqrt(np.square(np.diff(closed, axis=0)).sum(axis=1))
    distances = np.concatenate([np.zeros(1), np.cumsum(lengths)])
    wanted = distances[-1] * np.arange(count) / count
    return np.column_stack([np.interp(wanted, distances, closed[:, axis]) for axis in range(3)])


def _length(vertices: FloatArray) -> float:
    steps = np.roll(vertices, -1, axis=0) - vertices
    return float(np.sqrt(np.square(steps).sum(axis=1)).sum())


def _chord(
    low: FloatArray, high: FloatArray, at: FloatArray, direction: FloatArray
) -> tuple[float, float]:
    """Return the range of t for which at + t direction is in a rectangle."""
    with np.errstate(divide="ignore", invalid="ignore"):
        first = (low - at) / direction
        second = (high - at) / direction
    start = np.fmax.reduce(np.fmin(first, second))
    end = np.fmin.reduce(np.fmax(first, second))
    return float(start), float(end)

"""Search for closed loops on which a renderer gains energy, and their work under refinement.

For a renderer without memory the circulation of the cells of a plane grid is computed. A loop that
passes the columns of the grid forwards at one height and backwards at a higher one gains the sum of
the circulations between them, and so does, with the other sign, its reverse. For a renderer with
memory, polygons are improved by random steps, walked until the work of a turn is steady; the best
get twice the vertices, again and again.

**The work of a loop is what it tends to under refinement.** Its error is the larger of the last two
changes on doubling the points; a loop counts only if its work exceeds five times its error. Without
refinement, a search over loops maximizes the error of quadrature and finds gains in conservative
fields.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from asperity.analysis.energy.closed_loops import polygon_length
from asperity.certification.climbing import climb
from asperity.certification.column_loops import (
    find_circulations,
    find_column_loops,
    horizontal_planes,
    random_ends,
    vertical_planes,
)
from asperity.certification.region import RendererCalls
from asperity.certification.resolution import Resolution
from asperity.core.checks import FloatArray
from asperity.core.files import Serializable

TURNS = 3
"""Turns of a loop of a renderer with memory; the last one counts."""
_ERRORS_PER_WORK = 5.0
_ROUNDING = 1e-8
_COARSE_CELLS = 32
_MIDDLE_CELLS = 128
_FINE_CELLS = 400
"""Cells of a grid along each side: to find planes, to choose between them, to walk loops."""
_PLANES = 32
_CHOSEN_PLANES = 10
_LOOPS_A_ROUND = 12
_REFINED_POLYGONS = 6
_WAY_PARTS = 4
_BORDER_MARGIN = 0.005
_POLYGONS = 48
_TRIED_POLYGONS = 1000
_VERTICES = 8
_STEPS = 100
_STAGE_ENDS = (0.1, 0.2, 0.35, 0.6, 1.0)
"""Shares of the time at which each stage of polygons ends; each has twice the vertices."""
_STAGE_STEPS = 2**31  # as many as the time allows
_LEAST_POLYGONS = 4
_SIDE_POINTS = 16
_SEARCHED_POINTS = 512
"""Points of a side of a polygon, and of all its sides, at most, while it is searched."""
_LOOP_POINTS = 512
_FIRST_SPREAD = 0.3


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
        densest: the loop of greatest energy per length.
        rejected: number of loops whose gain was within its error.
    """

    def __init__(
        self, calls: RendererCalls, resolution: Resolution, gain: float, seed: int
    ) -> None:
        self.calls = calls
        self.best: ClosedLoop | None = None
        self.densest: ClosedLoop | None = None
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
            if _is_past(deadline):
                return

    # --- grids of planes ---

    def _search_planes(self, deadline: float) -> None:
        """Find planes of much circulation on a coarse grid, and their loops on finer ones."""
        now = time.monotonic()
        budget = self.calls.rate * max(deadline - now, 0.0)
        cells = int(min(_COARSE_CELLS, max(6.0, math.sqrt(budget / 1600.0))))
        fine_cells = int(min(_FINE_CELLS, max(cells, 0.25 * math.sqrt(budget))))
        count = int(min(_PLANES, max(4.0, 0.05 * budget / cells**2)))
        planes = self._best_planes(count, cells, now + 0.4 * (deadline - now))
        middle_cells = int(min(_MIDDLE_CELLS, max(cells, 0.1 * math.sqrt(budget))))
        works = [self._best_loop_work(plane, middle_cells) for plane in planes]
        found = 0
        for plane in planes[np.argsort(works)[::-1]]:
            circulations = find_circulations(self.calls, plane, fine_cells)
            for sign in (1.0, -1.0):
                found += self._record_columns(sign * circulations, plane)
            if found >= _LOOPS_A_ROUND or _is_past(deadline):
                break

    def _best_loop_work(self, plane: FloatArray, cells: int) -> float:
        """Return the greatest work of a simple loop of a grid [J], not refined."""
        circulations = find_circulations(self.calls, plane, cells)
        works = [find_column_loops(plane, sign * circulations).works for sign in (1.0, -1.0)]
        return float(np.sum(works, axis=1).max())

    def _best_planes(self, count: int, cells: int, deadline: float) -> FloatArray:
        """Return the planes of most circulation on a grid, the best first, shape (n, 3, 3).

        Vertical planes climb; a horizontal plane has a random height.
        """
        region = self.calls.region
        flat = horizontal_planes(region, self._random.uniform(size=count // 4))
        ends, energies = climb(
            random_ends(region, count, self._random),
            lambda ends: self._plane_energies(vertical_planes(region, ends), cells),
            lambda _starts, ends: region.clip(ends),
            partial(_is_past, deadline),
            self._random,
            _FIRST_SPREAD * region.size,
            _STEPS,
        )
        planes = np.concatenate([vertical_planes(region, ends), flat])
        energies = np.concatenate([energies, self._plane_energies(flat, cells)])
        return planes[np.argsort(-energies)[:_CHOSEN_PLANES]]

    def _plane_energies(self, planes: FloatArray, cells: int) -> FloatArray:
        """Return the sums of the magnitudes of the circulations of planes [J], shape (n,)."""
        circulations = [find_circulations(self.calls, plane, cells) for plane in planes]
        return np.array([np.nansum(np.abs(works)) for works in circulations])

    def _record_columns(self, circulations: FloatArray, plane: FloatArray) -> int:
        """Measure the simple loop of greatest energy in a plane, and a part of greater density.

        A loop passes the columns of the grid forwards at one height and backwards at another; that
        against the sense of the circulations is tried with their signs changed.

        Returns:
            How many of the two count.
        """
        column_loops = find_column_loops(plane, circulations)
        first, end = column_loops.densest_columns(0.0)
        for found in range(2):
            if not column_loops.encloses_area(first, end):
                return found
            loop = self.measure(self._path_within(column_loops.path(first, end)))
            if loop.energy < 0.0:
                loop = replace(loop, energy=-loop.energy, path=loop.path[::-1])
            if not self._keep(loop):
                return found
            first, end = column_loops.densest_columns(loop.density)
        return 2

    def _path_within(self, path: FloatArray) -> FloatArray:
        """Return a path through columns, there and back, with what is outside at the border.

        Points of a way are moved towards the middle between both ways.
        """
        points = subdivide(path, math.inf, _WAY_PARTS)
        middles = 0.5 * (points + np.roll(points[::-1], 1 - _WAY_PARTS, axis=0))
        limited = self.calls.region.limit(middles, points)
        is_moved = (limited != points).any(axis=1)
        # Straight parts between points of a curved border are outside.
        limited[is_moved] += _BORDER_MARGIN * (middles - limited)[is_moved]
        is_moved[::_WAY_PARTS] = True
        return np.asarray(limited[is_moved])

    def _keep(self, loop: ClosedLoop) -> bool:
        """Keep a loop if it is the best; return whether it counts."""
        if not loop.counts:
            self.rejected += 1
            return False
        if self.best is None or loop.energy > self.best.energy:
            self.best = loop
        if self.densest is None or loop.density > self.densest.density:
            self.densest = loop
        return True

    # --- polygons of a renderer with memory ---

    def _search_polygons(self, deadline: float) -> None:
        """Improve the best of random polygons by random steps, with more and more vertices."""
        region = self.calls.region
        now = time.monotonic()
        polygons = self._starting_polygons(deadline)
        for share in _STAGE_ENDS:
            end = now + share * (deadline - now)
            polygons, _energies = climb(
                polygons,
                self._polygon_works,
                region.limit,
                partial(_is_past, end),
                self._random,
                _FIRST_SPREAD * region.size,
                _STAGE_STEPS,
            )
            self._measure_polygons(polygons[:_REFINED_POLYGONS])
            if _is_past(deadline):
                return
            best = polygons[: max(len(polygons) // 4, _LEAST_POLYGONS)]
            middles = 0.5 * (best + np.roll(best, -1, axis=1))
            polygons = np.stack([best, middles], axis=2).reshape(len(best), -1, 3)

    def _measure_polygons(self, polygons: FloatArray) -> None:
        for polygon in polygons:
            self._keep(self.measure(polygon))

    def _starting_polygons(self, deadline: float) -> FloatArray:
        """Return the best of random polygons, of more the faster the renderer is [m]."""
        budget = self.calls.rate * max(deadline - time.monotonic(), 0.0)
        share = 0.1 * budget / (_VERTICES * _SIDE_POINTS * TURNS)
        tried = self._random_polygons(int(min(_TRIED_POLYGONS, max(_POLYGONS, share))))
        return tried[np.argsort(-self._polygon_works(tried))[:_POLYGONS]]

    def _random_polygons(self, number: int) -> FloatArray:
        """Return polygons of many sizes [m], a third of them horizontal, shape (n, vertices, 3)."""
        region = self.calls.region
        centres = region.points(self._random.uniform(size=(100 * number, 3)))
        centres = centres[region.contains(centres)][:number, None]
        moves = self._vertical_moves(len(centres))
        moves[::3] = self._circular_moves(len(moves[::3]))
        starts = np.broadcast_to(centres, moves.shape)
        return region.limit(starts, centres + moves * region.size)

    def _vertical_moves(self, count: int) -> FloatArray:
        """Return vertices in vertical planes, as shares of the region from their centre."""
        angle = self._random.uniform(0.0, math.pi, (count, 1))
        angle[::2] = 0.5 * math.pi * self._random.integers(2, size=(len(angle[::2]), 1))
        along = self._random.uniform(-0.5, 0.5, (count, _VERTICES))
        along *= 10.0 ** self._random.uniform(-1.0, 0.3, (count, 1))
        across = self._random.uniform(-1.0, 1.0, (count, _VERTICES))
        return np.stack([along * np.cos(angle), along * np.sin(angle), across], axis=2)

    def _circular_moves(self, count: int) -> FloatArray:
        """Return vertices on horizontal circles that wind once or more, in either sense."""
        windings = self._random.integers(1, 4, (count, 1)) * self._random.choice(
            (-1, 1), (count, 1)
        )
        angle = 2.0 * math.pi * windings * np.arange(_VERTICES) / _VERTICES
        radius = 0.5 * 10.0 ** self._random.uniform(-1.0, 0.0, (count, 1))
        around = [radius * np.cos(angle), radius * np.sin(angle), np.zeros_like(angle)]
        return np.stack(around, axis=2)

    def _polygon_works(self, polygons: FloatArray) -> FloatArray:
        """Return the work of the last turn of each polygon [J], shape (polygons,)."""
        following = np.roll(polygons, -1, axis=1)
        count = min(_SIDE_POINTS, _SEARCHED_POINTS // polygons.shape[1])
        shares = np.arange(count)[:, None] / count
        paths = polygons[:, :, None] + shares * (following - polygons)[:, :, None]
        return self._turn_works(paths.reshape(len(polygons), -1, 3))[0]

    # --- work under refinement ---

    def measure(self, vertices: FloatArray) -> ClosedLoop:
        """Return the loop through vertices with its work at one, two and four times the points.

        One that counts is measured at 8 and 16 times the points, too: of many loops, some have
        three works that agree by chance, and some few have four.
        """
        loop = ClosedLoop(0.0, math.inf, polygon_length(vertices), vertices, self._turns)
        works: list[float] = []
        for factor in (1, 2, 4, 8, 16):
            path = subdivide(vertices, loop.length / (_LOOP_POINTS * factor), 2 * factor)
            turn_works, doubts = self._turn_works(path[None])
            works.append(float(turn_works[0]))
            if factor >= 4:
                error = self._work_error(works, float(doubts[0]), loop.length)
                loop = replace(loop, energy=works[-1], error=error)
                if abs(loop.energy) <= _ERRORS_PER_WORK * error:
                    break
        return loop

    def _work_error(self, works: Sequence[float], doubt: float, length: float) -> float:
        """Return the error [J] of the last of works, each at twice the points of the one before."""
        first, second, third = works[-3:]
        changes = max(abs(second - first), abs(third - second), doubt)
        if not math.isfinite(changes):
            return math.inf
        unknown = self._unknown_force + _ROUNDING * self.calls.largest_force
        return changes + unknown * length / _ERRORS_PER_WORK

    @property
    def _turns(self) -> int:
        return TURNS if self.calls.approaches else 1

    def _turn_works(self, curves: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the works of the last turn, and their doubts [J], shape (curves,) each.

        A work is in doubt by its change from turn to turn, and by the jumps within steps, since
        doubling the points may change nothing there by chance.
        """
        turns = self._turns
        walks = np.concatenate([np.tile(curves, (1, turns, 1)), curves[:, :1]], axis=1)
        forces = self.calls.on_curves(walks)
        steps = np.diff(walks, axis=1)
        works = (0.5 * (forces[:, 1:] + forces[:, :-1]) * steps).sum(axis=2)
        works = works.reshape(len(curves), turns, -1).sum(axis=2)
        last = curves.shape[1]
        doubts = _jump_doubts(forces[:, -last - 1 :], steps[:, -last:])
        if turns > 1:
            doubts = np.maximum(doubts, np.abs(works[:, -1] - works[:, -2]))
        inside = self.calls.region.contains(curves.reshape(-1, 3)).reshape(curves.shape[:2])
        is_valid = np.asarray(inside.all(axis=1)) & np.isfinite(works).all(axis=1)
        return np.where(is_valid, works[:, -1], -np.inf), doubts

    def walking_spread(self, loop: ClosedLoop) -> tuple[float, FloatArray]:
        """Return how much the forces of a walk around a loop differ from those after a reset.

        Returns:
            The greatest difference [N], beyond what noise and steps explain, and where it is [m].
        """
        path = resample(loop.path, 4 * _LOOP_POINTS)
        sizes = np.full(len(path), np.inf)
        for _ in range(3):  # noise that is rare does not come again
            walked = self.calls.along(np.tile(path, (2, 1))[None])[0, len(path) :]
            changes = walked - self.calls.at(path)
            sizes = np.fmin(sizes, np.sqrt(np.square(changes).sum(axis=1)))
        index = int(np.argmax(np.nan_to_num(sizes)))
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
        return replace(loop, held_energy=work)


def _jump_doubts(forces: FloatArray, steps: FloatArray) -> FloatArray:
    """Return what jumps within steps may do to works [J], shape (curves,).

    A jump is a change between neighbours that exceeds twice those beside it.
    """
    changes = np.sqrt(np.square(np.diff(forces, axis=1)).sum(axis=2))
    beside = np.roll(changes, 1, axis=1) + np.roll(changes, -1, axis=1)
    jumps = np.maximum(changes - 2.0 * beside, 0.0)
    return np.asarray((jumps * np.sqrt(np.square(steps).sum(axis=2))).sum(axis=1))


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


def _is_past(deadline: float) -> bool:
    return time.monotonic() >= deadline

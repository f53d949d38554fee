"""Jumps of a force: places where it changes by a finite amount over any distance.

Lines through the region are sampled densely. Where the force bends most between neighbours, the
segment is halved again and again, always towards the half with the larger change beyond the trend
of its surroundings. A slope, however steep, loses its change in proportion to the length; a jump
keeps it.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.certification.gain_search import GainWitness
from asperity.certification.region import RendererCalls, approach_paths, step_changes
from asperity.certification.resolution import Resolution
from asperity.core.checks import FloatArray, IntArray
from asperity.core.files import Serializable

_SAMPLES = 128
_SHARE_PER_BATCH = 0.05
_LEAST_BATCH = 512
_LARGEST_BATCH = 2**16
"""Samples of a line at least, and of all lines that are searched at once."""
_SAMPLES_PER_CANDIDATE = 20
_SHORTEST = 1e-9
_JUMP_EXPONENT = 0.1
_HALVINGS = 4
_TRIED_HALVINGS = 5
_REPEATS = 3
_LEFT = 0.25
_BORDER_SHARE = 0.1
_POINTS_PER_NODE = 32
_BORDER_NODES = 64
_BORDER_SAMPLES = 512
_LIFTS = 3
_FOLLOWING_SHARE = 0.45
_TILT = 1.5
_LEAST_REACH = 0.004
_CELLS = 100
"""Jumps in the same of this many cells along each axis of the region count once."""


@dataclass(frozen=True)
class ForceJump(Serializable):
    """A jump of the force.

    Attributes:
        at: where it is [m].
        direction: direction of the line on which it was found, a unit vector.
        size: change of force beyond the trend [N].
        length: distance over which this change was seen [m].
        exponent: change of force ∝ length to this power over the last decade; near 0 for a jump.
        approach: where the path to it begins, for a renderer with memory [m].
    """

    at: tuple[float, ...]
    direction: tuple[float, ...]
    size: float
    length: float
    exponent: float
    approach: tuple[float, ...]


class JumpSearch:
    """Search for jumps on lines through the region.

    Args:
        calls: the renderer in its region.
        resolution: its noise and steps.
        seed: of the random numbers.

    Attributes:
        jumps: the jumps found, the largest first.
        steepest: ends of the steepest slopes between neighbours [m], shape (n, 2, 3).
    """

    def __init__(self, calls: RendererCalls, resolution: Resolution, seed: int) -> None:
        from scipy.stats import qmc

        self.calls = calls
        self.resolution = resolution
        self.steepest = np.zeros((0, 2, 3))
        self._random = np.random.default_rng(seed)
        self._halton = qmc.Halton(1, seed=seed)
        self._new: list[_Segments] = []
        self._jumps: dict[tuple[int, ...], ForceJump] = {}
        self._followed: set[tuple[tuple[int, ...], int]] = set()
        self._shortest = max(_SHORTEST, 20.0 * resolution.position_error)

    @property
    def jumps(self) -> tuple[ForceJump, ...]:
        """The jumps found, the largest first."""
        return tuple(sorted(self._jumps.values(), key=lambda jump: -jump.size))

    def run(self, deadline: float, steepest: GainWitness | None) -> None:
        """Search until a time of the monotonic clock [s]; a second time, go on.

        Args:
            deadline: the time.
            steepest: witness of the gain, where the search begins; its gain explains steps.
        """
        gain = 0.0
        if steepest is not None:
            rows = (steepest.approach, steepest.start, steepest.end, (0.0, 0.0, 0.0))
            approach, start, end, trend = [np.array([row]) for row in rows]
            self._bisect(_find_segments(self.calls, approach, start, end, trend), 0.0)
            gain = 0.0 if self._jumps else steepest.value  # that of a jump explains nothing
        left = deadline - time.monotonic()
        followed_from = deadline - _FOLLOWING_SHARE * left
        border = self._find_border(_BORDER_SHARE * self.calls.rate * left)
        while True:
            # Many lines with few samples see many places, few lines with many see small jumps.
            batch = int(min(max(_SHARE_PER_BATCH * self.calls.rate, _LEAST_BATCH), _LARGEST_BATCH))
            samples = min(_SAMPLES * 4 ** max(int(self._random.integers(-2, 4)), 0), batch)
            size = float(np.sqrt(np.square(self.calls.region.size).sum()))
            samples = min(samples, int(size / (32.0 * self._shortest)) + 8)
            lines = self._random_lines(max(batch // samples, 1), samples)
            self._search_lines(lines, self.calls.inside_on_curves(lines), gain)
            samples = min(samples, _BORDER_SAMPLES)
            lines = self._border_lines(border, max(batch // (2 * samples), 1), samples)
            self._search_lines(lines, self.calls.on_curves(lines), gain)
            if time.monotonic() >= followed_from:
                self._follow_surfaces(gain, deadline)
            if time.monotonic() >= deadline:
                return

    def _find_border(self, budget: float) -> FloatArray:
        """Return heights of the lower border of the region on a square grid [m], shape (n, n).

        Args:
            budget: number of points that may be looked at.
        """
        count = int(min(math.sqrt(max(budget, 0.0) / _POINTS_PER_NODE) + 4.0, _BORDER_NODES))
        side = np.linspace(0.0, 1.0, count)
        x, y = np.meshgrid(side, side, indexing="ij")
        nodes = np.stack([x, y, np.zeros_like(x)], axis=2).reshape(-1, 3)
        lowest = self.calls.region.lowest_points(self.calls.region.points(nodes))
        return lowest[:, 2].reshape(x.shape)

    def _border_lines(self, border: FloatArray, count: int, samples: int) -> FloatArray:
        """Return lines along the lower border, as many along x as along y, (2 count, samples, 3).

        Small sets of jumps of a god-object, which reach up from below, are beside this border.
        """
        across = self._halton.random(count)
        along = np.linspace(0.0, 1.0, samples)
        fractions = np.zeros((2 * count, samples, 3))
        fractions[..., 0] = along
        fractions[..., 1] = np.tile(across, (2, 1))
        fractions[count:, :, :2] = fractions[count:, :, 1::-1]
        lines = self.calls.region.points(fractions)
        rows = np.concatenate(
            [_interpolate_rows(border.T, across[:, 0]), _interpolate_rows(border, across[:, 0])]
        )
        lines[..., 2] = _interpolate_rows(rows.T, along).T
        return lines

    def _random_lines(self, count: int, samples: int) -> FloatArray:
        """Return lines through the region, half parallel to an axis, (count, samples, 3)."""
        region = self.calls.region
        ends = region.points(self._random.uniform(size=(count, 2, 3)))
        axis = self._random.integers(6, size=count)
        across = np.stack([ends[:, 0], ends[:, 0]], axis=1)
        is_along = axis[:, None] == np.arange(3)
        across[:, 0] = np.where(is_along, region.low, across[:, 0])
        across[:, 1] = np.where(is_along, region.high, across[:, 1])
        ends = np.where((axis < 3)[:, None, None], across, ends)
        shares = np.linspace(0.0, 1.0, samples)[:, None]
        return np.asarray(ends[:, :1] + shares * (ends[:, 1:] - ends[:, :1]))

    def _search_lines(self, lines: FloatArray, forces: FloatArray, gain: float) -> None:
        """Search lines with the forces at their samples, shape (n, m, 3) both."""
        line, first = self._bent_samples(lines, forces)
        steps = np.diff(forces, axis=1)
        trend = 0.5 * (steps[line, first - 1] + steps[line, first + 2])
        length = np.sqrt(np.square(lines[line, 1] - lines[line, 0]).sum(axis=1))
        trend = np.nan_to_num(trend) / length[:, None]
        ends = (lines[line, 0], lines[line, first], lines[line, first + 2])
        segments = _find_segments(self.calls, *ends, trend)
        for _ in range(_LIFTS):
            segments = self._segments_above(self._bisect(segments, gain))

    def _segments_above(self, segments: _Segments) -> _Segments:
        """Return segments outside of the region as longer ones at its border above."""
        segments = segments.select(self._one_per_cell(segments.middle))
        border = self.calls.region.lowest_points(segments.middle)
        chosen = self._one_per_cell(border)
        segments = segments.select(chosen)
        return self._segments_beside(segments, border[chosen] - segments.middle)

    def _follow_surfaces(self, gain: float, deadline: float) -> None:
        """Search beside new jumps, from cell to cell along their surface, all at once."""
        cell = self.calls.region.size / _CELLS
        while self._new and time.monotonic() < deadline:
            segments = _join_segments(self._new)
            self._new = []
            along = np.argmax(np.abs(segments.direction) / cell, axis=1)
            beside = []
            for shift in (1, 2):
                offsets = cell * (np.arange(3) == ((along + shift) % 3)[:, None])
                for sign in (1.0, -1.0):
                    chosen = self._untried(segments, sign * offsets)
                    part = segments.select(chosen), sign * offsets[chosen]
                    beside.append(self._segments_beside(*part))
            self._bisect(_join_segments(beside), gain)

    def _untried(self, segments: _Segments, offsets: FloatArray) -> NDArray[np.bool_]:
        """Return one segment for each cell and axis beside which none was followed yet."""
        chosen = np.zeros(len(offsets), dtype=bool)
        cells = self._cells(segments.middle + offsets)
        axes = np.argmax(np.abs(segments.direction), axis=1).tolist()
        for index, key in enumerate(zip(cells, axes, strict=True)):
            chosen[index] = key not in self._followed
            self._followed.add(key)
        return chosen

    def _segments_beside(self, segments: _Segments, offsets: FloatArray) -> _Segments:
        """Return longer segments at offsets from some, where no jump is known, in the region."""
        middle = segments.middle + offsets
        spread = np.sqrt(np.square(offsets).sum(axis=1))[:, None]
        reach = (_TILT * spread + _LEAST_REACH * self.calls.region.size) * segments.direction
        chosen = self._is_unknown(middle)
        chosen[chosen] = self.calls.region.contains(middle[chosen])
        ends = self.calls.region.clip(middle - reach), self.calls.region.clip(middle + reach)
        arrays = (segments.approach, *ends, segments.trend)
        return _find_segments(self.calls, *[array[chosen] for array in arrays])

    def _bent_samples(self, lines: FloatArray, forces: FloatArray) -> tuple[IntArray, IntArray]:
        """Return lines and first samples where the force bends most, and no jump is known."""
        bends = np.nan_to_num(np.sqrt(np.square(np.diff(forces, 2, axis=1)).sum(axis=2)))
        count = max(lines.shape[1] // _SAMPLES_PER_CANDIDATE, 1)
        first = np.argsort(-bends[:, 1:-1], axis=1)[:, :count] + 1
        line = np.repeat(np.arange(len(lines)), first.shape[1])
        first = first.ravel()
        chosen = bends[line, first] > self.resolution.force_error
        chosen &= self._is_unknown(lines[line, first + 1])
        return line[chosen], first[chosen]

    def _bisect(self, segments: _Segments, gain: float) -> _Segments:
        """Halve segments, and record the jumps; a gain explains changes [N/m].

        Returns:
            The jumps outside of the region.
        """
        changes = [segments.excess]
        while segments.lengths.max(initial=0.0) > self._shortest:
            if len(changes) % _TRIED_HALVINGS == 0:  # most are smooth
                is_left = self._are_left(segments, changes)
                segments = segments.select(is_left)
                changes = [change[is_left] for change in changes]
            segments.halve(self.calls)
            changes.append(segments.excess)
        if len(changes) <= _HALVINGS or not len(changes[0]):  # short as the resolution, or none
            return segments.select(np.zeros(len(changes[0]), dtype=bool))
        return self._record_jumps(segments, changes, gain)

    def _are_left(self, segments: _Segments, changes: list[FloatArray]) -> NDArray[np.bool_]:
        """Return which segments keep their change, the largest of a cell where no jump is known."""
        is_left = changes[-1] > _LEFT * changes[-_TRIED_HALVINGS]
        self._record_slope(segments, np.where(is_left, 0.0, changes[-1]))
        cells = self._cells(segments.start)
        ends = self._cells(segments.end)
        seen: set[tuple[int, ...]] = set()
        for index in np.argsort(-changes[-1]).tolist():
            cell = cells[index]
            if is_left[index] and cell == ends[index]:
                is_left[index] = cell not in seen and cell not in self._jumps
                if len(changes) > _TRIED_HALVINGS:  # a change that stayed so long is a jump
                    seen.add(cell)
        return np.asarray(is_left)

    def _record_jumps(
        self, segments: _Segments, changes: list[FloatArray], gain: float
    ) -> _Segments:
        lengths = segments.lengths
        explained = 3.0 * self.resolution.explained(gain) + 1e-9 * self.calls.largest_force
        is_jump, _exponents = _jumps_among(changes, explained + gain * lengths)
        self._record_slope(segments, np.where(is_jump, 0.0, changes[-1]))
        segments = segments.select(is_jump)
        changes = [change[is_jump] for change in changes]
        lengths = lengths[is_jump]
        changes[-1] = np.minimum(changes[-1], self._repeated_changes(segments))
        is_jump, exponents = _jumps_among(changes, explained + gain * lengths)
        size = changes[-1]
        middle = segments.middle
        cells = self._cells(middle)
        is_inside = is_jump.copy()
        is_inside[is_jump] = self.calls.region.contains(middle[is_jump])
        self._new.append(segments.select(is_inside & self._is_unknown(middle)))
        for index in np.flatnonzero(is_inside).tolist():
            known = self._jumps.get(cells[index])
            if known is None or size[index] > known.size:
                at, along, approach = [
                    tuple(row[index].tolist())
                    for row in (middle, segments.direction, segments.approach)
                ]
                found, over, exponent = [float(row[index]) for row in (size, lengths, exponents)]
                self._jumps[cells[index]] = ForceJump(at, along, found, over, exponent, approach)
        return segments.select(is_jump & ~is_inside)

    def _record_slope(self, segments: _Segments, changes: FloatArray) -> None:
        """Keep the segment of the steepest change [N], which is 0 for jumps."""
        if changes.any():
            steepest = int(np.argmax(changes / segments.lengths))
            ends = [segments.start[steepest], segments.end[steepest]]
            self.steepest = np.concatenate([self.steepest, [ends]])

    def _repeated_changes(self, segments: _Segments) -> FloatArray:
        """Return the least change in repetitions [N], since rare noise does not come again."""
        if self.calls.approaches:
            paths = approach_paths(segments.approach, segments.start, segments.end)
            forces = self.calls.along(np.concatenate([paths] * _REPEATS))
            sizes = step_changes(forces)[1]
        else:
            ends = np.stack([segments.start, segments.end], axis=1)
            forces = self.calls.on_curves(np.concatenate([ends] * _REPEATS))
            sizes = np.sqrt(np.square(forces[:, 1] - forces[:, 0]).sum(axis=1))
        return np.asarray(sizes.reshape(_REPEATS, -1).min(axis=0))

    def _cells(self, points: FloatArray) -> list[tuple[int, ...]]:
        """Return the cells of points, shape (n, 3)."""
        region = self.calls.region
        cells = np.floor(_CELLS * (points - region.low) / region.size)
        return list(map(tuple, cells.astype(int).tolist()))

    def _one_per_cell(self, points: FloatArray) -> IntArray:
        """Return the index of one point for each cell of points, shape (n, 3)."""
        return np.unique(self._cells(points), axis=0, return_index=True)[1]

    def _is_unknown(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return in the cells of which points, shape (n, 3), no jump is known, shape (n,)."""
        return np.array([cell not in self._jumps for cell in self._cells(points)], dtype=bool)


def _jumps_among(
    changes: list[FloatArray], explained: FloatArray
) -> tuple[NDArray[np.bool_], FloatArray]:
    """Return which changes of halved segments [N] are jumps, and the exponents of their length."""
    size = changes[-1]
    before = np.maximum(changes[-1 - _HALVINGS], 1e-300)
    exponents = np.log2(np.maximum(size, 1e-300) / before) / -_HALVINGS
    return (exponents < _JUMP_EXPONENT) & (size > explained), exponents


def _excess(start: FloatArray, end: FloatArray, trend: FloatArray) -> FloatArray:
    """Return the magnitudes of changes of force beyond a trend [N], shape (n,)."""
    return np.asarray(np.sqrt(np.square(end - start - trend).sum(axis=1)))


@dataclass
class _Segments:
    """Segments that are halved towards the greater change.

    Attributes:
        approach: where the approaches begin [m], shape (n, 3).
        reached: where they end [m], shape (n, 3).
        start: first ends [m], shape (n, 3).
        end: second ends [m], shape (n, 3).
        trend: change of force per length around them [N/m], shape (n, 3).
        start_force: at the first ends [N], shape (n, 3).
        end_force: at the second ends [N], shape (n, 3).
    """

    approach: FloatArray
    reached: FloatArray
    start: FloatArray
    end: FloatArray
    trend: FloatArray
    start_force: FloatArray
    end_force: FloatArray

    @property
    def lengths(self) -> FloatArray:
        """Their lengths [m], shape (n,)."""
        return np.asarray(np.sqrt(np.square(self.end - self.start).sum(axis=1)))

    @property
    def middle(self) -> FloatArray:
        """Their middles [m], shape (n, 3)."""
        return 0.5 * (self.start + self.end)

    @property
    def direction(self) -> FloatArray:
        """Their directions, unit vectors, shape (n, 3)."""
        return (self.end - self.start) / self.lengths[:, None]

    @property
    def excess(self) -> FloatArray:
        """Magnitudes of the changes of force beyond the trend [N], shape (n,)."""
        return _excess(self.start_force, self.end_force, self.trend * self.lengths[:, None])

    def select(self, chosen: NDArray[np.bool_] | IntArray) -> _Segments:
        """Return some of them, by a mask or by their indices."""
        return _Segments(*[array[chosen] for array in vars(self).values()])

    def halve(self, calls: RendererCalls) -> None:
        """Halve all."""
        middle = 0.5 * (self.start + self.end)
        force = calls.after(self.approach, self.reached, middle[:, None])[:, 0]
        trend = 0.5 * self.trend * self.lengths[:, None]
        left = _excess(self.start_force, force, trend)
        goes_right = (_excess(force, self.end_force, trend) > left)[:, None]
        self.start = np.where(goes_right, middle, self.start)
        self.start_force = np.where(goes_right, force, self.start_force)
        self.end = np.where(goes_right, self.end, middle)
        self.end_force = np.where(goes_right, self.end_force, force)


def _join_segments(parts: list[_Segments]) -> _Segments:
    """Return all segments of several."""
    arrays = zip(*[vars(part).values() for part in parts], strict=True)
    return _Segments(*[np.concatenate(part) for part in arrays])


def _interpolate_rows(rows: FloatArray, fractions: FloatArray) -> FloatArray:
    """Return rows between those of an array, at fractions of their number, (n, columns)."""
    places = (len(rows) - 1) * fractions
    first = np.minimum(places.astype(int), len(rows) - 2)
    shares = (places - first)[:, None]
    return np.asarray((1.0 - shares) * rows[first] + shares * rows[first + 1])


def _find_segments(
    calls: RendererCalls,
    approach: FloatArray,
    start: FloatArray,
    end: FloatArray,
    trend: FloatArray,
) -> _Segments:
    """Return segments with the forces at their ends."""
    forces = calls.after(approach, start, np.stack([start, end], axis=1))
    return _Segments(approach, start, start, end, trend, forces[:, 0], forces[:, 1])

"""Jumps of a force: places where it changes by a finite amount over any distance.

Lines through the region are sampled densely. Where the force bends most between neighbours, the
segment is halved again and again, always towards the half with the larger change beyond the trend
of its surroundings. A slope, however steep, loses its change in proportion to the length; a jump
keeps it.
"""

from __future__ import annotations

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
_JUMP_EXPONENT = 0.2
_HALVINGS = 4
_TRIED_HALVINGS = 5
_REPEATS = 2
_LEFT = 0.25
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
        steepest: ends of the steepest slope between neighbours [m], shape (2, 3).
    """

    def __init__(self, calls: RendererCalls, resolution: Resolution, seed: int) -> None:
        self.calls = calls
        self.resolution = resolution
        self.steepest = np.zeros((0, 2, 3))
        self._random = np.random.default_rng(seed)
        self._jumps: dict[tuple[int, ...], ForceJump] = {}
        self._shortest = max(_SHORTEST, 20.0 * resolution.position_error)

    @property
    def jumps(self) -> tuple[ForceJump, ...]:
        """The jumps found, the largest first."""
        return tuple(sorted(self._jumps.values(), key=lambda jump: -jump.size))

    def run(self, deadline: float, steepest: GainWitness | None) -> None:
        """Search until a time of the monotonic clock [s].

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
        while True:
            # Many lines with few samples see many places, few lines with many see small jumps.
            batch = int(min(max(_SHARE_PER_BATCH * self.calls.rate, _LEAST_BATCH), _LARGEST_BATCH))
            samples = min(_SAMPLES * 4 ** max(int(self._random.integers(-2, 4)), 0), batch)
            size = float(np.sqrt(np.square(self.calls.region.size).sum()))
            samples = min(samples, int(size / (32.0 * self._shortest)) + 8)
            self._search_lines(self._random_lines(max(batch // samples, 1)), samples, gain)
            if time.monotonic() >= deadline:
                return

    def _random_lines(self, count: int) -> FloatArray:
        """Return the ends of lines through the region, half of them parallel to an axis."""
        region = self.calls.region
        ends = region.points(self._random.uniform(size=(count, 2, 3)))
        axis = self._random.integers(6, size=count)
        across = np.stack([ends[:, 0], ends[:, 0]], axis=1)
        is_along = axis[:, None] == np.arange(3)
        across[:, 0] = np.where(is_along, region.low, across[:, 0])
        across[:, 1] = np.where(is_along, region.high, across[:, 1])
        return np.where((axis < 3)[:, None, None], across, ends)

    def _search_lines(self, ends: FloatArray, samples: int, gain: float) -> None:
        """Search lines between two points each, shape (n, 2, 3)."""
        shares = np.linspace(0.0, 1.0, samples)[:, None]
        lines = ends[:, :1] + shares * (ends[:, 1:] - ends[:, :1])
        if self.calls.approaches:
            forces = self.calls.along(lines)
        else:
            forces = self.calls.at(lines.reshape(-1, 3)).reshape(lines.shape)
        inside = self.calls.region.contains(lines.reshape(-1, 3)).reshape(lines.shape[:2])
        forces = np.where(inside[:, :, None], forces, np.nan)
        line, first = self._bent_samples(lines, forces)
        if len(first):
            steps = np.diff(forces, axis=1)
            trend = 0.5 * (steps[line, first - 1] + steps[line, first + 2])
            length = np.sqrt(np.square(lines[line, 1] - lines[line, 0]).sum(axis=1))
            trend = np.nan_to_num(trend) / length[:, None]
            segments = (lines[line, 0], lines[line, first], lines[line, first + 2])
            self._bisect(_find_segments(self.calls, *segments, trend), gain)

    def _bent_samples(self, lines: FloatArray, forces: FloatArray) -> tuple[IntArray, IntArray]:
        """Return lines and first samples where the force bends most, and no jump is known."""
        bends = np.nan_to_num(np.sqrt(np.square(np.diff(forces, 2, axis=1)).sum(axis=2)))
        count = max(lines.shape[1] // _SAMPLES_PER_CANDIDATE, 1)
        first = np.argsort(-bends[:, 1:-1], axis=1)[:, :count] + 1
        line = np.repeat(np.arange(len(lines)), first.shape[1])
        first = first.ravel()
        chosen = bends[line, first] > self.resolution.force_error
        chosen &= [self._cell(at) not in self._jumps for at in lines[line, first + 1]]
        return line[chosen], first[chosen]

    def _bisect(self, segments: _Segments, gain: float) -> None:
        """Halve segments, and record the jumps; a gain explains changes [N/m]."""
        changes = [segments.excess]
        while segments.lengths.max() > self._shortest:
            if len(changes) == _TRIED_HALVINGS:  # most are smooth
                is_left = changes[-1] > _LEFT * changes[0]
                if not is_left.any():
                    return
                segments = segments.select(is_left)
                changes = [change[is_left] for change in changes]
            segments.halve(self.calls)
            changes.append(segments.excess)
        if len(changes) > _HALVINGS:  # else they are as short as the resolution
            self._record_jumps(segments, changes, gain)

    def _record_jumps(self, segments: _Segments, changes: list[FloatArray], gain: float) -> None:
        paths = approach_paths(segments.approach, segments.start, segments.end)
        size = changes[-1]
        for _ in range(_REPEATS):  # noise that is rare does not come again
            size = np.minimum(size, step_changes(self.calls.along(paths))[1])
        before = np.maximum(changes[-1 - _HALVINGS], 1e-300)
        exponents = np.log2(np.maximum(size, 1e-300) / before) / -_HALVINGS
        explained = 3.0 * self.resolution.explained(gain) + 1e-9 * self.calls.largest_force
        lengths = segments.lengths
        is_jump = (exponents < _JUMP_EXPONENT) & (size > explained + gain * lengths)
        steepest = int(np.argmax(np.where(is_jump, 0.0, size / lengths)))
        ends = [segments.start[steepest], segments.end[steepest]]
        self.steepest = np.concatenate([self.steepest, [ends]])
        middle = 0.5 * (segments.start + segments.end)
        direction = (segments.end - segments.start) / lengths[:, None]
        for index in np.flatnonzero(is_jump):
            at, along, approach = [
                tuple(row[index].tolist()) for row in (middle, direction, segments.approach)
            ]
            found, over, exponent = [float(row[index]) for row in (size, lengths, exponents)]
            cell = self._cell(middle[index])
            known = self._jumps.get(cell)
            if known is None or found > known.size:
                self._jumps[cell] = ForceJump(at, along, found, over, exponent, approach)

    def _cell(self, at: FloatArray) -> tuple[int, ...]:
        region = self.calls.region
        cell = np.floor(_CELLS * (at - region.low) / region.size)
        return tuple(cell.astype(int).tolist())


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
    def excess(self) -> FloatArray:
        """Magnitudes of the changes of force beyond the trend [N], shape (n,)."""
        return _excess(self.start_force, self.end_force, self.trend * self.lengths[:, None])

    def select(self, chosen: NDArray[np.bool_]) -> _Segments:
        """Return some of them."""
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

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

from asperity.certification.gain_search import GainWitness
from asperity.certification.region import RendererCalls
from asperity.certification.resolution import Resolution
from asperity.core.checks import FloatArray, IntArray
from asperity.core.files import Serializable

_SAMPLES = 4096
_CANDIDATES = 24
_SHORTEST = 1e-9
_JUMP_EXPONENT = 0.2
_HALVINGS = 4
_MAX_JUMPS = 256
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
    """

    at: tuple[float, ...]
    direction: tuple[float, ...]
    size: float
    length: float
    exponent: float


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
        ordered = sorted(self._jumps.values(), key=lambda jump: -jump.size)
        return tuple(ordered[:_MAX_JUMPS])

    def run(self, deadline: float, steepest: GainWitness | None) -> None:
        """Search until a time of the monotonic clock [s].

        Args:
            deadline: the time.
            steepest: witness of the gain, around which the search begins; its gain explains steps.
        """
        gain = 0.0
        if steepest is not None:
            gain = steepest.value
            middle = np.array(steepest.start)
            step = np.array(steepest.end) - middle
            self._search_line(np.stack([middle - 20.5 * step, middle + 20.5 * step]), gain)
        while True:
            self._search_line(self._random_line(), gain)
            if time.monotonic() >= deadline:
                return

    def _random_line(self) -> FloatArray:
        """Return the ends of a line through the region, one of two parallel to an axis."""
        ends = self.calls.region.points(self._random.uniform(size=(2, 3)))
        if self._random.uniform() < 0.5:
            axis = int(self._random.integers(3))
            ends[1] = ends[0]
            ends[:, axis] = self.calls.region.low[axis], self.calls.region.high[axis]
        return ends

    def _search_line(self, ends: FloatArray, gain: float) -> None:
        """Search the line between two points, shape (2, 3)."""
        length = math.dist(ends[0], ends[1])
        samples = min(_SAMPLES, int(length / (32.0 * self._shortest)) + 8)
        samples = min(samples, max(64, int(0.05 * self.calls.rate)))
        line = ends[0] + np.linspace(0.0, 1.0, samples)[:, None] * (ends[1] - ends[0])
        line = line[self.calls.region.contains(line)]
        if len(line) < 8:
            return
        forces = self.calls.at(line)
        bends = np.sqrt(np.square(np.diff(forces, 2, axis=0)).sum(axis=1))
        bends = np.where(np.isfinite(bends), bends, 0.0)[1:-1]
        order = np.argsort(-bends)[:_CANDIDATES]
        first = order[bends[order] > self.resolution.force_error] + 1
        if len(first):
            self._bisect(line, forces, first, gain)

    def _bisect(self, line: FloatArray, forces: FloatArray, first: IntArray, gain: float) -> None:
        """Halve the segments from these samples to the next but one, and record the jumps."""
        start = line[first]
        end = line[first + 2]
        start_force = forces[first]
        end_force = forces[first + 2]
        before = forces[first] - forces[first - 1]
        after = forces[first + 3] - forces[first + 2]
        trend = 0.5 * (before + after) / math.dist(line[0], line[1])
        lengths = [np.sqrt(np.square(end - start).sum(axis=1))]
        changes = [_excess(start_force, end_force, trend, lengths[0])]
        while lengths[-1].max() > self._shortest:
            middle = 0.5 * (start + end)
            force = self.calls.at(middle)
            half = 0.5 * lengths[-1]
            left = _excess(start_force, force, trend, half)
            right = _excess(force, end_force, trend, half)
            goes_right = (right > left)[:, None]
            start = np.where(goes_right, middle, start)
            start_force = np.where(goes_right, force, start_force)
            end = np.where(goes_right, end, middle)
            end_force = np.where(goes_right, end_force, force)
            lengths.append(half)
            changes.append(np.maximum(left, right))
        self._record_jumps(start, end, np.array(lengths), np.array(changes), gain)

    def _record_jumps(
        self,
        start: FloatArray,
        end: FloatArray,
        lengths: FloatArray,
        changes: FloatArray,
        gain: float,
    ) -> None:
        """Record the jumps among segments, from their lengths and changes at each halving."""
        if len(lengths) <= _HALVINGS:
            return  # the segments are as short as the resolution
        before = np.maximum(changes[-1 - _HALVINGS], 1e-300)
        exponents = np.log2(np.maximum(changes[-1], 1e-300) / before) / -_HALVINGS
        explained = 3.0 * self.resolution.explained(gain) + 1e-9 * self.calls.largest_force
        explained = explained + gain * lengths[-1]  # what a slope explains
        is_jump = (exponents < _JUMP_EXPONENT) & (changes[-1] > explained)
        slopes = np.where(is_jump, 0.0, changes[-1] / lengths[-1])
        steepest = int(np.argmax(slopes))
        self.steepest = np.concatenate([self.steepest, [[start[steepest], end[steepest]]]])
        for index in np.flatnonzero(is_jump):
            self._add_jump(
                start[index], end[index], float(changes[-1][index]), float(exponents[index])
            )

    def _add_jump(self, start: FloatArray, end: FloatArray, size: float, exponent: float) -> None:
        region = self.calls.region
        at = 0.5 * (start + end)
        cell = tuple(np.floor(_CELLS * (at - region.low) / region.size).astype(int).tolist())
        length = math.dist(start, end)
        direction = tuple(((end - start) / length).tolist())
        known = self._jumps.get(cell)
        if known is None or size > known.size:
            self._jumps[cell] = ForceJump(tuple(at.tolist()), direction, size, length, exponent)


def _excess(
    start: FloatArray, end: FloatArray, trend: FloatArray, lengths: FloatArray
) -> FloatArray:
    """Return the magnitudes of changes of force beyond a trend [N/m], shape (n,)."""
    changes = end - start - trend * lengths[:, None]
    return np.asarray(np.sqrt(np.square(changes).sum(axis=1)))

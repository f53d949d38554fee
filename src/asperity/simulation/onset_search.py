"""Detection of limit cycles, and the search for their onset over starts and stiffnesses.

A run is extended until its verdict is clear; the search schedules starts and stiffnesses.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import replace
from enum import StrEnum
from functools import cache
from itertools import islice
from typing import NamedTuple

import numpy as np

from asperity.core.checks import FloatArray
from asperity.perception.grip import Grip, load_grip
from asperity.simulation.lanes import MAX_LANES, BatchSimulation, StopRule, Trajectory
from asperity.simulation.trace import SegmentStatistics, StopReason, ends_of_quarters

# A run that still oscillates is extended, again and again, up to the last of these factors.
_EXTENSION = 4.0
DURATION_FACTORS = tuple(_EXTENSION**times for times in range(5))
# A motion whose spread in the last quarter of a run is below this share of that in the quarter
# before is decaying: from the third factor on; in a shorter run it is one that decays as fast.
_DECAY_RATIO = 0.9
_DECAY_FACTOR = 16.0
_STEADY_RATIO = _DECAY_RATIO**0.25  # of a single run
# Of what damping and dry friction take, the texture supplies all in a motion that lasts; less where
# it beats.
_LASTING_SHARE = 0.9
# A motion that is supplied with less is not fed: it swings or falls by itself.
_SUPPLY_SHARE = 0.2
# With fewer oscillations a quarter tells neither decay nor supply.
_MIN_OSCILLATIONS = 4.0
# From the middle of the last quarter of a run to that of a run twice as long, in quarters.
_QUARTERS_PER_RUN = 3.5
# With fewer samples a quarter is a single sample, without spread.
_MIN_SAMPLES = 8


def felt_speed(speed: float, extent: float) -> float:
    """Return the RMS speed [m/s] above which a hand feels an oscillation, at its frequency.

    An oscillation of RMS speed v and RMS displacement x has the frequency f = v/(2π x). A hand that
    holds a tool like a pen feels amplitudes above a(f), which is the RMS speed √2 π f a(f). Beyond
    the frequencies of the thresholds the speed at the nearest of them counts.

    Args:
        speed: RMS speed of the oscillation [m/s].
        extent: RMS displacement [m].

    Example:
        >>> round(felt_speed(0.1, 0.1 / (2 * math.pi * 100)) * 1e3, 3)  # 100 Hz, in mm/s
        0.178
        >>> round(felt_speed(0.1, 0.1 / (2 * math.pi * 24)) * 1e3, 3)  # 24 Hz: that at 40 Hz
        0.444
    """
    grip = _default_grip()
    frequency = grip.frequency[-1]
    if extent > 0.0:
        frequency = speed / (2.0 * math.pi * extent)
        frequency = min(max(frequency, grip.frequency[0]), grip.frequency[-1])
    return math.sqrt(2.0) * math.pi * frequency * float(grip.threshold(frequency)[1])


@cache
def _default_grip() -> Grip:
    return load_grip()


def limit_cycle_rule(
    samples: Callable[[float], int], period: float, threshold: float | None = None
) -> StopRule:
    """Return the stop rule that detects a limit cycle: an oscillation fed by the texture.

    A run oscillates if, in its last quarter, the standard deviations of the velocity, summed over
    the axes, exceed the threshold: by default what a hand feels, :func:`felt_speed`. For a cycle in
    place this sum is rms(vx) + rms(vy) + rms(vz); sinking at constant speed does not count. It is
    fed if from the quarter before to that quarter the texture supplies, on average, at least a
    fifth of the loss in damping and dry friction. The energy that an elastic surface takes and
    returns in every oscillation may be many times the loss: what a quarter holds of it besides
    whole oscillations is counted as an error. A handle that swings or falls by itself is no limit
    cycle; a handle that leaves the workspace while it is fed is one, and so is a diverged run.

    A run that still oscillates is extended, to 4, 16, 64 and 256 times its duration, until it is
    clear whether the motion lasts: it does if it decays by less than a tenth per quarter of 16
    durations and the texture supplies nine tenths of the loss at least. It does not if it is not
    fed, or decays so that it would not be felt at the end of the next extension.

    Args:
        samples: number of samples of a run, by the factor of its duration.
        period: of a sample [s].
        threshold: [m/s]; ``None``: what a hand feels.
    """
    for factor in DURATION_FACTORS:
        rows = samples(factor)
        segments: list[SegmentStatistics] = []
        for goal in ends_of_quarters(rows):
            segments.append((yield goal))
            if segments[-1].stop:
                return (yield from _judge_stopped_run(segments[-1], threshold))
        _, before, last = segments
        if not _oscillates(last, threshold):
            return False
        if factor > 1.0:
            verdict = _verdict(before, last, threshold, rows // 4 * period, factor)
            if verdict is not None:
                return verdict
    return False


def _verdict(
    before: SegmentStatistics,
    last: SegmentStatistics,
    threshold: float | None,
    duration: float,
    factor: float,
) -> bool | None:
    """Return whether a felt motion lasts, by its last quarters [s]; ``None``: it is not clear."""
    is_longest = factor == DURATION_FACTORS[-1]
    count = _oscillation_count(last, duration)
    if count < _MIN_OSCILLATIONS and not is_longest:
        return None
    energies = _supplied_energy(before, last, count)
    ratio = _DECAY_RATIO ** min(factor / _DECAY_FACTOR, 1.0)
    decays = last.velocity_spread < ratio * before.velocity_spread
    if not decays and energies.least > _LASTING_SHARE * energies.taken:
        return True
    if is_longest:
        return not decays and energies.most > _LASTING_SHARE * energies.taken
    if factor < _DECAY_FACTOR:  # what is left of the start may hide a cycle
        return None
    left = 1.0
    if decays:
        quarters = _QUARTERS_PER_RUN * (_EXTENSION - 1.0)
        left = (last.velocity_spread / before.velocity_spread) ** quarters
    is_fed = energies.most > _SUPPLY_SHARE * energies.taken
    if is_fed and _oscillates(_scaled(last, left), threshold):
        return None
    return False


class MotionState(StrEnum):
    """What a handle does at the end of a run."""

    AT_REST = "at rest"
    """Its motion is not felt."""
    CYCLE = "cycle"
    """It oscillates, and the texture supplies what damping takes."""
    NOT_FED = "not fed"
    """It moves, and the texture supplies less than a fifth of what damping takes."""
    UNDECIDED = "undecided"
    """It moves, and the run is too short to tell whether that lasts."""


def motion_state(
    before: SegmentStatistics, last: SegmentStatistics, duration: float
) -> MotionState:
    """Return what a handle does at the end of a run, by its last quarters of a duration [s]."""
    if not _oscillates(last, None):
        return MotionState.AT_REST
    count = _oscillation_count(last, duration)
    if count < _MIN_OSCILLATIONS:
        return MotionState.UNDECIDED
    energies = _supplied_energy(before, last, count)
    if energies.most <= _SUPPLY_SHARE * energies.taken:
        return MotionState.NOT_FED
    decays = last.velocity_spread < _STEADY_RATIO * before.velocity_spread
    if decays or energies.least <= _LASTING_SHARE * energies.taken:
        return MotionState.UNDECIDED
    return MotionState.CYCLE


class _SuppliedEnergy(NamedTuple):
    """Bounds of the energy that the texture supplied, and the loss, between two quarters [J]."""

    least: float
    most: float
    taken: float


def _supplied_energy(
    before: SegmentStatistics, last: SegmentStatistics, count: float
) -> _SuppliedEnergy:
    """Return the energies from one quarter to the next, on average of each.

    An oscillation of amplitude a adds to the average of n periods at most a/(πn), if a part of one
    remains.
    """
    supplied = last.mean_energies[0] - before.mean_energies[0]
    taken = last.mean_energies[1] - before.mean_energies[1]
    error = math.sqrt(2.0) * (before.net_spread + last.net_spread) / (math.pi * count)
    return _SuppliedEnergy(supplied - error, supplied + error, taken)


def _oscillation_count(segment: SegmentStatistics, duration: float) -> float:
    """Return how many oscillations of RMS speed and displacement a duration [s] holds."""
    if not segment.position_spread > 0.0:
        return math.inf
    return duration * segment.velocity_spread / (2.0 * math.pi * segment.position_spread)


def _scaled(segment: SegmentStatistics, factor: float) -> SegmentStatistics:
    """Return the statistics of the same motion with another amplitude."""
    speed = factor * segment.velocity_spread
    return replace(segment, velocity_spread=speed, position_spread=factor * segment.position_spread)


def _judge_stopped_run(
    segment: SegmentStatistics, threshold: float | None
) -> Generator[int, SegmentStatistics, bool]:
    """Return the verdict on a run that stopped; its last quarter is run again."""
    if segment.stop is StopReason.DIVERGED:
        return True
    rows = segment.samples + 1  # with the sample that the body could not follow
    if rows < _MIN_SAMPLES:
        return False
    second, third, last_row = ends_of_quarters(rows)
    yield second
    before = yield third
    last = yield last_row
    energies = _supplied_energy(before, last, math.inf)
    return _oscillates(last, threshold) and energies.most > _SUPPLY_SHARE * energies.taken


def _oscillates(segment: SegmentStatistics, threshold: float | None) -> bool:
    speed = segment.velocity_spread
    if threshold is None:
        threshold = felt_speed(speed, segment.position_spread)
    return speed > threshold


_COARSE_FACTOR = 2.0  # factor between the stiffnesses of the coarse search


class OnsetBracket(NamedTuple):
    """The result of a search.

    Attributes:
        quiet: largest stiffness at which no start cycled [N/m]; 0 if there is none.
        cycling: least stiffness at which a start did [N/m]; infinite if there is none.
        cycles: number of starts that cycle there, or at the highest stiffness.
        low: least position there [m], shape (3,).
        high: greatest position there [m], shape (3,).
    """

    quiet: float
    cycling: float
    cycles: int
    low: tuple[float, ...]
    high: tuple[float, ...]


def run_searches(batch: BatchSimulation, searches: Mapping[int, OnsetSearch]) -> Iterator[int]:
    """Run the most urgent trajectories of all searches; yield the number of each finished one."""
    active = dict(searches)
    while active:
        queue: list[tuple[int, int, Trajectory]] = []
        for search in active.values():
            for place, (priority, run) in enumerate(search.next_trajectories()):
                queue.append((priority, place, run))
        queue.sort(key=lambda entry: entry[:2])
        batch.run([run for _priority, _place, run in queue[:MAX_LANES]])
        for number, search in list(active.items()):
            if search.is_finished():
                del active[number]
                yield number


class OnsetSearch:
    """The verdicts on the starts at each stiffness, none run twice, and the next ones to run.

    Args:
        start: returns the trajectory of a start, by number, at a stiffness [N/m].
        count: number of starts.
        bracketing: yields stiffnesses, receives whether any start cycles, returns the bracket.
        progress: called after every stiffness.
    """

    def __init__(
        self,
        start: Callable[[float, int], Trajectory],
        count: int,
        bracketing: Generator[float, bool, tuple[float, float]],
        progress: Callable[[], None] | None,
    ) -> None:
        self._start = start
        self._count = count
        self._bracketing = bracketing
        self._progress = progress
        self._results: dict[tuple[float, int], tuple[bool, FloatArray]] = {}
        self._running: dict[tuple[float, int], Trajectory] = {}
        # The selection does not change until a run ends.
        self._selected: list[tuple[int, Trajectory]] | None = None
        self._first = 0  # the start that cycled last is the most likely to cycle again
        self._bracket: tuple[float, float] | None = None
        self._stiffness = next(bracketing)

    def next_trajectories(self) -> list[tuple[int, Trajectory]]:
        """Return the trajectories to continue, each with its priority, 0 or 1."""
        if self._selected is None:
            self._selected = self._select_trajectories()
        return self._selected

    def _keys(self) -> list[tuple[float, int]]:
        return [(self._stiffness, (self._first + i) % self._count) for i in range(self._count)]

    def _select_trajectories(self) -> list[tuple[int, Trajectory]]:
        keys = self._keys()
        new = list(islice((key for key in keys if key not in self._results), MAX_LANES))
        # The first one runs alone: if it cycles, the others are not needed.
        alone = self._bracket is None and new[0] == keys[0]
        startable = new[:1] if alone else new
        for key in startable:
            if key not in self._running:
                self._running[key] = self._start(*key)
        running = [key for key in new if key in self._running]
        return [(int(alone and key != new[0]), self._running[key]) for key in running]

    def is_finished(self) -> bool:
        """Process the verdicts, and return whether the search is finished."""
        ended = [key for key, run in self._running.items() if run.verdict is not None]
        if not ended:
            return False
        for key in ended:
            run = self._running.pop(key)
            self._results[key] = bool(run.verdict), run.position_bounds
        self._selected = None
        while self._bracket is None:
            results = self._results_at_stiffness()
            cycling = [key for key, (cycles, _bounds) in results.items() if cycles]
            if not cycling and len(results) < self._count:
                return False
            if cycling:
                self._first = cycling[0][1]
                # Unfinished runs may be needed at this stiffness later, and at no other.
                here = self._stiffness
                self._running = {key: run for key, run in self._running.items() if key[0] == here}
            self._report_progress()
            try:
                self._stiffness = self._bracketing.send(bool(cycling))
            except StopIteration as end:
                self._bracket = end.value
                quiet, cycling_stiffness = end.value
                self._stiffness = cycling_stiffness
                if math.isinf(cycling_stiffness):
                    self._stiffness = quiet
        if len(self._results_at_stiffness()) < self._count:
            return False
        self._report_progress()
        return True

    def result(self) -> OnsetBracket:
        """Return the bracket, with the positions reached."""
        assert self._bracket is not None
        ends = self._results_at_stiffness().values()
        low = np.fmin.reduce([bounds[0] for _, bounds in ends]).tolist()
        high = np.fmax.reduce([bounds[1] for _, bounds in ends]).tolist()
        count = [cycles for cycles, _ in ends].count(True)
        return OnsetBracket(*self._bracket, count, tuple(low), tuple(high))

    def _results_at_stiffness(self) -> dict[tuple[float, int], tuple[bool, FloatArray]]:
        """Return the results of the starts at the current stiffness."""
        return {key: self._results[key] for key in self._keys() if key in self._results}

    def _report_progress(self) -> None:
        if self._progress is not None:
            self._progress()


def bracket_onset(
    lowest: float, highest: float, width: float, expected: float | None = None
) -> Generator[float, bool, tuple[float, float]]:
    """Return the largest quiet and the least cycling stiffness [N/m].

    Yields stiffnesses, and receives whether any start cycles there: upwards from the lowest by
    factors of 2 until one does, then by bisection; with ``expected``, from the step nearest to it,
    downwards first if that one cycles.
    """
    steps = _coarse_stiffnesses(lowest, highest)
    index = 0
    if expected is not None and expected > 0.0:
        index = int(np.argmin(np.abs(np.log(steps) - math.log(expected))))
    if (yield steps[index]):
        while index > 0 and (yield steps[index - 1]):
            index -= 1
    else:
        index += 1
        while index < len(steps) and not (yield steps[index]):
            index += 1
        if index == len(steps):
            return steps[-1], math.inf
    quiet = 0.0
    cycling = steps[index]
    if index:
        quiet = steps[index - 1]
    while quiet > 0.0 and cycling > quiet * (1.0 + width):
        middle = math.sqrt(quiet * cycling)
        if (yield middle):
            cycling = middle
        else:
            quiet = middle
    return quiet, cycling


def _coarse_stiffnesses(lowest: float, highest: float) -> list[float]:
    """Return stiffnesses a factor of 2 apart, with a shorter last step [N/m]."""
    steps = [lowest]
    while steps[-1] < highest:
        steps.append(min(steps[-1] * _COARSE_FACTOR, highest))
    return steps

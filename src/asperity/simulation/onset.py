"""At which stiffness a closed loop begins to buzz: limit cycles by bisection over many starts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.analysis.gain.answers import content_but_stiffness
from asperity.checks import FloatArray, array, positive
from asperity.errors import ParameterError
from asperity.files import Record, json_text, record
from asperity.kept import is_shipped, kept
from asperity.laws.w_smooth_wall import LAW as SMOOTH_WALL
from asperity.simulation.hands import Hand, MovedHand
from asperity.simulation.kernels.body_functions import LANES
from asperity.simulation.motions import Motion
from asperity.simulation.plants import Plant
from asperity.simulation.run import Run, Stop
from asperity.simulation.servo import Servo
from asperity.simulation.together import Together
from asperity.surface import Surface

Place = tuple[float, float, float]

# The paper does not say when an oscillation counts; here above this :func:`restlessness` [m/s].
CYCLE_SPEED = 15e-3
LOWEST, HIGHEST = 1.0, 1e6  # stiffness [N/m]
_LEAST_TOLERANCE = 1e-9
# A run that is restless at its end is made so many times longer, again and again up to the last.
PATIENCE = (1.0, 4.0, 16.0)
_LEAST_SAMPLES = 16
_MOST_STARTS = 10_000
_COARSE = 2.0  # factor from one stiffness to the next while the onset is looked for


@dataclass(frozen=True)
class Onset(Record):
    """The stiffness at which limit cycles begin.

    Attributes:
        law: letter of the law.
        delay: whole samples.
        quiet: the greatest stiffness tried, below ``cycling``, at which no start ended in a limit
            cycle [N/m]; 0 if even the lowest one cycled.
        cycling: the least stiffness tried at which one did [N/m]; infinite if none up to the
            highest did. The onset of these starts lies between the two, unless it is not monotone:
            of stiffnesses that are a factor of 2 apart, see :func:`find_onset`, the first pair was
            taken of which the upper one cycles.
        low: least position reached in the runs at ``cycling`` (at the highest stiffness if nothing
            cycled), per axis [m].
        high: greatest position reached there [m].
        wall: whether the law is the smooth wall.
        starts: how many starts were tried at each stiffness.
        cycles: how many of them ended in a limit cycle at ``cycling``.
    """

    written = "law delay quiet cycling starts cycles low high"

    law: str
    delay: int
    quiet: float
    cycling: float
    starts: int
    cycles: int
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    wall: bool = False

    @property
    def value(self) -> float:
        """Geometric mean of the bracket [N/m].

        Its upper end if even the lowest stiffness cycled, infinite if nothing did.
        """
        return math.sqrt(self.quiet * self.cycling) if self.quiet else self.cycling


@dataclass(frozen=True)
class Shifted:
    """A motion that is carried along: the same way from another place.

    Attributes:
        motion: the motion.
        offset: where to [m], shape (3,).
    """

    motion: Motion
    offset: tuple[float, float, float]

    def at(self, times: FloatArray) -> FloatArray:
        """Return the positions [m], shape (n, 3), at the times [s], shape (n,)."""
        return np.asarray(self.motion.at(times) + np.array(self.offset))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {"kind": "shifted"} | record(self)


def restlessness(run: Run, quarter: int = 3) -> float:
    """Return how much the velocity varies: its standard deviations, summed over the axes [m/s].

    Args:
        run: with at least four samples in its trace.
        quarter: of the run, 0 to 3. For a cycle in place this is rms(vx) + rms(vy) + rms(vz);
            sinking at constant speed does not count.
    """
    part = np.array_split(run.velocity, 4)[quarter]
    return float(part.std(axis=0).sum())


def cycles(run: Run, threshold: float = CYCLE_SPEED) -> bool:
    """Return whether a run ends restless, and fed by the texture, or diverged.

    Fed: in the last quarter the texture supplies at least a fifth of what damping and dry
    friction take, on average all of it. A handle that swings or falls on its own is no limit cycle.

    Args:
        run: whose hand holds still during the second half.
        threshold: of :func:`restlessness` [m/s].
    """
    if run.stop is Stop.DIVERGED:
        return True
    return restlessness(run) > threshold and run.fed


def calms_down(run: Run) -> bool:
    """Return whether what is left of the motion is still getting less, by a tenth or more."""
    return not run.stop and restlessness(run) < 0.9 * restlessness(run, quarter=2)


def ends_in_cycle(
    run_for: Callable[[float], Run], duration: float, threshold: float = CYCLE_SPEED
) -> tuple[bool, Run]:
    """Return whether a loop ends in a limit cycle, and the longest run of it.

    One that ends restless goes on, to 4 and 16 times as long, until it is steady. It is a cycle
    if the texture then feeds it, see :func:`cycles`. A handle that leaves the workspace while it
    is fed counts as one.

    Args:
        run_for: runs the loop for a duration [s], each time a longer one.
        duration: of the first run [s].
        threshold: of :func:`restlessness` [m/s].
    """
    (found,) = end_in_cycles(lambda span, _which: [run_for(span)], 1, duration, threshold)
    return found


def end_in_cycles(
    runs_for: Callable[[float, list[int]], Sequence[Run]],
    count: int,
    duration: float,
    threshold: float = CYCLE_SPEED,
) -> list[tuple[bool, Run]]:
    """Return the same of several loops that run together.

    Args:
        runs_for: runs some of them, by number, for a duration [s].
        count: how many there are.
        duration: see :func:`ends_in_cycle`.
        threshold: likewise.
    """
    found: dict[int, Run] = {}
    restless = list(range(count))
    for patience in PATIENCE:
        if not restless:
            break
        found.update(zip(restless, runs_for(patience * duration, restless), strict=True))
        restless = [
            index
            for index in restless
            if not (found[index].stop or restlessness(found[index]) <= threshold)
            and (patience == 1.0 or calms_down(found[index]))
        ]
    return [(cycles(found[index], threshold), found[index]) for index in range(count)]


def holds_still(motion: Motion, duration: float) -> bool:
    """Return whether a hand is at rest in the second half of a run [s]."""
    times = np.linspace(0.5, 1.0, 33) * duration
    return bool(np.ptp(motion.at(times), axis=0).max() == 0.0)


def together(
    surface: Surface,
    plant: Plant,
    hand: Hand,
    servo: Servo,
    motion: Motion,
    start: FloatArray,
    velocity: ArrayLike | None,
    shifts: FloatArray,
) -> Together:
    """Return what runs a loop from several starts, all of it shifted by offsets [m], (n, 3)."""
    ways = [Shifted(motion, _place(shift)) for shift in shifts]
    return Together(surface, plant, hand, servo, ways, list(start + shifts), velocity)


def ends_of_starts(
    surface: Surface,
    plant: Plant,
    hand: Hand,
    servo: Servo,
    motion: Motion,
    start: FloatArray,
    velocity: ArrayLike | None,
    shifts: FloatArray,
    duration: float,
    threshold: float = CYCLE_SPEED,
) -> Iterator[tuple[bool, Run]]:
    """Give of each start whether it ends in a limit cycle, and its run; see :func:`ends_in_cycle`.

    As many run at a time as go side by side, so memory does not grow with the number of starts.
    """
    for first in range(0, len(shifts), LANES):
        some = shifts[first : first + LANES]
        runs_for = together(surface, plant, hand, servo, motion, start, velocity, some)
        yield from end_in_cycles(runs_for, len(some), duration, threshold)


def offsets(surface: Surface, count: int) -> FloatArray:
    """Return so many starting phases along the scan line [m], shape (count, 3).

    They share out one period evenly; of a texture that does not repeat, its scan line.
    """
    line = surface.texture.scan_line()
    along = np.append(line.direction, 0.0)
    return np.asarray(np.arange(count)[:, None] / count * line.length * along)


def find_onset(
    surface: Surface,
    plant: Plant,
    hand: Hand,
    servo: Servo,
    motion: Motion,
    *,
    start: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    duration: float = 0.5,
    starts: int = 24,
    tolerance: float = 0.02,
    threshold: float = CYCLE_SPEED,
    lowest: float = LOWEST,
    highest: float = HIGHEST,
    near: float | None = None,
    progress: Callable[[], None] | None = None,
) -> Onset:
    """Return the stiffness at which limit cycles begin, by bisection over many starting phases.

    Args:
        surface: its stiffness does not count.
        plant: what moves.
        hand: what holds it.
        servo: period, delay, resolutions.
        motion: of the hand's anchor; it must be at rest in the second half of the run.
        start: of the handle [m], shape (3,); default: where the motion begins.
        velocity: of the handle at the start [m/s], shape (3,); default: none.
        duration: of a run [s]; one that is restless at its end is run again, up to 16 times as
            long.
        starts: phases of the texture at which the handle starts.
        tolerance: the bracket's width over its lower end.
        threshold: :func:`restlessness` that counts as a limit cycle [m/s].
        lowest: stiffness from which the search goes up [N/m]; one that does not hold the hand's
            force lets the handle sink to where the law's numbers no longer hold.
        highest: stiffness to which the search goes [N/m].
        near: stiffness at which cycles are expected to begin [N/m]. Of the same stiffnesses, a
            factor of 2 apart from the lowest on, the search then begins with the one nearest to
            it, and goes up from one that is quiet, down from one that cycles. Where loops cycle
            above one stiffness only, the answer is the same, and a quarter of the runs is enough;
            a window of cycles farther down, below a stiffness that is quiet, is then passed over.
        progress: called after every stiffness; not where the answer was kept from another run.

    Raises:
        ParameterError: for a handle that is moved, a motion that does not come to rest, or a wrong
            number.
    """
    _refuse(hand, motion, servo, duration, starts)
    width = positive("tolerance", tolerance)
    if width < _LEAST_TOLERANCE:
        raise ParameterError("tolerance", f"must be at least {_LEAST_TOLERANCE:g}", tolerance)
    if not positive("lowest", lowest, "N/m") < positive("highest", highest, "N/m"):
        raise ParameterError("lowest", f"must be below the highest, {highest:g} N/m", lowest)
    limit = positive("threshold", threshold, "m/s")
    shifts = offsets(surface, int(starts))
    begin = motion.at(np.zeros(1))[0] if start is None else array("start", start, (3,), "m")

    def search() -> Onset:
        def run(stiffness: float, some: FloatArray) -> Iterator[tuple[bool, Run]]:
            return ends_of_starts(
                surface.to_stiffness(stiffness), plant, hand, servo, motion, begin, velocity,
                some, duration, limit,
            )  # fmt: skip

        tried = _Tried(run, shifts, progress)
        quiet, cycling = _bracket(tried.cycles, lowest, highest, width, near)
        every, (low, high) = tried.all(quiet if math.isinf(cycling) else cycling)
        return Onset(surface.law.letter, servo.delay, quiet, cycling, len(shifts), every, low, high,
                     wall=surface.law is SMOOTH_WALL)  # fmt: skip

    numbers = tuple(begin), velocity, duration, starts, width, limit, lowest, highest, near
    return kept("onset", _content(surface, (plant, hand, servo, motion), numbers), search)


def _content(surface: Surface, parts: Sequence[Any], numbers: Sequence[Any]) -> str | None:
    """Return a digest of all that an onset depends on; ``None`` where code of one's own counts."""
    if not all(is_shipped(type(part)) for part in parts):
        return None
    given = [None if number is None else np.asarray(number).tolist() for number in numbers]
    return content_but_stiffness(surface, json_text([*parts, given]))


class _Tried:
    """What the starts came to at each stiffness, none run twice.

    Args:
        run: returns of some starts, shifts (m, 3) [m], whether each cycles at a stiffness [N/m],
            and its run.
        shifts: of all starts [m], shape (n, 3).
        progress: called after every stiffness.
    """

    def __init__(
        self,
        run: Callable[[float, FloatArray], Iterator[tuple[bool, Run]]],
        shifts: FloatArray,
        progress: Callable[[], None] | None,
    ) -> None:
        self.run, self.shifts, self.progress = run, shifts, progress
        self.known: dict[tuple[float, int], tuple[bool, FloatArray]] = {}
        self.first = 0  # the start that cycled last: the likeliest to do so again

    def cycles(self, stiffness: float) -> bool:
        """Return whether any start cycles at a stiffness."""
        count = len(self.shifts)
        order = [(self.first + step) % count for step in range(count)]
        some = order[:1]  # alone: if it cycles, nothing else is to be known
        cycling: list[int] = []
        while some and not cycling:
            self._run(stiffness, some)
            cycling = [index for index in some if self.known[stiffness, index][0]]
            order = order[len(some) :]
            some = order[:LANES]
        if cycling:
            self.first = cycling[0]
        self._told()
        return bool(cycling)

    def all(self, stiffness: float) -> tuple[int, tuple[Place, Place]]:
        """Return how many starts cycle at a stiffness, and the box [m] that they reached."""
        every = range(len(self.shifts))
        self._run(stiffness, every)
        found = [self.known[stiffness, index] for index in every]
        low = np.fmin.reduce([box[0] for _, box in found])
        high = np.fmax.reduce([box[1] for _, box in found])
        self._told()
        return sum(ended for ended, _ in found), (_place(low), _place(high))

    def _run(self, stiffness: float, starts: Sequence[int]) -> None:
        """Run the starts that have not been run."""
        new = [index for index in starts if (stiffness, index) not in self.known]
        for index, (ended, run) in zip(new, self.run(stiffness, self.shifts[new]), strict=True):
            box = np.array([run.position.min(axis=0), run.position.max(axis=0)])
            self.known[stiffness, index] = ended, box

    def _told(self) -> None:
        if self.progress is not None:
            self.progress()


def _place(row: FloatArray) -> Place:
    x, y, z = (float(value) for value in row)
    return x, y, z


def _bracket(
    cycling_at: Callable[[float], bool],
    lowest: float,
    highest: float,
    width: float,
    near: float | None = None,
) -> tuple[float, float]:
    """Return the greatest stiffness found quiet and the least found cycling [N/m].

    Upwards from the lowest in steps of a factor of 2 until something cycles, then bisection; with
    ``near``, from the step nearest to it, downwards first if that one cycles.
    """
    steps = _steps(lowest, highest)
    index = 0
    if near is not None and near > 0.0:
        index = int(np.argmin(np.abs(np.log(steps) - math.log(near))))
    if cycling_at(steps[index]):
        while index > 0 and cycling_at(steps[index - 1]):
            index -= 1
    else:
        index += 1
        while index < len(steps) and not cycling_at(steps[index]):
            index += 1
        if index == len(steps):
            return steps[-1], math.inf
    quiet, cycling = (steps[index - 1] if index else 0.0), steps[index]
    while quiet > 0.0 and cycling > quiet * (1.0 + width):
        middle = math.sqrt(quiet * cycling)
        if cycling_at(middle):
            cycling = middle
        else:
            quiet = middle
    return quiet, cycling


def _steps(lowest: float, highest: float) -> list[float]:
    """Return stiffnesses a factor of 2 apart, the last step shorter [N/m]."""
    steps = [lowest]
    while steps[-1] < highest:
        steps.append(min(steps[-1] * _COARSE, highest))
    return steps


def _refuse(hand: Hand, motion: Motion, servo: Servo, duration: float, starts: int) -> None:
    if isinstance(hand, MovedHand):
        raise ParameterError("hand", "must let the handle go: one that is moved never cycles")
    if positive("duration", duration, "s") < _LEAST_SAMPLES * servo.period:
        least = f"must be at least {_LEAST_SAMPLES} samples, {_LEAST_SAMPLES * servo.period:g} s"
        raise ParameterError("duration", least, duration)
    if not holds_still(motion, duration):
        raise ParameterError("motion", "must be at rest in the second half of the run")
    if isinstance(starts, bool) or not (1 <= starts <= _MOST_STARTS and starts == int(starts)):
        limit = f"must be a whole number, 1 to {_MOST_STARTS}"
        raise ParameterError("starts", limit, starts)

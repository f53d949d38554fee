"""At which stiffness a closed loop begins to buzz: limit cycles by bisection over many starts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.analysis.gain.answers import content_but_stiffness
from asperity.checks import FloatArray, array, positive
from asperity.errors import ParameterError
from asperity.files import Record, json_text
from asperity.kept import is_shipped, kept_each
from asperity.laws.w_smooth_wall import LAW as SMOOTH_WALL
from asperity.simulation.hands import Hand, MovedHand
from asperity.simulation.judging import CYCLE_SPEED, ends_in_cycle
from asperity.simulation.kernels.body_functions import LANES
from asperity.simulation.motions import Motion
from asperity.simulation.plants import Plant
from asperity.simulation.searching import Found, Search, bracket, run_searches
from asperity.simulation.servo import Servo
from asperity.simulation.simulate import whole_samples
from asperity.simulation.together import Start, Together
from asperity.surface import Surface

Place = tuple[float, float, float]

LOWEST, HIGHEST = 1.0, 1e6  # stiffness [N/m]
_LEAST_TOLERANCE = 1e-9
_LEAST_SAMPLES = 16
_MOST_STARTS = 10_000


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


def holds_still(motion: Motion, duration: float) -> bool:
    """Return whether a hand is at rest in the second half of a run [s]."""
    times = np.linspace(0.5, 1.0, 33) * duration
    return bool(np.ptp(motion.at(times), axis=0).max() == 0.0)


def ends_of_starts(
    loop: Together,
    stiffness: float,
    servo: Servo,
    shifts: FloatArray,
    duration: float,
    threshold: float = CYCLE_SPEED,
) -> list[Start]:
    """Return a start of a loop for each shift [m], (n, 3), with its verdict."""
    samples = _samples(duration, servo)
    starts = [
        loop.start(stiffness, servo.delay, shift, ends_in_cycle(samples, threshold))
        for shift in shifts
    ]
    while some := [start for start in starts if start.verdict is None][:LANES]:
        loop.run(some)
    return starts


def _samples(duration: float, servo: Servo) -> Callable[[float], int]:
    return lambda times: whole_samples(times * duration, servo.period)


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
        duration: of a run [s]; one that is restless at its end goes on, up to 16 times as
            long.
        starts: phases of the texture at which the handle starts.
        tolerance: the bracket's width over its lower end.
        threshold: of the standard deviations of the velocity, summed over the axes, that count as a
            limit cycle [m/s].
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
    (found,) = find_onsets(
        surface, plant, hand, servo, motion, [servo.delay], [near], start=start, velocity=velocity,
        duration=duration, starts=starts, tolerance=tolerance, threshold=threshold, lowest=lowest,
        highest=highest, progress=progress,
    )  # fmt: skip
    return found


def find_onsets(
    surface: Surface,
    plant: Plant,
    hand: Hand,
    servo: Servo,
    motion: Motion,
    delays: Sequence[int],
    nears: Sequence[float | None],
    *,
    start: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    duration: float = 0.5,
    starts: int = 24,
    tolerance: float = 0.02,
    threshold: float = CYCLE_SPEED,
    lowest: float = LOWEST,
    highest: float = HIGHEST,
    progress: Callable[[], None] | None = None,
    told: Callable[[], None] | None = None,
) -> list[Onset]:
    """Return the same for several delays [samples], each with the stiffness that is near [N/m].

    They are looked for together, so that as many runs go side by side as can be. The arguments are
    those of :func:`find_onset`; ``told`` is called after every onset.
    """
    _refuse(hand, motion, servo, duration, starts)
    width = positive("tolerance", tolerance)
    if width < _LEAST_TOLERANCE:
        raise ParameterError("tolerance", f"must be at least {_LEAST_TOLERANCE:g}", tolerance)
    if not positive("lowest", lowest, "N/m") < positive("highest", highest, "N/m"):
        raise ParameterError("lowest", f"must be below the highest, {highest:g} N/m", lowest)
    limit = positive("threshold", threshold, "m/s")
    begin = motion.at(np.zeros(1))[0] if start is None else array("start", start, (3,), "m")
    samples = _samples(duration, servo)

    def look(which: Sequence[int]) -> Iterator[tuple[int, Onset]]:
        loop = Together(surface, plant, hand, servo, motion, begin, velocity)
        shifts = offsets(surface, int(starts))

        def search(delay: int, near: float | None) -> Search:
            return Search(
                lambda k, i: loop.start(k, delay, shifts[i], ends_in_cycle(samples, limit)),
                len(shifts), bracket(lowest, highest, width, near), loop.at_once, progress,
            )  # fmt: skip

        def onset_of(delay: int, found: Found) -> Onset:
            return Onset(
                surface.law.letter, delay, found.quiet, found.cycling, len(shifts), found.cycles,
                _place(found.low), _place(found.high), wall=surface.law is SMOOTH_WALL,
            )  # fmt: skip

        searches = {number: search(delays[number], nears[number]) for number in which}
        for number in run_searches(loop, searches):
            yield number, onset_of(delays[number], searches[number].found())
            tell()

    tell = told or (lambda: None)
    contents = []
    for delay, near in zip(delays, nears, strict=True):
        numbers = tuple(begin), velocity, duration, starts, width, limit, lowest, highest, near
        parts = plant, hand, replace(servo, delay=delay), motion
        contents.append(_content(surface, parts, numbers))
    return kept_each("onset", contents, look)


def _content(surface: Surface, parts: Sequence[Any], numbers: Sequence[Any]) -> str | None:
    """Return a digest of all that an onset depends on; ``None`` where code of one's own counts."""
    if not all(is_shipped(type(part)) for part in parts):
        return None
    given = [None if number is None else np.asarray(number).tolist() for number in numbers]
    return content_but_stiffness(surface, json_text([*parts, given]))


def _place(row: FloatArray) -> Place:
    x, y, z = (float(value) for value in row)
    return x, y, z


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

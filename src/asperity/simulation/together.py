"""Runs of one loop from many starts, side by side, each as far as somebody asks to see it.

Their stiffnesses and delays may differ. What a run does is bit for bit what
:func:`~asperity.simulation.simulate` says, but no row of it is kept: what tells a limit cycle are a
few sums, see ``kernels/side_by_side.py``.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike

from asperity.checks import FloatArray, array
from asperity.contacts.memory import new_memory
from asperity.errors import ParameterError
from asperity.kernels.probe import ClampName
from asperity.laws import Law
from asperity.simulation.hands import Hand
from asperity.simulation.kernels import bar_lanes, one_by_one, servo_loop, side_by_side
from asperity.simulation.kernels.body_functions import LANES, SAMPLES, STOP
from asperity.simulation.kernels.booking import FRICTION, LOST, SUMS, SUPPLIED
from asperity.simulation.kernels.side_by_side import (
    CARRIED,
    HIGH,
    LAST,
    LOW,
    ROWS,
    SEEN,
    SQUARE,
    SUM,
)
from asperity.simulation.loop import STOPS, checked_delay
from asperity.simulation.motions import Motion
from asperity.simulation.plants import Plant
from asperity.simulation.run import Stop
from asperity.simulation.sampled_plant import sampled_plant
from asperity.simulation.servo import Servo
from asperity.simulation.simulate import CHUNK, anchor_points, begin, check_parts
from asperity.surface import Surface


@lru_cache(maxsize=256)
def _fused(
    law: Law, sampler: tuple[ModuleType, ...], clamp: ClampName, body: tuple[ModuleType, ...]
) -> ModuleType:
    from asperity.kernels import tick
    from asperity.kernels.fuse import fuse_on_texture

    further = (tick, servo_loop, *body, one_by_one)
    return fuse_on_texture(law, sampler, clamp, (side_by_side,), further)


@dataclass(frozen=True)
class Seen:
    """What is seen of a run.

    Attributes:
        samples: that are done.
        stop: what stopped it.
        restlessness: standard deviations of the velocity before each sample since the run was last
            seen, summed over the axes [m/s].
        energies: what the texture has supplied, and what damping and dry friction have taken [J].
        last: the same before the last sample.
    """

    samples: int
    stop: Stop
    restlessness: float
    energies: tuple[float, float]
    last: tuple[float, float]


Judge = Generator[int, Seen, bool]
"""Yields after how many samples of a run it wants to see it, and returns what it makes of it.

Where that is no later than what it has seen, the run begins anew.
"""


class Start:
    """A run from one start, as far as it has come, and who judges it.

    Args:
        state: of the body at first.
        offset: of the hand's motion [m], shape (3,).
        stiffness: [N/m].
        delay: [samples].
        looks: evaluations of the surface that a tick may take.
        judge: of the run.

    Attributes:
        goal: samples after which it is to be seen.
        verdict: of the judge; ``None`` until it is known.
    """

    def __init__(
        self,
        state: FloatArray,
        offset: FloatArray,
        stiffness: float,
        delay: int,
        looks: float,
        judge: Judge,
    ) -> None:
        self.first, self.offset, self.stiffness = state, offset, float(stiffness)
        self.delay, self.looks, self._judge = checked_delay(delay), looks, judge
        self.verdict: bool | None = None
        self.goal = next(judge)
        self.begin()

    def begin(self) -> None:
        """Be before the first sample."""
        self.state = self.first.copy()
        self.queue = np.zeros((self.delay + 1, 3))
        self.carried, self.ledger = np.zeros(CARRIED), np.zeros(SUMS)
        self.memory, self.seen = new_memory(self.looks), np.zeros(SEEN)
        self.seen[LOW : LOW + 3], self.seen[HIGH : HIGH + 3] = np.inf, -np.inf
        self.told = np.array([0, 0, self.delay])

    @property
    def samples(self) -> int:
        """Samples that are done."""
        return int(self.told[SAMPLES])

    @property
    def box(self) -> FloatArray:
        """The least and the greatest position before any sample [m], shape (2, 3)."""
        return np.array([self.seen[LOW : LOW + 3], self.seen[HIGH : HIGH + 3]])

    def show(self) -> None:
        """Let the judge see the run, if it is as far as that."""
        stop = STOPS[self.told[STOP]]
        if not stop and self.samples < self.goal:
            return
        count = self.seen[ROWS]
        mean = self.seen[SUM : SUM + 3] / count
        spread = self.seen[SQUARE : SQUARE + 3] / count - mean**2
        supplied = self.ledger[SUPPLIED] + self.ledger[SUPPLIED + 1] + self.ledger[SUPPLIED + 2]
        taken = self.ledger[LOST] - self.ledger[FRICTION]
        last = float(self.seen[LAST]), float(self.seen[LAST + 1])
        rest = float(np.sqrt(np.maximum(spread, 0.0)).sum())
        seen = Seen(self.samples, stop, rest, (float(supplied), float(taken)), last)
        self.seen[ROWS] = 0.0
        try:
            self.goal = self._judge.send(seen)
        except StopIteration as end:
            self.verdict = end.value
        else:
            if self.goal <= self.samples:
                self.begin()


class Together:
    """A loop whose starts run side by side.

    Args:
        surface: as for :func:`~asperity.simulation.simulate`, like all that follow; its stiffness
            does not count.
        plant: likewise.
        hand: likewise.
        servo: likewise; its delay does not count.
        motion: of the hand's anchor.
        start: of the handle [m], shape (3,); ``None`` where the motion begins.
        velocity: of the handle at the start [m/s], shape (3,); default: none.

    Raises:
        ParameterError: for parts that do not fit together.
    """

    def __init__(
        self,
        surface: Surface,
        plant: Plant,
        hand: Hand,
        servo: Servo,
        motion: Motion,
        start: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
    ) -> None:
        check_parts(surface, plant, hand, servo, motion)
        self._surface, self._plant, self._servo, self._motion = surface, plant, servo, motion
        origin = motion.at(np.zeros(1))[0] if start is None else array("start", start, (3,), "m")
        self._origin, self._velocity, self._hand = origin, velocity, hand
        self._body = sampled_plant(plant, hand, servo)
        self._way, self._known = np.empty((0, 3)), 0

    @property
    def at_once(self) -> bool:
        """Whether several bodies take hardly longer than one."""
        return bar_lanes in self._body.modules

    @cached_property
    def _compiled(self) -> ModuleType:
        surface = self._surface
        return _fused(
            surface.law, surface.texture.sampler, surface.acting_clamp, self._body.modules
        )

    def start(self, stiffness: float, delay: int, offset: FloatArray, judge: Judge) -> Start:
        """Return a run before its first sample.

        Args:
            stiffness: of the surface [N/m].
            delay: of the servo [samples].
            offset: by which the start and the hand's motion are shifted [m], shape (3,).
            judge: of the run.

        Raises:
            ParameterError: for a start that is outside the workspace.
        """
        place, speed = begin(
            self._plant, self._hand, self._servo, self._motion, self._origin + offset,
            self._velocity,
        )  # fmt: skip
        state = self._body.state(place, speed)
        looks = self._surface.law.contact.looks
        return Start(state, offset, stiffness, delay, looks, judge)

    def run(self, starts: Sequence[Start]) -> None:
        """Run at most ``LANES`` starts until one of them has come as far as it is to be seen.

        Raises:
            ParameterError: for more of them, or a motion that is not finite.
        """
        if len(starts) > LANES:
            raise ParameterError("starts", f"must be at most {LANES}", len(starts))
        span = min(CHUNK, *(start.goal - start.samples for start in starts))
        way = self._way_to(span + max(start.samples for start in starts))
        queues = np.zeros((len(starts), 1 + max(start.delay for start in starts), 3))
        for queue, start in zip(queues, starts, strict=True):
            queue[: start.delay + 1] = start.queue
        names = ("state", "carried", "ledger", "memory", "seen", "told")
        state, carried, ledger, memory, seen, told = rows = [
            np.array([getattr(start, name) for start in starts]) for name in names
        ]
        surface = self._surface
        self._compiled.servo_lanes(
            state, queues, carried, ledger, way, np.array([start.offset for start in starts]), span,
            self._body.record, self._servo.settings, memory, surface.texture.arguments,
            surface.law_arguments, np.array([start.stiffness for start in starts]), seen, told,
        )  # fmt: skip
        for run, start in enumerate(starts):
            start.queue[:] = queues[run, : start.delay + 1]
            for name, table in zip(names, rows, strict=True):
                getattr(start, name)[:] = table[run]
            start.show()

    def _way_to(self, last: int) -> FloatArray:
        """Return positions of the hand's anchor at the samples up to one at least [m]."""
        if last >= len(self._way):
            self._way = np.concatenate([self._way[: self._known], np.empty((2 * last, 3))])
        if last >= self._known:
            first, period = self._known, self._servo.period
            more = anchor_points(self._motion, period, self._plant, first, last)
            self._way[first : last + 1] = more
            self._known = last + 1
        return self._way

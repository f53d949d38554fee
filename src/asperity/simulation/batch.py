"""Batch simulation of trajectories that differ in start, stiffness and delay.

Each trajectory equals, bit for bit, that of :func:`~asperity.simulation.simulate`; no rows are
stored, only the sums that detect a limit cycle, see ``kernels/batch_loop.py``.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike

from asperity.contacts.warm_start import new_warm_start
from asperity.core.checks import FloatArray, check_array
from asperity.core.errors import ParameterError
from asperity.kernels import tick
from asperity.kernels.fuse import fuse_on_texture
from asperity.simulation import simulate
from asperity.simulation.hands import Hand, Motion
from asperity.simulation.kernels import batch_loop, simulated_device
from asperity.simulation.kernels.body_interface import LANES, SAMPLES, STOP
from asperity.simulation.kernels.body_parts import FRICTION, LEDGER_SIZE, LOST, SUPPLIED
from asperity.simulation.plants import Plant, sampled_plant
from asperity.simulation.servo import Servo
from asperity.simulation.trace import StopReason
from asperity.surface import Surface

# Attributes of a trajectory that the compiled loop changes; rows of its tables.
_TABLES = ("state", "servo_state", "ledger", "memory", "statistics", "progress")


@dataclass(frozen=True)
class SegmentStatistics:
    """Statistics of a run.

    Attributes:
        samples: samples done.
        stop: why the run stopped.
        velocity_spread: standard deviations of the velocity before each sample since the previous
            evaluation, summed over the axes [m/s].
        energies: energy supplied by the texture, and dissipated by damping and dry friction [J].
        previous_energies: the same before the last sample.
        position_spread: standard deviations of the position, as those of the velocity [m].
    """

    samples: int
    stop: StopReason
    velocity_spread: float
    energies: tuple[float, float]
    previous_energies: tuple[float, float]
    position_spread: float = 0.0


StopRule = Generator[int, SegmentStatistics, bool]
"""Yields the number of samples at its next evaluation, and returns its verdict.

A number that is not larger than the samples done restarts the run.
"""


class Trajectory:
    """A run from one start, with its stop rule.

    Args:
        state: initial state of the body.
        offset: shift of the hand's motion [m], shape (3,).
        stiffness: [N/m].
        delay: [samples].
        max_evaluations: evaluation budget of a tick.
        stop_rule: stop rule of the run.

    Attributes:
        next_evaluation: number of samples at the next evaluation of the stop rule.
        verdict: verdict of the stop rule; ``None`` until it is known.
    """

    def __init__(
        self, state: FloatArray, offset: FloatArray, stiffness: float, delay: int,
        max_evaluations: float, stop_rule: StopRule,
    ) -> None:  # fmt: skip
        self.initial_state = state
        self.offset = offset
        self.stiffness = float(stiffness)
        self.delay = simulate.check_delay(delay)
        self._stop_rule = stop_rule
        self.max_evaluations = max_evaluations
        self.verdict: bool | None = None
        self.next_evaluation = next(stop_rule)
        self.reset()

    def reset(self) -> None:
        """Reset to the initial state."""
        self.state = self.initial_state.copy()
        self.queue = np.zeros((self.delay + 1, 3))
        self.ledger = np.zeros(LEDGER_SIZE)
        self.servo_state = np.zeros(batch_loop.SERVO_STATE_SIZE)
        self.memory = new_warm_start(self.max_evaluations)
        self.statistics = np.zeros(batch_loop.STATISTICS_SIZE)
        self._statistic(batch_loop.LOW)[:] = np.inf
        self._statistic(batch_loop.HIGH)[:] = -np.inf
        self.progress = np.array([0, 0, self.delay])

    def _statistic(self, first: int) -> FloatArray:
        return self.statistics[first : first + 3]

    def _spread(self, sums: int, squares: int) -> float:
        """Return the standard deviations since the last evaluation, summed over the axes."""
        count = self.statistics[batch_loop.SAMPLE_COUNT]
        variance = self._statistic(squares) / count - (self._statistic(sums) / count) ** 2
        return float(np.sqrt(np.maximum(variance, 0.0)).sum())

    @property
    def samples(self) -> int:
        """Samples done."""
        return int(self.progress[SAMPLES])

    @property
    def position_bounds(self) -> FloatArray:
        """Least and greatest position before any sample [m], shape (2, 3)."""
        return np.array([self._statistic(batch_loop.LOW), self._statistic(batch_loop.HIGH)])

    def evaluate_stop_rule(self) -> None:
        """Evaluate the stop rule when its next evaluation is due."""
        stop = simulate.STOP_REASONS[self.progress[STOP]]
        if not stop and self.samples < self.next_evaluation:
            return
        supplied = self.ledger[SUPPLIED] + self.ledger[SUPPLIED + 1] + self.ledger[SUPPLIED + 2]
        taken = self.ledger[LOST] - self.ledger[FRICTION]
        before = self.statistics[batch_loop.PREVIOUS_ENERGIES :].tolist()
        spread = self._spread(batch_loop.VELOCITY_SUM, batch_loop.VELOCITY_SQUARES)
        extent = self._spread(batch_loop.POSITION_SUM, batch_loop.POSITION_SQUARES)
        energies = (float(supplied), float(taken)), (before[0], before[1])
        segment = SegmentStatistics(self.samples, stop, spread, *energies, extent)
        self.statistics[batch_loop.SAMPLE_COUNT] = 0.0
        try:
            self.next_evaluation = self._stop_rule.send(segment)
        except StopIteration as end:
            self.verdict = end.value
        else:
            if self.next_evaluation <= self.samples:
                self.reset()


class BatchSimulation:
    """A loop that runs several trajectories at once.

    Args:
        surface: see :func:`~asperity.simulation.simulate`, also for the following; its stiffness
            is not used.
        plant: the device.
        hand: the hand.
        servo: the electronics; its delay is not used.
        motion: motion of the hand's anchor.
        start: position of the handle [m], shape (3,); default: where the motion starts.
        velocity: of the handle at the start [m/s], shape (3,); default: at rest.

    Raises:
        ParameterError: for parts that do not fit together.
    """

    def __init__(
        self, surface: Surface, plant: Plant, hand: Hand, servo: Servo, motion: Motion,
        start: ArrayLike | None = None, velocity: ArrayLike | None = None,
    ) -> None:  # fmt: skip
        simulate.check_parts(surface, plant, hand, servo, motion)
        self._surface = surface
        self._plant = plant
        self._servo = servo
        self._motion = motion
        origin = motion.at(np.zeros(1))[0]
        self._origin = origin if start is None else check_array("start", start, (3,), "m")
        self._velocity = velocity
        self._hand = hand
        self._body = sampled_plant(plant, hand, servo)
        self._anchor = np.empty((0, 3))
        self._anchor_count = 0

    @cached_property
    def _compiled(self) -> ModuleType:
        surface = self._surface
        modules = *self._body.modules, batch_loop, tick, simulated_device
        return fuse_on_texture(
            surface.law, surface.texture.sampler, surface.effective_clamp, modules
        )

    def new_trajectory(
        self, stiffness: float, delay: int, offset: FloatArray, stop_rule: StopRule
    ) -> Trajectory:
        """Return a run before its first sample.

        Args:
            stiffness: of the surface [N/m].
            delay: of the servo [samples].
            offset: shift of the start and of the hand's motion [m], shape (3,).
            stop_rule: stop rule of the run.

        Raises:
            ParameterError: for a start outside the workspace.
        """
        position, velocity = simulate.initial_motion(
            self._plant, self._hand, self._servo, self._motion, self._origin + offset,
            self._velocity,
        )  # fmt: skip
        state = self._body.initial_state(position, velocity)
        budget = self._surface.law.contact.max_evaluations
        return Trajectory(state, offset, stiffness, delay, budget, stop_rule)

    def run(self, trajectories: Sequence[Trajectory]) -> None:
        """Run at most ``LANES`` trajectories until the stop rule of one of them is due.

        Raises:
            ParameterError: for more trajectories, or a motion that is not finite.
        """
        if len(trajectories) > LANES:
            raise ParameterError("starts", f"must be at most {LANES}", len(trajectories))
        span = min(
            simulate.CHUNK_SAMPLES, *(run.next_evaluation - run.samples for run in trajectories)
        )
        anchor = self._anchor_up_to(span + max(run.samples for run in trajectories))
        queues = np.zeros((len(trajectories), 1 + max(run.delay for run in trajectories), 3))
        for queue, run in zip(queues, trajectories, strict=True):
            queue[: run.delay + 1] = run.queue
        state, servo_state, ledger, memory, statistics, progress = tables = [
            np.array([getattr(run, name) for run in trajectories]) for name in _TABLES
        ]
        offsets = np.array([run.offset for run in trajectories])
        stiffness = np.array([run.stiffness for run in trajectories])
        self._compiled.simulate_lanes(
            state, queues, servo_state, ledger, anchor, offsets, span, self._body.record,
            self._servo.settings, memory, self._surface.texture.arguments,
            self._surface.law_arguments, stiffness, statistics, progress,
        )  # fmt: skip
        for row, run in enumerate(trajectories):
            run.queue[:] = queues[row, : run.delay + 1]
            for name, table in zip(_TABLES, tables, strict=True):
                getattr(run, name)[:] = table[row]
            run.evaluate_stop_rule()

    def _anchor_up_to(self, last: int) -> FloatArray:
        """Return positions of the hand's anchor at the samples up to one at least [m]."""
        count = self._anchor_count
        if last >= len(self._anchor):
            self._anchor = np.concatenate([self._anchor[:count], np.empty((2 * last, 3))])
        if last >= count:
            points = simulate.anchor_points(
                self._motion, self._servo.period, self._plant, count, last
            )
            self._anchor[count : last + 1] = points
            self._anchor_count = last + 1
        return self._anchor

"""Lanes of the closed loop: one run, or several that differ in start, stiffness and delay.

All lanes are run by one compiled loop, see :mod:`asperity.loop.lane_loop`, so that a trajectory of
a batch equals, bit for bit, that of :func:`~asperity.simulation.simulate`.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from functools import cached_property
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike

from asperity.contacts.warm_start import new_warm_start
from asperity.core.checks import FloatArray, check_array
from asperity.core.errors import ParameterError
from asperity.kernels import tick
from asperity.kernels.fuse import fuse_on_texture
from asperity.loop import lane_loop, no_guards, servo_loop, simulated_device
from asperity.loop.lane_loop import Lanes
from asperity.loop.simulated_device import DELAY, LEDGER_SIZE, SAMPLES
from asperity.simulation.hands import Hand, Motion
from asperity.simulation.plants import Plant, SampledPlant, sampled_plant
from asperity.simulation.servo import Servo
from asperity.simulation.trace import COLUMNS, SegmentStatistics, StopReason
from asperity.surface import Surface

MAX_LANES = 8
"""Largest number of lanes that run at once."""
CHUNK_SAMPLES = 16_384
"""Samples per chunk: memory does not depend on the duration; progress is reported in between."""
# Largest delay [samples]: a second at a megahertz.
MAX_DELAY = 1_000_000
# Why the compiled loop stops, by its error code.
_STOP_REASONS = tuple(StopReason)
NO_ROWS = np.empty((0, len(COLUMNS)))
# Adds nothing to the positions of an anchor, not even to the sign of a zero.
_NO_SHIFT = np.full(3, -0.0)
# Attributes of a lane that the compiled loop changes, by the fields of its record.
_TABLES = {
    "x": "state",
    "counters": "counters",
    "servo_states": "servo_state",
    "ledgers": "ledger_sums",
    "memories": "memory",
    "statistics": "statistics",
}


class Lane:
    """A run from one start: the state of body, delay, servo and contact, and what is recorded.

    Args:
        state: initial state of the body.
        delay: [samples].
        stiffness: [N/m].
        max_evaluations: evaluation budget of a tick.
        offset: shift of the hand's motion [m], shape (3,).
        has_statistics: whether the statistics that detect a limit cycle are recorded.

    Attributes:
        state: state of the body.
        queue: delayed forces [N], shape (delay + 1, 3).
        memory: warm start of the contact, see :mod:`asperity.contacts.warm_start`.
        ledger_sums: sums of energies since the start, see :mod:`asperity.loop.simulated_device`.
        statistics: see :mod:`asperity.loop.lane_loop`; empty if none are recorded.

    Raises:
        ParameterError: for a delay of more than ``MAX_DELAY`` samples.
    """

    def __init__(
        self,
        state: FloatArray,
        delay: int,
        stiffness: float,
        max_evaluations: float,
        offset: FloatArray = _NO_SHIFT,
        *,
        has_statistics: bool = False,
    ) -> None:
        if delay > MAX_DELAY:
            raise ParameterError("delay", f"must be at most {MAX_DELAY} samples", delay)
        self.initial_state = state
        self.delay = delay
        self.stiffness = float(stiffness)
        self.max_evaluations = max_evaluations
        self.offset = offset
        self._has_statistics = has_statistics
        self.reset()

    def reset(self) -> None:
        """Reset to the initial state."""
        self.state = self.initial_state.copy()
        self.queue = np.zeros((self.delay + 1, 3))
        self.counters = np.zeros(lane_loop.LANE_COUNTERS_SIZE, np.int64)
        self.counters[DELAY] = self.delay
        self.servo_state = np.zeros(lane_loop.SERVO_STATE_SIZE)
        self.ledger_sums = np.zeros(LEDGER_SIZE)
        self.memory = new_warm_start(self.max_evaluations)
        self.statistics = np.zeros(lane_loop.STATISTICS_SIZE if self._has_statistics else 0)
        self.statistics[lane_loop.LOW : lane_loop.HIGH] = np.inf
        self.statistics[lane_loop.HIGH : lane_loop.SAMPLE_COUNT] = -np.inf

    @property
    def samples(self) -> int:
        """Samples done."""
        return int(self.counters[SAMPLES])

    @property
    def stop(self) -> StopReason:
        """Why the run has stopped."""
        return _STOP_REASONS[int(self.counters[lane_loop.STOP])]


class LaneLoop:
    """The compiled loop of a surface on a body with a servo.

    Args:
        surface: the surface; lanes have their own stiffness.
        plant: the device and the hand that holds it.
        servo: the servo; lanes have their own delay.
    """

    def __init__(self, surface: Surface, plant: SampledPlant, servo: Servo) -> None:
        self._surface = surface
        self._plant = plant
        self._servo = servo

    @cached_property
    def _kernels(self) -> ModuleType:
        surface = self._surface
        parts = lane_loop, servo_loop, no_guards, simulated_device
        return fuse_on_texture(
            surface.law,
            surface.texture.sampler,
            surface.effective_clamp,
            (*parts, *self._plant.modules, tick),
            has_friction=surface.contact_friction is not None,
        )

    def stored_energy(self, state: FloatArray, anchor: FloatArray) -> float:
        """Return the energy stored in a state [J] with the hand's anchor at a position [m]."""
        return float(self._kernels.stored_energy_at(state, anchor, self._plant.record))

    def run(
        self, lanes: Sequence[Lane], samples: int, anchor: FloatArray, rows: FloatArray = NO_ROWS
    ) -> int:
        """Run lanes over a number of samples.

        Args:
            lanes: the lanes; changed.
            samples: number of samples.
            anchor: positions of the hand's anchor [m], shape (k, 3), contiguous: from the counter
                ``FIRST_SAMPLE`` of the lanes to the last sample of any; it moves at constant
                velocity in between.
            rows: rows of a single lane to write, shape (at least samples, columns).

        Returns:
            Number of rows written.
        """
        surface = self._surface
        tables = {
            field: np.array([getattr(lane, name) for lane in lanes])
            for field, name in _TABLES.items()
        }
        queues = np.zeros((len(lanes), 1 + max(lane.delay for lane in lanes), 3))
        for queue, lane in zip(queues, lanes, strict=True):
            queue[: lane.delay + 1] = lane.queue
        row_counters = np.array([0])
        self._kernels.run_lanes(
            Lanes(
                queues=queues,
                offsets=np.array([lane.offset for lane in lanes]),
                stiffness=np.array([lane.stiffness for lane in lanes]),
                **tables,
            ),
            samples,
            anchor,
            self._plant.record,
            self._servo.settings,
            rows,
            row_counters,
            surface.texture.arguments,
            surface.loop_arguments,
        )
        for number, lane in enumerate(lanes):
            lane.queue[:] = queues[number, : lane.delay + 1]
            for field, name in _TABLES.items():
                getattr(lane, name)[:] = tables[field][number]
        return int(row_counters[0])


StopRule = Generator[int, SegmentStatistics, bool]
"""Yields the number of samples at its next evaluation, and returns its verdict.

A number that is not larger than the samples done restarts the run.
"""


class Trajectory(Lane):
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
        self,
        state: FloatArray,
        offset: FloatArray,
        stiffness: float,
        delay: int,
        max_evaluations: float,
        stop_rule: StopRule,
    ) -> None:
        super().__init__(state, delay, stiffness, max_evaluations, offset, has_statistics=True)
        self._stop_rule = stop_rule
        self.verdict: bool | None = None
        self.next_evaluation = next(stop_rule)

    def _statistic(self, first: int) -> FloatArray:
        return self.statistics[first : first + 3]

    def _spread(self, sums: int, squares: int) -> float:
        """Return the standard deviations since the last evaluation, summed over the axes."""
        count = self.statistics[lane_loop.SAMPLE_COUNT]
        variance = self._statistic(squares) / count - (self._statistic(sums) / count) ** 2
        return float(np.sqrt(np.maximum(variance, 0.0)).sum())

    def _energies(self) -> tuple[tuple[float, float], float]:
        """Return the mean energies since the last evaluation, and their net spread [J]."""
        count = float(self.statistics[lane_loop.SAMPLE_COUNT])
        supplied, taken, squares = (self.statistics[lane_loop.ENERGY_SUMS :] / count).tolist()
        bases = self.statistics[lane_loop.BASE_ENERGIES :]
        variance = squares - (supplied - taken) ** 2
        means = float(bases[0]) + supplied, float(bases[1]) + taken
        return means, math.sqrt(max(variance, 0.0))

    @property
    def position_bounds(self) -> FloatArray:
        """Least and greatest position before any sample [m], shape (2, 3)."""
        return np.array([self._statistic(lane_loop.LOW), self._statistic(lane_loop.HIGH)])

    def evaluate_stop_rule(self) -> None:
        """Evaluate the stop rule when its next evaluation is due."""
        if not self.stop and self.samples < self.next_evaluation:
            return
        segment = SegmentStatistics(
            self.samples,
            self.stop,
            self._spread(lane_loop.VELOCITY_SUM, lane_loop.VELOCITY_SQUARES),
            *self._energies(),
            self._spread(lane_loop.POSITION_SUM, lane_loop.POSITION_SQUARES),
        )
        self.statistics[lane_loop.SAMPLE_COUNT] = 0.0
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
        self._parts = plant, hand, servo, motion
        if start is None:
            start = motion.at(np.zeros(1))[0]
        self._origin = check_array("start", start, (3,), "m")
        self._velocity = velocity
        self._max_evaluations = surface.law.contact.max_evaluations
        self._body = sampled_plant(plant, hand, servo)
        self._loop = LaneLoop(surface, self._body, servo)
        self._anchor = np.empty((0, 3))

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
        start = self._origin + offset
        position, velocity = initial_motion(*self._parts, start, self._velocity)
        state = self._body.initial_state(position, velocity)
        return Trajectory(state, offset, stiffness, delay, self._max_evaluations, stop_rule)

    def run(self, trajectories: Sequence[Trajectory]) -> None:
        """Run at most ``MAX_LANES`` trajectories until the stop rule of one of them is due.

        Raises:
            ParameterError: for more trajectories, or a motion that is not finite.
        """
        if len(trajectories) > MAX_LANES:
            raise ParameterError("starts", f"must be at most {MAX_LANES}", len(trajectories))
        span = min(CHUNK_SAMPLES, *(run.next_evaluation - run.samples for run in trajectories))
        anchor = self._anchor_up_to(span + max(run.samples for run in trajectories))
        self._loop.run(trajectories, span, anchor)
        for run in trajectories:
            run.evaluate_stop_rule()

    def _anchor_up_to(self, last: int) -> FloatArray:
        """Return positions of the hand's anchor at the samples up to one at least [m]."""
        plant, _hand, servo, motion = self._parts
        count = len(self._anchor)
        if last >= count:
            more = anchor_points(motion, servo.period, plant, count, last)
            self._anchor = np.concatenate([self._anchor, more])
        return self._anchor


def check_parts(surface: Surface, plant: Plant, hand: Hand, servo: Servo, motion: Motion) -> None:
    """Check the types of the parts of a closed loop.

    Raises:
        ParameterError: for the first part of another type.
    """
    for name, value, kind, words in (
        ("surface", surface, Surface, "a Surface"),
        ("plant", plant, Plant, "a plant such as Cartesian or Pantograph"),
        ("hand", hand, Hand, "a hand such as SpringHand, BandHand or PrescribedHand"),
        ("servo", servo, Servo, "a Servo"),
        ("motion", motion, Motion, "a motion such as Stationary, Strokes or Waypoints"),
    ):
        if not isinstance(value, kind):
            raise ParameterError(name, f"must be {words}", value)


def initial_motion(
    plant: Plant,
    hand: Hand,
    servo: Servo,
    motion: Motion,
    start: ArrayLike | None,
    velocity: ArrayLike | None,
) -> tuple[FloatArray, FloatArray]:
    """Return the initial position [m] and velocity [m/s] of a handle.

    Args:
        plant: the device.
        hand: the hand that holds it.
        servo: the electronics.
        motion: motion of the hand's anchor.
        start: position of the handle [m], shape (3,); ``None``: where the motion starts.
        velocity: velocity of the handle [m/s], shape (3,); ``None``: at rest.

    Raises:
        ParameterError: for an initial state that the hand or the plant does not allow.
    """
    position = None
    speed = None
    if start is not None:
        position = check_array("start", start, (3,), "m")
    if velocity is not None:
        speed = check_array("velocity", velocity, (3,), "m/s")
    position, speed = hand.initial_motion(motion, position, speed, servo.period)
    plant.check_points("start", position)
    plant.check_points("velocity", speed)
    reason = plant.workspace_violation(position)
    if reason and not hand.is_prescribed:
        raise ParameterError("start", f"must be in the workspace: {reason}", position.tolist())
    return position, speed


def anchor_points(motion: Motion, period: float, plant: Plant, first: int, last: int) -> FloatArray:
    """Return the positions of the anchor [m] at the samples from ``first`` to ``last``, included.

    Raises:
        ParameterError: for a motion that is not finite, or that the plant does not allow.
    """
    times = np.arange(first, last + 1, dtype=np.float64) * float(period)
    points = check_array("motion", motion.at(times), (last + 1 - first, 3), "m")
    plant.check_points("motion", points)
    return points

"""The measurements of a calibration: rest, pushes along each axis, then walls along each."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import AsperityError
from asperity.core.files import Serializable
from asperity.devices.device import Axis as AxisName
from asperity.servo.calibration.excitation import (
    EXCITATION_COLUMN,
    PUSHING,
    REST,
    WALL,
    CalibrationRig,
    Excitation,
)
from asperity.servo.calibration.identification import (
    FLOOR_STEPS,
    MAX_STIFFNESS,
    AxisDynamics,
    DelayEstimate,
    Estimate,
    PushRecord,
    WallOnset,
    find_wall_onset,
    fit_dynamics,
    fresh_fraction,
    is_limit_cycle,
    oscillation_amplitudes,
    position_step,
    rest_noise,
)

HOLDING_STIFFNESS = 30.0
"""Stiffness of the spring that holds the handle without a wall [N/m]."""
MAX_TRAVEL = 0.02
"""Largest displacement of a pushed handle [m]; beyond it the force ends."""
_GAP_PERIODS = 100.0  # rows further apart than these periods belong to two loops
_REST_TIME = 0.5  # [s]
_TRIAL_TIME = 0.4
_PUSH_TIME = 2.4
_PUSH_DURATIONS = (0.006, 0.04)  # [s] initial and largest duration of a push
_SUFFICIENT_TRAVEL = 2e-3  # [m] range that determines mass and damping
_IMMOBILE_TRAVEL = 0.2e-3  # [m] range below which a handle under the largest push is immobile
# shares of the maximum force, of the first and of the strongest pushes
_FIRST_PUSH_FRACTION = 0.2
_MAX_PUSH_FRACTION = 0.6
MAX_WALL_STEP = 1e-3
"""Largest step of a wall that starts an oscillation [m]."""
WALL_FORCE_FRACTION = 0.35
"""Share of the maximum force for the step of a wall."""
_TRIP_STEPS = 1.7  # steps: an oscillation of this size does not decay
_BRAKE_DAMPING = 1.0  # [N s/m] damping that brings the handle to rest, on a velocity
_VELOCITY_TIME_CONSTANT = 2e-3  # smoothed over this time [s]
# number and duration [s] of the rests before a measurement
_MAX_SETTLES = 12
_SETTLE_TIME = 0.25
_REST_TRAVEL = 20e-6  # [m] range of a handle at rest
_WALL_DELAY = 0.05  # [s] before the step of a wall, after the ramp
_OSCILLATIONS = (15.0, 150.0)  # oscillations to observe a wall for
_OBSERVATION_TIMES = (0.15, 2.5)  # [s]


class CalibrationError(AsperityError):
    """A device showed no measurable response."""


@dataclass(frozen=True)
class AxisCalibration(Serializable):
    """The measurement along an axis of a device.

    Attributes:
        name: name of the axis.
        dynamics: mass, damping and friction.
        wall: walls that held.
    """

    name: AxisName
    dynamics: AxisDynamics
    wall: WallOnset


@dataclass(frozen=True)
class Calibration(Serializable):
    """The measurement of a device.

    Attributes:
        update_rate: rate of fresh readings [Hz].
        position_step: step of the positions [m]; ``None`` if they are exact.
        noise: noise of readings at rest [m], the largest of the axes.
        delay: delay between a reading and its force.
        max_force: maximum force of the measurement [N].
        axes: axes along which the handle moves.
        immobile_axes: names of the axes along which it does not.
    """

    update_rate: Estimate
    position_step: Estimate | None
    noise: Estimate
    delay: DelayEstimate
    max_force: float
    axes: tuple[AxisCalibration, ...]
    immobile_axes: tuple[AxisName, ...] = ()

    @property
    def weakest_axis(self) -> AxisCalibration:
        """The axis whose wall held least."""
        return min(self.axes, key=lambda axis: axis.wall.stable_stiffness)


class Calibrator:
    """Runs the measurements of a calibration on a rig.

    Args:
        rig: the device.
        ramp: ramp of the loop [s].
        progress: called with the current measurement, in words.
    """

    def __init__(
        self,
        rig: CalibrationRig,
        ramp: float,
        progress: Callable[[str], None] = lambda _words: None,
    ) -> None:
        self._rig = rig
        self._ramp = ramp
        self._report_progress = progress
        self._period = rig.servo.period
        self._max_force = rig.servo.max_force
        self._centre = np.full(3, math.nan)
        self._excitation_number = 0
        self._noise_floor = 0.0
        self._times = np.zeros(0)

    def run(self) -> Calibration:
        """Run all measurements.

        Raises:
            CalibrationError: for a handle that does not move.
            DeviceFault: if the loop ends by a fault.
        """
        self._report_progress("at rest")
        rest = self._apply(REST, 0, _REST_TIME, holding_stiffness=0.0, brake_damping=0.0)
        self._centre = rest[0, 1:4]
        pushes = {}
        for axis, name in enumerate(self._rig.axes):
            self._report_progress(f"pushing along {name}")
            record = self._measure_pushes(axis)
            if record is not None:
                pushes[axis] = record
        if not pushes:
            raise CalibrationError("the handle does not move: is its force switched on?")
        records = list(pushes.values())
        step = _largest([position_step(record.positions) for record in records])
        noise = _largest([rest_noise(rest[:, 1 + axis]) for axis in pushes])
        delay, motions = fit_dynamics(records, self._period)
        self._noise_floor = FLOOR_STEPS * max(step.value, noise.value)
        axes = []
        for axis, motion in zip(pushes, motions, strict=True):
            wall = self._find_wall(axis, motion)
            axes.append(AxisCalibration(self._rig.axes[axis], motion, wall))
        immobile = [name for axis, name in enumerate(self._rig.axes) if axis not in pushes]
        return Calibration(
            self._update_rate(records, step.value),
            step if step.value else None,
            noise,
            delay,
            self._max_force,
            tuple(axes),
            tuple(immobile),
        )

    def _apply(self, kind: float, axis: int, time: float, **more: float) -> FloatArray:
        """Apply an excitation for a time [s] and return its rows; see :class:`Excitation`."""
        self._excitation_number += 1
        x, y, z = map(float, self._centre)
        smoothing = min(1.0, self._period / _VELOCITY_TIME_CONSTANT)
        excitation = Excitation(
            self._excitation_number,
            kind,
            axis,
            HOLDING_STIFFNESS,
            _BRAKE_DAMPING,
            smoothing,
            1.0 / self._period,
            x,
            y,
            z,
            stiffness=0.0,
            wall_step=0.0,
            wait_samples=0.0,
            push_force=0.0,
            push_samples=1.0,
            trip_distance=MAX_TRAVEL,
            samples=self._samples(time),
        )
        return self._rig.apply(excitation._replace(**more))

    def _settle(self) -> None:
        """Return the handle to its initial position, at rest."""
        for _ in range(_MAX_SETTLES):
            rows = self._apply(REST, 0, _SETTLE_TIME)
            last = rows[len(rows) // 2 :, 1:4]
            if np.ptp(last, axis=0).max() <= max(_REST_TRAVEL, 2.0 * self._noise_floor):
                return

    def _samples(self, duration: float) -> int:
        return max(1, round(duration / self._period))

    def _measure_pushes(self, axis: int) -> PushRecord | None:
        """Return a record of pushes, made stronger, then longer, until the handle moves enough.

        ``None`` if it does not move.
        """
        push = _FIRST_PUSH_FRACTION * self._max_force
        span = _PUSH_DURATIONS[0]
        max_push = _MAX_PUSH_FRACTION * self._max_force
        while True:
            rows = self._apply_pushes(axis, push, span, _TRIAL_TIME)
            way = float(np.ptp(rows[:, 1 + axis]))
            if _tripped(rows):
                push = 0.5 * push
                span = 0.7 * span
            elif way > _SUFFICIENT_TRAVEL or span >= _PUSH_DURATIONS[1]:
                break
            elif push < max_push:
                push = min(1.5 * push, max_push)
            else:
                span *= 1.4
        if way < _IMMOBILE_TRAVEL:
            return None
        while _tripped(rows := self._apply_pushes(axis, push, span, _PUSH_TIME)):
            push *= 0.7
        self._times = rows[:, 0]
        return PushRecord(rows[:, 1 + axis], rows[:, 7 + axis], self._samples(span))

    def _apply_pushes(self, axis: int, push: float, duration: float, time: float) -> FloatArray:
        self._settle()
        span = float(self._samples(duration))
        time = max(time, 6.0 * duration)
        return self._apply(PUSHING, axis, time, push_force=push, push_samples=span)

    def _update_rate(self, records: list[PushRecord], step: float) -> Estimate:
        """Return the rate of fresh readings, for a step of the positions [m]; 0 for none."""
        share = max(fresh_fraction(record.positions, step) for record in records)
        periods = np.diff(self._times)
        periods = periods[periods < _GAP_PERIODS * self._period]
        rate = share / float(periods.mean())
        return Estimate(rate, rate * float(periods.std() / periods.mean()) / len(periods) ** 0.5)

    def _find_wall(self, axis: int, motion: AxisDynamics) -> WallOnset:
        """Find the stiffest wall along an axis."""
        # The step of a stiffer wall would be too few position steps to detect a cycle.
        finest = WALL_FORCE_FRACTION * self._max_force / max(2.0 * self._noise_floor, 1e-9)
        cycles = partial(self._wall_cycles, axis, motion)
        return find_wall_onset(cycles, min(MAX_STIFFNESS, finest))

    def _wall_cycles(self, axis: int, motion: AxisDynamics, stiffness: float) -> bool:
        """Return whether a wall keeps oscillating after a step."""
        self._report_progress(f"a wall of {stiffness:.0f} N/m along {self._rig.axes[axis]}")
        mass = max(motion.mass.value, 1e-3)
        angular_frequency = math.sqrt(stiffness / mass)
        wave = 2.0 * math.pi / angular_frequency
        # Far below the onset a weakly damped oscillation needs long to decay.
        loss = max(motion.damping.value, 0.0) / (mass * angular_frequency)
        waves = float(np.clip(0.5 / max(loss, 1e-3), *_OSCILLATIONS))
        watched = float(np.clip(waves * wave, *_OBSERVATION_TIMES))
        step = min(MAX_WALL_STEP, WALL_FORCE_FRACTION * self._max_force / stiffness)
        wait = self._ramp + _WALL_DELAY
        self._settle()
        rows = self._apply(
            WALL,
            axis,
            wait + watched,
            stiffness=stiffness,
            wall_step=step,
            brake_damping=0.0,
            wait_samples=self._samples(wait),
            trip_distance=_TRIP_STEPS * step,
            x=math.nan,
        )
        if _tripped(rows):
            return True
        after = rows[:, EXCITATION_COLUMN + 1] >= self._samples(wait) + self._samples(0.5 * wave)
        way = rows[after, 1 + axis]
        amplitudes = oscillation_amplitudes(way, self._period, 1.0 / wave)
        return is_limit_cycle(*amplitudes, self._noise_floor)


def _largest(estimates: Sequence[Estimate | None]) -> Estimate:
    """Return the largest estimate; zero if there is none."""
    return max(
        filter(None, estimates), key=lambda estimate: estimate.value, default=Estimate(0.0, 0.0)
    )


def _tripped(rows: FloatArray) -> bool:
    return bool((rows[:, EXCITATION_COLUMN + 2] > 0.0).any())

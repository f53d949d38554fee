"""A calibration: rest, pushes along each axis, then a smooth wall along each, from below."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from asperity.checks import FloatArray
from asperity.devices.device import Axis as AxisName
from asperity.errors import AsperityError
from asperity.files import Record
from asperity.servo.calibration.bench import NUMBER, Bench
from asperity.servo.calibration.identify import (
    Delay,
    Estimate,
    Motion,
    Pushes,
    fit_motions,
    fresh_share,
    position_step,
    rest_noise,
)
from asperity.servo.calibration.wall import (
    HIGHEST,
    STEPS,
    WallOnset,
    find_wall,
    ringing,
)
from asperity.servo.kernels.exciter import PUSHES, REST, WALL, Excitation

HOLD = 30.0
"""[N/m] of the spring that holds the handle where no wall does."""
TRAVEL = 0.02
"""[m] from its place that the handle may go while it is pushed; further, the force ends."""
_PAUSE = 100.0  # periods: rows further apart are of two loops
_REST_TIME, _TRIAL_TIME, _PUSH_TIME = 0.5, 0.4, 2.4  # [s]
_SPANS = (0.006, 0.04)  # [s] that a push lasts, at first and at most
_ENOUGH = 2e-3  # [m] to and fro that tell mass and damping
_STILL = 0.2e-3  # [m]: a handle that goes no further under the greatest push does not move
_PUSH = 0.2  # of the greatest force, the first pushes
WALL_STEP = 1e-3
"""[m] by which a wall is moved at most, so that the handle oscillates."""
WALL_SHARE = 0.35
"""Of the greatest force, that the move of a wall takes at most."""
_TRIP = 1.7  # steps: an oscillation that grows to this is no decaying one
_BRAKE = 1.0  # [N s/m] of the brake that brings the handle to rest, on a velocity that is
_SMOOTH = 2e-3  # smoothed over this time [s]
_SETTLES, _SETTLE_TIME = 12, 0.25  # times, and how long [s], that it may take
_AT_REST = 20e-6  # [m] that a handle at rest moves
_SETTLE = 0.05  # [s] before a wall is moved, beyond the ramp
_WAVES = (15.0, 150.0)  # oscillations that a wall is watched for
_WATCHED = (0.15, 2.5)  # [s]


class CalibrationError(AsperityError):
    """A device did nothing that could be measured."""


@dataclass(frozen=True)
class Axis(Record):
    """What was measured along an axis of a device.

    Attributes:
        name: of the axis.
        motion: mass, damping and friction.
        wall: which walls held.
    """

    name: AxisName
    motion: Motion
    wall: WallOnset


@dataclass(frozen=True)
class Calibration(Record):
    """What was measured of a device.

    Attributes:
        rate: of fresh readings [Hz].
        step: in which positions are read [m]; ``None`` if they are read exactly.
        noise: of readings at rest [m], the greatest of the axes.
        delay: between a reading and its force.
        force: greatest force that was used [N].
        axes: along which the handle moves.
        unmoved: names of the axes along which it does not.
    """

    rate: Estimate
    step: Estimate | None
    noise: Estimate
    delay: Delay
    force: float
    axes: tuple[Axis, ...]
    unmoved: tuple[AxisName, ...] = ()

    @property
    def weakest(self) -> Axis:
        """The axis whose wall held least."""
        return min(self.axes, key=lambda axis: axis.wall.held)


class Calibrator:
    """Does one thing after the other on a bench.

    Args:
        bench: the device.
        ramp: of the loop [s].
        progress: is told what is done, in words.
    """

    def __init__(
        self, bench: Bench, ramp: float, progress: Callable[[str], None] = lambda _words: None
    ) -> None:
        self._bench, self._ramp, self._tell = bench, ramp, progress
        self._period, self._force = bench.servo.period, bench.servo.max_force
        self._centre, self._number = np.full(3, math.nan), 0
        self._floor, self._times = 0.0, np.zeros(0)

    def run(self) -> Calibration:
        """Measure all there is.

        Raises:
            CalibrationError: for a handle that does not move.
            DeviceFault: if the loop ends by one.
        """
        self._tell("at rest")
        rest = self._do(REST, 0, _REST_TIME, hold=0.0, brake=0.0)
        self._centre = rest[0, 1:4]
        pushes = {}
        for axis, name in enumerate(self._bench.axes):
            self._tell(f"pushing along {name}")
            if (found := self._pushed(axis)) is not None:
                pushes[axis] = found
        if not pushes:
            raise CalibrationError("the handle does not move: is its force switched on?")
        step = _coarsest(position_step(one.positions) for one in pushes.values())
        noise = max((rest_noise(rest[:, 1 + axis]) for axis in pushes), key=lambda one: one.value)
        delay, motions = fit_motions(list(pushes.values()), self._period)
        self._floor = STEPS * max(step.value if step else 0.0, noise.value)
        axes = tuple(
            Axis(self._bench.axes[axis], motion, self._wall(axis, motion))
            for axis, motion in zip(pushes, motions, strict=True)
        )
        unmoved = tuple(name for axis, name in enumerate(self._bench.axes) if axis not in pushes)
        rate = self._rate(list(pushes.values()), step)
        return Calibration(rate, step, noise, delay, self._force, axes, unmoved)

    def _do(self, kind: float, axis: int, time: float, **more: float) -> FloatArray:
        """Do something for a time [s] and return its rows; see :class:`Excitation`."""
        self._number += 1
        x, y, z = map(float, self._centre)
        whole = Excitation(
            number=self._number, kind=kind, axis=axis, hold=HOLD, brake=_BRAKE,
            share=min(1.0, self._period / _SMOOTH), rate=1.0 / self._period, x=x, y=y, z=z,
            stiffness=0.0, step=0.0, wait=0.0, push=0.0, span=1.0, trip=TRAVEL,
            samples=self._samples(time),
        )  # fmt: skip
        return self._bench.do(whole._replace(**more))

    def _settle(self) -> None:
        """Bring the handle back to where it was at first, and to rest."""
        for _ in range(_SETTLES):
            rows = self._do(REST, 0, _SETTLE_TIME)
            last = rows[len(rows) // 2 :, 1:4]
            if np.ptp(last, axis=0).max() <= max(_AT_REST, 2.0 * self._floor):
                return

    def _samples(self, span: float) -> int:
        return max(1, round(span / self._period))

    def _pushed(self, axis: int) -> Pushes | None:
        """Return a record of pushes that move the handle far enough: first harder, then longer.

        ``None`` if it does not move.
        """
        push, span = _PUSH * self._force, _SPANS[0]
        most = 0.6 * self._force
        while True:
            rows = self._push(axis, push, span, _TRIAL_TIME)
            way = float(np.ptp(rows[:, 1 + axis]))
            if _tripped(rows):
                push, span = 0.5 * push, 0.7 * span
            elif way > _ENOUGH or span >= _SPANS[1]:
                break
            elif push < most:
                push = min(1.5 * push, most)
            else:
                span *= 1.4
        if way < _STILL:
            return None
        while _tripped(rows := self._push(axis, push, span, _PUSH_TIME)):
            push *= 0.7
        self._times = rows[:, 0]
        return Pushes(rows[:, 1 + axis], rows[:, 7 + axis], self._samples(span))

    def _push(self, axis: int, push: float, span: float, time: float) -> FloatArray:
        self._settle()
        return self._do(
            PUSHES, axis, max(time, 6.0 * span), push=push, span=float(self._samples(span))
        )  # fmt: skip

    def _rate(self, records: list[Pushes], step: Estimate | None) -> Estimate:
        """Return how often a second a reading is fresh."""
        share = max(fresh_share(one.positions, step.value if step else 0.0) for one in records)
        periods = np.diff(self._times)
        periods = periods[periods < _PAUSE * self._period]
        rate = share / float(periods.mean())
        return Estimate(rate, rate * float(periods.std() / periods.mean()) / len(periods) ** 0.5)

    def _wall(self, axis: int, motion: Motion) -> WallOnset:
        """Raise a wall along an axis until it cycles."""
        name = self._bench.axes[axis]

        def cycles(stiffness: float) -> bool:
            self._tell(f"a wall of {stiffness:.0f} N/m along {name}")
            return self._cycles(axis, motion, stiffness)

        # A stiffer wall would be moved by too few steps to tell a cycle from them.
        finest = WALL_SHARE * self._force / max(2.0 * self._floor, 1e-9)
        return find_wall(cycles, min(HIGHEST, finest))

    def _cycles(self, axis: int, motion: Motion, stiffness: float) -> bool:
        """Return whether a wall that is moved goes on to oscillate."""
        mass = max(motion.mass.value, 1e-3)
        pulsation = math.sqrt(stiffness / mass)
        wave = 2.0 * math.pi / pulsation
        # Far below the onset an oscillation of a device that damps little takes long to tell.
        loss = max(motion.damping.value, 0.0) / (mass * pulsation)
        waves = float(np.clip(0.5 / max(loss, 1e-3), *_WAVES))
        watched = float(np.clip(waves * wave, *_WATCHED))
        step = min(WALL_STEP, WALL_SHARE * self._force / stiffness)
        wait = self._ramp + _SETTLE
        self._settle()
        rows = self._do(
            WALL, axis, wait + watched, stiffness=stiffness, step=step, brake=0.0,
            wait=self._samples(wait), trip=_TRIP * step, x=math.nan,
        )  # fmt: skip
        if _tripped(rows):
            return True
        after = rows[:, NUMBER + 1] >= self._samples(wait) + self._samples(0.5 * wave)
        way = rows[after, 1 + axis]
        return ringing(way, self._period, 1.0 / wave).cycles(self._floor)


def _coarsest(steps: Iterable[Estimate | None]) -> Estimate | None:
    """Return the longest of the steps that there are."""
    known = [step for step in steps if step is not None]
    return max(known, key=lambda one: one.value) if known else None


def _tripped(rows: FloatArray) -> bool:
    return bool((rows[:, NUMBER + 2] > 0.0).any())

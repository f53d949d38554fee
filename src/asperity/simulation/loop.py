"""The closed loop: a law rendered by a sampled servo on a body that a hand moves."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from types import ModuleType

import numpy as np

from asperity.checks import FloatArray, array, positive, real
from asperity.derive.driver import ClampName
from asperity.errors import ParameterError
from asperity.laws import Law
from asperity.simulation.body import Body
from asperity.simulation.exact import Step, exact_step
from asperity.simulation.ledger import Ledger
from asperity.simulation.servo_source import LEDGER, MEMORY, TRACE
from asperity.surface import Surface

# Parts of a sample over which dry friction is held constant.
_FRICTION_PARTS = 16


@dataclass(frozen=True)
class Servo:
    """What the device's electronics do to position and force.

    Attributes:
        period: T [s].
        delay: whole samples between reading a position and applying its force.
        position_resolution: of the encoder [m]; 0 for none.
        force_resolution: smallest step of the force [N]; 0 for none.
        max_force: the length to which a force is limited [N].
        virtual_damping: b_v [N s/m], on the filtered velocity.
        velocity_share: of the newest difference in the filtered velocity [1]; 1 for no filter.
        friction: dry friction of the device [N].
    """

    period: float
    delay: int = 0
    position_resolution: float = 0.0
    force_resolution: float = 0.0
    max_force: float = float("inf")
    virtual_damping: float = 0.0
    velocity_share: float = 1.0
    friction: float = 0.0

    def __post_init__(self) -> None:
        positive("period", self.period, "s")
        if self.delay != int(self.delay) or self.delay < 0:
            raise ParameterError(
                "delay", "must be a whole number of samples, 0 or more", self.delay
            )
        for name, unit in (
            ("position_resolution", "m"), ("force_resolution", "N"), ("friction", "N"),
        ):  # fmt: skip
            if real(name, getattr(self, name), unit) < 0.0:
                raise ParameterError(name, f"must not be negative [{unit}]", getattr(self, name))
        if not self.max_force > 0.0:
            raise ParameterError("max_force", "must be positive [N]", self.max_force)
        real("virtual_damping", self.virtual_damping, "N s/m")
        if not 0.0 < self.velocity_share <= 1.0:
            raise ParameterError("velocity_share", "must be in (0, 1]", self.velocity_share)


@dataclass(frozen=True)
class Run:
    """What a simulation gave.

    Attributes:
        time: of the samples [s], shape (k,).
        position: of the handle at the samples [m], shape (k, 3).
        velocity: [m/s], shape (k, 3).
        commanded: force that the law asked for, after rounding and limit [N], shape (k, 3).
        applied: force that was held from this sample on [N], shape (k, 3).
        state: of the body at the end, shape (n,).
        ledger: the energies.
        diverged: whether the state left all bounds (1e6 in SI units); the trace ends there.
    """

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    commanded: FloatArray
    applied: FloatArray
    state: FloatArray
    ledger: Ledger
    diverged: bool


@lru_cache(maxsize=64)
def _fused(law: Law, sampler: tuple[ModuleType, ...], clamp: ClampName) -> ModuleType:
    from asperity.derive.fuse import fuse_surface
    from asperity.simulation.servo_source import servo_source

    return fuse_surface(law, sampler, clamp, servo_source(law))


@dataclass
class Simulation:
    """A surface on a body with a servo; runs sample after sample from where it stopped.

    Args:
        surface: the surface; its stiffness is what is rendered.
        moved: the body, see :func:`~asperity.simulation.body.body`.
        servo: the servo.
        start: position [m] at rest, shape (3,).
    """

    surface: Surface
    moved: Body
    servo: Servo
    start: FloatArray
    _state: FloatArray = field(init=False)
    _queue: FloatArray = field(init=False)
    _memory: FloatArray = field(init=False)
    _ledger: FloatArray = field(init=False)
    _step: Step = field(init=False)

    def __post_init__(self) -> None:
        begin = array("start", self.start, (3,), "m")
        self._state = np.zeros(self.moved.order)
        self._state[:3] = begin
        if self.moved.order > 6:
            self._state[6:9] = begin
        self._queue = np.zeros((int(self.servo.delay) + 1, 3))
        self._memory, self._ledger = np.zeros(MEMORY), np.zeros(LEDGER)
        parts = _FRICTION_PARTS if self.servo.friction > 0.0 else 1
        self._step = exact_step(self.moved, self.servo.period / parts)
        self._parts = parts

    def run(self, anchor: FloatArray) -> Run:
        """Run one sample for each row of the anchor's way but the last.

        Args:
            anchor: positions of the hand's anchor at the samples [m], shape (k + 1, 3); it moves
                at constant velocity in between. The first row is where it is now.

        Raises:
            ParameterError: for another shape, or positions that are not finite.
        """
        way = array("anchor", anchor, (None, 3), "m")
        if len(way) < 2:
            raise ParameterError("anchor", "must be at least 2 positions", len(way))
        step, servo, count = self._step, self.servo, len(way) - 1
        trace, before = np.empty((count, TRACE)), self._ledger.copy()
        stored = self._stored(way[0])
        first = self._memory[11]
        done = self._loops.servo_batch(
            self._state, np.zeros(self.moved.order + 9), self._queue, self._memory, self._ledger,
            way, step.motion, step.loss, step.anchor_work, self._stopping_mass(), self._parts,
            self._settings(), self.surface.texture.arguments,
            self.surface.law_arguments, trace,
        )  # fmt: skip
        after = self._stored(way[done])
        trace = trace[:done]
        time = (first + np.arange(done)) * servo.period
        return Run(
            time, trace[:, :3], trace[:, 3:6], trace[:, 6:9], trace[:, 9:], self._state.copy(),
            Ledger.of(self._ledger - before, stored, after),
            diverged=not bool((np.abs(self._state) < 1e6).all()),
        )  # fmt: skip

    @property
    def _loops(self) -> ModuleType:
        clamp: ClampName = self.surface.clamp if self.surface.law.clampable else "none"
        return _fused(self.surface.law, self.surface.sampler, clamp)

    def _settings(self) -> tuple[float, ...]:
        s = self.servo
        return (
            s.position_resolution, s.force_resolution, s.max_force, s.virtual_damping,
            s.velocity_share, s.friction, s.period,
        )  # fmt: skip

    def _stopping_mass(self) -> float:
        """Mass over the duration of a part: the force that stops a unit of speed in it [N s/m]."""
        lightest = 1.0 / float(np.abs(self.moved.force[3:6]).max())
        return lightest * self._parts / self.servo.period

    def _stored(self, anchor: FloatArray) -> float:
        """Return ½ zᵀ S z [J]; force and anchor velocity store nothing."""
        z = np.concatenate([self._state, np.zeros(3), anchor, np.zeros(3)])
        return float(0.5 * z @ self.moved.storage @ z)

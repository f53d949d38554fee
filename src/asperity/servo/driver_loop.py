"""The compiled loop of a driver, with its limits and its clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.contacts.warm_start import BUDGET, POINT_COUNT, UNLIMITED, new_warm_start
from asperity.core.checks import FloatArray
from asperity.core.platform.clock_interface import Clock
from asperity.core.platform.clocks import clock_module
from asperity.kernels.fuse import load_fused, source_on_texture
from asperity.kernels.tick import ServoState
from asperity.loop import guards, servo_loop, shared_trace
from asperity.loop.guards import Guards, LoopLimits
from asperity.loop.interface import NO_END, LoopState
from asperity.loop.shared_trace import SharedBlock
from asperity.servo.driver import Driver
from asperity.servo.loop_memory import EndReason
from asperity.servo.safety import Safety
from asperity.simulation.servo import Servo
from asperity.surface import Surface


@dataclass(frozen=True, eq=False)
class LoopProgram:
    """A surface as the loop renders it, here or in another process.

    Attributes:
        source: text of the compiled module.
        texture: record of the texture.
        law: parameters of the law.
        safe_height: height above which the depth is within its limit at every position [m].
        max_depth: limit of the depth [m].
        depth_can_fault: whether the law is certified to this depth only.
        max_evaluations: evaluation budget of a tick.
    """

    source: str
    texture: tuple[Any, ...]
    law: tuple[float, ...]
    safe_height: float
    max_depth: float
    depth_can_fault: bool
    max_evaluations: float


def loop_parts() -> tuple[Any, ...]:
    """Return the modules of the loop's parts but the device."""
    from asperity.kernels import tick

    return tick, clock_module(), guards, shared_trace


def build_program(surface: Surface, driver: Driver) -> LoopProgram:
    """Return the program that renders a surface on a driver.

    Raises:
        ParameterError: for a texture without a function that the law needs.
    """
    from asperity.analysis.gain.theorems import theorem_on

    source = source_on_texture(
        surface.law,
        surface.texture.sampler,
        surface.effective_clamp,
        (servo_loop, *loop_parts(), *driver.kernel_modules()),
        has_friction=surface.contact_friction is not None,
    )
    bounded = surface.effective_clamp.holds_whole_force
    everywhere = bounded or theorem_on(surface).holds_at_any_depth(surface)
    crest = surface.law.contact.extremes(surface.texture)[1]
    return LoopProgram(
        source,
        surface.texture.arguments,
        surface.loop_arguments,
        crest - surface.max_depth,
        surface.max_depth,
        not everywhere,
        surface.law.contact.max_evaluations,
    )


def loop_limits(
    servo: Servo, safety: Safety, reach: float, centre: FloatArray, program: LoopProgram
) -> LoopLimits:
    """Return the limits of a loop."""
    period = servo.period
    share = 1.0 if safety.ramp < period else period / safety.ramp
    x, y, z = map(float, centre)
    return LoopLimits(
        round(1e9 * period),
        safety.slew_limit(servo.max_force) * period,
        share,
        float(safety.passivity_damping),
        round(1e9 * safety.lateness_limit(period)),
        round(1e9 * safety.silence),
        float(reach),
        x,
        y,
        z,
        program.safe_height,
        program.max_depth,
        safety.beyond_depth == "fault" and program.depth_can_fault,
    )


class DriverLoop:
    """The loop of a driver.

    Args:
        driver: the device; the caller opens and closes it.
        servo: period, steps of position and force, maximum force, virtual damping, and the delay
            with which the device applies forces.
        safety: limits.
        reach: reach of the handle from the origin of the device [m].
        block: memory of rows and counts.
        clock: the clock.

    Attributes:
        search_state: of the contact's search; see :mod:`asperity.contacts.warm_start`.
    """

    def __init__(
        self,
        driver: Driver,
        servo: Servo,
        safety: Safety,
        reach: float,
        block: SharedBlock,
        clock: Clock,
    ) -> None:
        self._servo = servo
        self._safety = safety
        self._reach = reach
        self._frame: FloatArray = driver.frame.matrix
        self._block = block._replace(pending=np.zeros((servo.delay + 1, 3)))
        self._clock = clock
        self._placeholder = driver.placeholder_record()
        self.state = LoopState()
        self.search_state = new_warm_start(UNLIMITED)

    def compile(self, program: LoopProgram) -> None:
        """Compile the loop for a surface, or load it; the device is left alone."""
        self._call(program, self._placeholder, LoopState(), -1)

    def run(
        self, program: LoopProgram, device: tuple[Any, ...], end_sample: int = NO_END
    ) -> tuple[EndReason, int]:
        """Run until ``end_sample``, a request, or a fault.

        Args:
            program: the surface.
            device: record of the open device.
            end_sample: number of the first sample that is not run.

        Returns:
            End reason, and error code of the driver.
        """
        cause, code, self.state = self._call(program, device, self.state, end_sample)
        return EndReason(int(cause)), int(code)

    def reset_contact(self) -> None:
        """Reset the state of the law; position and velocity are kept for the next surface."""
        servo = self.state.servo
        self.search_state[POINT_COUNT] = 0.0
        fresh = ServoState(servo.x, servo.y, servo.z, servo.vx, servo.vy, servo.vz)
        self.state = self.state._replace(servo=fresh)

    def _call(
        self, program: LoopProgram, device: tuple[Any, ...], state: LoopState, end_sample: int
    ) -> tuple[int, int, LoopState]:
        limits = loop_limits(self._servo, self._safety, self._reach, self._frame[:3, 3], program)
        self.search_state[BUDGET] = program.max_evaluations
        answer: tuple[int, int, LoopState] = load_fused(program.source).servo_loop(
            state,
            end_sample,
            self._servo.settings,
            self._clock,
            Guards(limits, self._frame, self._block),
            device,
            self._block,
            self.search_state,
            program.texture,
            program.law,
        )
        return answer

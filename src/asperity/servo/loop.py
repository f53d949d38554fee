"""The compiled loop with all that it needs, in this process."""

from __future__ import annotations

import ctypes
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.contacts.memory import BUDGET, POINTS, UNLIMITED, new_memory
from asperity.kernels.fuse import load_fused, source_on_texture
from asperity.kernels.tick import ServoSettings, ServoState
from asperity.servo.drivers.driver import Driver
from asperity.servo.fault import Cause
from asperity.servo.kernels import clock, guard, loop
from asperity.servo.kernels.clock import Clock
from asperity.servo.kernels.loop import Carried, Limits
from asperity.servo.kernels.published import Board
from asperity.servo.safety import Safety
from asperity.simulation.servo import Servo
from asperity.surface import Surface

# Clamps under which what is said of a surface holds at every depth.
_BOUNDED = ("whole", "backed")
_NEVER = 2**62


@dataclass(frozen=True, eq=False)
class Rendered:
    """A surface as the loop takes it, in another process too.

    Attributes:
        source: text of the compiled module.
        texture: record of the texture.
        law: parameters of the law.
        shallow: height above which the depth is within its limit wherever the probe is [m].
        depth: limit of the depth [m].
        looks: evaluations of the surface that a tick may take.
    """

    source: str
    texture: tuple[Any, ...]
    law: tuple[float, ...]
    shallow: float
    depth: float
    looks: float


def render(surface: Surface, driver: Driver) -> Rendered:
    """Return a surface as the loop of a driver takes it.

    Raises:
        ParameterError: for a texture that lacks what the law asks of it.
    """
    from asperity.analysis.gain.theorems import theorem_of
    from asperity.kernels import tick

    source = source_on_texture(
        surface.law, surface.texture.sampler, surface.acting_clamp, (loop,),
        (tick, clock, guard, *driver.kernels()),
    )  # fmt: skip
    held = surface.acting_clamp in _BOUNDED
    everywhere = held or theorem_of(surface.law).at_any_depth(surface)
    crest = surface.law.contact.extremes(surface.texture)[1]
    shallow = -math.inf if everywhere else crest - surface.max_depth
    return Rendered(
        source, surface.texture.arguments, surface.law_arguments, shallow, surface.max_depth,
        surface.law.contact.looks,
    )  # fmt: skip


def limits_of(
    servo: Servo, safety: Safety, reach: float, middle: FloatArray, shown: Rendered
) -> Limits:  # fmt: skip
    """Return when the loop holds the force back and gives up."""
    period = servo.period
    share = 1.0 if safety.ramp < period else period / safety.ramp
    x, y, z = map(float, middle)
    return Limits(
        round(1e9 * period), safety.slew(servo.max_force) * period, share,
        float(safety.passivity_damping), int(safety.misses), round(1e9 * safety.lateness),
        round(1e9 * safety.silence), float(reach), x, y, z, shown.shallow, shown.depth,
        safety.beyond_depth == "fault",
    )  # fmt: skip


def address(function: Any) -> int:
    """Return the address of a C function."""
    return int(ctypes.cast(function, ctypes.c_void_p).value or 0)


def system_clock() -> Clock:
    """Return the system's clock."""
    library = ctypes.CDLL(None)
    return Clock(
        address(library.clock_gettime), address(library.clock_nanosleep), np.zeros(2, np.int64)
    )


def no_clock() -> Clock:
    """Return a clock that is always when the next sample is due."""
    return Clock(0, 0, np.zeros(2, np.int64))


class Loop:
    """The loop of a driver.

    Args:
        driver: the device; it is opened and closed by whoever runs the loop.
        servo: period, steps of position and force, greatest force, virtual damping.
        safety: limits.
        reach: of the handle from the origin of the device [m].
        board: where rows and counts go.
        ticks: the clock.
    """

    def __init__(
        self, driver: Driver, servo: Servo, safety: Safety, reach: float, board: Board,
        ticks: Clock,
    ) -> None:  # fmt: skip
        self._servo, self._safety, self._reach = servo, safety, reach
        self._frame: FloatArray = driver.frame.table
        self._settings: ServoSettings = servo.settings
        self._board, self._clock, self._blank = board, ticks, driver.blank()
        self.carried = Carried()
        self._memory = new_memory(UNLIMITED)

    def load(self, shown: Rendered) -> None:
        """Compile the loop for a surface, or find it compiled; the device is left alone."""
        self._call(shown, self._blank, Carried(), -1)

    def run(
        self, shown: Rendered, device: tuple[Any, ...], last: int = _NEVER
    ) -> tuple[Cause, int]:
        """Run until a sample is due that is not wanted, or something ends the loop.

        Args:
            shown: the surface.
            device: record of the open device.
            last: number of the first sample that is not wanted.

        Returns:
            What ended it, and what the driver said.
        """
        cause, code, self.carried = self._call(shown, device, self.carried, last)
        return Cause(int(cause)), int(code)

    def forget(self) -> None:
        """Carry nothing of a law over to the next surface but where the handle is."""
        servo = self.carried.servo
        self._memory[POINTS] = 0.0
        fresh = ServoState(servo.x, servo.y, servo.z, servo.vx, servo.vy, servo.vz)
        self.carried = self.carried._replace(servo=fresh)

    def _call(
        self, shown: Rendered, device: tuple[Any, ...], carried: Carried, last: int
    ) -> tuple[int, int, Carried]:
        limits = limits_of(self._servo, self._safety, self._reach, self._frame[:3, 3], shown)
        self._memory[BUDGET] = shown.looks
        answer: tuple[int, int, Carried] = load_fused(shown.source).device_loop(
            carried, last, self._settings, limits, self._frame, self._clock, device, self._board,
            self._memory, shown.texture, shown.law,
        )  # fmt: skip
        return answer

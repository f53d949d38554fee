"""Fixtures shared by the tests of the servo loop."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest
from tests.servo.python_device import SURFACE, PythonClock, PythonDevice, program_for

from asperity.core.platform.clocks import no_clock
from asperity.servo.driver_loop import DriverLoop
from asperity.servo.loop_memory import LoopMemory
from asperity.servo.safety import Safety
from asperity.simulation import Servo
from asperity.surface import Surface


@pytest.fixture
def run_loop() -> Callable[..., SimpleNamespace]:
    """``run_loop(device, samples, ...)``: run a loop; return its cause, code, forces and rows."""

    def run(
        device: PythonDevice,
        samples: int,
        servo: Servo | None = None,
        safety: Safety | None = None,
        *,
        surface: Surface = SURFACE,
        reach: float = 1.0,
        clock: PythonClock | None = None,
        control: Callable[[LoopMemory], None] = lambda _shared: None,
    ) -> SimpleNamespace:
        settings = servo or Servo(1e-3, max_force=3.0)
        shared = LoopMemory()
        ticks = no_clock() if clock is None else clock.record
        loop = DriverLoop(device, settings, safety or Safety(), reach, shared.block(), ticks)
        control(shared)
        cause, code = loop.run(program_for(surface), device.open(), samples)
        rows, first = shared.rows(0)
        return SimpleNamespace(
            cause=cause,
            code=code,
            forces=np.array(device.forces),
            rows=rows,
            first=first,
            shared=shared,
            loop=loop,
        )

    return run

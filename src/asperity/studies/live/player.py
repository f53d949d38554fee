"""Rendering of stimuli in one loop, which changes by ramps and is recorded trial by trial."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self

import numpy as np

from asperity.core.errors import ParameterError
from asperity.loop.shared_trace import COLUMNS
from asperity.recording.writer import RecordingWriter
from asperity.scene.setup import Setup
from asperity.servo.drivers.driver import Driver
from asperity.servo.drivers.simulated import simulated_driver
from asperity.servo.fault import EndReason
from asperity.servo.process import ServoProcess
from asperity.studies.live.stimuli import Stimuli, smooth_wall

TRIAL_COLUMNS = (
    *COLUMNS, ("trial", "1"), ("interval", "1"), ("answer", "1"), ("response time", "s"),
)  # fmt: skip
"""Columns of a recorded trial. The interval is 0 while no stimulus is rendered; answer and response
time are NaN until the answer is given."""
_SHARE = [name for name, _ in COLUMNS].index("share")
_FULL_SHARE = 1.0 - 1e-9


class LoopPlayer:
    """Renders stimuli by a loop in its own process; use it in a ``with``.

    Args:
        stimuli: the stimuli, which are checked before they are rendered.
        first: loop of any stimulus; the wall between stimuli is as stiff as it.
        driver: of a real device; ``None`` for a simulated one with a hand that strokes the surface.
    """

    _loop: ServoProcess
    _writer: RecordingWriter | None

    def __init__(self, stimuli: Stimuli, first: Setup, driver: Driver | None = None) -> None:
        self._stimuli, self._setup, self._wall = stimuli, first, smooth_wall(first)
        self._driver = driver or simulated_driver(
            first.plant, first.hand, first.servo, first.motion, first.duration
        )
        self._open, self._writer = ExitStack(), None
        self._marks, self._interval, self._next_row = np.full(4, math.nan), 0, 0
        self._ramp_end = self._full_row = 0.0  # numbers of rows; infinite during a ramp

    def start(self) -> None:
        """Start the loop with the smooth wall, by a ramp.

        Raises:
            ParameterError: for a device that cannot be opened.
            DeviceFault: for a fault.
        """
        servo, safety = self._setup.servo, self._setup.safety
        reach = safety.reach_limit(self._setup.device)
        loop = ServoProcess(self._wall, self._driver, servo, safety, reach)
        self._loop, self._next_row = self._open.enter_context(loop), 0

    def stop(self) -> None:
        """Release the force by a ramp, and end the loop; an open recording ends there."""
        self._open.close()
        if self._writer is not None:
            self._writer.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def begin_trial(self, path: Path, trial: int, metadata: Mapping[str, Any]) -> None:
        """Begin the recording of a trial; it names no stimulus but by codes."""
        servo = {"period": self._setup.servo.period}
        about = {"made_by": "study", "device": self._setup.device.id, "servo": servo, **metadata}
        self._writer = RecordingWriter(path, TRIAL_COLUMNS, about, argument="output")
        self._marks[:] = trial, 0.0, math.nan, math.nan

    def render(self, values: Mapping[str, Any] | None, interval: int) -> None:
        """Begin to render a stimulus, or the smooth wall for ``None``, by ramps.

        Args:
            values: of the stimulus.
            interval: its number.

        Raises:
            ParameterError: for a stimulus above its limit, which is not rendered.
            DeviceFault: for a fault.
        """
        surface = self._wall if values is None else self._stimuli.setup(values).rendered
        self.elapsed()
        self._marks[1] = 0.0
        self._loop.change_surface(surface, accept_risk=True)  # its limit was checked
        ramps = 2.0 * self._setup.safety.ramp / self._setup.servo.period
        self._ramp_end, self._full_row = self._loop.memory.row_count + ramps, math.inf
        self._interval = interval

    def elapsed(self) -> float:
        """Record new rows, and return for how long all of the force is rendered [s].

        It is 0 during the ramps: the force falls, and rises to all of the law's.

        Raises:
            DeviceFault: for a fault.
        """
        rows, first = self._loop.rows(self._next_row)
        self._next_row = first + len(rows)
        if self._writer is not None and len(rows):
            marks = np.broadcast_to(self._marks, (len(rows), len(self._marks)))
            self._writer.append(np.hstack([rows, marks]))
        if self._loop.poll() is not EndReason.RUNNING:
            raise ParameterError("driver", "has ended: --resume goes on where it stopped")
        is_full = len(rows) > 0 and rows[-1, _SHARE] >= _FULL_SHARE
        if self._full_row == math.inf and is_full and self._next_row > self._ramp_end:
            self._full_row, self._marks[1] = self._next_row, self._interval
        return max(0.0, (self._next_row - self._full_row) * self._setup.servo.period)

    def end_trial(self, answer: float, response_time: float) -> None:
        """Record the answer with the newest rows, and close the recording."""
        self._marks[2:] = answer, response_time
        first = self._next_row
        while self._next_row == first:
            time.sleep(self._setup.servo.period)
            self.elapsed()
        if self._writer is not None:
            self._writer.close()
            self._writer = None

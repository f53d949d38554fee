"""Rendering of stimuli in one loop, which changes by ramps and is recorded trial by trial."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Protocol, Self

import numpy as np

from asperity.core.errors import ParameterError
from asperity.loop.shared_trace import COLUMNS
from asperity.recording.writer import RecordingWriter
from asperity.scene.device_run import POLL_INTERVAL
from asperity.servo.drivers.driver import Driver
from asperity.servo.drivers.pointer import PointerHand, pointer_driver
from asperity.servo.fault import EndReason
from asperity.servo.process import ServoProcess
from asperity.studies.live.stimuli import Stimuli
from asperity.surface import Surface

TRIAL_COLUMNS = (
    *COLUMNS,
    ("trial", "1"),
    ("interval", "1"),
    ("answer", "1"),
    ("response time", "s"),
)
"""Columns of a recorded trial. The interval is 0 while no stimulus is rendered; answer and response
time are NaN until the answer is given."""
_SHARE = [name for name, _ in COLUMNS].index("share")
_START_HEIGHT = 2e-3  # of the simulated hand above the highest point [m]
_FULL_SHARE = 1.0 - 1e-9


Wait = Callable[[], object]
"""Waits for a short time."""


class Player(Protocol):
    """Renders stimuli."""

    def start(self) -> None:
        """Start the loop with the smooth wall, by a ramp."""

    def stop(self) -> None:
        """Release the force by a ramp, and end the loop."""

    def begin_trial(self, path: Path, trial: int, metadata: Mapping[str, Any]) -> None:
        """Begin the recording of a trial."""

    def render(self, values: Mapping[str, Any] | None, interval: int, wait: Wait) -> None:
        """Render a stimulus, or the smooth wall for ``None``; return when its force is complete."""

    def elapsed(self) -> float:
        """Record new rows, and return the time of the current stimulus [s]."""

    def end_trial(self, answer: float, response_time: float) -> None:
        """Record the answer, and close the recording."""


class LoopPlayer:
    """A player of a loop in its own process; use it in a ``with``.

    Args:
        stimuli: the stimuli, which are checked before they are rendered.
        first: values of any stimulus; the wall between stimuli is as stiff as it.
        driver: of a real device; ``None`` for a simulated one with a hand that strokes the surface.
    """

    def __init__(self, stimuli: Stimuli, first: Mapping[str, Any], driver: Driver | None) -> None:
        self._stimuli, self._setup = stimuli, stimuli.setup(first)
        self._wall, self._driver = stimuli.rest(self._setup), driver
        self._loop: ServoProcess | None = None
        self._hand: PointerHand | None = None
        self._writer: RecordingWriter | None = None
        self._marks, self._next_row, self._first_row = np.full(4, math.nan), 0, 0

    @property
    def _running(self) -> ServoProcess:
        if self._loop is None:
            raise ParameterError("loop", "is stopped")
        return self._loop

    def start(self) -> None:
        """Start the loop with the smooth wall, by a ramp.

        Raises:
            ParameterError: for a device that cannot be opened.
            DeviceFault: for a fault.
        """
        setup = self._setup
        reach = setup.safety.reach_limit(setup.device)
        driver = self._driver or self._simulated_driver()
        loop = ServoProcess(self._wall, driver, setup.servo, setup.safety, reach)
        loop.start()
        self._loop, self._next_row = loop, 0
        if self._hand is not None:
            stroke = self._stimuli.stroke(setup)
            self._hand.request_motion(
                stroke.centre, stroke.half, angular_velocity=stroke.angular_velocity
            )
        self._wait_for_force(0, partial(time.sleep, POLL_INTERVAL))

    def _simulated_driver(self) -> Driver:
        setup = self._setup
        stroke = self._stimuli.stroke(setup)
        highest = float(setup.surface.texture.extremes[1])
        self._close_hand()
        self._hand = PointerHand((*stroke.centre[:2], highest + _START_HEIGHT))
        return pointer_driver(setup.plant, setup.hand, setup.servo, self._hand)

    def _close_hand(self) -> None:
        hand, self._hand = self._hand, None
        if hand is not None:
            hand.close()

    def stop(self) -> None:
        """Release the force by a ramp, and end the loop; an open recording ends there."""
        loop, self._loop = self._loop, None
        if loop is not None:
            loop.stop()
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.close()
        self._close_hand()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def begin_trial(self, path: Path, trial: int, metadata: Mapping[str, Any]) -> None:
        """Begin the recording of a trial; it names no stimulus but by codes."""
        if self._writer is not None:
            self._writer.close()
        servo = {"period": self._setup.servo.period}
        about = {"made_by": "study", "device": self._setup.device.id, "servo": servo, **metadata}
        self._writer = RecordingWriter(path, TRIAL_COLUMNS, about, argument="output")
        self._next_row = self._running.memory.row_count
        self._marks = np.array([trial, 0.0, math.nan, math.nan])

    def render(self, values: Mapping[str, Any] | None, interval: int, wait: Wait) -> None:
        """Render a stimulus, or the smooth wall for ``None``; return when its force is complete.

        Args:
            values: of the stimulus.
            interval: its number.
            wait: called again and again during the ramps; whatever it raises ends the waiting.

        Raises:
            ParameterError: for a stimulus above its limit, which is not rendered.
            DeviceFault: for a fault.
        """
        surface = self._wall if values is None else self._stimuli.setup(values).rendered
        self._record()
        self._marks[1] = 0.0
        self._change(surface, wait)
        self._record()
        self._marks[1], self._first_row = interval, self._next_row

    def _change(self, surface: Surface, wait: Wait) -> None:
        loop = self._running
        loop.change_surface(surface, accept_risk=True)  # its limit was checked
        self._wait_for_force(loop.memory.row_count, wait)

    def _wait_for_force(self, first: int, wait: Wait) -> None:
        """Wait until the force has fallen, where it does, and risen to all of the law's."""
        ramp = math.ceil(2.0 * self._setup.safety.ramp / self._setup.servo.period)
        while True:
            self._record()
            rows, start = self._running.rows(self._running.memory.row_count - 1)
            if len(rows) and start - first > ramp and rows[-1, _SHARE] >= _FULL_SHARE:
                return
            wait()

    def _record(self) -> None:
        """Write the new rows, and check that the loop runs.

        Raises:
            DeviceFault: for a fault.
        """
        rows, first = self._running.rows(self._next_row)
        self._next_row = first + len(rows)
        if self._writer is not None and len(rows):
            marks = np.broadcast_to(self._marks, (len(rows), len(self._marks)))
            self._writer.append(np.hstack([rows, marks]))
        if self._running.poll() is not EndReason.RUNNING:
            raise ParameterError("driver", "has ended: --resume goes on where it stopped")

    def elapsed(self) -> float:
        """Record new rows, and return the time of the current stimulus in the loop [s]."""
        self._record()
        return (self._next_row - self._first_row) * self._setup.servo.period

    def end_trial(self, answer: float, response_time: float) -> None:
        """Record the answer with the newest rows, and close the recording."""
        first = self._next_row
        self._marks[2:] = answer, response_time
        while self._next_row == first:
            self._record()
            time.sleep(self._setup.servo.period)
        if self._writer is not None:
            self._writer.close()
            self._writer = None

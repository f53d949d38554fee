"""Stimuli of a study: analysed before they are felt, and rendered in one loop by ramps.

A loop in its own process renders them, and is recorded trial by trial.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from asperity.analysis.energy.straight_scan import scan_force
from asperity.core.errors import AsperityError, ParameterError
from asperity.devices import Device
from asperity.loop.shared_trace import COLUMNS
from asperity.recording.writer import RecordingWriter
from asperity.scene.device_run import without_hand
from asperity.scene.scene_file import build_scene, to_scene_values
from asperity.scene.scene_keys import with_values
from asperity.scene.setup import Setup, make_setup
from asperity.servo.driver import Driver
from asperity.servo.drivers.simulated import simulated_driver
from asperity.servo.loop_memory import EndReason
from asperity.servo.process import ServoProcess
from asperity.servo.safety import excess_stiffness_reason
from asperity.studies.study_file import Study
from asperity.surface import Surface

_LEVEL_COUNT = 9  # levels in the range of a level that are analysed before the first trial
# A simulated device is harmless: late samples and deep presses do not end its loop.
_RELAXED = {"lateness": "60 s", "silence": "10 s", "beyond_depth": "warn"}
# The interval is 0 while no stimulus is rendered; answer and response time are NaN until the end.
_MARKS = (("trial", "1"), ("interval", "1"), ("answer", "1"), ("response time", "s"))
_SHARE = [name for name, _ in COLUMNS].index("share")


class Stimuli:
    """The stimuli of a study on a device.

    The limit of a stimulus is the stiffness that ``asperity compare`` recommends for its law,
    surface and device: the stability limit with its margin.

    Args:
        study: the study.
        is_real: whether a real device renders them, which has its own delay and resolution.
    """

    def __init__(self, study: Study, *, is_real: bool = False) -> None:
        self._study = study
        self._is_real = is_real
        self._checked: dict[str, Setup] = {}

    def check_all(self, progress: Callable[[float], None] = lambda _share: None) -> Setup:
        """Check all stimuli, over the whole range of the level, and return the first one's loop.

        Args:
            progress: called with the fraction done.

        Raises:
            ParameterError: for the first stimulus that cannot be rendered or is above its limit.
        """
        design = self._study.design
        levels: list[dict[str, float]] = [{}]
        if key := design.options.get("level"):
            low, high = design.options["range"]
            named = {low, high, design.options.get("reference", low)}
            inner = np.geomspace(min(named), max(named), _LEVEL_COUNT).tolist()
            levels = [{key: level} for level in sorted({*inner, *named})]
        stimuli = [{**condition, **level} for condition in design.conditions for level in levels]
        for count, values in enumerate(stimuli, start=1):
            self.setup(values)
            progress(count / len(stimuli))
        return self.setup(stimuli[0])

    def setup(self, values: Mapping[str, Any]) -> Setup:
        """Return the loop of a stimulus that is within its limit.

        Args:
            values: of the varied keys [SI].

        Raises:
            ParameterError: if it cannot be rendered, or is above its limit.
        """
        key = str(sorted(values.items()))
        known = self._study.arguments
        if key not in self._checked:
            texts = [f"{name} = {known[name].format_value(x)}" for name, x in values.items()]
            stimulus = ", ".join(texts) or "the stimulus"
            try:
                setup = self._make_setup(values)
                rendered = setup.rendered  # it may have to be baked
            except AsperityError as error:
                raise ParameterError("vary", f"{stimulus} cannot be rendered: {error}") from None
            _check_limit(stimulus, rendered, setup.device)
            self._checked[key] = setup
        return self._checked[key]

    def surface_and_device(self, values: Mapping[str, Any]) -> tuple[Surface, Device]:
        """Return what a stimulus that is within its limit is rendered on, see :meth:`setup`."""
        setup = self.setup(values)
        return setup.surface, setup.device

    def _make_setup(self, values: Mapping[str, Any]) -> Setup:
        """Return the loop of a stimulus, whose stiffness gives the texture force of the study."""
        setup = self._build_setup(values)
        force = self._study.settings.get("texture_force")
        if force is None:
            return setup
        ripple = scan_force(setup.rendered).ripple
        if not ripple:
            raise ParameterError("study.texture_force", "needs surfaces with a texture force")
        return replace(setup, surface=setup.surface.to_stiffness(force / ripple))

    def _build_setup(self, values: Mapping[str, Any]) -> Setup:
        study = self._study
        texts = to_scene_values(values, study.arguments.values())
        scene = build_scene(with_values(study.sections, texts), study.folder)
        scene = replace(scene, surface={"clamp": "backed", **scene.surface})
        if self._is_real:
            return make_setup(without_hand(scene)).on_real_device()
        servo = {"servo": {**_RELAXED, **scene.loop.get("servo", {})}}
        loop = replace(scene, loop={**scene.loop, **servo})
        # The simulated hand strokes the surface for ten minutes, and then rests.
        return make_setup(loop, duration=600.0, use_defaults=True)


def smooth_wall(setup: Setup) -> Setup:
    """Return the loop of the smooth wall that is rendered between stimuli, as stiff as one of them.

    Raises:
        ParameterError: if it is above its limit.
    """
    # Its gain is the same at every depth: at 0.1 m no press is too deep.
    wall = replace(setup, surface=setup.surface.to_law("W").to_depth(0.1))
    _check_limit("the smooth wall between stimuli", wall.rendered, wall.device)
    return wall


def _check_limit(stimulus: str, surface: Surface, device: Device) -> None:
    if reason := excess_stiffness_reason(surface, device, keeps_margin=True):
        raise ParameterError("vary", f"{stimulus} is refused: {reason}")


class LoopPlayer:
    """Renders stimuli by a loop in its own process, which must be stopped.

    Args:
        stimuli: the stimuli, which are checked before they are rendered.
        first: loop of any stimulus; the wall between stimuli is as stiff as it.
        driver: of a real device; ``None`` for a simulated one with a hand that strokes the surface.
    """

    _loop: ServoProcess
    _writer: RecordingWriter

    def __init__(self, stimuli: Stimuli, first: Setup, driver: Driver | None = None) -> None:
        self._stimuli = stimuli
        self._setup = first
        self._wall = smooth_wall(first)
        self._driver = driver or simulated_driver(
            first.plant, first.hand, first.servo, first.motion, first.duration
        )
        self._running = ExitStack()
        self._recording = ExitStack()
        self._marks = np.full(4, math.nan)
        self._interval = 0
        self._next_row = 0
        self._ramp_end = self._full_row = 0.0  # numbers of rows; infinite during a ramp

    def start(self) -> None:
        """Start the loop with the smooth wall, by a ramp.

        Raises:
            ParameterError: for a device that cannot be opened.
            DeviceFault: for a fault.
        """
        servo = self._setup.servo
        safety = self._setup.safety
        reach = safety.reach_limit(self._setup.device)
        loop = ServoProcess(self._wall.rendered, self._driver, servo, safety, reach)
        self._loop = self._running.enter_context(loop)
        self._next_row = 0

    def stop(self) -> None:
        """Release the force by a ramp, and end the loop; an open recording ends there."""
        self._running.close()
        self._recording.close()

    def begin_trial(self, path: Path, trial: int, metadata: Mapping[str, Any]) -> None:
        """Begin the recording of a trial; it names no stimulus but by codes."""
        servo = {"period": self._setup.servo.period}
        about = {"made_by": "study", "device": self._setup.device.id, "servo": servo, **metadata}
        writer = RecordingWriter(path, (*COLUMNS, *_MARKS), about, argument="output")
        self._writer = self._recording.enter_context(writer)
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
        setup = self._wall if values is None else self._stimuli.setup(values)
        self.elapsed()
        self._marks[1] = 0.0
        self._loop.change_surface(setup.rendered, accept_risk=True)  # its limit was checked
        ramps = 2.0 * self._setup.safety.ramp / self._setup.servo.period
        self._ramp_end = self._loop.memory.row_count + ramps
        self._full_row = math.inf
        self._interval = interval

    def elapsed(self) -> float:
        """Record new rows, and return for how long all of the force is rendered [s].

        It is 0 during the ramps: the force falls, and rises to all of the law's.

        Raises:
            DeviceFault: for a fault.
        """
        rows, first = self._loop.rows(self._next_row)
        self._next_row = first + len(rows)
        self._writer.append(np.hstack([rows, np.tile(self._marks, (len(rows), 1))]))
        if self._loop.poll() is not EndReason.RUNNING:
            raise ParameterError(
                "driver", "has ended: {resume} goes on where it stopped", resume=True
            )
        if len(rows) and self._next_row > self._ramp_end and rows[-1, _SHARE] > 1.0 - 1e-9:
            self._full_row = min(self._full_row, self._next_row)
            self._marks[1] = self._interval
        return max(0.0, (self._next_row - self._full_row) * self._setup.servo.period)

    def end_trial(self, answer: float, response_time: float) -> None:
        """Record the answer with the newest rows, and close the recording."""
        self._marks[2:] = answer, response_time
        first = self._next_row
        while self._next_row == first:
            time.sleep(self._setup.servo.period)
            self.elapsed()
        self._recording.close()

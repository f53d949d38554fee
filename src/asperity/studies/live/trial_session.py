"""A session: trials are presented until the method ends, with breaks, pauses and a stop."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Collection, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core.errors import ParameterError
from asperity.scene.device_run import POLL_INTERVAL
from asperity.studies.design import SIMULATED_DEVICE, Presentation, describe_source
from asperity.studies.live.player import LoopPlayer, Stimuli
from asperity.studies.live.screens import BACK, DOWN, GO_ON, PAUSE, STOP, UP, Screen, View
from asperity.studies.methods import METHODS
from asperity.studies.simulated_participants import (
    Observer,
    StudyPlan,
    hand_strength,
    plan,
    simulate_run,
)
from asperity.studies.study_file import load_study
from asperity.studies.study_store import Participant

ADJUSTMENT_STEPS = 40  # of equal ratios, from the least to the greatest value
_NUMERAL = "0123456789.-"
_NUMBER = re.compile(r"-?(\d+\.?\d*|\.\d+)")
_ALWAYS = ((PAUSE, "pause"), (STOP, "stop"))
_TITLES = ("First", "Second", "Third")


class SessionStopped(Exception):  # noqa: N818 - it is no error
    """The participant has stopped the session."""


class _Paused(Exception):  # noqa: N818 - it is no error
    """The participant pauses: the trial is presented again."""


class StudySession:
    """A session of a participant on a device.

    Args:
        participant: whose answers are recorded.
        player: renders the stimuli.
        screen: shows what to do, and reads keys.
    """

    def __init__(self, participant: Participant, player: LoopPlayer, screen: Screen) -> None:
        self._settings = participant.study.settings
        self._participant = participant
        self._player = player
        self._screen = screen

    def run(self) -> None:
        """Present trials until the method ends.

        Raises:
            SessionStopped: if the participant stops.
            DeviceFault: for a fault; the trial under way is presented again by a later session.
        """
        try:
            self._rest("Welcome", self._settings["instructions"])
            self._present_trials(self._settings["break_every"])
        finally:
            self._player.stop()
        self._screen.show(View("The end", self._settings["thanks"], is_last=True))

    def _present_trials(self, break_every: int) -> None:
        count = 0
        while (presentation := self._participant.method.next()) is not None:
            if count and break_every and count % break_every == 0:
                self._rest("A break", "Rest your hand as long as you like.")
            try:
                self._present_trial(presentation)
                count += 1
            except _Paused:
                self._rest("Pause", "The trial is presented again when you go on.")

    def _rest(self, title: str, text: str) -> None:
        """Show a text without force until the participant goes on; then start the loop."""
        self._player.stop()
        self._screen.show(View(title, text, ((GO_ON, "go on (or the space bar)"), _ALWAYS[1])))
        while (key := self._screen.read_key(POLL_INTERVAL)) != GO_ON:
            if key == STOP:
                raise SessionStopped
        self._screen.show(View("One moment", "The force is starting: hold the handle."))
        self._player.start()

    def _present_trial(self, presentation: Presentation) -> None:
        participant = self._participant
        started = _current_time()
        codes = participant.codes(presentation)
        path = participant.path / f"trial-{participant.trial:04d}-{'-'.join(codes)}.mcap"
        about = {
            "participant": participant.code,
            "codes": codes,
            "started": started,
            "simulated": participant.simulated,
        }
        self._player.begin_trial(path, participant.trial, about)
        if not presentation.adjusts:
            self._present_intervals(presentation)
        begin = time.monotonic()
        answer = self._ask(presentation)
        seconds = time.monotonic() - begin
        participant.record(answer, seconds, started)  # first: a fault of the loop must not lose it
        self._player.end_trial(float(answer), seconds)

    def _present_intervals(self, presentation: Presentation) -> None:
        for number, values in enumerate(presentation.intervals, start=1):
            title = _TITLES[number - 1] if len(presentation.intervals) > 1 else "Feel this one"
            self._render(values, number)
            self._screen.show(View(title, "Move the handle over the surface.", _ALWAYS))
            while self._player.elapsed() < self._settings["interval"]:
                self._watch()
        self._render(None, 0)

    def _render(self, values: Mapping[str, Any] | None, interval: int) -> None:
        """Render a stimulus, and wait for all of its force."""
        self._player.render(values, interval)
        while not self._player.elapsed():
            self._watch()

    def _watch(self) -> str | None:
        """Wait for a short time for a key, which is returned, a pause or the stop."""
        key = self._screen.read_key(POLL_INTERVAL)
        if key in {STOP, PAUSE}:
            raise SessionStopped if key == STOP else _Paused
        self._player.elapsed()
        return key

    def _press(self, view: View, others: Collection[str] = ()) -> str:
        """Show a view, and return the key of it, or of others, that is pressed."""
        self._screen.show(replace(view, keys=(*view.keys, *_ALWAYS)))
        keys = {*dict(view.keys), *others}
        while (key := self._watch()) not in keys:
            pass
        return str(key)

    def _ask(self, presentation: Presentation) -> str:
        """Return the answer to the question of a trial: a key, a number, or a value set by keys."""
        if presentation.adjusts:
            return self._adjust(presentation, presentation.adjusts)
        if presentation.answers:
            keys = tuple([(answer, f"answer {answer}") for answer in presentation.answers])
            return self._press(View(presentation.question, keys=keys))
        return self._ask_number(presentation)

    def _ask_number(self, presentation: Presentation) -> str:
        """Return a number in the range of a presentation, typed and confirmed."""
        low, high = presentation.range or (-math.inf, math.inf)
        text = f"Type a number from {low:g} to {high:g}."
        typed = ""
        note = ""
        keys = ((GO_ON, "confirm"), (BACK, "delete"))
        while True:
            view = View(presentation.question, note + text, keys, typed=typed or "_")
            key = self._press(view, _NUMERAL)
            if key != GO_ON:
                note = ""
                typed = typed[:-1] if key == BACK else typed + key
            elif _NUMBER.fullmatch(typed) and low <= float(typed) <= high:
                return typed
            else:
                note = "This is not such a number. "

    def _adjust(self, presentation: Presentation, key: str) -> str:
        """Return the value of a key that the participant chooses."""
        values = presentation.intervals[0]
        limits = presentation.range or (1.0, 1.0)
        levels = np.geomspace(*limits, ADJUSTMENT_STEPS + 1).tolist()
        at = min(range(len(levels)), key=lambda i: abs(levels[i] - values[key]))
        view = View(presentation.question, keys=((UP, "more"), (DOWN, "less"), (GO_ON, "done")))
        while True:
            self._render({**values, key: levels[at]}, 1)
            pressed = self._press(view)
            if pressed == GO_ON:
                return repr(levels[at])
            at = min(max(at + (1 if pressed == UP else -1), 0), len(levels) - 1)


def _current_time() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def simulate_session(participant: Participant, stimuli: Stimuli, observer: Observer) -> None:
    """Record the answers of a simulated observer, without a loop, in a folder for them.

    A session that goes on gives the answers of one that was not stopped.

    Args:
        participant: whose answers are recorded.
        stimuli: of the study, which are checked.
        observer: the observer.

    Raises:
        ParameterError: for a participant in a folder for answers of people.
    """
    if participant.simulated in {"", SIMULATED_DEVICE}:
        source = describe_source(participant.simulated)
        raise ParameterError(
            "participant",
            f"{participant.code} belongs to {source}: simulated answers need another folder",
        )
    design = participant.study.design
    strength = hand_strength(design, stimuli.surface_and_device)
    answered = simulate_run(design, participant.number, observer, strength, design.seed)
    for trial in answered[participant.trial - 1 :]:
        participant.record(trial.answer, 1.0, _current_time())  # after a second


def plan_study(path: str | Path, effect: float, **options: Any) -> StudyPlan:
    """Return how often a study would find an effect.

    Levels are as strong as the scene renders them in the second condition.

    Args:
        path: study file.
        effect: factor of the strength at the hand in the first condition.
        **options: as for :func:`asperity.studies.simulated_participants.plan`.

    Raises:
        ParameterError: for a study or an option that cannot be used.
    """
    study = load_study(path)
    design = METHODS[study.design.kind].complete(study.design)
    strength = hand_strength(design, Stimuli(study).surface_and_device)
    return plan(design, effect, level_strength=strength, **options)

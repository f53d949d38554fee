"""A session: trials are presented until the method ends, with breaks, pauses and a stop."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection
from typing import Any

import numpy as np

from asperity.scene.device_run import POLL_INTERVAL
from asperity.studies.design import Presentation
from asperity.studies.live.player import Player
from asperity.studies.live.screens import BACK, DOWN, GO_ON, PAUSE, STOP, UP, Screen, View
from asperity.studies.study_file import Study
from asperity.studies.study_store import Participant, current_time

ADJUSTMENT_STEPS = 40
"""Number of steps from the least to the greatest value of an adjustment."""
SIMULATED_RESPONSE_TIME = 1.0
"""Response time of simulated observers [s]."""
_NUMERAL = "0123456789.-"
_MAX_DIGITS = 12
_ALWAYS = ((PAUSE, "pause"), (STOP, "stop"))
_READY = ((GO_ON, "go on (or the space bar)"), *_ALWAYS)


class SessionStopped(Exception):  # noqa: N818 - it is no error
    """The participant has stopped the session."""


class _Paused(Exception):  # noqa: N818 - it is no error
    """The participant pauses: the trial is presented again."""


class StudySession:
    """A session of a participant on a device.

    Args:
        study: the study.
        participant: whose answers are recorded.
        player: renders the stimuli.
        screen: shows what to do, and reads keys.
    """

    def __init__(
        self, study: Study, participant: Participant, player: Player, screen: Screen
    ) -> None:
        self._study, self._participant, self._player, self._screen = (
            study, participant, player, screen,
        )  # fmt: skip

    def run(self) -> int:
        """Present trials until the method ends, and return the number of new answers.

        Raises:
            SessionStopped: if the participant stops.
            DeviceFault: for a fault; the trial under way is presented again by a later session.
        """
        settings, count = self._study.settings, 0
        self._wait_until_ready("Welcome", settings["instructions"])
        while (presentation := self._participant.method.next()) is not None:
            if count and settings["break_every"] and count % settings["break_every"] == 0:
                self._wait_until_ready("A break", "Rest your hand as long as you like.")
            try:
                self._present_trial(presentation)
            except _Paused:
                self._wait_until_ready("Pause", "The trial is presented again when you go on.")
                continue
            count += 1
        self._player.stop()
        self._screen.show(View("The end", settings["thanks"], progress=1.0))
        return count

    def _wait_until_ready(self, title: str, text: str) -> None:
        """Show a text without force until the participant goes on; then start the loop."""
        self._player.stop()
        self._screen.show(View(title, text, ((GO_ON, _READY[0][1]), _ALWAYS[1])))
        while (key := self._screen.read_key(POLL_INTERVAL)) != GO_ON:
            if key == STOP:
                raise SessionStopped
        self._screen.show(View("One moment", "The force is starting: hold the handle."))
        self._player.start()

    def _present_trial(self, presentation: Presentation) -> None:
        participant, started = self._participant, current_time()
        codes = participant.codes(presentation)
        path = participant.path / f"trial-{participant.trial:04d}-{'-'.join(codes)}.mcap"
        about = {"participant": participant.code, "codes": codes, "started": started}
        self._player.begin_trial(path, participant.trial, about)
        if presentation.adjusts is not None:
            answer, seconds = self._adjust(presentation)
        else:
            for number, values in enumerate(presentation.intervals, start=1):
                self._present_interval(number, len(presentation.intervals), values)
            self._player.render(None, 0, self._watch)
            answer, seconds = self._ask(presentation)
        self._player.end_trial(float(answer), seconds)
        participant.record(answer, seconds, started)

    def _present_interval(self, number: int, total: int, values: Any) -> None:
        self._player.render(values, number, self._watch)
        title = (
            "Feel this one" if total == 1 else ("First", "Second", "Third", "Fourth")[number - 1]
        )
        self._screen.show(View(title, "Move the handle over the surface.", _ALWAYS))
        self._watch()
        while self._player.elapsed() < self._study.settings["interval"]:
            self._watch()

    def _watch(self) -> None:
        """Wait for a short time for a pause or the stop."""
        self._read_key(())

    def _read_key(self, keys: Collection[str]) -> str | None:
        """Return a pressed key that is one of some; ``None`` if there is none yet."""
        key = self._screen.read_key(POLL_INTERVAL)
        if key == STOP:
            raise SessionStopped
        if key == PAUSE:
            raise _Paused
        self._player.elapsed()
        return key if key in keys else None

    def _ask(self, presentation: Presentation) -> tuple[str, float]:
        """Return the answer to the question of a trial, and the response time [s]."""
        start = time.monotonic()
        if not presentation.answers:
            return self._ask_number(presentation), time.monotonic() - start
        keys = tuple((one, f"answer {one}") for one in presentation.answers)
        self._screen.show(View(presentation.question, "", (*keys, *_ALWAYS)))
        while (answer := self._read_key(presentation.answers)) is None:
            pass
        return answer, time.monotonic() - start

    def _ask_number(self, presentation: Presentation) -> str:
        """Return a number in the range of a presentation, typed and confirmed."""
        low, high = presentation.range or (-math.inf, math.inf)
        text = (
            f"Type a number from {low:g} to {high:g}." if math.isfinite(high) else "Type a number."
        )
        keys, typed, note = ((GO_ON, "confirm"), (BACK, "delete"), *_ALWAYS), "", ""
        while True:
            self._screen.show(View(presentation.question, note + text, keys, typed=typed or "_"))
            while (key := self._read_key((*_NUMERAL, GO_ON, BACK))) is None:
                pass
            if key == GO_ON and is_number(typed) and low <= float(typed) <= high:
                return typed
            note = "This is not such a number. " if key == GO_ON else ""
            typed = _edit(typed, key)

    def _adjust(self, presentation: Presentation) -> tuple[str, float]:
        """Return the value that the participant chooses, and the time that it took [s]."""
        start, key = time.monotonic(), str(presentation.adjusts)
        values = dict(presentation.intervals[0])
        levels = adjustment_levels(*(presentation.range or (values[key], values[key])))
        at = min(range(len(levels)), key=lambda i: abs(levels[i] - values[key]))
        keys = ((UP, "more"), (DOWN, "less"), (GO_ON, "done"), *_ALWAYS)
        while True:
            self._player.render({**values, key: levels[at]}, 1, self._watch)
            self._screen.show(View(presentation.question, "", keys))
            while (pressed := self._read_key((UP, DOWN, GO_ON))) is None:
                pass
            if pressed == GO_ON:
                return repr(levels[at]), time.monotonic() - start
            at = min(max(at + (1 if pressed == UP else -1), 0), len(levels) - 1)


def _edit(typed: str, key: str) -> str:
    """Return a typed text after a key."""
    if key == BACK:
        return typed[:-1]
    return (typed + key)[:_MAX_DIGITS] if key in _NUMERAL else typed


def is_number(text: str) -> bool:
    """Return whether a typed text is a number.

    Example:
        >>> is_number("1.5"), is_number("1.-5")
        (True, False)
    """
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def adjustment_levels(low: float, high: float) -> list[float]:
    """Return the values that an adjustment can reach: equal ratios, or equal steps from zero.

    Example:
        >>> levels = adjustment_levels(100.0, 400.0)
        >>> levels[0], round(levels[20]), levels[-1]
        (100.0, 200, 400.0)
    """
    shares = [step / ADJUSTMENT_STEPS for step in range(ADJUSTMENT_STEPS + 1)]
    inner = [low * (high / low) ** s if low > 0.0 else low + (high - low) * s for s in shares]
    return [low, *inner[1:-1], high]


def simulate_session(
    participant: Participant, answer: Callable[[Presentation, np.random.Generator], str], seed: int
) -> int:
    """Record the answers of a simulated observer, without a loop; return their number.

    Args:
        participant: whose answers are recorded.
        answer: returns the answer to a presentation.
        seed: of the observer; a session that goes on gives the answers of one that was not stopped.
    """
    count = 0
    while (presentation := participant.method.next()) is not None:
        rng = np.random.default_rng([seed, participant.number, participant.trial])
        participant.record(answer(presentation, rng), SIMULATED_RESPONSE_TIME, current_time())
        count += 1
    return count

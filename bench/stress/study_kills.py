"""Kills at random of sessions of a study: is an answer lost, asked twice, or a stimulus unblinded?

``python -m bench.stress.study_kills [COUNT]`` (500 by default). A process runs sessions of a study
with a participant who answers at once, and is killed with SIGKILL at a random moment; the next one
goes on. What it rendered, asked and recorded is told to this process as it happens, and compared
with the files.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from asperity.core.errors import ParameterError
from asperity.studies.live.player import LoopPlayer, Stimuli
from asperity.studies.live.screens import GO_ON, Terminal, View
from asperity.studies.live.trial_session import StudySession
from asperity.studies.study_file import Study, load_study
from asperity.studies.study_store import (
    ANSWERS_FILE,
    Participant,
    list_participants,
    read_trials,
    write_study,
)

COUNT = 500
LONGEST = 0.2  # [s] until a kill
STIFFNESSES = (50.12345, 75.12345, 100.12345)  # more digits than times have
STUDY = f"""
[study]
kind = "comparison"
question = "Which one is rougher?"
interval = "1 ms"
[vary]
"surface.stiffness" = {[f"{one} N/m" for one in STIFFNESSES]}
"surface.law" = ["C", "D"]
[texture]
kind = "sinusoid"
amplitude = "0.1 mm"
period = "2 mm"
[device]
id = "touch"
"""
_SECRETS = (b"surface", b"stiffness", b"law", *(str(one).encode() for one in STIFFNESSES))


class _Player(LoopPlayer):
    """A player that tells what it renders; a stimulus above its limit is refused as in a loop."""

    def __init__(self, stimuli: Stimuli, line: Connection) -> None:
        self._stimuli, self._line = stimuli, line

    def start(self) -> None:
        """Start nothing."""

    def stop(self) -> None:
        """Stop nothing."""

    def begin_trial(self, path: Path, trial: int, metadata: Mapping[str, Any]) -> None:
        """Write a file in place of a recording, and tell the trial."""
        path.write_text(f"{dict(metadata)}")
        self._line.send(("asked", trial))

    def render(self, values: Mapping[str, Any] | None, _interval: int) -> None:
        """Tell the stiffness, after the check."""
        if values is not None:
            surface = self._stimuli.setup(values).rendered
            self._line.send(("rendered", (surface.law.letter, surface.stiffness)))

    def elapsed(self) -> float:
        """Return more than any interval."""
        return 1.0

    def end_trial(self, _answer: float, _response_time: float) -> None:
        """End nothing."""


class _Screen(Terminal):
    """A participant who answers at once."""

    def __init__(self) -> None:
        self._view = View("")

    def show(self, view: View) -> None:
        """Look at a view."""
        self._view = view

    def read_key(self, _timeout: float) -> str | None:
        """Return the first key of the view; before the answer of a trial, an arbitrary one."""
        keys = [key for key, _ in self._view.keys]
        return random.choice(keys[:2]) if "1" in keys else GO_ON


class _ToldParticipant(Participant):
    """A participant who tells that an answer is recorded."""

    line: Connection

    def record(self, answer: str, response_time: float, started: str) -> None:
        """Record an answer, then tell it."""
        number = self.trial
        super().record(answer, response_time, started)
        self.line.send(("recorded", (number, answer)))


def _run(folder: Path, study: Study, stimuli: Stimuli, code: str, line: Connection) -> None:
    """Run a session until killed; tell if the participant is done, now or since before."""
    try:
        is_known = code in list_participants(folder)
        with _ToldParticipant(folder, study, code, resume=is_known) as person:
            person.line = line
            StudySession(person, _Player(stimuli, line), _Screen()).run()
    except ParameterError as error:
        if "has answered all" not in str(error):
            raise
    line.send(("done", 0))
    time.sleep(60.0)


@dataclass
class KillOutcome:
    """What kills did.

    Attributes:
        kills: number of kills.
        answers: number of recorded answers.
        wrong: what must not be, in words.
        limits: greatest stiffness that was rendered by law [N/m].
    """

    kills: int = 0
    answers: int = 0
    wrong: Counter[str] = field(default_factory=Counter)
    limits: dict[str, float] = field(default_factory=dict)


def run_kills(count: int, folder: Path, seed: int = 1) -> KillOutcome:
    """Kill sessions, and return what was wrong.

    Args:
        count: number of kills.
        folder: an empty folder.
        seed: of the moments.
    """
    path = folder / "study.toml"
    path.write_text(STUDY)
    study, outcome, moments = load_study(path), KillOutcome(), random.Random(seed)
    stimuli, data = Stimuli(study), folder / "data"
    stimuli.check_all()
    write_study(data, study)
    told: dict[str, dict[int, str]] = {}
    number = 1
    while outcome.kills < count:
        code = f"P{number:03d}"
        answers = told.setdefault(code, {})
        if _kill_once(data, study, stimuli, code, moments, answers, outcome):
            number += 1
    _compare_files(data, told, outcome)
    return outcome


def _kill_once(
    folder: Path, study: Study, stimuli: Stimuli, code: str, moments: random.Random,
    answers: dict[int, str], outcome: KillOutcome,
) -> bool:  # fmt: skip
    """Kill one session; return whether its participant was done."""
    mine, theirs = get_context("fork").Pipe()
    child = get_context("fork").Process(target=_run, args=(folder, study, stimuli, code, theirs))
    child.start()
    theirs.close()
    time.sleep(moments.uniform(0.0, LONGEST))
    os.kill(child.pid or 0, signal.SIGKILL)
    child.join()
    outcome.kills += 1
    if child.exitcode != -signal.SIGKILL:
        outcome.wrong["session failed"] += 1
    is_done = False
    try:
        while True:
            kind, content = mine.recv()
            is_done |= _note(kind, content, answers, outcome)
    except (EOFError, OSError):
        mine.close()
    return is_done


def _note(kind: str, content: Any, answers: dict[int, str], outcome: KillOutcome) -> bool:
    if kind == "asked" and content in answers:
        outcome.wrong["asked twice"] += 1
    elif kind == "recorded":
        answers[content[0]] = content[1]
    elif kind == "rendered":
        law, stiffness = content
        outcome.limits[law] = max(stiffness, outcome.limits.get(law, 0.0))
    return kind == "done"


def _compare_files(folder: Path, told: dict[str, dict[int, str]], outcome: KillOutcome) -> None:
    """Compare the files with what was told, and look for what must not be in them."""
    found: dict[str, dict[int, str]] = {code: {} for code in told}
    for record in read_trials(folder):
        found[record.participant][record.trial] = record.answer
        outcome.answers += 1
    for code, answers in told.items():
        lost = answers.items() - found[code].items()
        outcome.wrong["answer lost"] += len(lost)
        for path in (folder / code).rglob("*"):
            text = str(path.relative_to(folder)).encode()
            lines = [text, *(path.read_bytes().splitlines() if path.is_file() else ())]
            shown = sum(any(secret in line for secret in _SECRETS) for line in lines)
            outcome.wrong["unblinded line"] += shown
        if not (folder / code / ANSWERS_FILE).exists() and answers:
            outcome.wrong["file lost"] += 1


def main() -> None:
    """Kill sessions, and print what was wrong; exit with 1 if anything was."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    with tempfile.TemporaryDirectory() as folder:
        outcome = run_kills(count, Path(folder))
    wrong = {what: times for what, times in outcome.wrong.items() if times}
    print(f"{outcome.kills} kills, {outcome.answers} answers, wrong: {wrong or 'nothing'}")
    print(f"greatest stiffness by law: {outcome.limits}")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()

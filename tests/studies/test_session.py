"""A session: order of a trial, breaks, pauses, the stop, numbers and adjustments."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.studies.study_texts import (
    COMPARISON,
    ONSET,
    RATING,
    FakePlayer,
    ScriptedScreen,
    answer_with,
    make_study,
)

from asperity.core.errors import ParameterError
from asperity.studies.live.screens import DOWN, GO_ON, PAUSE, STOP, UP, View
from asperity.studies.live.trial_session import ADJUSTMENT_STEPS, SessionStopped, StudySession
from asperity.studies.study_store import Participant, TrialRecord, read_trials, write_study


def run(
    folder: Path, text: str, press: Callable[[View, int], str | None], *, resume: bool = False
) -> tuple[FakePlayer, ScriptedScreen, list[TrialRecord]]:
    study = make_study(folder, text)
    write_study(folder / "data", study)
    player, screen = FakePlayer(), ScriptedScreen(press)
    with Participant(folder / "data", study, "P01", resume=resume) as person:
        StudySession(person, player, screen).run()
    return player, screen, read_trials(folder / "data")


def test_a_trial_has_its_intervals_then_the_wall_and_the_question(tmp_path: Path) -> None:
    player, screen, trials = run(tmp_path, COMPARISON, answer_with("2"))
    first, second = map(dict, trials[0].presentation.intervals)
    assert player.calls[:7] == [
        "stop", "start", ("begin", 1), ("render", first, 1), ("render", second, 2),
        ("render", None, 0), ("end", 2.0),
    ]  # fmt: skip
    assert player.calls[-1] == "stop"
    assert [trial.answer for trial in trials] == ["2"] * len(trials)
    assert [view.title for view in screen.views[:5]] == [
        "Welcome", "One moment", "First", "Second", "Which one is rougher?",
    ]  # fmt: skip
    assert screen.views[-1].title == "The end"


def test_nothing_shown_or_recorded_names_a_stimulus(tmp_path: Path) -> None:
    player, screen, _ = run(tmp_path, COMPARISON, answer_with("1"))
    shown = "".join(f"{view}" for view in screen.views)
    for secret in ("stiffness", "61.5", "83.5", "97.5"):
        assert secret not in f"{shown}{player.metadata}{player.path}"
    assert "-".join(player.metadata["codes"]) in player.path.name


def test_breaks_release_the_force(tmp_path: Path) -> None:
    text = COMPARISON.replace("interval", "break_every = 2\ninterval")
    player, screen, trials = run(tmp_path, text, answer_with("1"))
    breaks = sum(view.title == "A break" for view in screen.views)
    assert breaks == (len(trials) - 1) // 2 == 1
    assert player.calls.count("start") == 2
    at = player.calls.index(("end", 1.0), player.calls.index(("begin", 2)))
    assert player.calls[at + 1 : at + 3] == ["stop", "start"]


def test_a_pause_presents_the_trial_again(tmp_path: Path) -> None:
    paused: list[int] = []

    def press(view: View, count: int) -> str | None:
        if view.title == "Second" and not paused:
            paused.append(count)
            return PAUSE
        return answer_with("1")(view, count)

    player, screen, trials = run(tmp_path, COMPARISON, press)
    assert [call for call in player.calls if call == ("begin", 1)] == [("begin", 1)] * 2
    assert screen.views[paused[0]].title == "Pause"
    assert [trial.trial for trial in trials] == [1, 2, 3]


def test_a_stopped_session_goes_on_where_it_stopped(tmp_path: Path) -> None:
    def press(view: View, count: int) -> str | None:
        return STOP if view.title == "Second" and count > 5 else answer_with("1")(view, count)

    with pytest.raises(SessionStopped):
        run(tmp_path, COMPARISON, press)
    assert len(read_trials(tmp_path / "data")) == 1
    player, _, trials = run(tmp_path, COMPARISON, answer_with("2"), resume=True)
    assert ("begin", 1) not in player.calls
    assert [(one.run, one.trial, one.answer) for one in trials] == [
        (1, 1, "1"), (2, 2, "2"), (2, 3, "2"),
    ]  # fmt: skip


def test_an_answer_is_kept_if_the_loop_ends_after_it(tmp_path: Path) -> None:
    class EndingPlayer(FakePlayer):
        def end_trial(self, answer: float, response_time: float) -> None:
            super().end_trial(answer, response_time)
            raise ParameterError("driver", "has ended")

    study, player = make_study(tmp_path, COMPARISON), EndingPlayer()
    write_study(tmp_path / "data", study)
    with (
        Participant(tmp_path / "data", study, "P01") as person,
        pytest.raises(ParameterError, match="driver has ended"),
    ):
        StudySession(person, player, ScriptedScreen(answer_with("2"))).run()
    assert [trial.answer for trial in read_trials(tmp_path / "data")] == ["2"]
    assert player.calls[-1] == "stop"


def test_a_number_is_typed_corrected_and_confirmed(tmp_path: Path) -> None:
    typed = iter("4 BackspaceX 1 2 . 5 Enter".replace("BackspaceX", "Backspace").split() * 99)

    def press(view: View, count: int) -> str | None:
        return next(typed) if view.typed else answer_with("")(view, count)

    _, screen, trials = run(tmp_path, RATING, press)
    assert {trial.answer for trial in trials} == {"12.5"}
    assert {"_", "4", "1", "12", "12.", "12.5"} == {view.typed for view in screen.views} - {""}


def test_what_is_no_number_is_not_accepted(tmp_path: Path) -> None:
    typed = iter(["Enter", "-", "Enter", "Backspace", "7", "Enter"] * 99)

    def press(view: View, count: int) -> str | None:
        return next(typed) if view.typed else answer_with("")(view, count)

    _, screen, trials = run(tmp_path, RATING, press)
    assert {trial.answer for trial in trials} == {"7"}
    notes = sum(view.text.startswith("This is not such a number") for view in screen.views)
    assert notes == 2 * len(trials)


def test_an_adjustment_stays_within_its_range(tmp_path: Path) -> None:
    keys = iter([UP, UP, DOWN, GO_ON, *[DOWN] * 60, GO_ON, *[UP] * 60] + [GO_ON] * 99)

    def press(view: View, count: int) -> str | None:
        return next(keys) if UP in dict(view.keys) else answer_with("")(view, count)

    player, _, trials = run(tmp_path, ONSET, press)
    rendered = [call[1] for call in player.calls if call[0] == "render"]
    levels = {values["surface.stiffness"] for values in rendered}
    assert min(levels) >= 20.0
    assert max(levels) == 80.0
    start = trials[0].presentation.intervals[0]["surface.stiffness"]
    steps = np.geomspace(20.0, 80.0, ADJUSTMENT_STEPS + 1).tolist()
    at = min(range(len(steps)), key=lambda i: abs(steps[i] - start))
    wanted = at
    for key in (1, 1, -1):
        wanted = min(max(wanted + key, 0), len(steps) - 1)
    assert float(trials[0].answer) == steps[wanted]
    assert float(trials[1].answer) == 20.0

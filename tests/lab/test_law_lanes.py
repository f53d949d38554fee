"""Two laws side by side without a browser: each renders its own force, both under one hand."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.lab.client import STILL, column, frames, head, heard, joined, news, refused, say, taken
from tests.lab.started import Started
from websockets.sync.client import ClientConnection

from asperity.core.checks import FloatArray
from asperity.kernels.tick import quantize
from asperity.lab.law_lanes import LawLane
from asperity.lab.scene_state import make_scene_state
from asperity.scene import load_scene

COMMON = ("texture", "stiffness", "max_depth", "device", "delay", "hand_stiffness")
BEGIN = {"law": "A", "stiffness": 250.0, "beside": "H"}


def beside(first: str, second: str, **wanted: Any) -> Callable[[Any], bool]:
    """Return what knows the message that both loops run with these laws."""

    def fits(message: Any) -> bool:
        if not news(state="running", law=first, **wanted)(message):
            return False
        other, own = message["beside"]["settings"], message["settings"]
        is_followed = all(other[name] == own[name] for name in COMMON)
        return message["beside"]["state"] == "running" and other["law"] == second and is_followed

    return fits


def lane(number: int, **least: float) -> Callable[[Any], bool]:
    """Return what knows a frame of a lane, with the whole force, and columns of some size."""

    def fits(message: Any) -> bool:
        return (
            frames(message)
            and head(message, "lane") == number
            and column(message, "minima", "share") == 1.0
            and all(column(message, "newest", name) > value for name, value in least.items())
        )

    return fits


@pytest.fixture
def page(lab: Started) -> Iterator[ClientConnection]:
    """A page that steers, with law A and law H beside it.

    They stay for the next test: each start of a loop is that of a process.
    """
    with joined(lab) as line:
        said = heard(line, lambda m: news(control_available=True)(m) or news(has_control=True)(m))
        if not said["has_control"]:
            say(line, "take_control")
            heard(line, news(has_control=True))
        if not beside("A", "H", stiffness=250.0)(current(line, news(state="running"))):
            say(line, "change", changes=BEGIN)
            heard(line, beside("A", "H", stiffness=250.0))
        yield line
        say(line, "steer", target=[0, 0, 1e-3], **STILL)


def alone(law: str) -> Callable[[Any], bool]:
    """Return what knows the message that one law alone runs."""

    def fits(message: Any) -> bool:
        is_known = news(state="running", law=law)(message)
        return is_known and message["beside"]["state"] == "stopped"

    return fits


def current(page: ClientConnection, wanted: Callable[[Any], bool]) -> Any:
    """Return the message that things stand in some way, which is asked for."""
    say(page, "change", changes={})
    return heard(page, wanted)


def vector(frame: Any, prefix: str = "") -> FloatArray:
    return np.array([column(frame, "newest", f"{prefix}{axis}") for axis in "xyz"])


def law_force(status: dict[str, Any], law: str, frame: Any) -> FloatArray:
    """Return the force of a law at the position of a frame, as the encoders read it."""
    settings = status["settings"]
    state = make_scene_state(load_scene(settings["texture"])).with_changes(
        {"law": law, "stiffness": settings["stiffness"], "device": settings["device"]}
    )
    step = status["position_resolution"]
    point = np.array([[quantize(value, step) for value in vector(frame)]])
    return state.setup.rendered.force(point)[0]


def test_each_lane_renders_its_own_law_at_the_same_stiffness(page: ClientConnection) -> None:
    say(page, "change", changes={"stiffness": 300.0})
    status = heard(page, beside("A", "H", stiffness=300.0))
    assert status["beside"]["settings"]["stiffness"] == 300.0
    say(page, "steer", target=[0.3e-3, 0, -5e-4], **STILL)
    for number, law, other in ((0, "A", "H"), (1, "H", "A")):
        frame = heard(page, lane(number, **{"commanded z": 0.05}))
        force = vector(frame, "commanded ")
        assert force == pytest.approx(law_force(status, law, frame), abs=1e-9)
        # The other law's force at this very place is another.
        assert np.abs(force - law_force(status, other, frame)).max() > 1e-2


def test_both_follow_one_hand_in_one_time(page: ClientConnection) -> None:
    say(page, "steer", target=[0, 0, 2e-3], cosine=[0, 0, 0], sine=[4e-3, 0, 0], speed=6.0)
    tracks: tuple[list[Any], list[Any]] = ([], [])
    while len(tracks[1]) < 300:
        message = taken(page)
        if frames(message):
            tracks[int(head(message, "lane"))].append(message)
    first, second = (
        [[column(m, "newest", name) for name in ("time", "x")] for m in part] for part in tracks
    )
    times, places = np.array(first).T
    later, others = np.array(second)[100:].T
    # In the air nothing but the hand moves the probes: equal places at equal times, to some ms.
    error = np.abs(np.interp(later, times, places) - others).max()
    assert np.ptp(others) > 2e-3
    assert error < 4e-3 * 6.0 * 0.02
    assert np.abs(np.interp(later + 0.2, times, places) - others).max() > 5.0 * error


def test_changes_of_either_law_and_of_what_is_common(page: ClientConnection) -> None:
    starts = current(page, beside("A", "H"))["start_count"]
    for changes, first, second, wanted in (
        ({"beside": "F"}, "A", "F", {}),
        ({"law": "H"}, "H", "F", {}),
        ({"beside": "H"}, "H", "H", {}),
        ({"stiffness": 200.0}, "H", "H", {"stiffness": 200.0}),
        ({"texture": "sinusoid:amplitude=0.1mm,period=3mm"}, "H", "H", {"start_count": starts}),
        ({"device": "omega.3"}, "H", "H", {"device": "omega.3", "start_count": starts + 1}),
        ({"delay": 2, "law": "C"}, "C", "H", {"delay": 2}),
    ):
        say(page, "change", changes=changes)
        status = heard(page, beside(first, second, **wanted))
        assert status["settings"]["beside"] == second
        number = heard(page, lane(1))
        assert head(heard(page, lane(1)), "first") > head(number, "first")
    defaults = {"texture": "sinusoid:amplitude=0.2mm,period=2mm", "delay": 0}
    say(page, "change", changes={**defaults, "device": "touch-x"})
    heard(page, beside("C", "H", device="touch-x", delay=0))


def test_a_law_that_is_none_is_refused_and_both_go_on(page: ClientConnection) -> None:
    say(page, "change", changes={"beside": "Q"})
    assert "law" in heard(page, refused)["message"]
    number = head(heard(page, lane(1)), "first")
    heard(page, lambda m: lane(1)(m) and head(m, "first") > number)


def test_another_page_sees_both_and_cannot_choose(page: ClientConnection, lab: Started) -> None:
    assert current(page, beside("A", "H"))["has_control"]
    with joined(lab) as other:
        assert heard(other, news())["settings"]["beside"] == "H"
        heard(other, lane(1))
        say(other, "change", changes={"beside": ""})
        assert "steering" in heard(other, refused)["message"]
        heard(other, lane(1))


def loops_of(lab: Started) -> set[int]:
    """Return the processes of the loops: those below the lab's that hold the hand's memory."""
    found = set()
    for place in Path(f"/proc/{lab.process.pid}/task").iterdir():
        for number in (place / "children").read_text().split():
            with suppress(FileNotFoundError, ProcessLookupError):  # it has just ended
                if "/asperity-" in Path(f"/proc/{number}/maps").read_text():
                    found.add(int(number))
    return found


def test_a_loop_that_dies_is_said_and_the_other_goes_on(
    page: ClientConnection, lab: Started
) -> None:
    both = loops_of(lab)
    say(page, "change", changes={"beside": ""})
    heard(page, alone("A"))
    (first,) = loops_of(lab)
    assert first in both
    assert len(both) == 2
    say(page, "change", changes={"beside": "H"})
    heard(page, beside("A", "H"))
    (second,) = loops_of(lab) - {first}
    os.kill(second, signal.SIGKILL)
    told = heard(page, lambda m: news()(m) and m["beside"]["state"] == "stopped")
    assert "ended" in told["beside"]["message"]
    number = head(heard(page, lane(0)), "first")
    heard(page, lambda m: lane(0)(m) and head(m, "first") > number)
    # Any change starts it again; so does a loop of the first lane that is started again.
    say(page, "change", changes={"stiffness": 260.0})
    count = heard(page, beside("A", "H", stiffness=260.0))["start_count"]
    os.kill(first, signal.SIGKILL)
    heard(page, news(state="stopped"))
    say(page, "start")
    heard(page, beside("A", "H", start_count=count + 1))
    heard(page, lane(1))


def test_pictures_of_the_law_before_are_never_said_to_be_current() -> None:
    """Between a change of the session and the request of its pictures."""
    state = make_scene_state(load_scene("sinusoid:amplitude=0.2mm,period=2mm"))
    session: Any = SimpleNamespace(
        state="running", message="", start_count=1, scene_state=state.with_changes({"law": "W"})
    )
    shown = session.scene_state.setup.rendered
    pictures: Any = SimpleNamespace(
        limit={"stiffness": 400.0},
        version=1,
        message="",
        is_current=True,
        shows=lambda surface: surface is shown,
    )
    lane_of_w = LawLane(session, pictures)
    assert lane_of_w.status["pictures_current"]
    assert lane_of_w.status["limit"]
    session.scene_state = state.with_changes({"law": "A"})
    assert lane_of_w.status["settings"]["law"] == "A"
    assert not lane_of_w.status["pictures_current"]
    assert not lane_of_w.status["limit"]

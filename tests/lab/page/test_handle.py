"""The page as the window on a handle that somebody holds: here, one that the tests move."""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench.stand_ins.fakes import compile_library
from click.testing import CliRunner
from tests.lab.browser import Browser, needs_browser, until
from tests.lab.client import STILL, column, frames, head, heard, joined, news, refused, say
from tests.lab.started import Started

from asperity.cli.main import cli
from asperity.core.errors import AsperityError
from asperity.lab.scene_state import make_device_scene_state
from asperity.lab.server import STEERING_TIMEOUT
from asperity.lab.session import Session, make_handle
from asperity.scene import load_scene
from asperity.scene.setup import make_setup
from asperity.servo.drivers.library import LibraryDriver

SOURCE = Path(__file__).parents[3] / "bench" / "stand_ins" / "c" / "mapped_device.c"
# A busy machine is late, and that is not what is tested here.
SCENE = """
[texture]
kind = "sinusoid"
amplitude = "0.1 mm"
period = "2 mm"
[surface]
law = "C"
stiffness = "150 N/m"
[device]
id = "touch"
[servo]
lateness = "60 s"
silence = "30 s"
"""
LIBRARY = "mapped_device.so"
ABOVE, PRESSED = (3e-4, 1e-4, 2e-3), (3e-4, 1e-4, -8e-4)


class Device:
    """What the compiled device reads and writes."""

    def __init__(self, path: Path) -> None:
        path.write_bytes(bytes(64))
        self._map = np.memmap(path, np.float64, "r+")
        self.go(ABOVE)

    def go(self, place: tuple[float, ...]) -> None:
        self._map[:3] = place

    def fail(self, code: int) -> None:
        self._map[6] = code

    @property
    def force(self) -> np.ndarray:
        return np.array(self._map[3:6])

    @property
    def open(self) -> bool:
        return bool(self._map[7])

    @property
    def pushes(self) -> bool:
        return float(self.force[2]) > 0.05

    def lets_go(self) -> None:
        """Wait until there is no force and the device is closed."""
        until(lambda: not self.force.any() and not self.open)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("handle")
    (made / "scene.toml").write_text(SCENE)
    compile_library(SOURCE, made)
    return made


@pytest.fixture(scope="module")
def device(folder: Path) -> Device:
    return Device(folder / "map")


@pytest.fixture(scope="module")
def held(folder: Path, device: Device) -> Iterator[Started]:
    """A lab on that device."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MAPPED_DEVICE", str(folder / "map"))
        started = Started(str(folder / "scene.toml"), "--driver", str(folder / LIBRARY))
    yield started
    code, said = started.end()
    assert code == 0, said
    device.lets_go()


@pytest.fixture
def page(held: Started, device: Device) -> Iterator[Any]:
    """A page that steers; the loop has stopped, and the handle is in the air."""
    device.fail(0)
    device.go(ABOVE)
    with joined(held) as line:
        said = heard(line, lambda m: news(control_available=True)(m) or news(has_control=True)(m))
        if not said["has_control"]:
            say(line, "take_control")
            said = heard(line, news(has_control=True))
        if said["state"] != "stopped":
            say(line, "stop")
            heard(line, news(state="stopped"))
        yield line


def knows_nearest(message: Any) -> bool:
    return frames(message) and bool(np.isfinite(head(message, "closest z")))


def begin(page: Any, device: Device) -> dict[str, Any]:
    """Start the loop, and press."""
    say(page, "start")
    said: dict[str, Any] = heard(page, news(state="running"))
    device.go(PRESSED)
    heard(page, lambda m: frames(m) and column(m, "newest", "share") == 1.0 and device.pushes)
    return said


def test_nothing_moves_before_somebody_starts_it(page: Any, held: Started, device: Device) -> None:
    with joined(held) as watcher:
        first = heard(watcher, news(state="stopped"))
        assert first["handle"]["driver"] == "own"
        assert "You hold the handle of 3D Systems Touch" in first["handle"]["motion_source"]
        assert not device.open
        # Who only watches can neither start nor end it.
        for what in ("start", "stop"):
            say(watcher, what)
            assert "steering" in heard(watcher, refused)["message"]
        starts = begin(page, device)["start_count"]
        say(watcher, "stop")
        assert "steering" in heard(watcher, refused)["message"]
        # The nearest point is known once another process has compiled it. Who steers must be
        # heard from meanwhile, or the loop ends.
        heard(page, knows_nearest)
        frame = heard(watcher, knows_nearest)
        assert starts == first["start_count"] + 1
    assert device.pushes
    # The frames are those of the real loop; nobody knows where the hand is pulled to.
    assert column(frame, "newest", "z") == PRESSED[2]
    assert column(frame, "newest", "applied z") == pytest.approx(device.force[2], rel=1e-9)
    assert np.isnan([head(frame, f"hand {axis}") for axis in "xyz"]).all()


def test_the_pointer_moves_nothing_and_the_device_stays(page: Any, device: Device) -> None:
    settings = begin(page, device)["settings"]
    say(page, "steer", target=[0, 0, 0], **STILL)
    assert "done by the user of the handle" in heard(page, refused)["message"]
    for changes in (
        {"device": "omega.3"},
        {"delay": 3},
        {"hand_stiffness": 100.0},
        {"saved_scene": "tour"},
        {"saved_scene": "previous"},
    ):
        say(page, "change", changes=changes)
        name = next(iter(changes))
        words = f"{name} needs the simulated device" if name == "saved_scene" else f"{name} is "
        told = heard(page, lambda m, w=words: news(state="running")(m) and w in m["message"])
        assert told["settings"] == settings
    assert device.pushes


def test_a_stiffness_above_the_limit_is_refused_and_one_below_is_ramped(
    page: Any, device: Device
) -> None:
    first = begin(page, device)
    say(page, "change", changes={"stiffness": 2000.0})
    told = heard(page, lambda m: news(state="running")(m) and bool(m["message"]))
    assert "2000 N/m is above the limit" in told["message"]
    assert "--accept-risk" in told["message"]
    assert told["settings"]["stiffness"] == 150.0
    before = device.force[2]
    assert before > 0.05
    say(page, "change", changes={"stiffness": 75.0})
    gone = heard(page, lambda m: frames(m) and column(m, "minima", "share") == 0.0)
    assert column(gone, "minima", "applied z") < 0.1 * before
    back = heard(page, lambda m: frames(m) and column(m, "newest", "share") == 1.0)
    assert column(back, "newest", "applied z") == pytest.approx(0.5 * before, rel=1e-6)
    say(page, "change", changes={"stiffness": 150.0})
    assert (
        heard(page, news(state="running", stiffness=150.0))["start_count"] == first["start_count"]
    )


def test_the_force_is_let_go_by_a_ramp(page: Any, device: Device) -> None:
    begin(page, device)
    before, then = device.force[2], time.monotonic()
    say(page, "stop")
    seen = []
    while device.force.any():
        seen.append(device.force[2])
        assert time.monotonic() < then + 20.0
    assert max(seen) <= before
    assert sum(0.1 * before < one < 0.9 * before for one in seen) > 20  # it did not jump
    assert heard(page, news(state="stopped"))["message"] == "the force was released"
    device.lets_go()


def test_a_fault_is_said_and_only_a_start_brings_the_force_again(page: Any, device: Device) -> None:
    starts = begin(page, device)["start_count"]
    device.fail(17)
    told = heard(page, news(state="stopped"))
    assert "mapped_device.so returned 17" in told["message"]
    assert "the force was made zero. Check the device" in told["message"]
    assert "Start, with the handle in the air, ramps the force up again" in told["message"]
    device.lets_go()
    device.fail(0)
    for changes in ({"stiffness": 75.0}, {}):
        say(page, "change", changes=changes)
        after = heard(page, news(state="stopped", stiffness=75.0))
        assert "returned 17" in after["message"]  # what is said stays
        assert (after["start_count"], device.open) == (starts, False)
    # What is a risk is refused before it is started, too.
    say(page, "change", changes={"stiffness": 2000.0})
    risky = heard(page, lambda m: news(state="stopped")(m) and "above the limit" in m["message"])
    assert risky["settings"]["stiffness"] == 75.0
    say(page, "change", changes={"stiffness": 150.0})
    heard(page, news(state="stopped", stiffness=150.0))
    assert begin(page, device)["start_count"] == starts + 1


def test_a_handle_that_is_read_far_away_is_a_fault(page: Any, device: Device) -> None:
    begin(page, device)
    device.go((0.0, 0.0, 9.0))
    assert "Move the handle to its centre" in heard(page, news(state="stopped"))["message"]
    device.lets_go()


@pytest.mark.parametrize("closed", [True, False])
def test_the_force_goes_when_no_page_steers(
    page: Any, held: Started, device: Device, closed: bool
) -> None:
    with joined(held) as watcher:  # who watches does not count
        begin(page, device)
        heard(watcher, news(state="running"))
        then = time.monotonic()
        if closed:
            page.close()
        # Else it is there, but hangs: nothing is painted, nothing said.
        words = "released: no page with control is connected"
        heard(watcher, news(state="stopped", message=words), STEERING_TIMEOUT + 10.0)
        assert time.monotonic() - then > STEERING_TIMEOUT
        device.lets_go()
        with joined(held) as other:  # another page begins nothing
            told = heard(other, news())
            assert (told["state"], device.open) == ("stopped", False)


def test_a_page_that_is_loaded_anew_keeps_the_force(
    page: Any, held: Started, device: Device
) -> None:
    starts = begin(page, device)["start_count"]
    page.close()
    with joined(held) as again:
        heard(again, news(state="running", has_control=True))
        end = time.monotonic() + 1.5 * STEERING_TIMEOUT
        while time.monotonic() < end:
            heard(again, frames)
            assert device.pushes
        say(again, "stop")
        assert heard(again, news(state="stopped"))["start_count"] == starts


@needs_browser
def test_the_page_is_the_window_on_the_device(
    held: Started, device: Device, browser: Browser
) -> None:
    device.fail(0)
    device.go(ABOVE)
    browser.said.clear()
    browser.resize(1280, 900)
    # What an address says moves no handle.
    browser.call("Page.navigate", url=f"{held.address}#stiffness=100&law=W")
    browser.until("globalThis.lab?.status?.state === 'stopped' && lab.hasPictures")
    if not browser.ask("lab.status.has_control"):
        browser.until("!document.getElementById('take-control').hidden")
        browser.ask("document.getElementById('take-control').click()")
    browser.until("lab.status.has_control")
    gone = "['press-depth', 'motion', 'device', 'delay', 'hand_stiffness', 'tour-start', 'release']"
    seen = f"{gone}.filter(id => document.getElementById(id).checkVisibility())"
    assert browser.ask(seen) == []
    assert "You hold the handle" in browser.ask("document.getElementById('handle-note').innerText")
    assert not browser.ask("document.getElementById('start').hidden")
    browser.ask("document.getElementById('start').click()")
    browser.until("lab.status.state === 'running'")
    assert browser.ask("lab.status.settings.stiffness") == 150.0
    device.go(PRESSED)
    browser.until("lab.probeState().force[2] > 0.05 && lab.probeState().isInside")
    assert browser.ask(seen) == ["release"]
    # The pointer presses, keys move the hand and begin the tour: nothing of it is there.
    box = browser.ask("document.getElementById('relief').getBoundingClientRect().toJSON()")
    x, y = box["x"] + 0.4 * box["width"], box["y"] + 0.5 * box["height"]
    browser.mouse("mousePressed", x, y, 1)
    browser.mouse("mouseMoved", x + 50, y, 1)
    browser.mouse("mouseReleased", x + 50, y)
    for key in (" ", "m", "t", "k", "ArrowLeft"):
        browser.press(key)
    browser.ask("new Promise(done => setTimeout(done, 500))")
    assert browser.ask("[lab.hand.requestCount, lab.tour.isActive, lab.status.state]") == [
        0,
        False,
        "running",
    ]
    assert browser.ask("lab.probeState().probe[2]") == PRESSED[2]
    # In the picture: probe and force, and no cross of a hand.
    browser.until("lab.hasCurrentPictures")
    assert browser.ask("lab.toSvg()").count("<svg") == 5
    browser.press("Escape")
    device.lets_go()
    browser.until("lab.status.state === 'stopped' && !document.getElementById('start').hidden")
    device.go(ABOVE)
    browser.ask("document.getElementById('start').click()")
    browser.until("lab.status.state === 'running'")
    device.go(PRESSED)
    browser.until("lab.probeState().force[2] > 0.05")
    device.fail(9)
    browser.until("lab.status.state === 'stopped'")
    device.lets_go()
    words = browser.ask("document.getElementById('alarm').innerText")
    assert "The loop has stopped: mapped_device.so returned 9" in words
    assert "Check the device, its power and its cable" in words
    browser.call("Page.navigate", url="about:blank")
    assert browser.said == []


def test_letting_go_waits_for_no_analysis(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    device = Device(folder / "own")
    monkeypatch.setenv("MAPPED_DEVICE", str(folder / "own"))
    scene = load_scene(str(folder / "scene.toml"))
    still = {"hand": {"kind": "moved"}, "motion": {"kind": "still", "point": [0, 0, 0]}}
    whole = replace(scene, loop={**still, **scene.loop})
    setup = make_setup(whole, surface={"clamp": "backed"})
    handle = make_handle(LibraryDriver(str(folder / LIBRARY)), setup)
    stage = make_device_scene_state(setup, setup.servo, "scene")
    never: Future[str] = Future()
    with Session(stage, lambda: None, None, handle, lambda _surface, _device: never) as session:
        session.start()
        session.release_force("before it began")
        until(lambda: session._requests.empty() and session.state == "stopped")
        assert not session.is_running
        session.start()
        until(lambda: session.state == "running")
        device.go(PRESSED)
        until(lambda: device.pushes)
        session.change({"stiffness": 100.0})
        until(lambda: session.state == "changing")
        then = time.monotonic()
        session.release_force("enough")
        until(lambda: not device.force.any())
        assert time.monotonic() - then < 20.0
        until(lambda: session.state == "stopped")
        assert session.message == "enough"
        assert session.scene_state is stage
    device.lets_go()


def test_a_lab_that_is_ended_lets_the_force_go(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = Device(folder / "other")
    monkeypatch.setenv("MAPPED_DEVICE", str(folder / "other"))
    started = Started(str(folder / "scene.toml"), "--driver", str(folder / LIBRARY))
    with joined(started) as line:
        begin(line, other)
        assert started.end()[0] == 0
    assert not other.force.any()
    assert not other.open


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--stiffness", "2kN/m", "--driver", LIBRARY), "is above the limit"),
        (("--driver", "velvet"), "driver is unknown"),
        (
            ("--device", "pantograph", "--driver", LIBRARY, "--accept-risk"),
            "max_force is not known",
        ),
        (("--driver", "replay:none.mcap"), "none.mcap"),
    ],
)
def test_what_cannot_be_rendered_is_said_before_the_page(
    folder: Path, monkeypatch: pytest.MonkeyPatch, more: tuple[str, ...], words: str
) -> None:
    monkeypatch.chdir(folder)
    monkeypatch.setattr("asperity.lab.access.bind_socket", None)  # no page: nothing listens
    result = CliRunner().invoke(cli, ["lab", "scene.toml", *more])
    assert isinstance(result.exception, AsperityError)
    assert words in str(result.exception)


def test_a_recording_moves_the_handle_and_ends_with_its_rows(folder: Path) -> None:
    scene = folder / "replayed.toml"
    hand = '[hand]\nkind = "spring"\nstiffness = "800 N/m"\ndamping = "5 N*s/m"\nmass = "50 g"\n'
    still = (
        '[motion]\nkind = "still"\npoint = ["0 mm", "0 mm", "-0.3 mm"]\n[run]\nduration = "1.5 s"\n'
    )
    scene.write_text(SCENE + hand + still)
    setup = make_setup(load_scene(str(scene)))
    setup.simulate(trace=str(folder / "run.mcap"))
    started = Started(str(scene), "--law", "W", "--driver", f"replay:{folder / 'run.mcap'}")
    with joined(started) as line:
        assert "A recording moves the handle" in heard(line, news())["handle"]["motion_source"]
        for _ in range(2):
            say(line, "start")
            heard(line, news(state="running", law="W"))
            heard(line, lambda m: frames(m) and column(m, "newest", "inside") == 1.0)
            heard(line, news(state="stopped", message="end of the recording; Start replays it"))
    assert started.end()[0] == 0


def test_a_second_law_beside_is_refused_with_the_reason(page: Any) -> None:
    say(page, "change", changes={"beside": "H"})
    words = heard(page, refused)["message"]
    assert "beside needs the simulated device: one handle has one law" in words

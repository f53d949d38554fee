"""The server without a browser: what it lets in, what it answers, and that the loop goes on."""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
import socket
import time
from contextlib import suppress
from http.client import HTTPConnection
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from click.testing import CliRunner
from tests.lab.client import STILL, column, frames, head, heard, joined, news, refused, say, taken
from tests.lab.started import Started
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed, InvalidStatus

import asperity as asp
from asperity.cli.main import cli
from asperity.lab.access import MAX_MESSAGE_BYTES, page_files
from asperity.lab.background import BackgroundWorker
from asperity.lab.scene_state import (
    DEFAULT_SURFACE,
    START_LAW,
    START_STIFFNESS,
    SceneState,
    make_scene_state,
)
from asperity.lab.server import MAX_PENDING_FRAMES, MIN_FRAME_INTERVAL, LabOptions, LabServer
from asperity.scene import load_scene


def got(lab: Started, path: str, **headers: str) -> tuple[int, bytes, dict[str, str]]:
    line = HTTPConnection(lab.host, timeout=60)
    try:
        line.request("GET", path, headers=headers)
        answer = line.getresponse()
        return answer.status, answer.read(), dict(answer.getheaders())
    finally:
        line.close()


def test_the_page_comes_with_its_token_alone(lab: Started) -> None:
    token = lab.address.split("/")[3]
    status, content, headers = got(lab, f"/{token}/")
    assert (status, content) == (200, page_files()["index.html"][1])
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert got(lab, f"/{token}/lab.js")[0] == 200
    for path in ("/", "/lab.js", "/wrong/", f"/{token}x/"):
        assert got(lab, path)[0] == 403
    assert got(lab, f"/{token}/", Host="evil.example")[0] == 403
    for path in ("../server.py", "%2e%2e/server.py", "/etc/passwd", "nothing"):
        assert got(lab, f"/{token}/{path}")[0] == 404


def test_a_page_of_somebody_else_gets_no_live_connection(lab: Started) -> None:
    for origin in ("http://evil.example", "null", None):
        with pytest.raises(InvalidStatus, match="403"):
            joined(lab, origin=origin)


def test_it_listens_on_the_loopback_interface_alone(lab: Started) -> None:
    port = int(lab.host.split(":")[1])
    with socket.socket() as other:  # 127.0.0.2 is this machine, too, on another address
        other.settimeout(5)
        assert other.connect_ex(("127.0.0.2", port)) != 0


def test_a_page_that_wishes_at_every_frame_gets_no_more_of_them(lab: Started) -> None:
    """A wish is followed by a frame at once, but frames are 5 ms apart."""
    with joined(lab) as page:
        heard(page, frames)
        begun, count = time.monotonic(), 0
        while time.monotonic() < begun + 1.0:
            if frames(taken(page)):
                count += 1
                say(page, "steer", target=[0.0, 0.0, 1e-3], **STILL)
        assert 20 < count / (time.monotonic() - begun) <= 1.02 / MIN_FRAME_INTERVAL


def test_the_hand_is_steered_the_law_changes_and_the_loop_goes_on(lab: Started) -> None:
    with joined(lab) as page:
        first = heard(page, news(state="running"))
        assert first["has_control"]
        wish = first["request_count"] + 1
        say(page, "steer", target=[1e-3, 0, -1e-3], **STILL)
        frame = heard(page, lambda m: frames(m) and column(m, "newest", "applied z") > 0.1)
        assert head(frame, "acknowledged") == wish
        assert column(frame, "maxima", "applied z") <= first["max_force"]
        say(page, "change", changes={"law": "W", "stiffness": 200.0})
        changed = heard(page, news(state="running", law="W"))
        assert changed["settings"]["stiffness"] == 200.0
        assert changed["start_count"] == first["start_count"]
        heard(page, lambda m: frames(m) and column(m, "newest", "share") == 1.0)
        for changes in (
            {"stiffness": 1e9},
            {"colour": "red"},
            {"law": "Q"},
            {"texture": "/etc/x"},
            {"device": "x.toml"},
            {"delay": -1},
        ):
            say(page, "change", changes=changes)
            told = heard(page, lambda m: news(state="running")(m) and bool(m["message"]))
            assert next(iter(changes)) in told["message"]
            assert told["settings"] == changed["settings"]
        say(page, "steer", target=[9, 0, 0], **STILL)
        assert "target" in heard(page, refused)["message"]


def test_one_page_steers_and_others_watch(lab: Started) -> None:
    with joined(lab) as first:
        heard(first, news(has_control=True))
        with joined(lab) as second:
            assert heard(second, news())["has_control"] is False
            heard(second, frames)
            for what, content in (
                ("steer", {"target": [0, 0, 0], **STILL}),
                ("take_control", {}),
                ("change", {"changes": {"law": "A"}}),
            ):
                say(second, what, **content)
                assert "steering" in heard(second, refused)["message"]
            first.close()
            heard(second, news(control_available=True))
            say(second, "take_control")
            heard(second, news(has_control=True))


class SlowConnection:
    """A connection whose page receives nothing of a kind, and closes when it is let go."""

    def __init__(self, blocked: str = "") -> None:
        self.blocked = blocked
        self.closed = asyncio.Event()
        self.received: list[dict[str, Any]] = []

    async def send(self, content: str) -> None:
        message = json.loads(content)
        if message["type"] == self.blocked:
            await self.closed.wait()
            raise ConnectionClosed(None, None)
        self.received.append(message)

    def __aiter__(self) -> SlowConnection:
        return self

    async def __anext__(self) -> str:
        await self.closed.wait()
        raise StopAsyncIteration


def test_a_page_that_receives_nothing_delays_no_state_of_others() -> None:
    async def scenario() -> list[bool]:
        workers = [cast(BackgroundWorker, None)] * 3
        lab = LabServer(make_scene_state(load_scene(DEFAULT_SURFACE)), workers, LabOptions())
        stuck, open_page = SlowConnection("status"), SlowConnection()
        tasks = []
        for page in (stuck, open_page):
            tasks.append(asyncio.create_task(lab.serve_client(cast(ServerConnection, page))))
            await asyncio.sleep(0.05)
        assert open_page.received[-1]["control_available"] is False
        stuck.closed.set()
        await asyncio.sleep(0.05)
        open_page.closed.set()
        await asyncio.gather(*tasks)
        return [one["control_available"] for one in open_page.received if one["type"] == "status"]

    # No state that is older follows a newer one.
    assert asyncio.run(scenario()) == [False, True]


@pytest.mark.parametrize(
    ("content", "code"),
    [
        ("{}", 1008),
        (b"\x00\xff", 1008),
        ('{"type": "steer"}', 1008),
        ('{"type": "acknowledge", "frame": 1e9}', 1008),
        ('{"type": "take_control"}' + " " * MAX_MESSAGE_BYTES, 1009),
    ],
)
def test_a_malformed_frame_ends_the_connection_and_not_the_loop(
    lab: Started, content: str | bytes, code: int
) -> None:
    with joined(lab) as page:
        before = heard(page, frames)
        page.send(content)
        with pytest.raises(ConnectionClosed) as ended:
            heard(page, lambda _message: False)
    assert ended.value.rcvd is not None
    assert ended.value.rcvd.code == code
    assert ended.value.rcvd.reason
    with joined(lab) as again:
        assert head(heard(again, frames), "first") > head(before, "first")


def test_a_page_that_paints_nothing_is_not_sent_what_will_be_old(lab: Started) -> None:
    with joined(lab) as page:
        heard(page, news(state="running"))
        got = []
        with suppress(TimeoutError):
            while True:
                content = page.recv(timeout=1.0)
                got += [np.frombuffer(content)] if isinstance(content, bytes) else []
        assert [head(frame, "frame") for frame in got] == list(range(1, MAX_PENDING_FRAMES + 1))
        say(page, "acknowledge", frame=MAX_PENDING_FRAMES)
        # The next one is new, and holds the extremes of all that happened in between.
        after = np.frombuffer(page.recv(timeout=60))
        assert head(after, "first") == head(got[-1], "first") + head(got[-1], "rows")
        assert head(after, "rows") > 900


def test_pictures_are_computed_elsewhere(lab: Started) -> None:
    with joined(lab) as page:
        version = heard(page, lambda m: news(state="running")(m) and m["surface_version"] > 0)[
            "surface_version"
        ]
        assert version >= 1
        say(page, "relief", x=0.0, y=0.0, size=0.008)
        relief = heard(page, lambda m: isinstance(m, np.ndarray) and m[0] == 2.0)
        heights = relief[5:].reshape(int(relief[1]), -1)
        along = np.linspace(-4e-3, 4e-3, len(heights))
        assert np.abs(heights[3] - 2e-4 * np.sin(2.0 * np.pi * along / 2e-3)).max() < 1e-12
        say(page, "section", box=[-1e-3, 1e-3, -1e-3, 1e-3], y=0.0)
        cut = heard(page, lambda m: isinstance(m, np.ndarray) and m[0] == 3.0)
        line, across, deep = map(int, cut[1:4])
        assert len(cut) == 9 + line + 3 * across * deep
        above = cut[9 + line :].reshape(3, deep, across)[:, -1]
        assert (above == 0.0).all()


def niced(lab: Started) -> list[int]:
    """Return the processes that make pictures and limits: they stand back behind the loop."""
    least = os.getpriority(os.PRIO_PROCESS, lab.process.pid)
    return [one for one in lab.children() if os.getpriority(os.PRIO_PROCESS, one) > least]


def test_pictures_come_again_when_their_process_was_killed(lab: Started) -> None:
    look = {"x": 0.0, "y": 0.0, "size": 0.008}
    with joined(lab) as page:
        first = heard(
            page, lambda m: news(state="running")(m) and m["surface_version"] > 0 and m["limit"]
        )
        for one in niced(lab):
            os.kill(one, signal.SIGKILL)
        say(page, "relief", **look)
        notices: dict[str, str] = {}  # in either order

        def note(message: Any) -> bool:
            if news()(message) and message["picture_message"]:
                notices["status"] = message["picture_message"]
            elif isinstance(message, dict) and message["type"] == "picture_unavailable":
                notices["unavailable"] = message["kind"]
            return len(notices) == 2

        heard(page, note)
        assert "has crashed and is restarted" in notices["status"]
        assert notices["unavailable"] == "relief"
        told = heard(
            page,
            lambda m: (
                news(picture_message="")(m) and m["surface_version"] > first["surface_version"]
            ),
        )
        assert (told["state"], told["start_count"]) == ("running", first["start_count"])
        say(page, "relief", **look)
        assert heard(page, lambda m: isinstance(m, np.ndarray) and m[0] == 2.0).max() > 1e-4


def test_the_next_port_is_named(lab: Started) -> None:
    port = lab.host.split(":")[1]
    result = CliRunner().invoke(cli, ["lab", "--port", port])
    assert re.search(rf"port {port} is not available; \d+ is free", str(result.exception))


UNKNOWN = 'id = "unknown"\napparent_mass = "60 g"\n'


def test_a_lab_starts_with_what_compare_recommends() -> None:
    row = asp.compare(DEFAULT_SURFACE, "omega.3").recommended_row
    assert row is not None
    lab = Started("--port", "0")
    try:
        with joined(lab) as page:
            settings = heard(page, news(state="running"))["settings"]
    finally:
        lab.close()
    assert initial(settings) == ("omega.3", row.law.letter, row.recommended_stiffness)


def test_a_lab_starts_with_the_stiffness_that_holds_with_its_clamp(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    row, free = (
        asp.compare(DEFAULT_SURFACE, "omega.3", "G", clamp=clamp).rows[0]
        for clamp in ("backed", "none")
    )
    assert row.recommended_stiffness < 0.99 * free.recommended_stiffness
    settings = served_settings(monkeypatch, "--law", "G")
    assert initial(settings) == ("omega.3", "G", row.recommended_stiffness)


def test_a_lab_starts_where_nothing_is_recommended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    device = tmp_path / "unknown.toml"
    device.write_text(UNKNOWN)
    settings = served_settings(monkeypatch, "--device", str(device))
    assert initial(settings) == ("unknown", START_LAW, START_STIFFNESS)


def initial(settings: dict[str, Any]) -> tuple[str, str, float]:
    return settings["device"], settings["law"], settings["stiffness"]


def served_settings(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> dict[str, Any]:
    """Return the settings of the scene that the command serves, without serving it."""
    scenes: list[SceneState] = []

    async def keep_scene(scene: SceneState, place: socket.socket, *_others: object) -> None:
        place.close()
        scenes.append(scene)

    monkeypatch.setattr("asperity.lab.server.serve_lab", keep_scene)
    CliRunner().invoke(cli, ["lab", "--port", "0", *arguments], catch_exceptions=False)
    return scenes[0].settings

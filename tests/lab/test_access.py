"""Who is let in, what may be said, and what a frame keeps."""

from __future__ import annotations

import json
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asperity.errors import ParameterError
from asperity.lab.access import AT_ONCE, PER_SECOND, Door, MalformedError, Pace
from asperity.lab.frames import FORCES, HEAD, MOST_FORCES, NAMES, frame, layout
from asperity.lab.messages import Change, Look, Seen, Steer, Take, read_message

DOOR = Door(8137, "secret")
OURS = "127.0.0.1:8137"


@pytest.mark.parametrize(
    ("path", "hosts", "name"),
    [
        ("/secret/", [OURS], ""),
        ("/secret/lab.js?new", ["localhost:8137"], "lab.js"),
        ("/secret/../x", [OURS], "../x"),
        ("/secret", [OURS], None),
        ("/", [OURS], None),
        ("/Secret/", [OURS], None),
        ("/sécret/", [OURS], None),
        ("/secret/", ["evil.example:8137"], None),  # a name that was made to point here
        ("/secret/", ["127.0.0.1"], None),
        ("/secret/", ["127.0.0.1:81"], None),
        ("/secret/", [OURS, "evil.example"], None),
        ("/secret/", [], None),
    ],
)
def test_who_knows_address_and_token_is_let_in(path: str, hosts: list[str], name: str) -> None:
    assert DOOR.asked(path, hosts) == name


def test_a_live_connection_is_for_our_page_alone() -> None:
    assert DOOR.is_ours([f"http://{OURS}"])
    for other in ([], ["null"], ["http://evil.example"], [f"https://{OURS}"],
                  [f"http://{OURS}", "http://evil.example"], ["http://127.0.0.1"]):  # fmt: skip
        assert not DOOR.is_ours(other)


def test_each_door_has_a_token_of_its_own() -> None:
    one, other = Door(1), Door(1)
    assert one.token != other.token
    assert len(one.token) >= 20
    assert one.address == f"http://127.0.0.1:1/{one.token}/"


def test_too_many_messages_are_too_many() -> None:
    pace = Pace(now=0.0)
    for _ in range(int(AT_ONCE)):
        pace.count(now=0.0)
    with pytest.raises(MalformedError, match="500 messages per second"):
        pace.count(now=0.0)
    steady = Pace(now=0.0)
    for k in range(5000):
        steady.count(now=k / PER_SECOND)


def said(**message: object) -> str:
    return json.dumps(message)


def test_what_our_page_says_is_understood() -> None:
    three = [1e-3, 0, -2e-3]
    steer = read_message(said(do="steer", target=three, cosine=three, sine=three, speed=2))
    assert steer == Steer((1e-3, 0.0, -2e-3), (1e-3, 0.0, -2e-3), (1e-3, 0.0, -2e-3), 2.0)
    assert read_message(said(do="change", wishes={"law": "B"})) == Change({"law": "B"})
    look = read_message(said(do="cut", box=[-0.01, 0.01, -0.001, 0.001], y=0.0))
    assert look == Look("cut", (-0.01, 0.01, -0.001, 0.001, 0.0))
    assert read_message(said(do="relief", x=0, y=0, size=0.01)) == Look("relief", (0.0, 0.0, 0.01))
    assert read_message(said(do="take")) == Take()
    assert read_message(said(do="seen", frame=7)) == Seen(7.0)


@pytest.mark.parametrize(
    "content",
    [
        b"\x00\x01", "", "{", "[]", "7", "null", "{}", said(do="fly"), said(do=["take"]),
        said(do="take", more=1), said(do="steer", target=[0, 0, 0]),
        said(do="relief", x="0", y=0, size=0.01), said(do="relief", x=True, y=0, size=0.01),
        said(do="change", wishes=[]), said(do="change", wishes={"law": ["B"]}),
        said(do="cut", box=[0, 1, 2], y=0), said(do="seen", frame="7"), said(do="seen"),
        '{"do": "relief", "x": NaN, "y": 0, "size": 0.01}',
        '{"do": "relief", "x": Infinity, "y": 0, "size": 0.01}', "[" * 4000,
        '{"do": "relief", "x": ' + "9" * 5000 + "}",
    ],
)  # fmt: skip
def test_what_no_page_of_ours_says_is_malformed(content: str | bytes) -> None:
    with pytest.raises(MalformedError):
        read_message(content)


@pytest.mark.parametrize(
    "content",
    [
        '{"do": "relief", "x": 1e999, "y": 0, "size": 0.01}',
        said(do="relief", x=0, y=0, size=0), said(do="relief", x=0, y=0, size=1),
        said(do="steer", target=[0, 0, 1], cosine=[0, 0, 0], sine=[0, 0, 0], speed=0),
        said(do="steer", target=[0, 0, 0], cosine=[0, 0, 0], sine=[0, 0, 0], speed=1e4),
        said(do="cut", box=[0.1, 0.0, 0, 0.1], y=0), said(do="cut", box=[0, 0.1, 0, 1e-9], y=0),
    ],
)  # fmt: skip
def test_a_number_out_of_its_range_is_refused(content: str) -> None:
    with pytest.raises(ParameterError):
        read_message(content)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(
        st.sampled_from(["do", "target", "cosine", "sine", "speed", "wishes", "x", "y", "size",
                         "box", "take", "frame"]), inner, max_size=5),
    max_leaves=8,
)  # fmt: skip
KINDS = st.sampled_from(["steer", "change", "relief", "cut", "take", "seen"])


@settings(max_examples=200, deadline=None)
@given(JSON, KINDS)
def test_whatever_is_said_is_a_message_or_an_error_of_ours(content: object, kind: str) -> None:
    if isinstance(content, dict):
        content = {**content, "do": kind}
    with suppress(MalformedError, ParameterError):
        assert isinstance(read_message(json.dumps(content)), Steer | Change | Look | Take | Seen)


def test_a_frame_keeps_the_extremes_between_two_pictures() -> None:
    # A buzz of 800 Hz at 10 kHz, in frames of 50 samples: four whole periods in each.
    time = np.arange(50) / 10e3
    rows = np.zeros((50, len(NAMES)))
    place = NAMES.index("applied z")
    rows[:, place] = 0.3 * np.sin(2.0 * np.pi * 800.0 * time + 0.1)
    numbers = np.frombuffer(
        frame(rows, 7, {"frame": 5, "heard": 3, "late": 1, "skipped": 2}, np.arange(6.0))
    )
    named = layout()
    # The newest row alone would show nothing of it.
    assert abs(numbers[named["newest"] + place]) < 0.2
    assert numbers[named["least"] + place] == rows[:, place].min() < -0.29
    assert numbers[named["greatest"] + place] == rows[:, place].max() > 0.29
    head = [numbers[named["head"][name]] for name in HEAD]
    assert head == [1.0, 5.0, 50.0, 7.0, 3.0, 1.0, 2.0, 50.0, 0.0, 0.0, 0.0, 0.0]
    forces = numbers[named["forces"] :].reshape(-1, 3)
    assert (forces == rows[:, FORCES]).all()


def test_a_page_that_was_slow_gets_the_newest_forces_and_all_extremes() -> None:
    rows = np.zeros((MOST_FORCES + 10, len(NAMES)))
    rows[0, NAMES.index("x")] = -5.0
    rows[:, FORCES.start] = np.arange(len(rows))
    counts = {"frame": 1, "heard": 0, "late": 0, "skipped": 0}
    numbers = np.frombuffer(frame(rows, 0, counts, np.zeros(6)))
    assert numbers[layout()["least"] + NAMES.index("x")] == -5.0
    assert numbers[layout()["forces"] :: 3].tolist() == list(range(10, len(rows)))

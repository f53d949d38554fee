"""Who is let in, what may be said, and what a frame keeps."""

from __future__ import annotations

import json
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import asperity as asp
from asperity.core.errors import ParameterError
from asperity.lab.access import (
    MAX_MESSAGE_BURST,
    MAX_MESSAGE_RATE,
    AccessToken,
    MalformedMessageError,
    RateLimit,
)
from asperity.lab.messages import (
    COLUMN_NAMES,
    FORCE_COLUMNS,
    HEADER,
    MAX_FORCE_ROWS,
    Message,
    SteerRequest,
    ViewRequest,
    encode_frame,
    frame_layout,
    parse_message,
)

DOOR = AccessToken(8137, "secret")
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
    assert DOOR.authorize(path, hosts) == name


def test_a_live_connection_is_for_our_page_alone() -> None:
    assert DOOR.is_same_origin([f"http://{OURS}"])
    for other in (
        [],
        ["null"],
        ["http://evil.example"],
        [f"https://{OURS}"],
        [f"http://{OURS}", "http://evil.example"],
        ["http://127.0.0.1"],
    ):
        assert not DOOR.is_same_origin(other)


def test_each_door_has_a_token_of_its_own() -> None:
    one, other = AccessToken(1), AccessToken(1)
    assert one.secret != other.secret
    assert len(one.secret) >= 20
    assert one.url == f"http://127.0.0.1:1/{one.secret}/"


def test_too_many_messages_are_too_many() -> None:
    pace = RateLimit(now=0.0)
    for _ in range(int(MAX_MESSAGE_BURST)):
        pace.consume(now=0.0)
    with pytest.raises(MalformedMessageError, match="500 messages per second"):
        pace.consume(now=0.0)
    steady = RateLimit(now=0.0)
    for k in range(5000):
        steady.consume(now=k / MAX_MESSAGE_RATE)


def said(**message: object) -> str:
    return json.dumps(message)


def test_what_our_page_says_is_understood() -> None:
    three = [1e-3, 0, -2e-3]
    steer = parse_message(said(type="steer", target=three, cosine=three, sine=three, speed=2))
    assert steer.content == SteerRequest(*[(1e-3, 0.0, -2e-3)] * 3, 2.0)
    assert parse_message(said(type="change", changes={"law": "B"})) == Message(
        "change", {"law": "B"}
    )
    look = parse_message(said(type="section", box=[-0.01, 0.01, -0.001, 0.001], y=0.0))
    assert look.content == ViewRequest("section", (-0.01, 0.01, -0.001, 0.001, 0.0))
    assert parse_message(said(type="relief", x=0, y=0, size=0.01)).content == ViewRequest(
        "relief", (0.0, 0.0, 0.01)
    )
    assert parse_message(said(type="take_control")) == Message("take_control")
    assert parse_message(said(type="acknowledge", frame=7)) == Message("acknowledge", 7.0)


@pytest.mark.parametrize(
    "content",
    [
        b"\x00\x01",
        "",
        "{",
        "[]",
        "7",
        "null",
        "{}",
        said(type="fly"),
        said(type=["take_control"]),
        said(type="take_control", more=1),
        said(type="steer", target=[0, 0, 0]),
        said(type="relief", x="0", y=0, size=0.01),
        said(type="relief", x=True, y=0, size=0.01),
        said(type="change", changes=[]),
        said(type="change", changes={"law": ["B"]}),
        said(type="section", box=[0, 1, 2], y=0),
        said(type="acknowledge", frame="7"),
        said(type="acknowledge"),
        '{"type": "relief", "x": NaN, "y": 0, "size": 0.01}',
        '{"type": "relief", "x": Infinity, "y": 0, "size": 0.01}',
        "[" * 4000,
        '{"type": "relief", "x": ' + "9" * 5000 + "}",
    ],
)
def test_what_no_page_of_ours_says_is_malformed(content: str | bytes) -> None:
    with pytest.raises(MalformedMessageError):
        parse_message(content)


@pytest.mark.parametrize(
    "content",
    [
        '{"type": "relief", "x": 1e999, "y": 0, "size": 0.01}',
        said(type="relief", x=0, y=0, size=0),
        said(type="relief", x=0, y=0, size=1),
        said(type="steer", target=[0, 0, 1], cosine=[0, 0, 0], sine=[0, 0, 0], speed=0),
        said(type="steer", target=[0, 0, 0], cosine=[0, 0, 0], sine=[0, 0, 0], speed=1e4),
        said(type="section", box=[0.1, 0.0, 0, 0.1], y=0),
        said(type="section", box=[0, 0.1, 0, 1e-9], y=0),
    ],
)
def test_a_number_out_of_its_range_is_refused(content: str) -> None:
    with pytest.raises(ParameterError):
        parse_message(content)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(
                [
                    "type",
                    "target",
                    "cosine",
                    "sine",
                    "speed",
                    "changes",
                    "x",
                    "y",
                    "size",
                    "box",
                    "take",
                    "frame",
                ]
            ),
            inner,
            max_size=5,
        )
    ),
    max_leaves=8,
)
KINDS = st.sampled_from(["steer", "change", "relief", "section", "take_control", "acknowledge"])


@settings(max_examples=200, deadline=None)
@given(JSON, KINDS)
def test_whatever_is_said_is_a_message_or_an_error_of_ours(content: object, kind: str) -> None:
    if isinstance(content, dict):
        content = {**content, "type": kind}
    with suppress(MalformedMessageError, ParameterError):
        assert isinstance(parse_message(json.dumps(content)), Message)


def test_a_frame_keeps_the_extremes_between_two_pictures() -> None:
    # A buzz of 800 Hz at 10 kHz, in frames of 50 samples: four whole periods in each.
    time = np.arange(50) / 10e3
    rows = np.zeros((50, len(COLUMN_NAMES)))
    place = COLUMN_NAMES.index("applied z")
    rows[:, place] = 0.3 * np.sin(2.0 * np.pi * 800.0 * time + 0.1)
    counts = {"frame": 5, "acknowledged": 3, "late": 1, "skipped": 2, "lateness": 0.5}
    counts |= {"truncated": 4, "force_limited": 6, "too_deep": 8, "deepest": 0.25}
    numbers = np.frombuffer(encode_frame(rows, 7, counts, np.arange(6.0)))
    named = frame_layout()
    # The newest row alone would show nothing of it.
    assert abs(numbers[named["newest"] + place]) < 0.2
    assert numbers[named["minima"] + place] == rows[:, place].min() < -0.29
    assert numbers[named["maxima"] + place] == rows[:, place].max() > 0.29
    head = [numbers[named["header"][name]] for name in HEADER]
    known = [1.0, 0.0, 5.0, 50.0, 7.0, 3.0, 50.0, 1.0, 2.0, 0.5, 4.0, 6.0, 8.0, 0.25]
    assert head == [*known, 0.0, 0.0, 0.0, 0.0, 0.0]  # the probe and its anchor stand still
    forces = numbers[named["forces"] :].reshape(-1, 3)
    assert (forces == rows[:, FORCE_COLUMNS]).all()


def test_a_page_that_was_slow_gets_the_newest_forces_and_all_extremes() -> None:
    rows = np.zeros((MAX_FORCE_ROWS + 10, len(COLUMN_NAMES)))
    rows[0, COLUMN_NAMES.index("x")] = -5.0
    rows[:, FORCE_COLUMNS.start] = np.arange(len(rows))
    names = "acknowledged late skipped lateness truncated force_limited too_deep deepest"
    counts = dict.fromkeys(names.split(), 0) | {"frame": 1}
    numbers = np.frombuffer(encode_frame(rows, 0, counts, np.zeros(6)))
    assert numbers[frame_layout()["minima"] + COLUMN_NAMES.index("x")] == -5.0
    assert numbers[frame_layout()["forces"] :: 3].tolist() == list(range(10, len(rows)))


@pytest.mark.parametrize("kind", ["acknowledge", "relief"])
def test_integers_beyond_floating_point_are_refused(kind: str) -> None:
    digits = "9" * 400
    text = {"acknowledge": f'"frame": {digits}', "relief": f'"x": -{digits}, "y": 0, "size": 1'}
    with pytest.raises(ParameterError, match="must be"):
        parse_message(f'{{"type": "{kind}", {text[kind]}}}')
    with pytest.raises(ParameterError, match="amplitude must be at most 1e\\+30"):
        asp.Sinusoid(10**5000, 1e-3)

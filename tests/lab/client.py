"""A page without a browser: what it hears and says."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from tests.lab.started import Started
from websockets.sync.client import ClientConnection, connect

from asperity.lab.messages import frame_layout

LAYOUT = frame_layout()
STILL = {"cosine": [0, 0, 0], "sine": [0, 0, 0], "speed": 0}


def joined(lab: Started, **more: Any) -> ClientConnection:
    """Connect as the page does, for a ``with``."""
    options = {
        "origin": f"http://{lab.host}",
        "compression": None,
        "max_size": None,
        "proxy": None,
        **more,
    }
    page: ClientConnection = connect(lab.address.replace("http", "ws") + "live", **options)
    return page


def say(page: ClientConnection, what: str, **content: Any) -> None:
    page.send(json.dumps({"type": what, **content}))


def taken(page: ClientConnection) -> Any:
    """Return the next message, words as a dictionary or numbers; a frame counts as painted."""
    content = page.recv(timeout=120)
    message = json.loads(content) if isinstance(content, str) else np.frombuffer(content)
    if frames(message):
        say(page, "acknowledge", frame=head(message, "frame"))
    return message


def heard(page: ClientConnection, wanted: Callable[[Any], bool], within: float = 120.0) -> Any:
    """Return the first message that is wanted; others, frames that never end, may come before."""
    end = time.monotonic() + within
    while not wanted(message := taken(page)):
        assert time.monotonic() < end, f"not heard within {within:.0f} s"
    return message


def news(**wanted: Any) -> Callable[[Any], bool]:
    """Return what knows the message that things stand in some way."""

    def fits(message: Any) -> bool:
        if not isinstance(message, dict) or message["type"] != "status":
            return False
        known = {**message, **message["settings"]}
        return all(known[name] == value for name, value in wanted.items())

    return fits


def refused(message: Any) -> bool:
    return isinstance(message, dict) and message["type"] == "error"


def frames(message: Any) -> bool:
    return isinstance(message, np.ndarray) and message[0] == 1.0


def head(frame: Any, name: str) -> float:
    return float(frame[LAYOUT["header"][name]])


def column(frame: Any, part: str, name: str) -> float:
    return float(frame[LAYOUT[part] + LAYOUT["columns"][name]])

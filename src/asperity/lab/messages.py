"""What the page may say, and nothing else: read, and checked, before anything is done."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from asperity.errors import ParameterError
from asperity.lab.access import MalformedError

REACH = 0.1
"""Of the hand from the origin of the surface, along each axis [m]."""
FASTEST = 400.0
"""Of the angle of a motion that the hand repeats [rad/s]."""
LARGEST = 0.2
"""Side of what a picture shows at most [m]."""
SMALLEST = 1e-5
"""Likewise, at least [m]."""


@dataclass(frozen=True)
class Steer:
    """Where the hand shall be, see :meth:`asperity.servo.drivers.steered.Wheel.steer`."""

    target: tuple[float, ...]
    cosine: tuple[float, ...]
    sine: tuple[float, ...]
    speed: float


@dataclass(frozen=True)
class Change:
    """What of the stage shall be another."""

    wishes: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Look:
    """A picture that is wanted, see :func:`asperity.lab.workshop.picture`."""

    kind: str
    numbers: tuple[float, ...]


@dataclass(frozen=True)
class Take:
    """Who watches wants to steer."""


@dataclass(frozen=True)
class Seen:
    """The newest frame that the page has painted, by its number."""

    frame: float


@dataclass(frozen=True)
class Start:
    """A loop that has stopped shall start."""


@dataclass(frozen=True)
class Stop:
    """The force shall go, and the loop end."""


@dataclass(frozen=True)
class Save:
    """The newest seconds shall be kept, see :mod:`asperity.lab.takes`."""


Message = Steer | Change | Start | Stop | Look | Take | Seen | Save


def read_message(content: str | bytes) -> Message:
    """Return what a page says.

    Args:
        content: of a frame; JSON, with the keys of one of the messages and "do".

    Raises:
        MalformedError: for what no page of ours sends.
        ParameterError: for a number out of its range.
    """
    if isinstance(content, bytes):
        raise MalformedError("frames from the page are text")
    try:
        said = json.loads(content, parse_constant=_refused)
    except (ValueError, RecursionError):
        raise MalformedError("a message must be JSON") from None
    kind = said.pop("do", None) if isinstance(said, dict) else None
    reader = _READERS.get(kind) if isinstance(kind, str) else None
    if reader is None:
        raise MalformedError(f'a message must say what to "do": {", ".join(_READERS)}')
    expected, make = reader
    if set(said) != set(expected):
        raise MalformedError(f'"{kind}" has {", ".join(expected) or "no more keys"}')
    message: Message = make(**said)
    return message


def _refused(constant: str) -> float:
    raise ValueError(constant)


def _number(name: str, value: object, least: float, most: float) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise MalformedError(f"{name} must be a number")
    if not least <= value <= most:
        raise ParameterError(name, f"must be {least:g} to {most:g}", value)
    return float(value)


def _point(name: str, value: object) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) != 3:
        raise MalformedError(f"{name} must be three numbers")
    return tuple(_number(name, part, -REACH, REACH) for part in value)


def _steer(target: object, cosine: object, sine: object, speed: object) -> Steer:
    return Steer(
        _point("target", target), _point("cosine", cosine), _point("sine", sine),
        _number("speed", speed, -FASTEST, FASTEST),
    )  # fmt: skip


def _change(wishes: object) -> Change:
    if not isinstance(wishes, dict):
        raise MalformedError("wishes must be names with values")
    for value in wishes.values():
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            raise MalformedError("a wish is a number or a text")
    return Change(wishes)


def _relief(x: object, y: object, size: object) -> Look:
    numbers = (
        _number("x", x, -1.0, 1.0), _number("y", y, -1.0, 1.0),
        _number("size", size, SMALLEST, LARGEST),
    )  # fmt: skip
    return Look("relief", numbers)


def _cut(box: object, y: object) -> Look:
    if not isinstance(box, list) or len(box) != 4:
        raise MalformedError("box must be four numbers")
    left, right, bottom, top = (_number("box", side, -1.0, 1.0) for side in box)
    for low, high in ((left, right), (bottom, top)):
        if not SMALLEST <= high - low <= LARGEST:
            raise ParameterError("box", f"must have sides of {SMALLEST:g} to {LARGEST:g} m", box)
    return Look("cut", (left, right, bottom, top, _number("y", y, -1.0, 1.0)))


_READERS: dict[str, tuple[tuple[str, ...], Any]] = {
    "steer": (("target", "cosine", "sine", "speed"), _steer),
    "change": (("wishes",), _change),
    "relief": (("x", "y", "size"), _relief),
    "cut": (("box", "y"), _cut),
    "take": ((), Take),
    "start": ((), Start),
    "stop": ((), Stop),
    "save": ((), Save),
    "seen": (("frame",), lambda frame: Seen(_number("frame", frame, 0.0, math.inf))),
}

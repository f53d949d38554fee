"""Messages from the page: parsed and validated before anything is done."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from asperity.core.errors import ParameterError
from asperity.lab.access import MalformedMessageError

MAX_REACH = 0.1
"""Greatest distance of the hand from the origin of the surface, along each axis [m]."""
MAX_ANGULAR_SPEED = 400.0
"""Greatest angular speed of a periodic motion of the hand [rad/s]."""
MIN_VIEW_SIZE, MAX_VIEW_SIZE = 1e-5, 0.2
"""Least and greatest side of a picture [m]."""


@dataclass(frozen=True)
class SteerRequest:
    """Motion of the hand; see :meth:`asperity.servo.drivers.pointer.PointerHand.request_motion`."""

    target: tuple[float, ...]
    cosine: tuple[float, ...]
    sine: tuple[float, ...]
    speed: float


@dataclass(frozen=True)
class ViewRequest:
    """A requested picture; see :func:`asperity.lab.background_worker.render_view`."""

    kind: str
    numbers: tuple[float, ...]


class Message(NamedTuple):
    """A message of the page.

    Attributes:
        kind: "steer", "change", "relief", "cut", "take" (control), "start", "stop", "save" or
            "seen" (the newest painted frame).
        content: a :class:`SteerRequest`, the changes by name, a :class:`ViewRequest`, the number of
            a frame, or ``None``.
    """

    kind: str
    content: Any = None


def parse_message(content: str | bytes) -> Message:
    """Return a message of the page.

    Args:
        content: JSON with the keys of one kind of message and "do".

    Raises:
        MalformedMessageError: for a message that the page never sends.
        ParameterError: for a number out of its range.
    """
    if isinstance(content, bytes):
        raise MalformedMessageError("frames from the page are text")
    try:
        message = json.loads(content, parse_constant=_reject_constant)
    except (ValueError, RecursionError):
        raise MalformedMessageError("a message must be JSON") from None
    kind = message.pop("do", None) if isinstance(message, dict) else None
    if not isinstance(kind, str) or kind not in _PARSERS:
        raise MalformedMessageError(f'a message must have "do": {", ".join(_PARSERS)}')
    keys, parse = _PARSERS[kind]
    if set(message) != set(keys):
        raise MalformedMessageError(f'"{kind}" has {", ".join(keys) or "no more keys"}')
    return Message(kind, parse(**message))


def _reject_constant(constant: str) -> float:
    raise ValueError(constant)


def _parse_number(name: str, value: object, minimum: float, maximum: float) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise MalformedMessageError(f"{name} must be a number")
    if not minimum <= value <= maximum:
        raise ParameterError(name, f"must be {minimum:g} to {maximum:g}", value)
    return float(value)


def _parse_numbers(
    name: str, value: object, count: int, minimum: float, maximum: float
) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) != count:
        raise MalformedMessageError(f"{name} must be {count} numbers")
    return tuple(_parse_number(name, part, minimum, maximum) for part in value)


def _parse_steer(speed: object, **points: object) -> SteerRequest:
    vectors = {
        name: _parse_numbers(name, value, 3, -MAX_REACH, MAX_REACH)
        for name, value in points.items()
    }
    angular = _parse_number("speed", speed, -MAX_ANGULAR_SPEED, MAX_ANGULAR_SPEED)
    return SteerRequest(**vectors, speed=angular)


def _parse_change(changes: object) -> Mapping[str, Any]:
    if not isinstance(changes, dict):
        raise MalformedMessageError("changes must be names with values")
    for value in changes.values():
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            raise MalformedMessageError("a change is a number or a text")
    return changes


def _parse_relief(x: object, y: object, size: object) -> ViewRequest:
    middle = _parse_number("x", x, -1.0, 1.0), _parse_number("y", y, -1.0, 1.0)
    side = _parse_number("size", size, MIN_VIEW_SIZE, MAX_VIEW_SIZE)
    return ViewRequest("relief", (*middle, side))


def _parse_section(box: object, y: object) -> ViewRequest:
    sides = left, right, bottom, top = _parse_numbers("box", box, 4, -1.0, 1.0)
    if not all(MIN_VIEW_SIZE <= side <= MAX_VIEW_SIZE for side in (right - left, top - bottom)):
        limits = f"must have sides of {MIN_VIEW_SIZE:g} to {MAX_VIEW_SIZE:g} m"
        raise ParameterError("box", limits, box)
    return ViewRequest("cut", (*sides, _parse_number("y", y, -1.0, 1.0)))


def _parse_frame(frame: object) -> float:
    return _parse_number("frame", frame, 0.0, math.inf)


_PARSERS: dict[str, tuple[tuple[str, ...], Callable[..., Any]]] = {
    "steer": (("target", "cosine", "sine", "speed"), _parse_steer),
    "change": (("changes",), _parse_change),
    "relief": (("x", "y", "size"), _parse_relief),
    "cut": (("box", "y"), _parse_section),
    "seen": (("frame",), _parse_frame),
    **{kind: ((), lambda: None) for kind in ("take", "start", "stop", "save")},
}

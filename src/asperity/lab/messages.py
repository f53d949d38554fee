"""Messages from the page, validated before anything is done, and binary messages to it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from asperity.core.checks import FloatArray, check_real
from asperity.core.errors import ParameterError
from asperity.lab.access import MalformedMessageError
from asperity.loop.shared_trace import COLUMNS
from asperity.surface import Surface

MAX_REACH = 0.1
"""Greatest distance of the hand from the origin of the surface, along each axis [m]."""
MAX_ANGULAR_SPEED = 400.0
"""Greatest angular speed of a periodic motion of the hand [rad/s]."""
MIN_VIEW_SIZE = 1e-5
MAX_VIEW_SIZE = 0.2
"""Least and greatest side of a picture [m]."""


BESIDE = "beside"
"""Name of the second lane: of the change that chooses its law, and of its section."""


@dataclass(frozen=True)
class SteerRequest:
    """Motion of the hand; see :meth:`asperity.servo.drivers.pointer.PointerHand.request_motion`."""

    target: tuple[float, ...]
    cosine: tuple[float, ...]
    sine: tuple[float, ...]
    speed: float


@dataclass(frozen=True)
class ViewRequest:
    """A requested picture; see :func:`asperity.lab.background.render_view`."""

    kind: str
    numbers: tuple[float, ...]


class Message(NamedTuple):
    """A message of the page.

    Attributes:
        kind: "steer", "change", "relief", "section", ``BESIDE``, "take_control", "start", "stop"
            or "acknowledge" (the newest painted frame).
        content: a :class:`SteerRequest`, the changes by name, a :class:`ViewRequest`, the number of
            a frame, or ``None``.
    """

    kind: str
    content: Any = None


def parse_message(content: str | bytes) -> Message:
    """Return a message of the page.

    Args:
        content: JSON with "type" and the keys of that type of message.

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
    kind = message.pop("type", None) if isinstance(message, dict) else None
    if not isinstance(kind, str) or kind not in _PARSERS:
        raise MalformedMessageError(f'a message must have "type": {", ".join(_PARSERS)}')
    keys, parse = _PARSERS[kind]
    if set(message) != set(keys):
        raise MalformedMessageError(f'"{kind}" has {", ".join(keys) or "no more keys"}')
    return Message(kind, parse(**message))


def _reject_constant(constant: str) -> float:
    raise ValueError(constant)


def _parse_number(name: str, value: object, minimum: float, maximum: float) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise MalformedMessageError(f"{name} must be a number")
    number = check_real(name, value)
    if not minimum <= number <= maximum:
        raise ParameterError(name, f"must be {minimum:g} to {maximum:g}", number)
    return number


def _parse_numbers(name: str, value: object, count: int, limit: float) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) != count:
        raise MalformedMessageError(f"{name} must be {count} numbers")
    return tuple(_parse_number(name, part, -limit, limit) for part in value)


def _parse_steer(speed: object, **points: object) -> SteerRequest:
    vectors = {name: _parse_numbers(name, value, 3, MAX_REACH) for name, value in points.items()}
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


def _parse_section(kind: str, *code: float, box: object, y: object) -> ViewRequest:
    sides = left, right, bottom, top = _parse_numbers("box", box, 4, 1.0)
    if not all(MIN_VIEW_SIZE <= side <= MAX_VIEW_SIZE for side in (right - left, top - bottom)):
        limits = f"must have sides of {MIN_VIEW_SIZE:g} to {MAX_VIEW_SIZE:g} m"
        raise ParameterError("box", limits, box)
    return ViewRequest(kind, (*sides, _parse_number("y", y, -1.0, 1.0), *code))


_MAX_FRAME = 1e15  # of years
STATE = 1.0
RELIEF = 2.0
SECTION = 3.0
BESIDE_SECTION = 4.0
"""First number of a message: its kind."""

_PARSERS: dict[str, tuple[tuple[str, ...], Callable[..., Any]]] = {
    "steer": (("target", "cosine", "sine", "speed"), _parse_steer),
    "change": (("changes",), _parse_change),
    "relief": (("x", "y", "size"), _parse_relief),
    "section": (("box", "y"), partial(_parse_section, "section")),
    BESIDE: (("box", "y"), partial(_parse_section, BESIDE, BESIDE_SECTION)),
    "acknowledge": (("frame",), lambda frame: _parse_number("frame", frame, 0.0, _MAX_FRAME)),
    **{kind: ((), lambda: None) for kind in ("take_control", "start", "stop")},
}

COLUMN_NAMES = [name for name, _unit in COLUMNS]
FORCE_COLUMNS = slice(COLUMN_NAMES.index("applied x"), COLUMN_NAMES.index("applied z") + 1)
POSITION = slice(COLUMN_NAMES.index("x"), COLUMN_NAMES.index("z") + 1)
ANCHOR = [COLUMN_NAMES.index(f"law anchor {axis}") for axis in "xyz"]
_LAW_FORCE = slice(COLUMN_NAMES.index("commanded x"), COLUMN_NAMES.index("commanded z") + 1)
_STEP_STATISTICS = (
    *("path_length", "squared_steps", "max_force_step", "position_step"),
    "anchor_slip",
)
HEADER = (
    *("kind", "lane", "frame", "rows", "first", "acknowledged", "forces"),
    *("late", "skipped", "lateness", "truncated", "force_limited", "too_deep", "deepest"),
    *_STEP_STATISTICS,
)
_POSITION_NAMES = ("closest x", "closest y", "closest z", "hand x", "hand y", "hand z")
MAX_FORCE_ROWS = 2048
"""Greatest number of rows whose forces are in a frame, the newest."""


def frame_layout() -> dict[str, Any]:
    """Return the index of each number of a frame, for the page."""
    parts = ("newest", "minima", "maxima", "forces")
    after = len(HEADER) + len(_POSITION_NAMES)
    return {
        "header": {name: place for place, name in enumerate((*HEADER, *_POSITION_NAMES))},
        "columns": {name: place for place, name in enumerate(COLUMN_NAMES)},
        **{part: after + number * len(COLUMN_NAMES) for number, part in enumerate(parts)},
    }


def encode_frame(
    rows: FloatArray, first: int, counts: Mapping[str, float], positions: FloatArray
) -> bytes:
    """Return rows of a loop as a frame.

    Args:
        rows: at least one, with the columns ``loop.shared_layout.COLUMNS``.
        first: number of the first row.
        counts: ``lane`` (default 0; 1 for the second), ``frame`` (its number),
            ``acknowledged``, ``late`` and ``skipped`` ticks, ``lateness`` (greatest delay of a
            start [s]), ``truncated`` (ticks whose search was), ``force_limited`` and ``too_deep``
            (ticks at the force limit and below the depth), ``deepest`` (of these [m]).
        positions: of closest point and hand (6,) [m].
    """
    forces = rows[-MAX_FORCE_ROWS:, FORCE_COLUMNS]
    sizes = {"kind": STATE, "lane": 0.0, "rows": len(rows), "first": first, "forces": len(forces)}
    values = {**sizes, **counts, **step_statistics(rows)}
    head = [float(values[name]) for name in HEADER]
    parts = (head, positions, rows[-1], rows.min(axis=0), rows.max(axis=0), forces.ravel())
    return np.concatenate(parts).tobytes()


def step_statistics(rows: FloatArray) -> dict[str, float]:
    """Return statistics of the steps from row to row.

    ``path_length`` is the sum of the steps of the position [m], ``squared_steps`` that of their
    squares [m²], ``max_force_step`` the greatest step of the force of the law [N], and
    ``position_step`` the step of the position at that row [m]. ``anchor_slip`` is what the anchor
    of friction loses: the sum of its ways times the deflection in the middle of each [m²], of which
    the presliding stiffness makes the energy that friction takes.
    """
    if len(rows) < 2:
        return dict.fromkeys(_STEP_STATISTICS, 0.0)
    squares = np.square(np.diff(rows[:, POSITION], axis=0)).sum(axis=1)
    jumps = np.square(np.diff(rows[:, _LAW_FORCE], axis=0)).sum(axis=1)
    largest = int(jumps.argmax())
    ways = np.diff(rows[:, ANCHOR], axis=0)
    deflections = rows[1:, POSITION] - rows[1:, ANCHOR]
    return {
        "path_length": float(np.sqrt(squares).sum()),
        "squared_steps": float(squares.sum()),
        "max_force_step": float(jumps[largest] ** 0.5),
        "position_step": float(squares[largest] ** 0.5),
        "anchor_slip": float(np.sum((deflections + 0.5 * ways) * ways)),
    }


RELIEF_POINTS = 96
"""Number of heights along each side of the relief."""
SECTION_COLUMNS = 72
SECTION_ROWS = 36
"""Grid of the field in a section."""
PROFILE_POINTS = 288
"""Number of heights along a section."""


def encode_relief(surface: Surface, x: float, y: float, size: float) -> bytes:
    """Return the heights of a square as a message.

    RELIEF, RELIEF_POINTS, x, y and size, then the heights row by row from the least y [m].

    Args:
        surface: the surface.
        x: of the middle [m].
        y: likewise.
        size: of the side [m].
    """
    along = np.linspace(-0.5 * size, 0.5 * size, RELIEF_POINTS)
    xs, ys = np.meshgrid(x + along, y + along)
    heights = surface.texture.height(np.column_stack([xs.ravel(), ys.ravel()]))
    return np.concatenate([[RELIEF, RELIEF_POINTS, x, y, size], heights]).tobytes()


def encode_section(
    surface: Surface,
    left: float,
    right: float,
    bottom: float,
    top: float,
    y: float,
    code: float = SECTION,
) -> bytes:
    """Return a section along x, with the field and its curl, as a message.

    SECTION, PROFILE_POINTS, SECTION_COLUMNS, SECTION_ROWS, y and the box, then the heights [m],
    then row by row from the least z the forces along x, those along z [N] and the curl
    ∂f_x/∂z - ∂f_z/∂x [N/m]. A law with state is evaluated in its initial state.

    Args:
        surface: the surface.
        left: least x [m].
        right: greatest x [m].
        bottom: least z [m].
        top: greatest z [m].
        y: of the section [m].
        code: first number of the message: SECTION, or BESIDE_SECTION of the second lane.
    """
    line = np.linspace(left, right, PROFILE_POINTS)
    heights = surface.texture.height(np.column_stack([line, np.full(PROFILE_POINTS, y)]))
    xs, zs = np.meshgrid(
        np.linspace(left, right, SECTION_COLUMNS), np.linspace(bottom, top, SECTION_ROWS)
    )
    points = np.column_stack([xs.ravel(), np.full(xs.size, y), zs.ravel()])
    force, jacobian = map(np.nan_to_num, surface.force_and_jacobian(points))
    curl = jacobian[:, 0, 2] - jacobian[:, 2, 0]
    head = [code, PROFILE_POINTS, SECTION_COLUMNS, SECTION_ROWS, y, left, right, bottom, top]
    return np.concatenate([head, heights, force[:, 0], force[:, 2], curl]).tobytes()

"""Motions of the anchor of a hand."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray, check_array, check_positive
from asperity.core.errors import ParameterError
from asperity.core.files import attributes_to_dict


@runtime_checkable
class Motion(Protocol):
    """A motion of the hand's anchor."""

    def at(self, times: FloatArray) -> FloatArray:
        """Return the positions [m], shape (n, 3), at the times [s], shape (n,)."""

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""


class NamedPart:
    """Mixin for the dataclasses of a closed loop that a scene names by their kind.

    Attributes:
        kind: name of the kind.
    """

    kind: ClassVar[str]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {"kind": self.kind} | attributes_to_dict(self)


def _check_point(name: str, value: ArrayLike) -> tuple[float, float, float]:
    x, y, z = check_array(name, value, (3,), "m")
    return float(x), float(y), float(z)


@dataclass(frozen=True)
class Stationary(NamedPart):
    """An anchor that stays where it is.

    Attributes:
        point: [m], shape (3,).

    Raises:
        ParameterError: for another shape or a value that is not finite.

    Example:
        >>> Stationary((0.0, 0.0, -1e-3)).at([0.0, 1.0])
        array([[ 0.   ,  0.   , -0.001],
               [ 0.   ,  0.   , -0.001]])
    """

    kind: ClassVar[str] = "still"

    point: tuple[float, float, float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", _check_point("point", self.point))

    def at(self, times: ArrayLike) -> FloatArray:
        """Return the positions [m], shape (n, 3), at the times [s], shape (n,)."""
        return np.tile(np.array(self.point), (len(check_array("times", times, (None,), "s")), 1))


@dataclass(frozen=True)
class Strokes(NamedPart):
    """Back and forth between two points at constant speed, ending where the last stroke ends.

    Attributes:
        start: where the first stroke begins [m], shape (3,).
        end: where it ends and the second begins [m], shape (3,).
        speed: [m/s].
        count: number of strokes.

    Raises:
        ParameterError: for points that coincide or are infinitely far apart, a speed that is not
            positive or gives no finite duration, or a count that is not a positive whole number.

    Example:
        >>> there = Strokes((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), speed=0.2, count=2)
        >>> there.period, there.duration
        (0.5, 1.0)
        >>> there.at([0.25, 0.75, 2.0])[:, 0]
        array([0.05, 0.05, 0.  ])
    """

    kind: ClassVar[str] = "strokes"

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    speed: float
    count: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", _check_point("start", self.start))
        object.__setattr__(self, "end", _check_point("end", self.end))
        check_positive("speed", self.speed, "m/s")
        if self.start == self.end:
            raise ParameterError("end", "must differ from start", self.end)
        if check_positive("count", self.count) % 1 != 0:
            raise ParameterError("count", "must be a whole number of strokes", self.count)
        object.__setattr__(self, "count", int(self.count))
        if not math.isfinite(math.dist(self.start, self.end)):
            raise ParameterError("end", "must be at a finite distance from start [m]", self.end)
        if not (self.period > 0.0 and math.isfinite(self.duration)):
            limit = "must make a stroke last, and all of them a finite time [m/s]"
            raise ParameterError("speed", limit, self.speed)

    @property
    def period(self) -> float:
        """Duration of one stroke [s]."""
        return math.dist(self.start, self.end) / self.speed

    @property
    def duration(self) -> float:
        """Duration of all strokes [s]."""
        return self.count * self.period

    def at(self, times: ArrayLike) -> FloatArray:
        """Return the positions [m], shape (n, 3), at the times [s], shape (n,)."""
        strokes = check_array("times", times, (None,), "s") / self.period
        strokes = np.clip(strokes, 0.0, self.count)
        share = 1.0 - np.abs(1.0 - strokes % 2.0)
        begin = np.array(self.start)
        way = np.subtract(self.end, self.start)
        return np.asarray(begin + share[:, None] * way)


@dataclass(frozen=True, eq=False)
class Waypoints(NamedPart):
    """Through given points at given times, straight and at constant speed in between.

    Before the first time and after the last one it rests there.

    Attributes:
        times: [s], increasing, shape (n,).
        points: [m], shape (n, 3).

    Raises:
        ParameterError: for other shapes, values that are not finite, or times that do not increase.

    Example:
        >>> Waypoints([0.0, 1.0], [[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]).at([0.25, 3.0])[:, 2]
        array([0.5, 2. ])
    """

    kind: ClassVar[str] = "path"

    times: FloatArray
    points: FloatArray

    def __post_init__(self) -> None:
        times = check_array("times", self.times, (None,), "s")
        points = check_array("points", self.points, (None, 3), "m")
        if len(times) < 1 or len(times) != len(points):
            raise ParameterError("points", f"must be one for each of {len(times)} times")
        if (np.diff(times) <= 0.0).any():
            raise ParameterError("times", "must increase [s]")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "points", points)

    @property
    def duration(self) -> float:
        """The last time [s]."""
        return float(self.times[-1])

    def at(self, times: ArrayLike) -> FloatArray:
        """Return the positions [m], shape (n, 3), at the times [s], shape (n,)."""
        wanted = check_array("times", times, (None,), "s")
        columns = [np.interp(wanted, self.times, self.points[:, i]) for i in range(3)]
        return np.stack(columns, axis=-1)

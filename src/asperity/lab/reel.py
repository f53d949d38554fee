"""Rows of a loop as the page shows them again: in pieces, however long they are."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.recording.recording import Recording
from asperity.recording.rows import Columns
from asperity.servo.kernels.published import COLUMNS
from asperity.surface import Surface
from asperity.textures.texture import Texture

PIECE = 8192
"""Rows of a piece: the page holds some of them, never all."""
BINS = 600
"""Of the force over the whole: of each, the least and the greatest."""
SHOWN = 5e-3
"""[s] from one nearest point to the next."""
ANCHOR = tuple((f"anchor {axis}", "m") for axis in "xyz")
"""Columns of the hand, after those of the loop."""

_PLACE, _FORCE = ("x", "y", "z"), ("applied x", "applied y", "applied z")
_NAMES = tuple(name for name, _unit in COLUMNS)


@dataclass(frozen=True)
class Reel:
    """Rows that can be had piece by piece.

    Attributes:
        texture: that the probe was on.
        period: from row to row [s].
        count: of the rows.
        read: returns the rows from one to another, with ``COLUMNS`` and ``ANCHOR``.
        force: least and greatest size of the force [N] in each of the bins, shape (bins, 2).
    """

    texture: Texture
    period: float
    count: int
    read: Callable[[int, int], FloatArray] = field(repr=False)
    force: FloatArray = field(repr=False)

    def piece(self, number: int) -> bytes:
        """Return a piece: rows of the loop, god-object and hand [m]."""
        rows = self.read(number * PIECE, (number + 1) * PIECE)
        step = max(1, round(SHOWN / self.period))
        near = self.texture.nearest(rows[::step, 1:4])
        near = np.repeat(near, step, axis=0)[: len(rows)]
        hand = len(COLUMNS)
        return np.column_stack([rows[:, :hand], near, rows[:, hand:]]).tobytes()

    @property
    def pieces(self) -> int:
        """How many there are."""
        return math.ceil(self.count / PIECE)

    def to_dict(self) -> dict[str, Any]:
        """Return what the page is told."""
        return {
            "rows": self.count, "period": self.period, "piece": PIECE,
            "width": len(COLUMNS) + 2 * len(ANCHOR), "force": self.force.round(6).tolist(),
        }  # fmt: skip


def reel_of(table: FloatArray, period: float, texture: Texture) -> Reel:
    """Return rows that are in memory, with ``COLUMNS`` and ``ANCHOR``, shape (n, columns)."""
    seen = _Force(len(table))
    seen.take(table, [_NAMES.index(name) for name in _FORCE])
    return Reel(texture, period, len(table), lambda first, end: table[first:end], seen.bins)


def recorded_reel(recording: Recording, surface: Surface) -> Reel:
    """Return the rows of a recording, all of which are read once, and looked at.

    What a recording does not hold is made: whether the probe was inside, of its place and the
    surface; and the energy given, of its parts. Where no hand was recorded, its place is no number.

    Args:
        recording: of a run or a simulation.
        surface: that it was made on.

    Raises:
        ParameterError: for one without rows, without a column that is needed, with a damaged block,
            a number that is none, or times that do not grow.
    """
    arranged = _Arranged(recording.columns, surface)
    if recording.rows < 2:
        words = f"has {recording.rows} rows: nothing to show"
        raise ParameterError("recording", f"{recording.path} {words}")
    seen, before = _Force(recording.rows), -math.inf
    needed = arranged.places((*_PLACE, *_FORCE))
    for block in recording.blocks():
        times = block[:, 0]
        if not (np.isfinite(block[:, needed]).all() and np.isfinite(times).all()):
            raise ParameterError("recording", f"{recording.path} has numbers that are none")
        if times[0] <= before or (np.diff(times) <= 0.0).any():
            raise ParameterError("recording", f"{recording.path} has times that do not grow")
        before = float(times[-1])
        seen.take(block, arranged.places(_FORCE))
    period = recording.duration / (recording.rows - 1)
    return Reel(
        surface.texture, period, recording.rows,
        lambda first, end: arranged.table(recording.part(first, end)), seen.bins,
    )  # fmt: skip


class _Force:
    """The least and the greatest size of the force in each part of so many rows."""

    def __init__(self, count: int) -> None:
        self._count, self._seen = count, 0
        self.bins = np.tile([np.inf, 0.0], (min(BINS, count), 1))

    def take(self, rows: FloatArray, places: list[int]) -> None:
        """Take the next rows, whose force stands in these columns."""
        size = np.sqrt(np.square(rows[:, places]).sum(axis=1))
        numbers = np.arange(self._seen, self._seen + len(rows)) * len(self.bins) // self._count
        np.minimum.at(self.bins[:, 0], numbers, size)
        np.maximum.at(self.bins[:, 1], numbers, size)
        self._seen += len(rows)


class _Arranged:
    """The columns of a recording as the page knows them."""

    def __init__(self, columns: Columns, surface: Surface) -> None:
        self._names, self._surface = [name for name, _unit in columns], surface
        for name in (*_PLACE, *_FORCE):
            if name not in self._names:
                raise ParameterError("recording", f"has no column {name!r}: it cannot be shown")
        self._parts = ["supplied"]
        if "supplied" not in self._names:
            self._parts = [f"supplied {axis}" for axis in "xyz"]
        if not {*self._parts} <= {*self._names}:
            words = "does not say the energy that the hand was given ('supplied')"
            raise ParameterError("recording", f"{words}: it cannot be shown")

    def places(self, names: tuple[str, ...]) -> list[int]:
        """Return where columns stand."""
        return [self._names.index(name) for name in names]

    def table(self, rows: FloatArray) -> FloatArray:
        """Return rows with ``COLUMNS`` and ``ANCHOR``."""
        place = np.ascontiguousarray(rows[:, self.places(_PLACE)])
        made = {
            "share": np.ones(len(rows)),
            "supplied": rows[:, self.places(tuple(self._parts))].sum(axis=1),
            **{f"anchor {axis}": np.full(len(rows), np.nan) for axis in "xyz"},
        }
        if "inside" not in self._names:
            made["inside"] = self._inside(place).astype(float)
        for axis in "xyz":
            made[f"commanded {axis}"] = rows[:, self._names.index(f"applied {axis}")]
        own = {name: rows[:, k] for k, name in enumerate(self._names)}
        blank = np.zeros(len(rows))
        return np.column_stack(
            [own.get(name, made.get(name, blank)) for name, _unit in (*COLUMNS, *ANCHOR)]
        )

    def _inside(self, place: FloatArray) -> Any:
        """Return whether probes are in contact (n,)."""
        if not self._surface.law.contact.begins_on_texture:
            return place[:, 2] < 0.0
        return place[:, 2] < self._surface.texture.height(place[:, :2])

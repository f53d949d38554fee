"""Rows of a loop for replay on the page, in chunks."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.lab.messages import COLUMN_NAMES
from asperity.loop.shared_trace import COLUMNS
from asperity.recording.recording import Recording
from asperity.recording.row_encoding import Columns
from asperity.surface import Surface
from asperity.textures.texture import Texture

CHUNK_ROWS = 8192
"""Rows of a chunk: the page stores some chunks, never all."""
FORCE_BINS = 600
"""Bins of the whole duration, each with the least and the greatest force."""
NEAREST_POINT_INTERVAL = 5e-3
"""Interval of closest points [s]."""
ANCHOR_COLUMNS = tuple((f"anchor {axis}", "m") for axis in "xyz")
"""Columns of the hand, which follow those of the loop."""

_POSITION_COLUMNS = ("x", "y", "z")
_FORCE_COLUMNS = ("applied x", "applied y", "applied z")


@dataclass(frozen=True)
class Playback:
    """Rows of a loop in chunks.

    Attributes:
        texture: the texture below the probe.
        period: from row to row [s].
        row_count: number of rows.
        read_rows: returns rows first to end, with ``COLUMNS`` and ``ANCHOR_COLUMNS``.
        force_range: least and greatest magnitude of the force [N] per bin, shape (bins, 2).
    """

    texture: Texture
    period: float
    row_count: int
    read_rows: Callable[[int, int], FloatArray] = field(repr=False)
    force_range: FloatArray = field(repr=False)

    def chunk(self, number: int) -> bytes:
        """Return a chunk: rows of the loop, closest point and hand [m]."""
        rows = self.read_rows(number * CHUNK_ROWS, (number + 1) * CHUNK_ROWS)
        step = max(1, round(NEAREST_POINT_INTERVAL / self.period))
        closest = self.texture.nearest(rows[::step, 1:4])
        closest = np.repeat(closest, step, axis=0)[: len(rows)]
        hand = len(COLUMNS)
        return np.column_stack([rows[:, :hand], closest, rows[:, hand:]]).tobytes()

    @property
    def chunk_count(self) -> int:
        """Number of chunks."""
        return math.ceil(self.row_count / CHUNK_ROWS)

    def to_dict(self) -> dict[str, Any]:
        """Return the description for the page."""
        return {
            "row_count": self.row_count,
            "period": self.period,
            "chunk_rows": CHUNK_ROWS,
            "row_width": len(COLUMNS) + 2 * len(ANCHOR_COLUMNS),
            "force_ranges": self.force_range.round(6).tolist(),
        }


def make_playback(table: FloatArray, period: float, texture: Texture) -> Playback:
    """Return rows in memory, with ``COLUMNS`` and ``ANCHOR_COLUMNS``, shape (n, columns)."""
    force = _ForceRange(len(table))
    force.update(table, [COLUMN_NAMES.index(name) for name in _FORCE_COLUMNS])
    return Playback(texture, period, len(table), lambda first, end: table[first:end], force.bins)


def load_playback(recording: Recording, surface: Surface) -> Playback:
    """Return the rows of a recording, all of which are read once and validated.

    Columns that are not recorded are computed: contact from position and surface, the supplied
    energy from its components. Without a recorded hand its position is NaN.

    Args:
        recording: of a run or a simulation.
        surface: the surface of the recording.

    Raises:
        ParameterError: for a recording without rows or a required column, with a damaged block,
            values that are not finite, or times that do not increase.
    """
    layout = _ColumnLayout(recording.columns, surface)
    if recording.rows < 2:
        raise ParameterError("recording", f"{recording.path} has {recording.rows} rows, too few")
    force = _ForceRange(recording.rows)
    before = -math.inf
    required = layout.indices((*_POSITION_COLUMNS, *_FORCE_COLUMNS))
    for block in recording.blocks():
        times = block[:, 0]
        if not (np.isfinite(block[:, required]).all() and np.isfinite(times).all()):
            raise ParameterError("recording", f"{recording.path} has values that are not finite")
        if times[0] <= before or (np.diff(times) <= 0.0).any():
            raise ParameterError("recording", f"{recording.path} has times that do not increase")
        before = float(times[-1])
        force.update(block, layout.indices(_FORCE_COLUMNS))
    period = recording.duration / (recording.rows - 1)

    def read_rows(first: int, end: int) -> FloatArray:
        return layout.arrange(recording.row_range(first, end))

    return Playback(surface.texture, period, recording.rows, read_rows, force.bins)


class _ForceRange:
    """Least and greatest magnitude of the force in equal parts of a number of rows."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._processed = 0
        self.bins = np.tile([np.inf, 0.0], (min(FORCE_BINS, count), 1))

    def update(self, rows: FloatArray, columns: list[int]) -> None:
        """Process the next rows, whose force is in these columns."""
        size = np.sqrt(np.square(rows[:, columns]).sum(axis=1))
        samples = np.arange(self._processed, self._processed + len(rows))
        numbers = samples * len(self.bins) // self._count
        np.minimum.at(self.bins[:, 0], numbers, size)
        np.maximum.at(self.bins[:, 1], numbers, size)
        self._processed += len(rows)


class _ColumnLayout:
    """Order of the columns of a recording for the page."""

    def __init__(self, columns: Columns, surface: Surface) -> None:
        self._names = [name for name, _unit in columns]
        self._surface = surface
        for name in (*_POSITION_COLUMNS, *_FORCE_COLUMNS):
            if name not in self._names:
                raise ParameterError("recording", f"has no column {name!r}: it cannot be shown")
        parts = tuple(f"supplied {axis}" for axis in "xyz")
        self._energy_columns = ("supplied",) if "supplied" in self._names else parts
        if not {*self._energy_columns} <= {*self._names}:
            missing = "has no column of the energy supplied to the hand ('supplied')"
            raise ParameterError("recording", f"{missing}: it cannot be shown")

    def indices(self, names: tuple[str, ...]) -> list[int]:
        """Return the indices of columns."""
        return [self._names.index(name) for name in names]

    def arrange(self, rows: FloatArray) -> FloatArray:
        """Return rows with ``COLUMNS`` and ``ANCHOR_COLUMNS``."""
        positions = np.ascontiguousarray(rows[:, self.indices(_POSITION_COLUMNS)])
        computed = {
            "share": np.ones(len(rows)),
            "supplied": rows[:, self.indices(self._energy_columns)].sum(axis=1),
            **{f"anchor {axis}": np.full(len(rows), np.nan) for axis in "xyz"},
            **{
                f"commanded {axis}": rows[:, self._names.index(f"applied {axis}")] for axis in "xyz"
            },
        }
        if "inside" not in self._names:
            texture = self._surface.texture
            contact = self._surface.law.contact
            tops = contact.contact_height(texture, positions[:, :2])
            computed["inside"] = (positions[:, 2] < tops).astype(float)
        zeros = np.zeros(len(rows))
        columns = computed | {name: rows[:, k] for k, name in enumerate(self._names)}
        names = (name for name, _unit in (*COLUMNS, *ANCHOR_COLUMNS))
        return np.column_stack([columns.get(name, zeros) for name in names])

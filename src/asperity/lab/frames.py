"""What goes to the page: rows of the loop as frames, none of whose extremes is lost.

A frame holds the newest row, and of each column the least and the greatest of all rows since the
frame before: a buzz of 800 Hz between two frames shows as a band, never as a slow wave. The forces
of all these rows follow, for the spectrum and for the ear. All numbers are doubles.

``way`` and ``squares`` are the sums of |Δp| [m] and |Δp|² [m²] from row to row, by which steps and
sampling can feed the hand; ``jump`` is the greatest change of the law's force from a row to the
next [N], and ``moved`` how far the probe went with it [m].
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.servo.kernels.published import COLUMNS

STATE, RELIEF, CUT = 1.0, 2.0, 3.0
"""First number of a message: what it is."""

NAMES = tuple(name for name, _unit in COLUMNS)
FORCES = slice(NAMES.index("applied x"), NAMES.index("applied z") + 1)
_PLACE = slice(NAMES.index("x"), NAMES.index("z") + 1)
_LAW = slice(NAMES.index("commanded x"), NAMES.index("commanded z") + 1)
HEAD = (
    "kind", "frame", "rows", "first", "heard", "late", "skipped", "forces", "way", "squares",
    "jump", "moved",
)  # fmt: skip
PLACES = ("god x", "god y", "god z", "hand x", "hand y", "hand z")
MOST_FORCES = 2048
"""Rows whose forces go with a frame, the newest."""


def layout() -> dict[str, Any]:
    """Return where each number of a frame stands, for the page."""
    columns = len(NAMES)
    after = len(HEAD) + len(PLACES)
    return {
        "head": {name: place for place, name in enumerate((*HEAD, *PLACES))},
        "columns": {name: place for place, name in enumerate(NAMES)},
        "newest": after, "least": after + columns, "greatest": after + 2 * columns,
        "forces": after + 3 * columns,
    }  # fmt: skip


def frame(rows: FloatArray, first: int, counts: Mapping[str, float], places: FloatArray) -> bytes:
    """Return rows of a loop as a frame.

    Args:
        rows: at least one, as ``kernels.published.COLUMNS`` has them.
        first: number of the first of them.
        counts: ``frame`` (its number), ``heard``, ``late`` and ``skipped``.
        places: of god-object and hand (6,) [m].
    """
    forces = rows[-MOST_FORCES:, FORCES]
    said = {
        "kind": STATE, "rows": len(rows), "first": first, "forces": len(forces), **counts,
        **steps(rows),
    }  # fmt: skip
    head = [float(said[name]) for name in HEAD]
    parts = (head, places, rows[-1], rows.min(axis=0), rows.max(axis=0), forces.ravel())
    return np.concatenate(parts).tobytes()


def steps(rows: FloatArray) -> dict[str, float]:
    """Return what happened from row to row: ``way``, ``squares``, ``jump``, ``moved``."""
    if len(rows) < 2:
        return {"way": 0.0, "squares": 0.0, "jump": 0.0, "moved": 0.0}
    squares = np.square(np.diff(rows[:, _PLACE], axis=0)).sum(axis=1)
    jumps = np.square(np.diff(rows[:, _LAW], axis=0)).sum(axis=1)
    most = int(jumps.argmax())
    return {
        "way": float(np.sqrt(squares).sum()), "squares": float(squares.sum()),
        "jump": float(jumps[most] ** 0.5), "moved": float(squares[most] ** 0.5),
    }  # fmt: skip

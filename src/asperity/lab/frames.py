"""Binary messages to the page: frames of the loop, the relief of the surface, and a section.

A frame contains the newest row, and the least and greatest value of each column over all rows since
the previous frame: a buzz of 800 Hz between two frames appears as a band, not as an aliased slow
wave. The forces of all these rows follow, for spectrum and sound. All numbers are doubles.

``way`` and ``squares`` are the sums of |Δp| [m] and |Δp|² [m²] from row to row, which bound the
energy that steps and sampling can feed the hand; ``jump`` is the greatest change of the force of
the law between rows [N], and ``moved`` the displacement of the probe in that step [m].
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.loop.shared_trace import COLUMNS
from asperity.surface import Surface

STATE, RELIEF, SECTION = 1.0, 2.0, 3.0
"""First number of a message: its kind."""

COLUMN_NAMES = tuple(name for name, _unit in COLUMNS)
FORCE_COLUMNS = slice(COLUMN_NAMES.index("applied x"), COLUMN_NAMES.index("applied z") + 1)
_POSITION = slice(COLUMN_NAMES.index("x"), COLUMN_NAMES.index("z") + 1)
_LAW_FORCE = slice(COLUMN_NAMES.index("commanded x"), COLUMN_NAMES.index("commanded z") + 1)
HEADER = (
    *("kind", "frame", "rows", "first", "acknowledged", "late", "skipped", "forces"),
    *("way", "squares", "jump", "moved"),
)
POSITION_NAMES = ("god x", "god y", "god z", "hand x", "hand y", "hand z")
MAX_FORCE_ROWS = 2048
"""Greatest number of rows whose forces are in a frame, the newest."""


def frame_layout() -> dict[str, Any]:
    """Return the index of each number of a frame, for the page."""
    columns = len(COLUMN_NAMES)
    after = len(HEADER) + len(POSITION_NAMES)
    return {
        "head": {name: place for place, name in enumerate((*HEADER, *POSITION_NAMES))},
        "columns": {name: place for place, name in enumerate(COLUMN_NAMES)},
        "newest": after,
        "least": after + columns,
        "greatest": after + 2 * columns,
        "forces": after + 3 * columns,
    }


def encode_frame(
    rows: FloatArray, first: int, counts: Mapping[str, float], positions: FloatArray
) -> bytes:
    """Return rows of a loop as a frame.

    Args:
        rows: at least one, with the columns ``loop.shared_layout.COLUMNS``.
        first: number of the first row.
        counts: ``frame`` (its number), ``acknowledged``, ``late`` and ``skipped``.
        positions: of closest point and hand (6,) [m].
    """
    forces = rows[-MAX_FORCE_ROWS:, FORCE_COLUMNS]
    sizes = {"kind": STATE, "rows": len(rows), "first": first, "forces": len(forces)}
    values = {**sizes, **counts, **step_statistics(rows)}
    head = [float(values[name]) for name in HEADER]
    parts = (head, positions, rows[-1], rows.min(axis=0), rows.max(axis=0), forces.ravel())
    return np.concatenate(parts).tobytes()


def step_statistics(rows: FloatArray) -> dict[str, float]:
    """Return statistics of the steps from row to row: ``way``, ``squares``, ``jump``, ``moved``."""
    if len(rows) < 2:
        return {"way": 0.0, "squares": 0.0, "jump": 0.0, "moved": 0.0}
    squares = np.square(np.diff(rows[:, _POSITION], axis=0)).sum(axis=1)
    jumps = np.square(np.diff(rows[:, _LAW_FORCE], axis=0)).sum(axis=1)
    most = int(jumps.argmax())
    return {
        "way": float(np.sqrt(squares).sum()),
        "squares": float(squares.sum()),
        "jump": float(jumps[most] ** 0.5),
        "moved": float(squares[most] ** 0.5),
    }


RELIEF_POINTS = 96
"""Number of heights along each side of the relief."""
SECTION_COLUMNS, SECTION_ROWS = 72, 36
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


def encode_section(surface: Surface, box: tuple[float, float, float, float, float]) -> bytes:
    """Return a section along x, with the field and its curl, as a message.

    SECTION, PROFILE_POINTS, SECTION_COLUMNS, SECTION_ROWS, y and the box, then the heights [m],
    then row by row from the least z the forces along x, those along z [N] and the curl
    ∂f_x/∂z - ∂f_z/∂x [N/m]. A law with state is evaluated in its initial state.

    Args:
        surface: the surface.
        box: least and greatest x, least and greatest z, and y [m].
    """
    left, right, bottom, top, y = box
    line = np.linspace(left, right, PROFILE_POINTS)
    heights = surface.texture.height(np.column_stack([line, np.full(PROFILE_POINTS, y)]))
    xs, zs = np.meshgrid(
        np.linspace(left, right, SECTION_COLUMNS), np.linspace(bottom, top, SECTION_ROWS)
    )
    points = np.column_stack([xs.ravel(), np.full(xs.size, y), zs.ravel()])
    force, jacobian = evaluate_field(surface, points)
    curl = jacobian[:, 0, 2] - jacobian[:, 2, 0]
    head = [SECTION, PROFILE_POINTS, SECTION_COLUMNS, SECTION_ROWS, y, left, right, bottom, top]
    return np.concatenate([head, heights, force[:, 0], force[:, 2], curl]).tobytes()


def evaluate_field(surface: Surface, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return forces (n, 3) [N] and Jacobians (n, 3, 3) [N/m], NaN replaced by zero."""
    force, jacobian = surface.force_and_jacobian(points)
    return np.nan_to_num(force), np.nan_to_num(jacobian)

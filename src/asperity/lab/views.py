"""What the page shows behind the probe: the surface in relief, and a cut with field and curl."""

from __future__ import annotations

import numpy as np

from asperity.checks import FloatArray
from asperity.lab.frames import CUT, RELIEF
from asperity.surface import Surface

SIDE = 96
"""Heights along each side of the relief."""
ACROSS, DEEP = 72, 36
"""Points of the field in a cut."""
LINE = 288
"""Heights along a cut."""


def relief(surface: Surface, x: float, y: float, size: float) -> bytes:
    """Return the heights of a square as a message.

    RELIEF, SIDE, x, y and size, then the heights row by row from the least y [m].

    Args:
        surface: what is shown.
        x: of the middle [m].
        y: likewise.
        size: of the side [m].
    """
    along = np.linspace(-0.5 * size, 0.5 * size, SIDE)
    xs, ys = np.meshgrid(x + along, y + along)
    heights = surface.texture.height(np.column_stack([xs.ravel(), ys.ravel()]))
    return np.concatenate([[RELIEF, SIDE, x, y, size], heights]).tobytes()


def cut(surface: Surface, box: tuple[float, float, float, float, float]) -> bytes:
    """Return a cut along x, with the field and its curl, as a message.

    CUT, LINE, ACROSS, DEEP, y and the box, then LINE heights [m], then row by row from the least
    z the forces along x and z [N] and the curl ∂f_x/∂z - ∂f_z/∂x [N/m]. Of a law that carries a
    state it is the field of a probe that has just touched.

    Args:
        surface: what is shown.
        box: least and greatest x, least and greatest z, and y [m].
    """
    left, right, bottom, top, y = box
    line = np.linspace(left, right, LINE)
    heights = surface.texture.height(np.column_stack([line, np.full(LINE, y)]))
    xs, zs = np.meshgrid(np.linspace(left, right, ACROSS), np.linspace(bottom, top, DEEP))
    points = np.column_stack([xs.ravel(), np.full(xs.size, y), zs.ravel()])
    force, jacobian = field(surface, points)
    curl = jacobian[:, 0, 2] - jacobian[:, 2, 0]
    head = [CUT, LINE, ACROSS, DEEP, y, left, right, bottom, top]
    return np.concatenate([head, heights, force[:, 0], force[:, 2], curl]).tobytes()


def field(surface: Surface, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return forces (n, 3) [N] and Jacobians (n, 3, 3) [N/m]; zero where they are no numbers."""
    force, jacobian = surface.force_and_jacobian(points)
    return np.nan_to_num(force), np.nan_to_num(jacobian)

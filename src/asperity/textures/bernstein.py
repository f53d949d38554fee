"""Certified extremes of a spline surface: hulls of Bernstein coefficients, subdivided."""

from __future__ import annotations

import numpy as np

from asperity.checks import FloatArray

# One cubic B-spline segment -> its Bernstein coefficients.
_TO_BERNSTEIN = np.array([[1, 4, 1, 0], [0, 4, 2, 0], [0, 2, 4, 0], [0, 1, 4, 1]]) / 6.0
# De Casteljau at the middle: the left and the right half.
_LEFT = np.array([[8, 0, 0, 0], [4, 4, 0, 0], [2, 4, 2, 0], [1, 3, 3, 1]]) / 8.0
_RIGHT = _LEFT[::-1, ::-1]
_ROWS_AT_ONCE = 256
# Where so many cells are equally high (along a groove), the hull of what is left is the answer.
_MOST_CELLS = 60_000


def greatest_height(coefficients: FloatArray) -> float:
    """Return the greatest value of a bicubic B-spline over all its cells.

    A polynomial lies in the hull of its Bernstein coefficients, and meets them at the corners:
    the hull gives an upper bound of each cell, the corners a lower bound of the maximum. Cells
    that can still hold more are quartered until both agree to rounding.

    Args:
        coefficients: B-spline coefficients [m], shape (ny + 3, nx + 3) for ny × nx cells.
    """
    best = _greatest_node(coefficients)
    kept: list[FloatArray] = []
    for first in range(0, coefficients.shape[0] - 3, _ROWS_AT_ONCE):
        rows = coefficients[first : first + _ROWS_AT_ONCE + 3]
        # The hull of the 16 coefficients of a cell, cheaper than its Bernstein coefficients.
        hull = np.max([rows[i : rows.shape[0] - 3 + i] for i in range(4)], axis=0)
        hull = np.max([hull[:, j : hull.shape[1] - 3 + j] for j in range(4)], axis=0)
        windows = np.lib.stride_tricks.sliding_window_view(rows, (4, 4))[hull > best]
        patches = _TO_BERNSTEIN @ windows @ _TO_BERNSTEIN.T
        kept.append(patches[patches.max(axis=(1, 2), initial=-np.inf) > best])
    patches = np.concatenate(kept)
    scale = max(float(np.abs(coefficients).max()), 1e-300)
    for _ in range(60):
        patches = patches[patches.max(axis=(1, 2)) > best + 1e-15 * scale]
        if len(patches) == 0 or len(patches) > _MOST_CELLS:
            break
        patches = np.concatenate(
            [rows @ patches @ columns.T for rows in (_LEFT, _RIGHT) for columns in (_LEFT, _RIGHT)]
        )
        best = max(best, float(patches[:, ::3, ::3].max()))
    return max(best, float(patches.max())) if len(patches) else best


def _greatest_node(coefficients: FloatArray) -> float:
    """Return the greatest height at a node, where the spline is (1 4 1)/6 of coefficients."""
    best = -np.inf
    for first in range(0, coefficients.shape[0] - 2, _ROWS_AT_ONCE):
        c = coefficients[first : first + _ROWS_AT_ONCE + 2]
        rows = (c[:-2] + 4.0 * c[1:-1] + c[2:]) / 6.0
        best = max(best, float(((rows[:, :-2] + 4.0 * rows[:, 1:-1] + rows[:, 2:]) / 6.0).max()))
    return best

"""Height maps evaluated at blocks of points: no branches, and one index into the coefficients.

These functions replace those of the same names: the compiler then vectorises over the points and
gathers their coefficients. Products and sums are fused where the processor can.
"""

from typing import Any

import numpy as np

from asperity.core.compiled import FloatArray, Kernels, load_unchecked, multiply_add
from asperity.textures.spline.bspline_kernels import Vector4

KERNELS = Kernels(provides=("find_cell", "dot4", "row_sums"), for_blocks=True)


def find_cell(
    x: float, start: float, per_metre: float, cells: int, periodic: bool
) -> tuple[float, float, float]:
    """Return the cell of x, the position in it and the sign of derivatives, without branches."""
    length = float(cells) if periodic else 2.0 * cells
    u = (x - start) * per_metre
    u = multiply_add(-length, np.floor(u * (1.0 / length)), u)
    back = u > cells
    u = length - u if back else u
    u = u if u > 0.0 else 0.0  # NaN as well: x may be beyond all cells
    cell = min(np.floor(u), cells - 1.0)
    return cell, u - cell, -1.0 if back else 1.0


def dot4(a: Vector4, b: Vector4) -> float:
    """Return the sum of four products, fused."""
    first = multiply_add(a[1], b[1], a[0] * b[0])
    return multiply_add(a[3], b[3], multiply_add(a[2], b[2], first))


def coefficients_at(c: FloatArray, index: Any) -> Vector4:
    """Return four adjacent coefficients."""
    # Unsigned indices are not checked for counting from the end.
    second = load_unchecked(c, index + np.uint64(1))
    third = load_unchecked(c, index + np.uint64(2))
    return load_unchecked(c, index), second, third, load_unchecked(c, index + np.uint64(3))


def row_sums(c: FloatArray, i: float, j: float, w: Vector4) -> Vector4:
    """Return the weighted sums of four coefficients in each of four rows from i on."""
    row = np.uint64(c.shape[1])
    at = np.uint64(np.int64(multiply_add(i, c.shape[1], j)))
    return (
        dot4(w, coefficients_at(c, at)),
        dot4(w, coefficients_at(c, at + row)),
        dot4(w, coefficients_at(c, at + (row + row))),
        dot4(w, coefficients_at(c, at + (row + row + row))),
    )

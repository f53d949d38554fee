"""h = Σ c_ij β(x/p_x - j) β(y/p_y - i), a bicubic B-spline."""

from asperity.contacts.sampler_interface import Derivatives
from asperity.core.compiled import EVERY_FUNCTION, FloatArray, Kernels
from asperity.textures.spline.bspline_kernels import (
    SplineArguments,
    Vector4,
    bspline_first_weights,
    bspline_second_weights,
    bspline_weights,
    cell_counts,
    dot4,
    find_cell,
)

KERNELS = Kernels(provides=EVERY_FUNCTION)


def row_sum(c: FloatArray, i: int, j: int, w: Vector4) -> float:
    """Return the weighted sum of four coefficients of row i from column j on."""
    return dot4(w, (c[i, j], c[i, j + 1], c[i, j + 2], c[i, j + 3]))


def row_sums(c: FloatArray, i: int, j: int, w: Vector4) -> Vector4:
    """Return the weighted sums of four coefficients in each of four rows from i on."""
    return (
        row_sum(c, i, j, w),
        row_sum(c, i + 1, j, w),
        row_sum(c, i + 2, j, w),
        row_sum(c, i + 3, j, w),
    )


def sample_height(x: float, y: float, texture: SplineArguments) -> float:
    """Return h [m]."""
    nx, ny = cell_counts(texture)
    j, t, _sx = find_cell(x, texture.x0, texture.ix, nx, texture.periodic)
    i, r, _sy = find_cell(y, texture.y0, texture.iy, ny, texture.periodic)
    return dot4(bspline_weights(r), row_sums(texture.c, i, j, bspline_weights(t)))


def sample_gradient(x: float, y: float, texture: SplineArguments) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    nx, ny = cell_counts(texture)
    j, t, sx = find_cell(x, texture.x0, texture.ix, nx, texture.periodic)
    i, r, sy = find_cell(y, texture.y0, texture.iy, ny, texture.periodic)
    rows = row_sums(texture.c, i, j, bspline_weights(t))
    w = bspline_weights(r)
    hx = sx * texture.ix * dot4(w, row_sums(texture.c, i, j, bspline_first_weights(t)))
    return dot4(w, rows), hx, sy * texture.iy * dot4(bspline_first_weights(r), rows)


def sample_hessian(x: float, y: float, texture: SplineArguments) -> Derivatives:
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    nx, ny = cell_counts(texture)
    j, t, sx = find_cell(x, texture.x0, texture.ix, nx, texture.periodic)
    i, r, sy = find_cell(y, texture.y0, texture.iy, ny, texture.periodic)
    rows = row_sums(texture.c, i, j, bspline_weights(t))
    first = row_sums(texture.c, i, j, bspline_first_weights(t))
    second = row_sums(texture.c, i, j, bspline_second_weights(t))
    w = bspline_weights(r)
    d = bspline_first_weights(r)
    return (
        dot4(w, rows),
        sx * texture.ix * dot4(w, first),
        sy * texture.iy * dot4(d, rows),
        texture.ix * texture.ix * dot4(w, second),
        sx * sy * texture.ix * texture.iy * dot4(d, first),
        texture.iy * texture.iy * dot4(bspline_second_weights(r), rows),
    )

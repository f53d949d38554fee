"""h = Σ c_j β(x/p_x - j), a cubic B-spline profile; constant along y."""

from asperity.contacts.sampler_interface import Derivatives
from asperity.core.compiled import EVERY_FUNCTION, Kernels
from asperity.textures.spline.bspline_kernels import (
    SplineArguments,
    Vector4,
    bspline_first_weights,
    bspline_second_weights,
    bspline_weights,
    dot4,
    find_cell,
)

KERNELS = Kernels(provides=EVERY_FUNCTION)


def local_coefficients(x: float, texture: SplineArguments) -> tuple[Vector4, float, float]:
    """Return the four coefficients at x, the position in its cell and the sign of the slope."""
    c = texture.c
    j, t, sign = find_cell(x, texture.x0, texture.ix, c.size - 3, texture.periodic)
    return (c[0, j], c[0, j + 1], c[0, j + 2], c[0, j + 3]), t, sign


def sample_height(x: float, y: float, texture: SplineArguments) -> float:
    """Return h [m]."""
    c, t, _sign = local_coefficients(x, texture)
    return dot4(bspline_weights(t), c)


def sample_gradient(x: float, y: float, texture: SplineArguments) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    c, t, sign = local_coefficients(x, texture)
    return dot4(bspline_weights(t), c), sign * texture.ix * dot4(bspline_first_weights(t), c), 0.0


def sample_hessian(x: float, y: float, texture: SplineArguments) -> Derivatives:
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    c, t, sign = local_coefficients(x, texture)
    hx = sign * texture.ix * dot4(bspline_first_weights(t), c)
    hxx = texture.ix * texture.ix * dot4(bspline_second_weights(t), c)
    return dot4(bspline_weights(t), c), hx, 0.0, hxx, 0.0, 0.0

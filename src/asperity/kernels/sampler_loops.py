"""Loops over points of the plane, or of space, that ask a sampler alone."""

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.contacts.sampler import curvature, foot, height, slope

KERNELS = Kernels(
    requires=("curvature", "foot", "height", "slope"),
    loops=("curvature_batch", "height_batch", "nearest_batch", "slope_batch"),
)


def height_batch(points: FloatArray, out: FloatArray, texture: object) -> None:
    """Write the heights [m] at points (n, 2) [m]."""
    for i in range(points.shape[0]):
        out[i, 0] = height(points[i, 0], points[i, 1], texture)


def slope_batch(points: FloatArray, out: FloatArray, texture: object) -> None:
    """Write heights [m] and slopes at points (n, 2) [m]."""
    for i in range(points.shape[0]):
        out[i, 0], out[i, 1], out[i, 2] = slope(points[i, 0], points[i, 1], texture)


def curvature_batch(points: FloatArray, out: FloatArray, texture: object) -> None:
    """Write heights [m], slopes and second derivatives [1/m] at points (n, 2) [m]."""
    for i in range(points.shape[0]):
        values = curvature(points[i, 0], points[i, 1], texture)
        for d in range(6):
            out[i, d] = values[d]


def nearest_batch(points: FloatArray, out: FloatArray, texture: object) -> None:
    """Write the nearest surface points, x and y [m], of probes (n, 3) [m]."""
    for i in range(points.shape[0]):
        out[i, 0], out[i, 1], _h, _hx, _hy = foot(points[i, 0], points[i, 1], points[i, 2], texture)

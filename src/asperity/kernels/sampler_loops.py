"""Loops over points that call a sampler only."""

from asperity.contacts.sampler_interface import (
    closest_point,
    sample_gradient,
    sample_height,
    sample_hessian,
)
from asperity.core.compiled import FloatArray, Kernels

KERNELS = Kernels(loops=("curvature_batch", "height_batch", "nearest_batch", "slope_batch"))


def height_batch(points: FloatArray, out: FloatArray, texture: object) -> None:
    """Write the heights [m] at points (n, 2) [m]."""
    for i in range(points.shape[0]):
        out[i, 0] = sample_height(points[i, 0], points[i, 1], texture)


def slope_batch(points: FloatArray, out: FloatArray, texture: object) -> None:
    """Write heights [m] and slopes at points (n, 2) [m]."""
    for i in range(points.shape[0]):
        out[i, 0], out[i, 1], out[i, 2] = sample_gradient(points[i, 0], points[i, 1], texture)


def curvature_batch(points: FloatArray, out: FloatArray, texture: object) -> None:
    """Write heights [m], slopes and second derivatives [1/m] at points (n, 2) [m]."""
    for i in range(points.shape[0]):
        values = sample_hessian(points[i, 0], points[i, 1], texture)
        for d in range(6):
            out[i, d] = values[d]


def nearest_batch(points: FloatArray, out: FloatArray, texture: object) -> None:
    """Write x and y [m] of the closest surface points of probes (n, 3) [m]."""
    for i in range(points.shape[0]):
        out[i, 0], out[i, 1], _h, _hx, _hy = closest_point(
            points[i, 0], points[i, 1], points[i, 2], texture
        )

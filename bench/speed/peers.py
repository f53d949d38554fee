"""The polish of a nearest point that something else found, compiled like asperity's samplers."""

from asperity.contacts.sampler_interface import sample_hessian
from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels

KERNELS = Kernels(loops=("peer_polish_batch",))


def peer_polish(
    x: float, y: float, z: float, fx: float, fy: float, texture: object
) -> tuple[float, float]:
    """Return where Newton's method leads from a start near a minimum of the distance."""
    for _ in range(30):
        h, hx, hy, hxx, hxy, hyy = sample_hessian(fx, fy, texture)
        px = fx - x + (h - z) * hx
        py = fy - y + (h - z) * hy
        qxx = 1.0 + hx * hx + (h - z) * hxx
        qxy = hx * hy + (h - z) * hxy
        qyy = 1.0 + hy * hy + (h - z) * hyy
        det = qxx * qyy - qxy * qxy
        if det <= 0.0 or qxx + qyy <= 0.0:
            break
        sx = (qxy * py - qyy * px) / det
        sy = (qxy * px - qxx * py) / det
        fx += sx
        fy += sy
        if sx * sx + sy * sy <= 1e-20 * ((fx - x) * (fx - x) + (fy - y) * (fy - y)) + 1e-34:
            break
    return fx, fy


def peer_polish_batch(
    points: FloatArray, starts: FloatArray, out: FloatArray, texture: object
) -> None:
    """Write the polished feet (n, 2) of the probes (n, 3)."""
    for i in range(points.shape[0]):
        out[i, 0], out[i, 1] = peer_polish(
            points[i, 0], points[i, 1], points[i, 2], starts[i, 0], starts[i, 1], texture
        )

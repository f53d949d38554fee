"""Other ways to a nearest point, compiled like asperity's own samplers: plain scalar functions.

A polish from a start that something else found, and the downhill simplex of HAPI's depth-map
surfaces (its class HAPIVariableDepthSurface): at most 35 steps, started from the last proxy, the
probe's x, y and a third point beside the two, ended when the squared distances of the corners
agree to 1e-4.
"""

from asperity.contacts.sampler_interface import sample_height, sample_hessian
from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels

KERNELS = Kernels(loops=("peer_polish_batch", "peer_simplex_batch"))

Corner = tuple[float, float, float]


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


def peer_corner(x: float, y: float, z: float, fx: float, fy: float, texture: object) -> Corner:
    """Return a corner of the simplex: a point and its squared distance from the probe."""
    gap = sample_height(fx, fy, texture) - z
    return fx, fy, (fx - x) * (fx - x) + (fy - y) * (fy - y) + gap * gap


def peer_simplex(
    x: float, y: float, z: float, last_x: float, last_y: float, texture: object
) -> tuple[float, float]:
    """Return the lowest corner after at most 35 steps of Nelder and Mead's method."""
    half_x = 0.5 * (x - last_x)
    half_y = 0.5 * (y - last_y)
    low = peer_corner(x, y, z, last_x, last_y, texture)
    mid = peer_corner(x, y, z, x, y, texture)
    high = peer_corner(x, y, z, last_x + half_x + half_y, last_y + half_y - half_x, texture)
    for step in range(36):
        if mid[2] < low[2]:
            low, mid = mid, low
        if high[2] < low[2]:
            low, high = high, low
        if high[2] < mid[2]:
            mid, high = high, mid
        if 2.0 * (high[2] - low[2]) <= 1e-4 * (abs(high[2]) + abs(low[2])) or step == 35:
            break
        mx = low[0] + mid[0]
        my = low[1] + mid[1]
        new = peer_corner(x, y, z, mx - high[0], my - high[1], texture)
        if new[2] <= low[2]:
            far = peer_corner(x, y, z, 1.5 * mx - 2.0 * high[0], 1.5 * my - 2.0 * high[1], texture)
            high = far if far[2] < new[2] else new
        elif new[2] < mid[2]:
            high = new
        else:
            if new[2] < high[2]:
                high = new
            new = peer_corner(
                x, y, z, 0.25 * mx + 0.5 * high[0], 0.25 * my + 0.5 * high[1], texture
            )
            if new[2] < high[2]:
                high = new
            else:
                mid = peer_corner(
                    x, y, z, 0.5 * (low[0] + mid[0]), 0.5 * (low[1] + mid[1]), texture
                )
                high = peer_corner(
                    x, y, z, 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), texture
                )
    return low[0], low[1]


def peer_simplex_batch(
    points: FloatArray, last: FloatArray, out: FloatArray, texture: object
) -> None:
    """Write the feet (n, 2) of the probes (n, 3), from the last proxies (n, 2)."""
    for i in range(points.shape[0]):
        out[i, 0], out[i, 1] = peer_simplex(
            points[i, 0], points[i, 1], points[i, 2], last[i, 0], last[i, 1], texture
        )

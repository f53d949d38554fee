"""The compiled loop of :mod:`bench.stress.friction`: closed paths under friction that varies."""

import math

from asperity.core.compiled import FloatArray, Kernels
from asperity.kernels.loop_functions import drag_anchor, drag_anchor_in_space
from asperity.kernels.probe_functions import probe_slip

KERNELS = Kernels(loops=("closed_paths",))

# Numbers of a path: centre, then sine and cosine of three harmonics, x, y, z each.
SHAPE_SIZE = 21
TURNS = 3


def path_point(shapes: FloatArray, i: int, axis: int, phase: float) -> float:
    """Return a coordinate [m] of a path at a phase [rad]."""
    value: float = shapes[i, axis]
    for harmonic in range(1, 4):
        row = 6 * harmonic - 3 + axis
        value += shapes[i, row] * math.sin(harmonic * phase)
        value += shapes[i, row + 3] * (math.cos(harmonic * phase) - 1.0)
    return value


def closed_paths(
    shapes: FloatArray,
    noise: FloatArray,
    ticks: int,
    presliding: float,
    speed: float,
    reach: float,
    in_space: bool,
    out: FloatArray,
    warm_start: FloatArray,
    texture: object,
    law: object,
) -> None:
    """Write friction's work, its bound Σ κ|u|²/8 - ΔS, total work and k|Δp|²/8 of paths (n, 4) [J].

    Args:
        shapes: of the paths (n, ``SHAPE_SIZE``) [m].
        noise: factors of the slip limit, one per tick in turn.
        ticks: per turn.
        presliding: κ [N/m].
        speed: distance per tick at which the slip limit is halved [m]; 0 for no dependence.
        reach: greatest deflection [m] where κ follows the slip limit, as in F; 0 for constant κ.
        in_space: whether the anchor moves in three directions.
        out: result.
        warm_start: of the contact.
        texture: record of the texture.
        law: parameters of law and friction.
    """
    for i in range(shapes.shape[0]):
        ax = ay = az = px = py = pz = dx = dy = dz = fx = fy = fz = 0.0
        stiffness = presliding
        own = bound = total = coarse = 0.0
        for tick in range(TURNS * ticks + 1):
            phase = 2.0 * math.pi * (tick % ticks) / ticks
            x = path_point(shapes, i, 0, phase)
            y = path_point(shapes, i, 1, phase)
            z = path_point(shapes, i, 2, phase)
            gx, gy, gz, limit = probe_slip(x, y, z, warm_start, texture, law)
            limit *= noise[(7919 * i + tick) % noise.shape[0]]
            ux = x - px
            uy = y - py
            uz = z - pz
            if speed > 0.0 and tick > 0:
                limit /= 1.0 + math.sqrt(ux * ux + uy * uy) / speed
            before = stiffness
            if reach > 0.0:
                stiffness = limit / reach
            longest = limit / stiffness if stiffness > 0.0 else 0.0
            old_x = dx
            old_y = dy
            old_z = dz
            if in_space:
                ax, ay, az, dx, dy, dz = drag_anchor_in_space(
                    x, y, z, tick > 0, ax, ay, az, gx, gy, gz, longest
                )
            else:
                ax, ay, dx, dy = drag_anchor(x, y, tick > 0, ax, ay, longest)
            if tick > 0:
                square = ux * ux + uy * uy
                if in_space:
                    square += uz * uz
                old = old_x * ux + old_y * uy + old_z * uz
                own -= 0.5 * (before * old + stiffness * (dx * ux + dy * uy + dz * uz))
                bound += presliding * square / 8.0
                coarse += ux * ux + uy * uy + uz * uz
                total += 0.5 * ((fx + gx) * ux + (fy + gy) * uy + (fz + gz) * uz)
            px = x
            py = y
            pz = z
            fx = gx
            fy = gy
            fz = gz
        out[i, 0] = own
        out[i, 1] = bound - 0.5 * presliding * (dx * dx + dy * dy + dz * dz)
        out[i, 2] = total + own
        out[i, 3] = coarse / 8.0

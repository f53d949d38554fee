"""The hand on a body that is integrated: a spring to its anchor, or a band to a far end."""

import math
from typing import Any

from asperity.compiled import Kernels

KERNELS = Kernels(provides=("band_turns", "hand_energy", "hand_force"))


def hand_force(
    sx: float, sy: float, sz: float,
    rx: float, ry: float, rz: float,
    hand: Any,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Force of spring and damper, or band, on the handle [N], and its loss [W].

    s = a - p and r = u - p' (anchor less handle); hand: 0 whether a band, 1-3 stiffness, 4-6
    damping, 7-9 constant force, 10 length at the anchor, 11 rest length.
    """
    fx = hand[4] * rx
    fy = hand[5] * ry
    fz = hand[6] * rz
    lost = fx * rx + fy * ry + fz * rz
    if hand[0] > 0.0:
        sz -= hand[10]
        length = math.sqrt(sx * sx + sy * sy + sz * sz)
        if length > hand[11]:
            pull = hand[1] * (length - hand[11]) / length
            fx += pull * sx
            fy += pull * sy
            fz += pull * sz
        return fx, fy, fz, lost
    return fx + hand[1] * sx, fy + hand[2] * sy, fz + hand[3] * sz, lost


def band_turns(
    sx: float, sy: float, sz: float, tx: float, ty: float, tz: float, hand: Any
) -> bool:  # fmt: skip
    """Whether a band is slack at one of two places s = a - p and t, and taut at the other."""
    if hand[0] == 0.0:
        return False
    sz -= hand[10]
    tz -= hand[10]
    rest = hand[11] * hand[11]
    return (sx * sx + sy * sy + sz * sz > rest) != (tx * tx + ty * ty + tz * tz > rest)  # type: ignore[no-any-return]  # arrays are untyped for Numba


def hand_energy(sx: float, sy: float, sz: float, hand: Any) -> float:
    """Energy of the spring or the band [J], for s = a - p."""
    if hand[0] > 0.0:
        sz -= hand[10]
        length = math.sqrt(sx * sx + sy * sy + sz * sz)
        over = max(length - hand[11], 0.0)
        return float(0.5 * hand[1] * over * over)
    return float(0.5 * (hand[1] * sx * sx + hand[2] * sy * sy + hand[3] * sz * sz))

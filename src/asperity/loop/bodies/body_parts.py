"""What bodies share: the hand that holds them, and dry friction."""

import math
from typing import NamedTuple

from asperity.core.compiled import FloatArray, Kernels

KERNELS = Kernels(provides=("band_changes_state", "friction_force", "hand_energy", "hand_force"))

Triple = tuple[float, float, float]


class HandRecord(NamedTuple):
    """A hand: a spring to its anchor, or an elastic band to its far end.

    Attributes:
        is_band: whether it is a band.
        stiffness: per axis; of a band the same three times [N/m].
        damping: likewise [N s/m].
        force: constant force [N].
        length: of the band, from its far end down to the anchor [m].
        rest_length: of the band [m].
    """

    is_band: bool
    stiffness: Triple
    damping: Triple
    force: Triple
    length: float
    rest_length: float


def hand_force(
    sx: float, sy: float, sz: float, rx: float, ry: float, rz: float, hand: HandRecord
) -> tuple[float, float, float, float]:
    """Return the force of spring and damper, or band, on the handle [N], and its loss [W].

    s = a - p and r = u - p' (anchor less handle).
    """
    fx = hand.damping[0] * rx
    fy = hand.damping[1] * ry
    fz = hand.damping[2] * rz
    lost = fx * rx + fy * ry + fz * rz
    if hand.is_band:
        sz -= hand.length
        length = math.sqrt(sx * sx + sy * sy + sz * sz)
        if length > hand.rest_length:
            pull = hand.stiffness[0] * (length - hand.rest_length) / length
            fx += pull * sx
            fy += pull * sy
            fz += pull * sz
        return fx, fy, fz, lost
    fx += hand.stiffness[0] * sx
    fy += hand.stiffness[1] * sy
    fz += hand.stiffness[2] * sz
    return fx, fy, fz, lost


def band_changes_state(
    sx: float, sy: float, sz: float, tx: float, ty: float, tz: float, hand: HandRecord
) -> bool:
    """Return whether a band is slack at one of two places s = a - p and t, taut at the other."""
    if not hand.is_band:
        return False
    sz -= hand.length
    tz -= hand.length
    rest = hand.rest_length * hand.rest_length
    return (sx * sx + sy * sy + sz * sz > rest) != (tx * tx + ty * ty + tz * tz > rest)


def hand_energy(sx: float, sy: float, sz: float, hand: HandRecord) -> float:
    """Return the energy of the spring or the band [J], for s = a - p."""
    if hand.is_band:
        sz -= hand.length
        length = math.sqrt(sx * sx + sy * sy + sz * sz)
        over = max(length - hand.rest_length, 0.0)
        return float(0.5 * hand.stiffness[0] * over * over)
    x, y, z = hand.stiffness
    return float(0.5 * (x * sx * sx + y * sy * sy + z * sz * sz))


def friction_force(
    vx: float, vy: float, vz: float, friction: float, stopping_mass: FloatArray, substep: float
) -> tuple[float, float, float]:
    """Return the dry friction [N] that stops the velocity within a part, or its limit against it.

    ``stopping_mass`` (3, 3) is the mass that it stops in the part's duration.
    """
    gx = -(stopping_mass[0, 0] * vx + stopping_mass[0, 1] * vy + stopping_mass[0, 2] * vz) / substep
    gy = -(stopping_mass[1, 0] * vx + stopping_mass[1, 1] * vy + stopping_mass[1, 2] * vz) / substep
    gz = -(stopping_mass[2, 0] * vx + stopping_mass[2, 1] * vy + stopping_mass[2, 2] * vz) / substep
    speed = math.sqrt(vx * vx + vy * vy + vz * vz)
    if gx * gx + gy * gy + gz * gz <= friction * friction or speed == 0.0:
        return gx, gy, gz
    share = -friction / speed
    return share * vx, share * vy, share * vz

"""What stands between law and motor: limits of length and slew, and the energy that is given.

The observer adds up what the hand was given, E += f·Δp with the force that was held over the
sample and the way that was measured: for a force held from sample to sample this is the exact work,
which needs no velocity. The controller takes it back by damping: over the next sample
α = E/(T v²) dissipates α v² T = E.

Reference:
    Hannaford and Ryu, "Time-domain passivity control of haptic interfaces", IEEE Transactions on
    Robotics and Automation 18(1), 2002, section II: observer (4), controller (9) for a device that
    measures motion and displays force. Sum by way instead of velocity: Stramigioli, Secchi, van der
    Schaft and Fantuzzi, "Sampled data systems passivity and discrete port-Hamiltonian systems",
    IEEE Transactions on Robotics 21(4), 2005.
"""

import math
from typing import NamedTuple

from asperity.compiled import Kernels

KERNELS = Kernels(provides=("controlled", "is_finite", "limited_length", "limited_slew"))


class Force(NamedTuple):
    """A force, and what was done to it.

    Attributes:
        x: [N].
        y: likewise.
        z: likewise.
        changed: whether a limit acted.
    """

    x: float
    y: float
    z: float
    changed: bool


def is_finite(x: float, y: float, z: float) -> bool:
    """Whether three numbers are finite."""
    return abs(x) + abs(y) + abs(z) < math.inf


def limited_length(x: float, y: float, z: float, longest: float) -> Force:
    """Shorten a force to a length [N]."""
    square = x * x + y * y + z * z
    if square <= longest * longest:
        return Force(x, y, z, False)
    # A few last bits shorter: rounding must not make it longer.
    share = (1.0 - 1e-15) * longest / math.sqrt(square)
    return Force(share * x, share * y, share * z, True)


def limited_slew(force: Force, hx: float, hy: float, hz: float, most: float) -> Force:
    """Move from the force that is held towards another one, by a length [N] at most."""
    dx = force.x - hx
    dy = force.y - hy
    dz = force.z - hz
    square = dx * dx + dy * dy + dz * dz
    if square <= most * most:
        return Force(force.x, force.y, force.z, False)
    share = (1.0 - 1e-15) * most / math.sqrt(square)
    return Force(hx + share * dx, hy + share * dy, hz + share * dz, True)


def controlled(energy: float, dx: float, dy: float, dz: float, period: float, most: float) -> float:
    """Return the damping [N s/m] that takes back an energy [J] over the next sample, or less.

    Args:
        energy: that the hand was given.
        dx: way of the last sample [m].
        dy: likewise.
        dz: likewise.
        period: T [s].
        most: damping [N s/m].
    """
    square = dx * dx + dy * dy + dz * dz
    if energy <= 0.0 or most <= 0.0 or square == 0.0:
        return 0.0
    return min(most, energy * period / square)

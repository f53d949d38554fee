"""What moves: a handle with mass and damping, the hand that holds it, a spring to its anchor.

Between two samples everything is linear, with a force held constant and an anchor that moves at
constant velocity, so the motion and every energy of it are exact: see ``exact.py``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from asperity.checks import FloatArray, positive, real
from asperity.errors import ParameterError
from asperity.files import Record
from asperity.simulation.hands import SpringHand


@dataclass(frozen=True)
class Resonance(Record):
    """The first structural mode: part of the mass hangs on a spring, away from motor and sensor.

    Attributes:
        frequency: of the free vibration of the two masses against each other [Hz].
        damping_ratio: of that mode [1].
        share: of the mass that hangs on the spring [1], between 0 and 1.
    """

    frequency: float
    damping_ratio: float = 0.02
    share: float = 0.5

    def __post_init__(self) -> None:
        positive("frequency", self.frequency, "Hz")
        if real("damping_ratio", self.damping_ratio) < 0.0:
            raise ParameterError("damping_ratio", "must not be negative", self.damping_ratio)
        if not 0.0 < real("share", self.share) < 1.0:
            raise ParameterError("share", "must be between 0 and 1", self.share)


@dataclass(frozen=True)
class Body:
    """A linear body: x' = A x + B f + C_a a + C_v v + G g, with the energies as quadratic forms.

    f is the force on the handle [N], a and v position and velocity of the hand's anchor, g the
    constant force of the hand. With z = (x, f, a, v, g) the stored energy is ½ zᵀ S z and the rate
    of loss zᵀ Q z; the anchor feeds the power v · N z. S and Q are symmetric.

    Attributes:
        dynamics: A, shape (n, n); the first three states are the handle's position [m], the next
            three its velocity [m/s]; then the same of the part that carries the hand, if it is
            another one.
        force: B, shape (n, 3).
        anchor: C_a and C_v side by side, shape (n, 6).
        press: G, shape (n, 3).
        storage: S, shape (n + 12, n + 12).
        loss: Q, shape (n + 12, n + 12).
        pull: N, the force of the anchor on the body, shape (3, n + 12).
    """

    dynamics: FloatArray
    force: FloatArray
    anchor: FloatArray
    press: FloatArray
    storage: FloatArray
    loss: FloatArray
    pull: FloatArray

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.dynamics)


def body(
    mass: ArrayLike, damping: ArrayLike, hand: SpringHand, resonance: Resonance | None = None
) -> Body:
    """Return the body of a device that a hand holds.

    M p'' = f - B p' + K_h (a - p) + B_h (v - p') + g; with a resonance the share of the device's
    mass and the hand hang on a spring from the part that motor and sensor see.

    Args:
        mass: of the device as felt at the handle [kg], one per axis.
        damping: B [N s/m], symmetric, positive semidefinite, shape (3, 3).
        hand: spring, damper, mass and constant force of the hand.
        resonance: first structural mode, alike along all axes.

    Example:
        >>> body([0.05] * 3, np.eye(3), SpringHand(stiffness=200.0)).order
        6
    """
    device, friction = np.diag(np.asarray(mass, dtype=float)), np.asarray(damping, dtype=float)
    spring, damper = np.diag(hand.stiffness), np.diag(hand.damping)
    if resonance is None:
        return _assembled(device + hand.mass * np.eye(3), friction, spring, damper)
    return _two_masses(device, friction, hand.mass, spring, damper, resonance)


class _Blocks:
    """Rows of z, three by three: ``blocks(r=1, p=-1)`` is the matrix of r - p."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self._names = names

    def __call__(self, **weights: float) -> FloatArray:
        matrix = np.zeros((3, 3 * len(self._names)))
        for name, weight in weights.items():
            first = 3 * self._names.index(name)
            matrix[:, first : first + 3] = weight * np.eye(3)
        return matrix


def _assembled(
    mass: FloatArray, friction: FloatArray, spring: FloatArray, damper: FloatArray
) -> Body:
    """One mass: x = (p, p')."""
    z = _Blocks(("p", "dp", "f", "a", "v", "g"))
    stretch, rate, speed = z(a=1.0, p=-1.0), z(v=1.0, dp=-1.0), z(dp=1.0)
    pull = spring @ stretch + damper @ rate
    rows = [speed, np.linalg.inv(mass) @ (z(f=1.0, g=1.0) - friction @ speed + pull)]
    storage = _form(mass, speed) + _form(spring, stretch)
    loss = _form(friction, speed) + _form(damper, rate)
    return _body(rows, storage, loss, pull)


def _two_masses(
    device: FloatArray,
    friction: FloatArray,
    held: float,
    spring: FloatArray,
    damper: FloatArray,
    resonance: Resonance,
) -> Body:
    """Two masses: x = (p, p', r, r'), r the part that hangs on a spring and carries the hand."""
    near = (1.0 - resonance.share) * device
    far = resonance.share * device + held * np.eye(3)
    reduced = near @ far @ np.linalg.inv(near + far)
    omega = 2.0 * np.pi * resonance.frequency
    inner, inner_damper = omega**2 * reduced, 2.0 * resonance.damping_ratio * omega * reduced
    z = _Blocks(("p", "dp", "r", "dr", "f", "a", "v", "g"))
    bend, bend_rate = z(r=1.0, p=-1.0), z(dr=1.0, dp=-1.0)
    stretch, rate = z(a=1.0, r=-1.0), z(v=1.0, dr=-1.0)
    pull = spring @ stretch + damper @ rate
    between = inner @ bend + inner_damper @ bend_rate
    rows = [
        z(dp=1.0),
        np.linalg.inv(near) @ (z(f=1.0) - friction @ z(dp=1.0) + between),
        z(dr=1.0),
        np.linalg.inv(far) @ (z(g=1.0) + pull - between),
    ]
    storage = _form(near, z(dp=1.0)) + _form(far, z(dr=1.0))
    storage += _form(inner, bend) + _form(spring, stretch)
    loss = _form(friction, z(dp=1.0)) + _form(inner_damper, bend_rate) + _form(damper, rate)
    return _body(rows, storage, loss, pull)


def _form(matrix: FloatArray, rows: FloatArray) -> FloatArray:
    return np.asarray(rows.T @ matrix @ rows)


def _body(rows: list[FloatArray], storage: FloatArray, loss: FloatArray, pull: FloatArray) -> Body:
    every = np.vstack(rows)
    n = len(every)
    return Body(
        every[:, :n], every[:, n : n + 3], every[:, n + 3 : n + 9], every[:, n + 9 :],
        storage, loss, pull,
    )  # fmt: skip

"""One sample of a body without coupling between its axes: small forms, written out.

Along one axis, relative to the anchor, with e = p - a, w = p' - u, F = f + g - b u and

    m w' = F - (b + b_h) w - K e,

the changes of e and w over a sample are linear in (e, w, F), and ∫ (b + b_h) w² dt is a quadratic
form. b p'² + b_h w² = (b + b_h) w² + 2 b u w + b u², and the impulse of the anchor's spring and
damper is m Δp' - (f + g) T + b Δp.
"""

# ruff: noqa: ARG001 - one signature for every body

from typing import Any

from asperity.compiled import Kernels
from asperity.simulation.kernels.booking import book_energies

KERNELS = Kernels(
    provides=("advance_axis", "advance_body", "stored_energy"), requires=("book_energies",)
)


def advance_axis(
    x: Any, i: int, f: float, a: float, u: float, table: Any
) -> tuple[float, float, float]:
    """Move along one axis; returns the displacement [m], loss and work of the hand [J].

    Row i of the table: 0-5 changes of e and w, 6-11 the loss in ee, ew, eF, ww, wF, FF,
    12 b, 13 m, 14 K, 15 g, 16 T.
    """
    p = x[i]
    v = x[3 + i]
    b = table[i, 12]
    span = table[i, 16]
    g = table[i, 15]
    e = p - a
    w = v - u
    push = f + g - b * u
    de = table[i, 0] * e + table[i, 1] * w + table[i, 2] * push
    dw = table[i, 3] * e + table[i, 4] * w + table[i, 5] * push
    dp = de + u * span
    lost = e * (table[i, 6] * e + table[i, 7] * w + table[i, 8] * push)
    lost += w * (table[i, 9] * w + table[i, 10] * push) + table[i, 11] * push * push
    lost += b * u * (de + dp)
    hand = u * (table[i, 13] * dw - (f + g) * span + b * dp) + g * dp
    x[i] = p + dp
    x[3 + i] = v + dw
    return dp, lost, hand


def advance_body(
    x: Any, ledger: Any,
    fx: float, fy: float, fz: float,
    ax: float, ay: float, az: float,
    ux: float, uy: float, uz: float,
    inside: bool, plant: Any,
) -> int:  # fmt: skip
    """Move the body over one sample; see ``kernels/__init__.py``. plant: the table."""
    (table,) = plant
    dx, lost_x, hand_x = advance_axis(x, 0, fx, ax, ux, table)
    dy, lost_y, hand_y = advance_axis(x, 1, fy, ay, uy, table)
    dz, lost_z, hand_z = advance_axis(x, 2, fz, az, uz, table)
    lost = lost_x + lost_y + lost_z
    hand = hand_x + hand_y + hand_z
    book_energies(ledger, fx * dx, fy * dy, fz * dz, lost, hand, 0.0)
    return 0


def stored_energy(x: Any, ax: float, ay: float, az: float, plant: Any) -> float:
    """½ m v² + ½ K (a - p)² of every axis [J]."""
    table = plant[0]
    total = 0.0
    for i in range(3):
        anchor = ax if i == 0 else ay if i == 1 else az
        stretch = anchor - x[i]
        total += 0.5 * table[i, 13] * x[3 + i] ** 2 + 0.5 * table[i, 14] * stretch * stretch
    return total

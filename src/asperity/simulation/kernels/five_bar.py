"""A pantograph over one sample: its mass matrix, its own forces, and Runge-Kutta steps.

The position of the handle is the coordinate. An arm with motor at m, elbow at e, link l = e - m,
t = l turned by a right angle, u = p - e: the motor turns at g · p' with g = u/(u · t). For uniform
rods the kinetic energy is ½ p'ᵀ M p' with, per arm, I₁ = rotor + m₁ l₁²/3 and the distal mass m₂,

    M = (I₁ + m₂ l₁²/3) g gᵀ + m₂/6 (t gᵀ + g tᵀ) + m₂/3 1,

and c(p, p') is what the masses need to stay on their way while p'' = 0.
"""

# ruff: noqa: ARG001 - one signature for every body

import math
from typing import NamedTuple

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.simulation.kernels.body_functions import LEFT, RAN, Held
from asperity.simulation.kernels.booking import book_energies
from asperity.simulation.kernels.hand import HandRecord, band_turns, hand_energy, hand_force

KERNELS = Kernels(
    provides=("advance_body", "stored_energy"),
    requires=("band_turns", "book_energies", "hand_energy", "hand_force"),
)


class Bar(NamedTuple):
    """A five-bar linkage with its masses.

    Attributes:
        proximal: length of the links at the motors [m].
        distal: length of the links at the handle [m].
        base: distance of the motors [m].
        inertia: I₁ + m₂ l₁²/3 [kg m²].
        distal_mass: m₂ [kg].
        handle_mass: at the handle [kg].
        centre_x: point of the linkage's plane that is the origin of the scene [m].
        centre_z: likewise.
        joint_damping: [N m s].
    """

    proximal: float
    distal: float
    base: float
    inertia: float
    distal_mass: float
    handle_mass: float
    centre_x: float
    centre_z: float
    joint_damping: float


class PantographPlant(NamedTuple):
    """A pantograph that a hand holds.

    Attributes:
        bar: the linkage.
        hand: the hand.
        friction: dry friction at the handle [N].
        rate: the fastest, at rest [1/s].
        fewest: parts of a sample.
        period: T [s].
        share: of a time constant that one step covers.
        inside_only: whether the brakes act only in contact.
        least: sine of the angles at the elbows: nearer to stretched or folded it stops.
    """

    bar: Bar
    hand: HandRecord
    friction: float
    rate: float
    fewest: int
    period: float
    share: float
    inside_only: bool
    least: float


def bar_arm(
    x: float, z: float, dx: float, dz: float, side: float, near: float, far: float, inertia: float,
    mass: float,
) -> tuple[float, float, float, float, float, float, float]:  # fmt: skip
    """One arm, with (x, z) from motor to handle and (dx, dz) the handle's velocity.

    Returns g, its part of M (xx, xz, zz) and of c (x, z). ``side`` is 1 for the elbow to the right
    of the line from motor to handle, -1 to the left; ``inertia`` is I₁ + m₂ l₁²/3.
    """
    square = x * x + z * z
    along = 0.5 * (square + near * near - far * far) / square
    across = side * math.sqrt(near * near / square - along * along)
    lx = along * x + across * z
    lz = along * z - across * x
    over = 1.0 / (across * square)  # u · t = across |D|²
    gx = (x - lx) * over
    gz = (z - lz) * over
    turn = gx * dx + gz * dz
    wx = dx + turn * lz
    wz = dz - turn * lx
    square_turn = turn * turn
    gain = (wx * wx + wz * wz + square_turn * (along * square - near * near)) * over
    sixth = mass * (1.0 / 6.0)
    mxx = inertia * gx * gx + 2.0 * sixth * (1.0 - lz * gx)
    mxz = inertia * gx * gz + sixth * (lx * gx - lz * gz)
    mzz = inertia * gz * gz + 2.0 * sixth * (1.0 + lx * gz)
    cx = inertia * gain * gx - sixth * (lz * gain + square_turn * lx)
    cz = inertia * gain * gz + sixth * (lx * gain - square_turn * lz)
    return gx, gz, mxx, mxz, mzz, cx, cz


def bar_body(
    x: float, z: float, dx: float, dz: float, bar: Bar
) -> tuple[float, float, float, float, float, float, float, float]:
    """Mass matrix (xx, xz, zz), c (x, z) and J⁻ᵀJ⁻¹ (xx, xz, zz)."""
    px = bar.centre_x + x
    pz = bar.centre_z + z
    gx, gz, mxx, mxz, mzz, cx, cz = bar_arm(
        px, pz, dx, dz, 1.0, bar.proximal, bar.distal, bar.inertia, bar.distal_mass
    )
    kx, kz, nxx, nxz, nzz, ex, ez = bar_arm(
        px + bar.base, pz, dx, dz, -1.0, bar.proximal, bar.distal, bar.inertia, bar.distal_mass
    )
    return (
        mxx + nxx + bar.handle_mass, mxz + nxz, mzz + nzz + bar.handle_mass, cx + ex, cz + ez,
        gx * gx + kx * kx, gx * gz + kx * kz, gz * gz + kz * kz,
    )  # fmt: skip


def bar_rates(
    x: float, z: float, dx: float, dz: float,
    fx: float, fz: float, ax: float, az: float, ux: float, uz: float,
    damping: float, bar: Bar, hand: HandRecord,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Acceleration [m/s²] in x and z, loss and power of the hand [W]."""
    mxx, mxz, mzz, cx, cz, bxx, bxz, bzz = bar_body(x, z, dx, dz, bar)
    hx, _hy, hz, lost = hand_force(ax - x, 0.0, az - z, ux - dx, 0.0, uz - dz, hand)
    qx = damping * (bxx * dx + bxz * dz)
    qz = damping * (bxz * dx + bzz * dz)
    power = ux * hx + uz * hz + hand.force[0] * dx + hand.force[2] * dz
    rx = fx + hx + hand.force[0] - qx - cx
    rz = fz + hz + hand.force[2] - qz - cz
    over = 1.0 / (mxx * mzz - mxz * mxz)
    lost += qx * dx + qz * dz
    return (mzz * rx - mxz * rz) * over, (mxx * rz - mxz * rx) * over, lost, power


def bar_friction(
    x: FloatArray, fx: float, fz: float, ax: float, az: float, ux: float, uz: float,
    damping: float, friction: float, span: float, bar: Bar, hand: HandRecord,
) -> tuple[float, float]:  # fmt: skip
    """Dry friction [N] that stops the handle in a part of a sample, or its limit."""
    if friction == 0.0:
        return 0.0, 0.0
    rx, rz, _lost, _hand = bar_rates(
        x[0], x[2], x[3], x[5], fx, fz, ax, az, ux, uz, damping, bar, hand
    )
    mxx, mxz, mzz, _cx, _cz, _bxx, _bxz, _bzz = bar_body(x[0], x[2], x[3], x[5], bar)
    vx = x[3] + span * rx
    vz = x[5] + span * rz
    gx = -(mxx * vx + mxz * vz) / span
    gz = -(mxz * vx + mzz * vz) / span
    speed = math.sqrt(vx * vx + vz * vz)
    if gx * gx + gz * gz <= friction * friction or speed == 0.0:
        return gx, gz
    return -friction * vx / speed, -friction * vz / speed


def bar_part(
    x: FloatArray, sx: float, sz: float, ax: float, az: float,
    ux: float, uz: float, damping: float, span: float, bar: Bar, hand: HandRecord,
) -> tuple[float, float, float, float]:  # fmt: skip
    """One step of the classical Runge-Kutta method; loss and hand's work are integrated along.

    Returns the displacement in x and z [m], the loss and the work of the hand [J].
    """
    half = 0.5 * span
    px = x[0]
    pz = x[2]
    vx = x[3]
    vz = x[5]
    ax1, az1, lost1, hand1 = bar_rates(
        px, pz, vx, vz, sx, sz, ax, az, ux, uz, damping, bar, hand
    )  # fmt: skip
    vx2 = vx + half * ax1
    vz2 = vz + half * az1
    mx = ax + half * ux
    mz = az + half * uz
    ax2, az2, lost2, hand2 = bar_rates(
        px + half * vx, pz + half * vz, vx2, vz2, sx, sz, mx, mz, ux, uz, damping, bar, hand
    )  # fmt: skip
    vx3 = vx + half * ax2
    vz3 = vz + half * az2
    ax3, az3, lost3, hand3 = bar_rates(
        px + half * vx2, pz + half * vz2, vx3, vz3, sx, sz, mx, mz, ux, uz, damping, bar, hand
    )  # fmt: skip
    vx4 = vx + span * ax3
    vz4 = vz + span * az3
    ax4, az4, lost4, hand4 = bar_rates(
        px + span * vx3, pz + span * vz3, vx4, vz4, sx, sz, ax + span * ux, az + span * uz,
        ux, uz, damping, bar, hand,
    )  # fmt: skip
    sixth = span / 6.0
    dx = sixth * (vx + 2.0 * (vx2 + vx3) + vx4)
    dz = sixth * (vz + 2.0 * (vz2 + vz3) + vz4)
    x[0] = px + dx
    x[2] = pz + dz
    x[3] = vx + sixth * (ax1 + 2.0 * (ax2 + ax3) + ax4)
    x[5] = vz + sixth * (az1 + 2.0 * (az2 + az3) + az4)
    lost = sixth * (lost1 + 2.0 * (lost2 + lost3) + lost4)
    work = sixth * (hand1 + 2.0 * (hand2 + hand3) + hand4)
    return dx, dz, lost, work


def bar_reached(x: float, z: float, least: float, bar: Bar) -> bool:
    """Whether both arms reach a point, with room: |cos| of the angle at the elbow below a limit."""
    px = bar.centre_x + x
    pz = bar.centre_z + z
    sides = bar.proximal * bar.proximal + bar.distal * bar.distal
    limit = 2.0 * bar.proximal * bar.distal * math.sqrt(1.0 - least * least)
    right = sides - px * px - pz * pz
    left = sides - (px + bar.base) * (px + bar.base) - pz * pz
    return bool(pz > 0.0 and abs(right) < limit and abs(left) < limit)


def bar_parts(vx: float, vz: float, rate: float, span: float, bar: Bar) -> int:
    """Steps for a sample: one for each ``share`` of a time constant, shorter ones at speed."""
    parts = (rate + 4.0 * math.sqrt(vx * vx + vz * vz) / bar.proximal) * span
    # At such speeds the handle leaves the workspace with the first of them.
    return 1 + int(parts) if parts < 1e6 else 1000000


def bar_kink(
    x: FloatArray, dx: float, dz: float, time: float, h: float, held: Held, hand: HandRecord
) -> bool:
    """Whether the band turned slack or taut in a step h of the handle, d, from a time on."""
    sx = held.ax + time * held.ux - x[0]
    sz = held.az + time * held.uz - x[2]
    return band_turns(sx + dx, 0.0, sz + dz, sx + h * held.ux, 0.0, sz + h * held.uz, hand)


def advance_body(x: FloatArray, ledger: FloatArray, held: Held, plant: PantographPlant) -> int:
    """Move the handle over one sample; see ``body_functions``."""
    fx, _fy, fz, ax, _ay, az, ux, _uy, uz, inside = held
    bar, hand, friction, rate, fewest, period, share, inside_only, least = plant
    damping = bar.joint_damping if inside or not inside_only else 0.0
    px, pz, vx, vz = x[0], x[2], x[3], x[5]
    parts = max(fewest, bar_parts(vx, vz, rate, period / share, bar))
    wx = wz = lost = work = rubbed = time = 0.0
    part = fine = 0
    h = period / parts
    while part < parts:
        bx = ax + time * ux
        bz = az + time * uz
        sx, sz, tx, tz = x[0], x[2], x[3], x[5]
        gx, gz = bar_friction(x, fx, fz, bx, bz, ux, uz, damping, friction, h, bar, hand)
        dx, dz, loss, pulled = bar_part(x, fx + gx, fz + gz, bx, bz, ux, uz, damping, h, bar, hand)
        if not bar_reached(x[0], x[2], least, bar):
            x[0], x[2], x[3], x[5] = px, pz, vx, vz
            return LEFT
        if fine == 0 and bar_kink(x, dx, dz, time, h, held, hand):
            x[0], x[2], x[3], x[5] = sx, sz, tx, tz
            fine = 256  # the force has a kink there: again, in small steps
            h = period / parts / 256.0
            continue
        time += h
        wx += fx * dx
        wz += fz * dz
        lost += loss
        work += pulled
        rubbed += gx * dx + gz * dz
        fine = max(fine - 1, 0)
        if fine == 0:
            part += 1
            h = period / parts
    book_energies(ledger, wx, 0.0, wz, lost, work, rubbed)
    return RAN


def stored_energy(x: FloatArray, ax: float, ay: float, az: float, plant: PantographPlant) -> float:
    """½ p'ᵀ M p' and the energy of the hand [J]."""
    bar = plant.bar
    mxx, mxz, mzz, _cx, _cz, _bxx, _bxz, _bzz = bar_body(x[0], x[2], x[3], x[5], bar)
    kinetic = 0.5 * (mxx * x[3] * x[3] + 2.0 * mxz * x[3] * x[5] + mzz * x[5] * x[5])
    return float(kinetic + hand_energy(ax - x[0], 0.0, az - x[2], plant.hand))

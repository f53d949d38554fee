"""A pantograph over one sample: its mass matrix, its own forces, and Runge-Kutta steps.

The position of the handle is the coordinate. An arm with motor at m, elbow at e, link l = e - m,
t = l turned by a right angle, u = p - e: the motor turns at g · p' with g = u/(u · t). For uniform
rods the kinetic energy is ½ p'ᵀ M p' with, per arm, I₁ = rotor + m₁ l₁²/3 and the distal mass m₂,

    M = (I₁ + m₂ l₁²/3) g gᵀ + m₂/6 (t gᵀ + g tᵀ) + m₂/3 1,

and c(p, p') is what the masses need to stay on their way while p'' = 0.
"""

import math
from typing import NamedTuple

from asperity.core.compiled import FloatArray, Kernels
from asperity.loop.bodies.body_parts import HandRecord, band_changes_state, hand_energy, hand_force
from asperity.loop.body_interface import LEFT_WORKSPACE, RUNNING, SampleInput
from asperity.loop.simulated_device import add_energies

# ruff: noqa: ARG001 - one signature for every body


KERNELS = Kernels(
    provides=(
        "advance_body",
        "linkage_band_changes_state",
        "linkage_step_count",
        "linkage_reaches",
        "linkage_step",
        "stored_energy",
    )
)


class LinkageRecord(NamedTuple):
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


class StepInput(NamedTuple):
    """The input of a handle over a step.

    Attributes:
        fx: force [N].
        fz: likewise.
        ax: position of the hand's anchor at the start of the step [m].
        az: likewise.
        ux: velocity of the anchor [m/s].
        uz: likewise.
        damping: damping of the joints [N m s].
    """

    fx: float
    fz: float
    ax: float
    az: float
    ux: float
    uz: float
    damping: float


class PantographRecord(NamedTuple):
    """A pantograph that a hand holds.

    Attributes:
        linkage: the linkage.
        hand: the hand.
        friction: dry friction at the handle [N].
        max_rate: fastest rate at rest [1/s].
        min_steps: least number of steps of a sample.
        period: T [s].
        step_fraction: share of a time constant that one step covers.
        inside_only: whether the brakes act only in contact.
        min_sine: least sine of the angles at the elbows: nearer to stretched or folded it stops.
    """

    linkage: LinkageRecord
    hand: HandRecord
    friction: float
    max_rate: float
    min_steps: int
    period: float
    step_fraction: float
    inside_only: bool
    min_sine: float


def linkage_arm(
    x: float, z: float, dx: float, dz: float, side: float, linkage: LinkageRecord
) -> tuple[float, float, float, float, float, float, float]:
    """Return g, and the parts of one arm in M (xx, xz, zz) and in c (x, z).

    Args:
        x: position of the handle relative to the motor [m].
        z: likewise.
        dx: velocity of the handle [m/s].
        dz: likewise.
        side: 1 for the elbow to the right of the line from motor to handle, -1 to the left.
        linkage: the linkage.
    """
    proximal = linkage.proximal
    distal = linkage.distal
    inertia = linkage.inertia
    square = x * x + z * z
    twice = square + proximal * proximal - distal * distal
    root = math.sqrt(4.0 * proximal * proximal * square - twice * twice)  # 2 |D|² across
    inverse = 1.0 / (square * root)  # one division for all
    along = 0.5 * twice * root * inverse
    across = 0.5 * side * root * root * inverse
    lx = along * x + across * z
    lz = along * z - across * x
    over = 2.0 * side * square * inverse  # u · t = across |D|²
    gx = (x - lx) * over
    gz = (z - lz) * over
    turn = gx * dx + gz * dz
    wx = dx + turn * lz
    wz = dz - turn * lx
    square_turn = turn * turn
    gain = (wx * wx + wz * wz + square_turn * (0.5 * twice - proximal * proximal)) * over
    sixth = linkage.distal_mass * (1.0 / 6.0)
    mxx = inertia * gx * gx + 2.0 * sixth * (1.0 - lz * gx)
    mxz = inertia * gx * gz + sixth * (lx * gx - lz * gz)
    mzz = inertia * gz * gz + 2.0 * sixth * (1.0 + lx * gz)
    cx = inertia * gain * gx - sixth * (lz * gain + square_turn * lx)
    cz = inertia * gain * gz + sixth * (lx * gain - square_turn * lz)
    return gx, gz, mxx, mxz, mzz, cx, cz


def linkage_dynamics(
    x: float, z: float, dx: float, dz: float, linkage: LinkageRecord
) -> tuple[float, float, float, float, float, float, float, float]:
    """Return the mass matrix (xx, xz, zz), c (x, z) and J⁻ᵀJ⁻¹ (xx, xz, zz)."""
    px = linkage.centre_x + x
    pz = linkage.centre_z + z
    gx, gz, mxx, mxz, mzz, cx, cz = linkage_arm(px, pz, dx, dz, 1.0, linkage)
    kx, kz, nxx, nxz, nzz, ex, ez = linkage_arm(px + linkage.base, pz, dx, dz, -1.0, linkage)
    return (
        mxx + nxx + linkage.handle_mass,
        mxz + nxz,
        mzz + nzz + linkage.handle_mass,
        cx + ex,
        cz + ez,
        gx * gx + kx * kx,
        gx * gz + kx * kz,
        gz * gz + kz * kz,
    )


def linkage_rates(
    x: float, z: float, dx: float, dz: float, t: float, inputs: StepInput, plant: PantographRecord
) -> tuple[float, float, float, float]:
    """Return the acceleration [m/s²] in x and z, the loss and the power of the hand [W].

    Args:
        x: position of the handle [m].
        z: likewise.
        dx: velocity of the handle [m/s].
        dz: likewise.
        t: time since the start of the step [s].
        inputs: input of the step.
        plant: the pantograph.
    """
    fx, fz, ax, az, ux, uz, damping = inputs
    hand = plant.hand
    mxx, mxz, mzz, cx, cz, bxx, bxz, bzz = linkage_dynamics(x, z, dx, dz, plant.linkage)
    hx, _hy, hz, lost = hand_force(
        ax + t * ux - x, 0.0, az + t * uz - z, ux - dx, 0.0, uz - dz, hand
    )
    qx = damping * (bxx * dx + bxz * dz)
    qz = damping * (bxz * dx + bzz * dz)
    power = ux * hx + uz * hz + hand.force[0] * dx + hand.force[2] * dz
    rx = fx + hx + hand.force[0] - qx - cx
    rz = fz + hz + hand.force[2] - qz - cz
    over = 1.0 / (mxx * mzz - mxz * mxz)
    lost += qx * dx + qz * dz
    return (mzz * rx - mxz * rz) * over, (mxx * rz - mxz * rx) * over, lost, power


def runge_kutta_sum(
    rate1: float, rate3: float, rate4: float, rate5: float, rate6: float, h: float
) -> float:
    """Return the integral of a rate over a step h, from the stages of :func:`linkage_step`."""
    return h / 90.0 * (7.0 * (rate1 + rate6) + 32.0 * (rate3 + rate5) + 12.0 * rate4)


def linkage_friction(
    x: FloatArray, inputs: StepInput, substep: float, plant: PantographRecord
) -> tuple[float, float]:
    """Return the dry friction [N] that stops the handle in a part of a sample, or its limit."""
    friction = plant.friction
    if friction == 0.0:
        return 0.0, 0.0
    rx, rz, _lost, _power = linkage_rates(x[0], x[2], x[3], x[5], 0.0, inputs, plant)
    mxx, mxz, mzz, _cx, _cz, _bxx, _bxz, _bzz = linkage_dynamics(
        x[0], x[2], x[3], x[5], plant.linkage
    )
    vx = x[3] + substep * rx
    vz = x[5] + substep * rz
    gx = -(mxx * vx + mxz * vz) / substep
    gz = -(mxz * vx + mzz * vz) / substep
    speed = math.sqrt(vx * vx + vz * vz)
    if gx * gx + gz * gz <= friction * friction or speed == 0.0:
        return gx, gz
    return -friction * vx / speed, -friction * vz / speed


def linkage_step(
    x1: float,
    z1: float,
    vx1: float,
    vz1: float,
    inputs: StepInput,
    h: float,
    plant: PantographRecord,
) -> tuple[float, float, float, float, float, float]:
    """Return the changes over one step h of Butcher's Runge-Kutta method of order five.

    Displacement [m] and change of velocity [m/s] in x and z, loss and work of the hand [J].
    """
    ax1, az1, lost1, hand1 = linkage_rates(x1, z1, vx1, vz1, 0.0, inputs, plant)
    q = 0.25 * h
    vx2 = vx1 + q * ax1
    vz2 = vz1 + q * az1
    ax2, az2, _, _ = linkage_rates(x1 + q * vx1, z1 + q * vz1, vx2, vz2, q, inputs, plant)
    e = 0.125 * h
    vx3 = vx1 + e * (ax1 + ax2)
    vz3 = vz1 + e * (az1 + az2)
    x3 = x1 + e * (vx1 + vx2)
    z3 = z1 + e * (vz1 + vz2)
    ax3, az3, lost3, hand3 = linkage_rates(x3, z3, vx3, vz3, q, inputs, plant)
    vx4 = vx1 + h * (ax3 - 0.5 * ax2)
    vz4 = vz1 + h * (az3 - 0.5 * az2)
    x4 = x1 + h * (vx3 - 0.5 * vx2)
    z4 = z1 + h * (vz3 - 0.5 * vz2)
    ax4, az4, lost4, hand4 = linkage_rates(x4, z4, vx4, vz4, 2.0 * q, inputs, plant)
    s = h / 16.0
    vx5 = vx1 + s * (3.0 * ax1 + 9.0 * ax4)
    vz5 = vz1 + s * (3.0 * az1 + 9.0 * az4)
    x5 = x1 + s * (3.0 * vx1 + 9.0 * vx4)
    z5 = z1 + s * (3.0 * vz1 + 9.0 * vz4)
    ax5, az5, lost5, hand5 = linkage_rates(x5, z5, vx5, vz5, 3.0 * q, inputs, plant)
    s = h / 7.0
    vx6 = vx1 + s * (2.0 * ax2 - 3.0 * ax1 + 12.0 * (ax3 - ax4) + 8.0 * ax5)
    vz6 = vz1 + s * (2.0 * az2 - 3.0 * az1 + 12.0 * (az3 - az4) + 8.0 * az5)
    x6 = x1 + s * (2.0 * vx2 - 3.0 * vx1 + 12.0 * (vx3 - vx4) + 8.0 * vx5)
    z6 = z1 + s * (2.0 * vz2 - 3.0 * vz1 + 12.0 * (vz3 - vz4) + 8.0 * vz5)
    ax6, az6, lost6, hand6 = linkage_rates(x6, z6, vx6, vz6, h, inputs, plant)
    return (
        runge_kutta_sum(vx1, vx3, vx4, vx5, vx6, h),
        runge_kutta_sum(vz1, vz3, vz4, vz5, vz6, h),
        runge_kutta_sum(ax1, ax3, ax4, ax5, ax6, h),
        runge_kutta_sum(az1, az3, az4, az5, az6, h),
        runge_kutta_sum(lost1, lost3, lost4, lost5, lost6, h),
        runge_kutta_sum(hand1, hand3, hand4, hand5, hand6, h),
    )


def linkage_reaches(x: float, z: float, min_sine: float, linkage: LinkageRecord) -> bool:
    """Return whether both arms reach a point, and |cos| of the angles at the elbows is allowed."""
    px = linkage.centre_x + x
    pz = linkage.centre_z + z
    sides = linkage.proximal * linkage.proximal + linkage.distal * linkage.distal
    limit = 2.0 * linkage.proximal * linkage.distal * math.sqrt(1.0 - min_sine * min_sine)
    right = sides - px * px - pz * pz
    left = sides - (px + linkage.base) * (px + linkage.base) - pz * pz
    return bool(pz > 0.0 and abs(right) < limit and abs(left) < limit)


def linkage_step_count(
    vx: float, vz: float, max_rate: float, span: float, linkage: LinkageRecord
) -> int:
    """Return the number of steps of a sample, one for each ``step_fraction`` of a time constant."""
    parts = (max_rate + 4.0 * math.sqrt(vx * vx + vz * vz) / linkage.proximal) * span
    # At such speeds the handle leaves the workspace with the first of them.
    return 1 + int(parts) if parts < 1e6 else 1000000


def linkage_band_changes_state(
    x: float, z: float, dx: float, dz: float, h: float, inputs: StepInput, hand: HandRecord
) -> bool:
    """Return whether the band turned slack or taut in a step h of the handle, by d to (x, z)."""
    sx = inputs.ax - x
    sz = inputs.az - z
    return band_changes_state(
        sx + dx, 0.0, sz + dz, sx + h * inputs.ux, 0.0, sz + h * inputs.uz, hand
    )


def place_handle(x: FloatArray, px: float, pz: float, vx: float, vz: float) -> None:
    """Write position and velocity of the handle in the plane of the linkage."""
    x[0] = px
    x[2] = pz
    x[3] = vx
    x[5] = vz


def advance_body(
    x: FloatArray, ledger: FloatArray, inputs: SampleInput, plant: PantographRecord
) -> int:
    """Move the handle over one sample; see ``body_interface``."""
    fx, _fy, fz, ax, _ay, az, ux, _uy, uz, in_contact = inputs
    linkage, hand, _friction, rate, min_steps, period, fraction, inside_only, min_sine = plant
    damping = linkage.joint_damping if in_contact or not inside_only else 0.0
    px = x[0]
    pz = x[2]
    vx = x[3]
    vz = x[5]
    parts = max(min_steps, linkage_step_count(vx, vz, rate, period / fraction, linkage))
    wx = wz = lost = work = rubbed = time = 0.0
    part = fine = 0
    h = period / parts
    while part < parts:
        bx = ax + time * ux
        bz = az + time * uz
        sx = x[0]
        sz = x[2]
        tx = x[3]
        tz = x[5]
        gx, gz = linkage_friction(x, StepInput(fx, fz, bx, bz, ux, uz, damping), h, plant)
        pull = StepInput(fx + gx, fz + gz, bx, bz, ux, uz, damping)
        dx, dz, dvx, dvz, loss, pulled = linkage_step(sx, sz, tx, tz, pull, h, plant)
        x[0] = sx + dx
        x[2] = sz + dz
        x[3] = tx + dvx
        x[5] = tz + dvz
        if not linkage_reaches(x[0], x[2], min_sine, linkage):
            place_handle(x, px, pz, vx, vz)
            return LEFT_WORKSPACE
        if fine == 0 and linkage_band_changes_state(x[0], x[2], dx, dz, h, pull, hand):
            place_handle(x, sx, sz, tx, tz)
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
    add_energies(ledger, wx, 0.0, wz, lost, work, rubbed)
    return RUNNING


def stored_energy(x: FloatArray, ax: float, ay: float, az: float, plant: PantographRecord) -> float:
    """Return ½ p'ᵀ M p' and the energy of the hand [J]."""
    linkage = plant.linkage
    mxx, mxz, mzz, _cx, _cz, _bxx, _bxz, _bzz = linkage_dynamics(x[0], x[2], x[3], x[5], linkage)
    kinetic = 0.5 * (mxx * x[3] * x[3] + 2.0 * mxz * x[3] * x[5] + mzz * x[5] * x[5])
    return float(kinetic + hand_energy(ax - x[0], 0.0, az - x[2], plant.hand))

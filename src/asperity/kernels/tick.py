"""One tick of a servo: from the position that an encoder reads to the force that is commanded.

A simulation calls it sample by sample, and so may the loop of a device. It keeps nothing: what is
carried from tick to tick is a record that goes in and comes out, and the array of
:mod:`asperity.contacts.memory`, which also holds a tick to a budget.
"""

import math
from typing import NamedTuple

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.kernels.law_functions import probe_tick

KERNELS = Kernels(
    provides=("first_state", "flushed", "flushed_state", "servo_tick"), requires=("probe_tick",)
)


class ServoSettings(NamedTuple):
    """What a servo does to position and force.

    Attributes:
        position_step: of the encoder [m]; 0 for none.
        force_step: of the force [N]; 0 for none.
        max_force: the length to which the force is limited [N].
        virtual_damping: on the filtered velocity [N s/m].
        velocity_share: of the newest difference in the filtered velocity [1].
        period: T [s].
    """

    position_step: float
    force_step: float
    max_force: float
    virtual_damping: float
    velocity_share: float
    period: float


class ServoState(NamedTuple):
    """What is carried from tick to tick.

    Attributes:
        x: position as it was read last [m].
        y: likewise.
        z: likewise.
        vx: filtered velocity [m/s].
        vy: likewise.
        vz: likewise.
        anchor_x: the law's anchor [m].
        anchor_y: likewise.
        held: whether the law's anchor is held.
        fx: force that was commanded [N].
        fy: likewise.
        fz: likewise.
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    vz: float = 0.0
    anchor_x: float = 0.0
    anchor_y: float = 0.0
    held: bool = False
    fx: float = 0.0
    fy: float = 0.0
    fz: float = 0.0


def rounded(value: float, step: float) -> float:
    """Round to a multiple of a step; as it is for step 0."""
    if step > 0.0:
        return step * math.floor(value / step + 0.5)
    return value


def rounded_force(
    x: float, y: float, z: float, step: float, largest: float
) -> tuple[float, float, float]:
    """Round a force to multiples of a step; towards zero if it would get too long (squared)."""
    if step > 0.0:
        rx = rounded(x, step)
        ry = rounded(y, step)
        rz = rounded(z, step)
        # What is a multiple, but for the last bits, loses no step.
        if rx * rx + ry * ry + rz * rz <= largest * (1.0 + 1e-12):
            return rx, ry, rz
        x = math.copysign(step * math.floor(abs(x) / step), x)
        y = math.copysign(step * math.floor(abs(y) / step), y)
        z = math.copysign(step * math.floor(abs(z) / step), z)
    return x, y, z


def first_state(x: float, y: float, z: float, settings: ServoSettings) -> ServoState:
    """Return the state before the first tick, of a handle at rest at a position [m]."""
    x = rounded(x, settings.position_step)
    y = rounded(y, settings.position_step)
    z = rounded(z, settings.position_step)
    return ServoState(x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0, False, 0.0, 0.0, 0.0)


def flushed(value: float) -> float:
    """Make nothing of what is next to nothing: subnormal numbers are a hundred times slower."""
    return 0.0 if abs(value) < 1e-60 else value


def flushed_state(state: ServoState) -> ServoState:
    """Return the state without subnormal numbers."""
    return ServoState(
        flushed(state.x), flushed(state.y), flushed(state.z),
        flushed(state.vx), flushed(state.vy), flushed(state.vz),
        flushed(state.anchor_x), flushed(state.anchor_y), state.held,
        flushed(state.fx), flushed(state.fy), flushed(state.fz),
    )  # fmt: skip


def servo_tick(
    state: ServoState, settings: ServoSettings, x: float, y: float, z: float,
    memory: FloatArray, texture: object, law: object,
) -> ServoState:  # fmt: skip
    """Return the state after a tick; it holds the force that is commanded.

    The position is read in steps of the encoder, the law answers, virtual damping is added, the
    force is limited and rounded.

    Args:
        state: after the last tick.
        settings: of the servo.
        x: position of the handle [m].
        y: likewise.
        z: likewise.
        memory: of the contact; changed.
        texture: record of the texture.
        law: parameters of the law.
    """
    x = rounded(x, settings.position_step)
    y = rounded(y, settings.position_step)
    z = rounded(z, settings.position_step)
    fx, fy, fz, ax, ay, held = probe_tick(
        x, y, z, state.anchor_x, state.anchor_y, state.held, memory, texture, law
    )
    vx = state.vx
    vy = state.vy
    vz = state.vz
    if settings.virtual_damping != 0.0:
        rate = 1.0 / settings.period
        vx += settings.velocity_share * ((x - state.x) * rate - vx)
        vy += settings.velocity_share * ((y - state.y) * rate - vy)
        vz += settings.velocity_share * ((z - state.z) * rate - vz)
        fx -= settings.virtual_damping * vx
        fy -= settings.virtual_damping * vy
        fz -= settings.virtual_damping * vz
    square = fx * fx + fy * fy + fz * fz
    largest = settings.max_force * settings.max_force
    if square > largest:
        shorter = settings.max_force / math.sqrt(square)
        fx *= shorter
        fy *= shorter
        fz *= shorter
    fx, fy, fz = rounded_force(fx, fy, fz, settings.force_step, largest)
    return ServoState(x, y, z, vx, vy, vz, ax, ay, held, fx, fy, fz)

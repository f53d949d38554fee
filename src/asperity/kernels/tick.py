"""One servo tick: from the encoder position to the commanded force.

The loops of simulations and devices call it once per sample. The state is a record, argument and
result, and the array of :mod:`asperity.contacts.warm_start`, which also limits the evaluations of a
tick.
"""

import math
from typing import NamedTuple

from asperity.core.compiled import EVERY_FUNCTION, FloatArray, Kernels
from asperity.kernels.probe_functions import probe_tick

KERNELS = Kernels(provides=EVERY_FUNCTION)


class ServoSettings(NamedTuple):
    """Settings of a servo.

    Attributes:
        position_step: quantisation of the encoder [m]; 0 for none.
        force_step: quantisation of the force [N]; 0 for none.
        max_force: greatest magnitude of the force [N].
        virtual_damping: damping of the filtered velocity [N s/m].
        velocity_share: weight of the newest difference in the filtered velocity [1].
        period: T [s].
    """

    position_step: float
    force_step: float
    max_force: float
    virtual_damping: float
    velocity_share: float
    period: float


class ServoState(NamedTuple):
    """State of a servo between ticks.

    Attributes:
        x: last encoder position [m].
        y: likewise.
        z: likewise.
        vx: filtered velocity [m/s].
        vy: likewise.
        vz: likewise.
        anchor_x: the law's anchor [m].
        anchor_y: likewise.
        held: whether the law's anchor is held.
        fx: commanded force [N].
        fy: likewise.
        fz: likewise.
        anchor_z: the anchor of friction on a closed body [m]; 0 elsewhere.
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
    anchor_z: float = 0.0


def quantize(value: float, step: float) -> float:
    """Round to a multiple of a step; unchanged for step 0."""
    if step > 0.0:
        return step * math.floor(value / step + 0.5)
    return value


def quantize_force(
    x: float, y: float, z: float, step: float, max_square: float
) -> tuple[float, float, float]:
    """Round a force to multiples of a step, towards zero if its square would exceed a limit."""
    if step > 0.0:
        rx = quantize(x, step)
        ry = quantize(y, step)
        rz = quantize(z, step)
        # A multiple, up to rounding, does not lose a step.
        if rx * rx + ry * ry + rz * rz <= max_square * (1.0 + 1e-12):
            return rx, ry, rz
        x = math.copysign(step * math.floor(abs(x) / step), x)
        y = math.copysign(step * math.floor(abs(y) / step), y)
        z = math.copysign(step * math.floor(abs(z) / step), z)
    return x, y, z


def least_limited_square(max_force: float, force_step: float) -> float:
    """Return the least square [N²] of a force that was limited, then rounded to steps."""
    least = max((1.0 - 1e-12) * max_force - 1.75 * force_step, 0.5 * max_force)
    return least * least


def initial_servo_state(x: float, y: float, z: float, settings: ServoSettings) -> ServoState:
    """Return the state before the first tick, of a handle at rest at a position [m]."""
    x = quantize(x, settings.position_step)
    y = quantize(y, settings.position_step)
    z = quantize(z, settings.position_step)
    return ServoState(x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0, False, 0.0, 0.0, 0.0, 0.0)


def flush_subnormal(value: float) -> float:
    """Return 0 for tiny numbers: subnormal numbers are a hundred times slower."""
    return 0.0 if abs(value) < 1e-60 else value


def flush_subnormal_state(state: ServoState) -> ServoState:
    """Return the state without subnormal numbers."""
    return ServoState(
        flush_subnormal(state.x),
        flush_subnormal(state.y),
        flush_subnormal(state.z),
        flush_subnormal(state.vx),
        flush_subnormal(state.vy),
        flush_subnormal(state.vz),
        flush_subnormal(state.anchor_x),
        flush_subnormal(state.anchor_y),
        state.held,
        flush_subnormal(state.fx),
        flush_subnormal(state.fy),
        flush_subnormal(state.fz),
        flush_subnormal(state.anchor_z),
    )


def state_before_tick(
    servo: ServoState, sample: int, x: float, y: float, z: float, settings: ServoSettings
) -> ServoState:
    """Return the state with which a sample begins: initial at sample 0, subnormals flushed."""
    if sample == 0:
        servo = initial_servo_state(x, y, z, settings)
    return flush_subnormal_state(servo) if sample & 255 == 0 else servo


def servo_tick(
    state: ServoState,
    settings: ServoSettings,
    x: float,
    y: float,
    z: float,
    warm_start: FloatArray,
    texture: object,
    law: object,
) -> ServoState:
    """Return the state after a tick, with the commanded force.

    The position is quantised, the law is evaluated, virtual damping is added, and the force is
    limited and quantised.

    Args:
        state: after the last tick.
        settings: of the servo.
        x: position of the handle [m].
        y: likewise.
        z: likewise.
        warm_start: of the contact; updated.
        texture: record of the texture.
        law: parameters of the law.
    """
    x = quantize(x, settings.position_step)
    y = quantize(y, settings.position_step)
    z = quantize(z, settings.position_step)
    fx, fy, fz, ax, ay, az, held = probe_tick(
        x,
        y,
        z,
        state.anchor_x,
        state.anchor_y,
        state.anchor_z,
        state.held,
        warm_start,
        texture,
        law,
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
        scale = settings.max_force / math.sqrt(square)
        fx *= scale
        fy *= scale
        fz *= scale
    fx, fy, fz = quantize_force(fx, fy, fz, settings.force_step, largest)
    return ServoState(x, y, z, vx, vy, vz, ax, ay, held, fx, fy, fz, az)

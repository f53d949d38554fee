"""The ticks of a servo along the positions that a recording holds, compiled."""

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.kernels.tick import (
    ServoSettings,
    ServoState,
    first_state,
    flushed_state,
    servo_tick,
)

KERNELS = Kernels(
    requires=("first_state", "flushed_state", "servo_tick"),
    loops=("replay_batch",),
)


def replay_batch(
    points: FloatArray, first: int, state: ServoState, settings: ServoSettings, memory: FloatArray,
    texture: object, law: object, out: FloatArray,
) -> ServoState:  # fmt: skip
    """Write force [N], anchor of the law [m] and whether it is held, shape (n, 6); carry the state.

    Args:
        points: positions of the handle (n, 3) [m], sample after sample.
        first: number of the first sample.
        state: of the servo before it; none counts for sample 0.
        settings: of the servo.
        memory: of the contact; changed.
        texture: record of the texture.
        law: parameters of the law.
        out: what is written.
    """
    if first == 0:
        state = first_state(points[0, 0], points[0, 1], points[0, 2], settings)
    for i in range(points.shape[0]):
        # As the loop does: see asperity.simulation.kernels.servo_loop.
        if (first + i) & 255 == 0:
            state = flushed_state(state)
        state = servo_tick(
            state, settings, points[i, 0], points[i, 1], points[i, 2], memory, texture, law
        )
        out[i, 0] = state.fx
        out[i, 1] = state.fy
        out[i, 2] = state.fz
        out[i, 3] = state.anchor_x
        out[i, 4] = state.anchor_y
        out[i, 5] = 1.0 if state.held else 0.0
    return state

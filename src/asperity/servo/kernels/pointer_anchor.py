"""The anchor of a simulated hand that a pointer moves while the loop runs.

Requests come through shared memory, at any time and in any steps. The anchor follows them with
critical damping and a limited speed.
"""

import math

from asperity.core.compiled import Kernels
from asperity.simulation.kernels.simulated_device import SimulatedDevice

KERNELS = Kernels(provides=("anchor_segment",))

# Rows of the memory: the pointer writes the first four, the loop the next three, a following loop
# the last. The request is the point TARGET + COSINE cos(angle) + SINE sin(angle) [m].
TARGET, COSINE, SINE, REQUEST_ROW, ANCHOR, VELOCITY, STATE_ROW, FOLLOWER_ROW = range(8)
HEADER_ROWS = 8
# Then follow anchor [m], velocity [m/s] and position [m] of each of the newest samples.
HISTORY_SAMPLES, ROWS_PER_SAMPLE = 40_000, 3
# REQUEST_ROW: angular velocity [rad/s] and number of the newest request; STATE_ROW: angle [rad],
# number of the newest acknowledged request, and samples whose rows are complete; FOLLOWER_ROW: see
# ``following_anchor``.
ANGLE, REQUEST_NUMBER, SAMPLE_COUNT = 0, 1, 2

TRACKING_BANDWIDTH = 250.0
"""Bandwidth of the anchor [rad/s]; it lags by 2/ω, 8 ms."""
MAX_SPEED = 0.4
"""Largest speed of the anchor [m/s]."""


def anchor_segment(device: SimulatedDevice) -> tuple[float, float, float, float, float, float]:
    """Return the position of the hand's anchor at this sample and at the next [m].

    v' = ω² (target - a) - 2 ω v, with |v| limited to ``MAX_SPEED``.
    """
    at = device.anchor
    at[STATE_ROW, SAMPLE_COUNT] = device.counters[1]  # written between two calls of the loop
    step = 1.0 / device.update_rate
    number = at[REQUEST_ROW, REQUEST_NUMBER]
    angle = (at[STATE_ROW, ANGLE] + at[REQUEST_ROW, ANGLE] * step) % (2.0 * math.pi)
    cosine = math.cos(angle)
    sine = math.sin(angle)
    speed = 0.0
    for i in range(3):
        target = at[TARGET, i] + at[COSINE, i] * cosine + at[SINE, i] * sine
        pull = TRACKING_BANDWIDTH * TRACKING_BANDWIDTH * (target - at[ANCHOR, i])
        at[VELOCITY, i] += step * (pull - 2.0 * TRACKING_BANDWIDTH * at[VELOCITY, i])
        speed += at[VELOCITY, i] * at[VELOCITY, i]
    speed = math.sqrt(speed)
    share = MAX_SPEED / speed if speed > MAX_SPEED else 1.0
    ax = at[ANCHOR, 0]
    ay = at[ANCHOR, 1]
    az = at[ANCHOR, 2]
    row = HEADER_ROWS + ROWS_PER_SAMPLE * (device.counters[1] % HISTORY_SAMPLES)
    for i in range(3):
        at[row, i] = at[ANCHOR, i]
        at[row + 1, i] = device.x[3 + i]
        at[row + 2, i] = device.x[i]
        at[VELOCITY, i] *= share
        at[ANCHOR, i] += step * at[VELOCITY, i]
    at[STATE_ROW, ANGLE] = angle
    at[STATE_ROW, REQUEST_NUMBER] = number
    return ax, ay, az, at[ANCHOR, 0], at[ANCHOR, 1], at[ANCHOR, 2]

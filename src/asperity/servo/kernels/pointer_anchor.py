"""The anchor of a simulated hand that a pointer moves while the loop runs.

Requests come through shared memory, at any time and in any steps. The anchor follows them with
critical damping and a limited speed.

The anchor of a following loop repeats that of another loop, sample by sample. Such a loop has no
clock of its own: it waits for each sample of the other one, so both get the same motion at the same
samples, however late either is.
"""

import math

from asperity.core.compiled import Kernels, call_address
from asperity.loop.clock import CLOCK_BOOTTIME
from asperity.simulation.kernels.simulated_device import SimulatedDevice

KERNELS = Kernels(provides=("anchor_segment",), native=("call_address",))

# Rows of the memory: the pointer writes the first four, the loop the next three, a following loop
# the last. The request is the point TARGET + COSINE cos(angle) + SINE sin(angle) [m].
TARGET, COSINE, SINE, REQUEST_ROW, ANCHOR, VELOCITY, STATE_ROW, FOLLOWER_ROW = range(8)
HEADER_ROWS = 8
# Then follow the anchors at the newest samples [m], which a following loop repeats.
HISTORY_SAMPLES = 8_000
# REQUEST_ROW: angular velocity [rad/s] and number of the newest request; STATE_ROW: angle [rad],
# number of the newest acknowledged request, and number of samples whose rows are complete.
ANGLE = 0
REQUEST_NUMBER = 1
SAMPLE_COUNT = 2
# FOLLOWER_ROW: number of the next sample that is repeated, and number of samples left out.
NEXT_SAMPLE = 0
LEFT_OUT = 1

TRACKING_BANDWIDTH = 250.0
"""Bandwidth of the anchor [rad/s]; it lags by 2/ω, 8 ms."""
MAX_SPEED = 0.4
"""Largest speed of the anchor [m/s]."""
POLL_TIME = 2_000_000
"""Time for which a following loop waits before it looks for the next sample again [ns]."""
MAX_POLLS = 25
"""Waits after which its anchor rests for a sample, so that a request to stop is met."""
MAX_LAG = 2000
"""Samples behind the other loop, beyond which a following loop leaves samples out."""


def history_row(sample: int) -> int:
    """Return the row of the anchor at a sample."""
    return HEADER_ROWS + sample % HISTORY_SAMPLES


def follow_anchor(device: SimulatedDevice) -> tuple[float, float, float, float, float, float]:
    """Return the anchor of the other loop at its sample and at the next [m], and wait for them.

    The sample is the own one plus ``counters[2]``. Without a further sample the anchor rests.
    """
    at = device.anchor
    sample = device.counters[1] + device.counters[2]
    polls = 0
    while at[STATE_ROW, SAMPLE_COUNT] < sample + 2 and polls < MAX_POLLS:
        call_address(device.clock.nanosleep, CLOCK_BOOTTIME, 0, device.clock.timespec, 0)
        polls += 1
    lag = int(at[STATE_ROW, SAMPLE_COUNT]) - 2 - sample
    left_out = lag if lag > MAX_LAG else 0
    here = history_row(sample + left_out)
    following = sample + left_out + (1 if lag >= 0 else 0)
    there = history_row(following)
    device.counters[2] += following - sample - 1
    at[FOLLOWER_ROW, NEXT_SAMPLE] = following
    at[FOLLOWER_ROW, LEFT_OUT] += left_out
    return at[here, 0], at[here, 1], at[here, 2], at[there, 0], at[there, 1], at[there, 2]


def anchor_segment(device: SimulatedDevice) -> tuple[float, float, float, float, float, float]:
    """Return the position of the hand's anchor at this sample and at the next [m].

    v' = ω² (target - a) - 2 ω v, with |v| limited to ``MAX_SPEED``. With a clock that can wait, the
    anchor is that of another loop.
    """
    if device.clock.nanosleep != 0:
        return follow_anchor(device)
    at = device.anchor
    at[STATE_ROW, SAMPLE_COUNT] = device.counters[1]  # written in the call after that of the row
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
    row = history_row(device.counters[1])
    for i in range(3):
        at[row, i] = at[ANCHOR, i]
        at[VELOCITY, i] *= share
        at[ANCHOR, i] += step * at[VELOCITY, i]
    at[STATE_ROW, ANGLE] = angle
    at[STATE_ROW, REQUEST_NUMBER] = number
    return ax, ay, az, at[ANCHOR, 0], at[ANCHOR, 1], at[ANCHOR, 2]

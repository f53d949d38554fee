"""The anchor of a simulated hand that repeats the motion of another loop's hand, sample by sample.

The loop has no clock of its own: it waits for each sample of the other one. So both get the same
motion at the same samples, however late either is.
"""

from asperity.core.compiled import Kernels, call_address
from asperity.loop.clock import CLOCK_BOOTTIME
from asperity.servo.kernels.pointer_anchor import (
    FOLLOWER_ROW,
    HEADER_ROWS,
    HISTORY_SAMPLES,
    ROWS_PER_SAMPLE,
    SAMPLE_COUNT,
    STATE_ROW,
)
from asperity.simulation.kernels.simulated_device import SimulatedDevice

KERNELS = Kernels(provides=("anchor_segment",), native=("call_address",))

POLL_TIME = 2_000_000
"""Time between two looks for a sample of the other loop [ns]."""
MAX_POLLS = 25
"""Looks after which the hand rests for a sample, so that requests to stop are met."""
MAX_LAG = 2000
"""Samples behind the other loop, beyond which the following loop leaves samples out."""
# FOLLOWER_ROW: number of the next sample that is repeated, and samples left out.
NEXT_SAMPLE, LEFT_OUT = 0, 1


def wait_for_samples(count: int, device: SimulatedDevice) -> bool:
    """Wait until so many samples of the other loop are complete; return whether they are."""
    polls = 0
    while device.anchor[STATE_ROW, SAMPLE_COUNT] < count and polls < MAX_POLLS:
        device.clock.timespec[0] = 0
        device.clock.timespec[1] = POLL_TIME
        call_address(device.clock.nanosleep, CLOCK_BOOTTIME, 0, device.clock.timespec, 0)
        polls += 1
    return bool(device.anchor[STATE_ROW, SAMPLE_COUNT] >= count)


def anchor_segment(device: SimulatedDevice) -> tuple[float, float, float, float, float, float]:
    """Return the position of the other hand's anchor at its sample and at the next [m].

    The sample is the own one plus ``counters[2]``. Without a further sample the anchor rests.
    """
    at = device.anchor
    sample = device.counters[1] + device.counters[2]
    is_known = wait_for_samples(sample + 2, device)
    behind = int(at[STATE_ROW, SAMPLE_COUNT]) - 2 - sample
    if behind > MAX_LAG:
        sample += behind
        device.counters[2] += behind
        at[FOLLOWER_ROW, LEFT_OUT] += behind
    here = HEADER_ROWS + ROWS_PER_SAMPLE * (sample % HISTORY_SAMPLES)
    there = here
    if is_known:
        sample += 1
        there = HEADER_ROWS + ROWS_PER_SAMPLE * (sample % HISTORY_SAMPLES)
    else:
        device.counters[2] -= 1
    at[FOLLOWER_ROW, NEXT_SAMPLE] = sample
    return at[here, 0], at[here, 1], at[here, 2], at[there, 0], at[there, 1], at[there, 2]

"""The trace of a replay: the columns that are compared with the recording."""

# ruff: noqa: ARG001 - one signature for all traces

from typing import NamedTuple

from asperity.core.compiled import FloatArray, Kernels
from asperity.kernels.probe_functions import probe_depth
from asperity.kernels.tick import ServoSettings, ServoState
from asperity.loop.interface import GuardedForce, Reading

KERNELS = Kernels(provides=("trace_sample", "trace_timing"), loops=("depth_batch",))


class ReplayTrace(NamedTuple):
    """The trace of a replay.

    Attributes:
        rows: force [N], anchor of the law [m] and whether it is held (n, 7).
        first_sample: number of the sample of the first row.
    """

    rows: FloatArray
    first_sample: int


def trace_sample(
    trace: ReplayTrace,
    sample: int,
    reading: Reading,
    before: ServoState,
    servo: ServoState,
    force: GuardedForce,
    in_contact: bool,
    settings: ServoSettings,
    device: object,
) -> None:
    """Write a row; see ``interface``."""
    row = sample - trace.first_sample
    trace.rows[row, 0] = servo.fx
    trace.rows[row, 1] = servo.fy
    trace.rows[row, 2] = servo.fz
    trace.rows[row, 3] = servo.anchor_x
    trace.rows[row, 4] = servo.anchor_y
    trace.rows[row, 5] = 1.0 if servo.held else 0.0
    trace.rows[row, 6] = servo.anchor_z


def trace_timing(trace: ReplayTrace, reading: Reading, lateness: int, duration: int) -> None:
    """Do nothing: there is no clock."""


def depth_batch(points: FloatArray, out: FloatArray, texture: object) -> None:
    """Write the depths [m] of probes (n, 3) [m], 0 out of contact."""
    for i in range(points.shape[0]):
        out[i] = probe_depth(points[i, 0], points[i, 1], points[i, 2], texture)

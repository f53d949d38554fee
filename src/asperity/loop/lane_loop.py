"""The closed loop of one simulation or of several at once, a lane each.

The lanes have one surface, body and servo; start, stiffness, delay and progress may differ. In each
sample all lanes tick one after the other, so that the processor works on several of them. The bits
of a lane do not depend on the others.

What a lane records is a setting: rows of the trace, and statistics that detect a limit cycle.
"""

# ruff: noqa: ARG001 - one signature for all traces

from typing import NamedTuple

from asperity.core.compiled import FloatArray, IntArray, Kernels
from asperity.kernels.tick import ServoSettings, ServoState
from asperity.loop.body_interface import RUNNING, stored_energy
from asperity.loop.interface import NO_END, GuardedForce, LoopState, LoopTiming, Reading
from asperity.loop.servo_loop import run_sample
from asperity.loop.simulated_device import (
    COUNTERS_SIZE,
    FRICTION,
    LOST,
    SAME_SAMPLE,
    SAMPLES,
    SAMPLING,
    SUPPLIED,
    SimulatedDevice,
    anchor_segment,
    due_force,
)

KERNELS = Kernels(
    provides=("trace_sample", "trace_timing"), loops=("run_lanes", "stored_energy_at")
)

# Numbers of a servo's state.
SERVO_STATE_SIZE = 13
# Counter of a lane after those of its device: why it stopped.
STOP = COUNTERS_SIZE
LANE_COUNTERS_SIZE = COUNTERS_SIZE + 1
# Statistics of a lane: least and greatest position since the start; since ``SAMPLE_COUNT`` was
# reset the number of samples, the first velocity, and the sums of the deviations from it and of
# their squares; the first energies supplied by the texture and dissipated; the same sums of
# positions; the sums of the deviations of the energies, and of the squares of their difference.
LOW = 0
HIGH = 3
SAMPLE_COUNT = 6
BASE_VELOCITY = 7
VELOCITY_SUM = 10
VELOCITY_SQUARES = 13
BASE_ENERGIES = 16
BASE_POSITION = 18
POSITION_SUM = 21
POSITION_SQUARES = 24
ENERGY_SUMS = 27
NET_SQUARES = 29
STATISTICS_SIZE = 30


class Lanes(NamedTuple):
    """The lanes, a row each.

    Attributes:
        x: states of the bodies, position [m], velocity [m/s], more.
        queues: delayed forces (n, at least the longest delay + 1, 3) [N].
        counters: of the devices, and why lanes stopped (n, ``LANE_COUNTERS_SIZE``).
        servo_states: states of the servos (n, ``SERVO_STATE_SIZE``).
        ledgers: sums of energies.
        memories: warm starts of the contacts.
        statistics: (n, ``STATISTICS_SIZE``), or (n, 0) to record none.
        offsets: shift of the anchor (n, 3) [m].
        stiffness: first parameter of the law (n,) [N/m].
    """

    x: FloatArray
    queues: FloatArray
    counters: IntArray
    servo_states: FloatArray
    ledgers: FloatArray
    memories: FloatArray
    statistics: FloatArray
    offsets: FloatArray
    stiffness: FloatArray


class LaneTrace(NamedTuple):
    """What is recorded of a lane.

    Attributes:
        rows: rows to write (n, columns), see ``COLUMNS``; none are written if n is 0.
        counters: number of rows written (1,).
        statistics: statistics of the lane; none if empty.
    """

    rows: FloatArray
    counters: IntArray
    statistics: FloatArray


def run_lanes(
    lanes: Lanes,
    samples: int,
    anchor: FloatArray,
    plant: object,
    settings: ServoSettings,
    rows: FloatArray,
    row_counters: IntArray,
    texture: object,
    law: tuple[float, ...],
) -> None:
    """Run each lane over a number of samples; a lane that has stopped is skipped.

    Args:
        lanes: the lanes; changed.
        samples: number of samples.
        anchor: positions of the hand's anchor at the samples (k, 3) [m], up to the last of all.
        plant: record of the body.
        settings: settings of the servo.
        rows: rows of the trace of a single lane, see :class:`LaneTrace`; none for several.
        row_counters: number of these rows written (1,).
        texture: record of the texture.
        law: parameters of the law, of which the first is replaced by the stiffness of the lane.
    """
    rate = 1.0 / settings.period
    for _sample in range(samples):
        is_active = False
        for lane in range(lanes.x.shape[0]):
            if lanes.counters[lane, STOP] != RUNNING:
                continue
            is_active = True
            device = SimulatedDevice(
                lanes.x[lane],
                lanes.queues[lane],
                lanes.counters[lane],
                anchor,
                lanes.offsets[lane],
                lanes.ledgers[lane],
                rate,
                plant,
                0.0,
                0.0,
                (),
            )
            trace = LaneTrace(rows, row_counters, lanes.statistics[lane])
            parameters = (lanes.stiffness[lane],) + law[1:]  # noqa: RUF005 - no stars in Numba
            state = load_state(lanes, lane)
            memory = lanes.memories[lane]
            _cause, stop, state = run_sample(
                state,
                NO_END,
                settings,
                (),  # type: ignore[arg-type]  # neither clock nor guards have a record here
                (),  # type: ignore[arg-type]  # no guards
                device,
                trace,
                memory,
                texture,
                parameters,
            )
            store_servo_state(lanes.servo_states, lane, state.servo)
            lanes.counters[lane, STOP] = stop
        if not is_active:
            break


def load_state(lanes: Lanes, lane: int) -> LoopState:
    """Return the state of a loop whose guards change no force."""
    states = lanes.servo_states
    servo = ServoState(
        states[lane, 0],
        states[lane, 1],
        states[lane, 2],
        states[lane, 3],
        states[lane, 4],
        states[lane, 5],
        states[lane, 6],
        states[lane, 7],
        states[lane, 8] > 0.0,
        states[lane, 9],
        states[lane, 10],
        states[lane, 11],
        states[lane, 12],
    )
    force = GuardedForce(servo.fx, servo.fy, servo.fz, 1.0, 0.0, 0.0)
    return LoopState(servo, force, LoopTiming(lanes.counters[lane, SAMPLES], 0, 0, 0, 0))


def store_servo_state(states: FloatArray, lane: int, servo: ServoState) -> None:
    """Write the state of a servo into its row."""
    states[lane, 0] = servo.x
    states[lane, 1] = servo.y
    states[lane, 2] = servo.z
    states[lane, 3] = servo.vx
    states[lane, 4] = servo.vy
    states[lane, 5] = servo.vz
    states[lane, 6] = servo.anchor_x
    states[lane, 7] = servo.anchor_y
    states[lane, 8] = 1.0 if servo.held else 0.0
    states[lane, 9] = servo.fx
    states[lane, 10] = servo.fy
    states[lane, 11] = servo.fz
    states[lane, 12] = servo.anchor_z


def trace_sample(
    trace: LaneTrace,
    sample: int,
    reading: Reading,
    before: ServoState,
    servo: ServoState,
    force: GuardedForce,
    in_contact: bool,
    settings: ServoSettings,
    device: SimulatedDevice,
) -> None:
    """Add to the ledger, and record what the lane records; see ``interface``."""
    add_command_energies(device.ledger, before, servo)
    if trace.statistics.shape[0] != 0:
        update_statistics(trace.statistics, device.x, device.ledger)
    if trace.rows.shape[0] == 0:
        return
    write_row(trace.counters[0], sample * settings.period, servo, trace.rows, device)
    trace.counters[0] += 1


def trace_timing(trace: LaneTrace, reading: Reading, lateness: int, duration: int) -> None:
    """Do nothing: there is no clock."""


def add_command_energies(ledger: FloatArray, before: ServoState, after: ServoState) -> None:
    """Add the terms that follow from the readings and commands of two samples to the ledger."""
    dx = after.x - before.x
    dy = after.y - before.y
    dz = after.z - before.z
    ledger[SAME_SAMPLE] += after.fx * dx
    ledger[SAME_SAMPLE + 1] += after.fy * dy
    ledger[SAME_SAMPLE + 2] += after.fz * dz
    ledger[SAMPLING] += 0.5 * (
        (before.fx - after.fx) * dx + (before.fy - after.fy) * dy + (before.fz - after.fz) * dz
    )


def write_row(
    row: int, time: float, servo: ServoState, trace: FloatArray, device: SimulatedDevice
) -> None:
    """Write a row of the trace, see ``COLUMNS``."""
    fx, fy, fz = due_force(servo.fx, servo.fy, servo.fz, device)
    ax, ay, az, _bx, _by, _bz = anchor_segment(device)
    trace[row, 0] = time
    for i in range(6):
        trace[row, 1 + i] = device.x[i]
    trace[row, 7] = servo.fx
    trace[row, 8] = servo.fy
    trace[row, 9] = servo.fz
    trace[row, 10] = fx
    trace[row, 11] = fy
    trace[row, 12] = fz
    trace[row, 13] = ax
    trace[row, 14] = ay
    trace[row, 15] = az
    for i in range(10):
        trace[row, 16 + i] = device.ledger[i]
    trace[row, 26] = stored_energy(device.x, ax, ay, az, device.plant)
    trace[row, 27] = servo.anchor_x
    trace[row, 28] = servo.anchor_y
    trace[row, 29] = 1.0 if servo.held else 0.0
    trace[row, 30] = servo.anchor_z


def update_statistics(statistics: FloatArray, x: FloatArray, ledger: FloatArray) -> None:
    """Update the statistics of a lane with its state before a sample."""
    is_first = statistics[SAMPLE_COUNT] == 0.0
    statistics[SAMPLE_COUNT] += 1.0
    supplied = ledger[SUPPLIED] + ledger[SUPPLIED + 1] + ledger[SUPPLIED + 2]
    taken = ledger[LOST] - ledger[FRICTION]
    if is_first:
        statistics[BASE_ENERGIES] = supplied
        statistics[BASE_ENERGIES + 1] = taken
        statistics[ENERGY_SUMS] = 0.0
        statistics[ENERGY_SUMS + 1] = 0.0
        statistics[NET_SQUARES] = 0.0
    supplied -= statistics[BASE_ENERGIES]
    taken -= statistics[BASE_ENERGIES + 1]
    statistics[ENERGY_SUMS] += supplied
    statistics[ENERGY_SUMS + 1] += taken
    statistics[NET_SQUARES] += (supplied - taken) ** 2
    for i in range(3):
        statistics[LOW + i] = min(statistics[LOW + i], x[i])
        statistics[HIGH + i] = max(statistics[HIGH + i], x[i])
        if is_first:
            statistics[BASE_VELOCITY + i] = x[3 + i]
            statistics[VELOCITY_SUM + i] = 0.0
            statistics[VELOCITY_SQUARES + i] = 0.0
            statistics[BASE_POSITION + i] = x[i]
            statistics[POSITION_SUM + i] = 0.0
            statistics[POSITION_SQUARES + i] = 0.0
        deviation = x[3 + i] - statistics[BASE_VELOCITY + i]
        statistics[VELOCITY_SUM + i] += deviation
        statistics[VELOCITY_SQUARES + i] += deviation * deviation
        displacement = x[i] - statistics[BASE_POSITION + i]
        statistics[POSITION_SUM + i] += displacement
        statistics[POSITION_SQUARES + i] += displacement * displacement


def stored_energy_at(x: FloatArray, anchor: FloatArray, plant: object) -> float:
    """Return the stored energy [J] with the hand's anchor at a position (3,) [m]."""
    return stored_energy(x, anchor[0], anchor[1], anchor[2], plant)

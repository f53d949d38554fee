"""The closed loop of several runs at once: one surface, body and servo from several starts.

Stiffness, delay and progress of the runs may differ. In each sample all runs tick, and then all
bodies advance. Each run equals its run alone, bit for bit. No trace is written: a few sums are
enough to detect a limit cycle.
"""

from asperity.core.compiled import FloatArray, IntArray, Kernels
from asperity.kernels.probe_functions import probe_in_contact
from asperity.kernels.tick import ServoSettings, ServoState, servo_tick, state_before_tick
from asperity.simulation.kernels.body_interface import (
    DIVERGED,
    RUNNING,
    SAMPLES,
    STOP,
    SampleInput,
    advance_body,
)
from asperity.simulation.kernels.body_parts import FRICTION, LOST, SUPPLIED
from asperity.simulation.kernels.simulated_device import flush_subnormals

KERNELS = Kernels(loops=("simulate_lanes",))

# Numbers of a servo's state.
SERVO_STATE_SIZE = 12
# Column of the delay in ``progress``, beside ``STOP`` and ``SAMPLES``.
DELAY = 2
# Statistics of a run: least and greatest position since the start; since ``SAMPLE_COUNT`` was reset
# the number of samples, the first velocity, and the sums of the deviations from it and of their
# squares; energies supplied by the texture and dissipated, before the last sample; the same sums
# of positions.
LOW = 0
HIGH = 3
SAMPLE_COUNT = 6
BASE_VELOCITY = 7
VELOCITY_SUM = 10
VELOCITY_SQUARES = 13
PREVIOUS_ENERGIES = 16
BASE_POSITION = 18
POSITION_SUM = 21
POSITION_SQUARES = 24
STATISTICS_SIZE = 27


def load_servo_state(states: FloatArray, lane: int) -> ServoState:
    """Return the state of a servo from its row."""
    return ServoState(
        states[lane, 0], states[lane, 1], states[lane, 2], states[lane, 3],
        states[lane, 4], states[lane, 5], states[lane, 6], states[lane, 7],
        states[lane, 8] > 0.0, states[lane, 9], states[lane, 10], states[lane, 11],
    )  # fmt: skip


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


def simulate_lanes(
    x: FloatArray, queues: FloatArray, servo_states: FloatArray, ledger: FloatArray,
    anchor: FloatArray, offset: FloatArray, samples: int, plant: object, settings: ServoSettings,
    memory: FloatArray, texture: object, law: tuple[float, ...], stiffness: FloatArray,
    statistics: FloatArray, progress: IntArray,
) -> None:  # fmt: skip
    """Run each of n runs over a number of samples.

    Args:
        x: states of the bodies, a row per run; changed.
        queues: delayed forces (n, at least the longest delay + 1, 3) [N]; changed.
        servo_states: states of the servos (n, 12); changed.
        ledger: sums (n, sums) but those of readings and commands; changed.
        anchor: positions of the hand's anchor at the samples (k, 3) [m], up to the last of any run.
        offset: shift of the anchor in each run (n, 3) [m].
        samples: number of samples.
        plant: record of the body.
        settings: settings of the servo.
        memory: warm starts of the contacts (n, 22); changed.
        texture: record of the texture.
        law: parameters of the law, of which the first is replaced.
        stiffness: the first parameter in each run (n,) [N/m].
        statistics: statistics of each run (n, ``STATISTICS_SIZE``); changed.
        progress: stop reason, samples and delay of each run (n, 3); changed. Runs that have stopped
            are skipped.
    """
    rate = 1.0 / settings.period
    for _sample in range(samples):
        active = False
        for run in range(x.shape[0]):
            if progress[run, STOP] != RUNNING:
                continue
            active = True
            now = progress[run, SAMPLES]
            if now & 255 == 0:
                flush_subnormals(x[run])
            servo = load_servo_state(servo_states, run)
            before = state_before_tick(servo, now, x[run, 0], x[run, 1], x[run, 2], settings)
            own = (stiffness[run],) + law[1:]  # noqa: RUF005 - no stars in compiled functions
            servo = servo_tick(
                before, settings, x[run, 0], x[run, 1], x[run, 2], memory[run], texture, own
            )
            store_servo_state(servo_states, run, servo)
            size = progress[run, DELAY] + 1
            head = now % size
            queues[run, head, 0] = servo.fx
            queues[run, head, 1] = servo.fy
            queues[run, head, 2] = servo.fz
            head = head + 1 if head + 1 < size else 0
            ax = anchor[now, 0] + offset[run, 0]
            ay = anchor[now, 1] + offset[run, 1]
            az = anchor[now, 2] + offset[run, 2]
            inputs = SampleInput(
                queues[run, head, 0], queues[run, head, 1], queues[run, head, 2], ax, ay, az,
                (anchor[now + 1, 0] + offset[run, 0] - ax) * rate,
                (anchor[now + 1, 1] + offset[run, 1] - ay) * rate,
                (anchor[now + 1, 2] + offset[run, 2] - az) * rate,
                probe_in_contact(servo.x, servo.y, servo.z, texture),
            )  # fmt: skip
            update_lane_statistics(statistics, run, x, ledger)
            progress[run, STOP] = advance_body(x[run], ledger[run], inputs, plant)
            finish_lane_sample(x, progress, run)
        if not active:
            break


def update_lane_statistics(
    statistics: FloatArray, lane: int, x: FloatArray, ledger: FloatArray
) -> None:
    """Update the statistics of a run with its state before a sample."""
    first = statistics[lane, SAMPLE_COUNT] == 0.0
    statistics[lane, SAMPLE_COUNT] += 1.0
    for i in range(3):
        statistics[lane, LOW + i] = min(statistics[lane, LOW + i], x[lane, i])
        statistics[lane, HIGH + i] = max(statistics[lane, HIGH + i], x[lane, i])
        if first:
            statistics[lane, BASE_VELOCITY + i] = x[lane, 3 + i]
            statistics[lane, VELOCITY_SUM + i] = 0.0
            statistics[lane, VELOCITY_SQUARES + i] = 0.0
            statistics[lane, BASE_POSITION + i] = x[lane, i]
            statistics[lane, POSITION_SUM + i] = 0.0
            statistics[lane, POSITION_SQUARES + i] = 0.0
        deviation = x[lane, 3 + i] - statistics[lane, BASE_VELOCITY + i]
        statistics[lane, VELOCITY_SUM + i] += deviation
        statistics[lane, VELOCITY_SQUARES + i] += deviation * deviation
        offset = x[lane, i] - statistics[lane, BASE_POSITION + i]
        statistics[lane, POSITION_SUM + i] += offset
        statistics[lane, POSITION_SQUARES + i] += offset * offset
    statistics[lane, PREVIOUS_ENERGIES] = (
        ledger[lane, SUPPLIED] + ledger[lane, SUPPLIED + 1] + ledger[lane, SUPPLIED + 2]
    )
    statistics[lane, PREVIOUS_ENERGIES + 1] = ledger[lane, LOST] - ledger[lane, FRICTION]


def finish_lane_sample(x: FloatArray, progress: IntArray, lane: int) -> None:
    """Count a sample of a run; stop a run that has diverged."""
    if progress[lane, STOP] != RUNNING:
        return
    progress[lane, SAMPLES] += 1
    size = 0.0
    for i in range(6):
        size += abs(x[lane, i])
    if not size < 1e6:
        progress[lane, STOP] = DIVERGED

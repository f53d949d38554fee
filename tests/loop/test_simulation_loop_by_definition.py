"""The closed loop as plain Python functions: the data flow of a sample and the written rows."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from asperity.core.checks import FloatArray
from asperity.kernels import tick
from asperity.kernels.tick import ServoState
from asperity.loop import lane_loop, no_guards, servo_loop, simulated_device
from asperity.loop.body_interface import DIVERGED, LEFT_WORKSPACE, RUNNING, SampleInput
from asperity.loop.lane_loop import (
    LANE_COUNTERS_SIZE,
    LOW,
    SAMPLE_COUNT,
    STATISTICS_SIZE,
    STOP,
    Lanes,
)
from asperity.loop.simulated_device import (
    COUNTERS_SIZE,
    DELAY,
    FRICTION,
    LEDGER_SIZE,
    LOST,
    QUEUE_HEAD,
    SAME_SAMPLE,
    SAMPLES,
    SAMPLING,
    SimulatedDevice,
)
from asperity.simulation.trace import COLUMNS

RNG = np.random.default_rng(61)
NAMES = [name for name, _unit in COLUMNS]
SERVO = ServoState(*RNG.normal(size=8), True, *RNG.normal(size=4))
SAMPLE_INPUT = SampleInput(*RNG.normal(size=9), True)


def test_force_is_delayed_by_its_number_of_samples() -> None:
    for delay in (0, 1, 3):
        queue, head, applied = np.zeros((delay + 1, 3)), 0, []
        for i in range(1, 9):
            head, *due = simulated_device.delay_force(queue, head, delay, i, 10.0 * i, 100.0 * i)
            applied.append(due)
            assert 0 <= head <= delay
        expected = [[max(i - delay, 0) * part for part in (1.0, 10.0, 100.0)] for i in range(1, 9)]
        assert applied == expected


def test_command_energies_are_added_to_the_ledger() -> None:
    """New force times displacement since the last reading, and half the force change times it."""
    ledger = np.arange(float(LEDGER_SIZE))
    before = ServoState(1.0, 2.0, 3.0, fx=5.0, fy=7.0, fz=11.0)
    after = ServoState(1.5, 2.25, 2.0, fx=-1.0, fy=4.0, fz=2.0)
    lane_loop.add_command_energies(ledger, before, after)
    displacement, force = np.array([0.5, 0.25, -1.0]), np.array([-1.0, 4.0, 2.0])
    expected = np.arange(float(LEDGER_SIZE))
    expected[SAME_SAMPLE : SAME_SAMPLE + 3] += force * displacement
    expected[SAMPLING] += 0.5 * float((np.array([5.0, 7.0, 11.0]) - force) @ displacement)
    np.testing.assert_allclose(ledger, expected, rtol=1e-15)


def device(x: FloatArray, delay: int = 1, **values: Any) -> SimulatedDevice:
    """Return a simulated device at 2 Hz with an anchor row per sample."""
    counters, ledger = np.zeros(COUNTERS_SIZE, np.int64), np.zeros(LEDGER_SIZE)
    counters[DELAY] = delay
    queue, anchor = np.zeros((delay + 1, 3)), RNG.normal(size=(9, 3))
    result = SimulatedDevice(x, queue, counters, anchor, np.zeros(3), ledger, 2.0, "plant")
    return result._replace(**values)


def test_row_values_match_their_column_names(monkeypatch: pytest.MonkeyPatch) -> None:
    def stored_energy(x: FloatArray, ax: float, ay: float, az: float, plant: object) -> float:
        assert plant == "plant"
        return float(x[0] + 2.0 * ax + 3.0 * ay + 4.0 * az)

    monkeypatch.setattr(lane_loop, "stored_energy", stored_energy)
    x, ledger = RNG.normal(size=8), RNG.normal(size=LEDGER_SIZE)
    body = device(x, 2, ledger=ledger, queue=RNG.normal(size=(3, 3)))
    body.counters[:DELAY] = 2, 6, 4
    body.offset[:] = 0.5, -0.25, 0.125
    (ax, ay, az), due = body.anchor[2] + body.offset, body.queue[0]
    expected: dict[str, Any] = {
        "time": 0.25,
        **dict(zip(["x", "y", "z", "vx", "vy", "vz"], x, strict=False)),
        "anchor x": ax,
        "anchor y": ay,
        "anchor z": az,
        "lost": ledger[LOST],
        "friction": ledger[FRICTION],
    }
    for held in (True, False):
        trace = np.full((3, len(COLUMNS)), np.nan)
        servo = SERVO._replace(held=held)
        lane_loop.write_row(1, 0.25, servo, trace, body)
        assert np.isnan(trace[[0, 2]]).all()
        row = trace[1]
        for name, value in expected.items():
            assert row[NAMES.index(name)] == value, name
        np.testing.assert_array_equal(row[7:16], [servo.fx, servo.fy, servo.fz, *due, ax, ay, az])
        np.testing.assert_array_equal(row[16:26], ledger[:10])
        assert row[26] == stored_energy(x, ax, ay, az, "plant")
        state = servo.anchor_x, servo.anchor_y, float(held), servo.anchor_z
        assert tuple(row[27:]) == state
    undelayed = lane_loop.due_force(1.0, 2.0, 3.0, device(x, 0))
    assert undelayed == (1.0, 2.0, 3.0)


def test_lane_statistics_are_bounds_and_sums() -> None:
    """Bounds since the start; sums of velocity, position, energies since the last segment."""
    rows, ledgers = RNG.normal(size=(12, 6)), RNG.normal(size=(12, LEDGER_SIZE))
    statistics = np.zeros(STATISTICS_SIZE)
    statistics[LOW:SAMPLE_COUNT] = [np.inf] * 3 + [-np.inf] * 3
    for x, ledger in zip(rows[:5], ledgers, strict=False):
        lane_loop.update_statistics(statistics, x, ledger)
    statistics[SAMPLE_COUNT] = 0.0
    for x, ledger in zip(rows[5:], ledgers[5:], strict=True):
        lane_loop.update_statistics(statistics, x, ledger)
    low, high, (count,), base, total, squares, first, *positions, energies, net = np.split(
        statistics, [3, 6, 7, 10, 13, 16, 18, 21, 24, 27, 29]
    )
    np.testing.assert_array_equal(low, rows[:, :3].min(axis=0))
    np.testing.assert_array_equal(high, rows[:, :3].max(axis=0))
    deviations = rows[5:, 3:] - rows[5, 3:]
    assert count == 7.0
    np.testing.assert_array_equal(base, rows[5, 3:])
    np.testing.assert_allclose(total, deviations.sum(axis=0), rtol=1e-14)
    np.testing.assert_allclose(squares, (deviations**2).sum(axis=0), rtol=1e-14)
    supplied = ledgers[5:, :3].sum(axis=1)
    taken = ledgers[5:, LOST] - ledgers[5:, FRICTION]
    np.testing.assert_allclose(first, [supplied[0], taken[0]], rtol=1e-14)
    changes = np.array([supplied - supplied[0], taken - taken[0]])
    np.testing.assert_allclose(energies, changes.sum(axis=1), rtol=1e-13)
    np.testing.assert_allclose(net, [np.square(changes[0] - changes[1]).sum()], rtol=1e-13)
    offsets = rows[5:, :3] - rows[5, :3]
    np.testing.assert_array_equal(positions[0], rows[5, :3])
    np.testing.assert_allclose(positions[1], offsets.sum(axis=0), rtol=1e-14)
    np.testing.assert_allclose(positions[2], (offsets**2).sum(axis=0), rtol=1e-14)


class Recorder:
    """A stand-in servo and body that record arguments; the body moves 1 m along each axis."""

    def __init__(
        self, monkeypatch: pytest.MonkeyPatch, stops: Any = lambda _x, _sample: RUNNING
    ) -> None:
        self.ticks: list[Any] = []
        self.inputs: list[SampleInput] = []
        self.rows: list[Any] = []
        self.flushed: list[int] = []
        self.stops = stops
        monkeypatch.setattr(tick, "flush_subnormal_state", self.flush)
        monkeypatch.setattr(tick, "initial_servo_state", lambda x, y, z, _s: ServoState(x, y, z))
        patches = {
            "servo_tick": self.servo_tick,
            "probe_in_contact": lambda x, y, z, _t: x > y + z,
            "trace_sample": lane_loop.trace_sample,
            "trace_timing": lane_loop.trace_timing,
        }
        for name in no_guards.KERNELS.provides:
            patches[name] = getattr(no_guards, name)
        for name, function in patches.items():
            monkeypatch.setattr(servo_loop, name, function)
        for name in ("device_read", "device_write"):
            monkeypatch.setattr(no_guards, name, getattr(simulated_device, name))
        monkeypatch.setattr(simulated_device, "flush_subnormal", lambda value: value + 0.25)
        monkeypatch.setattr(simulated_device, "advance_body", self.advance_body)
        monkeypatch.setattr(lane_loop, "write_row", self.write_row)

    def flush(self, state: ServoState) -> ServoState:
        self.flushed.append(len(self.ticks))
        return state

    def servo_tick(self, state: ServoState, _settings: Any, *arguments: Any) -> ServoState:
        self.ticks.append((state, *arguments))
        n = len(self.ticks)
        return ServoState(*arguments[:3], fx=n, fy=2.0 * n, fz=3.0 * n)

    def write_row(self, row: int, time: float, servo: ServoState, *_rest: Any) -> None:
        self.rows.append((row, time, servo.fx))

    def advance_body(
        self, x: FloatArray, _ledger: FloatArray, inputs: SampleInput, plant: object
    ) -> int:
        assert plant == "plant"
        self.inputs.append(inputs)
        x[:3] += 1.0
        return int(self.stops(x, len(self.inputs)))


def run(samples: int, *, done: int = 1, rows: int = 99, x: Any = None) -> Any:
    """Return stop, rows, state of the servo, samples, head of the queue and the anchor positions.

    A second lane, which has stopped before, is left alone.
    """
    anchor = np.arange(3.0 * (samples + 1)).reshape(-1, 3) ** 2
    counters = np.zeros((2, LANE_COUNTERS_SIZE), np.int64)
    counters[:, 1 : DELAY + 1] = done, done, 1
    counters[1, STOP] = DIVERGED
    states = np.zeros((2, 8))
    states[0] = 0.0 if x is None else np.resize(x, 8)
    servo_states = np.tile([float(value) for value in SERVO], (2, 1))
    empty = np.zeros((2, 0))
    lanes = Lanes(
        states,
        np.zeros((2, 2, 3)),
        counters,
        servo_states,
        np.zeros((2, LEDGER_SIZE)),
        np.zeros((2, 3)),
        empty,
        np.zeros((2, 3)),
        np.array([7.0, 8.0]),
    )
    row_counters = np.array([0])
    settings: Any = SimpleNamespace(period=0.5)
    stopped = [table[1].copy() for table in lanes]
    lane_loop.run_lanes(
        lanes,
        samples,
        anchor,
        "plant",
        settings,
        np.zeros((rows, 9)),
        row_counters,
        "texture",
        (0.5, 9.0),
    )
    assert all((table[1] == before).all() for table, before in zip(lanes, stopped, strict=True))
    servo = lane_loop.load_state(lanes, 0).servo
    return counters[0, STOP], row_counters[0], servo, *counters[0, [SAMPLES, QUEUE_HEAD]], anchor


def test_sample_passes_reading_to_servo_and_force_to_body(monkeypatch: pytest.MonkeyPatch) -> None:
    """The servo gets the reading; the body the force of one sample ago and the anchor's motion."""
    recorder, x = Recorder(monkeypatch), np.array([0.0, -1.0, -2.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    stop, rows, servo, samples, head, anchor = run(4, x=x)
    assert (stop, rows, samples, head) == (RUNNING, 4, 5, 0)
    assert recorder.ticks[0][0] == SERVO
    for i, (previous, *arguments) in enumerate(recorder.ticks):
        np.testing.assert_array_equal(arguments[:3], [i, i - 1.0, i - 2.0])
        assert arguments[4:] == ["texture", (7.0, 9.0)]
        assert i == 0 or previous == ServoState(i - 1, i - 2, i - 3, fx=i, fy=2 * i, fz=3 * i)
    assert servo == ServoState(3.0, 2.0, 1.0, fx=4.0, fy=8.0, fz=12.0)
    for i, inputs in enumerate(recorder.inputs):
        assert inputs[:3] == (i, 2.0 * i, 3.0 * i)
        assert inputs[3:6] == tuple(anchor[i])
        assert inputs[6:9] == tuple((anchor[i + 1] - anchor[i]) / 0.5)
        assert bool(inputs[9]) is (i < 3)


def test_first_sample_reads_the_initial_state(monkeypatch: pytest.MonkeyPatch) -> None:
    recorder = Recorder(monkeypatch)
    run(1, done=0, x=np.array([0.5, 1.5, 2.5, 0.0, 0.0, 0.0]))
    # After the flush of subnormals, whose stand-in adds 0.25.
    assert recorder.ticks[0][:4] == (ServoState(0.75, 1.75, 2.75), 0.75, 1.75, 2.75)
    assert recorder.flushed == [0]


@pytest.mark.parametrize("done", [0, 3])
def test_a_row_is_written_of_every_sample(done: int, monkeypatch: pytest.MonkeyPatch) -> None:
    recorder = Recorder(monkeypatch)
    assert run(7, done=done)[1] == 7
    assert recorder.rows == [(row, 0.5 * (done + row), row + 1) for row in range(7)]
    recorder.rows.clear()
    assert run(7, done=done, rows=0)[1] == 0
    assert recorder.rows == []


def test_subnormals_are_flushed_every_256_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    recorder = Recorder(monkeypatch)
    run(600, done=200)
    assert recorder.flushed == [56, 312, 568]


def test_run_stops_at_workspace_limit_or_divergence(monkeypatch: pytest.MonkeyPatch) -> None:
    """The body stops it during a sample; a coordinate or speed of 1e6 after the sample."""
    recorder = Recorder(monkeypatch, lambda _x, sample: LEFT_WORKSPACE if sample == 3 else RUNNING)
    stop, _rows, _state, samples, *_rest = run(9, done=5)
    assert (stop, samples, len(recorder.ticks)) == (LEFT_WORKSPACE, 7, 3)
    for axis in range(6):
        for value, sample in (
            (999_990.0, None),
            (-999_990.0, None),
            (1e6, 3),
            (-1e6, 3),
            (np.nan, 3),
        ):

            def push(x: FloatArray, at: int, axis: int = axis, value: float = value) -> int:
                x[:6] = 0.0
                x[axis] = value if at == 3 else 0.0
                return RUNNING

            recorder = Recorder(monkeypatch, push)
            stop, _rows, _state, samples, *_rest = run(4, done=5)
            assert stop == (RUNNING if sample is None else DIVERGED)
            assert samples == 5 + (4 if sample is None else sample)


def test_stored_energy_is_computed_with_the_anchor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lane_loop, "stored_energy", lambda *arguments: arguments)
    point: Any = np.array([1.0, 2.0, 3.0])
    stored: Any = lane_loop.stored_energy_at(point, 2.0 * point, "plant")
    assert stored == (point, 2.0, 4.0, 6.0, "plant")

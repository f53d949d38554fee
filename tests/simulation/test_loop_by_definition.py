"""The closed loop as plain functions: who is told what in a sample, and what is written down."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from asperity.checks import FloatArray
from asperity.kernels.tick import ServoState
from asperity.simulation.kernels import servo_loop, side_by_side
from asperity.simulation.kernels.body_functions import DIVERGED, LEFT, RAN, Held
from asperity.simulation.kernels.booking import FRICTION, LOST, SAME_SAMPLE, SAMPLING, SUMS
from asperity.simulation.trace import COLUMNS

RNG = np.random.default_rng(61)
NAMES = [name for name, _unit in COLUMNS]
SERVO = ServoState(*RNG.normal(size=8), True, *RNG.normal(size=3))
HELD = Held(*RNG.normal(size=9), True)


def test_a_force_waits_for_its_delay() -> None:
    for delay in (0, 1, 3):
        queue, head, seen = np.zeros((delay + 1, 3)), 0, []
        for i in range(1, 9):
            head, *due = servo_loop.wait_in_queue(queue, head, i, 10.0 * i, 100.0 * i)
            seen.append(due)
            assert 0 <= head <= delay
        expected = [[max(i - delay, 0) * part for part in (1.0, 10.0, 100.0)] for i in range(1, 9)]
        assert seen == expected


def test_readings_and_commands_are_booked() -> None:
    """The new force over the way since the last reading; half the change of force over it."""
    ledger = np.arange(float(SUMS))
    before = ServoState(1.0, 2.0, 3.0, fx=5.0, fy=7.0, fz=11.0)
    after = ServoState(1.5, 2.25, 2.0, fx=-1.0, fy=4.0, fz=2.0)
    servo_loop.book_command(ledger, before, after)
    way, force = np.array([0.5, 0.25, -1.0]), np.array([-1.0, 4.0, 2.0])
    expected = np.arange(float(SUMS))
    expected[SAME_SAMPLE : SAME_SAMPLE + 3] += force * way
    expected[SAMPLING] += 0.5 * float((np.array([5.0, 7.0, 11.0]) - force) @ way)
    np.testing.assert_allclose(ledger, expected, rtol=1e-15)


def test_a_row_is_what_its_columns_are_called(monkeypatch: pytest.MonkeyPatch) -> None:
    def stored_energy(x: FloatArray, ax: float, ay: float, az: float, plant: object) -> float:
        assert plant == "plant"
        return float(x[0] + 2.0 * ax + 3.0 * ay + 4.0 * az)

    monkeypatch.setattr(servo_loop, "stored_energy", stored_energy)
    x, ledger = RNG.normal(size=8), RNG.normal(size=SUMS)
    told: dict[str, Any] = {
        "time": 0.25, **dict(zip(["x", "y", "z", "vx", "vy", "vz"], x, strict=False)),
        "anchor x": HELD.ax, "anchor y": HELD.ay, "anchor z": HELD.az,
        "lost": ledger[LOST], "friction": ledger[FRICTION],
    }  # fmt: skip
    for held in (True, False):
        trace = np.full((3, len(COLUMNS)), np.nan)
        servo = SERVO._replace(held=held)
        servo_loop.trace_row(trace, 1, 0.25, x, servo, HELD, ledger, "plant")
        assert np.isnan(trace[[0, 2]]).all()
        row = trace[1]
        for name, value in told.items():
            if name in NAMES:
                assert row[NAMES.index(name)] == value, name
        force = (servo.fx, servo.fy, servo.fz, HELD.fx, HELD.fy, HELD.fz, HELD.ax, HELD.ay, HELD.az)
        np.testing.assert_array_equal(row[7:16], force)
        np.testing.assert_array_equal(row[16:26], ledger[:10])
        assert row[26] == stored_energy(x, HELD.ax, HELD.ay, HELD.az, "plant")
        assert tuple(row[27:]) == (servo.anchor_x, servo.anchor_y, float(held))


def test_what_is_seen_of_a_run() -> None:
    """Where it got from the beginning on, and how the velocity varies since it was last seen."""
    rows, ledgers = RNG.normal(size=(12, 6)), RNG.normal(size=(12, SUMS))
    seen = np.full((2, side_by_side.SEEN), np.nan)
    seen[1, side_by_side.LOW : side_by_side.ROWS] = [np.inf] * 3 + [-np.inf] * 3
    for x, ledger in zip(rows[:5], ledgers, strict=False):
        side_by_side.see(seen, 1, np.stack([-x, x]), np.stack([-ledger, ledger]))
    seen[1, side_by_side.ROWS] = 0.0
    for x, ledger in zip(rows[5:], ledgers[5:], strict=True):
        side_by_side.see(seen, 1, np.stack([-x, x]), np.stack([-ledger, ledger]))
    assert np.isnan(seen[0]).all()
    low, high, (count,), base, total, squares, last = np.split(seen[1], [3, 6, 7, 10, 13, 16])
    np.testing.assert_array_equal(low, rows[:, :3].min(axis=0))
    np.testing.assert_array_equal(high, rows[:, :3].max(axis=0))
    apart = rows[5:, 3:] - rows[5, 3:]
    assert count == 7.0
    np.testing.assert_array_equal(base, rows[5, 3:])
    np.testing.assert_allclose(total, apart.sum(axis=0), rtol=1e-14)
    np.testing.assert_allclose(squares, (apart**2).sum(axis=0), rtol=1e-14)
    expected = [ledgers[-1, :3].sum(), ledgers[-1, LOST] - ledgers[-1, FRICTION]]
    np.testing.assert_allclose(last, expected, rtol=1e-14)


class Told:
    """A servo and a body that write down what they are told; the body goes 1 m along each axis."""

    def __init__(
        self, monkeypatch: pytest.MonkeyPatch, stops: Any = lambda _x, _sample: RAN
    ) -> None:
        self.ticks: list[Any] = []
        self.held: list[Held] = []
        self.rows: list[Any] = []
        self.washed: list[int] = []
        self.stops = stops
        for name in ("servo_tick", "advance_body", "trace_row", "flushed_state"):
            monkeypatch.setattr(servo_loop, name, getattr(self, name))
        monkeypatch.setattr(servo_loop, "flushed", lambda value: value + 0.25)
        monkeypatch.setattr(servo_loop, "first_state", lambda x, y, z, _s: ServoState(x, y, z))
        monkeypatch.setattr(servo_loop, "probe_inside", lambda x, y, z, _t: x > y + z)

    def flushed_state(self, state: ServoState) -> ServoState:
        self.washed.append(len(self.ticks))
        return state

    def servo_tick(self, state: ServoState, _settings: Any, *given: Any) -> ServoState:
        self.ticks.append((state, *given))
        n = len(self.ticks)
        return ServoState(*given[:3], fx=n, fy=2.0 * n, fz=3.0 * n)

    def trace_row(self, _trace: FloatArray, row: int, time: float, *given: Any) -> None:
        self.rows.append((row, time, given[1].fx))

    def advance_body(self, x: FloatArray, _ledger: FloatArray, held: Held, plant: object) -> int:
        assert plant == "plant"
        self.held.append(held)
        x[:3] += 1.0
        return int(self.stops(x, len(self.held)))


def run(samples: int, *, every: int = 1, done: int = 1, rows: int = 99, x: Any = None) -> Any:
    """Return stop, rows, state, and the anchor that the hand was led along."""
    anchor = np.arange(3.0 * (samples + 1)).reshape(-1, 3) ** 2
    settings: Any = SimpleNamespace(period=0.5)
    found = servo_loop.servo_batch(
        np.zeros(8) if x is None else x, np.zeros((2, 3)), servo_loop.LoopState(SERVO, 0, done),
        np.zeros(SUMS), anchor, "plant", settings, np.zeros(3), "texture", "law",
        np.zeros((rows, 9)), every,
    )  # fmt: skip
    return *found, anchor


def test_a_sample_tells_servo_and_body_what_they_need(monkeypatch: pytest.MonkeyPatch) -> None:
    """The servo what is read, the body the force of a sample ago and where the anchor goes."""
    told, x = Told(monkeypatch), np.array([0.0, -1.0, -2.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    stop, rows, state, anchor = run(4, x=x)
    assert (stop, rows, state.samples, state.head) == (RAN, 4, 5, 0)
    assert told.ticks[0][0] == SERVO
    for i, (before, *given) in enumerate(told.ticks):
        np.testing.assert_array_equal(given[:3], [i, i - 1.0, i - 2.0])
        assert given[4:] == ["texture", "law"]
        assert i == 0 or before == ServoState(i - 1, i - 2, i - 3, fx=i, fy=2 * i, fz=3 * i)
    assert state.servo == ServoState(3.0, 2.0, 1.0, fx=4.0, fy=8.0, fz=12.0)
    for i, held in enumerate(told.held):
        assert held[:3] == (i, 2.0 * i, 3.0 * i)
        assert held[3:6] == tuple(anchor[i])
        assert held[6:9] == tuple((anchor[i + 1] - anchor[i]) / 0.5)
        assert bool(held[9]) is (i < 3)


def test_the_first_sample_of_all_reads_where_the_body_is(monkeypatch: pytest.MonkeyPatch) -> None:
    told = Told(monkeypatch)
    run(1, done=0, x=np.array([0.5, 1.5, 2.5, 0.0, 0.0, 0.0]))
    # Before it what is next to nothing was made nothing, here a quarter more.
    assert told.ticks[0][:4] == (ServoState(0.5, 1.5, 2.5), 0.75, 1.75, 2.75)
    assert told.washed == [0]


@pytest.mark.parametrize(
    ("every", "done", "expected"),
    [(1, 0, [0, 1, 2, 3, 4, 5, 6]), (3, 0, [0, 3, 6]), (3, 1, [3, 6]), (3, 2, [3, 6]),
     (3, 3, [3, 6, 9]), (10, 1, [])],
)  # fmt: skip
def test_rows_are_those_of_multiples(
    every: int, done: int, expected: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    told = Told(monkeypatch)
    found = run(7, every=every, done=done)
    assert found[1] == len(expected)
    assert [row for row, _time, _force in told.rows] == list(range(len(expected)))
    assert [time for _row, time, _force in told.rows] == [0.5 * sample for sample in expected]
    assert [force for _row, _time, force in told.rows] == [s - done + 1 for s in expected]
    told.rows.clear()
    assert run(7, every=every, done=done, rows=0)[1] == 0
    assert told.rows == []


def test_what_is_next_to_nothing_goes_every_256_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    told = Told(monkeypatch)
    run(600, done=200)
    assert told.washed == [56, 312, 568]


def test_what_stops_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """The body itself before its sample is done, or a place or speed of a million after it."""
    told = Told(monkeypatch, lambda _x, sample: LEFT if sample == 3 else RAN)
    stop, _rows, state, _anchor = run(9, done=5)
    assert (stop, state.samples, len(told.ticks)) == (LEFT, 7, 3)
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
                return RAN

            told = Told(monkeypatch, push)
            stop, _rows, state, _anchor = run(4, done=5)
            assert stop == (RAN if sample is None else DIVERGED)
            assert state.samples == 5 + (4 if sample is None else sample)


def test_stored_energy_is_asked_at_the_place_of_the_anchor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(servo_loop, "stored_energy", lambda *given: given)
    place = np.array([1.0, 2.0, 3.0])
    assert servo_loop.stored_batch(place, 2.0 * place, "plant") == (place, 2.0, 4.0, 6.0, "plant")  # type: ignore[comparison-overlap]  # told

"""The servo loop: agreement with a simulation, safety limits, and zero force when it ends."""

from __future__ import annotations

import math
import multiprocessing
import re
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.servo.python_device import SURFACE, PythonClock, PythonDevice, program_for

from asperity.contacts.warm_start import TRUNCATED_TICKS
from asperity.core.platform.clocks import no_clock
from asperity.core.platform.priority import Priority
from asperity.servo import loop_process
from asperity.servo.driver_loop import DriverLoop, build_program
from asperity.servo.drivers.library import LibraryDevice
from asperity.servo.drivers.simulated import simulated_driver
from asperity.servo.loop_memory import EndReason, LoopMemory, LoopStatistics
from asperity.servo.loop_process import LoopJob, _LoopServer
from asperity.servo.safety import Safety
from asperity.simulation import (
    BandHand,
    Cartesian,
    Pantograph,
    PrescribedHand,
    Servo,
    SpringHand,
    Stationary,
    Strokes,
    simulate,
)
from asperity.surface import Surface
from asperity.textures import Fourier

RunLoop = Callable[..., SimpleNamespace]
PRESSED = SpringHand(stiffness=300.0, damping=3.0, mass=0.05, force=(0.0, 0.0, -0.6))
STROKES = Strokes((-2e-3, 0.3e-3, 0.0), (2e-3, 0.3e-3, 0.0), 0.05, 2)
SERVO = Servo(
    2.5e-4,
    delay=2,
    position_resolution=1e-5,
    force_resolution=0.01,
    max_force=2.0,
    virtual_damping=0.3,
    velocity_share=0.3,
)
OPEN = Safety(ramp=0.0, max_slew=1e9, beyond_depth="warn")
PLANE = Strokes((-2e-3, 0.0, 0.0), (2e-3, 0.0, 0.0), 0.05, 2)
CASES = {
    "C in space, delay, steps, damping": (
        "C",
        Cartesian(0.05, 0.5, friction=0.05),
        PRESSED,
        SERVO,
        STROKES,
    ),
    "F, which has state": ("F", Cartesian(0.05, 0.5), PRESSED, Servo(1e-3), STROKES),
    "D, moved": (
        "D",
        Cartesian(0.05),
        PrescribedHand(),
        Servo(1e-3, delay=1),
        Strokes((-2e-3, 0.3e-3, -3e-4), (2e-3, 0.3e-3, -2e-4), 0.05, 2),
    ),
    "A on a pantograph, on a band": ("A", Pantograph(), BandHand(), Servo(1e-4, delay=3), PLANE),
}


@pytest.mark.parametrize("case", CASES)
def test_loop_trace_equals_simulation(case: str) -> None:
    law, plant, hand, servo, motion = CASES[case]
    surface = SURFACE.to_law(law)
    duration = 700 * servo.period  # more than the 256 samples between flushes of subnormals
    run = simulate(surface, plant, hand, servo, motion, duration)
    rows = run_simulated_device(surface, plant, hand, servo, motion, duration)
    assert np.abs(run.commanded).max() > 0.0
    np.testing.assert_array_equal(rows[:700, 0], run.time)
    np.testing.assert_array_equal(rows[:700, 1:4], run.position)
    np.testing.assert_array_equal(rows[:700, 4:7], run.commanded)
    np.testing.assert_array_equal(rows[:700, 7:10], run.applied)


@pytest.mark.parametrize("step", [0.0, 5e-6])
@pytest.mark.parametrize("delay", [0, 1, 3])
def test_energy_of_a_loop_is_that_of_its_simulation(delay: int, step: float) -> None:
    """The work of forces before their delay is another one."""
    servo = Servo(1e-3, delay=delay, position_resolution=step)
    plant, case = Cartesian(0.06, 1.0), (servo, STROKES, 0.7)
    run = simulate(SURFACE, plant, PRESSED, *case)
    rows = run_simulated_device(SURFACE, plant, PRESSED, *case)[:700]
    np.testing.assert_array_equal(rows[:, 7:10], run.applied)
    supplied = run.energies["supplied"].sum(axis=1)
    changes = np.abs(np.diff(run.applied, axis=0)).sum() + np.abs(run.applied).max(axis=0).sum()
    rounding = 0.5 * step * changes + 1e-9 * np.abs(supplied).max()
    np.testing.assert_allclose(rows[:, 11], supplied, rtol=0.0, atol=rounding)
    undelayed = np.cumsum((run.commanded[:-1] * np.diff(run.position, axis=0)).sum(axis=1))
    differences = np.abs(undelayed - supplied[1:])
    assert (differences.max() > 1e-5 + rounding) == (delay > 0)


def run_simulated_device(
    surface: Surface,
    plant: Any,
    hand: Any,
    servo: Servo,
    motion: Any,
    duration: float,
    safety: Safety = OPEN,
) -> np.ndarray:
    """Return the rows of an unclocked loop on a simulated device."""
    driver = simulated_driver(plant, hand, servo, motion, duration)
    shared = LoopMemory()
    loop = DriverLoop(driver, servo, safety, math.inf, shared.block(), no_clock())
    cause, _code = loop.run(
        build_program(surface, driver), driver.open(), round(duration / servo.period)
    )
    assert cause is EndReason.FINISHED
    return shared.rows(0)[0]


def test_opening_a_simulated_device_resets_its_state() -> None:
    driver = simulated_driver(
        Cartesian(0.05), PRESSED, Servo(1e-3), Stationary((0.0, 0.0, -1e-3)), 0.1
    )
    first = driver.open()
    first.x[:] = 7.0
    assert driver.open().x[0] == 0.0


def slide_at_depth(depth: float) -> Callable[[int], Any]:
    """Return a path that slides along x at a constant depth."""
    return lambda k: (1e-5 * k, 0.2e-3, -depth)


def test_force_ramps_up_at_start_and_down_at_stop(run_loop: RunLoop) -> None:
    device = PythonDevice(slide_at_depth(1e-3))
    result = run_loop(device, 100, safety=Safety(ramp=0.02))
    assert result.cause is EndReason.FINISHED
    shares = result.rows[:, 10]
    np.testing.assert_allclose(shares[:20], np.arange(1, 21) / 20)
    np.testing.assert_allclose(
        shares[99:], np.append(np.arange(20, -1, -1) / 20, [])[:21], atol=1e-12
    )
    assert (result.forces[-1] == 0.0).all()
    expected = result.rows[:, 4:7] * shares[:, None]
    np.testing.assert_allclose(result.rows[:, 7:10], expected, atol=1e-15)


def nan_at(sample: int, value: float = math.nan) -> Callable[[int], Any]:
    return lambda k: (value if k == sample else 1e-5 * k, 0.0, -1e-3)


def sink_too_deep(k: int) -> Any:
    return 1e-5 * k, 0.0, -1e-3 - (9e-3 if k >= 57 else 0.0)


def leave_workspace(k: int) -> Any:
    return 2.0 if k == 57 else 1e-5 * k, 0.0, -1e-3


PUSHED = slide_at_depth(1e-3)
STOPS: dict[str, tuple[EndReason, Callable[[int], Any], dict[tuple[str, int], int]]] = {
    "no number": (EndReason.NOT_FINITE, nan_at(57), {}),
    "infinity": (EndReason.NOT_FINITE, nan_at(57, math.inf), {}),
    "reading fails": (EndReason.DEVICE, PUSHED, {("read", 57): -4}),
    "writing fails": (EndReason.DEVICE, PUSHED, {("write", 57): 9}),
    "out of reach": (EndReason.WORKSPACE, leave_workspace, {}),
    "too deep": (EndReason.DEPTH, sink_too_deep, {}),
}


@pytest.mark.parametrize("name", STOPS)
def test_fault_zeroes_the_force_in_the_same_sample(run_loop: RunLoop, name: str) -> None:
    cause, path, codes = STOPS[name]
    result = run_loop(PythonDevice(path, codes), 200)
    assert result.cause is cause
    is_read = cause is not EndReason.NOT_FINITE and ("read", 57) not in codes
    assert result.shared.row_count == 57 + is_read  # no row without a position
    assert np.abs(result.forces[50:57]).max() > 0.0
    assert (result.forces[-1] == 0.0).all()
    assert len(result.forces) == 59  # including the force of the faulty sample and the final one
    write_fails = ("write", 57) in codes
    assert write_fails or (result.forces[57] == 0.0).all()
    assert result.code == codes.get(("write" if write_fails else "read", 57), 0)
    # The law is evaluated at every position, so that a replay computes the same.
    last = result.rows[-1]
    force = SURFACE.force(last[1:4])
    force *= min(1.0, 3.0 / float(np.linalg.norm(force)))  # the limit of the loop
    np.testing.assert_allclose(last[4:7], force, rtol=1e-12)


def test_excess_depth_can_be_reported_without_stopping(run_loop: RunLoop) -> None:
    device = PythonDevice(sink_too_deep)
    result = run_loop(device, 200, safety=Safety(beyond_depth="warn"))
    assert result.cause is EndReason.FINISHED
    assert LoopStatistics.from_status(result.shared.status).too_deep > 100
    backed = Surface(SURFACE.texture, "C", 900.0, 5e-3, clamp="backed")
    assert run_loop(PythonDevice(sink_too_deep), 200, surface=backed).cause is EndReason.FINISHED


@pytest.mark.parametrize("step", [0.0, 0.05])
def test_samples_at_the_force_limit_and_below_the_depth_are_counted(
    run_loop: RunLoop, step: float
) -> None:
    """Each sample at the limit counts, however it is rounded, where depth is no fault, too."""
    backed = Surface(SURFACE.texture, "C", 900.0, 5e-3, clamp="backed")
    servo = Servo(1e-3, max_force=3.0, force_resolution=step)
    result = run_loop(PythonDevice(sink_too_deep), 200, surface=backed, safety=OPEN, servo=servo)
    counts = LoopStatistics.from_status(result.shared.status)
    depths = backed.law.contact.depth(backed.texture, result.rows[:, 1:4])
    forces = np.linalg.norm(backed.force(result.rows[:, 1:4]), axis=1)
    assert 20 < (forces > 3.0).sum() < 190
    assert abs(counts.force_limited - (forces > 3.0).sum()) <= 2.0 * (step > 0.0)
    assert 20 < counts.too_deep == (depths > 5e-3).sum() < 190
    assert counts.deepest == pytest.approx(depths.max(), abs=1e-11)


@pytest.mark.parametrize(
    ("law", "cause"), [("H", EndReason.FINISHED), ("W", EndReason.FINISHED), ("D", EndReason.DEPTH)]
)
def test_only_laws_certified_at_any_depth_run_beyond_max_depth(
    run_loop: RunLoop, law: str, cause: EndReason
) -> None:
    shallow = Surface(SURFACE.texture, law, 300.0, 2e-3)
    assert run_loop(PythonDevice(sink_too_deep), 80, surface=shallow).cause is cause
    if law == "H":  # continuity > 1: q is not bounded where the god-object splits
        steep = Surface(SURFACE.texture, law, 300.0, 2e-3, continuity=2.0)
        assert run_loop(PythonDevice(sink_too_deep), 80, surface=steep).cause is EndReason.DEPTH


@given(
    seed=st.integers(0, 2**32 - 1),
    changes=st.lists(
        st.tuples(st.sampled_from("WBCF"), st.floats(10.0, 2e4)), min_size=1, max_size=4
    ),
    max_force=st.floats(0.1, 20.0),
    slew=st.floats(1.0, 1e5),
    ramp=st.floats(0.0, 0.05),
    damping=st.floats(0.0, 5.0),
    virtual=st.floats(-1.0, 5.0),
)
@settings(max_examples=100, deadline=None)
def test_force_and_slew_rate_never_exceed_their_limits(
    seed: int,
    changes: list[tuple[str, float]],
    max_force: float,
    slew: float,
    ramp: float,
    damping: float,
    virtual: float,
) -> None:
    rng = np.random.default_rng(seed)
    positions = np.cumsum(rng.normal(scale=10.0 ** rng.uniform(-6, -3), size=(80, 3)), axis=0)
    device = PythonDevice(lambda k: positions[min(k, 79)])
    servo = Servo(1e-3, max_force=max_force, virtual_damping=virtual, velocity_share=0.5)
    safety = Safety(ramp=ramp, max_slew=slew, beyond_depth="warn", passivity_damping=damping)
    shared = LoopMemory()
    loop = DriverLoop(device, servo, safety, 1e3, shared.block(), no_clock())
    record = device.open()
    for index, (law, stiffness) in enumerate(changes, 1):
        program = program_for(SURFACE.to_law(law))
        arguments = SURFACE.to_law(law).to_stiffness(stiffness).law_arguments
        loop.run(replace(program, law=arguments), record, 80 * index // len(changes))
        loop.reset_contact()
    forces = np.array(device.forces)
    assert np.linalg.norm(forces, axis=1).max() <= max_force
    steps = np.linalg.norm(np.diff(forces, axis=0, prepend=np.zeros((1, 3))), axis=1)
    # Forces and their differences are each rounded to the last bit.
    assert steps.max() <= slew * servo.period + 4.0 * np.spacing(max_force)


def test_passivity_observer_sums_the_work_on_the_hand(run_loop: RunLoop) -> None:
    result = run_loop(PythonDevice(move_on_circle), 200, safety=Safety(ramp=0.0, max_slew=1e9))
    held, place = result.rows[:-1, 7:10], result.rows[:, 1:4]
    energy = np.cumsum((held * np.diff(place, axis=0)).sum(axis=1))
    np.testing.assert_allclose(result.rows[1:, 11], energy, rtol=1e-12, atol=1e-18)


def move_on_circle(k: int) -> Any:
    return 0.3e-3 * math.cos(0.2 * k), 0.0, -1e-3 + 0.3e-3 * math.sin(0.2 * k)


@pytest.mark.parametrize("delay", [0, 1, 3])
@pytest.mark.parametrize("damping", [0.0, 10.0])
def test_passivity_controller_sees_the_energy_of_the_delayed_force(
    run_loop: RunLoop, delay: int, damping: float
) -> None:
    """The longer the delay, the more energy a wall gives: the controller takes it."""
    wall = Surface(SURFACE.texture, "W", 900.0, 5e-3)
    safety = Safety(ramp=0.0, max_slew=1e9, passivity_damping=damping)
    servo = Servo(1e-3, delay=delay, max_force=3.0)
    result = run_loop(PythonDevice(move_on_circle), 900, servo, safety, surface=wall)
    late = np.concatenate([np.zeros((delay, 3)), result.forces])[:899]
    work = np.cumsum((late * np.diff(result.rows[:900, 1:4], axis=0)).sum(axis=1))
    energy = result.rows[1:900, 11]
    np.testing.assert_allclose(energy, work, rtol=1e-9, atol=1e-15)
    assert energy.max() < 1.5e-4 if damping else energy.max() > 9e-4


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_passivity_controller_at_its_bound_calms_a_delayed_wall(delay: int) -> None:
    """Without it the wall feeds a cycle of up to 1 m/s; with it the hand strokes at 0.08 m/s."""
    wall = Surface(SURFACE.texture, "W", 700.0, 5e-3)
    hand = SpringHand(stiffness=200.0, damping=0.5, mass=1e-3, force=(0.0, 0.0, -0.6))
    strokes = Strokes((-5e-3, 0.3e-3, 0.0), (5e-3, 0.3e-3, 0.0), 0.08, 8)
    servo = Servo(1e-3, delay=delay, max_force=3.0)
    energies = []
    for damping in (0.0, 0.05 / ((1 + delay) * servo.period)):
        safety = replace(OPEN, passivity_damping=damping, silence=1e6)
        loop = servo, strokes, 0.9, safety
        rows = run_simulated_device(wall, Cartesian(0.05, 0.1), hand, *loop)
        energies.append(rows[:, 11].max())
    speeds = np.linalg.norm(np.diff(rows[:, 1:4], axis=0), axis=1) / servo.period
    assert speeds.max() < 0.4
    assert energies[1] < 2e-3
    assert energies[0] > 20.0 * energies[1] or not delay


@pytest.mark.parametrize("damping", [0.0, 50.0])
def test_passivity_controller_dissipates_the_gained_energy(
    run_loop: RunLoop, damping: float
) -> None:
    """On a circle law A gains energy each turn; passivity damping keeps the total below 10 µJ."""
    surface = Surface(SURFACE.texture, "A", 900.0, 5e-3)
    safety = Safety(ramp=0.0, max_slew=1e9, passivity_damping=damping)
    reverse = PythonDevice(lambda k: move_on_circle(-k))
    energies = [
        run_loop(device, 2000, safety=safety, surface=surface).rows[-2, 11]
        for device in (PythonDevice(move_on_circle), reverse)
    ]
    gained = max(energies)
    assert gained > 1e-4 if damping == 0.0 else gained < 1e-5


def test_late_ticks_and_jitter_are_counted(run_loop: RunLoop) -> None:
    def late_once(k: int) -> int:
        return 3_400_000 if k == 20 else 1_000

    result = run_loop(PythonDevice(slide_at_depth(1e-3)), 60, clock=PythonClock(late_once))
    statistics = LoopStatistics.from_status(result.shared.status)
    assert result.cause is EndReason.FINISHED
    assert (statistics.late, statistics.skipped, statistics.max_lateness) == (
        1,
        2,
        pytest.approx(3.4e-3),
    )
    # The times have a gap where samples were skipped.
    assert np.flatnonzero(np.diff(result.rows[:, 0]) > 1.5e-3).tolist() == [20]
    assert sum(statistics.lateness_histogram) == statistics.samples
    # One period was long and the two after it short; the others were nominal.
    assert sum(statistics.period_histogram) == statistics.samples - 1
    assert (statistics.period_histogram[0], sum(statistics.period_histogram[19:])) == (
        statistics.samples - 4,
        3,
    )
    assert statistics.jitter_quantile(0.9) == 1e-9
    assert statistics.jitter_quantile(1.0) == pytest.approx(2.0**22 * 1e-9)


@pytest.mark.parametrize(
    ("lateness", "cause", "rows"),
    [
        (lambda k: 60_000_000 if k == 30 else 0, EndReason.LATE_SAMPLE, 31),
        (lambda k: 1_100_000 if k >= 30 else 0, EndReason.LATE_SAMPLE, 30 + 4),
    ],
)
def test_excessive_lateness_is_a_fault(
    run_loop: RunLoop, lateness: Any, cause: EndReason, rows: int
) -> None:
    safety = Safety(lateness=4e-3)
    result = run_loop(
        PythonDevice(slide_at_depth(1e-3)), 500, safety=safety, clock=PythonClock(lateness)
    )
    assert (result.cause, result.shared.row_count) == (cause, rows)
    assert (result.forces[-1] == 0.0).all()
    # After a late start no force is commanded at all: the loop may have been suspended.
    starts_late = rows == 31
    assert bool((result.forces[rows - 1] == 0.0).all()) is starts_late


def test_slow_device_reading_is_a_fault(run_loop: RunLoop) -> None:
    clock = PythonClock(lambda _k: 0)

    def path(k: int) -> tuple[float, float, float]:
        clock.passes(60_000_000 if k == 30 else 100_000)
        return 0.0, 0.0, -1e-3

    result = run_loop(PythonDevice(path), 500, clock=clock)
    assert (result.cause, result.shared.row_count) == (EndReason.LATE_SAMPLE, 31)
    assert (result.forces[-1] == 0.0).all()


def test_missing_heartbeat_is_a_fault(run_loop: RunLoop) -> None:
    device, safety = PythonDevice(slide_at_depth(1e-3)), Safety(silence=0.1)
    result = run_loop(device, 500, safety=safety, clock=PythonClock(lambda _k: 0))
    assert result.cause is EndReason.NO_HEARTBEAT
    assert 100 <= result.shared.row_count <= 102
    assert (result.forces[-1] == 0.0).all()


def test_requested_stop_is_not_a_fault(run_loop: RunLoop) -> None:
    result = run_loop(
        PythonDevice(slide_at_depth(1e-3)), 500, control=lambda shared: shared.request_stop()
    )
    assert result.cause is EndReason.STOPPED
    assert (result.forces == 0.0).all()


def test_random_faults_end_with_zero_force(run_loop: RunLoop) -> None:
    rng = np.random.default_rng(20261122)
    for _ in range(1000):
        sample, kind = int(rng.integers(0, 12)), int(rng.integers(0, 4))
        device = PythonDevice(slide_at_depth(1e-3))
        if kind == 0:
            device.path = nan_at(sample, rng.choice([math.nan, math.inf, -math.inf]))
        elif kind == 1:
            device.path = lambda k, at=sample: (9.0 if k == at else 0.0, 0.0, -1e-3)
        else:
            device.codes[("read", "write")[kind - 2], sample] = int(rng.integers(-9, 0))
        result = run_loop(device, 40, safety=Safety(ramp=0.0))
        assert result.cause.is_fault
        is_read = kind in {1, 3}
        assert result.shared.row_count == sample + is_read
        assert (result.forces[-1] == 0.0).all()
        assert (result.forces[sample] == 0.0).all() or kind == 3
        assert kind != 1 or (result.rows[-1, 7:10] == 0.0).all()


def test_truncated_searches_are_counted_in_the_shared_memory() -> None:
    texture = Fourier([2e-5, 1e-5], [[3e3, 1e3], [-1e3, 4e3]])
    surface = Surface(texture, "D", stiffness=500.0, max_depth=1e-3)
    driver = simulated_driver(Cartesian(0.05), PRESSED, Servo(1e-3), STROKES, 0.3)
    counts = []
    for budget in (2.0, surface.law.contact.max_evaluations):
        shared = LoopMemory()
        loop = DriverLoop(driver, Servo(1e-3), OPEN, math.inf, shared.block(), no_clock())
        loop.search_state = shared.search_state
        program = replace(build_program(surface, driver), max_evaluations=budget)
        assert loop.run(program, driver.open(), 300)[0] is EndReason.FINISHED
        counts.append(shared.search_state[TRUNCATED_TICKS])
    # Two evaluations end no search in contact; those of the contact end all.
    assert counts[0] > 50
    assert counts[1] == 0


def test_lateness_without_priority_is_measured_before_the_device_is_open(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A device may switch its motors off while it waits for the first force."""
    calls: list[str] = []

    def refuse(_period: float) -> Priority:
        calls.append("priority")
        return Priority(False, ("not allowed",))

    class Recorded(PythonDevice):
        def open(self) -> LibraryDevice:
            calls.append("open")
            return super().open()

    monkeypatch.setattr(loop_process, "request_realtime_priority", refuse)
    monkeypatch.setattr(loop_process, "LATENESS_WAITS", 3)
    ours, theirs = multiprocessing.Pipe()
    driver = Recorded(lambda _k: (0.0, 0.0, 0.0))
    job = LoopJob(program_for(SURFACE), driver, Servo(1e-3), Safety(), 1.0, 5)
    _LoopServer(theirs, LoopMemory(), job).serve()
    assert calls == ["priority", "open", "priority"]
    kind, notes = ours.recv()
    assert (kind, notes[0]) == ("ready", "not allowed")
    assert re.fullmatch(r"Measured .*, 3 waits of 1 ms: late by up to \S+ ms", notes[1])
    ours.close()

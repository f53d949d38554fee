"""The loop of a device: the same as a simulation, guarded, and without force when it ends."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.servo.python_device import SURFACE, PythonClock, PythonDevice, shown_of

from asperity.servo.driver_loop import DriverLoop, build_program, no_clock
from asperity.servo.drivers.simulated import simulated_driver
from asperity.servo.fault import EndReason
from asperity.servo.loop_memory import LoopMemory, LoopStatistics
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

Go = Callable[..., SimpleNamespace]
PRESSED = SpringHand(stiffness=300.0, damping=3.0, mass=0.05, force=(0.0, 0.0, -0.6))
STROKES = Strokes((-2e-3, 0.3e-3, 0.0), (2e-3, 0.3e-3, 0.0), 0.05, 2)
SERVO = Servo(
    2.5e-4, delay=2, position_resolution=1e-5, force_resolution=0.01, max_force=2.0,
    virtual_damping=0.3, velocity_share=0.3,
)  # fmt: skip
OPEN = Safety(ramp=0.0, max_slew=1e9, beyond_depth="warn")
PLANE = Strokes((-2e-3, 0.0, 0.0), (2e-3, 0.0, 0.0), 0.05, 2)
CASES = {
    "C in space, delay, steps, damping": ("C", Cartesian(0.05, 0.5, friction=0.05), PRESSED, SERVO,
                                          STROKES),
    "F, which has state": ("F", Cartesian(0.05, 0.5), PRESSED, Servo(1e-3), STROKES),
    "D, moved": ("D", Cartesian(0.05), PrescribedHand(), Servo(1e-3, delay=1),
                 Strokes((-2e-3, 0.3e-3, -3e-4), (2e-3, 0.3e-3, -2e-4), 0.05, 2)),
    "A on a pantograph, on a band": ("A", Pantograph(), BandHand(), Servo(1e-4, delay=3), PLANE),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_the_trace_of_the_loop_is_that_of_a_simulation(case: str) -> None:
    law, plant, hand, servo, motion = CASES[case]
    surface = SURFACE.to_law(law)
    duration = 700 * servo.period  # more than the 256 samples between two flushes
    run = simulate(surface, plant, hand, servo, motion, duration)
    rows = looped(surface, plant, hand, servo, motion, duration)
    assert np.abs(run.commanded).max() > 0.0
    np.testing.assert_array_equal(rows[:700, 0], run.time)
    np.testing.assert_array_equal(rows[:700, 1:4], run.position)
    np.testing.assert_array_equal(rows[:700, 4:7], run.commanded)
    np.testing.assert_array_equal(rows[:700, 7:10], run.commanded)


def looped(surface: Surface, plant: Any, hand: Any, servo: Servo, motion: Any,
           duration: float) -> np.ndarray:  # fmt: skip
    """Return the rows of a loop on a simulated device, without a clock."""
    driver = simulated_driver(plant, hand, servo, motion, duration)
    shared = LoopMemory()
    loop = DriverLoop(driver, servo, OPEN, math.inf, shared.block(), no_clock())
    cause, _code = loop.run(
        build_program(surface, driver), driver.open(), round(duration / servo.period)
    )
    assert cause is EndReason.FINISHED
    return shared.rows(0)[0]


def test_a_simulated_device_starts_the_same_again() -> None:
    driver = simulated_driver(
        Cartesian(0.05), PRESSED, Servo(1e-3), Stationary((0.0, 0.0, -1e-3)), 0.1
    )
    first = driver.open()
    first.x[:] = 7.0
    assert driver.open().x[0] == 0.0


def pushing(depth: float) -> Callable[[int], Any]:
    """A handle that is pushed to a depth and slides."""
    return lambda k: (1e-5 * k, 0.2e-3, -depth)


def test_the_force_comes_in_and_goes_by_the_ramp(go: Go) -> None:
    device = PythonDevice(pushing(1e-3))
    done = go(device, 100, safety=Safety(ramp=0.02))
    assert done.cause is EndReason.FINISHED
    shares = done.rows[:, 10]
    np.testing.assert_allclose(shares[:20], np.arange(1, 21) / 20)
    np.testing.assert_allclose(
        shares[99:], np.append(np.arange(20, -1, -1) / 20, [])[:21], atol=1e-12
    )
    assert (done.forces[-1] == 0.0).all()
    asked = done.rows[:, 4:7] * shares[:, None]
    np.testing.assert_allclose(done.rows[:, 7:10], asked, atol=1e-15)


def nan_at(sample: int, value: float = math.nan) -> Callable[[int], Any]:
    return lambda k: (value if k == sample else 1e-5 * k, 0.0, -1e-3)


def sinking(k: int) -> Any:
    return 1e-5 * k, 0.0, -1e-3 - (9e-3 if k >= 57 else 0.0)


def leaving(k: int) -> Any:
    return 2.0 if k == 57 else 1e-5 * k, 0.0, -1e-3


PUSHED = pushing(1e-3)
STOPS: dict[str, tuple[EndReason, Callable[[int], Any], dict[tuple[str, int], int]]] = {
    "no number": (EndReason.NOT_FINITE, nan_at(57), {}),
    "infinity": (EndReason.NOT_FINITE, nan_at(57, math.inf), {}),
    "reading fails": (EndReason.DEVICE, PUSHED, {("read", 57): -4}),
    "writing fails": (EndReason.DEVICE, PUSHED, {("write", 57): 9}),
    "out of reach": (EndReason.WORKSPACE, leaving, {}),
    "too deep": (EndReason.DEPTH, sinking, {}),
}


@pytest.mark.parametrize("name", STOPS)
def test_a_fault_makes_the_force_zero_in_its_sample(go: Go, name: str) -> None:
    cause, path, codes = STOPS[name]
    done = go(PythonDevice(path, codes), 200)
    assert done.cause is cause
    assert done.shared.row_count == 58
    assert np.abs(done.forces[50:57]).max() > 0.0
    assert (done.forces[-1] == 0.0).all()
    assert len(done.forces) == 59  # that of the sample and the last one
    failing = ("write", 57) in codes
    assert failing or (done.forces[57] == 0.0).all()
    assert done.code == codes.get(("write" if failing else "read", 57), 0)


def test_what_is_too_deep_can_be_told_only(go: Go) -> None:
    device = PythonDevice(sinking)
    done = go(device, 200, safety=Safety(beyond_depth="warn"))
    assert done.cause is EndReason.FINISHED
    assert LoopStatistics.from_status(done.shared.status).too_deep > 100
    backed = Surface(SURFACE.texture, "C", 900.0, 5e-3, clamp="backed")
    done = go(PythonDevice(sinking), 200, surface=backed)
    assert (done.cause, LoopStatistics.from_status(done.shared.status).too_deep) == (
        EndReason.FINISHED,
        0,
    )


@pytest.mark.parametrize(("law", "cause"), [("H", EndReason.FINISHED), ("W", EndReason.FINISHED),
                                           ("D", EndReason.DEPTH)])  # fmt: skip
def test_only_what_is_proved_at_any_depth_may_be_felt_there(
    go: Go, law: str, cause: EndReason
) -> None:
    shallow = Surface(SURFACE.texture, law, 300.0, 2e-3)
    assert go(PythonDevice(sinking), 80, surface=shallow).cause is cause
    if law == "H":  # with more than 1 its number grows where the god-object splits
        steep = Surface(SURFACE.texture, law, 300.0, 2e-3, continuity=2.0)
        assert go(PythonDevice(sinking), 80, surface=steep).cause is EndReason.DEPTH


@given(
    seed=st.integers(0, 2**32 - 1),
    changes=st.lists(st.tuples(st.sampled_from("WBCF"), st.floats(10.0, 2e4)), min_size=1,
                     max_size=4),
    max_force=st.floats(0.1, 20.0), slew=st.floats(1.0, 1e5),
    ramp=st.floats(0.0, 0.05), damping=st.floats(0.0, 5.0), virtual=st.floats(-1.0, 5.0),
)  # fmt: skip
@settings(max_examples=100, deadline=None)
def test_no_force_is_above_its_limits(
    seed: int, changes: list[tuple[str, float]], max_force: float, slew: float, ramp: float,
    damping: float, virtual: float,
) -> None:  # fmt: skip
    rng = np.random.default_rng(seed)
    way = np.cumsum(rng.normal(scale=10.0 ** rng.uniform(-6, -3), size=(80, 3)), axis=0)
    device = PythonDevice(lambda k: way[min(k, 79)])
    servo = Servo(1e-3, max_force=max_force, virtual_damping=virtual, velocity_share=0.5)
    safety = Safety(ramp=ramp, max_slew=slew, beyond_depth="warn", passivity_damping=damping)
    shared = LoopMemory()
    loop = DriverLoop(device, servo, safety, 1e3, shared.block(), no_clock())
    record = device.open()
    for index, (law, stiffness) in enumerate(changes, 1):
        shown = shown_of(SURFACE.to_law(law))
        arguments = SURFACE.to_law(law).to_stiffness(stiffness).law_arguments
        loop.run(replace(shown, law=arguments), record, 80 * index // len(changes))
        loop.reset_contact()
    forces = np.array(device.forces)
    assert np.linalg.norm(forces, axis=1).max() <= max_force
    steps = np.linalg.norm(np.diff(forces, axis=0, prepend=np.zeros((1, 3))), axis=1)
    # A force is rounded to its last bit, and so is the difference of two.
    assert steps.max() <= slew * servo.period + 4.0 * np.spacing(max_force)


def test_the_observer_counts_what_the_hand_is_given(go: Go) -> None:
    done = go(PythonDevice(circling), 200, safety=Safety(ramp=0.0, max_slew=1e9))
    held, place = done.rows[:-1, 7:10], done.rows[:, 1:4]
    given = np.cumsum((held * np.diff(place, axis=0)).sum(axis=1))
    np.testing.assert_allclose(done.rows[1:, 11], given, rtol=1e-12, atol=1e-18)


def circling(k: int) -> Any:
    return 0.3e-3 * math.cos(0.2 * k), 0.0, -1e-3 + 0.3e-3 * math.sin(0.2 * k)


@pytest.mark.parametrize("damping", [0.0, 50.0])
def test_the_controller_takes_the_energy_back(go: Go, damping: float) -> None:
    """Along a circle law B feeds the hand at each turn; with damping what it has stays below."""
    surface = Surface(SURFACE.texture, "A", 900.0, 5e-3)
    safety = Safety(ramp=0.0, max_slew=1e9, passivity_damping=damping)
    other_way = PythonDevice(lambda k: circling(-k))
    ends = [go(device, 2000, safety=safety, surface=surface).rows[-2, 11]
            for device in (PythonDevice(circling), other_way)]  # fmt: skip
    gained = max(ends)
    assert gained > 1e-4 if damping == 0.0 else gained < 1e-5


def test_lateness_is_counted_and_judged(go: Go) -> None:
    def once(k: int) -> int:
        return 3_400_000 if k == 20 else 1_000

    done = go(PythonDevice(pushing(1e-3)), 60, clock=PythonClock(once))
    counted = LoopStatistics.from_status(done.shared.status)
    assert done.cause is EndReason.FINISHED
    assert (counted.late, counted.skipped, counted.max_lateness) == (1, 2, pytest.approx(3.4e-3))
    # The samples that were left out are missing in the times, too.
    assert np.flatnonzero(np.diff(done.rows[:, 0]) > 1.5e-3).tolist() == [20]
    assert sum(counted.lateness_histogram) == counted.samples
    # One period was long and the two after it short; the others were as they should be.
    assert sum(counted.period_histogram) == counted.samples - 1
    assert (counted.period_histogram[0], sum(counted.period_histogram[19:])) == (
        counted.samples - 4,
        3,
    )
    assert counted.jitter_quantile(0.9) == 1e-9
    assert counted.jitter_quantile(1.0) == pytest.approx(2.0**22 * 1e-9)


@pytest.mark.parametrize(
    ("lateness", "cause", "rows"),
    [
        (lambda k: 60_000_000 if k == 30 else 0, EndReason.LATE_SAMPLE, 31),
        (lambda k: 1_100_000 if k >= 30 else 0, EndReason.MISSED_SAMPLES, 30 + 8),
    ],
)
def test_too_late_is_a_fault(go: Go, lateness: Any, cause: EndReason, rows: int) -> None:
    safety = Safety(misses=6)
    done = go(PythonDevice(pushing(1e-3)), 500, safety=safety, clock=PythonClock(lateness))
    assert (done.cause, done.shared.row_count) == (cause, rows)
    assert (done.forces[-1] == 0.0).all()


def test_a_device_that_takes_too_long_is_a_fault(go: Go) -> None:
    clock = PythonClock(lambda _k: 0)

    def path(k: int) -> tuple[float, float, float]:
        clock.passes(60_000_000 if k == 30 else 100_000)
        return 0.0, 0.0, -1e-3

    done = go(PythonDevice(path), 500, clock=clock)
    assert (done.cause, done.shared.row_count) == (EndReason.LATE_SAMPLE, 31)
    assert (done.forces[-1] == 0.0).all()


def test_a_watcher_that_is_silent_is_a_fault(go: Go) -> None:
    device, safety = PythonDevice(pushing(1e-3)), Safety(silence=0.1)
    done = go(device, 500, safety=safety, clock=PythonClock(lambda _k: 0))
    assert done.cause is EndReason.NO_HEARTBEAT
    assert 100 <= done.shared.row_count <= 102
    assert (done.forces[-1] == 0.0).all()


def test_a_stop_is_no_fault(go: Go) -> None:
    done = go(PythonDevice(pushing(1e-3)), 500, control=lambda shared: shared.request_stop())
    assert done.cause is EndReason.STOPPED
    assert (done.forces == 0.0).all()


def test_a_thousand_random_faults_leave_no_force(go: Go) -> None:
    rng = np.random.default_rng(20261122)
    for _ in range(1000):
        sample, kind = int(rng.integers(0, 12)), int(rng.integers(0, 4))
        device = PythonDevice(pushing(1e-3))
        if kind == 0:
            device.path = nan_at(sample, rng.choice([math.nan, math.inf, -math.inf]))
        elif kind == 1:
            device.path = lambda k, at=sample: (9.0 if k == at else 0.0, 0.0, -1e-3)
        else:
            device.codes[("read", "write")[kind - 2], sample] = int(rng.integers(-9, 0))
        done = go(device, 40, safety=Safety(ramp=0.0))
        assert done.cause.is_fault
        assert done.shared.row_count == sample + 1
        assert (done.forces[-1] == 0.0).all()
        assert np.array_equal(done.rows[-1, 7:10], done.forces[sample]) or kind == 3

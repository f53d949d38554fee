"""A calibration: the true numbers are recovered, the wall stops at once, the file is a device."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from bench.calibration import RandomDevice, calibrate_device, list_misses, random_device, wall_limit
from tests.servo.python_device import PythonDevice

import asperity as asp
from asperity.core.checks import FloatArray
from asperity.devices import device_names, load_device
from asperity.devices.device_file import to_device_toml
from asperity.servo.calibration.calibrator import (
    AxisCalibration,
    Calibration,
    CalibrationError,
    Calibrator,
)
from asperity.servo.calibration.identification import (
    AxisDynamics,
    DelayEstimate,
    Estimate,
    WallOnset,
    find_wall_onset,
    fresh_fraction,
    is_limit_cycle,
    oscillation_amplitudes,
    position_step,
    rest_noise,
)
from asperity.servo.calibration.measured_device import measured_device
from asperity.servo.calibration.test_rig import (
    EXCITATION_COLUMN,
    ClockedRig,
    UnclockedRig,
    excitation_renderer,
    frame_axes,
)
from asperity.servo.drivers.driver import AWAY, RIGHT, TOWARDS, UP, surface_frame
from asperity.servo.drivers.driver_registry import DRIVER_KINDS, hardware_driver
from asperity.servo.drivers.simulated import simulated_driver
from asperity.servo.kernels.excitation import PUSHING, REST, WALL, Excitation
from asperity.servo.safety import Safety
from asperity.simulation import Cartesian, Pantograph, Servo, SpringHand, Stationary

SAFE = Safety(ramp=0.02, max_slew=3000.0)
LOOP = Servo(1e-3, max_force=3.0)
ORIGIN = Stationary((0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def drawn() -> tuple[RandomDevice, Calibration]:
    device = random_device(np.random.default_rng(20261123), (1e3, 1.5e3))
    return device, calibrate_device(device)


def test_random_devices_are_recovered(drawn: tuple[RandomDevice, Calibration]) -> None:
    rng = np.random.default_rng(7)
    devices = [random_device(rng, (1e3, 2e3)) for _ in range(2)]
    for device, found in (drawn, *((device, calibrate_device(device)) for device in devices)):
        assert list_misses(device, found) == []
        assert found.noise.value == 0.0
        for axis, mass, damping in zip(found.axes, device.mass, device.damping, strict=True):
            motion = axis.dynamics
            trues = (motion.mass, mass), (motion.damping, damping), (
                motion.friction, device.friction)  # fmt: skip
            for found_one, true in trues:
                assert abs(found_one.value - true) < 4.0 * found_one.uncertainty
            assert motion.mass.value == pytest.approx(mass, rel=0.02)
        weakest = min(range(3), key=lambda i: device.damping[i])
        assert found.weakest_axis.name == "xyz"[weakest]


WRONG = {"delay": 1, "step": 1.06, "period": 1.06, "damping": 1.15}


@pytest.mark.parametrize("name", WRONG)
def test_another_device_is_not_recovered(
    drawn: tuple[RandomDevice, Calibration], name: str
) -> None:
    """The control: what is found of a device is not what is true of one that is a little other."""
    device, found = drawn
    true, by = getattr(device, name), WRONG[name]
    other = true + by if name == "delay" else true * np.array(by)
    assert list_misses(dataclasses.replace(device, **{name: other}), found)


def test_the_true_wall_is_that_of_theory() -> None:
    """K₀ = b/T/(1/2 + d) for a heavy handle; with no delay 2 b/T."""
    for delay in range(4):
        assert wall_limit(2.0, 1.0, 1e-3, delay) == pytest.approx(1e3 / (0.5 + delay), rel=2e-3)


def test_steps_are_told_from_exact_positions() -> None:
    rng = np.random.default_rng(1)
    way = np.cumsum(rng.normal(scale=3e-5, size=2000))
    step = 2.1e-5
    read = step * np.rint(way / step)
    found = position_step(read)
    assert found is not None
    assert found.value == pytest.approx(step, rel=1e-9)
    assert found.uncertainty < 1e-3 * step
    odd = position_step(step * np.array([0.0, 2, 5, 9, 2, 0]))  # no two are neighbours
    assert odd is not None
    assert odd.value == pytest.approx(step)
    assert position_step(way) is None
    # An arm that turns steps of angle into positions: what changes from reading to reading counts.
    slow = np.cumsum(rng.uniform(0.0, 4e-6, 4000))
    arm = 0.2 * np.sin(1e-4 * np.rint(slow / 2e-5))
    bent = position_step(arm)
    assert bent is not None
    assert bent.value == pytest.approx(2e-5, rel=0.02)


def test_noise_is_told_from_drift() -> None:
    rng = np.random.default_rng(2)
    read = 1e-3 + np.linspace(0.0, 1e-4, 4000) + rng.normal(scale=3e-6, size=4000)
    found = rest_noise(read)
    assert abs(found.value - 3e-6) < 4.0 * found.uncertainty
    assert found.uncertainty < 0.05 * found.value


@pytest.mark.parametrize("every", [1, 3, 4])
def test_readings_that_repeat_are_no_fresh_ones(every: int) -> None:
    times = np.arange(3000) * 1e-3
    way = 2e-3 * np.sin(40.0 * times)
    read = 1e-5 * np.rint(way[np.arange(3000) // every * every] / 1e-5)
    assert fresh_fraction(read, 1e-5) == pytest.approx(1.0 / every, rel=0.02)
    assert fresh_fraction(np.zeros(100), 1e-5) == 1.0


@pytest.mark.parametrize(("onset", "lowest"), [(731.0, 50.0), (60.0, 50.0), (20.0, 50.0)])
def test_a_wall_is_raised_from_below(onset: float, lowest: float) -> None:
    tried: list[float] = []

    def cycles(stiffness: float) -> bool:
        tried.append(stiffness)
        return stiffness > onset

    found = find_wall_onset(cycles, 1e4, lowest)
    assert found.stable_stiffness <= onset <= (found.cycling_stiffness or 0.0)
    assert found.trials == len(tried)
    assert max(tried) <= max(1.3 * onset, lowest)
    assert (
        found.stable_stiffness == 0.0 if onset < lowest else found.stable_stiffness > 0.97 * onset
    )


def test_a_wall_that_never_cycles_is_said_to() -> None:
    assert find_wall_onset(lambda _stiffness: False, 100.0, 50.0) == WallOnset(84.5, None, 3)


@pytest.mark.parametrize(("growth", "cycles"), [(-0.5, False), (-0.02, True), (0.0, True)])
def test_an_oscillation_cycles_unless_it_decays(growth: float, cycles: bool) -> None:
    times = np.arange(800) * 1e-3
    way = 1e-3 * np.exp(growth * times) * np.sin(130.0 * times) + 2e-4
    read = 5e-5 * np.rint(way / 5e-5)
    first, last = oscillation_amplitudes(read, 1e-3, 15.0)
    assert is_limit_cycle(first, last, 1e-4) is cycles
    assert first == pytest.approx(1e-3 * math.exp(0.2 * growth), rel=0.02)
    assert not is_limit_cycle(first, last, 2e-3)  # below the floor it is the device's own buzz


def excited(kind: float, samples: int, **more: float) -> Excitation:
    nan = math.nan
    whole = Excitation(1, kind, 2, 30.0, 0.0, 1.0, 1e3, nan, nan, nan, 0.0, 0.0, 0.0, 0.0, 5.0,
                       1e-3, samples)  # fmt: skip
    return whole._replace(**more)


def test_a_handle_that_runs_away_feels_no_force_in_that_very_sample() -> None:
    device = PythonDevice(lambda k: (0.0, 0.0, 1e-3 * max(0, k - 60)))
    bench = UnclockedRig(device, LOOP, Safety(ramp=0.0, max_slew=1e9))
    rows = bench.apply(excited(WALL, 100, stiffness=400.0, trip_distance=2.5e-3))
    forces = np.array(device.forces)[:, 2]
    assert forces[62] == pytest.approx(-0.8)
    assert (forces[63:] == 0.0).all()
    assert rows[62:64, EXCITATION_COLUMN + 2].tolist() == [0.0, 1.0]


def test_pushes_go_to_and_fro_and_end() -> None:
    device = PythonDevice(lambda _k: (0.0, 0.0, 0.0))
    bench = UnclockedRig(device, LOOP, Safety(ramp=0.0, max_slew=1e9))
    rows = bench.apply(excited(PUSHING, 400, push_force=0.5, push_samples=10.0))
    forces = rows[:, 9]
    assert set(np.unique(forces)) == {-0.5, 0.5}
    lengths = np.diff(np.flatnonzero(np.diff(forces)))
    assert 8.0 < lengths.mean() < 12.0
    assert (lengths.min(), lengths.max()) >= (5, 12)
    assert device.forces[-1] == (0.0, 0.0, 0.0)
    assert len(rows) == 400


class Kept:
    """A bench that keeps what it did."""

    def __init__(self, bench: UnclockedRig) -> None:
        self.servo, self.axes, self._bench = bench.servo, bench.axes, bench
        self.rows: list[FloatArray] = []

    def apply(self, excitation: Excitation) -> FloatArray:
        self.rows.append(self._bench.apply(excitation))
        return self.rows[-1]


def device_of(damping: float | tuple[float, float, float], delay: int = 1) -> UnclockedRig:
    own = Servo(1e-3, delay=delay, position_resolution=2e-5)
    plant = Cartesian(0.08, damping)
    driver = simulated_driver(plant, SpringHand(), own, ORIGIN, 1e-3, device_resolution=True)
    return UnclockedRig(driver, LOOP, SAFE)


def test_no_force_is_above_the_limits_and_a_cycle_is_not_fed() -> None:
    kept = Kept(device_of((0.7, 0.9, 0.8)))
    found = Calibrator(kept, SAFE.ramp).run()
    for rows in kept.rows:
        forces = rows[:, 7:10]
        assert np.linalg.norm(forces, axis=1).max() <= LOOP.max_force
        assert np.linalg.norm(np.diff(forces, axis=0), axis=1).max() <= 3.0 + 1e-12
        tripped = rows[:, EXCITATION_COLUMN + 2] > 0.0
        first = int(np.argmax(tripped)) if tripped.any() else len(rows)
        assert (rows[first + 1 :, 7:10] == 0.0).all()
    assert found.weakest_axis.name == "x"
    # At no time the handle is far from where it was.
    assert max(np.abs(rows[:, 1:4]).max() for rows in kept.rows) < 0.02


@pytest.mark.parametrize("name", [*DRIVER_KINDS, "pantograph"])
def test_an_excitation_takes_the_place_of_a_law_with_every_driver(name: str) -> None:
    if name == "pantograph":
        whole = Pantograph(), SpringHand(), LOOP, ORIGIN
        assert excitation_renderer(simulated_driver(*whole, 1e-3))(excited(REST, 1)).source
    else:
        text = "device.so" if name == "own" else name
        driver = hardware_driver(text, "lying", (0.0, 0.0, 0.0))
        assert excitation_renderer(driver)(excited(REST, 1)).source


def test_an_axis_that_does_not_move_is_left_out() -> None:
    own = Servo(1e-3, position_resolution=2e-5)
    plant = Cartesian((0.08, 1e4, 0.08), 0.7)
    driver = simulated_driver(plant, SpringHand(), own, ORIGIN, 1e-3, device_resolution=True)
    found = Calibrator(UnclockedRig(driver, LOOP, SAFE), SAFE.ramp).run()
    assert [axis.name for axis in found.axes] == ["x", "z"]
    assert found.immobile_axes == ("y",)


def test_a_handle_that_does_not_move_cannot_be_measured() -> None:
    bench = UnclockedRig(PythonDevice(lambda _k: (0.0, 0.0, 0.0)), LOOP, SAFE)
    with pytest.raises(CalibrationError, match="does not move"):
        Calibrator(bench, SAFE.ramp).run()


def test_axes_are_named_as_the_device_names_them() -> None:
    frame = surface_frame((TOWARDS, RIGHT, UP), "lying", (0.0, 0.0, 0.0), 1.0)
    assert frame_axes(frame) == ("y", "x", "z")
    assert frame_axes(surface_frame((RIGHT, AWAY, UP), "standing", (0.0, 0.0, 0.0), 1.0)) == (
        "x",
        "z",
        "y",
    )


def test_by_the_clock_it_is_done_too_and_an_interrupt_ends_it_without_force() -> None:
    own = Servo(1e-3, delay=1, position_resolution=2e-5)
    driver = simulated_driver(
        Cartesian(0.08, 1.0), SpringHand(), own, ORIGIN, 1e-3, device_resolution=True
    )
    patient = Safety(ramp=0.02, lateness=60.0, misses=10**6, silence=30.0)
    asked = []

    def look() -> None:
        if asked:
            raise KeyboardInterrupt

    with ClockedRig(driver, LOOP, patient, 1.0, look) as bench:
        rows = bench.apply(
            excited(PUSHING, 300, push_force=0.5, push_samples=20.0, trip_distance=1.0)
        )
        assert (len(rows) > 250, set(rows[:, EXCITATION_COLUMN])) == (True, {1.0})
        assert np.ptp(rows[:, 3]) > 1e-4
        # After its time there is no force, until something else is asked for.
        seen = bench.loop.memory.row_count
        while bench.loop.memory.row_count < seen + 20:
            bench.loop.poll()
        assert (bench.loop.rows(seen + 10)[0][:, 7:10] == 0.0).all()
        rest = bench.apply(excited(REST, 50, number=2.0, holding_stiffness=0.0))
        assert (rest[:, 7:10] == 0.0).all()
        asked.append(1)
        with pytest.raises(KeyboardInterrupt):
            bench.apply(excited(WALL, 10_000, number=3.0, stiffness=200.0))
    last, _first = bench.loop.rows(bench.loop.memory.row_count - 1)
    assert not bench.loop.process.is_alive()
    assert (last[-1, 7:10] == 0.0).all()


def axis(name: str, held: float, cycled: float | None, damping: float) -> AxisCalibration:
    motion = AxisDynamics(Estimate(0.05, 1e-4), Estimate(damping, 0.01), Estimate(0.004, 1e-3))
    return AxisCalibration(name, motion, WallOnset(held, cycled, 9))  # type: ignore[arg-type]  # of three names


FOUND = Calibration(
    Estimate(1000.0, 0.01), Estimate(3e-5, 1e-9), Estimate(2e-6, 1e-7), DelayEstimate(2, ()), 1.0,
    (axis("x", 812.3456, 830.0, 0.5), axis("y", 640.0, 655.0, 0.4), axis("z", 700.0, None, 0.6)),
)  # fmt: skip


def test_the_file_is_a_device_that_is_compared(tmp_path: Path) -> None:
    base = load_device("touch")
    made = measured_device(base, FOUND, "mine", "2026-11-23", simulated=False)
    path = tmp_path / "mine.toml"
    path.write_text(to_device_toml(made))
    read = load_device(path)
    assert read == made
    test = read.wall_test
    assert test is not None
    assert (test.value, test.cycled, test.update_rate) == (640.0, 655.0, 1000.0)
    assert (test.directions, test.positions) == (("x", "y", "z"), "stepped")
    assert [other.value for other in test.also] == [812.3, 700.0]
    assert {read.data[name].pedigree for name in ("max_stiffness", "damping")} == {"measured"}
    assert test.source.startswith("measured")
    # Proofs rest on the damping: the least, less two uncertainties.
    assert read.value("damping") == pytest.approx(0.38)
    assert read.value("delay_samples") == 2.0
    assert read.value("max_force") == base.value("max_force")
    both = math.hypot(3e-5, 12**0.5 * 2e-6)
    assert read.value("position_resolution") == pytest.approx(both, rel=1e-3)
    compared = asp.compare("sinusoid:amplitude=0.1mm,period=2mm", device=path, laws="W")
    assert 0.0 < compared.row("W").safe_stiffness <= 640.0


@pytest.mark.parametrize("name", device_names())
def test_a_device_is_written_as_it_is_read(name: str, tmp_path: Path) -> None:
    path = tmp_path / "device.toml"
    path.write_text(to_device_toml(load_device(name)))
    assert load_device(path) == load_device(name)


def test_what_is_not_sure_is_not_written() -> None:
    unsure = dataclasses.replace(
        FOUND, delay=DelayEstimate(2, (1,)), position_step=None, noise=Estimate(0.0, 0.0),
        axes=(axis("x", 0.0, 50.0, 0.015), *FOUND.axes[1:]),
    )  # fmt: skip
    made = measured_device(load_device("touch"), unsure, "mine", "2026-11-23", simulated=True)
    absent = {"delay_samples", "position_resolution", "damping", "max_stiffness"}
    assert not absent & made.data.keys()
    assert "simulated" in made.name

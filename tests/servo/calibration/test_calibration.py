"""Calibration: true parameters are recovered, walls stop at once, the file is a valid device."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest
from bench.stress.calibration import (
    RandomDevice,
    calibrate_device,
    list_misses,
    random_device,
    wall_limit,
)
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
from asperity.servo.calibration.excitation import (
    EXCITATION_COLUMN,
    PUSHING,
    REST,
    WALL,
    ClockedRig,
    Excitation,
    UnclockedRig,
    excitation_renderer,
    frame_axes,
)
from asperity.servo.calibration.identification import (
    AxisDynamics,
    DelayEstimate,
    Estimate,
    PushRecord,
    WallOnset,
    find_wall_onset,
    fresh_fraction,
    is_limit_cycle,
    oscillation_amplitudes,
    position_step,
    rest_noise,
    simulated_signs,
)
from asperity.servo.calibration.measured_device import measured_device
from asperity.servo.driver import AWAY, RIGHT, TOWARDS, UP, surface_frame
from asperity.servo.drivers.driver_registry import DRIVER_KINDS, hardware_driver
from asperity.servo.drivers.simulated import simulated_driver
from asperity.servo.loop_memory import DeviceFault
from asperity.servo.safety import Safety
from asperity.simulation import Cartesian, Pantograph, Servo, SpringHand, Stationary

SAFE = Safety(ramp=0.02, max_slew=3000.0)
LOOP = Servo(1e-3, max_force=3.0)
ORIGIN = Stationary((0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def random_calibration() -> tuple[RandomDevice, Calibration]:
    device = random_device(np.random.default_rng(20261123), (1e3, 1.5e3))
    return device, calibrate_device(device)


def test_parameters_of_random_devices_are_recovered(
    random_calibration: tuple[RandomDevice, Calibration],
) -> None:
    rng = np.random.default_rng(7)
    devices = [random_device(rng, (1e3, 2e3)) for _ in range(2)]
    for device, calibration in (
        random_calibration,
        *((device, calibrate_device(device)) for device in devices),
    ):
        assert list_misses(device, calibration) == []
        assert calibration.noise.value == 0.0
        for axis_calibration, mass, damping in zip(
            calibration.axes, device.mass, device.damping, strict=True
        ):
            dynamics = axis_calibration.dynamics
            pairs = (
                (dynamics.mass, mass),
                (dynamics.damping, damping),
                (dynamics.friction, device.friction),
            )
            for estimate, true in pairs:
                assert abs(estimate.value - true) < 4.0 * estimate.uncertainty
            assert dynamics.mass.value == pytest.approx(mass, rel=0.02)
        weakest = min(range(3), key=lambda i: device.damping[i])
        assert calibration.weakest_axis.name == "xyz"[weakest]


@pytest.mark.parametrize(
    ("damping", "friction"),
    [(2.0, 0.26), (1.0, 0.26), (2.2, 0.26), (2.0, 0.15), (0.5, 0.05), (2.0, 0.0)],
)
def test_damping_and_friction_are_within_their_uncertainty(damping: float, friction: float) -> None:
    """Coarse readings of a light handle; friction does not count as damping."""
    servo = Servo(1e-3, delay=1, position_resolution=5.5e-5)
    plant = Cartesian(0.045, damping, friction=friction)
    driver = simulated_driver(plant, SpringHand(), servo, ORIGIN, 1e-3, device_resolution=True)
    loop = Servo(1e-3, max_force=1.0)
    calibration = Calibrator(UnclockedRig(driver, loop, SAFE), SAFE.ramp).run()
    for axis in calibration.axes:
        for estimate, true in (
            (axis.dynamics.damping, damping),
            (axis.dynamics.friction, friction),
        ):
            assert abs(estimate.value - true) < 2.5 * estimate.uncertainty
            assert estimate.uncertainty < max(0.3 * true, 2e-3)
        assert axis.dynamics.mass.value == pytest.approx(0.045, rel=0.02)
    device = measured_device(load_device("touch"), calibration, "mine", "today", simulated=True)
    assert 0.3 * damping < (device.value("damping") or 0.0) < damping


def test_simulated_sign_reverses_within_a_sample_and_sticks() -> None:
    """Friction of 0.1 N on 0.1 kg: +1 m/s² for 10 samples, -3 m/s² for 3 1/3, then -1 m/s²."""
    forces = np.concatenate([np.full(10, 0.2), np.full(10, -0.2), np.full(9, -0.05)])
    signs = simulated_signs(forces, 0.1, 1e-9, 0.1, 1e-3)
    np.testing.assert_allclose(signs[:13], 1.0)
    np.testing.assert_allclose(signs[13:15], [1.0 / 3.0 - 2.0 / 3.0, -1.0], atol=1e-6)
    # From 6 2/3 mm/s it comes to rest at 0.5 m/s², held by half of the friction.
    long = simulated_signs(np.append(forces, np.full(9, -0.05)), 0.1, 1e-9, 0.1, 1e-3)
    np.testing.assert_allclose(long[20:33], -1.0)
    np.testing.assert_allclose(long[33:], [-1.0 / 3.0 - 1.0 / 3.0, *[-0.5] * 4], atol=1e-6)


WRONG = {"delay": 1, "step": 1.06, "period": 1.06, "damping": 1.15}


@pytest.mark.parametrize("name", WRONG)
def test_slightly_different_device_is_rejected(
    random_calibration: tuple[RandomDevice, Calibration], name: str
) -> None:
    """Negative control: the calibration of a device does not match a slightly different one."""
    device, calibration = random_calibration
    true, change = getattr(device, name), WRONG[name]
    other = true + change if name == "delay" else true * np.array(change)
    assert list_misses(dataclasses.replace(device, **{name: other}), calibration)


def test_wall_limit_agrees_with_theory() -> None:
    """K₀ = b/T/(1/2 + d) for a heavy handle; 2 b/T without delay."""
    for delay in range(4):
        assert wall_limit(2.0, 1.0, 1e-3, delay) == pytest.approx(1e3 / (0.5 + delay), rel=2e-3)


def test_position_step_is_detected_in_quantised_readings() -> None:
    rng = np.random.default_rng(1)
    positions = np.cumsum(rng.normal(scale=3e-5, size=2000))
    step = 2.1e-5
    readings = step * np.rint(positions / step)
    estimate = position_step(readings)
    assert estimate is not None
    assert estimate.value == pytest.approx(step, rel=1e-9)
    assert estimate.uncertainty < 1e-3 * step
    # No two values are one step apart.
    irregular = position_step(step * np.array([0.0, 2, 5, 9, 2, 0]))
    assert irregular is not None
    assert irregular.value == pytest.approx(step)
    assert position_step(positions) is None
    # A change of the size of rounding is no reading, however often it occurs.
    still = np.tile([0.0, 1e-10], 100)
    moved = position_step(np.append(still, [1e-5, 3.7e-5, 9.1e-5, 1.93e-4]))
    assert moved is not None
    assert moved.value > 1e-6
    # Steps of a joint angle: the change between readings counts.
    angles = np.cumsum(rng.uniform(0.0, 4e-6, 4000))
    turning = 0.2 * np.sin(1e-4 * np.rint(angles / 2e-5))
    angular = position_step(turning)
    assert angular is not None
    assert angular.value == pytest.approx(2e-5, rel=0.02)


def test_rest_noise_is_separated_from_drift() -> None:
    rng = np.random.default_rng(2)
    readings = 1e-3 + np.linspace(0.0, 1e-4, 4000) + rng.normal(scale=3e-6, size=4000)
    noise = rest_noise(readings)
    assert abs(noise.value - 3e-6) < 4.0 * noise.uncertainty
    assert noise.uncertainty < 0.05 * noise.value


@pytest.mark.parametrize("every", [1, 3, 4])
def test_repeated_readings_are_not_fresh(every: int) -> None:
    times = np.arange(3000) * 1e-3
    positions = 2e-3 * np.sin(40.0 * times)
    readings = 1e-5 * np.rint(positions[np.arange(3000) // every * every] / 1e-5)
    assert fresh_fraction(readings, 1e-5) == pytest.approx(1.0 / every, rel=0.02)
    assert fresh_fraction(np.zeros(100), 1e-5) == 1.0


@pytest.mark.parametrize(("onset", "lowest"), [(731.0, 50.0), (60.0, 50.0), (20.0, 50.0)])
def test_wall_onset_is_approached_from_below(onset: float, lowest: float) -> None:
    trials: list[float] = []

    def cycles(stiffness: float) -> bool:
        trials.append(stiffness)
        return stiffness > onset

    wall = find_wall_onset(cycles, 1e4, lowest)
    assert wall.stable_stiffness <= onset <= (wall.cycling_stiffness or 0.0)
    assert wall.trials == len(trials)
    assert max(trials) <= max(1.3 * onset, lowest)
    assert wall.stable_stiffness == 0.0 if onset < lowest else wall.stable_stiffness > 0.97 * onset


def test_wall_that_never_cycles_has_no_onset() -> None:
    assert find_wall_onset(lambda _stiffness: False, 100.0, 50.0) == WallOnset(84.5, None, 3)


@pytest.mark.parametrize(("growth", "cycles"), [(-0.5, False), (-0.02, True), (0.0, True)])
def test_oscillation_is_a_limit_cycle_unless_it_decays(growth: float, cycles: bool) -> None:
    times = np.arange(800) * 1e-3
    positions = 1e-3 * np.exp(growth * times) * np.sin(130.0 * times) + 2e-4
    readings = 5e-5 * np.rint(positions / 5e-5)
    first, last = oscillation_amplitudes(readings, 1e-3, 15.0)
    assert is_limit_cycle(first, last, 1e-4) is cycles
    assert first == pytest.approx(1e-3 * math.exp(0.2 * growth), rel=0.02)
    assert not is_limit_cycle(first, last, 2e-3)  # below the noise floor it is not a limit cycle


def make_excitation(kind: float, samples: int, **more: float) -> Excitation:
    nan = math.nan
    default = Excitation(
        1, kind, 2, 30.0, 0.0, 1.0, 1e3, nan, nan, nan, 0.0, 0.0, 0.0, 0.0, 5.0, 1e-3, samples
    )
    return default._replace(**more)


def test_wall_trips_in_the_sample_where_the_handle_runs_away() -> None:
    device = PythonDevice(lambda k: (0.0, 0.0, 1e-3 * max(0, k - 60)))
    bench = UnclockedRig(device, LOOP, Safety(ramp=0.0, max_slew=1e9))
    rows = bench.apply(make_excitation(WALL, 100, stiffness=400.0, trip_distance=2.5e-3))
    forces = np.array(device.forces)[:, 2]
    assert forces[62] == pytest.approx(-0.8)
    assert (forces[63:] == 0.0).all()
    assert rows[62:64, EXCITATION_COLUMN + 2].tolist() == [0.0, 1.0]


def test_pushes_alternate_and_end_with_zero_force() -> None:
    device = PythonDevice(lambda _k: (0.0, 0.0, 0.0))
    bench = UnclockedRig(device, LOOP, Safety(ramp=0.0, max_slew=1e9))
    rows = bench.apply(make_excitation(PUSHING, 400, push_force=0.5, push_samples=10.0))
    forces = rows[:, 9]
    assert set(np.unique(forces)) == {-0.5, 0.5}
    lengths = np.diff(np.flatnonzero(np.diff(forces)))
    assert 8.0 < lengths.mean() < 12.0
    assert (lengths.min(), lengths.max()) >= (5, 12)
    assert device.forces[-1] == (0.0, 0.0, 0.0)
    assert len(rows) == 400


def test_fault_of_device_and_of_loop_are_described() -> None:
    """The driver describes its own errors, the loop the others; the force ends at zero."""
    lost = PythonDevice(lambda _k: (0.0, 0.0, 0.0), codes={("read", 40): 17})
    wild = PythonDevice(lambda k: (math.nan if k > 40 else 0.0, 0.0, 0.0))
    for device, words in ((lost, lost.describe_error(17)), (wild, "is not a number")):
        bench = UnclockedRig(device, LOOP, Safety(ramp=0.0, max_slew=1e9))
        with pytest.raises(DeviceFault, match=f"{re.escape(words)}; the force was made zero"):
            bench.apply(make_excitation(PUSHING, 400, push_force=0.5, push_samples=10.0))
        assert device.forces[-1] == (0.0, 0.0, 0.0)


class RecordingRig:
    """A rig that records every excitation and its rows."""

    def __init__(self, bench: UnclockedRig) -> None:
        self.servo, self.axes, self._bench = bench.servo, bench.axes, bench
        self.rows: list[FloatArray] = []
        self.excitations: list[Excitation] = []

    def apply(self, excitation: Excitation) -> FloatArray:
        self.excitations.append(excitation)
        self.rows.append(self._bench.apply(excitation))
        return self.rows[-1]


def simulated_rig(damping: float | tuple[float, float, float], delay: int = 1) -> UnclockedRig:
    servo = Servo(1e-3, delay=delay, position_resolution=2e-5)
    plant = Cartesian(0.08, damping)
    driver = simulated_driver(plant, SpringHand(), servo, ORIGIN, 1e-3, device_resolution=True)
    return UnclockedRig(driver, LOOP, SAFE)


def test_forces_stay_below_limits_and_end_after_a_trip() -> None:
    rig = RecordingRig(simulated_rig((0.7, 0.9, 0.8)))
    calibration = Calibrator(rig, SAFE.ramp).run()
    for rows in rig.rows:
        forces = rows[:, 7:10]
        assert np.linalg.norm(forces, axis=1).max() <= LOOP.max_force
        assert np.linalg.norm(np.diff(forces, axis=0), axis=1).max() <= 3.0 + 1e-12
        tripped = rows[:, EXCITATION_COLUMN + 2] > 0.0
        first = int(np.argmax(tripped)) if tripped.any() else len(rows)
        assert (rows[first + 1 :, 7:10] == 0.0).all()
    assert calibration.weakest_axis.name == "x"
    # A wall is observed until an oscillation has decayed by e^-π at the measured damping, for 15
    # to 150 oscillations and 0.15 to 2.5 s, after 70 ms of ramp and rest.
    walls = [one for one in rig.excitations if one.kind == WALL]
    for wall in walls:
        motion = calibration.axes[int(wall.axis)].dynamics
        mass, frequency = motion.mass.value, math.sqrt(wall.stiffness / motion.mass.value)
        waves = min(max(0.5 * mass * frequency / motion.damping.value, 15.0), 150.0)
        watched = min(max(waves * 2.0 * math.pi / frequency, 0.15), 2.5)
        assert wall.wait_samples == 70.0
        assert wall.samples == pytest.approx((0.07 + watched) / 1e-3, abs=1.0)
        assert wall.wall_step == min(1e-3, 0.35 * LOOP.max_force / wall.stiffness)
    assert len({wall.samples for wall in walls}) > 10
    # The handle never moves far.
    assert max(np.abs(rows[:, 1:4]).max() for rows in rig.rows) < 0.02


def test_uncertainty_of_the_rate_is_that_of_the_mean_period() -> None:
    """σ_T/(T √n) of the rate; a gap between two loops is no period."""
    calibrator = Calibrator(simulated_rig(0.7), SAFE.ramp)
    periods = 1e-3 * (1.0 + 0.1 * np.resize([-1.0, 1.0], 400))
    periods[200] = 5.0
    calibrator._times = np.concatenate([[0.0], np.cumsum(periods)])
    rate = calibrator._update_rate([PushRecord(np.arange(9.0), np.zeros(9), 1)], 0.0)
    assert rate.value == pytest.approx(1e3, rel=1e-3)
    assert rate.uncertainty == pytest.approx(0.1 * 1e3 / math.sqrt(399.0), rel=1e-2)


@pytest.mark.parametrize("name", [*DRIVER_KINDS, "pantograph"])
def test_excitation_replaces_the_law_for_every_driver(name: str) -> None:
    if name == "pantograph":
        whole = Pantograph(), SpringHand(), LOOP, ORIGIN
        assert excitation_renderer(simulated_driver(*whole, 1e-3))(make_excitation(REST, 1)).source
    else:
        text = "device.so" if name == "own" else name
        driver = hardware_driver(text, "lying", (0.0, 0.0, 0.0))
        assert excitation_renderer(driver)(make_excitation(REST, 1)).source


def test_immobile_axis_is_left_out() -> None:
    servo = Servo(1e-3, position_resolution=2e-5)
    plant = Cartesian((0.08, 1e4, 0.08), 0.7)
    driver = simulated_driver(plant, SpringHand(), servo, ORIGIN, 1e-3, device_resolution=True)
    calibration = Calibrator(UnclockedRig(driver, LOOP, SAFE), SAFE.ramp).run()
    assert [axis_calibration.name for axis_calibration in calibration.axes] == ["x", "z"]
    assert calibration.immobile_axes == ("y",)


def test_immobile_handle_is_an_error() -> None:
    bench = UnclockedRig(PythonDevice(lambda _k: (0.0, 0.0, 0.0)), LOOP, SAFE)
    with pytest.raises(CalibrationError, match="does not move"):
        Calibrator(bench, SAFE.ramp).run()


def test_axes_are_named_in_the_device_frame() -> None:
    frame = surface_frame((TOWARDS, RIGHT, UP), "lying", (0.0, 0.0, 0.0), 1.0)
    assert frame_axes(frame) == ("y", "x", "z")
    assert frame_axes(surface_frame((RIGHT, AWAY, UP), "standing", (0.0, 0.0, 0.0), 1.0)) == (
        "x",
        "z",
        "y",
    )


def test_clocked_calibration_ends_without_force_on_interrupt() -> None:
    servo = Servo(1e-3, delay=1, position_resolution=2e-5)
    driver = simulated_driver(
        Cartesian(0.08, 1.0), SpringHand(), servo, ORIGIN, 1e-3, device_resolution=True
    )
    patient = Safety(ramp=0.02, lateness=60.0, silence=30.0)
    interrupts = []

    def poll() -> None:
        if interrupts:
            raise KeyboardInterrupt

    with ClockedRig(driver, LOOP, patient, 1.0, poll) as bench:
        rows = bench.apply(
            make_excitation(PUSHING, 300, push_force=0.5, push_samples=20.0, trip_distance=1.0)
        )
        assert (len(rows) > 250, set(rows[:, EXCITATION_COLUMN])) == (True, {1.0})
        assert np.ptp(rows[:, 3]) > 1e-4
        # After its duration there is no force until the next excitation.
        row_count = bench.loop.memory.row_count
        while bench.loop.memory.row_count < row_count + 20:
            bench.loop.poll()
        assert (bench.loop.rows(row_count + 10)[0][:, 7:10] == 0.0).all()
        rest = bench.apply(make_excitation(REST, 50, number=2.0, holding_stiffness=0.0))
        assert (rest[:, 7:10] == 0.0).all()
        interrupts.append(1)
        with pytest.raises(KeyboardInterrupt):
            bench.apply(make_excitation(WALL, 10_000, number=3.0, stiffness=200.0))
    last, _first = bench.loop.rows(bench.loop.memory.row_count - 1)
    assert not bench.loop.process.is_alive()
    assert (last[-1, 7:10] == 0.0).all()


def axis_calibration(
    name: str, stable: float, cycling: float | None, damping: float
) -> AxisCalibration:
    dynamics = AxisDynamics(Estimate(0.05, 1e-4), Estimate(damping, 0.01), Estimate(0.004, 1e-3))
    return AxisCalibration(name, dynamics, WallOnset(stable, cycling, 9))  # type: ignore[arg-type]  # of three names


CALIBRATION = Calibration(
    Estimate(1000.0, 0.01),
    Estimate(3e-5, 1e-9),
    Estimate(2e-6, 1e-7),
    DelayEstimate(2, ()),
    1.0,
    (
        axis_calibration("x", 812.3456, 830.0, 0.5),
        axis_calibration("y", 640.0, 655.0, 0.4),
        axis_calibration("z", 700.0, None, 0.6),
    ),
)


def test_calibration_file_is_a_device_for_comparisons(tmp_path: Path) -> None:
    base = load_device("touch")
    measured = measured_device(base, CALIBRATION, "mine", "2026-11-23", simulated=False)
    path = tmp_path / "mine.toml"
    path.write_text(to_device_toml(measured))
    loaded = load_device(path)
    assert loaded == measured
    test = loaded.wall_test
    assert test is not None
    assert (test.value, test.cycled, test.update_rate) == (640.0, 655.0, 1000.0)
    assert (test.directions, test.positions, test.lightest) == (("x", "y", "z"), "stepped", 1.0)
    assert [other.value for other in test.also] == [812.3, 700.0]
    assert {loaded.data[name].pedigree for name in ("max_stiffness", "damping")} == {"measured"}
    assert test.source.startswith("measured")
    # Proofs use the least damping less two standard uncertainties.
    assert loaded.value("damping") == pytest.approx(0.38)
    assert loaded.value("delay_samples") == 2.0
    assert loaded.value("max_force") == base.value("max_force")
    resolution = math.hypot(3e-5, 12**0.5 * 2e-6)
    assert loaded.value("position_resolution") == pytest.approx(resolution, rel=1e-3)
    comparison = asp.compare("sinusoid:amplitude=0.1mm,period=2mm", device=path, laws="W")
    assert 0.0 < comparison.row("W").stability_limit.stiffness <= 640.0


@pytest.mark.parametrize("name", device_names())
def test_device_file_round_trip(name: str, tmp_path: Path) -> None:
    path = tmp_path / "device.toml"
    path.write_text(to_device_toml(load_device(name)))
    assert load_device(path) == load_device(name)


def test_uncertain_values_are_not_written() -> None:
    uncertain = dataclasses.replace(
        CALIBRATION,
        delay=DelayEstimate(2, (1,)),
        position_step=None,
        noise=Estimate(0.0, 0.0),
        axes=(axis_calibration("x", 0.0, 50.0, 0.015), *CALIBRATION.axes[1:]),
    )
    device = measured_device(load_device("touch"), uncertain, "mine", "2026-11-23", simulated=True)
    absent = {"delay_samples", "position_resolution", "damping", "max_stiffness"}
    assert not absent & device.data.keys()
    assert "simulated" in device.name

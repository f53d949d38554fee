"""Drivers of real devices, tested against fake libraries compiled here."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench.stand_ins.fakes import compile_library
from tests.servo.python_device import SURFACE

from asperity.core.errors import ParameterError
from asperity.core.platform.clock_interface import Clock
from asperity.core.platform.clocks import no_clock
from asperity.recording.recording import open_recording
from asperity.servo.driver import RIGHT, TOWARDS, UP, Driver, Frame, surface_frame
from asperity.servo.driver_loop import DriverLoop, LoopProgram, build_program
from asperity.servo.drivers.driver_registry import hardware_driver
from asperity.servo.drivers.force_dimension import LIBRARY, ForceDimensionDriver
from asperity.servo.drivers.library import LibraryDriver
from asperity.servo.drivers.simulated import replay_driver
from asperity.servo.loop_memory import EndReason, LoopMemory
from asperity.servo.safety import Safety
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary, simulate

ROOT = Path(__file__).parents[3]
EXAMPLE = ROOT / "examples" / "own_device.c"
FAKES = ROOT / "bench" / "stand_ins" / "c"
NOTHING, READ_ONCE, _READ_EVER, WRITE_ONCE = range(4)
# Generous limits: lateness on a busy machine is not under test here.
NO_RAMP = Safety(ramp=0.0, max_slew=1e9, silence=60.0, lateness=60.0)


@pytest.fixture(scope="module")
def dhd_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compile_library(FAKES / "fake_dhd.c", tmp_path_factory.mktemp("dhd"))


@pytest.fixture
def dhd(dhd_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The fake libdhd, reset to its initial state."""
    monkeypatch.setenv(LIBRARY, str(dhd_path))
    library = ctypes.CDLL(str(dhd_path))
    library.fake_force.restype = ctypes.c_double
    library.fake_place.argtypes = [ctypes.c_double] * 3
    library.fake_reset(NOTHING, 0)
    return library


@cache
def program_for(kind: type[Driver]) -> LoopProgram:
    """Return the compiled program of the surface for a kind of driver."""
    return build_program(SURFACE, kind.__new__(kind))


def run(
    driver: Driver, samples: int, clock: Callable[[], Clock] = no_clock
) -> tuple[EndReason, int, np.ndarray]:
    """Open, run and close a driver as the servo process does."""
    shared = LoopMemory()
    loop = DriverLoop(driver, Servo(1e-3, max_force=3.0), NO_RAMP, 1.0, shared.block(), clock())
    loop.compile(program_for(type(driver)))
    record = driver.open()
    try:
        cause, code = loop.run(program_for(type(driver)), record, samples)
    finally:
        driver.close()
    return cause, code, shared.rows(0)[0]


def test_force_dimension_rotates_positions_and_forces(dhd: Any) -> None:
    """The device's x points to the user and y right; the surface's x right and y away."""
    driver = hardware_driver("forcedimension", "lying", (0.01, 0.02, 0.03))
    dhd.fake_place(0.01 - 0.4e-3, 0.02 + 0.7e-3, 0.03 - 1e-3)
    cause, _code, rows = run(driver, 5)
    assert cause is EndReason.FINISHED
    np.testing.assert_allclose(rows[0, 1:4], [0.7e-3, 0.4e-3, -1e-3], atol=1e-15)
    expected = SURFACE.force(rows[0, 1:4])
    np.testing.assert_allclose(rows[0, 7:10], expected, rtol=1e-12)
    assert np.abs(expected).min() > 0.01
    assert [dhd.fake_state(0), dhd.fake_state(1)] == [-1, 0]


def test_force_dimension_receives_forces_in_its_own_frame(dhd: Any) -> None:
    driver = hardware_driver("forcedimension", "lying", (0.0, 0.0, 0.0))
    dhd.fake_place(-0.4e-3, 0.7e-3, -1e-3)
    record = driver.open()
    loop = DriverLoop(driver, Servo(1e-3), NO_RAMP, 1.0, LoopMemory().block(), no_clock())
    sent = []
    write = ctypes.CFUNCTYPE(ctypes.c_int, *[ctypes.c_double] * 3, ctypes.c_byte)(
        lambda x, y, z, _number: sent.append((x, y, z)) or 0
    )
    word = ctypes.cast(write, ctypes.c_void_p).value
    loop.run(build_program(SURFACE, driver), record._replace(set_force=word), 1)
    fx, fy, fz = SURFACE.force((0.7e-3, 0.4e-3, -1e-3))
    np.testing.assert_allclose(sent[0], (-fy, fx, fz), rtol=1e-12)
    driver.close()


@pytest.mark.parametrize("fault", [READ_ONCE, WRITE_ONCE])
def test_libdhd_error_ends_the_loop_with_zero_force(dhd: Any, fault: int) -> None:
    dhd.fake_reset(fault, 7)
    dhd.fake_place(0.0, 0.0, -1e-3)
    driver = ForceDimensionDriver()
    cause, code, rows = run(driver, 50)
    assert (cause, code, len(rows)) == (EndReason.DEVICE, -1, 8 if fault == WRITE_ONCE else 7)
    assert [dhd.fake_force(axis) for axis in range(3)] == [0.0, 0.0, 0.0]
    assert driver.describe_error(code) == "libdhd: communication error (-1)"
    dhd.fake_reset(NOTHING, 0)
    assert run(driver, 5)[0] is EndReason.FINISHED  # a restart works


def test_random_libdhd_failures_leave_zero_force(dhd: Any) -> None:
    rng = np.random.default_rng(15)
    driver, program = ForceDimensionDriver(), build_program(SURFACE, ForceDimensionDriver())
    for _ in range(300):
        sample, fault = int(rng.integers(0, 10)), (READ_ONCE, WRITE_ONCE)[rng.integers(0, 2)]
        dhd.fake_reset(fault, sample)
        dhd.fake_place(0.0, 0.0, -rng.uniform(0.5e-3, 3e-3))
        loop = DriverLoop(
            driver, Servo(1e-3, max_force=3.0), NO_RAMP, 1.0, LoopMemory().block(), no_clock()
        )
        cause, _code = loop.run(program, driver.open(), 40)
        assert cause is EndReason.DEVICE
        assert [dhd.fake_force(axis) for axis in range(3)] == [0.0, 0.0, 0.0]
        assert dhd.fake_state(2) == sample + 1
        driver.close()


def test_ambiguous_or_absent_device_is_an_error(dhd: Any) -> None:
    dhd.fake_devices(2)
    with pytest.raises(ParameterError, match="2 devices: choose one, forcedimension:0, "):
        ForceDimensionDriver().open()
    second = ForceDimensionDriver(1)
    second.open()
    assert dhd.fake_state(0) == 1
    assert dhd.fake_state(3) == 255  # without commands for 32 ms the device disables its force
    second.close()
    assert dhd.fake_state(3) == 0
    with pytest.raises(ParameterError, match="finds 2 devices"):
        ForceDimensionDriver(2).open()
    dhd.fake_devices(0)
    with pytest.raises(ParameterError, match="is it switched on"):
        ForceDimensionDriver().open()


def test_missing_or_unusable_library_has_a_helpful_error(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv(LIBRARY, raising=False)
    with pytest.raises(ParameterError, match=r"the SDK of Force Dimension.*ASPERITY_LIBDHD"):
        ForceDimensionDriver().open()
    foreign = tmp_path / "foreign.so"
    # The ELF header of a library for another, 32-bit processor.
    foreign.write_bytes(b"\x7fELF\x01\x01\x01" + bytes(9) + b"\x03\x00\x28\x00" + bytes(60))
    damaged = tmp_path / "beschädigte Datei.dll"
    damaged.write_text("no library")
    for file in (foreign, damaged):
        with pytest.raises(ParameterError, match=f"does not load .*{file.name}: "):
            LibraryDriver(str(file)).open()
    with pytest.raises(ParameterError, match=r"not found: compile your C file$"):
        LibraryDriver(str(tmp_path / "missing.so")).open()
    source = tmp_path / "empty.c"
    source.write_text("int asperity_open(void) { return 0; }\n")
    with pytest.raises(ParameterError, match="has no function asperity_read"):
        LibraryDriver(str(compile_library(source, tmp_path))).open()


def test_example_of_a_user_defined_device_runs(tmp_path: Path) -> None:
    library = compile_library(EXAMPLE, tmp_path)
    driver = hardware_driver(str(library), "lying", (0.0, 0.0, 0.0))
    cause, _code, rows = run(driver, 1500)
    assert cause is EndReason.FINISHED
    assert (rows[0, 3], rows[0, 9]) == (2e-3, 0.0)
    # At rest the surface force balances the spring.
    assert rows[1450, 9] == pytest.approx(100.0 * (rows[1450, 3] + 5e-3), rel=1e-3)


def test_error_code_of_a_user_defined_device_is_reported(tmp_path: Path) -> None:
    text = EXAMPLE.read_text()
    failing = tmp_path / "failing.c"
    failing.write_text(text.replace("(void)contact;", "(void)contact;\n    return 17;"))
    driver = LibraryDriver(str(compile_library(failing, tmp_path)))
    cause, code, rows = run(driver, 10)
    assert (cause, len(rows)) == (EndReason.DEVICE, 1)
    assert driver.describe_error(code) == "failing.so returned 17"
    closed = tmp_path / "closed.c"
    opening = "int asperity_open(void)\n{\n    return "
    closed.write_text(text.replace(f"{opening}0;", f"{opening}3;"))
    with pytest.raises(ParameterError, match="asperity_open returned 3"):
        LibraryDriver(str(compile_library(closed, tmp_path))).open()


def test_frame_transforms_positions_and_its_inverse_forces() -> None:
    frame = surface_frame((RIGHT, UP, TOWARDS), "standing", (0.0, 0.01, 0.0), 1e-3)
    table = frame.matrix
    probe = table[:3, :3] @ np.array([3.0, 12.0, -5.0]) + table[:3, 3]
    np.testing.assert_allclose(probe, [3e-3, 2e-3, -5e-3], atol=1e-15)
    np.testing.assert_allclose(table[3:, :3] @ table[:3, :3] / 1e-3, np.eye(3), atol=1e-15)
    for bad in (np.diag([1.0, 1.0, -1.0]), 2.0 * np.eye(3)):
        with pytest.raises(ParameterError, match="rotation"):
            Frame(tuple(map(tuple, bad.tolist())))


@pytest.mark.parametrize(
    ("text", "message"), [("falcon9", "is unknown"), ("forcedimension:x", "a number after")]
)
def test_unknown_driver_is_an_error(text: str, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        hardware_driver(text, "lying", (0.0, 0.0, 0.0))


def test_replay_driver_reproduces_recorded_forces(tmp_path: Path) -> None:
    """The loop driven along a recording commands the recorded forces."""
    place, path = Stationary((0.0, 0.0, -1e-3)), tmp_path / "run.mcap"
    hand = SpringHand(stiffness=300.0, damping=3.0, mass=0.05)
    simulate(SURFACE, Cartesian(0.05), hand, Servo(1e-3), place, 0.3, trace=path)
    recording = open_recording(path)
    cause, _code, rows = run(replay_driver(str(path), 1e-3), 300)
    assert cause is EndReason.FINISHED
    for name, column in (("x", 1), ("z", 3), ("commanded x", 4), ("commanded z", 6)):
        np.testing.assert_array_equal(rows[:300, column], recording[name])
    assert rows[300, 3] == recording["z"][-1]  # the handle stays at the last position
    with pytest.raises(ParameterError, match=r"not sampled evenly at 4 kHz.*update_rate='1 kHz'"):
        replay_driver(str(path), 2.5e-4)
    with pytest.raises(ParameterError):
        replay_driver(str(tmp_path / "none.mcap"), 1e-3)

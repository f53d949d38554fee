"""The OpenHaptics driver against a fake libHD compiled here, with its scheduler and failures."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench.stand_ins.fakes import compile_library
from tests.servo.drivers.test_drivers import FAKES, run
from tests.servo.drivers.test_haply import wait_until, write_force
from tests.servo.python_device import SURFACE

from asperity.core.errors import ParameterError
from asperity.core.platform.clocks import clock_module, no_clock, system_clock
from asperity.core.platform.system import System, function_address
from asperity.kernels.fuse import fuse_module
from asperity.servo.drivers import open_haptics
from asperity.servo.drivers import threaded as exchanged
from asperity.servo.drivers.driver_registry import hardware_driver
from asperity.servo.drivers.open_haptics import LIBRARY, OpenHapticsDriver
from asperity.servo.drivers.threaded import FAILURE_CODE, LOOP_SILENT, STALE
from asperity.servo.loop_memory import EndReason

NOTHING, ERROR, HANGS, NOT_A_NUMBER, FAR, NOT_CALIBRATED, NOT_OPENED = range(7)
OPENED, ENABLED, FRAMES, RUNNING, FORCED = range(5)


@pytest.fixture(scope="module")
def hd_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compile_library(FAKES / "fake_hd.c", tmp_path_factory.mktemp("hd"))


@pytest.fixture
def hd(hd_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The fake libHD, reset, with the handle inside the wall."""
    monkeypatch.setenv(LIBRARY, str(hd_path))
    monkeypatch.setattr(exchanged, "OPEN_TIMEOUT", 30.0)  # enough for a busy machine
    library = ctypes.CDLL(str(hd_path))
    library.fake_force.restype = ctypes.c_double
    library.fake_place.argtypes = [ctypes.c_double] * 3
    library.fake_reset(NOTHING, 0)
    library.fake_place(0.7, -1.0, -0.4)
    return library


def tolerant_driver(**options: Any) -> OpenHapticsDriver:
    """Return a driver with timeouts that a busy machine does not exceed."""
    return OpenHapticsDriver(**{"max_reading_age": 60.0, "force_timeout": 60.0, **options})


def held_force(hd: Any) -> list[float]:
    return [hd.fake_force(axis) for axis in range(3)]


def test_units_and_axes_are_converted(hd: Any) -> None:
    """The device's y points up and its z to the user; the surface's y points away and z up."""
    driver = hardware_driver("openhaptics:Left Device", "lying", (0.0, 0.0, 0.0))
    assert isinstance(driver, OpenHapticsDriver)
    driver.max_reading_age = driver.force_timeout = 60.0
    cause, _code, rows = run(driver, 30, system_clock)
    assert cause is EndReason.FINISHED
    np.testing.assert_allclose(rows[0, 1:4], [0.7e-3, 0.4e-3, -1e-3], atol=1e-15)
    np.testing.assert_allclose(rows[0, 7:10], SURFACE.force(rows[0, 1:4]), rtol=1e-12)
    # libHD reports calls outside the scheduler's thread; everything is closed at the end.
    assert [hd.fake_state(index) for index in (OPENED, ENABLED, RUNNING)] == [0, 0, 0]


def test_device_holds_the_force_until_closed(hd: Any) -> None:
    driver = tolerant_driver()
    record = driver.open()
    write_force(record, (0.25, -0.5, 1.5))
    assert wait_until(lambda: held_force(hd) == [0.25, -0.5, 1.5])
    driver.close()
    assert held_force(hd) == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("fault", "cause", "code"),
    [
        (ERROR, EndReason.DEVICE, 0x0302),
        (HANGS, EndReason.DEVICE, STALE),
        (NOT_A_NUMBER, EndReason.NOT_FINITE, 0),
        (FAR, EndReason.WORKSPACE, 0),
    ],
)
def test_failure_zeroes_the_force_and_a_restart_works(
    hd: Any, fault: int, cause: EndReason, code: int
) -> None:
    hd.fake_reset(fault, 30)
    hd.fake_place(0.7, -1.0, -0.4)
    driver = tolerant_driver(max_reading_age=0.2 if fault == HANGS else 60.0)
    end_reason, error_code, rows = run(driver, 100_000, system_clock)
    assert (end_reason, error_code) == (cause, code)
    assert hd.fake_state(FORCED) == 1
    assert np.isfinite(rows).all()
    assert held_force(hd) == [0.0, 0.0, 0.0]
    hd.fake_reset(NOTHING, 0)
    assert run(tolerant_driver(), 5, system_clock)[0] is EndReason.FINISHED


def test_error_in_the_scheduler_zeroes_the_force_at_once(hd: Any) -> None:
    hd.fake_reset(ERROR, 30)
    driver = tolerant_driver()
    record = driver.open()
    write_force(record, (0.0, 0.0, 1.5))
    assert wait_until(lambda: hd.fake_state(FRAMES) > 33)
    assert (record.words[FAILURE_CODE], hd.fake_state(FORCED)) == (0x0302, 1)
    assert held_force(hd) == [0.0, 0.0, 0.0]
    assert driver.describe_error(0x0302) == "libHD: communication error (0x0302)"
    driver.close()


def test_force_of_a_hanging_loop_times_out(hd: Any) -> None:
    driver = tolerant_driver(force_timeout=0.05)
    record = driver.open()
    write_force(record, (0.0, 0.0, 1.5))
    assert wait_until(lambda: held_force(hd) == [0.0, 0.0, 1.5])
    assert wait_until(lambda: record.words[FAILURE_CODE] == LOOP_SILENT)
    assert wait_until(lambda: held_force(hd) == [0.0, 0.0, 0.0])
    assert "held a force for 50 ms" in driver.describe_error(LOOP_SILENT)
    driver.close()


@pytest.mark.parametrize(
    ("fault", "device", "message"),
    [
        (NOT_OPENED, "", "cannot open the default device: communication error"),
        (NOTHING, "Right Device", "cannot open Right Device: communication error"),
        (NOT_CALIBRATED, "", "not calibrated: put the stylus into its inkwell"),
        (HANGS, "", "no reading of the device for 0.2 s"),
        (ERROR, "", "cannot use the device: communication error"),
    ],
)
def test_failed_open_has_a_helpful_error(
    hd: Any, monkeypatch: pytest.MonkeyPatch, fault: int, device: str, message: str
) -> None:
    if fault == HANGS:
        monkeypatch.setattr(exchanged, "OPEN_TIMEOUT", 0.2)
    hd.fake_reset(fault, 0)
    with pytest.raises(ParameterError, match=message):
        tolerant_driver(device=device).open()
    assert [hd.fake_state(index) for index in (OPENED, ENABLED, RUNNING)] == [0, 0, 0]


_SLEPT = """
#define _POSIX_C_SOURCE 200809L
#include <time.h>
int slept_gettime(int clock, struct timespec *time)
{
    const int answer = clock_gettime(CLOCK_MONOTONIC, time);
    time->tv_sec += clock == 7 ? 1000 : 0; /* CLOCK_BOOTTIME */
    return answer;
}
"""


@pytest.mark.usefixtures("hd")
def test_readings_are_fresh_after_the_machine_slept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Loop and scheduler read the same clock, which counts the time of sleep."""
    source = tmp_path / "slept.c"
    source.write_text(_SLEPT, encoding="utf-8")
    library = ctypes.CDLL(str(compile_library(source, tmp_path)))
    clock = system_clock()._replace(gettime=function_address(library.slept_gettime))
    for module in (exchanged, open_haptics):
        monkeypatch.setattr(module, "system_clock", lambda: clock)
    assert run(tolerant_driver(), 30, no_clock)[0] is EndReason.FINISHED


_WINDOWS_ERROR = """
typedef struct { unsigned int code; int internal; unsigned int device; } Error;
unsigned int code;
void hdBeginFrame(unsigned int device) { (void)device; }
void hdEndFrame(unsigned int device) { (void)device; }
void hdGetDoublev(unsigned int what, double *values) { values[0] = values[1] = values[2] = what; }
void hdSetDoublev(unsigned int what, double *values) { (void)what, (void)values; }
Error *hdGetError(Error *error)
{
    *error = (Error){code, -7, 0};
    return error;
}
"""


def test_error_that_windows_returns_in_memory_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A record of 12 bytes, whose last number is the handle: that of the first device is 0."""
    monkeypatch.setattr(open_haptics, "find_system", lambda: System.WINDOWS)
    source = tmp_path / "windows_error.c"
    source.write_text(_WINDOWS_ERROR, encoding="utf-8")
    library = ctypes.CDLL(str(compile_library(source, tmp_path)))
    buffer = OpenHapticsDriver()._create_buffer(library)
    frame = fuse_module(open_haptics, exchanged, clock_module()).haptic_frame
    for code in (0, 0, 0x0302):
        ctypes.c_uint.in_dll(library, "code").value = code
        frame(buffer.words, buffer.numbers)
        assert buffer.words[FAILURE_CODE] == code


def test_missing_library_names_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(LIBRARY, raising=False)
    with pytest.raises(ParameterError, match=r"the Touch driver and OpenHaptics.*ASPERITY_LIBHD"):
        OpenHapticsDriver().open()

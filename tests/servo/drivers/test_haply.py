"""The Inverse3 driver against a fake Haply service and its failures."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from bench.stand_ins.fake_haply import FAULTS, FakeHaply
from tests.servo.drivers.test_drivers import run
from tests.servo.python_device import SURFACE

from asperity.core.errors import ParameterError
from asperity.core.platform.clocks import system_clock
from asperity.servo.drivers import threaded as exchanged
from asperity.servo.drivers.driver_registry import hardware_driver
from asperity.servo.drivers.haply import MAX_PENDING, SERVICE, HaplyDriver
from asperity.servo.drivers.threaded import (
    FAILURE_CODE,
    FORCES,
    HEADER_WORDS,
    LOOP_SILENT,
    RING_ROWS,
    ROW_WORDS,
    STALE,
    ThreadedDevice,
)
from asperity.servo.loop_memory import EndReason

ZERO = (0.0, 0.0, 0.0)
Start = Callable[..., FakeHaply]


@pytest.fixture
def start(monkeypatch: pytest.MonkeyPatch) -> Start:
    """``start(...)`` starts a fake service for the driver, with timeouts for a busy machine."""
    monkeypatch.setattr(exchanged, "OPEN_TIMEOUT", 30.0)

    def start_service(**options: Any) -> FakeHaply:
        service = FakeHaply(**options)
        monkeypatch.setenv(SERVICE, service.address)
        return service

    return start_service


def tolerant_driver(**options: Any) -> HaplyDriver:
    """Return a driver with timeouts that a busy machine does not exceed."""
    return HaplyDriver(**{"max_reading_age": 60.0, "force_timeout": 60.0, **options})


def test_positions_and_forces_are_exchanged_in_the_surface_frame(start: Start) -> None:
    """For a horizontal surface; coordinates missing in a state message are 0."""
    with start(place=lambda _k: (0.7e-3, 0.0, -1e-3)) as service:
        driver = hardware_driver("haply:049d", "lying", (0.0, -0.4e-3, 0.0))
        assert isinstance(driver, HaplyDriver)
        driver.max_reading_age = driver.force_timeout = 60.0
        cause, _code, rows = run(driver, 60, system_clock)
        assert cause is EndReason.FINISHED
        np.testing.assert_allclose(rows[0, 1:4], [0.7e-3, 0.4e-3, -1e-3], atol=1e-15)
        (sent,) = {force for _when, force in service.forces} - {ZERO}
        np.testing.assert_allclose(sent, SURFACE.force(rows[0, 1:4]), rtol=1e-12)
        assert (service.forces[0][1], service.last_force()) == (ZERO, ZERO)


@pytest.mark.parametrize("fault", FAULTS)
def test_failure_zeroes_the_force_and_a_restart_works(start: Start, fault: str) -> None:
    driver = tolerant_driver(max_reading_age=0.2 if fault in {"mute", "half a frame"} else 60.0)
    with start(fault=fault, at=30) as service:
        cause, code, rows = run(driver, 100_000, system_clock)
        assert cause is {"nan": EndReason.NOT_FINITE, "far": EndReason.WORKSPACE}.get(
            fault, EndReason.DEVICE
        )
        is_pushed = rows[:, 7:10].any(axis=1)
        assert np.isfinite(rows).all()  # no row of a sample without a position
        assert is_pushed[:-1].all()
        assert is_pushed[-1] == (cause is not EndReason.WORKSPACE)
        if fault != "closed":  # a closed service receives no last force
            assert service.last_force() == ZERO
    messages = {
        "mute": "older than 200 ms",
        "unplugged": "unplugged?",
        "closed": "is lost",
        "twice": "without a request",
        "no JSON": "another format",
    }
    assert messages.get(fault, "") in driver.describe_error(code)
    with start():
        assert run(tolerant_driver(), 5, system_clock)[0] is EndReason.FINISHED


def test_final_zero_force_reaches_a_slow_service(start: Start) -> None:
    with start(fault="no JSON", at=10, late=0.03) as service:
        assert run(tolerant_driver(), 100_000, system_clock)[0] is EndReason.DEVICE
        assert service.last_force() == ZERO


def test_force_of_a_lost_loop_is_released_by_another_connection(start: Start) -> None:
    with start() as service:
        HaplyDriver().release_lost_device()
        assert wait_until(lambda: bool(service.forces))
    assert [force for _time, force in service.forces] == [ZERO]


def test_age_of_a_state_counts_from_its_request(start: Start) -> None:
    """A service that answers regularly but with old states is stale."""
    with start(late=0.05):
        driver = HaplyDriver(max_reading_age=0.02, force_timeout=60.0)
        cause, code, _rows = run(driver, 100_000, system_clock)
    assert (cause, code) == (EndReason.DEVICE, STALE)
    with start(late=0.05):
        assert run(tolerant_driver(), 20, system_clock)[0] is EndReason.FINISHED


def test_force_of_a_hanging_loop_times_out(start: Start) -> None:
    with start() as service:
        driver = tolerant_driver(force_timeout=0.05)
        record = driver.open()
        write_force(record, (0.0, 0.0, 1.5))
        assert wait_until(lambda: (0.0, 0.0, 1.5) in [force for _when, force in service.forces])
        assert wait_until(lambda: bool(record.words[FAILURE_CODE]))
        assert service.last_force() == ZERO
        assert "held a force for 50 ms without renewing it" in driver.describe_error(LOOP_SILENT)
        driver.close()


def test_zero_force_is_sent_to_a_mute_service(start: Start) -> None:
    """Requests do not pile up at a mute service, but the final zero force is still sent."""
    with start() as service:
        driver = tolerant_driver()
        record = driver.open()
        write_force(record, (0.0, 0.0, 1.5))
        assert wait_until(lambda: service.forces[-1][1] == (0.0, 0.0, 1.5))
        service.at = len(service.forces) + 10
        service.fault = "mute"
        assert wait_until(lambda: len(service.forces) >= service.at + MAX_PENDING)
        sent_count = len(service.forces)
        time.sleep(0.02)
        assert len(service.forces) == sent_count
        write_force(record, ZERO)
        assert service.last_force() == ZERO
        driver.close()


def write_force(record: ThreadedDevice, force: tuple[float, float, float]) -> None:
    """Write one force to the ring buffer as the loop does."""
    row = HEADER_WORDS + ROW_WORDS * (RING_ROWS + record.words[FORCES])
    record.words[row] = time.monotonic_ns()
    record.numbers[row + 1 : row + 4] = force
    record.words[FORCES] += 1


def wait_until(reached: Callable[[], bool], patience: float = 30.0) -> bool:
    """Wait for a condition and return whether it was met in time."""
    end = time.monotonic() + patience
    while not reached() and time.monotonic() < end:
        time.sleep(1e-3)
    return reached()


@pytest.mark.parametrize(
    ("options", "device", "message"),
    [
        ({"devices": ()}, "", "finds no Inverse3: is it plugged in"),
        ({"devices": ("049D", "1A2B")}, "", "2 devices: choose one, haply:049D, haply:1A2B"),
        ({"devices": ("049D",)}, "1A2B", "finds no device 1A2B: choose one, haply:049D"),
        ({"hello": b'{"version": "3.0"}'}, "", "format 3.1 or newer; this one sent a message of"),
        ({"hello": b""}, "", "format 3.1 or newer"),
        ({"fault": "unplugged"}, "", "cannot use the device: .* unplugged?"),
        ({"fault": "mute"}, "", "has no reading of the device for 0.2 s"),
    ],
)
def test_failed_open_has_a_helpful_error(
    start: Start, monkeypatch: pytest.MonkeyPatch, options: Any, device: str, message: str
) -> None:
    if options.get("fault") == "mute":
        monkeypatch.setattr(exchanged, "OPEN_TIMEOUT", 0.2)
    with start(**options), pytest.raises(ParameterError, match=message):
        HaplyDriver(device=device).open()


def test_selected_device_of_several_is_opened(start: Start) -> None:
    with start(devices=("1A2B", "049D")):
        assert run(tolerant_driver(device="049d"), 5, system_clock)[0] is EndReason.FINISHED


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (b"HTTP/1.1 404 Not Found\r\n\r\n", "finds no Inverse Service at .*404"),
        (b"HTTP/1.1 101 Yes\r\nSec-WebSocket-Accept: no\r\n\r\n", "not a WebSocket's"),
        (b"", "does not answer at .*Haply Hub"),
    ],
)
def test_server_that_is_not_the_inverse_service_is_an_error(
    monkeypatch: pytest.MonkeyPatch, answer: bytes, message: str
) -> None:
    monkeypatch.setattr(exchanged, "OPEN_TIMEOUT", 2.0)
    with socket.create_server(("127.0.0.1", 0)) as server:
        monkeypatch.setenv(SERVICE, f"127.0.0.1:{server.getsockname()[1]}")

        def serve() -> None:
            connection, _address = server.accept()
            with connection:
                connection.recv(4096)
                connection.sendall(answer)

        thread = threading.Thread(target=serve)
        thread.start()
        with pytest.raises(ParameterError, match=message):
            HaplyDriver().open()
        thread.join()


def test_unreachable_service_or_invalid_address_is_an_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    monkeypatch.setenv(SERVICE, f"127.0.0.1:{port}")
    with pytest.raises(ParameterError, match=r"install and start the Haply Hub.*ASPERITY_HAPLY"):
        HaplyDriver().open()
    monkeypatch.setenv(SERVICE, "localhost")
    with pytest.raises(ParameterError, match="host and port"):
        HaplyDriver().open()

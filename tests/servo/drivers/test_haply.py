"""The Inverse3, against a service that is none and its failures."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from bench.fake_haply import FAULTS, FakeHaply
from tests.servo.drivers.test_drivers import run
from tests.servo.python_device import SURFACE

from asperity.core.errors import ParameterError
from asperity.servo.driver_loop import system_clock
from asperity.servo.drivers import haply
from asperity.servo.drivers import threaded as exchanged
from asperity.servo.drivers.driver_registry import hardware_driver
from asperity.servo.drivers.haply import MAX_PENDING, SERVICE, HaplyDriver
from asperity.servo.fault import EndReason
from asperity.servo.kernels.ring_buffer import (
    FAILURE_CODE,
    FORCES,
    HEADER_WORDS,
    LOOP_SILENT,
    RING_ROWS,
    ROW_WORDS,
    STALE,
)
from asperity.servo.kernels.threaded_device import ThreadedDevice

ZERO = (0.0, 0.0, 0.0)
Start = Callable[..., FakeHaply]


@pytest.fixture
def start(monkeypatch: pytest.MonkeyPatch) -> Start:
    """``start(...)``: a service that the driver finds, and has time for on a busy machine."""
    for module in (exchanged, haply):
        monkeypatch.setattr(module, "OPEN_TIMEOUT", 30.0)

    def started(**order: Any) -> FakeHaply:
        service = FakeHaply(**order)
        monkeypatch.setenv(SERVICE, service.address)
        return service

    return started


def patient(**said: Any) -> HaplyDriver:
    """Return a driver that a busy machine does not disturb."""
    return HaplyDriver(**{"max_reading_age": 60.0, "force_timeout": 60.0, **said})


def test_positions_come_and_forces_go(start: Start) -> None:
    """The axes are those of a lying surface; what is missing in a state is 0."""
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
def test_whatever_fails_the_force_is_zero_and_the_next_start_works(
    start: Start, fault: str
) -> None:
    driver = patient(max_reading_age=0.2 if fault in {"mute", "half a frame"} else 60.0)
    with start(fault=fault, at=30) as service:
        cause, code, rows = run(driver, 100_000, system_clock)
        assert cause is {"nan": EndReason.NOT_FINITE, "far": EndReason.WORKSPACE}.get(
            fault, EndReason.DEVICE
        )
        assert (rows[-1, 7:10] == 0.0).all()
        assert np.abs(rows[:-1, 7:10]).max(axis=1).all()
        if fault != "closed":  # then nobody hears it
            assert service.last_force() == ZERO
    said = {"mute": "older than 200 ms", "unplugged": "unplugged?", "closed": "is lost",
            "twice": "without a request", "no JSON": "another format"}  # fmt: skip
    assert said.get(fault, "") in driver.describe_error(code)
    with start():
        assert run(patient(), 5, system_clock)[0] is EndReason.FINISHED


def test_the_last_word_reaches_a_service_that_is_slow(start: Start) -> None:
    with start(fault="no JSON", at=10, late=0.03) as service:
        assert run(patient(), 100_000, system_clock)[0] is EndReason.DEVICE
        assert service.last_force() == ZERO


def test_a_state_is_as_old_as_the_question_that_it_answers(start: Start) -> None:
    """A service that answers in time, but questions of long ago, is stale."""
    with start(late=0.05):
        driver = HaplyDriver(max_reading_age=0.02, force_timeout=60.0)
        cause, code, _rows = run(driver, 100_000, system_clock)
    assert (cause, code) == (EndReason.DEVICE, STALE)
    with start(late=0.05):
        assert run(patient(), 20, system_clock)[0] is EndReason.FINISHED


def test_a_loop_that_hangs_loses_its_force(start: Start) -> None:
    with start() as service:
        driver = patient(force_timeout=0.05)
        record = driver.open()
        hold(record, (0.0, 0.0, 1.5))
        assert until(lambda: (0.0, 0.0, 1.5) in [force for _when, force in service.forces])
        assert until(lambda: bool(record.words[FAILURE_CODE]))
        assert service.last_force() == ZERO
        assert "held a force for 50 ms without renewing it" in driver.describe_error(LOOP_SILENT)
        driver.close()


def test_a_force_goes_even_where_nobody_answers(start: Start) -> None:
    """Messages do not pile up before a service that is mute; that there is no force is said."""
    with start() as service:
        driver = patient()
        record = driver.open()
        hold(record, (0.0, 0.0, 1.5))
        assert until(lambda: service.forces[-1][1] == (0.0, 0.0, 1.5))
        service.at = len(service.forces) + 10
        service.fault = "mute"
        assert until(lambda: len(service.forces) >= service.at + MAX_PENDING)
        heard = len(service.forces)
        time.sleep(0.02)
        assert len(service.forces) == heard
        hold(record, ZERO)
        assert service.last_force() == ZERO
        driver.close()


def hold(record: ThreadedDevice, force: tuple[float, float, float]) -> None:
    """Be a loop that gives a force once."""
    row = HEADER_WORDS + ROW_WORDS * (RING_ROWS + record.words[FORCES])
    record.words[row] = time.monotonic_ns()
    record.numbers[row + 1 : row + 4] = force
    record.words[FORCES] += 1


def until(reached: Callable[[], bool], patience: float = 30.0) -> bool:
    """Wait for something; whether it came."""
    end = time.monotonic() + patience
    while not reached() and time.monotonic() < end:
        time.sleep(1e-3)
    return reached()


@pytest.mark.parametrize(
    ("order", "device", "said"),
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
def test_a_start_that_cannot_be_says_what_to_do(
    start: Start, monkeypatch: pytest.MonkeyPatch, order: Any, device: str, said: str
) -> None:
    if order.get("fault") == "mute":
        monkeypatch.setattr(exchanged, "OPEN_TIMEOUT", 0.2)
    with start(**order), pytest.raises(ParameterError, match=said):
        HaplyDriver(device=device).open()


def test_one_of_several_is_opened(start: Start) -> None:
    with start(devices=("1A2B", "049D")):
        assert run(patient(device="049d"), 5, system_clock)[0] is EndReason.FINISHED


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (b"HTTP/1.1 404 Not Found\r\n\r\n", "finds no Inverse Service at .*404"),
        (b"HTTP/1.1 101 Yes\r\nSec-WebSocket-Accept: no\r\n\r\n", "not a WebSocket's"),
        (b"", "does not answer at .*Haply Hub"),
    ],
)
def test_what_is_no_service_is_said(
    monkeypatch: pytest.MonkeyPatch, answer: bytes, said: str
) -> None:
    monkeypatch.setattr(haply, "OPEN_TIMEOUT", 2.0)
    with socket.create_server(("127.0.0.1", 0)) as server:
        monkeypatch.setenv(SERVICE, f"127.0.0.1:{server.getsockname()[1]}")

        def serve() -> None:
            line, _who = server.accept()
            with line:
                line.recv(4096)
                line.sendall(answer)

        thread = threading.Thread(target=serve)
        thread.start()
        with pytest.raises(ParameterError, match=said):
            HaplyDriver().open()
        thread.join()


def test_a_service_that_is_not_there_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        free = server.getsockname()[1]
    monkeypatch.setenv(SERVICE, f"127.0.0.1:{free}")
    with pytest.raises(ParameterError, match=r"install and start the Haply Hub.*ASPERITY_HAPLY"):
        HaplyDriver().open()
    monkeypatch.setenv(SERVICE, "localhost")
    with pytest.raises(ParameterError, match="host and port"):
        HaplyDriver().open()

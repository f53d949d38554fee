"""The Haply Inverse3, by the WebSocket of the Haply Inverse Service.

Metres and newtons; x to the right, y forward, z up. The service filters the force (oscillation
damper, force gate, damping, scale); results of asperity do not cover these filters.
"""

from __future__ import annotations

import json
import os
import selectors
import sys
import threading
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, ClassVar

from asperity.core.errors import ParameterError
from asperity.core.platform.clocks import system_time
from asperity.core.platform.priority import request_thread_priority
from asperity.core.platform.wakeup import Wakeup
from asperity.servo.driver import AWAY, RIGHT, UP, DriverKind, Vector
from asperity.servo.drivers import threaded
from asperity.servo.drivers.threaded import FORCE_TIMEOUT, LOOP_SILENT, STALE, ThreadedDevice
from asperity.servo.drivers.websocket_client import ProtocolError, WebSocketClient

CONNECTION_LOST = 3
INVALID_STATE = 4
DEVICE_GONE = 5
"""Failures of the thread: no connection, no state in a message, no device."""
KEEP_ALIVE = 5e-3
"""Time without a new force after which the last one is sent again [s]: states keep coming."""
MAX_PENDING = 4
"""Largest number of messages without an answer."""
_ZERO_FORCE = (0.0, 0.0, 0.0)


def parse_states(message: bytes) -> list[dict[str, Any]]:
    """Return the states of the devices in a message of the service.

    Raises:
        ValueError: for a message that is not of format 3.1 or newer.
    """
    try:
        content = json.loads(message)
        devices = content.get("inverse3", [])
        known = not content.keys().isdisjoint(("session_id", "inverse3"))
        if known and all(isinstance(device["device_id"], str) for device in devices):
            return list(devices)
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        pass
    raise ValueError(f"a message of another format: {message[:60]!r}")


def cursor_position(state: dict[str, Any]) -> Vector:
    """Return the position of a device [m]; a missing coordinate is 0.

    Raises:
        ValueError: for a state without a position.
    """
    try:
        coordinates = state["state"]["cursor_position"]
        x = coordinates.get("x", 0.0)
        y = coordinates.get("y", 0.0)
        z = coordinates.get("z", 0.0)
        if coordinates and {type(x), type(y), type(z)} <= {int, float}:
            return float(x), float(y), float(z)
    except (LookupError, TypeError, AttributeError, OverflowError):
        pass
    raise ValueError(f"a state without a position: {str(state)[:60]}")


def force_message(device: str, force: Vector) -> str:
    """Return the message that commands a force [N]."""
    commands = {"set_cursor_force": {"values": dict(zip("xyz", force, strict=True))}}
    return json.dumps({"inverse3": [{"device_id": device, "commands": commands}]})


class HaplyThread(threading.Thread):
    """The thread of a device; it ends with the connection, or by :meth:`stop`.

    Args:
        connection: connection to the service.
        device: id of the device.
        force_timeout: time after which a force that is not renewed is released [s].

    Attributes:
        buffer: buffer between this thread and the loop.
        wakeup: wakes this thread.
        reason: what failed, in words.
    """

    def __init__(self, connection: WebSocketClient, device: str, force_timeout: float) -> None:
        super().__init__(daemon=True)
        self.buffer = threaded.ThreadBuffer(force_timeout)
        self.reason = ""
        self._connection = connection
        self._device_id = device
        self.wakeup = Wakeup()
        self._pending: deque[int] = deque()
        self._last_force = _ZERO_FORCE
        self._last_force_time = 0
        self._stopping = False

    def run(self) -> None:
        """Exchange until a failure or :meth:`stop`; the last message is no force."""
        request_thread_priority(below=1)
        try:
            self._exchange()
        except OSError as error:
            self._fail(CONNECTION_LOST, f"the connection to the Inverse Service is lost: {error}")
        except ValueError as error:
            self._fail(INVALID_STATE, f"the Inverse Service sent {error}")
        finally:
            with suppress(OSError):
                self._send(_ZERO_FORCE)

    def stop(self, timeout: float) -> None:
        """End the thread: the service receives no force, and has time to answer [s]."""
        self._stopping = True
        self.wakeup.wake()
        self.join(timeout)
        self._connection.close()
        self.wakeup.close()

    def _exchange(self) -> None:
        with selectors.DefaultSelector() as selector:
            for file in (self._connection, self.wakeup.reader):
                selector.register(file, selectors.EVENT_READ)
            self._send(_ZERO_FORCE)
            while not self._stopping and not self.reason:
                ready = [key.fileobj for key, _event in selector.select(KEEP_ALIVE)]
                if self.wakeup.reader in ready:
                    self.wakeup.clear()
                if self._connection in ready:
                    self._process_messages(self._connection.receive())
                self._send_newest_force(resend=not ready)

    def _process_messages(self, messages: Sequence[bytes]) -> None:
        """Push the positions of messages to the loop."""
        for message in messages:
            if not self._pending:
                raise ValueError("a state without a request")
            sent = self._pending.popleft()
            for state in parse_states(message):
                if state["device_id"] == self._device_id:
                    self.buffer.push_position(*cursor_position(state), sent)
                    break
            else:
                words = f"the Inverse Service has no {self._device_id} any more: unplugged?"
                self._fail(DEVICE_GONE, words)

    def _send_newest_force(self, *, resend: bool) -> None:
        """Send the newest force if it is new, or the last one again."""
        x, y, z, command_time = self.buffer.latest_force()
        force = (x, y, z)
        timeout = self.buffer.ring.words[FORCE_TIMEOUT]
        if force != _ZERO_FORCE and system_time() - command_time > timeout:
            self._fail(LOOP_SILENT, "its force was released")
            return
        is_new = command_time != self._last_force_time
        is_due = (resend or is_new) and len(self._pending) < MAX_PENDING
        if is_due or force == _ZERO_FORCE != self._last_force:
            self._last_force_time = command_time
            self._send(force)

    def _send(self, force: Vector) -> None:
        self._pending.append(system_time())
        self._connection.send(force_message(self._device_id, force))
        self._last_force = force

    def _fail(self, code: int, reason: str) -> None:
        self.reason = reason
        self.buffer.report_failure(code)


SERVICE = "ASPERITY_HAPLY"
"""Variable of the environment that may hold host and port of the service."""
_DEFAULT_ADDRESS = "localhost:10001"
_SWITCH_INTERVAL = 1e-4  # [s] after which Python switches to the exchange while it compiles


@dataclass
class HaplyDriver(threaded.ThreadedDriver):
    """An Inverse3.

    Attributes:
        device: id of the device; empty for the only one.
    """

    name: ClassVar[str] = "haply"
    loss_notice: ClassVar[str] = (
        "The Inverse Service receives no further commands and may hold the last force: unplug the"
        " device."
    )

    device: str = ""
    _exchange: HaplyThread | None = field(default=None, init=False, repr=False)
    _previous_switch_interval: float = field(default=0.0, init=False, repr=False)

    @property
    def device_name(self) -> str:
        """Name of the device for its lock."""
        return self.device.lower()

    def check_library(self) -> None:
        """Connect to the service."""
        _connect().close()

    def open(self) -> ThreadedDevice:
        """Find the device, start the thread, and wait for the first state."""
        connection = _connect()
        try:
            chosen = _choose_device(_list_devices(connection), self.device)
            exchange = HaplyThread(connection, chosen, self.force_timeout)
        except BaseException:  # also for an interrupt
            connection.close()
            raise
        self._exchange = exchange
        self._previous_switch_interval = sys.getswitchinterval()
        sys.setswitchinterval(_SWITCH_INTERVAL)
        exchange.start()
        try:
            threaded.wait_for_position(exchange.buffer.ring, lambda: exchange.reason)
        except ParameterError:
            self.close()
            raise
        return self.device_record(exchange.buffer.ring, exchange.wakeup)

    def close(self) -> None:
        """Send no force to the service, and end the thread."""
        if self._exchange is not None:
            self._exchange.stop(threaded.OPEN_TIMEOUT)
            sys.setswitchinterval(self._previous_switch_interval)

    def release_lost_device(self) -> None:
        """Send zero force to the service through another connection."""
        connection = _connect()
        try:
            device = _choose_device(_list_devices(connection), self.device)
            connection.send(force_message(device, _ZERO_FORCE))
        finally:
            connection.close()

    def describe_error(self, code: int) -> str:
        """Return what failed in the thread."""
        parts = []
        if code in {STALE, LOOP_SILENT}:
            parts.append(super().describe_error(code))
        if self._exchange is not None and self._exchange.reason:
            parts.append(self._exchange.reason)
        return ": ".join(parts)


def _connect() -> WebSocketClient:
    """Return a connection to the service.

    Raises:
        ParameterError: if the service does not answer, with a hint.
    """
    where = os.environ.get(SERVICE) or _DEFAULT_ADDRESS
    host, _colon, port = where.rpartition(":")
    if not host or not port.isdecimal():
        raise ParameterError(SERVICE, "must be host and port, localhost:10001", where)
    try:
        return WebSocketClient(host, int(port), threaded.OPEN_TIMEOUT)
    except ProtocolError as error:
        raise ParameterError("driver", f"finds no Inverse Service at {where}: {error}") from None
    except OSError as error:
        raise ParameterError(
            "driver",
            f"needs the Haply Inverse Service, which does not answer at {where} ({error}): install"
            f" and start the Haply Hub (docs.haply.co), or name host and port in {SERVICE}",
        ) from None


def _list_devices(connection: WebSocketClient) -> list[dict[str, Any]]:
    """Return the devices of the service, from its first message."""
    try:
        messages: Sequence[bytes] = ()
        while not messages:
            messages = connection.receive()
        return parse_states(messages[0])
    except OSError as error:
        words = f"is connected to the Inverse Service, which does not list its devices: {error}"
    except ValueError as error:
        words = f"needs an Inverse Service that speaks format 3.1 or newer; this one sent {error}"
    raise ParameterError("driver", words)


def _choose_device(devices: Sequence[dict[str, Any]], device_id: str) -> str:
    """Return the id of the requested device, or of the only one."""
    ids = [str(device["device_id"]) for device in devices]
    choices = ", ".join(f"haply:{known}" for known in ids)
    if not ids:
        raise ParameterError("driver", "finds no Inverse3: is it plugged in and switched on?")
    if not device_id and len(ids) > 1:
        raise ParameterError("driver", f"finds {len(ids)} devices: choose one, {choices}")
    for known in ids:
        if not device_id or known.lower() == device_id.lower():
            return known
    raise ParameterError("driver", f"finds no device {device_id}: choose one, {choices}")


KIND = DriverKind(
    "haply",
    (RIGHT, AWAY, UP),
    1.0,
    lambda text, frame: HaplyDriver(device=text, surface_frame=frame),
    "haply:049D",
)

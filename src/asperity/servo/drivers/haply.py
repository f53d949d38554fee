"""The Haply Inverse3, by the WebSocket of the Haply Inverse Service.

Metres and newtons; x to the right, y forward, z up. The service filters the force (oscillation
damper, force gate, damping, scale); results of asperity do not cover these filters.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

from asperity.core.errors import ParameterError
from asperity.servo.drivers.driver import AWAY, RIGHT, UP, DriverKind
from asperity.servo.drivers.haply_exchange import HaplyThread, parse_states
from asperity.servo.drivers.threaded import OPEN_TIMEOUT, ThreadedDriver, wait_for_position
from asperity.servo.drivers.websocket_client import ProtocolError, WebSocketClient
from asperity.servo.kernels.ring_buffer import LOOP_SILENT, STALE
from asperity.servo.kernels.threaded_device import ThreadedDevice

SERVICE = "ASPERITY_HAPLY"
"""Variable of the environment that may hold host and port of the service."""
_DEFAULT_ADDRESS = "localhost:10001"
_SWITCH_INTERVAL = 1e-4  # [s] after which Python switches to the exchange while it compiles


@dataclass
class HaplyDriver(ThreadedDriver):
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

    def open(self) -> ThreadedDevice:
        """Find the device, start the thread, and wait for the first state."""
        connection = _connect()
        try:
            chosen = _choose_device(_list_devices(connection), self.device)
            exchange = HaplyThread(connection, chosen, self.force_timeout)
        except BaseException:
            connection.close()
            raise
        self._exchange, self._previous_switch_interval = exchange, sys.getswitchinterval()
        sys.setswitchinterval(_SWITCH_INTERVAL)
        exchange.start()
        try:
            wait_for_position(exchange.buffer.ring, lambda: exchange.reason)
        except ParameterError:
            self.close()
            raise
        return self.device_record(exchange.buffer.ring, exchange.wakeup)

    def close(self) -> None:
        """Send no force to the service, and end the thread."""
        if self._exchange is not None:
            self._exchange.stop(OPEN_TIMEOUT)
            sys.setswitchinterval(self._previous_switch_interval)

    def describe_error(self, code: int) -> str:
        """Return what failed in the thread."""
        reason = self._exchange.reason if self._exchange else ""
        words = super().describe_error(code) if code in {STALE, LOOP_SILENT} else ""
        return ": ".join(filter(None, (words, reason)))


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
        return WebSocketClient(host, int(port), OPEN_TIMEOUT)
    except ProtocolError as error:
        raise ParameterError("driver", f"finds no Inverse Service at {where}: {error}") from None
    except OSError as error:
        words = (
            f"needs the Haply Inverse Service, which does not answer at {where} ({error}): install"
            f" and start the Haply Hub (docs.haply.co), or name host and port in {SERVICE}"
        )
        raise ParameterError("driver", words) from None


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
    "haply", (RIGHT, AWAY, UP), 1.0,
    lambda text, frame: HaplyDriver(device=text, surface_frame=frame), "haply:049D",
)  # fmt: skip

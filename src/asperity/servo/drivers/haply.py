"""The Haply Inverse3, by the WebSocket of the Haply Inverse Service.

Metres and newtons; x to the right, y forward, z up. The service filters the force (oscillation
damper, force gate, damping, scale), which no statement of asperity covers.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

from asperity.errors import ParameterError
from asperity.servo.drivers.driver import AWAY, RIGHT, UP, DriverKind
from asperity.servo.drivers.exchanged import OPENING, ExchangedDriver, new_slot, wait_for_a_place
from asperity.servo.drivers.haply_exchange import Exchange, states_of
from asperity.servo.drivers.websocket import ProtocolError, WebSocket
from asperity.servo.kernels.exchanged import ExchangedDevice
from asperity.servo.kernels.slot import SILENT, STALE

SERVICE = "ASPERITY_HAPLY"
"""Variable of the environment that may hold host and port of the service."""
_USUAL = "localhost:10001"
_SWITCH = 1e-4  # [s] after which Python lets the exchange run while it compiles a surface


@dataclass
class HaplyDriver(ExchangedDriver):
    """An Inverse3.

    Attributes:
        device: its id; empty for the only one.
    """

    name: ClassVar[str] = "haply"
    when_lost: ClassVar[str] = (
        "The Inverse Service then hears no more of it, and what it does with the force is its own"
        " affair: count on its holding the last one, and pull the plug."
    )

    device: str = ""
    _exchange: Exchange | None = field(default=None, init=False, repr=False)
    _switch: float = field(default=0.0, init=False, repr=False)

    def open(self) -> ExchangedDevice:
        """Find the device, start the thread, and wait for the first state."""
        line = _connected()
        try:
            chosen = _chosen(_inventory(line), self.device)
            exchange = Exchange(line, chosen, new_slot(self.patience))
        except BaseException:
            line.close()
            raise
        self._exchange, self._switch = exchange, sys.getswitchinterval()
        sys.setswitchinterval(_SWITCH)
        exchange.start()
        try:
            wait_for_a_place(exchange.slot, lambda: exchange.reason)
        except ParameterError:
            self.close()
            raise
        return self.record(exchange.slot, exchange.bell)

    def close(self) -> None:
        """Tell the service that there is no force, and end the thread."""
        if self._exchange is not None:
            self._exchange.end(OPENING)
            sys.setswitchinterval(self._switch)

    def explain(self, code: int) -> str:
        """Return what the thread found wrong."""
        said = self._exchange.reason if self._exchange else ""
        found = super().explain(code) if code in {STALE, SILENT} else ""
        return ": ".join(filter(None, (found, said)))


def _connected() -> WebSocket:
    """Return a connection to the service.

    Raises:
        ParameterError: if there is none, with what to do.
    """
    where = os.environ.get(SERVICE) or _USUAL
    host, _colon, port = where.rpartition(":")
    if not host or not port.isdecimal():
        raise ParameterError(SERVICE, "must be host and port, localhost:10001", where)
    try:
        return WebSocket(host, int(port), OPENING)
    except ProtocolError as error:
        raise ParameterError("driver", f"finds no Inverse Service at {where}: {error}") from None
    except OSError as error:
        words = (
            f"needs the Haply Inverse Service, which does not answer at {where} ({error}): install"
            f" and start the Haply Hub (docs.haply.co), or name host and port in {SERVICE}"
        )
        raise ParameterError("driver", words) from None


def _inventory(line: WebSocket) -> list[dict[str, Any]]:
    """Return the devices that the service has, which it says by itself."""
    try:
        messages: Sequence[bytes] = ()
        while not messages:
            messages = line.received()
        return states_of(messages[0])
    except OSError as error:
        words = f"is connected to the Inverse Service, which does not say its devices: {error}"
    except ValueError as error:
        words = f"needs an Inverse Service that speaks format 3.1 or newer; this one sent {error}"
    raise ParameterError("driver", words)


def _chosen(devices: Sequence[dict[str, Any]], wanted: str) -> str:
    """Return the id of the device that is meant."""
    ids = [str(device["device_id"]) for device in devices]
    choices = ", ".join(f"haply:{known}" for known in ids)
    if not ids:
        raise ParameterError("driver", "finds no Inverse3: is it plugged in and switched on?")
    if not wanted and len(ids) > 1:
        raise ParameterError("driver", f"finds {len(ids)} devices: choose one, {choices}")
    for known in ids:
        if not wanted or known.lower() == wanted.lower():
            return known
    raise ParameterError("driver", f"finds no device {wanted}: choose one, {choices}")


KIND = DriverKind(
    "haply", (RIGHT, AWAY, UP), 1.0,
    lambda text, frame: HaplyDriver(device=text, placed=frame), "haply:049D",
)  # fmt: skip

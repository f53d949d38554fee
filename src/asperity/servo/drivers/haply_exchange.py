"""The thread that talks to the Haply Inverse Service, beside the compiled loop.

It sends each force of the loop and pushes each position into the ring buffer. The service answers
every message with one state, so a state is as old as the message that it answers: a backlog
anywhere
makes states old, and the loop checks their age.
"""

from __future__ import annotations

import json
import os
import select
import threading
import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from asperity.servo.drivers.threaded import ThreadBuffer
from asperity.servo.drivers.websocket_client import WebSocketClient
from asperity.servo.kernels.ring_buffer import FORCE_TIMEOUT, LOOP_SILENT
from asperity.servo.realtime import PRIORITY

CONNECTION_LOST, INVALID_STATE, DEVICE_GONE = 3, 4, 5
"""Failures of the thread: no connection, no state in a message, no device."""
KEEP_ALIVE = 5e-3
"""Time without a new force after which the last one is sent again [s]: states keep coming."""
MAX_PENDING = 4
"""Largest number of messages without an answer."""
_ZERO_FORCE = (0.0, 0.0, 0.0)
Force = tuple[float, float, float]


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


def cursor_position(state: dict[str, Any]) -> Force:
    """Return the position of a device [m]; a missing coordinate is 0.

    Raises:
        ValueError: for a state without a position.
    """
    try:
        given = state["state"]["cursor_position"]
        x, y, z = (given.get(axis, 0.0) for axis in "xyz")
        if given and all(type(value) in {int, float} for value in (x, y, z)):
            return float(x), float(y), float(z)
    except (LookupError, TypeError, AttributeError, OverflowError):
        pass
    raise ValueError(f"a state without a position: {str(state)[:60]}")


class HaplyThread(threading.Thread):
    """The thread of a device; it ends with the connection, or by :meth:`stop`.

    Args:
        connection: connection to the service.
        device: id of the device.
        force_timeout: time after which a force that is not renewed is released [s].

    Attributes:
        buffer: buffer between this thread and the loop.
        wakeup: file that wakes this thread when a byte is written to it.
        reason: what failed, in words.
    """

    def __init__(self, connection: WebSocketClient, device: str, force_timeout: float) -> None:
        super().__init__(daemon=True)
        self.buffer, self.reason = ThreadBuffer(force_timeout), ""
        self._connection, self._device_id = connection, device
        self._wakeup_reader, self.wakeup = os.pipe()
        for end in (self._wakeup_reader, self.wakeup):
            os.set_blocking(end, False)
        self._pending: deque[int] = deque()
        self._last_force, self._last_force_time, self._stopping = _ZERO_FORCE, 0, False

    def run(self) -> None:
        """Exchange until a failure or :meth:`stop`; the last message is no force."""
        with suppress(OSError, AttributeError):  # not permitted, or not supported
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY - 1))
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
        with suppress(BlockingIOError):  # the pipe is full: it wakes the thread
            os.write(self.wakeup, b"\0")
        self.join(timeout)
        self._connection.close()
        os.close(self._wakeup_reader)
        os.close(self.wakeup)

    def _exchange(self) -> None:
        poller = select.poll()
        poller.register(self._connection, select.POLLIN)
        poller.register(self._wakeup_reader, select.POLLIN)
        self._send(_ZERO_FORCE)
        while not self._stopping and not self.reason:
            ready = [file for file, _event in poller.poll(1e3 * KEEP_ALIVE)]
            if self._wakeup_reader in ready:
                os.read(self._wakeup_reader, 1 << 16)
            if self._connection.fileno() in ready:
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
        x, y, z, given = self.buffer.latest_force()
        force = (x, y, z)
        timeout = self.buffer.ring.words[FORCE_TIMEOUT]
        if force != _ZERO_FORCE and time.monotonic_ns() - given > timeout:
            self._fail(LOOP_SILENT, "its force was released")
            return
        is_due = (resend or given != self._last_force_time) and len(self._pending) < MAX_PENDING
        if is_due or force == _ZERO_FORCE != self._last_force:
            self._last_force_time = given
            self._send(force)

    def _send(self, force: Force) -> None:
        x, y, z = force
        self._pending.append(time.monotonic_ns())
        commands = {"set_cursor_force": {"values": {"x": x, "y": y, "z": z}}}
        message = {"inverse3": [{"device_id": self._device_id, "commands": commands}]}
        self._connection.send(json.dumps(message))
        self._last_force = force

    def _fail(self, code: int, reason: str) -> None:
        self.reason = reason
        self.buffer.report_failure(code)

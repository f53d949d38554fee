"""The thread that talks to the Haply Inverse Service, beside the compiled loop.

It sends each force as the loop gives it and puts each place that comes back into the slot. The
service answers every message with one state, so a state is as old as the message that it answers:
what piles up anywhere on the way makes it old, and the loop judges its age.
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
from types import ModuleType
from typing import Any

from asperity.kernels.fuse import fuse_module
from asperity.servo.drivers.exchanged import new_slot
from asperity.servo.drivers.websocket import WebSocket
from asperity.servo.kernels import slot
from asperity.servo.kernels.slot import PATIENCE, SILENT, Slot
from asperity.servo.priority import PRIORITY

LOST, NO_STATE, GONE = 3, 4, 5
"""What the thread finds wrong: no connection, no state in a message, no device."""
KEEP_ALIVE = 5e-3
"""[s] without a force of the loop after which the last one is sent again: states keep coming."""
MOST_ASKED = 4
"""Messages that may wait for their answer."""
_NOTHING = (0.0, 0.0, 0.0)
Force = tuple[float, float, float]


def states_of(message: bytes) -> list[dict[str, Any]]:
    """Return what a message of the service says of its devices.

    Raises:
        ValueError: if that is not the service's format 3.1 or newer.
    """
    try:
        said = json.loads(message)
        devices = said.get("inverse3", [])
        ours = not said.keys().isdisjoint(("session_id", "inverse3"))
        if ours and all(isinstance(device["device_id"], str) for device in devices):
            return list(devices)
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        pass
    raise ValueError(f"a message of another format: {message[:60]!r}")


def place_of(state: dict[str, Any]) -> Force:
    """Return the position of a device [m]; a coordinate that is missing is 0.

    Raises:
        ValueError: if there is none.
    """
    try:
        given = state["state"]["cursor_position"]
        x, y, z = (given.get(axis, 0.0) for axis in "xyz")
        if given and all(type(value) in {int, float} for value in (x, y, z)):
            return float(x), float(y), float(z)
    except (LookupError, TypeError, AttributeError, OverflowError):
        pass
    raise ValueError(f"a state without a position: {str(state)[:60]}")


def _compiled_ends() -> ModuleType:
    """Return this thread's ends of a slot, compiled now: no message is to wait for it."""
    ends, spare = fuse_module(slot), new_slot()
    ends.deliver(*spare, 0.0, 0.0, 0.0, 0)
    ends.fetch(*spare)
    ends.give_up(spare.words, LOST)
    return ends


class Exchange(threading.Thread):
    """The thread; it ends when the connection does, or when it is told to.

    Args:
        line: to the service.
        device: its id.
        shared: the slot between this thread and the loop.

    Attributes:
        slot: between this thread and the loop.
        bell: the file that wakes this thread when a byte is written to it.
        reason: what is wrong, in words.
    """

    def __init__(self, line: WebSocket, device: str, shared: Slot) -> None:
        super().__init__(daemon=True)
        self.slot = shared
        self.reason = ""
        self._ends = _compiled_ends()
        self._line, self._device = line, device
        self._heard, self.bell = os.pipe()
        for end in (self._heard, self.bell):
            os.set_blocking(end, False)
        self._asked: deque[int] = deque()
        self._sent, self._told, self._ending = _NOTHING, 0, False

    def run(self) -> None:
        """Exchange until something ends it; the last word is no force, if anybody hears it."""
        with suppress(OSError, AttributeError):  # not allowed, or not of this system
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY - 1))
        try:
            self._serve()
        except OSError as error:
            self._fail(LOST, f"the connection to the Inverse Service is lost: {error}")
        except ValueError as error:
            self._fail(NO_STATE, f"the Inverse Service sent {error}")
        finally:
            with suppress(OSError):
                self._send(_NOTHING)

    def end(self, patience: float) -> None:
        """End it: the service is told that there is no force, and has time to answer [s]."""
        self._ending = True
        with suppress(BlockingIOError):  # it rings as it is
            os.write(self.bell, b"\0")
        self.join(patience)
        self._line.close()
        os.close(self._heard)
        os.close(self.bell)

    def _serve(self) -> None:
        poller = select.poll()
        poller.register(self._line, select.POLLIN)
        poller.register(self._heard, select.POLLIN)
        self._send(_NOTHING)
        while not self._ending and not self.reason:
            ready = [file for file, _event in poller.poll(1e3 * KEEP_ALIVE)]
            if self._heard in ready:
                os.read(self._heard, 1 << 16)
            if self._line.fileno() in ready:
                self._take(self._line.received())
            self._tell(again=not ready)

    def _take(self, messages: Sequence[bytes]) -> None:
        """Put what the messages say into the slot."""
        for message in messages:
            if not self._asked:
                raise ValueError("a state that nobody asked for")
            asked = self._asked.popleft()
            for state in states_of(message):
                if state["device_id"] == self._device:
                    self._ends.deliver(*self.slot, *place_of(state), asked)
                    break
            else:
                self._fail(GONE, f"the Inverse Service has no {self._device} any more: unplugged?")

    def _tell(self, *, again: bool) -> None:
        """Send the newest force, if there is a new one or the last is to be sent again."""
        x, y, z, given = self._ends.fetch(*self.slot)
        force = (x, y, z)
        if force != _NOTHING and time.monotonic_ns() - given > self.slot.words[PATIENCE]:
            self._fail(SILENT, "its force was taken away")
            return
        letting_go = force == _NOTHING != self._sent
        if letting_go or ((again or given != self._told) and len(self._asked) < MOST_ASKED):
            self._told = given
            self._send(force)

    def _send(self, force: Force) -> None:
        x, y, z = force
        self._asked.append(time.monotonic_ns())
        commands = {"set_cursor_force": {"values": {"x": x, "y": y, "z": z}}}
        message = {"inverse3": [{"device_id": self._device, "commands": commands}]}
        self._line.send(json.dumps(message))
        self._sent = force

    def _fail(self, code: int, words: str) -> None:
        self.reason = words
        self._ends.give_up(self.slot.words, code)

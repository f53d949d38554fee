"""A Haply Inverse Service that is none: one device or more, and failures as they are ordered."""

from __future__ import annotations

import base64
import hashlib
import json
import os
import socket
import struct
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, Self

Force = tuple[float, float, float]
_SECRET = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"

GARBAGE: dict[str, bytes] = {
    "no JSON": b"\x00\xffnonsense",
    "a list": b"[1, 2, 3]",
    "deep": b"[" * 5000,
    "no position": b'{"inverse3": [{"device_id": "049D", "state": {}}]}',
    "text": b'{"inverse3": [{"device_id": "049D", "state": {"cursor_position": {"x": "0"}}}]}',
    "truth": b'{"inverse3": [{"device_id": "049D", "state": {"cursor_position": {"x": true}}}]}',
    "no id": b'{"inverse3": [{"state": {"cursor_position": {"x": 0.0}}}]}',
    "unplugged": b'{"inverse3": []}',
    "too large": b'{"inverse3": [{"device_id": "049D", "state": {"cursor_position": {"x": 1'
    + 400 * b"0"
    + b"}}}]}",
}
"""Messages that are no state."""
BROKEN: dict[str, bytes] = {
    "masked": b"\x81\x82abcdef",
    "unknown kind": b"\x83\x00",
    "endless": b"\x81\x7f\x7f\xff\xff\xff\xff\xff\xff\xff",
}
"""Bytes that are no frame."""
FAULTS = (
    *GARBAGE,
    *BROKEN,
    "closed",
    "good-bye",
    "half a frame",
    "mute",
    "nan",
    "far",
    "twice",
    "reserved bits",
)


class FakeHaply:
    """A service on a port of its own; use it in a ``with``.

    Args:
        devices: ids of what is plugged in.
        fault: what goes wrong, one of ``FAULTS``; empty for nothing.
        at: number of the message with which it does.
        place: position at the k-th message [m].
        hello: what is said first, instead of the inventory.
        late: time that each answer takes [s].

    Attributes:
        forces: that came, with the times at which they did [ns].
    """

    def __init__(
        self,
        devices: Sequence[str] = ("049D",),
        fault: str = "",
        at: int = 0,
        place: Callable[[int], Force] = lambda _k: (0.7e-3, 0.4e-3, -1e-3),
        hello: bytes | None = None,
        late: float = 0.0,
    ) -> None:
        self.devices, self.fault, self.at, self.place = devices, fault, at, place
        self.hello, self.late, self.forces = hello, late, list[tuple[int, Force]]()
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listening.getsockname()[1]}"
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_error: object) -> None:
        with suppress(OSError):
            self._listening.shutdown(socket.SHUT_RDWR)
        self._listening.close()
        self._thread.join(5.0)

    def last_force(self, patience: float = 30.0) -> Force:
        """Return the last force, once it is zero or nothing more comes."""
        end = time.monotonic() + patience
        while time.monotonic() < end and self.forces[-1][1] != (0.0, 0.0, 0.0):
            time.sleep(1e-3)
        return self.forces[-1][1]

    def _serve(self) -> None:
        with suppress(OSError, AttributeError):  # not permitted, or not supported
            os.sched_setscheduler(threading.get_native_id(), os.SCHED_FIFO, os.sched_param(50))
        with suppress(OSError):
            while True:
                line, _who = self._listening.accept()
                with line, suppress(OSError, EOFError):
                    line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    self._talk(line)

    def _talk(self, line: socket.socket) -> None:
        stream = line.makefile("rb")
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += stream.readline()
        key = head.split(b"Sec-WebSocket-Key: ")[1].split(b"\r\n")[0]
        answer = base64.b64encode(hashlib.sha1(key + _SECRET).digest())
        upgrade = (
            b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        )
        line.sendall(upgrade + b"Sec-WebSocket-Accept: " + answer + b"\r\n\r\n")
        hello = {"session_id": 7, "inverse3": [self._state(one, 0) for one in self.devices]}
        line.sendall(frame(json.dumps(hello).encode() if self.hello is None else self.hello))
        number, silent = 0, False
        while (message := read_frame(stream)) is not None:
            (device,) = json.loads(message)["inverse3"]
            values = device["commands"]["set_cursor_force"]["values"]
            self.forces.append((time.monotonic_ns(), (values["x"], values["y"], values["z"])))
            lasts = self.fault in {"nan", "far", "mute"} and number > self.at
            fault = self.fault if number == self.at or lasts else ""
            silent = silent or fault in {"half a frame", "mute"}
            if fault == "closed":
                return
            time.sleep(self.late)
            line.sendall(self._answer(fault, number) if fault or not silent else b"")
            number += 1

    def _answer(self, fault: str, number: int) -> bytes:
        states = [self._state(device, number) for device in self.devices]
        whole = frame(json.dumps({"inverse3": states}).encode())
        if fault in GARBAGE:
            return frame(GARBAGE[fault])
        if fault in {"nan", "far"}:
            states[0]["state"]["cursor_position"]["z"] = float("nan") if fault == "nan" else 1e3
            return frame(json.dumps({"inverse3": states}).encode())
        others = {
            "good-bye": b"\x88\x02\x03\xe8",
            "half a frame": whole[:20],
            "mute": b"",
            "reserved bits": bytes((whole[0] | 0x40,)) + whole[1:],
        }
        return {**BROKEN, **others, "twice": 2 * whole}.get(fault, whole)

    def _state(self, device: str, number: int) -> dict[str, Any]:
        values = zip("xyz", self.place(number), strict=True)
        position = {axis: value for axis, value in values if value}  # what is 0 is left out
        return {"device_id": device, "config": {}, "state": {"cursor_position": position}}


def frame(content: bytes) -> bytes:
    """Return a text message as one frame of a server, or as two with a ping between them."""
    if len(content) < 126:
        return bytes((0x81, len(content))) + content
    return (
        b"\x01\x7d"
        + content[:125]
        + b"\x89\x02hi"
        + b"\x80\x7e"
        + struct.pack(">H", len(content) - 125)
        + content[125:]
    )


def read_frame(stream: Any) -> bytes | None:
    """Return the next text message of a client; nothing when it says good-bye."""
    while True:
        head = stream.read(2)
        if len(head) < 2 or head[0] & 0x0F == 0x8:
            return None
        length = head[1] & 0x7F
        if length == 126:
            (length,) = struct.unpack(">H", stream.read(2))
        mask, content = stream.read(4), stream.read(length)
        if head[0] & 0x0F == 0x1:
            return bytes(byte ^ mask[i % 4] for i, byte in enumerate(content))

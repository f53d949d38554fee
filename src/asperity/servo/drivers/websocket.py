"""The client's end of a WebSocket, for text messages, as far as a service on this machine asks.

Reference:
    RFC 6455, sections 4.1 (opening), 5.2 (frames), 5.4 (messages in pieces), 5.5 (control frames).
"""

from __future__ import annotations

import base64
import hashlib
import os
import socket
import time
from contextlib import suppress

LONGEST = 1 << 20
"""Bytes of a message: a state has a few hundred."""
GOOD_BYE = 0.5
"""[s] that the other side has to close."""
_SECRET = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"  # of the RFC, section 1.3
_MORE, _TEXT, _CLOSE, _PING, _PONG = 0x0, 0x1, 0x8, 0x9, 0xA
_LAST, _MASKED = 0x80, 0x80


class ProtocolError(ValueError):
    """The other side does not speak WebSocket, or what it says is no message."""


class WebSocket:
    """An open connection.

    Args:
        host: name or address.
        port: of the service.
        patience: that it may take to connect, and to take a message [s].

    Raises:
        OSError: if nobody answers.
        ProtocolError: if the answer is not that of a WebSocket.
    """

    def __init__(self, host: str, port: int, patience: float) -> None:
        self._line = socket.create_connection((host, port), timeout=patience)
        self._line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._came, self._pieces = bytearray(), bytearray()
        try:
            self._open(f"{host}:{port}")
        except BaseException:
            self._line.close()
            raise

    def fileno(self) -> int:
        """Return the file, for whoever waits for messages."""
        return self._line.fileno()

    def send(self, text: str) -> None:
        """Send a message.

        Raises:
            OSError: if the connection is lost, or takes nothing.
        """
        self._send(_TEXT, text.encode())

    def received(self) -> list[bytes]:
        """Return the messages that are whole; wait until something comes where none is.

        Raises:
            OSError: if the connection is lost or closed, or nothing comes.
            ProtocolError: if what has come is no WebSocket frame.
        """
        messages = self._whole()
        if not messages:
            self._read()
            messages = self._whole()
        return messages

    def _whole(self) -> list[bytes]:
        messages = []
        while (frame := self._frame()) is not None:
            kind, last, content = frame
            if kind == _CLOSE:
                raise ConnectionError("the service closed the connection")
            if kind == _PING:
                self._send(_PONG, content)
            elif kind != _PONG:
                self._pieces += content
                if last:
                    messages.append(bytes(self._pieces))
                    self._pieces.clear()
        return messages

    def close(self) -> None:
        """Say good-bye, hear the other side out, and close.

        A connection that is closed with answers on their way is reset, and what was sent last may
        be lost: it is the force of zero.
        """
        end = time.monotonic() + GOOD_BYE
        with suppress(OSError):
            self._send(_CLOSE, b"\x03\xe8")  # 1000: done
            self._line.shutdown(socket.SHUT_WR)
            self._line.settimeout(GOOD_BYE)
            while time.monotonic() < end and self._line.recv(1 << 16):
                pass
        self._line.close()

    def _open(self, host: str) -> None:
        key = base64.b64encode(os.urandom(16))
        lines = (
            "GET / HTTP/1.1", f"Host: {host}", "Upgrade: websocket", "Connection: Upgrade",
            f"Sec-WebSocket-Key: {key.decode()}", "Sec-WebSocket-Version: 13", "", "",
        )  # fmt: skip
        self._line.sendall("\r\n".join(lines).encode())
        while b"\r\n\r\n" not in self._came:
            self._read()
        head, _end, rest = bytes(self._came).partition(b"\r\n\r\n")
        self._came = bytearray(rest)
        wanted = base64.b64encode(hashlib.sha1(key + _SECRET, usedforsecurity=False).digest())
        status = head.split(b"\r\n", 1)[0].split(b" ")
        if b"101" not in status[1:2] or wanted not in head:
            raise ProtocolError(f"the answer is not a WebSocket's: {head[:60]!r}")

    def _read(self) -> None:
        """Add what has come."""
        came = self._line.recv(1 << 16)
        if not came:
            raise ConnectionError("the service closed the connection")
        self._came += came
        if len(self._came) + len(self._pieces) > LONGEST:
            raise ProtocolError(f"a message is longer than {LONGEST} bytes")

    def _frame(self) -> tuple[int, bool, bytes] | None:
        """Return the next frame, its kind and whether it ends a message; nothing if it is cut."""
        came = self._came
        if len(came) < 2:
            return None
        kind, length, start = came[0] & 0x0F, came[1] & 0x7F, 2
        wider = {126: 2, 127: 8}.get(length, 0)
        if wider:
            start += wider
            length = int.from_bytes(came[2:start]) if len(came) >= start else 0
        if came[0] & 0x70 or came[1] & _MASKED or kind not in {_MORE, _TEXT, _CLOSE, _PING, _PONG}:
            raise ProtocolError(f"a frame begins with {bytes(came[:2])!r}")
        if length > LONGEST:
            raise ProtocolError(f"a message is longer than {LONGEST} bytes")
        if len(came) < start + length:
            return None
        last, content = bool(came[0] & _LAST), bytes(came[start : start + length])
        del came[: start + length]
        return kind, last, content

    def _send(self, kind: int, content: bytes) -> None:
        size = len(content)
        longer = size.to_bytes(2) if size > 125 else b""
        head = bytes((_LAST | kind, _MASKED | (126 if longer else size))) + longer
        mask = os.urandom(4)
        key = (mask * (size // 4 + 1))[:size]
        masked = (int.from_bytes(content) ^ int.from_bytes(key)).to_bytes(size)
        self._line.sendall(head + mask + masked)

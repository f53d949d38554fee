"""A WebSocket connection whose socket a thread can poll together with other files."""

from __future__ import annotations

import socket
import time
from contextlib import suppress

MAX_MESSAGE_BYTES = 1 << 20
"""Largest size of a message [bytes]: a state has a few hundred."""
CLOSE_TIMEOUT = 0.5
"""Time for the other side to close [s]."""


class ProtocolError(ValueError):
    """The other side does not speak WebSocket, or sends invalid frames."""


class WebSocketClient:
    """An open connection.

    Args:
        host: name or address.
        port: port of the service.
        timeout: time to connect, and to send a message [s].

    Raises:
        OSError: if nobody answers.
        ProtocolError: if the answer is not that of a WebSocket.
    """

    def __init__(self, host: str, port: int, timeout: float) -> None:
        from websockets.client import ClientProtocol
        from websockets.uri import parse_uri

        self._socket = socket.create_connection((host, port), timeout=timeout)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        address = parse_uri(f"ws://{host}:{port}/")
        self._protocol = ClientProtocol(address, max_size=MAX_MESSAGE_BYTES)
        self._messages: list[bytes] = []
        self._fragments = bytearray()
        self._has_answered = False
        try:
            self._protocol.send_request(self._protocol.connect())
            self._flush()
            while self._protocol.state.name == "CONNECTING":
                self._read()
        except BaseException:  # also for an interrupt
            self._socket.close()
            raise

    def fileno(self) -> int:
        """Return the file descriptor, for a poll."""
        return self._socket.fileno()

    def send(self, text: str) -> None:
        """Send a message, also after a failure: it may be the force of zero.

        Raises:
            OSError: if the connection is lost, or the other side does not take it.
        """
        from websockets.frames import Frame, Opcode

        self._socket.sendall(Frame(Opcode.TEXT, text.encode()).serialize(mask=True))

    def receive(self) -> list[bytes]:
        """Return the complete messages; wait for data if there is none.

        Raises:
            OSError: if the connection is lost or closed, or nothing comes.
            ProtocolError: for an invalid frame.
        """
        if not self._messages:
            self._read()
        messages = self._messages
        self._messages = []
        return messages

    def close(self) -> None:
        """Close the connection, and wait for the other side.

        A connection that is closed with answers under way is reset, and the last message, the
        force of zero, might be lost.
        """
        end = time.monotonic() + CLOSE_TIMEOUT
        with suppress(OSError):
            if self._protocol.state.name == "OPEN":
                self._protocol.send_close(1000)
            self._flush()
            self._socket.shutdown(socket.SHUT_WR)
            self._socket.settimeout(CLOSE_TIMEOUT)
            while time.monotonic() < end and self._socket.recv(1 << 16):
                pass
        self._socket.close()

    def _flush(self) -> None:
        for data in self._protocol.data_to_send():
            if data:
                self._socket.sendall(data)

    def _read(self) -> None:
        """Process the data that arrives next."""
        from websockets.frames import Frame, Opcode

        data = self._socket.recv(1 << 16)
        self._has_answered = self._has_answered or bool(data)
        if data:
            self._protocol.receive_data(data)
        else:
            self._protocol.receive_eof()
        events = self._protocol.events_received()
        if self._protocol.handshake_exc is not None and self._has_answered:
            raise ProtocolError(f"the answer is not a WebSocket's: {self._protocol.handshake_exc}")
        if not data:
            raise ConnectionError("the service closed the connection")
        if self._protocol.parser_exc is not None:
            raise ProtocolError(f"an invalid frame: {self._protocol.parser_exc}")
        for event in events:
            if not isinstance(event, Frame):  # the answer of the handshake
                continue
            if event.opcode is Opcode.CLOSE:
                raise ConnectionError("the service closed the connection")
            if event.opcode in {Opcode.TEXT, Opcode.BINARY, Opcode.CONT}:
                self._fragments += event.data
                if event.fin:
                    self._messages.append(bytes(self._fragments))
                    self._fragments.clear()
        self._flush()

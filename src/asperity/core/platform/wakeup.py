"""A pair of sockets by which compiled code wakes a thread that waits for files."""

from __future__ import annotations

import socket
from contextlib import suppress

from asperity.core.platform.system import function_address, system_library


class Wakeup:
    """Wakes a thread.

    Attributes:
        reader: becomes readable for the thread.
        address: address of ``int send(socket, data, size, flags)`` of the system.
    """

    def __init__(self) -> None:
        self.reader, self._writer = socket.socketpair()
        for end in (self.reader, self._writer):
            end.setblocking(False)
        self.address = function_address(system_library("ws2_32").send)

    @property
    def number(self) -> int:
        """Number of the socket that compiled code sends a byte to."""
        return self._writer.fileno()

    def wake(self) -> None:
        """Wake the thread, from Python."""
        with suppress(BlockingIOError):  # it is full, and wakes the thread
            self._writer.send(b"\0")

    def clear(self) -> None:
        """Read what has been sent."""
        self.reader.recv(1 << 16)

    def close(self) -> None:
        """Close both sockets."""
        self.reader.close()
        self._writer.close()

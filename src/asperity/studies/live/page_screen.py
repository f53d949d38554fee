"""The page of a session, served on this machine only, as that of the lab."""

from __future__ import annotations

import asyncio
import json
import socket
import threading
from contextlib import suppress
from dataclasses import asdict
from queue import Empty, Queue
from typing import Self

from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

from asperity.lab.access import MAX_MESSAGE_BYTES, AccessToken, respond
from asperity.studies.live.screens import PAUSE, STOP, View

PACKAGE = "asperity.studies.live"
"""Package of the page."""
_PING = 2.0  # a page that does not answer for this time is gone [s]


class PageScreen:
    """A screen in a page, served by threads; use it in a ``with``.

    If the last page is closed or does not answer, the session pauses.

    Args:
        listener: the bound socket, see :func:`asperity.lab.launch.bind_socket`.
        masking_noise: whether the page plays noise.

    Attributes:
        url: address of the page.
    """

    def __init__(self, listener: socket.socket, *, masking_noise: bool = False) -> None:
        token = AccessToken(listener.getsockname()[1])
        self.url, self._masking_noise, self._lock = token.url, masking_noise, threading.Lock()
        self._keys, self._pages = Queue[str](), set[ServerConnection]()
        self._view = View("One moment", "The study is being prepared.")
        self._server = serve(
            self._serve_page, sock=listener, max_size=MAX_MESSAGE_BYTES, compression=None,
            ping_interval=_PING, ping_timeout=_PING,
            process_request=lambda _page, request: asyncio.run(
                respond(token, request, package=PACKAGE)
            ),
        )  # fmt: skip

    def __enter__(self) -> Self:
        threading.Thread(target=self._server.serve_forever, name="study page", daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        for page in tuple(self._pages):
            page.close()
        self._server.shutdown()

    def show(self, view: View) -> None:
        """Show a view in place of the one before; earlier keys do not count, but pause and stop."""
        self._view = view
        earlier = [self._keys.get_nowait() for _ in range(self._keys.qsize())]
        for key in {PAUSE, STOP}.intersection(earlier):
            self._keys.put(key)
        for page in tuple(self._pages):
            self._send_view(page)

    def read_key(self, timeout: float) -> str | None:
        """Return the next pressed key; ``None`` if there is none in a time [s]."""
        with suppress(Empty):
            return self._keys.get(timeout=timeout)
        return None

    def _serve_page(self, page: ServerConnection) -> None:
        """Serve a page until it disconnects."""
        self._pages.add(page)
        self._send_view(page)
        with suppress(ConnectionClosed):
            for key in page:
                self._keys.put(str(key))
        self._pages.discard(page)
        if not self._pages:
            self._keys.put(PAUSE)

    def _send_view(self, page: ServerConnection) -> None:
        # The lock makes the newest view the last one that a page receives.
        with self._lock, suppress(ConnectionClosed):
            page.send(json.dumps({**asdict(self._view), "noise": self._masking_noise}))

"""The page of a session, served on this machine only, as that of the lab."""

from __future__ import annotations

import asyncio
import json
import queue
import socket
import threading
from contextlib import suppress
from dataclasses import asdict
from functools import cache
from importlib.resources import files
from typing import Self

from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from asperity.lab.access import MAX_MESSAGE_BYTES, AccessToken, RateLimit, respond
from asperity.studies.live.screens import PAUSE, STOP, View

PAGE_FILE = "study.html"
"""Name of the page, below the access token."""
_PING = 2.0  # a page that does not answer for this time is gone [s]
_MAX_KEY = 16  # characters of a key's name
_CONTENT_TYPES = {"html": "text/html", "js": "text/javascript", "css": "text/css"}


@cache
def study_files() -> dict[str, tuple[str, bytes]]:
    """Return type and content of each file of the page, by name."""
    entries = files("asperity.studies.live").joinpath("page").iterdir()
    kinds = {entry: _CONTENT_TYPES.get(entry.name.rpartition(".")[2]) for entry in entries}
    return {
        entry.name: (f"{kind}; charset=utf-8", entry.read_bytes())
        for entry, kind in kinds.items()
        if kind is not None
    }


async def _fetch(name: str) -> tuple[str, bytes] | None:
    return study_files().get(name)


class PageScreen:
    """A screen in a page, served by a thread of its own; use it in a ``with``.

    If the last page is closed or does not answer, the session pauses.

    Args:
        listener: the bound socket, see :func:`asperity.lab.launch.bind_socket`.
        masking_noise: whether the page plays noise.

    Attributes:
        url: address of the page.
    """

    def __init__(self, listener: socket.socket, *, masking_noise: bool = False) -> None:
        self._listener, self._masking_noise = listener, masking_noise
        self._token = AccessToken(listener.getsockname()[1])
        self.url = f"{self._token.url}{PAGE_FILE}"
        self._keys: queue.Queue[str] = queue.Queue()
        self._pages: set[ServerConnection] = set()
        self._view = View("One moment", "The study is being prepared.")
        self._events = asyncio.new_event_loop()
        self._stopped, self._is_served = asyncio.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="study page", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        self._is_served.wait()
        return self

    def __exit__(self, *_: object) -> None:
        self._events.call_soon_threadsafe(self._stopped.set)
        self._thread.join()

    def show(self, view: View) -> None:
        """Show a view in place of the one before; earlier keys do not count, but pause and stop."""
        self._view = view
        earlier = [self._keys.get_nowait() for _ in range(self._keys.qsize())]
        for key in {PAUSE, STOP}.intersection(earlier):
            self._keys.put(key)
        asyncio.run_coroutine_threadsafe(self._broadcast(), self._events).result()

    def read_key(self, timeout: float) -> str | None:
        """Return the next pressed key; ``None`` if there is none in a time [s]."""
        try:
            return self._keys.get(timeout=timeout)
        except queue.Empty:
            return None

    def _run(self) -> None:
        with suppress(RuntimeError):
            self._events.run_until_complete(self._serve())
        self._events.close()

    async def _serve(self) -> None:
        async with serve(
            self._serve_page, sock=self._listener, max_size=MAX_MESSAGE_BYTES, compression=None,
            ping_interval=_PING, ping_timeout=_PING,
            process_request=lambda _line, request: respond(self._token, request, _fetch),
        ):  # fmt: skip
            self._is_served.set()
            await self._stopped.wait()

    async def _serve_page(self, connection: ServerConnection) -> None:
        """Serve a page until it disconnects."""
        rate = RateLimit()
        self._pages.add(connection)
        try:
            await connection.send(self._message())
            async for content in connection:
                rate.consume()
                self._keys.put(str(content)[:_MAX_KEY])
        except ConnectionClosed:
            pass
        finally:
            self._pages.discard(connection)
            if not self._pages:
                self._keys.put(PAUSE)

    def _message(self) -> str:
        return json.dumps({**asdict(self._view), "noise": self._masking_noise})

    async def _broadcast(self) -> None:
        for page in tuple(self._pages):
            with suppress(ConnectionClosed):
                await page.send(self._message())

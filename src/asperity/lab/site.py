"""The files of the page, and the answer to a request for one."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import cache
from http import HTTPStatus
from importlib.resources import files

from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from asperity.lab.access import POLICY, Door

Fetch = Callable[[str], Awaitable[tuple[str, bytes] | None]]
LIVE = "live"
"""Name of the live connection, below the token."""
_TYPES = {"html": "text/html", "js": "text/javascript", "css": "text/css"}


@cache
def page_files() -> dict[str, tuple[str, bytes]]:
    """Return type and content of each file of the page, by name; "" is the page itself."""
    found = {}
    for entry in files("asperity.lab").joinpath("page").iterdir():
        kind = _TYPES.get(entry.name.rpartition(".")[2])
        if kind is not None:
            found[entry.name] = f"{kind}; charset=utf-8", entry.read_bytes()
    return {**found, "": found["index.html"]}


async def answer(door: Door, request: Request, fetch: Fetch) -> Response | None:
    """Return the answer to a request; ``None`` to let a live connection through.

    Args:
        door: who is let in.
        request: what is asked for.
        fetch: returns type and content of a file besides those of the page, by its name.
    """
    name = door.asked(request.path, request.headers.get_all("Host"))
    if name is None:
        return _said(HTTPStatus.FORBIDDEN, "This is not the address that asperity lab has printed.")
    if name == LIVE:
        if door.is_ours(request.headers.get_all("Origin")):
            return None
        return _said(HTTPStatus.FORBIDDEN, "Another page asks for the lab.")
    found = page_files().get(name) or await fetch(name)
    if found is None:
        return _said(HTTPStatus.NOT_FOUND, "The lab has no such page.")
    return _response(HTTPStatus.OK, *found)


def _said(status: HTTPStatus, words: str) -> Response:
    return _response(status, "text/plain; charset=utf-8", f"{words}\n".encode())


def _response(status: HTTPStatus, kind: str, content: bytes) -> Response:
    headers = {
        "Content-Type": kind, "Content-Length": str(len(content)), "Cache-Control": "no-store",
        "Content-Security-Policy": POLICY, "Referrer-Policy": "no-referrer",
        "X-Content-Type-Options": "nosniff", "Connection": "close",
        # The page shares memory with its thread, which no page of others may reach.
        "Cross-Origin-Opener-Policy": "same-origin", "Cross-Origin-Embedder-Policy": "require-corp",
    }  # fmt: skip
    return Response(status.value, status.phrase, Headers(headers), content)

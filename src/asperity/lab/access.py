"""Access to the page: socket, token, allowed hosts and origins, rate limit, and HTTP responses."""

from __future__ import annotations

import secrets
import socket
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from http import HTTPStatus
from importlib.resources import files

from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from asperity.core.errors import AsperityError, ParameterError

MAX_MESSAGE_BYTES = 4096
"""Greatest size of a message from the page."""
MAX_MESSAGE_RATE = 500.0
MAX_MESSAGE_BURST = 1000.0
"""Messages per second that a page may send, and in a burst."""


LOOPBACK_ADDRESS = "127.0.0.1"
DEFAULT_PORT = 8137
"""Port of the lab, if it is free."""
PORT_COUNT = 65_536
_PORT_ATTEMPTS = 50  # consecutive ports that are tried


def bind_socket(port: int | None) -> socket.socket:
    """Return a socket that listens on the loopback interface.

    Args:
        port: the port, 0 for any; ``None`` for the first free one from ``DEFAULT_PORT``.

    Raises:
        ParameterError: for an invalid port, or one that is not free; the next free one is named.
    """
    wanted = DEFAULT_PORT if port is None else port
    if not 0 <= wanted < PORT_COUNT:
        raise ParameterError("port", f"must be 0 (any free port) to {PORT_COUNT - 1}", wanted)
    for number in range(wanted, min(wanted + _PORT_ATTEMPTS, PORT_COUNT)):
        try:
            bound = socket.create_server((LOOPBACK_ADDRESS, number))
        except OSError:
            continue
        if port is not None and number != wanted:
            bound.close()
            raise ParameterError("port", f"{wanted} is not available; {number} is free")
        return bound
    raise ParameterError("port", "is not available, nor are the next ones", wanted)


# Nothing is loaded from elsewhere and nothing is sent there.
CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self'; worker-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)


class MalformedMessageError(AsperityError):
    """A message that the page never sends: the connection is closed, the loop continues."""


@dataclass(frozen=True)
class AccessToken:
    """Secret path and port that authorize a request.

    Attributes:
        port: of the server.
        secret: first part of every path.
    """

    port: int
    secret: str = field(default_factory=lambda: secrets.token_urlsafe(16))

    @property
    def host_names(self) -> tuple[str, ...]:
        """Names of the server on this machine."""
        return f"127.0.0.1:{self.port}", f"localhost:{self.port}"

    @property
    def url(self) -> str:
        """Address for the browser."""
        return f"http://{self.host_names[0]}/{self.secret}/"

    def authorize(self, path: str, hosts: Sequence[str]) -> str | None:
        """Return the name of the requested file; ``None`` for an unauthorized request.

        Args:
            path: of the request.
            hosts: its headers "Host": exactly one, and one of the server's names. A foreign name
                that resolves to this machine (DNS rebinding) is rejected.
        """
        if len(hosts) != 1 or hosts[0] not in self.host_names:
            return None
        token, slash, name = path.partition("?")[0].removeprefix("/").partition("/")
        same = secrets.compare_digest(token.encode(), self.secret.encode())
        return name if same and slash else None

    def is_same_origin(self, origins: Sequence[str]) -> bool:
        """Whether a live connection is requested by the page of this server."""
        return len(origins) == 1 and origins[0] in {f"http://{host}" for host in self.host_names}


class RateLimit:
    """Token bucket for the messages of a connection.

    Args:
        now: time [s]; by default that of the monotonic clock.
    """

    def __init__(self, now: float | None = None) -> None:
        self._tokens = MAX_MESSAGE_BURST
        self._last_time = time.monotonic() if now is None else now

    def consume(self, now: float | None = None) -> None:
        """Count a message.

        Raises:
            MalformedMessageError: if there are too many.
        """
        moment = time.monotonic() if now is None else now
        refilled = self._tokens + MAX_MESSAGE_RATE * (moment - self._last_time)
        self._tokens = min(MAX_MESSAGE_BURST, refilled) - 1.0
        self._last_time = moment
        if self._tokens < 0.0:
            raise MalformedMessageError(f"more than {MAX_MESSAGE_RATE:g} messages per second")


LIVE_PATH = "live"
"""Name of the live connection, below the token."""
_CONTENT_TYPES = {"html": "text/html", "js": "text/javascript", "css": "text/css"}


@cache
def page_files(package: str = "asperity.lab") -> dict[str, tuple[str, bytes]]:
    """Return type and content of each file of a package's page, by name; "" is the page itself."""
    pages = {}
    for entry in files(package).joinpath("page").iterdir():
        kind = _CONTENT_TYPES.get(entry.name.rpartition(".")[2])
        if kind is not None:
            pages[entry.name] = f"{kind}; charset=utf-8", entry.read_bytes()
    return {**pages, "": pages["index.html"]}


def respond(
    access_token: AccessToken, request: Request, package: str = "asperity.lab"
) -> Response | None:
    """Return the response to a request; ``None`` to accept a live connection.

    Args:
        access_token: authorizes the request.
        request: the request.
        package: of the page.
    """
    name = access_token.authorize(request.path, request.headers.get_all("Host"))
    if name is None:
        return _text_response(HTTPStatus.FORBIDDEN, "Open the address that the lab prints.")
    if name == LIVE_PATH:
        if access_token.is_same_origin(request.headers.get_all("Origin")):
            return None
        return _text_response(HTTPStatus.FORBIDDEN, "The request comes from another page.")
    file = page_files(package).get(name)
    if file is None:
        return _text_response(HTTPStatus.NOT_FOUND, "No such file.")
    return _response(HTTPStatus.OK, *file)


def _text_response(status: HTTPStatus, text: str) -> Response:
    return _response(status, "text/plain; charset=utf-8", f"{text}\n".encode())


def _response(status: HTTPStatus, content_type: str, content: bytes) -> Response:
    headers = {
        "Content-Type": content_type,
        "Content-Length": str(len(content)),
        "Cache-Control": "no-store",
        "Content-Security-Policy": CONTENT_SECURITY_POLICY,
        "Referrer-Policy": "no-referrer",
        "X-Content-Type-Options": "nosniff",
        "Connection": "close",
        # The page shares memory with its worker, which requires isolation from other pages.
        "Cross-Origin-Opener-Policy": "same-origin",
        "Cross-Origin-Embedder-Policy": "require-corp",
    }
    return Response(status.value, status.phrase, Headers(headers), content)

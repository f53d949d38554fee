"""Who may see the page and steer: local users who were given the address, and one at a time."""

from __future__ import annotations

import secrets
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

from asperity.errors import AsperityError

MOST_BYTES = 4096
"""Of a message from the page."""
PER_SECOND, AT_ONCE = 500.0, 1000.0
"""Messages that a page may send, lastingly and at once."""

# Nothing comes from elsewhere and nothing goes there.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self'; worker-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)


class MalformedError(AsperityError):
    """A message that no page of ours sends: the connection is closed, the loop goes on."""


@dataclass(frozen=True)
class Door:
    """What a request must know to be let in.

    Attributes:
        port: of the server.
        token: first part of every path.
    """

    port: int
    token: str = field(default_factory=lambda: secrets.token_urlsafe(16))

    @property
    def hosts(self) -> tuple[str, ...]:
        """What the server is called by those who sit at this machine."""
        return f"127.0.0.1:{self.port}", f"localhost:{self.port}"

    @property
    def address(self) -> str:
        """What is opened in the browser."""
        return f"http://{self.hosts[0]}/{self.token}/"

    def asked(self, path: str, hosts: Sequence[str]) -> str | None:
        """Return the name that a request asks for; ``None`` for one that is not let in.

        Args:
            path: of the request.
            hosts: its headers "Host": exactly one, and one of ours. A page of another name that
                was made to point to this machine says that name here.
        """
        if len(hosts) != 1 or hosts[0] not in self.hosts:
            return None
        token, slash, name = path.partition("?")[0].removeprefix("/").partition("/")
        same = secrets.compare_digest(token.encode(), self.token.encode())
        return name if same and slash else None

    def is_ours(self, origins: Sequence[str]) -> bool:
        """Whether a live connection was asked for by a page of ours."""
        return len(origins) == 1 and origins[0] in {f"http://{host}" for host in self.hosts}


class Pace:
    """Counts the messages of a connection.

    Args:
        now: returns the time [s].
    """

    def __init__(self, now: float | None = None) -> None:
        self._left, self._then = AT_ONCE, time.monotonic() if now is None else now

    def count(self, now: float | None = None) -> None:
        """Count one.

        Raises:
            MalformedError: if there are too many.
        """
        moment = time.monotonic() if now is None else now
        self._left = min(AT_ONCE, self._left + PER_SECOND * (moment - self._then)) - 1.0
        self._then = moment
        if self._left < 0.0:
            raise MalformedError(f"more than {PER_SECOND:g} messages per second")

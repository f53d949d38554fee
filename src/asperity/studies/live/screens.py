"""What a participant sees and presses: in the terminal, or in a page on this machine alone."""

from __future__ import annotations

import json
import sys
import threading
from contextlib import ExitStack, suppress
from dataclasses import asdict, dataclass
from queue import Empty, Queue
from typing import Self

import click
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

from asperity.core.errors import ParameterError
from asperity.core.platform.console import open_keyboard
from asperity.lab.access import MAX_MESSAGE_BYTES, AccessToken, bind_socket, respond

# Keys, as browsers name them.
GO_ON = "Enter"
PAUSE = "p"
STOP = "Escape"
BACK = "Backspace"
UP = "ArrowUp"
DOWN = "ArrowDown"
PAGE_PACKAGE = "asperity.studies.live"
_SEQUENCES = {
    b"\n": GO_ON,
    b" ": GO_ON,
    b"\x1b": STOP,
    b"\x7f": BACK,
    b"\x1b[A": UP,
    b"\x1b[B": DOWN,
}


@dataclass(frozen=True)
class View:
    """What a screen shows; no number of a stimulus is among it.

    Attributes:
        title: a line in large letters.
        text: further lines.
        keys: keys that have an effect, with what they do.
        typed: digits of an answer.
        is_last: whether the session ends with it.
    """

    title: str
    text: str = ""
    keys: tuple[tuple[str, str], ...] = ()
    typed: str = ""
    is_last: bool = False


class Terminal(ExitStack):
    """The terminal of the command, whose keys arrive at once; use it in a ``with``.

    Attributes:
        url: empty, since there is no page.

    Raises:
        ParameterError: without a terminal.
    """

    url = ""

    def __init__(self) -> None:
        super().__init__()
        if not sys.stdin.isatty():
            raise ParameterError("terminal", "is needed: run the command in one")
        self._press = self.enter_context(open_keyboard())

    def show(self, view: View) -> None:
        """Print a view."""
        keys = (f"  [{key}] {label}" for key, label in view.keys)
        text = click.wrap_text(view.text, 60, preserve_paragraphs=True)
        lines = ("", view.title.upper(), text, *keys, view.typed)
        click.echo("\n".join(lines).rstrip(), err=True)

    def read_key(self, timeout: float) -> str | None:
        """Return the next pressed key.

        Raises:
            ParameterError: if the terminal is lost.
        """
        pressed = self._press(timeout)
        if pressed is None:
            return None
        if not pressed:
            raise ParameterError(
                "terminal", "is closed: {resume} goes on where it stopped", resume=True
            )
        return _SEQUENCES.get(pressed, pressed.decode("ascii", "replace").lower())


class PageScreen:
    """A screen in a page, served by threads; use it in a ``with``.

    If the last page is closed or does not answer, the session pauses.

    Args:
        masking_noise: whether the page plays noise.

    Attributes:
        url: address of the page.
    """

    def __init__(self, *, masking_noise: bool = False) -> None:
        listener = bind_socket(None)
        token = AccessToken(listener.getsockname()[1])
        self.url = token.url
        self._masking_noise = masking_noise
        self._lock = threading.Lock()
        self._keys = Queue[str]()
        self._pages = set[ServerConnection]()
        self._view = View("One moment", "The study is being prepared.")
        # A page that does not answer for two seconds is gone.
        self._server = serve(
            self._serve_page,
            sock=listener,
            max_size=MAX_MESSAGE_BYTES,
            compression=None,
            ping_interval=2.0,
            ping_timeout=2.0,
            process_request=lambda _page, request: respond(token, request, PAGE_PACKAGE),
        )

    def __enter__(self) -> Self:
        threading.Thread(target=self._server.serve_forever, name="study page", daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        for page in tuple(self._pages):
            page.close()
        self._server.shutdown()

    def show(self, view: View) -> None:
        """Show a view in place of the one before."""
        self._view = view
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


Screen = Terminal | PageScreen  # with a keyboard; a pedal is a keyboard with one key

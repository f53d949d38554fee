"""What a participant sees and presses: in the terminal, or in a page (:mod:`.page_screen`)."""

from __future__ import annotations

import os
import select
import sys
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

import click

from asperity.core.errors import ParameterError

GO_ON, PAUSE, STOP, BACK, UP, DOWN = "Enter", "p", "Escape", "Backspace", "ArrowUp", "ArrowDown"
"""Names of keys, as browsers call them."""
_WIDTH = 60
_SEQUENCES = {
    b"\n": GO_ON, b"\r": GO_ON, b" ": GO_ON, b"\x1b": STOP, b"\x7f": BACK, b"\x08": BACK,
    b"\x1b[A": UP, b"\x1b[B": DOWN, b"\x1bOA": UP, b"\x1bOB": DOWN,
}  # fmt: skip


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


class Screen(Protocol):
    """A screen with a keyboard; a pedal is a keyboard with one key."""

    def show(self, view: View) -> None:
        """Show a view in place of the one before."""

    def read_key(self, timeout: float) -> str | None:
        """Return the next pressed key; ``None`` if there is none in a time [s]."""


class Terminal:
    """The terminal of the command; see :func:`open_terminal`."""

    def show(self, view: View) -> None:
        """Print a view."""
        keys = (f"  [{key}] {label}" for key, label in view.keys)
        lines = ("", view.title.upper(), *textwrap.wrap(view.text, _WIDTH), *keys, view.typed)
        click.echo("\n".join(lines).rstrip(), err=True)

    def read_key(self, timeout: float) -> str | None:
        """Return the next pressed key.

        Raises:
            ParameterError: if the terminal is lost.
        """
        if not select.select([sys.stdin], [], [], timeout)[0]:
            return None
        pressed = os.read(sys.stdin.fileno(), 1)
        if not pressed:
            raise ParameterError("terminal", "is closed: --resume goes on where it stopped")
        if pressed == b"\x1b" and select.select([sys.stdin], [], [], 0.02)[0]:
            pressed += os.read(sys.stdin.fileno(), 2)  # the rest of an arrow key
        return _SEQUENCES.get(pressed, pressed.decode("ascii", "replace").lower())


@contextmanager
def open_terminal() -> Iterator[Terminal]:
    """Yield the terminal, whose keys arrive at once.

    Raises:
        ParameterError: without a terminal.
    """
    import termios
    import tty

    if not sys.stdin.isatty():
        raise ParameterError("terminal", "is needed: run the command in one")
    before = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        yield Terminal()
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)

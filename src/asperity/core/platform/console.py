"""The terminal of a program: single keys, and whether it is gone."""

from __future__ import annotations

import os
import select
import stat
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

ReadKey = Callable[[float], bytes | None]
"""Waits a time [s] for a key; returns the bytes of a Linux terminal, none if the terminal is gone,
or ``None`` if no key was pressed."""
_ESCAPE_TIME = 0.02  # [s] between the bytes of an arrow key
_POLL_TIME = 0.005  # [s]
# What Windows returns for keys that a Linux terminal names otherwise.
_WINDOWS_KEYS = {"\r": b"\n", "\x08": b"\x7f", "\xe0H": b"\x1b[A", "\xe0P": b"\x1b[B"}


@contextmanager
def open_keyboard() -> Iterator[ReadKey]:
    """Deliver the keys of the terminal of standard input as they are pressed, until the end."""
    try:
        import termios
        import tty
    except ModuleNotFoundError:
        yield _read_windows_key
        return
    before = termios.tcgetattr(sys.stdin)
    try:
        tty.setcbreak(sys.stdin)
        yield _read_key
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def _read_key(timeout: float) -> bytes | None:
    if not select.select([sys.stdin], [], [], timeout)[0]:
        return None
    pressed = os.read(sys.stdin.fileno(), 1)
    if pressed == b"\x1b" and select.select([sys.stdin], [], [], _ESCAPE_TIME)[0]:
        pressed += os.read(sys.stdin.fileno(), 2)  # the rest of an arrow key
    return pressed


def _read_windows_key(timeout: float) -> bytes | None:
    import msvcrt

    console: Any = msvcrt  # its types are known on Windows alone
    end = time.monotonic() + timeout
    while not console.kbhit():
        if time.monotonic() >= end:
            return None
        time.sleep(_POLL_TIME)
    pressed: str = console.getwch()
    if pressed in "\0\xe0":  # the first of two characters, for keys that write nothing
        pressed = "\xe0" + console.getwch()
    return _WINDOWS_KEYS.get(pressed, pressed.encode())


def leave_lost_terminal() -> bool:
    """Return whether the terminal of this program is gone; its output then goes nowhere."""
    if not hasattr(select, "poll"):
        return False  # the system ends a program whose terminal is closed
    poller = select.poll()
    is_lost = False
    for stream in range(3):
        poller.register(stream, 0)
    for stream, event in poller.poll(0):
        # A pipe whose reader has ended is no terminal.
        if event & select.POLLHUP and stat.S_ISCHR(os.fstat(stream).st_mode):
            os.dup2(os.open(os.devnull, os.O_RDWR), stream)
            is_lost = True
    return is_lost

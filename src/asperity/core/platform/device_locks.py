"""Locks of devices for all users of a machine, released by the system when a process ends.

``filelock`` has exclusive locks alone, while loops on several devices of a kind share that of the
kind.
"""

from __future__ import annotations

import hashlib
import os
import secrets
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from asperity.core.platform.process_control import describe_parent

# Windows locks bytes, behind the text of the file: a shared lock is one of them, picked at random.
_FIRST_BYTE = 2**20
_BYTES = 2**30


@contextmanager
def hold_lock(name: str, *, shared: bool) -> Iterator[None]:
    """Lock a name; without a folder for the lock nothing is locked.

    Raises:
        BlockingIOError: if another process holds it; the message names that process.
    """
    file = _open_lock(name)
    if file is None:
        yield
        return
    try:
        _lock(file, shared=shared)
        yield
    finally:
        os.close(file)


def _open_lock(name: str) -> int | None:
    digest = hashlib.sha256(name.encode()).hexdigest()[:16]
    path = Path(tempfile.gettempdir(), f"asperity-{digest}.lock")
    no_link = getattr(os, "O_NOFOLLOW", 0)
    # A file of another user must not be opened with O_CREAT in a folder that all may write.
    for flags in (0, os.O_CREAT | os.O_EXCL, 0):
        with suppress(OSError):
            file = os.open(path, os.O_RDWR | no_link | flags, 0o666)
            with suppress(OSError, TypeError, NotImplementedError):  # only of a path, elsewhere
                os.chmod(file, 0o666)
            return file
    return None


def _lock(file: int, *, shared: bool) -> None:
    try:
        _try_lock(file, shared=shared)
    except OSError:
        os.lseek(file, 0, os.SEEK_SET)
        raise BlockingIOError(os.read(file, 1000).decode(errors="replace")) from None
    os.ftruncate(file, 0)
    os.lseek(file, 0, os.SEEK_SET)
    os.write(file, describe_parent().encode(errors="replace"))


def _try_lock(file: int, *, shared: bool) -> None:
    try:
        import fcntl
    except ModuleNotFoundError:
        import msvcrt

        windows: Any = msvcrt  # its types are known on Windows alone
        first = secrets.randbelow(_BYTES) if shared else 0
        os.lseek(file, _FIRST_BYTE + first, os.SEEK_SET)
        windows.locking(file, windows.LK_NBLCK, 1 if shared else _BYTES)
    else:
        fcntl.flock(file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)

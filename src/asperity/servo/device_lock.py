"""A lock on a device, so that no two loops command it at once."""

from __future__ import annotations

import fcntl
import hashlib
import os
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from asperity.core.errors import ParameterError
from asperity.servo.drivers.driver import Driver


@contextmanager
def lock_device(driver: Driver) -> Iterator[None]:
    """Lock the device of a driver, for all users of this machine with one temporary folder.

    A driver that names no device locks all devices of its kind. The system releases the lock when
    the process ends, however that was. Without a folder for the lock nothing is locked.

    Raises:
        ParameterError: if another loop uses it; the message names that program.
    """
    kind = driver.name
    device = driver.device_name
    names = [kind, f"{kind}:{device}"] if device else [kind]
    with ExitStack() as stack:
        for name in names if driver.has_moving_handle else ():
            shared = name == kind and bool(device)
            file = _open_lock(name)
            if file is not None:
                stack.callback(os.close, file)
                _lock(file, shared=shared)
        yield


def _open_lock(name: str) -> int | None:
    digest = hashlib.sha256(name.encode()).hexdigest()[:16]
    path = Path(tempfile.gettempdir(), f"asperity-{digest}.lock")
    # A file of another user must not be opened with O_CREAT in a folder that all may write.
    for flags in (0, os.O_CREAT | os.O_EXCL, 0):
        with suppress(OSError):
            file = os.open(path, os.O_RDWR | os.O_NOFOLLOW | flags, 0o666)
            with suppress(OSError):
                os.fchmod(file, 0o666)
            return file
    return None


def _lock(file: int, *, shared: bool) -> None:
    try:
        fcntl.flock(file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except OSError:
        user = os.pread(file, 1000, 0).decode(errors="replace")
        raise ParameterError("driver", f"finds the device in use by process {user}") from None
    os.ftruncate(file, 0)
    os.pwrite(file, _supervisor().encode(errors="replace"), 0)


def _supervisor() -> str:
    """Return number and command of the process that supervises this one."""
    number = os.getppid()
    command = b""
    with suppress(OSError):
        command = Path(f"/proc/{number}/cmdline").read_bytes()
    words = " ".join(command.decode(errors="replace").split("\0")).strip()
    return f"{number} ({words})" if words else str(number)

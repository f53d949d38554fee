"""Signals and limits of processes, as far as the system has them."""

from __future__ import annotations

import math
import os
import signal
import time
from contextlib import suppress
from pathlib import Path


def _existing(*names: str) -> tuple[int, ...]:
    """Return the signals of these names that the system has."""
    return tuple([int(getattr(signal, name)) for name in names if hasattr(signal, name)])


STOP_NOW_SIGNALS = _existing("SIGQUIT", "SIGUSR1", "SIGBREAK")
"""Signals that end a loop without a ramp; SIGBREAK is Ctrl-Break on Windows."""
SUSPEND_SIGNALS = _existing("SIGTSTP")
"""The signal of Ctrl-Z, which ends a loop and suspends the program."""
STOP_SIGNALS = (*_existing("SIGINT", "SIGTERM", "SIGHUP"), *SUSPEND_SIGNALS, *STOP_NOW_SIGNALS)
"""Signals that end a loop."""
PROCESSOR_TIME_SIGNALS = _existing("SIGXCPU")
"""The signal of a process that used the processor for longer than it may."""


def suspend_this_process() -> None:
    """Suspend this process, as Ctrl-Z does."""
    os.kill(os.getpid(), signal.SIGSTOP)


def resume_process(number: int) -> None:
    """Resume a process that was suspended, where processes can be."""
    for resume in _existing("SIGCONT"):
        with suppress(OSError):
            os.kill(number, resume)


def leave_terminal() -> None:
    """Leave the session of the terminal, and block or ignore every signal that can be.

    In a session of its own, a process gets no signals of the terminal or to the process group, not
    even a SIGKILL or SIGSTOP. Windows has no sessions and two signals of the terminal.
    """
    with suppress(OSError, AttributeError):  # it has a session already
        os.setsid()
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())  # threads inherit it
    else:
        for number in _existing("SIGINT", "SIGBREAK"):
            signal.signal(number, signal.SIG_IGN)


def processor_time_left() -> float:
    """Return the time after which the system kills this process [s]; infinite without a limit."""
    try:
        import resource
    except ModuleNotFoundError:
        return math.inf
    limit = resource.getrlimit(resource.RLIMIT_CPU)[1]
    return limit - time.process_time() if limit >= 0 else math.inf


def limit_process(seconds: float, memory: int) -> None:
    """Limit processor time [s] and memory [bytes] of this process, where the system can."""
    try:
        import resource
    except ModuleNotFoundError:  # the parent's clock is the only limit
        return
    # RLIMIT_DATA rather than RLIMIT_AS: mapped libraries do not count.
    for name, wanted in {"DATA": memory, "CPU": math.ceil(seconds), "CORE": 0}.items():
        limit = wanted
        kind = getattr(resource, f"RLIMIT_{name}")
        hard = resource.getrlimit(kind)[1]
        if hard >= 0:
            limit = min(limit, hard)
        resource.setrlimit(kind, (limit, hard))


def memory_file_of_parent() -> Path:
    """Return the file in which Linux counts the memory of the parent; other systems have none."""
    return Path(f"/proc/{os.getppid()}/statm")


def describe_parent() -> str:
    """Return number and, on Linux, command of the process that started this one."""
    number = os.getppid()
    command = b""
    with suppress(OSError):
        command = Path(f"/proc/{number}/cmdline").read_bytes()
    words = " ".join(command.decode(errors="replace").split("\0")).strip()
    return f"{number} ({words})" if words else str(number)

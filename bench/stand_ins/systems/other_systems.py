"""Windows and macOS as the package sees them, for tests on Linux: a lower bound, not the systems.

``ASPERITY_SYSTEM`` names the system. Modules of the package get ``os``, ``signal``, ``select``,
``time``, ``sys`` and ``ctypes`` without what the system lacks, and calls of its libraries that are
written here; all other packages, and Python itself, see Linux. Names that are hidden are those
that the stubs of typeshed declare for Linux and not for the system.

``ASPERITY_REFUSES`` lists what the system refuses: ``priority``, ``timer`` (of high resolution).
"""

from __future__ import annotations

import builtins
import ctypes
import functools
import os
import time
from collections.abc import Callable, Mapping, Sequence
from types import ModuleType, SimpleNamespace
from typing import Any

SYSTEM = "ASPERITY_SYSTEM"
REFUSES = "ASPERITY_REFUSES"
CALLS = "ASPERITY_CALLS"
"""File to which names of calls are appended, one a line."""

POSIX_MODULES = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"}
_UNIX_SIGNALS = (
    "SIGALRM SIGBUS SIGCHLD SIGCLD SIGCONT SIGHUP SIGIO SIGIOT SIGKILL SIGPIPE SIGPOLL SIGPROF"
    " SIGPWR SIGQUIT SIGRTMAX SIGRTMIN SIGSTKFLT SIGSTOP SIGSYS SIGTRAP SIGTSTP SIGTTIN SIGTTOU"
    " SIGURG SIGUSR1 SIGUSR2 SIGVTALRM SIGWINCH SIGXCPU SIGXFSZ SIG_BLOCK SIG_SETMASK SIG_UNBLOCK"
    " alarm getitimer pause pthread_kill pthread_sigmask setitimer sigpending sigwait sigtimedwait"
)
_LINUX_FUNCTIONS = (
    "O_TMPFILE O_NOATIME O_PATH copy_file_range eventfd fdatasync getrandom memfd_create pidfd_open"
    " pipe2 posix_fadvise posix_fallocate sched_getaffinity sched_getparam sched_getscheduler"
    " sched_setaffinity sched_setparam sched_setscheduler sched_rr_get_interval setxattr getxattr"
    " listxattr"
)
_UNIX_FUNCTIONS = (
    "O_CLOEXEC O_DIRECTORY O_NOFOLLOW O_NONBLOCK O_SYNC WNOHANG SCHED_FIFO SCHED_OTHER SCHED_RR"
    " chown chroot confstr ctermid fchdir fchmod fchown fork forkpty getegid geteuid getgid"
    " getgroups getloadavg getpgid getpgrp getpriority getsid getuid killpg lchown lockf mkfifo"
    " mknod nice openpty posix_spawn pread preadv pwrite pwritev readv sched_get_priority_max"
    " sched_param sched_yield sendfile set_blocking setegid seteuid setgid setpgid setpriority"
    " setsid setuid statvfs sync sysconf tcgetpgrp ttyname uname wait wait3 wait4 waitid writev"
)
_HIDDEN: dict[str, dict[str, str]] = {
    "windows": {
        "os": f"{_UNIX_FUNCTIONS} {_LINUX_FUNCTIONS}",
        "signal": _UNIX_SIGNALS,
        "select": "epoll poll POLLHUP POLLIN POLLOUT",
        "time": "CLOCK_BOOTTIME CLOCK_MONOTONIC clock_getres clock_gettime clock_gettime_ns",
    },
    "macos": {
        "os": _LINUX_FUNCTIONS,
        "signal": "SIGCLD SIGPOLL SIGPWR SIGRTMAX SIGRTMIN SIGSTKFLT sigtimedwait",
        "select": "epoll",
        "time": "CLOCK_BOOTTIME",
    },
}
SLEPT = 1000 * 10**9
"""Time for which the machine with macOS slept since its start [ns]."""
_MACH_UNIT = (125, 3)  # of processors by Apple
_COUNTS_PER_SECOND = 10_000_000


class PartOfModule(ModuleType):
    """A module without some of its names, and with others."""

    def __init__(self, whole: ModuleType, hidden: set[str], added: Mapping[str, Any]) -> None:
        vars(self).update(_whole=whole, _hidden=hidden, _added=added)

    def __getattr__(self, name: str) -> Any:
        if name in vars(self)["_added"]:
            return vars(self)["_added"][name]
        if name in vars(self)["_hidden"]:
            raise AttributeError(f"this system has no {name}")
        return getattr(vars(self)["_whole"], name)

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(vars(self)["_whole"], name, value)


def note_call(name: str) -> None:
    """Append the name of a call to a file, for tests."""
    if os.environ.get(CALLS):
        with open(os.environ[CALLS], "a", encoding="utf-8") as file:
            file.write(f"{name}\n")


def refuses(what: str) -> bool:
    """Return whether the system refuses something."""
    return what in os.environ.get(REFUSES, "")


def function(result: Any, *arguments: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that makes a C function of a function."""
    return ctypes.CFUNCTYPE(result, *arguments)


def numbers_at(place: int, kind: Any = ctypes.c_int64) -> Any:
    """Return the numbers at an address, to be written."""
    return ctypes.cast(place, ctypes.POINTER(kind))


def sleep_until(end: int) -> None:
    """Sleep until a time of the monotonic clock [ns]."""
    remaining = end - time.monotonic_ns()
    if remaining > 0:
        time.sleep(1e-9 * remaining)


# --- Windows --------------------------------------------------------------------------------------

_timers: dict[int, int] = {}
_WORD = ctypes.c_void_p


@function(ctypes.c_int, _WORD)
def query_frequency(place: int) -> int:
    numbers_at(place)[0] = _COUNTS_PER_SECOND
    return 1


@function(ctypes.c_int, _WORD)
def query_counter(place: int) -> int:
    numbers_at(place)[0] = time.perf_counter_ns() // 100
    return 1


@function(_WORD, _WORD, _WORD, ctypes.c_uint32, ctypes.c_uint32)
def create_timer(_security: int, _name: int, flags: int, access: int) -> int:
    assert access == 0x1F0003
    note_call(f"CreateWaitableTimerExW({flags})")
    if flags == 2 and refuses("timer"):
        return 0
    handle = 2**33 + 4 * len(_timers)  # a handle may need more than 32 bits
    _timers[handle] = 0
    return handle


@function(ctypes.c_int, _WORD, _WORD, ctypes.c_long, _WORD, _WORD, ctypes.c_int)
def set_timer(handle: int, due: int, period: int, _call: int, _data: int, _resume: int) -> int:
    time_to_wait = numbers_at(due)[0]
    assert time_to_wait < 0, "relative times are negative"
    assert period == 0
    _timers[handle] = time.monotonic_ns() - 100 * time_to_wait
    return 1


@function(ctypes.c_uint32, _WORD, ctypes.c_uint32)
def wait_for_object(handle: int, milliseconds: int) -> int:
    last = time.monotonic_ns() + 1_000_000 * milliseconds
    sleep_until(min(_timers[handle], last))
    return 0 if _timers[handle] <= last else 0x102


@function(_WORD)
def current_thread() -> int:
    return 2**64 - 2


@function(_WORD)
def current_process() -> int:
    return 2**64 - 1


@function(ctypes.c_int, _WORD, ctypes.c_int)
def set_thread_priority(handle: int, level: int) -> int:
    assert handle == 2**64 - 2
    note_call(f"SetThreadPriority({level})")
    return int(not refuses("priority"))


@function(ctypes.c_int, _WORD, ctypes.c_uint32)
def set_priority_class(handle: int, level: int) -> int:
    assert (handle, level) == (2**64 - 1, 0x80)
    return 1


@function(ctypes.c_uint, ctypes.c_uint)
def time_begin_period(milliseconds: int) -> int:
    note_call(f"timeBeginPeriod({milliseconds})")
    return 0


@function(_WORD, ctypes.c_wchar_p, _WORD)
def set_task(name: str, index: int) -> int:
    assert numbers_at(index, ctypes.c_uint32)[0] == 0
    note_call(f"AvSetMmThreadCharacteristicsW({name})")
    return 0 if refuses("priority") else 2**33


@functools.cache
def windows_library(name: str) -> Any:
    """Return a library of Windows."""
    libraries = {
        "kernel32": {
            "QueryPerformanceFrequency": query_frequency,
            "QueryPerformanceCounter": query_counter,
            "CreateWaitableTimerExW": create_timer,
            "SetWaitableTimer": set_timer,
            "WaitForSingleObject": wait_for_object,
            "GetCurrentThread": current_thread,
            "GetCurrentProcess": current_process,
            "SetThreadPriority": set_thread_priority,
            "SetPriorityClass": set_priority_class,
        },
        "winmm": {"timeBeginPeriod": time_begin_period},
        "avrt": {"AvSetMmThreadCharacteristicsW": set_task},
        "ws2_32": {"send": ctypes.CDLL(None).send},
    }
    if name not in libraries:
        raise FileNotFoundError(f"Could not find module {name!r}")
    return SimpleNamespace(**libraries[name])


def windows_file(name: str | None, *options: Any, **further: Any) -> ctypes.CDLL:
    """Load a library by its path; Windows has no library of the program itself."""
    if name is None:
        raise TypeError("bad argument type for built-in operation")
    return ctypes.CDLL(name, *options, **further)


class Console:
    """The module ``msvcrt``: keys that a test has put into ``pressed``, and locks of bytes."""

    LK_NBLCK = 2
    pressed: str = ""
    locked: Sequence[tuple[int, int, int, int]] = ()

    def kbhit(self) -> bool:
        """Return whether a key waits."""
        return bool(self.pressed)

    def getwch(self) -> str:
        """Return a character of a key."""
        key, self.pressed = self.pressed[0], self.pressed[1:]
        return key

    def locking(self, file: int, mode: int, count: int) -> None:
        """Lock bytes from the position of a file on, until the file is closed."""
        assert mode == self.LK_NBLCK
        first = os.lseek(file, 0, os.SEEK_CUR)
        node = os.fstat(file).st_ino
        held = [lock for lock in self.locked if _is_open(lock[0], lock[1])]
        for _other, other_node, start, end in held:
            if node == other_node and first < end and start < first + count:
                raise PermissionError(13, "Permission denied")
        self.locked = (*held, (file, node, first, first + count))


def _is_open(file: int, node: int) -> bool:
    try:
        return os.fstat(file).st_ino == node
    except OSError:
        return False


# --- macOS ----------------------------------------------------------------------------------------


@function(ctypes.c_int, ctypes.c_int, _WORD)
def read_clock(clock: int, place: int) -> int:
    now = {6: time.monotonic_ns(), 8: time.monotonic_ns() - SLEPT}[clock]
    numbers_at(place)[0], numbers_at(place)[1] = divmod(now, 10**9)
    return 0


@function(ctypes.c_int, ctypes.c_uint64)
def wait_until(ticks: int) -> int:
    sleep_until(ticks * _MACH_UNIT[0] // _MACH_UNIT[1] + SLEPT)
    return 0


@function(ctypes.c_int, _WORD)
def read_unit(place: int) -> int:
    numbers_at(place, ctypes.c_uint32)[0], numbers_at(place, ctypes.c_uint32)[1] = _MACH_UNIT
    return 0


@function(ctypes.c_uint32)
def this_thread() -> int:
    return 771


@function(ctypes.c_int, ctypes.c_uint32, ctypes.c_uint32, _WORD, ctypes.c_uint32)
def set_policy(thread: int, policy: int, values: int, count: int) -> int:
    assert (thread, policy, count) == (771, 2, 4)
    period, computation, constraint, _preemptible = numbers_at(values, ctypes.c_uint32)[:4]
    assert computation <= constraint <= period
    note_call(f"thread_policy_set({period})")
    return 4 if refuses("priority") else 0


def macos_file(name: str | None, *options: Any, **further: Any) -> Any:
    """Load a library by its path, or the one of the system."""
    if name is not None:
        return ctypes.CDLL(name, *options, **further)
    return SimpleNamespace(
        clock_gettime=read_clock,
        mach_wait_until=wait_until,
        mach_timebase_info=read_unit,
        mach_thread_self=this_thread,
        thread_policy_set=set_policy,
        send=ctypes.CDLL(None).send,
    )


# --- what the package imports ---------------------------------------------------------------------

console = Console()


def install() -> None:
    """Show the named system to the modules of the package."""
    system = os.environ.get(SYSTEM)
    if system is None:
        return
    systems: dict[str, dict[str, dict[str, Any]]] = {
        "windows": {
            "ctypes": {"WinDLL": windows_library, "CDLL": windows_file},
            "os": {"name": "nt"},
            "sys": {"platform": "win32"},
            "signal": {"SIGBREAK": 10},  # the number of a signal that Linux has
        },
        "macos": {"ctypes": {"CDLL": macos_file}, "sys": {"platform": "darwin"}},
    }
    added = systems[system]
    hidden = _HIDDEN[system]
    missing = POSIX_MODULES if system == "windows" else set[str]()
    real_import = builtins.__import__
    parts: dict[str, Any] = {"msvcrt": console} if system == "windows" else {}

    def import_part(
        name: str,
        globals: Mapping[str, Any] | None = None,  # noqa: A002 - callers name it
        locals: Mapping[str, Any] | None = None,  # noqa: A002 - likewise
        fromlist: Sequence[str] | None = (),
        level: int = 0,
    ) -> ModuleType:
        package = str((globals or {}).get("__package__") or "")
        if package.partition(".")[0] != "asperity" or level:
            return real_import(name, globals, locals, fromlist or (), level)
        if name in missing:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        if name not in parts and name in hidden.keys() | added.keys():
            whole = real_import(name)
            parts[name] = PartOfModule(whole, {*hidden.get(name, "").split()}, added.get(name, {}))
        return parts.get(name) or real_import(name, globals, locals, fromlist or (), level)

    builtins.__import__ = import_part

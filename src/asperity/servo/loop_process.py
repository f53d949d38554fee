"""The process of a driver's loop: its job, real-time priority, and the lock on the device."""

from __future__ import annotations

import ctypes
import fcntl
import hashlib
import importlib.util
import os
import pickle
import resource
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from asperity.core.errors import AsperityError, ParameterError
from asperity.core.processes import end_with_parent
from asperity.servo.driver import Driver
from asperity.servo.driver_loop import DriverLoop, LoopProgram, no_clock, system_clock
from asperity.servo.loop_memory import EndReason, LoopMemory
from asperity.servo.safety import Safety
from asperity.simulation.servo import Servo

PRIORITY = 80
"""Real-time priority of the loop, 1 to 99: above user programs, below kernel threads."""
# Linux: lock all current and future pages; set the timer slack [ns].
_LOCK_ALL_PAGES = 1 | 2
_SET_TIMER_SLACK = 29


def request_realtime_priority() -> tuple[str, ...]:
    """Request real-time priority and locked memory for this thread.

    Returns:
        What was not permitted, in sentences; nothing if all was.
    """
    notes = []
    library = ctypes.CDLL(None, use_errno=True)
    library.prctl(_SET_TIMER_SLACK, ctypes.c_ulong(1), 0, 0, 0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except OSError:
        notes.append(
            "Real-time priority is not allowed: samples may be late when the machine is busy"
            " (allow it by 'rtprio' in /etc/security/limits.conf)"
        )
    unlimited = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY
    if not (unlimited or os.geteuid() == 0) or library.mlockall(_LOCK_ALL_PAGES) != 0:
        notes.append("Memory may be paged out ('memlock' in the same file forbids it)")
    return tuple(notes)


ModuleFiles = Sequence[tuple[str, str]]
"""Names and files of plugins, which cannot be imported by their names."""


@dataclass(frozen=True, eq=False)
class LoopJob:
    """The job of a loop's process.

    Attributes:
        program: the surface.
        driver: the device.
        servo: period, steps of position and force, maximum force, virtual damping.
        safety: limits.
        reach: reach of the handle [m].
        end_sample: number of the first sample that is not run.
    """

    program: LoopProgram
    driver: Driver
    servo: Servo
    safety: Safety
    reach: float
    end_sample: int


def unpickle(modules: ModuleFiles, data: bytes) -> Any:
    """Return a pickled value, after loading the modules of its classes."""
    for name, file in modules:
        spec = importlib.util.spec_from_file_location(name, file)
        if name not in sys.modules and spec is not None and spec.loader is not None:
            sys.modules[name] = importlib.util.module_from_spec(spec)
            sys.path.insert(0, os.path.dirname(file))  # the module may import files beside it
            try:
                spec.loader.exec_module(sys.modules[name])
            finally:
                sys.path.remove(os.path.dirname(file))
    return pickle.loads(data)


class _LoopServer:
    """A running loop, and the thread that compiles the next surface for it."""

    def __init__(self, connection: Connection, memory: LoopMemory, job: LoopJob) -> None:
        self._connection = connection
        self._job = job
        self._memory = memory
        self._block = memory.block()
        # A device that follows another loop waits for each of its samples.
        clock = no_clock() if job.driver.follows else system_clock(job.driver.clock_speed)
        self._loop = DriverLoop(job.driver, job.servo, job.safety, job.reach, self._block, clock)
        self._loop.search_state = memory.search_state
        self._program = self._next_program = job.program

    def serve(self) -> None:
        """Run until the loop ends, and report why."""
        driver = self._job.driver
        self._loop.compile(self._program)
        with lock_device(driver):
            self._serve(driver)

    def _serve(self, driver: Driver) -> None:
        device = driver.open()
        try:
            threading.Thread(target=self._receive_programs, daemon=True).start()
            self._connection.send(("ready", request_realtime_priority()))
            cause = EndReason.SWAP
            code = 0
            while cause is EndReason.SWAP:
                self._program = self._next_program
                self._block.swap[0] = 0
                cause, code = self._loop.run(self._program, device, self._job.end_sample)
                self._loop.reset_contact()
        finally:
            driver.close()
        self._connection.send(("ended", (cause, driver.describe_error(code))))

    def _receive_programs(self) -> None:
        """Compile surfaces as they arrive, until the connection closes; then the loop ends."""
        with suppress(EOFError, OSError):
            while True:
                modules, data = self._connection.recv()
                try:
                    program = unpickle(modules, data)
                    self._loop.compile(program)
                except Exception as error:  # on any error the current surface goes on
                    self._connection.send(("refused", f"{type(error).__name__}: {error}"))
                    continue
                self._next_program = program
                self._block.swap[0] = 1
                self._connection.send(("loaded", None))
        self._memory.request_stop(now=True)


_WATCH_PERIOD = 0.003  # [s]
_CPU_MARGIN = 1.0  # before the limit of processor time, at which the system kills [s]
_CPU_WATCH_PERIOD = 0.1  # [s]
MAX_CALL_TIME = 10.0
"""Time for a call of a device to return before the process that waits in it is killed [s]."""


def _leave_to_supervisor(memory: LoopMemory) -> None:
    """Let the supervising process decide how the loop ends, and end with it.

    In a session of its own, the process gets no signals of the terminal or to the process group,
    not even a SIGKILL or SIGSTOP. All signals that can be blocked are: those of limits, timers and
    profilers too. If the supervising process dies, the force is released, and by a ramp shortly
    before the limit of processor time.
    """
    with suppress(OSError):  # it has a session already
        os.setsid()
    signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())  # threads inherit it

    def release() -> None:
        memory.request_stop(now=True)
        time.sleep(MAX_CALL_TIME)

    def watch_memory() -> None:
        """A killed process loses its memory first, which can take longer than all that follows."""
        with suppress(OSError):  # it has ended, or this is not Linux
            while not memory_of_parent.read_bytes().startswith(b"0 "):
                time.sleep(_WATCH_PERIOD)
            memory.request_stop(now=True)

    def watch_processor_time() -> None:
        """A process that reaches the hard limit is killed without a signal that it can block."""
        is_near = False
        while not is_near:
            time.sleep(_CPU_WATCH_PERIOD)
            limit = resource.getrlimit(resource.RLIMIT_CPU)[1]
            is_near = 0 <= limit <= time.process_time() + _CPU_MARGIN
        memory.request_stop()

    memory_of_parent = Path(f"/proc/{os.getppid()}/statm")
    threading.Thread(target=watch_memory, daemon=True).start()
    threading.Thread(target=watch_processor_time, daemon=True).start()
    end_with_parent(release)


def run_loop_process(connection: Connection, memory: LoopMemory) -> None:
    """Wait for a pickled :class:`LoopJob`, and run it: the main function of a loop's process.

    Args:
        connection: messages go out here; the job and further surfaces come in.
        memory: rows and counts.
    """
    _leave_to_supervisor(memory)
    importlib.import_module("numba")  # the slowest import, done while the job is prepared
    try:
        job = unpickle(*connection.recv())
    except EOFError:
        return  # there is no job
    try:
        _LoopServer(connection, memory, job).serve()
    except AsperityError as error:
        connection.send(("failed", str(error)))
    except BrokenPipeError:
        return  # the supervisor is gone; the device is closed


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

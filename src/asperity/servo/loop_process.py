"""The process of a driver's loop: its job, real-time priority, and the lock on the device."""

from __future__ import annotations

import importlib.util
import os
import pickle
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from asperity.core.errors import AsperityError, ParameterError
from asperity.core.platform import lateness
from asperity.core.platform.clocks import clock_module, no_clock, system_clock
from asperity.core.platform.device_locks import hold_lock
from asperity.core.platform.priority import request_realtime_priority
from asperity.core.platform.process_control import (
    leave_terminal,
    memory_file_of_parent,
    processor_time_left,
)
from asperity.core.processes import end_with_parent
from asperity.kernels.fuse import fuse_module
from asperity.servo.driver import Driver
from asperity.servo.driver_loop import DriverLoop, LoopProgram
from asperity.servo.loop_memory import EndReason, LoopMemory
from asperity.servo.safety import Safety
from asperity.simulation.servo import Servo

LATENESS_WAITS = 100
"""Waits that are measured where a loop has no real-time priority."""
_LATENESS_PERIOD = 1_000_000  # of these waits [ns]


def realtime_notes(period: float) -> tuple[str, ...]:
    """Request real-time priority for a loop with a period [s]; return what is not permitted.

    Without the priority, the notes say by how much waits ended late.
    """
    priority = request_realtime_priority(period)
    if priority.is_realtime:
        return priority.notes
    loops = fuse_module(lateness, clock_module())
    worst = loops.measure_lateness(system_clock(), _LATENESS_PERIOD, LATENESS_WAITS)
    words = f"{LATENESS_WAITS} waits of 1 ms: late by up to {1e-6 * worst:.2g} ms"
    return (*priority.notes, f"Measured without real-time priority, {words}")


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
        # In a thread that ends, before the device is open: it may not wait for its first force.
        with ThreadPoolExecutor(1) as thread:
            notes = thread.submit(realtime_notes, self._job.servo.period).result()
        with lock_device(driver):
            self._serve(driver, notes)

    def _serve(self, driver: Driver, notes: tuple[str, ...]) -> None:
        device = driver.open()
        try:
            threading.Thread(target=self._receive_programs, daemon=True).start()
            request_realtime_priority(self._job.servo.period)
            self._connection.send(("ready", notes))
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

    All signals that can be blocked are: those of limits, timers and profilers too. If the
    supervising process dies, the force is released, and by a ramp shortly before the limit of
    processor time.
    """
    leave_terminal()

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
            is_near = processor_time_left() <= _CPU_MARGIN
        memory.request_stop()

    memory_of_parent = memory_file_of_parent()
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
        connection.send(("started", None))
        job = unpickle(*connection.recv())
    except (EOFError, OSError):
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
            try:
                stack.enter_context(hold_lock(name, shared=name == kind and bool(device)))
            except BlockingIOError as user:
                raise ParameterError(
                    "driver", f"finds the device in use by process {user}"
                ) from None
        yield

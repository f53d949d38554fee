"""The process of a loop: it opens the device, runs the loop, and closes the device."""

from __future__ import annotations

import importlib.util
import os
import pickle
import signal
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from asperity.core.errors import AsperityError
from asperity.servo.driver_loop import (
    DriverLoop,
    LoopProgram,
    request_realtime_priority,
    system_clock,
)
from asperity.servo.drivers.driver import Driver
from asperity.servo.fault import EndReason
from asperity.servo.loop_memory import LoopMemory
from asperity.servo.safety import Safety
from asperity.simulation.servo import Servo

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
        self._connection, self._job, self._block = connection, job, memory.block()
        self._loop = DriverLoop(
            job.driver, job.servo, job.safety, job.reach, self._block, system_clock()
        )  # fmt: skip
        self._program = self._next_program = job.program

    def serve(self) -> None:
        """Run until the loop ends, and report why."""
        driver = self._job.driver
        self._loop.compile(self._program)
        device = driver.open()
        try:
            threading.Thread(target=self._receive_programs, daemon=True).start()
            self._connection.send(("ready", request_realtime_priority()))
            cause, code = EndReason.SWAP, 0
            while cause is EndReason.SWAP:
                self._program, self._block.swap[0] = self._next_program, 0
                cause, code = self._loop.run(self._program, device, self._job.end_sample)
                self._loop.reset_contact()
        finally:
            driver.close()
        self._connection.send(("ended", (cause, driver.describe_error(code))))

    def _receive_programs(self) -> None:
        """Compile surfaces as they arrive, until the connection closes."""
        with suppress(EOFError, OSError):
            while True:
                modules, data = self._connection.recv()
                try:
                    program = unpickle(modules, data)
                    self._loop.compile(program)
                except Exception as error:  # on any error the current surface goes on
                    self._connection.send(("refused", f"{type(error).__name__}: {error}"))
                    continue
                self._next_program, self._block.swap[0] = program, 1
                self._connection.send(("loaded", None))


def run_loop_process(connection: Connection, memory: LoopMemory) -> None:
    """Wait for a pickled :class:`LoopJob`, and run it: the main function of a loop's process.

    Args:
        connection: messages go out here; the job and further surfaces come in.
        memory: rows and counts.
    """
    # Ctrl-C goes to all processes of a terminal: the supervising one decides how the loop ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
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

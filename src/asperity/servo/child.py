"""The process of the loop: it opens the device, runs the loop, and lets go of the device."""

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

from asperity.errors import AsperityError
from asperity.servo.drivers.driver import Driver
from asperity.servo.fault import Cause
from asperity.servo.loop import Loop, Rendered, system_clock
from asperity.servo.priority import ask_for_priority
from asperity.servo.safety import Safety
from asperity.servo.shared import Shared
from asperity.simulation.servo import Servo

Modules = Sequence[tuple[str, str]]
"""Names and files of modules that cannot be imported by their names."""


@dataclass(frozen=True, eq=False)
class Job:
    """What the loop's process does.

    Attributes:
        shown: the surface.
        driver: the device.
        servo: period, steps of position and force, greatest force, virtual damping.
        safety: limits.
        reach: of the handle [m].
        last: number of the first sample that is not wanted.
    """

    shown: Rendered
    driver: Driver
    servo: Servo
    safety: Safety
    reach: float
    last: int


def unpacked(modules: Modules, packed: bytes) -> Any:
    """Return what was packed, once the modules that its classes come from are there."""
    for name, file in modules:
        if name not in sys.modules:
            spec = importlib.util.spec_from_file_location(name, file)
            if spec is not None and spec.loader is not None:
                sys.modules[name] = importlib.util.module_from_spec(spec)
                # As where it was first read: files beside it may be imported by it.
                sys.path.insert(0, os.path.dirname(file))
                try:
                    spec.loader.exec_module(sys.modules[name])
                finally:
                    sys.path.remove(os.path.dirname(file))
    return pickle.loads(packed)


class _Serving:
    """A loop that runs, and the thread that makes the next surface ready for it."""

    def __init__(self, line: Connection, shared: Shared, job: Job) -> None:
        self._line, self._job, self._board = line, job, shared.board()
        self._loop = Loop(
            job.driver, job.servo, job.safety, job.reach, self._board, system_clock()
        )  # fmt: skip
        self._shown = self._next = job.shown

    def serve(self) -> None:
        """Run until the loop ends, and say why."""
        driver = self._job.driver
        self._loop.load(self._shown)
        device = driver.open()
        try:
            threading.Thread(target=self._listen, daemon=True).start()
            self._line.send(("ready", ask_for_priority()))
            cause, code = Cause.SWAP, 0
            while cause is Cause.SWAP:
                self._shown, self._board.swap[0] = self._next, 0
                cause, code = self._loop.run(self._shown, device, self._job.last)
                self._loop.forget()
        finally:
            driver.close()
        self._line.send(("ended", (cause, driver.explain(code))))

    def _listen(self) -> None:
        """Make surfaces ready as they come, until nobody sends any."""
        with suppress(EOFError, OSError):
            while True:
                modules, packed = self._line.recv()
                try:
                    shown = unpacked(modules, packed)
                    self._loop.load(shown)
                except Exception as error:  # whatever it is, the surface that runs goes on
                    self._line.send(("refused", f"{type(error).__name__}: {error}"))
                    continue
                self._next, self._board.swap[0] = shown, 1
                self._line.send(("loaded", None))


def serve(line: Connection, shared: Shared) -> None:
    """Be the process of a loop: wait for the :class:`Job`, packed, and do it.

    Args:
        line: what is said goes here; the job and the surfaces to come are heard from here.
        shared: rows and counts.
    """
    # Ctrl-C goes to all processes of a terminal: the watching one decides how the loop ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    importlib.import_module("numba")  # what takes longest of all, while the job is made ready
    try:
        job = unpacked(*line.recv())
    except EOFError:
        return  # there is none
    try:
        _Serving(line, shared, job).serve()
    except AsperityError as error:
        line.send(("failed", str(error)))
    except BrokenPipeError:
        return  # nobody is left to hear how it ended; the device is closed

"""A loop in a process of its own, as the program that starts, supervises and records it sees it."""

from __future__ import annotations

import math
import os
import pickle
import sys
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from importlib.util import find_spec
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from multiprocessing.util import Finalize
from typing import Any, Self

from asperity.core.checks import FloatArray
from asperity.core.errors import AsperityError, ParameterError, print_message
from asperity.core.files import to_plain_data
from asperity.core.platform.process_control import resume_process
from asperity.core.processes import MAIN_GUARD_HINT, ShieldedContext
from asperity.devices import Device
from asperity.loop.interface import NO_END
from asperity.loop.shared_trace import COLUMNS
from asperity.recording.recorded_field import field_attachments, field_metadata
from asperity.recording.writer import RecordingWriter
from asperity.servo import driver_loop, loop_process
from asperity.servo.driver import Driver
from asperity.servo.loop_memory import (
    FAULT_DESCRIPTIONS,
    FAULT_SAMPLES,
    DeviceFault,
    EndReason,
    LoopMemory,
    LoopStatistics,
)
from asperity.servo.safety import Safety, check_passivity_damping
from asperity.simulation.servo import Servo
from asperity.surface import Surface

START_TIMEOUT = 120.0
"""Time until the loop must run [s]: compiling for the first time takes most of it."""
# The argument that a message of the loop's process refuses.
_REFUSALS = {"failed": "device", "refused": "surface"}
_ENDED_MESSAGE = "comes too late: the loop has ended"
_EXIT_TIMEOUT = 2.0  # [s] for a process to report its end
_HEARTBEAT_PERIOD = 0.01  # [s] at most


class PrestartedProcess:
    """A process that stands ready for a loop that is not known yet: starting takes time.

    End a process that gets no loop by :meth:`terminate`.

    Args:
        memory: memory to share; new memory if ``None``.
    """

    def __init__(self, memory: LoopMemory | None = None) -> None:
        context = ShieldedContext()
        self.memory = memory or LoopMemory()
        self.connection, theirs = context.Pipe()
        self.process = context.Process(
            target=loop_process.run_loop_process, args=(theirs, self.memory), daemon=True
        )
        self.process.start()
        theirs.close()
        # Otherwise Python would wait at its end for a process that ignores SIGTERM.
        what = self.connection, self.process, _EXIT_TIMEOUT
        Finalize(self, _end_process, what, exitpriority=1)

    def terminate(self, timeout: float = 0.0) -> None:
        """End the process, after a time to finish [s]."""
        _end_process(self.connection, self.process, timeout)


def _end_process(connection: Connection, process: BaseProcess, timeout: float) -> None:
    connection.close()
    process.join(timeout)
    if process.is_alive():
        process.kill()
        process.join()


class ServoProcess:
    """A surface on a device, rendered by a process of its own.

    Args:
        surface: the surface, or a program in its place.
        driver: the device.
        servo: period, steps of position and force, maximum force, virtual damping.
        safety: limits.
        reach: reach of the handle from the device's origin [m]; a reading further away is a fault.
        duration: duration of the loop [s]; ``None`` for no end.
        device: device whose limit applies to the surfaces of :meth:`change_surface`.
        prestarted: process to use, which ends with this loop; ``None`` for a new one.

    Attributes:
        driver: the device.
        memory: rows and counts of the loop.
        notes: what the system did not permit, in sentences.
        process: process of the loop, once started.

    Raises:
        ParameterError: for a surface that cannot be rendered, or a moving device without a known
            maximum force; for a passivity damping above its bound, if the device is given.

    Example:
        Not run as a test: it starts a process on a device; ``tests/servo/test_servo_process.py``
        does.

        >>> with ServoProcess(surface, driver, Servo(1e-3)) as loop:  # doctest: +SKIP
        ...     while loop.poll() is EndReason.RUNNING:
        ...         time.sleep(0.05)
    """

    def __init__(
        self,
        surface: Surface | driver_loop.LoopProgram,
        driver: Driver,
        servo: Servo,
        safety: Safety | None = None,
        reach: float = math.inf,
        duration: float | None = None,
        device: Device | None = None,
        prestarted: PrestartedProcess | None = None,
    ) -> None:
        require_max_force(driver, servo)
        self.driver = driver
        self._safety = safety or Safety()
        self._device = device
        if device is not None:
            check_passivity_damping(self._safety, device, servo)
        end_sample = NO_END
        if duration is not None:
            end_sample = round(duration / servo.period)
        if isinstance(surface, Surface):
            surface = driver_loop.build_program(surface, driver)
        self._job = loop_process.LoopJob(surface, driver, servo, self._safety, reach, end_sample)
        self._prestarted = prestarted
        if prestarted is None:
            self.memory = LoopMemory()
        else:
            self.memory = prestarted.memory
        self.notes: tuple[str, ...] = ()
        self._has_started = False
        self._end_reason = EndReason.RUNNING
        self._driver_message = ""
        self._last_row_count = 0
        self._last_progress = 0.0
        self._was_released = False
        self._heartbeat_stop = threading.Event()

    def __enter__(self) -> Self:
        self.start()
        return self

    def start(self) -> None:
        """Start the process; the loop runs when this returns.

        Raises:
            ParameterError: for a device that cannot be opened.
            DeviceFault: if the process ends or hangs.
        """
        self._prestarted = self._prestarted or PrestartedProcess(self.memory)
        self._connection = self._prestarted.connection
        self.process = self._prestarted.process
        threading.Thread(target=self._send_heartbeats, daemon=True).start()
        try:
            job = _pickle(self._job)
            with suppress(OSError):  # it has ended
                self._connection.send(job)
            self.notes = self._wait_for("ready", START_TIMEOUT)
        except BaseException:  # also for an interrupt
            self._terminate()
            raise
        self._last_progress = time.monotonic()

    def __exit__(self, *_error: object) -> None:
        self.stop()

    @property
    def statistics(self) -> LoopStatistics:
        """Counts of the loop."""
        return LoopStatistics.from_status(self.memory.status)

    def poll(self) -> EndReason:
        """Return why the loop has ended, or ``EndReason.RUNNING``.

        Raises:
            DeviceFault: if it ended by a fault.
        """
        if self._end_reason is EndReason.RUNNING:
            self._receive()
        if self._end_reason.is_fault:
            raise self.fault()
        return self._end_reason

    def fault(self) -> DeviceFault:
        """Return the fault that ended the loop."""
        reason = self._end_reason
        text = FAULT_DESCRIPTIONS.get(reason, self._driver_message)
        rows, _first = self.memory.rows(self.memory.row_count - FAULT_SAMPLES)
        if reason is EndReason.DIED and not self._has_started:
            return DeviceFault(reason, f"{text} when it started: {MAIN_GUARD_HINT}", rows)
        if len(rows):
            text += f" after {rows[-1, 0]:.4g} s"
        if reason in {EndReason.UNRESPONSIVE, EndReason.DIED}:
            return DeviceFault(reason, f"{text}. {self.driver.loss_notice}", rows)
        return DeviceFault(reason, f"{text}; the force was made zero", rows)

    def change_surface(self, surface: Surface, *, accept_risk: bool = False) -> None:
        """Render another surface: the force ramps down, the surface is replaced, it ramps up.

        The surface is analysed and compiled before, while the loop runs. The share of the law's
        force falls from 1 to 0, and rises from 0 to 1 with the next law, so that the stiffness
        never exceeds that of either.

        Args:
            surface: the next surface.
            accept_risk: whether to render it at a stiffness above the analysed limit as well.

        Raises:
            ParameterError: for a surface that cannot be rendered, or a stiffness above the limit;
                without a device no limit is known.
            DeviceFault: if the loop has ended by a fault.
        """
        if not accept_risk:
            self._check_stiffness(surface)
        self.change_program(driver_loop.build_program(surface, self.driver))

    def _check_stiffness(self, surface: Surface) -> None:
        from asperity.servo.safety import excess_stiffness_reason

        if self._device is None:
            raise ParameterError(
                "device", "is not known to the loop, so no limit is: ServoProcess(..., device=...)"
            )
        if reason := excess_stiffness_reason(surface, self._device):
            raise ParameterError("stiffness", f"is refused: {reason}; accept_risk=True renders it")

    def change_program(self, program: driver_loop.LoopProgram) -> None:
        """Render another program, without analysis; see :meth:`change_surface`.

        Raises:
            ParameterError: if it cannot be rendered, or the loop was ended.
            DeviceFault: if the loop has ended by a fault.
        """
        message = _pickle(program)
        if self.poll() is not EndReason.RUNNING:
            raise ParameterError("surface", _ENDED_MESSAGE)
        with suppress(OSError):  # it has just ended, and reported why
            self._connection.send(message)
        self._wait_for("loaded", START_TIMEOUT)

    def rows(self, first: int) -> tuple[FloatArray, int]:
        """Return the available rows from one on, and the number of the first."""
        return self.memory.rows(first)

    def stop(self) -> None:
        """Release the force, and end the loop and its process.

        A process that waits for its device is killed after ``MAX_CALL_TIME``.
        """
        if self._end_reason is EndReason.RUNNING:
            self.memory.request_stop()
            deadline = time.monotonic() + self._safety.ramp + _EXIT_TIMEOUT
            while self._end_reason is EndReason.RUNNING and time.monotonic() < deadline:
                self._receive(0.01)
        self._terminate()

    def _terminate(self) -> None:
        """End the process, which has closed the device unless it hangs."""
        self._heartbeat_stop.set()
        assert self._prestarted is not None
        timeout = _EXIT_TIMEOUT
        if self._end_reason in {EndReason.RUNNING, EndReason.UNRESPONSIVE}:
            timeout = loop_process.MAX_CALL_TIME
        self._prestarted.terminate(timeout)
        if self._end_reason is EndReason.DIED and not self._was_released:
            self._was_released = True
            with suppress(AsperityError, OSError):
                self.driver.release_lost_device()

    def _send_heartbeats(self) -> None:
        previous_count = -1
        while not self._heartbeat_stop.wait(min(0.1 * self._safety.silence, _HEARTBEAT_PERIOD)):
            self.memory.send_heartbeat()
            count = self.memory.row_count
            if count == previous_count:
                # If it is suspended: its next sample is late, and releases the force.
                resume_process(self.process.pid or os.getpid())
            previous_count = count

    def _receive(self, timeout: float = 0.0) -> None:
        """Receive messages, and check that the loop makes progress."""
        try:
            while self._connection.poll(timeout):
                self._handle_message(*self._connection.recv())
        except (EOFError, OSError):
            if self._end_reason is EndReason.RUNNING:
                self._end_reason = EndReason.DIED
        now = time.monotonic()
        count = self.memory.row_count
        if count != self._last_row_count:
            self._last_row_count = count
            self._last_progress = now
        elif (
            self._end_reason is EndReason.RUNNING
            and now - self._last_progress > self._safety.silence
        ):
            self._end_reason = EndReason.UNRESPONSIVE
            self.memory.request_stop(now=True)
            print_message(f"{self.fault()} Waiting for its call to return")

    def _handle_message(self, kind: str, content: Any) -> None:
        if kind == "ended":
            self._end_reason, self._driver_message = content

    def _wait_for(self, expected: str, timeout: float) -> Any:
        """Return the content of the next message of a kind."""
        try:
            while self._connection.poll(timeout):
                kind, content = self._connection.recv()
                self._has_started = True
                if kind == "started":
                    continue
                if kind == expected:
                    return content
                if kind in _REFUSALS:
                    raise ParameterError(_REFUSALS[kind], content)
                self._handle_message(kind, content)
                if self.poll() is not EndReason.RUNNING:
                    raise ParameterError("surface", _ENDED_MESSAGE)
        except (EOFError, OSError):
            self._end_reason = EndReason.DIED
        else:
            self._end_reason = EndReason.UNRESPONSIVE
        raise self.fault()


def require_max_force(driver: Driver, servo: Servo) -> None:
    """Require a known maximum force for a moving device.

    Raises:
        ParameterError: if it is not known.
    """
    if driver.has_moving_handle and not math.isfinite(servo.max_force):
        raise ParameterError(
            "max_force",
            "is not known: a device that moves needs it, such as {max_force}",
            max_force="3 N",
        )


def _pickle(value: object) -> tuple[loop_process.ModuleFiles, bytes]:
    """Return a pickled value, and the files of the plugins that it needs."""
    try:
        data = pickle.dumps(value)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise AsperityError(f"cannot be sent to the loop's process: {error}") from None
    files = {
        name: str(getattr(module, "__file__", ""))
        for name, module in list(sys.modules.items())
        if name.startswith("plugin_") and name.encode() in data and not _is_importable(name)
    }
    return tuple(files.items()), data


def _is_importable(name: str) -> bool:
    try:
        return find_spec(name) is not None
    except ValueError:  # a module without a spec
        return False


class LoopRecorder:
    """Records every sample of a loop, if called often enough; use it in a ``with``.

    The file is created when the ``with`` begins, so begin it when the loop runs.

    Args:
        path: path of the recording.
        loop: the loop, or its memory.
        surface: the surface that it renders.
        servo: servo of the loop.
        metadata: further metadata of the recording; plain data.

    Attributes:
        lost_rows: rows that were overwritten before they were read.

    Raises:
        ParameterError: for a path that cannot be written.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        loop: ServoProcess | LoopMemory,
        surface: Surface,
        servo: Servo,
        metadata: Mapping[str, Any],
    ) -> None:
        about: dict[str, Any] = {"made_by": "run", "surface": field_metadata(surface)}
        about |= {"servo": to_plain_data(servo), "every": 1, "has_applied_delay": True, **metadata}
        self._what = path, COLUMNS, about, field_attachments(surface), "record"
        self._loop = loop
        self._next_row = 0
        self.lost_rows = 0

    def write_new_rows(self) -> None:
        """Write the rows that are new.

        Raises:
            ParameterError: if the disk is full; what is written can be read.
        """
        rows, first = self._loop.rows(self._next_row)
        self.lost_rows += first - self._next_row
        self._next_row = first + len(rows)
        self._writer.append(rows)

    def __enter__(self) -> Self:
        self._writer = RecordingWriter(*self._what)
        return self

    def __exit__(self, *_error: object) -> None:
        self.write_new_rows()
        self._writer.close()

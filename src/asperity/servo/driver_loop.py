"""The compiled loop of a driver, and the process in which it runs with real-time priority."""

from __future__ import annotations

import ctypes
import importlib.util
import math
import os
import pickle
import resource
import signal
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from asperity.contacts.warm_start import BUDGET, POINT_COUNT, UNLIMITED, new_warm_start
from asperity.core.checks import FloatArray
from asperity.core.errors import AsperityError
from asperity.core.processes import end_with_parent
from asperity.kernels.fuse import load_fused, source_on_texture
from asperity.kernels.tick import ServoState
from asperity.loop import clock, guards, servo_loop, shared_trace
from asperity.loop.clock import Clock
from asperity.loop.guards import Guards, LoopLimits
from asperity.loop.interface import LoopState
from asperity.loop.shared_trace import SharedBlock
from asperity.servo.device_lock import lock_device
from asperity.servo.drivers.driver import Driver
from asperity.servo.fault import EndReason
from asperity.servo.loop_memory import LoopMemory
from asperity.servo.safety import Safety
from asperity.simulation.servo import Servo
from asperity.surface import Surface

NO_END = 2**62
"""End sample of a loop that does not end by itself."""


@dataclass(frozen=True, eq=False)
class LoopProgram:
    """A surface as the loop renders it, here or in another process.

    Attributes:
        source: text of the compiled module.
        texture: record of the texture.
        law: parameters of the law.
        safe_height: height above which the depth is within its limit at every position [m].
        max_depth: limit of the depth [m].
        max_evaluations: evaluation budget of a tick.
    """

    source: str
    texture: tuple[Any, ...]
    law: tuple[float, ...]
    safe_height: float
    max_depth: float
    max_evaluations: float


def loop_parts() -> tuple[Any, ...]:
    """Return the modules of the loop's parts but the device."""
    from asperity.kernels import tick

    return tick, clock, guards, shared_trace


def build_program(surface: Surface, driver: Driver) -> LoopProgram:
    """Return the program that renders a surface on a driver.

    Raises:
        ParameterError: for a texture without a function that the law needs.
    """
    from asperity.analysis.gain.theorems import theorem_on

    source = source_on_texture(
        surface.law, surface.texture.sampler, surface.effective_clamp,
        (servo_loop, *loop_parts(), *driver.kernel_modules()),
    )  # fmt: skip
    bounded = surface.effective_clamp.holds_whole_force
    everywhere = bounded or theorem_on(surface).holds_at_any_depth(surface)
    crest = surface.law.contact.extremes(surface.texture)[1]
    safe_height = -math.inf if everywhere else crest - surface.max_depth
    return LoopProgram(
        source, surface.texture.arguments, surface.law_arguments, safe_height, surface.max_depth,
        surface.law.contact.max_evaluations,
    )  # fmt: skip


def loop_limits(
    servo: Servo, safety: Safety, reach: float, centre: FloatArray, program: LoopProgram
) -> LoopLimits:
    """Return the limits of a loop."""
    period = servo.period
    share = 1.0 if safety.ramp < period else period / safety.ramp
    x, y, z = map(float, centre)
    return LoopLimits(
        round(1e9 * period), safety.slew_limit(servo.max_force) * period, share,
        float(safety.passivity_damping), round(1e9 * safety.lateness_limit(period)),
        round(1e9 * safety.silence), float(reach), x, y, z, program.safe_height, program.max_depth,
        safety.beyond_depth == "fault",
    )  # fmt: skip


def function_address(function: Any) -> int:
    """Return the address of a C function."""
    return int(ctypes.cast(function, ctypes.c_void_p).value or 0)


def system_clock() -> Clock:
    """Return the system's clock."""
    library = ctypes.CDLL(None)
    gettime = function_address(library.clock_gettime)
    sleep = function_address(library.clock_nanosleep)
    return Clock(gettime, sleep, np.zeros(2, np.int64))


def no_clock() -> Clock:
    """Return a clock whose time is always that of the next due sample."""
    return Clock(0, 0, np.zeros(2, np.int64))


class DriverLoop:
    """The loop of a driver.

    Args:
        driver: the device; the caller opens and closes it.
        servo: period, steps of position and force, maximum force, virtual damping.
        safety: limits.
        reach: reach of the handle from the origin of the device [m].
        block: memory of rows and counts.
        clock: the clock.

    Attributes:
        search_state: of the contact's search; see :mod:`asperity.contacts.warm_start`.
    """

    def __init__(
        self, driver: Driver, servo: Servo, safety: Safety, reach: float, block: SharedBlock,
        clock: Clock,
    ) -> None:  # fmt: skip
        self._servo = servo
        self._safety = safety
        self._reach = reach
        self._frame: FloatArray = driver.frame.matrix
        self._block = block
        self._clock = clock
        self._placeholder = driver.placeholder_record()
        self.state = LoopState()
        self.search_state = new_warm_start(UNLIMITED)

    def compile(self, program: LoopProgram) -> None:
        """Compile the loop for a surface, or load it; the device is left alone."""
        self._call(program, self._placeholder, LoopState(), -1)

    def run(
        self, program: LoopProgram, device: tuple[Any, ...], end_sample: int = NO_END
    ) -> tuple[EndReason, int]:
        """Run until ``end_sample``, a request, or a fault.

        Args:
            program: the surface.
            device: record of the open device.
            end_sample: number of the first sample that is not run.

        Returns:
            End reason, and error code of the driver.
        """
        cause, code, self.state = self._call(program, device, self.state, end_sample)
        return EndReason(int(cause)), int(code)

    def reset_contact(self) -> None:
        """Reset the state of the law; position and velocity are kept for the next surface."""
        servo = self.state.servo
        self.search_state[POINT_COUNT] = 0.0
        fresh = ServoState(servo.x, servo.y, servo.z, servo.vx, servo.vy, servo.vz)
        self.state = self.state._replace(servo=fresh)

    def _call(
        self, program: LoopProgram, device: tuple[Any, ...], state: LoopState, end_sample: int
    ) -> tuple[int, int, LoopState]:
        limits = loop_limits(self._servo, self._safety, self._reach, self._frame[:3, 3], program)
        self.search_state[BUDGET] = program.max_evaluations
        answer: tuple[int, int, LoopState] = load_fused(program.source).servo_loop(
            state, end_sample, self._servo.settings, self._clock,
            Guards(limits, self._frame, self._block), device, self._block,
            self.search_state, program.texture, program.law,
        )  # fmt: skip
        return answer


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
        clock = no_clock() if job.driver.follows else system_clock()
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


_IGNORED_SIGNALS = (
    signal.SIGINT, signal.SIGHUP, signal.SIGTERM, signal.SIGQUIT, signal.SIGTSTP, signal.SIGTTIN,
    signal.SIGTTOU, signal.SIGUSR1, signal.SIGUSR2, signal.SIGALRM,
)  # fmt: skip
_WATCH_PERIOD = 0.003  # [s]
MAX_CALL_TIME = 10.0
"""Time for a call of a device to return before the process that waits in it is killed [s]."""


def _leave_to_supervisor(memory: LoopMemory) -> None:
    """Let the supervising process decide how the loop ends, and end with it.

    In a session of its own, the process gets no signals of the terminal or to the process group,
    not even a SIGKILL or SIGSTOP. If the supervising process dies, the force is released.
    """
    with suppress(OSError):  # it has a session already
        os.setsid()
    for number in _IGNORED_SIGNALS:
        signal.signal(number, signal.SIG_IGN)

    def release() -> None:
        memory.request_stop(now=True)
        time.sleep(MAX_CALL_TIME)

    def watch_memory() -> None:
        """A killed process loses its memory first, which can take longer than all that follows."""
        with suppress(OSError):  # it has ended, or this is not Linux
            while not memory_of_parent.read_bytes().startswith(b"0 "):
                time.sleep(_WATCH_PERIOD)
            memory.request_stop(now=True)

    memory_of_parent = Path(f"/proc/{os.getppid()}/statm")
    threading.Thread(target=watch_memory, daemon=True).start()
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

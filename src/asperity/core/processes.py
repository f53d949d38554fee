"""Worker processes that compute results in advance, so that a command uses all cores.

Results do not depend on the number of processes: the calling process works through all tasks in
order, and uses the result of a worker where there is one. Workers start after a delay, or when a
function is compiled, so that results from the cache start none. From Python nothing runs in
parallel unless :func:`limit_processes` allows it.

Threads would not help, since Numba compiles under a global lock. Processes are spawned, since a
fork copies the threads of numerical libraries incompletely; a spawned process imports the main
module of the program, which therefore needs the usual ``if __name__ == "__main__"``.
"""

from __future__ import annotations

import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from enum import IntEnum
from functools import partial
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from concurrent.futures import Future, ProcessPoolExecutor
    from multiprocessing.process import BaseProcess

START_DELAY = 1.0
"""Time [s] after which workers start at the latest; starting one takes about as long."""
SINGLE_THREADED = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
"""Environment of every process: the last digit of linear algebra depends on its threads."""

MAIN_GUARD_HINT = (
    "a script needs  if __name__ == '__main__':  around what starts processes, and is a file"
)
"""Ends the message about a process that ended before it started."""

REPORT_PERIOD = 0.5
"""Time [s] between two looks at the progress of a worker."""
PROGRESS_CALLBACKS: list[Callable[[float], None]] = []
"""Functions called with the number of a :class:`Part` of a task plus its finished fraction."""


class Part(IntEnum):
    """Long parts of a task; a field that is baked reports its finished fraction."""

    BAKING = 0
    GAIN = 1
    LEAK = 2


_MAX_PROCESSES: ContextVar[int] = ContextVar("max_processes", default=1)


def available_cores() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def report_fraction(fraction: float) -> None:
    """Report the finished fraction of a field that is baked, in this process or a worker."""
    report_part(Part.BAKING + min(fraction, 0.999))


def report_part(part: float) -> None:
    """Report which part of a task begins, in this process or a worker."""
    for callback in PROGRESS_CALLBACKS:
        callback(part)


@contextmanager
def limit_processes(count: int) -> Iterator[None]:
    """Use at most a number of processes, including this one."""
    token = _MAX_PROCESSES.set(count)
    try:
        yield
    finally:
        _MAX_PROCESSES.reset(token)


class ShieldedProcess(SpawnProcess):
    """A process that Ctrl-C does not reach, from its first instruction: it inherits a mask."""

    def start(self) -> None:
        """Start the process."""
        if not hasattr(signal, "pthread_sigmask"):
            super().start()
            return
        from multiprocessing import resource_tracker

        resource_tracker.ensure_running()  # starting it unblocks the signal
        previous = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
        try:
            super().start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, previous)


class ShieldedContext(SpawnContext):
    """Starts processes as :class:`ShieldedProcess`; the one that started them ends them."""

    Process = ShieldedProcess


def ignore_interrupts() -> None:
    """Ignore Ctrl-C in this process from now on, but not in programs that it starts."""
    signal.signal(signal.SIGINT, lambda _number, _frame: None)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_SETMASK, [])


def make_pool(
    workers: int, prepare: Callable[[], None] | None = None, niceness: int = 0
) -> ProcessPoolExecutor:
    """Return a pool of spawned processes that ignore interrupts and end with this process.

    Args:
        workers: number of processes.
        prepare: function called first in each process, such as one that loads plugins.
        niceness: added to the niceness of the processes.
    """
    from concurrent.futures import ProcessPoolExecutor

    return ProcessPoolExecutor(
        workers, ShieldedContext(), initializer=_start_worker, initargs=(prepare, niceness)
    )


def _start_worker(prepare: Callable[[], None] | None, niceness: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process ends its workers
    end_with_parent()
    os.environ |= SINGLE_THREADED
    null = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):  # output of libraries
        os.dup2(null, stream)
    if hasattr(os, "nice"):
        os.nice(niceness)
    if prepare is not None:
        prepare()


def end_pool(pool: ProcessPoolExecutor, others: set[BaseProcess]) -> None:
    """End the processes of a pool without waiting for their tasks.

    Args:
        pool: the pool.
        others: child processes that were there before it, and stay.
    """
    from multiprocessing import active_children

    for child in set(active_children()) - others:
        child.kill()
    pool.shutdown(cancel_futures=True)


def end_with_parent(release: Callable[[], None] = lambda: None) -> None:
    """Let this process end when the one that started it has ended, however that was.

    A thread waits for the end of a pipe. The signal that Linux sends at the death of a parent
    (``PR_SET_PDEATHSIG``) would come when the parent's *thread* ends.

    Args:
        release: called first.
    """
    from multiprocessing import parent_process

    def wait() -> None:
        parent = parent_process()
        if parent is not None:
            parent.join()
            release()
            os._exit(0)  # a task may take long

    threading.Thread(target=wait, daemon=True).start()


@contextmanager
def defer_interrupt() -> Iterator[None]:
    """Handle Ctrl-C after a block that must not end half-way."""
    previous = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or previous is None:
        yield  # only the main thread is interrupted, by a handler of Python
        return
    received: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _frame: received.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)
        if received:
            signal.raise_signal(signal.SIGINT)


@contextmanager
def precompute(work: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[Iterator[Any]]:
    """Compute tasks in worker processes, from the last to the first.

    Args:
        work: function of a module, called in the workers; its result must be picklable.
        tasks: its arguments; ``None`` for a task that no worker can do.

    Yields:
        An iterator over the tasks in order: the result of a worker, or ``None`` for a task that
        the caller has to do.
    """
    workers = min(_MAX_PROCESSES.get(), len(tasks)) - 1
    if workers < 1:
        yield iter([None] * len(tasks))
        return
    from asperity.core.compiled import COMPILE_CALLBACKS

    queue = _TaskQueue(work, tasks, workers)
    COMPILE_CALLBACKS.append(queue.start)
    queue.timer.start()
    try:
        yield queue.iterate_results()
    finally:
        COMPILE_CALLBACKS.remove(queue.start)
        queue.stop()


# In a worker: where the calling process reads the progress of each task.
_FRACTIONS: list[Any] = []


def _share_fractions(fractions: Any) -> None:
    _FRACTIONS.append(fractions)


def _run_task(work: Callable[[Any], Any], index: int, task: Any) -> Any:
    """Do a task in a worker, and write its progress."""
    PROGRESS_CALLBACKS[:] = [partial(_FRACTIONS[0].__setitem__, index)]
    return None if task is None else work(task)


class _TaskQueue:
    """Tasks that are left, and the results of the others."""

    def __init__(self, work: Callable[[Any], Any], tasks: Sequence[Any], workers: int) -> None:
        self.work = work
        self.tasks = tasks
        self.workers = workers
        self.pending = deque(range(len(tasks)))
        self.results: dict[int, Future[Any]] = {}
        self.lock = threading.RLock()
        self.started = threading.Lock()
        self.timer = threading.Timer(START_DELAY, self.start)
        self.pool: ProcessPoolExecutor | None = None
        self.fractions: Any = None
        self.other_children: set[BaseProcess] = set()

    def iterate_results(self) -> Iterator[Any]:
        """Yield the result of each task, ``None`` if no worker has it."""
        for index in range(len(self.tasks)):
            with self.lock:
                future = self.results.get(index)
                if future is None:
                    self.pending.popleft()
            value = None
            if future is not None:
                self._wait(index, future)
                with suppress(Exception):  # the caller meets the error when it does the task
                    value = future.result()
            yield value

    def _wait(self, index: int, future: Future[Any]) -> None:
        """Wait until a worker has ended a task, and report its progress."""
        from concurrent.futures import wait

        while wait([future], REPORT_PERIOD).not_done:
            if self.fractions[index]:
                report_part(self.fractions[index])

    def start(self, _name: str = "") -> None:
        """Start the workers, unless they were started or stopped."""
        if not self.started.acquire(blocking=False):
            return
        from multiprocessing import active_children
        from multiprocessing.sharedctypes import RawArray

        self.other_children = set(active_children())
        with suppress(OSError):  # no room for semaphores, or no processes: this one does all
            self.fractions = RawArray("d", len(self.tasks))
            self.pool = make_pool(self.workers, partial(_share_fractions, self.fractions))
        for _ in range(self.workers):
            self._submit_last(self.pool)

    def _submit_last(self, pool: ProcessPoolExecutor | None) -> None:
        with self.lock, suppress(RuntimeError, OSError):  # the pool is broken, or cannot grow
            if self.pending and pool is not None:
                index = self.pending[-1]
                future = pool.submit(_run_task, self.work, index, self.tasks[index])
                self.results[self.pending.pop()] = future
                future.add_done_callback(lambda done: self._continue(pool, done))

    def _continue(self, pool: ProcessPoolExecutor, done: Future[Any]) -> None:
        # A broken pool takes no tasks, and may not be called from its callbacks.
        if not done.cancelled() and not isinstance(done.exception(), RuntimeError):
            self._submit_last(pool)

    def stop(self) -> None:
        """End the workers without waiting for their tasks."""
        self.timer.cancel()
        self.pending.clear()
        if self.started.acquire(blocking=False):
            return  # nothing was started, and nothing will be
        self.timer.join()
        if self.pool is not None:
            end_pool(self.pool, self.other_children)


def run_in_threads(
    function: Callable[[Any], None], parts: Sequence[Any], progress: Callable[[float], None] | None
) -> None:
    """Apply a function to the parts in threads; compiled loops release the GIL.

    The first part is computed alone, so that the loop is compiled once.
    """
    from concurrent.futures import ThreadPoolExecutor, as_completed

    if parts:
        function(parts[0])
    with ThreadPoolExecutor(max_workers=available_cores()) as pool:
        rest = [pool.submit(function, part) for part in parts[1:]]
        for done, future in enumerate(as_completed(rest), 2):
            future.result()
            if progress is not None:
                progress(done / len(parts))
    if progress is not None and len(parts) <= 1:
        progress(1.0)

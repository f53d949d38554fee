"""Where cases are computed: in this process, on the cores of this machine, on a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any

from asperity.core.errors import ParameterError
from asperity.core.processes import end_pool, make_pool

TASKS_PER_WORKER = 4
"""Tasks that are submitted at a time, so that no worker waits for the next."""


@dataclass(frozen=True)
class Place:
    """Where cases are computed.

    Attributes:
        open: returns a context of the executor that computes them.
        count_tasks: returns the number of tasks to be submitted at a time.
        task_time: time that a task is to take at least [s], so that the cost of a task does not
            count; 0 for one case per task.
        is_local: whether cases are computed in this process.
        is_lost: whether an error says that the worker of a task ended.
    """

    open: Callable[[], AbstractContextManager[Executor]]
    count_tasks: Callable[[], int]
    task_time: float = 0.0
    is_local: bool = False
    is_lost: Callable[[BaseException], bool] = lambda _error: False


class _SerialExecutor(Executor):
    """Executor that computes a task when it is submitted, in this process."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Return the future of a task that is done."""
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


def serial_place() -> Place:
    """Return this process."""
    return Place(_SerialExecutor, lambda: 1, is_local=True)


def cores_place(processes: int) -> Place:
    """Return worker processes on this machine."""
    return Place(
        lambda: _open_pool(processes),
        lambda: TASKS_PER_WORKER * processes,
        is_lost=lambda error: isinstance(error, BrokenProcessPool),
    )


@contextmanager
def _open_pool(processes: int) -> Iterator[Executor]:
    """Open a pool of processes, which end at once where the block ends with an error."""
    from multiprocessing import active_children

    others = set(active_children())
    pool = make_pool(processes)
    try:
        try:
            pool.submit(_do_nothing).result()
        except BrokenProcessPool:
            words = "end when they start: a script needs  if __name__ == '__main__':  around sweep"
            raise ParameterError("processes", words) from None
        yield pool
        pool.shutdown()
    except BaseException:  # also for an interrupt
        end_pool(pool, others)
        raise


def _do_nothing() -> None: ...

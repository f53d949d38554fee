"""The engine of a sweep: submit cases to an executor, and record what comes back."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from itertools import islice
from queue import SimpleQueue
from typing import Any

from asperity.core.errors import ParameterError
from asperity.core.processes import end_pool, make_pool
from asperity.sweeps.case_runs import Case, CaseTemplate, Outcome, compute_cases

Record = Callable[[Sequence[Outcome]], None]
TASKS_PER_WORKER = 4
"""Tasks that are submitted at a time, so that no worker waits for the next."""
MAX_CASES_PER_TASK = 4096
LOST = "its worker process ended: killed, crashed or out of memory"


@dataclass(frozen=True)
class Place:
    """Where cases are computed.

    Attributes:
        open: returns a context of the executor that computes them.
        n_tasks: returns the number of tasks to be submitted at a time.
        task_time: returns the time that a task is to take at least [s], so that its own cost does
            not count; 0 for one case per task.
        lost: error of a task whose worker process ended.
    """

    open: Callable[[], AbstractContextManager[Executor]]
    n_tasks: Callable[[], int] = lambda: 1
    task_time: Callable[[], float] = lambda: 0.0
    lost: type[Exception] = BrokenExecutor


class SerialExecutor(Executor):
    """Executor that computes a task in this process, when it is submitted."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Return the future of a task that is done."""
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def local_place(processes: int) -> Place:
    """Return worker processes on this machine; for one process, this one."""
    if processes == 1:
        return Place(SerialExecutor)
    return Place(lambda: _open_pool(processes), lambda: TASKS_PER_WORKER * processes)


@contextmanager
def _open_pool(processes: int) -> Iterator[Executor]:
    """Open a pool of processes, which end at once if the block ends with an error."""
    from multiprocessing import active_children

    others = set(active_children())
    pool = make_pool(processes)
    try:
        try:
            pool.submit(int).result()
        except BrokenExecutor:
            words = "end when they start: a script needs  if __name__ == '__main__':  around sweep"
            raise ParameterError("processes", words) from None
        yield pool
        pool.shutdown()
    except BaseException:  # also for an interrupt
        end_pool(pool, others)
        raise


def run_cases(place: Place, template: CaseTemplate, cases: Iterator[Case], record: Record) -> None:
    """Compute cases and record each when it is done, in any order.

    A case whose worker process ends is computed once more alone; if that process ends too, its
    outcome is an error.

    Args:
        place: where to compute.
        template: what the cases share.
        cases: number and values of each.
        record: called in this thread with outcomes.
    """
    while lost := _run_until_lost(place, template, cases, record, place.n_tasks):
        alone = iter(lost)
        while culprits := _run_until_lost(place, template, alone, record, lambda: 1):
            record([Outcome(index, error=LOST) for index, _ in culprits])


def _run_until_lost(
    place: Place, template: CaseTemplate, cases: Iterator[Case], record: Record,
    n_tasks: Callable[[], int],
) -> list[Case]:  # fmt: skip
    """Compute cases until a worker process ends; return the cases that are lost."""
    lost: list[Case] = []
    tasks: dict[Future[Any], list[Case]] = {}
    done = SimpleQueue[Future[Any]]()
    size = 1
    with place.open() as executor:
        while True:
            while not lost and len(tasks) < n_tasks() and (batch := list(islice(cases, size))):
                future = _submit(executor, place, template, batch)
                tasks[future] = batch
                future.add_done_callback(done.put)
            if not tasks:
                return lost
            future = done.get()
            batch = tasks.pop(future)
            try:
                seconds, outcomes = future.result()
            except place.lost:
                lost += batch
                continue
            record(outcomes)
            ideal = place.task_time() * len(batch) / max(seconds, 1e-9)
            size = max(1, min(MAX_CASES_PER_TASK, round(ideal)))


def _submit(
    executor: Executor, place: Place, template: CaseTemplate, batch: list[Case]
) -> Future[Any]:
    try:
        return executor.submit(compute_cases, template, batch)
    except place.lost as error:
        future: Future[Any] = Future()
        future.set_exception(error)
        return future

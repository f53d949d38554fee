"""The engine of a sweep: submit tasks to an executor, and record what comes back."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future
from itertools import islice
from queue import SimpleQueue
from typing import Any

from asperity.sweeps.compute_cases import Case, Outcome, compute_cases
from asperity.sweeps.places import Place
from asperity.sweeps.sweep_plan import CaseTemplate

Record = Callable[[Iterable[Outcome]], None]
MAX_CASES_PER_TASK = 4096
LOST = "its worker process ended: killed, crashed or out of memory"
_SMOOTHING = 0.2


class _Batches:
    """The cases that are left, in batches that take about the same time."""

    def __init__(self, cases: Iterator[Case], task_time: float) -> None:
        self._cases, self._task_time = cases, task_time
        self._mean: float | None = None  # time of a case [s]

    def take(self) -> list[Case]:
        """Return the next cases; none at the end."""
        size = 1.0
        if self._mean is not None and self._task_time:
            size = self._task_time / max(self._mean, 1e-9)
        return list(islice(self._cases, max(1, min(MAX_CASES_PER_TASK, round(size)))))

    def learn(self, seconds: float, count: int) -> None:
        """Take the time of a batch into account."""
        mean = seconds / count
        self._mean = mean if self._mean is None else self._mean + _SMOOTHING * (mean - self._mean)


def run_cases(place: Place, template: CaseTemplate, cases: Iterable[Case], record: Record) -> None:
    """Compute cases and record each when it is done, in any order.

    A case whose worker process ends is computed once more alone; if that process ends too, its
    outcome is an error.

    Args:
        place: where to compute.
        template: what the cases share.
        cases: number and values of each.
        record: called in this thread with outcomes.
    """
    batches = _Batches(iter(cases), place.task_time)
    while lost := _run_until_lost(place, template, batches, record):
        alone = _Batches(iter(lost), 0.0)
        while culprits := _run_until_lost(place, template, alone, record, limit=1):
            record(Outcome(index, error=LOST) for index, _ in culprits)


def _run_until_lost(
    place: Place, template: CaseTemplate, batches: _Batches, record: Record, limit: int = 0
) -> list[Case]:
    """Compute batches until a worker process ends; return the cases that are lost."""
    lost: list[Case] = []
    tasks: dict[Future[Any], list[Case]] = {}
    done: SimpleQueue[Future[Any]] = SimpleQueue()
    with place.open() as executor:
        while True:
            while not lost and len(tasks) < (limit or place.count_tasks()):
                if not (batch := batches.take()):
                    break
                future = _submit(executor, place, template, batch)
                if future is None:
                    lost += batch
                    break
                tasks[future] = batch
                future.add_done_callback(done.put)
            if not tasks:
                return lost
            future = done.get()
            lost += _collect(future, tasks.pop(future), place, batches, record)


def _submit(
    executor: Executor, place: Place, template: CaseTemplate, batch: list[Case]
) -> Future[Any] | None:
    """Return the future of a task; ``None`` if the executor has lost a worker."""
    try:
        return executor.submit(compute_cases, template, batch)
    except Exception as error:
        if not place.is_lost(error):
            raise
        return None


def _collect(
    future: Future[Any], batch: list[Case], place: Place, batches: _Batches, record: Record
) -> list[Case]:
    """Record the outcomes of a task; return its cases if its worker ended."""
    try:
        seconds, outcomes = future.result()
    except Exception as error:
        if not place.is_lost(error):
            raise
        return batch
    batches.learn(seconds, len(batch))
    record(outcomes)
    return []

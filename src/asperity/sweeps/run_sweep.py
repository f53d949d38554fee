"""Sweep a scene: compute all cases of a plan that are not in its results folder.

Cases are submitted to an executor, and what comes back is recorded: computed in this process, in
processes of this machine, or by the workers of Dask's distributed scheduler.
"""

from __future__ import annotations

import logging
import os
import tempfile
import time
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from asperity.core.arguments import check_integer
from asperity.core.errors import ParameterError
from asperity.core.processes import MAIN_GUARD_HINT, available_cores, end_pool, make_pool
from asperity.sweeps.case_runs import Case, CaseTemplate, Outcome, compute_cases
from asperity.sweeps.sweep_plan import SweepPlan, make_plan
from asperity.sweeps.sweep_result import ResultStore, SweepResult

Progress = Callable[[float], object]


def sweep(
    scene: str | os.PathLike[str],
    vary: Mapping[str, str],
    run: str = "compare",
    *,
    laws: str | Sequence[str] | None = None,
    design: str = "",
    folder: str | os.PathLike[str] | None = None,
    processes: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> SweepResult:
    """Compute a scene for many values of its keys.

    Every case is computed from its own text alone, which also seeds random numbers: its rows do not
    depend on the order of the cases or on where they are computed.

    Args:
        scene: path of a scene file, or a surface as for :func:`asperity.compare`.
        vary: values by key, as on the command line: ``{"texture.period": "0.5mm:4mm:40log",
            "device": "touch,omega.3"}``. The last key changes fastest.
        run: ``"compare"``, ``"limits"``, ``"onset"``, ``"scan"`` or ``"bake"``, which makes the
            fields of law H and keeps them in the cache.
        laws: letters or names, for runs with several laws; all by default.
        design: ``"sobol:64"`` for that many points of a Sobol sequence over the ranges, which are
            then ``"0.5mm:4mm"`` or ``"0.5mm:4mm:log"``; by default all combinations.
        folder: results folder. The same call goes on where an earlier one was stopped. Default: a
            temporary one, which lives as long as the result.
        processes: number of worker processes; 1 for none; default: one per core. A script that
            starts some needs the usual ``if __name__ == "__main__":``.
        scheduler: address of a scheduler of Dask, whose workers compute instead; see
            :func:`~asperity.sweeps.run_sweep.cluster_place`.
        progress: called with the completed fraction of the cases that were left.
        **options: further arguments of :func:`asperity.compare`, :func:`asperity.limits`,
            :func:`asperity.onset` or :func:`asperity.scan`.

    Raises:
        ParameterError: for an unknown key or a value that cannot be used, a folder of another
            sweep, or if every case fails.

    Example:
        >>> result = sweep("sinusoid:amplitude=0.1mm", {"texture.period": "1mm:2mm:2"}, "compare",
        ...                laws="WA", processes=1)
        >>> [(row["texture.period [m]"], row["law"]) for row in result.table_rows()]
        [(0.001, 'W'), (0.001, 'A'), (0.002, 'W'), (0.002, 'A')]
    """
    if processes is None:
        processes = available_cores()
    check_integer("processes", processes, 1)
    plan = make_plan(os.fspath(scene), vary, run, design=design, laws=laws, options=options)
    if scheduler is not None:
        return run_plan(plan, cluster_place(scheduler), folder, progress)
    return run_plan(plan, local_place(processes), folder, progress)


def run_plan(
    plan: SweepPlan,
    place: Place,
    folder: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> SweepResult:
    """Compute the cases of a plan that are not in a folder; see :func:`sweep`."""
    store = open_store(plan, folder)
    left = len(plan) - store.n_done

    def record(outcomes: Sequence[Outcome]) -> None:
        store.record(outcomes)
        if progress is not None:
            progress(1.0 - (len(plan) - store.n_done) / left)

    try:
        if left:
            run_cases(place, plan.template, missing_cases(plan, store), record)
    finally:
        store.release()
    result = SweepResult(plan, store)
    if len(result.errors) == len(plan):
        first = result.errors[0]
        raise ParameterError("sweep", f"failed in each of {len(plan)} cases, the first: {first}")
    return result


def open_store(plan: SweepPlan, folder: str | os.PathLike[str] | None) -> ResultStore:
    """Return the results folder of a plan; a temporary one lives as long as the store."""
    if folder is not None:
        return ResultStore(Path(folder), plan.describe(), len(plan))
    temporary = tempfile.TemporaryDirectory(prefix="asperity-sweep-", ignore_cleanup_errors=True)
    store = ResultStore(Path(temporary.name), plan.describe(), len(plan))
    weakref.finalize(store, temporary.cleanup)
    return store


def missing_cases(plan: SweepPlan, store: ResultStore) -> Iterator[Case]:
    """Yield the cases that are not recorded."""
    return ((i, plan.values(i)) for i in range(len(plan)) if i not in store)


def estimate_case_time(plan: SweepPlan) -> float:
    """Return the time of a case [s]: of the last one, after the first has compiled what they need.

    Neither is recorded.
    """
    compute_cases(plan.template, [(0, plan.values(0))])
    return compute_cases(plan.template, [(len(plan) - 1, plan.values(len(plan) - 1))])[0]


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
    pool = None
    with suppress(OSError):  # no room for semaphores, as in some containers
        pool = make_pool(processes)
    if pool is None:
        yield SerialExecutor()
        return
    try:
        try:
            pool.submit(int).result()
        except BrokenExecutor:
            reason = f"end when they start: {MAIN_GUARD_HINT}"
            raise ParameterError("processes", reason) from None
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
    place: Place,
    template: CaseTemplate,
    cases: Iterator[Case],
    record: Record,
    n_tasks: Callable[[], int],
) -> list[Case]:
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


TASK_TIME = 0.5
TASK_TIME_PER_WORKER = 2e-3
"""Time that a task is to take at least [s]: all workers together then finish at most 500 tasks in a
second, half of what the scheduler manages (0.2 to 1 ms for each)."""
_CONNECT_TIME = 10.0
_MAX_TASKS = 10_000


def cluster_place(address: str) -> Place:
    """Return the workers of a scheduler of Dask.

    Workers may join and leave while cases are computed; a task of a worker that ends is computed by
    another. A worker with another version of asperity is an error.

    Args:
        address: "tcp://host:8786", or as for ``distributed.Client``.

    Raises:
        ParameterError: if distributed is not installed.
    """
    try:
        from distributed.scheduler import KilledWorker
    except ImportError:
        reason = "needs Dask's distributed: pip install 'asperity[cluster]'"
        raise ParameterError("scheduler", reason) from None
    clients: list[Any] = []

    @contextmanager
    def connect() -> Iterator[Executor]:
        with _connect(address) as client:
            clients[:] = [client]
            yield _ClientExecutor(client)

    @lru_cache(maxsize=1)
    def count_workers(_second: int) -> int:
        return len(clients[0].scheduler_info(n_workers=-1)["workers"])

    def workers() -> int:
        return max(1, count_workers(int(time.monotonic())))  # asked for once a second

    return Place(
        connect,
        lambda: min(_MAX_TASKS, TASKS_PER_WORKER * workers()),
        lambda: max(TASK_TIME, TASK_TIME_PER_WORKER * workers()),
        KilledWorker,
    )


class _ClientExecutor(Executor):
    """Executor of a client; that of Dask fails at times for a result that was lost with a worker.

    Args:
        client: of a scheduler.
    """

    def __init__(self, client: Any) -> None:
        self._client = client

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Return the future of a task that any worker computes."""
        future: Future[Any] = Future()
        remote = self._client.submit(fn, *args, pure=False, **kwargs)
        self._client.loop.add_callback(self._copy_result, remote, future)
        return future

    async def _copy_result(self, remote: Any, future: Future[Any]) -> None:
        try:
            future.set_result(await self._client.gather(remote, asynchronous=True))
        except BaseException as error:  # also a cancelled task
            future.set_exception(error)


@contextmanager
def _connect(address: str) -> Iterator[Any]:
    """Open a client whose scheduler has the same versions."""
    from distributed import Client

    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # its messages are not for the user
    try:
        client = Client(address, timeout=_CONNECT_TIME, set_as_default=False)
        versions = client.get_versions()
    except (OSError, ValueError, TypeError) as error:
        reason = f"cannot be reached: {' '.join(str(error).split())[:200]}"
        raise ParameterError("scheduler", reason, address) from None
    with client:
        _check_versions(versions)
        try:
            yield client
        except (CancelledError, OSError) as error:
            reason = f"was lost ({type(error).__name__}): the same command goes on from here"
            raise ParameterError("scheduler", reason, address) from None


def _check_versions(versions: dict[str, Any]) -> None:
    """Check that scheduler and workers have the Python and the Dask of this process."""
    expected = versions["client"]["packages"]
    for other in (versions["scheduler"], *versions["workers"].values()):
        packages = other["packages"] if other else {}
        for name in ("python", "distributed", "msgpack", "cloudpickle"):
            if packages.get(name) != expected[name]:
                reason = f"has {name} {packages.get(name)}, this process {expected[name]}"
                raise ParameterError("scheduler", reason)

"""A cluster as the place of a sweep: workers of Dask's distributed scheduler."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

from asperity.core.errors import ParameterError
from asperity.sweeps.engine import TASKS_PER_WORKER, Place

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
        words = "needs Dask's distributed: pip install 'asperity[cluster]'"
        raise ParameterError("scheduler", words) from None
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
        words = f"cannot be reached: {' '.join(str(error).split())[:200]}"
        raise ParameterError("scheduler", words, address) from None
    with client:
        _check_versions(versions)
        try:
            yield client
        except (CancelledError, OSError) as error:
            words = f"was lost ({type(error).__name__}): the same command goes on from here"
            raise ParameterError("scheduler", words, address) from None


def _check_versions(versions: dict[str, Any]) -> None:
    """Check that scheduler and workers have the Python and the Dask of this process."""
    own = versions["client"]["packages"]
    for other in (versions["scheduler"], *versions["workers"].values()):
        packages = other["packages"] if other else {}
        for name in ("python", "distributed", "msgpack", "cloudpickle"):
            if packages.get(name) != own[name]:
                words = f"has {name} {packages.get(name)}, this process {own[name]}"
                raise ParameterError("scheduler", words)

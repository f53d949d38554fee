"""The cluster: the same table from Dask's workers, also while some are killed, leave and join."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from asperity.core.errors import ParameterError
from asperity.sweeps import run_sweep
from asperity.sweeps.run_sweep import LOST, local_place, run_plan
from asperity.sweeps.sweep_plan import SweepPlan

distributed: Any = pytest.importorskip("distributed", reason="not run: no distributed here")
dask_config: Any = pytest.importorskip("dask", reason="not run: no dask here").config
# Dask leaves sockets to the garbage collector.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
MakePlan = Callable[..., SweepPlan]


class Cluster:
    """A scheduler and workers, each a process of its own; a context manager."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.stack = ExitStack()
        self.workers = list[subprocess.Popen[bytes]]()

    def __enter__(self) -> Cluster:
        contact = self.folder / "scheduler.json"
        place = ("--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(contact))
        self.scheduler = self._start("dask_scheduler", *place, "--no-dashboard")
        self.address = self._read_address(contact)
        return self

    def __exit__(self, *_: object) -> None:
        self.stack.close()

    def add_worker(self) -> None:
        options = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--memory-limit", "0")
        self.workers.append(self._start("dask_worker", self.address, *options))

    def wait(self, count: int) -> None:
        """Wait for a number of workers."""
        with distributed.Client(self.address, timeout=60, set_as_default=False) as client:
            client.wait_for_workers(count, timeout=60)

    def _read_address(self, contact: Path) -> str:
        """The address at which the scheduler listens, once it has written it."""
        for _ in range(1200):
            with suppress(OSError, json.JSONDecodeError):
                return str(json.loads(contact.read_text())["address"])
            assert self.scheduler.poll() is None, "the scheduler ended"
            time.sleep(0.05)
        raise AssertionError("the scheduler wrote no address within a minute")

    def _start(self, module: str, *arguments: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.{module}", *arguments]
        log = self.stack.enter_context((self.folder / f"{module}.log").open("ab"))
        process = subprocess.Popen(command, stdout=log, stderr=log, cwd=self.folder)
        self.stack.callback(process.wait)
        self.stack.callback(process.kill)
        return process


@pytest.fixture
def dask(tmp_path: Path) -> Iterator[Cluster]:
    with Cluster(tmp_path) as running:
        yield running


def table(plan: SweepPlan, place: Any, path: Path) -> bytes:
    run_plan(plan, place).to_csv(path)
    return path.read_bytes()


def test_the_table_is_the_same_while_workers_are_killed_leave_and_join(
    dask: Cluster, counting_plan: MakePlan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SWEEP_PAUSE", "0.01")  # for the workers
    monkeypatch.setattr(run_sweep, "TASK_TIME", 0.1)
    plan = counting_plan("texture.period=1mm:2mm:900")
    for _ in range(3):
        dask.add_worker()
    dask.wait(3)
    done, events = [0.0], list[str]()

    def disturb() -> None:
        for fraction, name, action in (
            (0.15, "killed", dask.workers[0].kill),
            (0.3, "left", lambda: dask.workers[1].send_signal(signal.SIGTERM)),
            (0.45, "joined", dask.add_worker),
        ):
            while done[0] < fraction:
                time.sleep(0.01)
            action()
            events.append(name)

    thread = threading.Thread(target=disturb, daemon=True)
    thread.start()
    place = run_sweep.cluster_place(dask.address)
    result = run_plan(plan, place, tmp_path / "run", lambda part: done.__setitem__(0, part))
    thread.join()
    assert events == ["killed", "left", "joined"]
    assert dask.workers[0].wait() == -signal.SIGKILL
    result.to_csv(tmp_path / "cluster.csv")
    monkeypatch.setenv("SWEEP_PAUSE", "0")
    assert (tmp_path / "cluster.csv").read_bytes() == table(
        plan, local_place(1), tmp_path / "serial.csv"
    )


def test_errors_and_lost_workers_are_rows(
    counting_plan: MakePlan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = counting_plan("texture.period=1mm:2mm:5", failing=1.25e-3, crashing=1.75e-3)
    monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "0")
    with Cluster(tmp_path) as dask:
        for _ in range(3):  # two of which the crash ends
            dask.add_worker()
        dask.wait(3)
        result = run_plan(plan, run_sweep.cluster_place(dask.address))
    assert result.errors == {1: "period fails here, got 0.00125", 3: LOST}


def test_a_scheduler_that_ends_is_one_line(
    dask: Cluster, counting_plan: MakePlan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SWEEP_PAUSE", "0.02")
    plan = counting_plan("texture.period=1mm:2mm:400")
    dask.add_worker()
    dask.wait(1)

    def end(fraction: float) -> None:
        if fraction > 0.05:
            dask.scheduler.kill()

    with (
        dask_config.set({"distributed.comm.timeouts.connect": "1s"}),
        pytest.raises(ParameterError, match=r"scheduler was lost .*: the same command goes on"),
    ):
        run_plan(plan, run_sweep.cluster_place(dask.address), tmp_path / "run", end)
    assert len(run_plan(plan, local_place(1), tmp_path / "run").table_rows()) == 400


def test_a_worker_of_another_version_is_refused(dask: Cluster, counting_plan: MakePlan) -> None:
    plan = counting_plan("texture.period=1mm,2mm")
    dask.add_worker()
    other = replace(plan, template=replace(plan.template, package="other"))
    with pytest.raises(ParameterError, match="scheduler has a worker with another version"):
        run_plan(other, run_sweep.cluster_place(dask.address))


def test_another_version_of_dask_is_refused(
    dask: Cluster, counting_plan: MakePlan, monkeypatch: pytest.MonkeyPatch
) -> None:
    with distributed.Client(dask.address, timeout=60, set_as_default=False) as client:
        versions = client.get_versions()
    versions["scheduler"]["packages"]["distributed"] = "1.0"
    monkeypatch.setattr(distributed.Client, "get_versions", lambda _client: versions)
    with pytest.raises(ParameterError, match=r"scheduler has distributed 1\.0, this process 20"):
        run_plan(counting_plan("texture.period=1mm,2mm"), run_sweep.cluster_place(dask.address))


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nowhere", "tcp://", "gopher://x:1"])
def test_a_scheduler_that_cannot_be_reached(
    address: str, counting_plan: MakePlan, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_sweep, "_CONNECT_TIME", 0.5)
    with pytest.raises(ParameterError, match="scheduler cannot be reached") as caught:
        run_plan(counting_plan("texture.period=1mm,2mm"), run_sweep.cluster_place(address))
    assert "\n" not in str(caught.value)


def test_without_distributed_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed.scheduler", None)
    with pytest.raises(ParameterError, match=r"pip install 'asperity\[cluster\]'"):
        run_sweep.cluster_place("tcp://127.0.0.1:9")

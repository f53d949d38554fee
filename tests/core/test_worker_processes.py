"""Worker processes: the same results with any number of them, and all of them end."""

from __future__ import annotations

import math
import os
import pickle
import subprocess
import sys
import time
from concurrent.futures import CancelledError, Future, ProcessPoolExecutor
from importlib import import_module
from multiprocessing import active_children
from multiprocessing.context import SpawnProcess
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import pytest

from asperity.analysis.results.compare import compare
from asperity.analysis.results.comparison_rows import precompute_row
from asperity.core import cache, processes
from asperity.core.compiled import COMPILE_CALLBACKS
from asperity.core.files import json_text
from asperity.paper.cycle_experiments import band_setup
from asperity.report import html_text
from asperity.report.document.html import RenderedPicture
from asperity.report.pages.catalogue_report import find_surfaces
from asperity.scene import sweeps
from asperity.textures import Sinusoid
from asperity.textures.catalogue import CATALOGUE


def workers() -> list[Any]:
    """Return the worker processes that run; the tests' reader of files is forked, not spawned."""
    return [child for child in active_children() if isinstance(child, SpawnProcess)]


@pytest.fixture(autouse=True)
def no_delay(monkeypatch: pytest.MonkeyPatch) -> None:
    """Start workers without a delay."""
    monkeypatch.setattr(processes, "START_DELAY", 0.0)


@pytest.fixture
def started_workers(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return a list to which each started pool appends its number of workers."""
    counts: list[int] = []
    make = processes.make_pool

    def record(workers: int, *arguments: Any) -> Any:
        counts.append(workers)
        return make(workers, *arguments)

    monkeypatch.setattr(processes, "make_pool", record)
    return counts


@pytest.fixture
def futures(monkeypatch: pytest.MonkeyPatch) -> list[Future[Any]]:
    """Return a list to which each task submitted to a worker is appended."""
    submitted: list[Future[Any]] = []
    submit = ProcessPoolExecutor.submit

    def record(*arguments: Any) -> Future[Any]:
        submitted.append(submit(*arguments))
        return submitted[-1]

    monkeypatch.setattr(ProcessPoolExecutor, "submit", record)
    return submitted


def completed_results(futures: list[Future[Any]]) -> list[Any]:
    completed = [future for future in futures if future.done() and not future.cancelled()]
    return [future.result() for future in completed if future.exception() is None]


def run_precompute(work: Any, tasks: list[Any], jobs: int, wait: float = 0.0) -> list[Any]:
    """Return the results of workers; the caller waits for each task that it does itself (None)."""
    values = []
    with processes.limit_processes(jobs), processes.precompute(work, tasks) as iterator:
        for value in iterator:
            values.append(value)
            time.sleep(wait if value is None else 0.0)
    return values


@pytest.mark.parametrize("jobs", [1, 2, 3])
def test_every_task_is_yielded_once_with_its_result_or_none(
    jobs: int, started_workers: list[int]
) -> None:
    tasks = [float(number) for number in range(12)]
    values = run_precompute(math.sqrt, tasks, jobs, wait=0.3)
    assert len(values) == 12
    assert all(value in (None, math.sqrt(task)) for value, task in zip(values, tasks, strict=True))
    assert (values.count(None) < 12) == (jobs > 1)
    assert started_workers == [jobs - 1] * (jobs > 1)
    assert workers() == []


def test_fast_tasks_start_no_workers(
    monkeypatch: pytest.MonkeyPatch, started_workers: list[int]
) -> None:
    monkeypatch.setattr(processes, "START_DELAY", 30.0)
    assert run_precompute(math.sqrt, [1.0] * 5, 2) == [None] * 5
    assert started_workers == []


def test_compilation_starts_the_workers(
    monkeypatch: pytest.MonkeyPatch, started_workers: list[int]
) -> None:
    monkeypatch.setattr(processes, "START_DELAY", 30.0)
    with processes.limit_processes(2), processes.precompute(math.sqrt, [1.0] * 5) as iterator:
        next(iterator)
        (callback,) = COMPILE_CALLBACKS
        callback("force_batch")
        assert started_workers == [1]
    assert COMPILE_CALLBACKS == []
    assert workers() == []


def report_a_quarter(seconds: float) -> float:
    """Report a quarter of a task, which then takes a time [s]."""
    processes.report_fraction(0.25)
    time.sleep(seconds)
    return seconds


def test_progress_of_the_worker_that_is_waited_for_is_reported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Not that of another task."""
    monkeypatch.setattr(processes, "REPORT_PERIOD", 0.1)
    reported: list[float] = []
    monkeypatch.setattr(processes, "PROGRESS_CALLBACKS", [reported.append])
    for work in (report_a_quarter, time.sleep):
        with processes.limit_processes(2), processes.precompute(work, [0.5] * 2) as results:
            next(results)
            time.sleep(0.2)
            next(results)
        assert (set(reported) == {0.25}) == (work is report_a_quarter)
        reported.clear()


def test_task_that_fails_in_a_worker_is_left_to_the_caller() -> None:
    assert run_precompute(math.sqrt, [-1.0] * 6, 2, wait=0.2) == [None] * 6  # it raises
    assert run_precompute(lambda task: task, [1.0] * 6, 2, wait=0.2) == [None] * 6  # not picklable
    assert run_precompute(os._exit, [1] * 6, 2, wait=0.2) == [None] * 6  # the worker dies
    assert workers() == []


def test_interrupt_ends_all_worker_processes(started_workers: list[int]) -> None:
    def run_interrupted() -> None:
        with processes.limit_processes(2), processes.precompute(time.sleep, [60.0] * 4) as tasks:
            next(tasks)
            while not started_workers:
                time.sleep(0.01)
            raise KeyboardInterrupt

    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        run_interrupted()
    assert workers() == []
    assert time.monotonic() - start < 30.0


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path))
    return tmp_path


WAVE = Sinusoid(0.31e-3, 1.3e-3)


@pytest.mark.caches_results
@pytest.mark.usefixtures("empty_cache")
def test_comparison_does_not_depend_on_the_workers(
    started_workers: list[int], futures: list[Future[Any]]
) -> None:
    def compare_json() -> str:
        return json_text(compare(WAVE, laws="WACE", stiffness=700.0))

    expected = compare_json()
    cache.clear()
    with processes.limit_processes(2):
        assert compare_json() == expected
    assert started_workers == [1]
    assert workers() == []
    assert completed_results(futures)


@pytest.mark.caches_results
@pytest.mark.usefixtures("empty_cache")
def test_report_does_not_depend_on_the_workers(
    monkeypatch: pytest.MonkeyPatch, futures: list[Future[Any]]
) -> None:
    result = compare(WAVE, laws="WA", stiffness=700.0)
    expected = html_text(result)
    cache.clear()
    with processes.limit_processes(2):
        assert html_text(result) == expected
    assert any(isinstance(value, RenderedPicture) for value in completed_results(futures))
    html = import_module("asperity.report.document.html")
    monkeypatch.setattr(html, "render_picture", lambda _picture: None)
    assert html_text(result) == expected  # pictures of workers are cached


@pytest.mark.parametrize("workers", [1, 3])
def test_onsets_do_not_depend_on_the_threads(monkeypatch: pytest.MonkeyPatch, workers: int) -> None:
    monkeypatch.setattr(sweeps, "available_cores", lambda: workers)
    steps: list[int] = []
    cells = sweeps.sweep_onsets(
        band_setup("W"),
        "WA",
        (0, 3),
        n_phases=2,
        min_stiffness=5.0,
        progress=lambda: steps.append(1),
    ).onsets
    by_law = [f"{cell.onset.law}{cell.onset.delay}" for cell in cells]
    assert by_law == ["W0", "W3", "A0", "A3"]
    assert len(steps) == 4
    for cell in cells[::3]:
        setup = band_setup(cell.onset.law)
        single = sweeps.sweep_onsets(
            setup, cell.onset.law, (cell.onset.delay,), n_phases=2, min_stiffness=5.0
        )
        assert single.onsets[0].onset == cell.onset


def test_threads_are_notified_of_an_interrupt(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweeps, "available_cores", lambda: 2)
    work_started, over, notified = Event(), Event(), []

    def work(number: int) -> None:
        if number == 0:
            work_started.wait(60.0)
            raise KeyboardInterrupt
        work_started.set()
        notified.append(over.wait(10.0))

    with pytest.raises(KeyboardInterrupt):
        sweeps.map_threads(work, [(0,), (1,)], over)
    assert notified == [True]


def test_onset_search_ends_after_an_interrupt(monkeypatch: pytest.MonkeyPatch) -> None:
    progress_calls: list[int] = []
    over = Event()
    monkeypatch.setattr(sweeps, "map_threads", lambda work, jobs, _over: [work(*jobs[0])])
    monkeypatch.setattr(sweeps, "Event", lambda: over)
    over.set()
    with pytest.raises(CancelledError):
        sweeps.sweep_onsets(
            band_setup("W"), "W", (0, 1), n_phases=2, progress=lambda: progress_calls.append(1)
        )
    assert not progress_calls


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_surface_can_be_pickled(name: str) -> None:
    texture = find_surfaces([name])[0].texture
    points = texture.domain.points(np.full((1, len(texture.domain.spans)), 0.3))
    heights = texture.height(points)  # by now it holds compiled loops
    copy = pickle.loads(pickle.dumps(texture))
    assert copy.describe() == texture.describe()
    assert (copy.height(points) == heights).all()


@pytest.mark.caches_results
@pytest.mark.usefixtures("empty_cache")
def test_precomputed_row_stores_all_results(monkeypatch: pytest.MonkeyPatch) -> None:
    module = import_module("asperity.analysis.results.compare")
    tasks: list[Any] = []

    def record(surfaces: Any, query: Any) -> list[Any]:
        tasks.extend(intact(surfaces, query))
        return [None] * len(surfaces)

    intact = module._precompute_tasks
    monkeypatch.setattr(module, "_precompute_tasks", record)
    with monkeypatch.context() as patch:
        patch.setattr(cache, "put_entry", lambda *_: None)
        compare(WAVE, laws="D")
    precompute_row(tasks[0])
    stored: list[str] = []
    monkeypatch.setattr(cache, "put_entry", lambda _namespace, key, _content: stored.append(key))
    compare(WAVE, laws="D")
    assert stored == []


_THREADS = """
import os, sys
import asperity.__main__ as program
program._prepare_streams()
assert "numpy" not in sys.modules
print(*(os.environ[name] for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")))
"""


def test_command_uses_one_thread_of_linear_algebra() -> None:
    """Workers use one thread, and with two a form fitted to a map differs in the last digit."""
    process = subprocess.run(
        [sys.executable, "-c", _THREADS],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "7"},
    )
    assert process.stdout.split() == ["1", "1"]


@pytest.mark.parametrize("where", ["pool", "task"])
def test_without_room_for_workers_this_process_does_all(
    monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    """Containers may have no /dev/shm for semaphores, or no more processes."""

    def refuse(*_: Any) -> Any:
        raise OSError(30, "Read-only file system")

    pool = ProcessPoolExecutor(1)
    monkeypatch.setattr(pool, "submit", refuse)
    monkeypatch.setattr(processes, "make_pool", refuse if where == "pool" else lambda *_: pool)
    failures: list[Any] = []
    monkeypatch.setattr("threading.excepthook", failures.append)
    with processes.limit_processes(2), processes.precompute(math.sqrt, [1.0, 4.0]) as results:
        time.sleep(0.2)
        assert list(results) == [None, None]
    assert failures == []

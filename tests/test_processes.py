"""Helpers: the same results whatever they do, and none of them left behind."""

from __future__ import annotations

import math
import os
import pickle
import subprocess
import sys
import time
from concurrent.futures import CancelledError
from importlib import import_module
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import pytest

from asperity import cache, kept, processes
from asperity.analysis import compare
from asperity.analysis.compare import answer_ahead
from asperity.compiled import LISTENERS
from asperity.files import json_text
from asperity.paper.experiments.settings import band_setup
from asperity.report.html import html_text
from asperity.report.page import Picture
from asperity.report.surfaces import listed_surfaces
from asperity.scene import sweeps
from asperity.textures import Sinusoid
from asperity.textures.catalogue import CATALOGUE


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Helpers begin without waiting."""
    monkeypatch.setattr(processes, "PATIENCE", 0.0)


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The processes that are started."""
    found: list[Any] = []
    start = processes._Board._start

    def noted(board: Any) -> Any:
        found.append(start(board))
        return found[-1]

    monkeypatch.setattr(processes._Board, "_start", noted)
    return found


@pytest.fixture
def heard(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What helpers have answered."""
    answers: list[Any] = []
    asked = processes._asked

    def noted(process: Any, question: Any) -> Any:
        answers.append(asked(process, question))
        return answers[-1]

    monkeypatch.setattr(processes, "_asked", noted)
    return answers


def told(work: Any, tasks: list[Any], jobs: int, wait: float = 0.0) -> list[Any]:
    """Return what helpers have found, None for what is to be done here, which takes a while."""
    result = []
    with processes.at_most(jobs), processes.helped(work, tasks) as turns:
        for found in turns:
            result.append(found)
            time.sleep(wait if found is None else 0.0)
    return result


def ended(started: list[Any]) -> bool:
    return all(process.poll() is not None for process in started)


@pytest.mark.parametrize("jobs", [1, 2, 3])
def test_every_task_has_its_turn_and_what_is_found_is_right(jobs: int, started: list[Any]) -> None:
    tasks = [float(number) for number in range(12)]
    found = told(math.sqrt, tasks, jobs, wait=0.3)
    assert len(found) == 12
    assert all(one in (None, math.sqrt(task)) for one, task in zip(found, tasks, strict=True))
    assert (found.count(None) < 12) == (jobs > 1)
    assert found[0] is None
    assert len(started) <= jobs - 1
    assert ended(started)


def test_no_helper_for_what_is_done_at_once(
    monkeypatch: pytest.MonkeyPatch, started: list[Any]
) -> None:
    monkeypatch.setattr(processes, "PATIENCE", 30.0)
    assert told(math.sqrt, [1.0] * 5, 2) == [None] * 5
    assert started == []


def test_what_compiles_needs_a_helper_soon(
    monkeypatch: pytest.MonkeyPatch, started: list[Any]
) -> None:
    monkeypatch.setattr(processes, "PATIENCE", 30.0)
    with processes.at_most(2), processes.helped(math.sqrt, [1.0] * 5) as turns:
        next(turns)
        (tell,) = LISTENERS
        tell("force_batch")
        before = time.monotonic()
        while not started:
            assert time.monotonic() - before < 20.0
            time.sleep(0.01)
    assert LISTENERS == []
    assert ended(started)


def test_what_a_helper_cannot_do_is_done_here(started: list[Any]) -> None:
    assert told(math.sqrt, [-1.0] * 6, 2, wait=0.2) == [None] * 6  # it raises
    assert told(lambda task: task, [1.0] * 6, 2, wait=0.2) == [None] * 6  # it cannot be sent
    assert told(os._exit, [1] * 6, 2, wait=0.2) == [None] * 6  # it dies
    assert ended(started)


def test_an_interrupt_leaves_no_process_behind(started: list[Any]) -> None:
    def interrupted() -> None:
        with processes.at_most(2), processes.helped(time.sleep, [60.0] * 4) as turns:
            next(turns)
            while not started:
                time.sleep(0.01)
            raise KeyboardInterrupt

    before = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert ended(started)
    assert time.monotonic() - before < 30.0


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path))
    return tmp_path


WAVE = Sinusoid(0.31e-3, 1.3e-3)


@pytest.mark.keeps_answers
@pytest.mark.usefixtures("own_cache")
def test_a_comparison_is_the_same_however_many_work_on_it(
    started: list[Any], heard: list[Any]
) -> None:
    def answer() -> str:
        return json_text(compare(WAVE, laws="WACE", stiffness=700.0))

    alone = answer()
    cache.clear()
    with processes.at_most(2):
        assert answer() == alone
    assert len(started) == 1
    assert ended(started)
    assert heard  # it was of use


@pytest.mark.keeps_answers
@pytest.mark.usefixtures("own_cache")
def test_a_report_is_the_same_however_many_draw_it(
    monkeypatch: pytest.MonkeyPatch, heard: list[Any]
) -> None:
    result = compare(WAVE, laws="WA", stiffness=700.0)
    alone = html_text(result)
    cache.clear()
    with processes.at_most(2):
        assert html_text(result) == alone
    assert any(isinstance(answer, Picture) for answer in heard)  # it was of use
    drawing = import_module("asperity.report.comparison")
    monkeypatch.setattr(drawing, "_picture", lambda *_task: None)
    assert html_text(result) == alone  # what a helper drew is kept


@pytest.mark.parametrize("workers", [1, 3])
def test_onsets_are_the_same_however_many_work_on_them(
    monkeypatch: pytest.MonkeyPatch, workers: int
) -> None:
    monkeypatch.setattr(sweeps, "cores", lambda: workers)
    told: list[int] = []
    found = sweeps.onsets(
        band_setup("W"), "WAC", (0, 3), starts=2, lowest=5.0, progress=lambda: told.append(1)
    )
    by_law = [f"{one.onset.law}{one.onset.delay}" for one in found]
    assert by_law == ["W0", "W3", "A0", "A3", "C0", "C3"]
    assert len(told) == 6
    for one in found[::5]:
        setup = band_setup(one.onset.law)
        alone = sweeps.onsets(setup, one.onset.law, (one.onset.delay,), starts=2, lowest=5.0)
        assert alone[0].onset == one.onset


def test_threads_hear_that_nobody_waits_any_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweeps, "cores", lambda: 2)
    begun, over, heard = Event(), Event(), []

    def work(number: int) -> None:
        if number == 0:
            begun.wait(60.0)
            raise KeyboardInterrupt
        begun.set()
        heard.append(over.wait(10.0))

    with pytest.raises(KeyboardInterrupt):
        sweeps.side_by_side(work, [(0,), (1,)], over)
    assert heard == [True]


def test_a_law_is_left_after_a_stiffness_when_nobody_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[int] = []
    over = Event()
    monkeypatch.setattr(sweeps, "side_by_side", lambda work, jobs, _over: [work(*jobs[0])])
    monkeypatch.setattr(sweeps, "Event", lambda: over)
    over.set()
    with pytest.raises(CancelledError):
        sweeps.onsets(band_setup("W"), "W", (0, 1), starts=2, progress=lambda: found.append(1))
    assert not found


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_surface_can_be_sent_to_a_helper(name: str) -> None:
    texture = listed_surfaces([name])[0].texture
    points = texture.domain.points(np.full((1, len(texture.domain.spans)), 0.3))
    heights = texture.height(points)  # by now it holds compiled loops
    sent = pickle.loads(pickle.dumps(texture))
    assert sent.describe() == texture.describe()
    assert (sent.height(points) == heights).all()


@pytest.mark.keeps_answers
@pytest.mark.usefixtures("own_cache")
def test_a_law_that_is_answered_ahead_asks_for_nothing_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    module = import_module("asperity.analysis.compare")
    tasks: list[Any] = []

    def noted(surfaces: Any, question: Any) -> list[Any]:
        tasks.extend(intact(surfaces, question))
        return [None] * len(surfaces)

    intact = module._tasks
    monkeypatch.setattr(module, "_tasks", noted)
    with monkeypatch.context() as patch:
        patch.setattr(kept, "keep", lambda *_: None)
        compare(WAVE, laws="D")
    answer_ahead(tasks[0])
    made: list[str] = []
    monkeypatch.setattr(kept, "keep", lambda _room, key, _content: made.append(key))
    compare(WAVE, laws="D")
    assert made == []


_THREADS = """
import os, sys
import asperity.__main__ as program
program._open_streams()
assert "numpy" not in sys.modules
print(*(os.environ[name] for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")))
"""


def test_a_command_has_one_thread_of_linear_algebra_as_its_helpers_have() -> None:
    """Whatever is asked for: a form fitted to a map is another in the last digit with two."""
    done = subprocess.run(
        [sys.executable, "-c", _THREADS], capture_output=True, text=True, check=True,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "7"},
    )  # fmt: skip
    assert done.stdout.split() == ["1", "1"]

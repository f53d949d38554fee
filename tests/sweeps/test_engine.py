"""The engine: the same table everywhere, errors as rows, workers that end, kills and resumption."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import asperity as asp
from asperity.analysis.passivity.recommended_stiffness import render_on_device
from asperity.analysis.results.compare import DEFAULT_DEVICE
from asperity.core.arguments import FIELD
from asperity.core.errors import ParameterError
from asperity.sweeps.case_runs import compute_cases
from asperity.sweeps.run_sweep import (
    LOST,
    Place,
    estimate_case_time,
    local_place,
    missing_cases,
    open_store,
    run_cases,
    run_plan,
)
from asperity.sweeps.sweep_plan import SweepPlan
from asperity.sweeps.sweep_result import CASES_FILE, ResultStore

MakePlan = Callable[..., SweepPlan]
CHILD = Path(__file__).with_name("sweep_child.py")
RANGE = "texture.period=1mm:2mm:40log"


def table(result: asp.SweepResult, path: Path) -> bytes:
    result.to_csv(path)
    return path.read_bytes()


@pytest.mark.caches_results
def test_one_process_and_two_give_the_same_bytes(counting_plan: MakePlan, tmp_path: Path) -> None:
    plan = counting_plan(RANGE)
    tables = [
        table(run_plan(plan, place), tmp_path / f"{i}.csv")
        for i, place in enumerate((local_place(1), local_place(2)))
    ]
    assert tables[0] == tables[1]
    assert tables[0].count(b"\n") == 41


def test_order_does_not_change_a_number(counting_plan: MakePlan) -> None:
    plan, forward, backward = counting_plan(RANGE), [], []
    cases = [(i, plan.values(i)) for i in range(len(plan))]
    run_cases(local_place(1), plan.template, iter(cases), forward.extend)
    run_cases(local_place(1), plan.template, iter(cases[::-1]), backward.extend)
    assert forward == backward[::-1] != backward
    randoms = {outcome.rows[0]["random"] for outcome in forward}
    assert len(randoms) == len(cases)  # seeded by content, not all alike


def test_a_case_that_fails_is_a_row_with_its_error(counting_plan: MakePlan) -> None:
    result = run_plan(counting_plan("texture.period=1mm,2mm,3mm", failing=2e-3), local_place(1))
    assert result.errors == {1: "period fails here, got 0.002"}
    rows = result.table_rows()
    assert [row["error"] for row in rows] == [None, "period fails here, got 0.002", None]
    assert (rows[1]["square [m^2]"], rows[2]["square [m^2]"]) == (None, 9e-6)
    assert rows[0]["reach [m]"] == float("inf")


def test_a_sweep_of_which_every_case_fails_says_so(counting_plan: MakePlan) -> None:
    with pytest.raises(ParameterError, match=r"failed in each of 1 cases, the first: period fails"):
        run_plan(counting_plan("texture.period=2mm", failing=2e-3), local_place(1))


def test_a_case_that_ends_its_process_is_a_row(counting_plan: MakePlan, tmp_path: Path) -> None:
    plan = counting_plan("texture.period=1mm:2mm:11", crashing=1.5e-3)
    result = run_plan(plan, local_place(2), tmp_path / "run")
    assert result.errors == {5: LOST}
    assert [row["case"] for row in result.table_rows() if row["error"] is None] == [
        *range(5), *range(6, 11),
    ]  # fmt: skip


def test_a_worker_of_another_version_is_refused(counting_plan: MakePlan) -> None:
    template = replace(counting_plan("texture.period=1mm").template, package="other")
    with pytest.raises(match="another version of asperity"):
        compute_cases(template, [(0, {"texture.period": "1 mm"})])


class _Delayed(Executor):
    """Executor whose tasks take a given time per case, without waiting."""

    def __init__(self, sizes: list[int], case_time: float) -> None:
        self.sizes, self.case_time = sizes, case_time

    def submit(self, fn: Any, /, template: Any, batch: Any) -> Future[Any]:
        self.sizes.append(len(batch))
        _, outcomes = fn(template, batch)
        future: Future[Any] = Future()
        future.set_result((self.case_time * len(batch), outcomes))
        return future


def test_tasks_contain_as_many_cases_as_fit_their_time(counting_plan: MakePlan) -> None:
    plan, sizes = counting_plan("texture.period=1mm:2mm:500"), list[int]()
    cases = [(i, plan.values(i)) for i in range(len(plan))]
    found: list[Any] = []
    place = Place(lambda: _Delayed(sizes, 2e-3), lambda: 3, lambda: 0.1)
    run_cases(place, plan.template, iter(cases), found.extend)
    assert sizes[:3] == [1, 1, 1]
    assert set(sizes[3:-1]) == {50}
    assert sorted(one.index for one in found) == list(range(500))


# --- the results folder --------------------------------------------------------------------------


def test_a_torn_line_is_removed_and_computed_again(counting_plan: MakePlan, tmp_path: Path) -> None:
    plan = counting_plan(RANGE)
    whole = table(run_plan(plan, local_place(1), tmp_path / "a"), tmp_path / "a.csv")
    cases = tmp_path / "a" / CASES_FILE
    lines = cases.read_bytes().splitlines(keepends=True)
    assert len(lines) == 40
    for kept, torn in ((12, lines[12][:-1]), (30, b""), (7, lines[7][:9]), (3, b"\x00\x00")):
        cases.write_bytes(b"".join(lines[:kept]) + torn)
        store = open_store(plan, tmp_path / "a")
        assert [i for i, _ in missing_cases(plan, store)] == list(range(kept, 40))
        store.release()
        again = run_plan(plan, local_place(1), tmp_path / "a")
        assert table(again, tmp_path / "b.csv") == whole


def test_a_damaged_line_in_the_middle_is_computed_again(
    counting_plan: MakePlan, tmp_path: Path
) -> None:
    plan = counting_plan(RANGE)
    whole = table(run_plan(plan, local_place(1), tmp_path / "a"), tmp_path / "a.csv")
    cases = tmp_path / "a" / CASES_FILE
    data = bytearray(cases.read_bytes())
    data[len(data) // 2 : len(data) // 2 + 200] = bytes(200)
    cases.write_bytes(bytes(data))
    assert table(run_plan(plan, local_place(1), tmp_path / "a"), tmp_path / "b.csv") == whole


def test_folders_that_cannot_be_used(counting_plan: MakePlan, tmp_path: Path) -> None:
    plan, folder = counting_plan(RANGE), tmp_path / "run"
    store = open_store(plan, folder)
    with pytest.raises(ParameterError, match="output is in use by another process"):
        open_store(plan, folder)
    store.release()
    with pytest.raises(ParameterError, match=r"holds another sweep \(other vary, cases\)"):
        open_store(counting_plan("texture.period=1mm:2mm:41log"), folder)
    other = replace(plan, template=replace(plan.template, package="1"))
    with pytest.raises(ParameterError, match=r"holds another sweep \(other version of asperity\)"):
        open_store(other, folder)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "letter.txt").write_text("mine")
    with pytest.raises(ParameterError, match="is neither empty nor the folder of a sweep"):
        open_store(plan, tmp_path / "full")
    with pytest.raises(ParameterError, match="must be a folder that can be written"):
        open_store(plan, tmp_path / "full" / "letter.txt")
    open_store(plan, folder).release()  # after all errors


def test_another_content_of_a_file_is_another_sweep(tmp_path: Path) -> None:
    device = tmp_path / "mine.toml"
    device.write_text('id = "mine"\nmax_stiffness = "1000 N/m"\n')
    arguments: Any = {"laws": "W", "processes": 1, "folder": tmp_path / "run"}
    vary = {"device": f"{device},touch"}
    first = asp.sweep("sinusoid:amplitude=0.1mm,period=1mm", vary, "compare", **arguments)
    assert [row["stability limit [N/m]"] for row in first.table_rows()] == [1000.0, 400.0]
    device.write_text('id = "mine"\nmax_stiffness = "1200 N/m"\n')
    with pytest.raises(ParameterError, match=r"holds another sweep \(other files\)"):
        asp.sweep("sinusoid:amplitude=0.1mm,period=1mm", vary, "compare", **arguments)


def test_a_full_disk_is_one_line_and_the_sweep_goes_on(
    counting_plan: MakePlan, tmp_path: Path
) -> None:
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("not run: no /dev/full here")
    plan = counting_plan(RANGE)
    store = open_store(plan, tmp_path / "run")
    _, outcomes = compute_cases(plan.template, [(0, plan.values(0)), (1, plan.values(1))])
    store.record(outcomes[:1])
    size = (tmp_path / "run" / CASES_FILE).stat().st_size
    stream, store._stream = store._stream, _FullAfter(store._stream, 10)  # type: ignore[assignment]  # a stand-in
    with pytest.raises(ParameterError, match=r"output cannot be written: No space left on device;"):
        store.record(outcomes[1:])
    assert 1 not in store
    assert (tmp_path / "run" / CASES_FILE).stat().st_size == size
    store._stream = stream
    store.release()
    assert len(run_plan(plan, local_place(1), tmp_path / "run").table_rows()) == 40


class _FullAfter:
    """A file on a disk with room for some bytes."""

    def __init__(self, stream: Any, room: int) -> None:
        self.stream, self.room = stream, room

    def write(self, data: bytes) -> int:
        if not self.room:
            raise OSError(28, "No space left on device")
        written: int = self.stream.write(data[: self.room])
        self.room -= written
        return written

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


def test_the_time_of_what_is_left_is_estimated(
    counting_plan: MakePlan, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SWEEP_PAUSE", "0.02")
    plan = counting_plan("texture.period=1mm:2mm:1000")
    assert 0.02 < estimate_case_time(plan) < 0.06


# --- kills ---------------------------------------------------------------------------------------


def _start(folder: Path, log: Path, count: int, processes: int) -> subprocess.Popen[bytes]:
    environment = {**os.environ, "SWEEP_LOG": str(log), "SWEEP_PAUSE": "0.004"}
    arguments = [str(folder), f"1mm:2mm:{count}", str(processes)]
    return subprocess.Popen([sys.executable, str(CHILD), *arguments], env=environment)


def _recorded(folder: Path) -> set[int]:
    """Return the cases that are on disk, in whole lines."""
    path = folder / CASES_FILE
    lines = path.read_bytes().split(b"\n")[:-1] if path.exists() else []
    return {int(line[9 : line.index(b",")]) for line in lines}


@pytest.mark.parametrize("processes", [1, 2])
def test_a_killed_sweep_goes_on_and_computes_nothing_twice(
    tmp_path: Path, processes: int, counting_plan: MakePlan
) -> None:
    """Kill at random moments; the number of kills is SWEEP_KILLS, 3 by default."""
    kills, count = int(os.environ.get("SWEEP_KILLS", "3")), 400
    plan, rng = counting_plan(f"texture.period=1mm:2mm:{count}"), random.Random(7)
    periods = [plan.numbers(i)["texture.period [m]"] for i in range(count)]
    folder, log = tmp_path / "run", tmp_path / "log"
    log.touch()
    killed, done_before = 0, dict[int, int]()
    while killed < kills:
        child = _start(folder, log, count, processes)
        done = len(_recorded(folder))
        while child.poll() is None and len(_recorded(folder)) <= done:
            time.sleep(0.002)
        time.sleep(rng.uniform(0.0, 1.6 / kills))
        child.send_signal(signal.SIGKILL)
        assert child.wait() == -signal.SIGKILL, "the sweep ended before it was killed: more cases"
        killed += 1
        time.sleep(0.05)  # the workers end with their parent
        computed = Counter(log.read_text().split())
        for index in _recorded(folder):
            done_before.setdefault(index, computed[repr(periods[index])])
    assert 0 < len(done_before) < count
    assert _start(folder, log, count, processes).wait() == 0
    computed = Counter(log.read_text().split())
    # What was on disk at a kill was not computed again; what ran at a kill, at most once per kill.
    assert {i: computed[repr(periods[i])] for i in done_before} == done_before
    in_flight = 2 * processes + 1
    assert count <= sum(computed.values()) <= count + kills * in_flight
    whole = table(run_plan(plan, local_place(1)), tmp_path / "whole.csv")
    assert (folder / "table.csv").read_bytes() == whole


def test_a_script_without_a_main_guard_is_told(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "import asperity as asp\n"
        "asp.sweep('sinusoid:amplitude=0.1mm', {'texture.period': '1mm,2mm'}, 'limits',"
        " processes=2)\n"
    )
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert "needs  if __name__ == '__main__':" in done.stderr.splitlines()[-1]


def test_results_stay_readable_without_a_folder() -> None:
    result = asp.sweep(
        "sinusoid:amplitude=0.1mm", {"texture.period": "1mm,2mm"}, "limits", processes=1
    )
    path = result.store.path
    assert [row["case"] for row in result.table_rows()] == [0, 1]
    assert isinstance(result.store, ResultStore)
    assert path.exists()
    del result
    assert not path.exists()


@pytest.mark.caches_results
def test_fields_are_baked_by_the_engine_and_kept() -> None:
    axes = {"surface.continuity": "1,2"}
    result = asp.sweep("knurl", axes, "bake", processes=2)
    rows = result.table_rows()
    texture = asp.named_surface("knurl")
    device = asp.load_device(DEFAULT_DEVICE)
    for row, continuity in zip(rows, (1.0, 2.0), strict=True):
        surface = asp.Surface(texture, "H", continuity=continuity)
        field = render_on_device(
            surface, device, FIELD, progress=lambda _part: pytest.fail("baked anew")
        )
        assert row["q"] == asp.characteristic_number(field).upper
        assert row["nodes"] * 4 == row["size [B]"]
    with pytest.raises(ParameterError, match="needs no field: its contact has a closed form"):
        asp.sweep("sinusoid:amplitude=1mm,period=5mm", axes, "bake", processes=1)


def test_without_room_for_processes_this_one_computes(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> Any:
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr("asperity.sweeps.run_sweep.make_pool", refuse)
    with local_place(2).open() as executor:
        assert executor.submit(os.getpid).result() == os.getpid()

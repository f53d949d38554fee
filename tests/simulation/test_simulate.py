"""The public call: motions, hands, trace in memory and in files, many runs, bad input."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from functools import partial
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from tests.helpers.allocations import traced_peak
from tests.simulation.onset.limit_cycle_definition import cycles, restlessness

from asperity.core.errors import ParameterError
from asperity.simulation import (
    BandHand,
    Cartesian,
    LinkMasses,
    Pantograph,
    PrescribedHand,
    Resonance,
    Run,
    Servo,
    SpringHand,
    Stationary,
    Strokes,
    Waypoints,
    simulate,
    simulate_many,
)
from asperity.simulation.limit_cycles.onset_search import CYCLE_SPEED
from asperity.simulation.trace import HEADER, DecimatedTrace, load_trace
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

WAVE = Sinusoid(amplitude=0.3e-3, period=2e-3, phase=0.3)
WALL = Surface(WAVE, "W", 500.0)
HAND = SpringHand(300.0, 3.0, mass=0.03, force=(0.0, 0.0, -0.5))
WAY = Strokes((0.0, 0.0, -1e-3), (8e-3, 0.0, -1e-3), speed=0.08, count=3)
JOB: dict[str, Any] = {
    "surface": WALL, "plant": Cartesian(0.05, 1.0), "hand": HAND, "servo": Servo(1e-3, delay=1),
    "motion": WAY, "duration": 0.4,
}  # fmt: skip


def run_of(**changed: Any) -> Run:
    return simulate(**{**JOB, **changed})


def test_strokes_go_there_and_back_and_stop() -> None:
    assert WAY.period == pytest.approx(0.1)
    assert WAY.duration == pytest.approx(0.3)
    times = np.array([0.0, 0.025, 0.1, 0.125, 0.2, 0.225, 0.3, 9.0])
    x = np.array([0.0, 2e-3, 8e-3, 6e-3, 0.0, 2e-3, 8e-3, 8e-3])
    np.testing.assert_allclose(WAY.at(times)[:, 0], x, atol=1e-15)
    back = Strokes((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0, 2)
    assert back.at(np.array([7.0]))[0, 0] == 1.0


def test_the_hand_is_where_the_motion_says() -> None:
    run = run_of()
    np.testing.assert_allclose(run.anchor, WAY.at(run.time), atol=1e-15)
    assert run.samples == 400
    assert run.duration == pytest.approx(0.4)
    np.testing.assert_array_equal(run.position[0], WAY.start)
    assert run.velocity[0].max() == 0.0


def test_every_thins_the_trace_and_nothing_else() -> None:
    whole, thin, none = run_of(), run_of(every=7), run_of(trace=False)
    np.testing.assert_array_equal(thin.table, whole.table[::7])
    assert none.table.shape == (0, 30)
    assert whole.ledger == thin.ledger == none.ledger
    sparse = run_of(every=10**30)
    np.testing.assert_array_equal(sparse.table, whole.table[:1])
    assert sparse.ledger == whole.ledger


@pytest.mark.parametrize("most", [0, 1, 10, 57, 400, 1000])
@pytest.mark.parametrize("chunk", [17, 16_384])
def test_rows_are_thinned_out_evenly(
    monkeypatch: pytest.MonkeyPatch, most: int, chunk: int
) -> None:
    module = importlib.import_module("asperity.simulation.simulate")  # the name is the function's
    monkeypatch.setattr(module, "CHUNK_SAMPLES", chunk)
    whole, thin = run_of(), run_of(max_rows=most)
    rows = whole.table[:: -(-400 // most)] if most else whole.table[:0]
    assert len(thin.table) == len(rows) <= most
    assert thin.ledger == whole.ledger
    np.testing.assert_array_equal(thin.table, rows)


@pytest.mark.parametrize("every", [1, 3, 20])
def test_the_ending_is_that_of_all_rows(every: int) -> None:
    rest: dict[str, Any] = {"motion": Stationary((0.0, 0.0, -1e-3)), "velocity": (0.3, 0.0, 0.0)}
    whole, none = run_of(**rest, every=every), run_of(**rest, every=every, max_rows=0)
    assert whole.tail is not None
    assert none.tail is not None
    assert none.tail.is_complete
    assert none.tail.velocity_spread == whole.tail.velocity_spread
    assert whole.tail.velocity_spread == pytest.approx(restlessness(whole), rel=1e-12)
    assert whole.tail.velocity_spread > 1e-9  # the handle swings
    assert (whole.tail.velocity_spread > CYCLE_SPEED and whole.tail.gains_energy) == cycles(whole)


def test_a_run_without_enough_rows_has_no_known_ending() -> None:
    few = run_of(every=200, max_rows=0).tail
    assert few is not None
    assert not few.is_complete
    assert run_of(trace=False).tail is None
    with pytest.raises(ParameterError, match="max_rows must be a whole number"):
        run_of(max_rows=-1)


def test_memory_without_rows_is_flat_in_the_duration() -> None:
    def peak(duration: float) -> int:
        still = Stationary((0.0, 0.0, -1e-3))
        return traced_peak(lambda: run_of(duration=duration, motion=still, max_rows=0))

    peak(20.0)
    assert peak(400.0) < 1.05 * peak(40.0)  # 86 MB if it kept the rows


def test_chunks_leave_no_seam(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = run_of(every=3)
    module = importlib.import_module("asperity.simulation.simulate")  # the name is the function's
    monkeypatch.setattr(module, "CHUNK_SAMPLES", 17)
    told: list[float] = []
    pieces = run_of(every=3, progress=told.append)
    # The sums are added to in another order.
    np.testing.assert_allclose(pieces.table, whole.table, rtol=1e-12, atol=1e-18)
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert len(told) == 24


def test_the_file_holds_the_trace(tmp_path: FilePath) -> None:
    path = tmp_path / "run.csv"
    run, whole = run_of(trace=path), run_of()
    assert path.read_text().splitlines()[0] == HEADER
    assert HEADER.startswith("time [s],x [m],y [m],z [m],vx [m/s]")
    read = np.loadtxt(path, delimiter=",", skiprows=1)
    np.testing.assert_allclose(read, whole.table, rtol=1e-11, atol=1e-20)
    assert run.ledger == whole.ledger
    assert run.path == str(path)
    assert run.to_dict()["trace"] == str(path)


def test_a_file_that_cannot_be_written_is_named(tmp_path: FilePath) -> None:
    with pytest.raises(ParameterError, match="trace cannot be written"):
        run_of(trace=tmp_path / "missing" / "run.csv")
    with pytest.raises(ParameterError, match="trace cannot be written"):
        run_of(trace=tmp_path / "missing" / "run.mcap")
    with pytest.raises(ParameterError, match=r"\.mcap.*\.csv"):
        run_of(trace=tmp_path / "run.npy")
    assert list(tmp_path.iterdir()) == []


_FULL_DISK = """
import resource, signal, sys
sys.path[:0] = {paths!r}
from asperity.core.errors import ParameterError
from tests_job import job
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))
from asperity.simulation import simulate
try:
    simulate(**job, trace={trace!r})
except ParameterError as error:
    print(error)
"""

_JOB = """
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid
job = dict(
    surface=Surface(Sinusoid(3e-4, 2e-3), "W", 500.0), plant=Cartesian(0.05, 1.0),
    hand=SpringHand(100.0), servo=Servo(1e-4), motion=Stationary((0.0, 0.0, -1e-3)), duration=10.0,
)
"""


def test_a_full_disk_ends_the_run_and_leaves_whole_lines(tmp_path: FilePath) -> None:
    """A limit on the size of files stands for a full disk: writes come back short, then fail."""
    (tmp_path / "tests_job.py").write_text(_JOB)
    path, size = tmp_path / "run.csv", 5_000_000
    # Compiled here, so that the limit meets the trace alone.
    script = "from tests_job import job\nfrom asperity.simulation import simulate\nsimulate(**job)"
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, check=True, timeout=60)
    script = _FULL_DISK.format(paths=[str(tmp_path)], size=size, trace=str(path))
    answer = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True
    )
    text = path.read_text()
    rows = text.count("\n") - 1
    assert "trace cannot be written any further (File too large)" in answer.stdout
    assert f"{rows} rows are in {path}" in answer.stdout
    assert text.endswith("\n")
    assert size - 1000 < len(text) <= size
    read = np.loadtxt(path, delimiter=",", skiprows=1)
    assert read.shape == (rows, 30)
    np.testing.assert_allclose(read[:, 0], 1e-4 * np.arange(rows), atol=1e-12)


@pytest.mark.skipif(not FilePath("/dev/full").exists(), reason="this system has no /dev/full")
def test_a_disk_without_any_room_is_reported(tmp_path: FilePath) -> None:
    full = tmp_path / "run.csv"
    full.symlink_to("/dev/full")
    with pytest.raises(ParameterError, match=r"No space left on device.*0 rows"):
        run_of(trace=full)


@pytest.mark.parametrize("name", ["run.csv", "run.mcap"])
def test_memory_does_not_depend_on_the_duration(tmp_path: FilePath, name: str) -> None:
    """Ten times as long, no more memory: Python's own allocations, and those of NumPy."""
    peaks = []
    options: dict[str, Any] = {"servo": Servo(1e-4), "every": 5}
    for duration in (4.0, 40.0):
        traced = partial(run_of, trace=tmp_path / name, duration=duration, **options)
        run_of(trace=tmp_path / name, every=5)
        peaks.append(traced_peak(traced))
    assert peaks[1] < 1.1 * peaks[0]
    # Negative control: in memory it does depend.
    assert traced_peak(partial(run_of, duration=40.0, **options)) > 2.0 * peaks[1]


def test_many_runs_are_the_same_as_one_after_the_other() -> None:
    jobs = [
        {**JOB, "surface": Surface(WAVE, letter, 300.0), "plant": plant}
        for letter in "WF"
        for plant in (Cartesian(0.05, 1.0), Pantograph())
    ]
    for run, job in zip(simulate_many(jobs, workers=3), jobs, strict=True):
        alone = simulate(**job)
        np.testing.assert_array_equal(run.table, alone.table)
        assert run.ledger == alone.ledger


def test_a_run_is_plain_data() -> None:
    run = run_of(plant=Pantograph(), duration=0.01)
    plain = json.loads(json.dumps(run.to_dict()))
    assert plain["notes"][0].startswith("Link masses of the pantograph are a guess")
    assert plain["samples"] == 10
    for part in (JOB["plant"], Pantograph(), HAND, BandHand(), PrescribedHand(), WAY, Servo(1e-3)):
        json.dumps(part.to_dict(), allow_nan=False)
    json.dumps(Waypoints([0.0], [[0.0, 0.0, 0.0]]).to_dict())
    json.dumps(Cartesian(resonance=Resonance(400.0)).to_dict())


def test_at_rest_nothing_becomes_subnormal() -> None:
    """Long after the last stroke velocities have decayed to nothing, not to 1e-310."""
    run = run_of(
        motion=Stationary((0.0, 0.0, 0.05)), start=(1e-3, 0.0, 0.05), duration=40.0, every=100
    )
    tiny = np.abs(run.table[:, 1:7])
    assert not ((tiny > 0.0) & (tiny < 1e-150)).any()


def test_a_ledger_that_does_not_close_is_said() -> None:
    assert run_of().is_energy_balanced
    # Friction holds the handle: all that is exchanged is the last bits of what a band stores.
    held = run_of(
        plant=Cartesian(0.05, 1.0, friction=5.0), hand=BandHand(),
        motion=Stationary((0.0, 0.0, 0.01)), start=(0.0, 0.0, 1e-3),
    )  # fmt: skip
    assert abs(held.ledger.closure) > 1e-9 * held.ledger.exchanged
    assert held.ledger.exchanged < 1e-15 * held.ledger.stored_before
    assert held.is_energy_balanced
    stiff = run_of(hand=SpringHand(1e12))  # thousands of its radians to a sample
    assert abs(stiff.ledger.closure) > 1e-9 * stiff.ledger.exchanged
    assert not stiff.is_energy_balanced


@pytest.mark.parametrize("rows", [10**15, 10**18])
def test_a_trace_beyond_all_memory_is_refused(rows: int) -> None:
    with pytest.raises(ParameterError, match=f"trace needs memory for {rows} rows"):
        DecimatedTrace(rows, None)


BAD: list[tuple[dict[str, Any], str]] = [
    ({"surface": WAVE}, "surface must be a Surface"),
    ({"plant": 0.05}, "plant must be"),
    ({"hand": 3}, "hand must be"),
    ({"servo": 1e-3}, "servo must be"),
    ({"motion": (0, 0, 0)}, "motion must be"),
    ({"duration": 0.0}, "duration must be positive"),
    ({"duration": 1e-5}, "duration must be at least one period"),
    ({"duration": 1e30}, "duration must be at most"),
    ({"servo": Servo(1e-30)}, "duration must be at most"),
    ({"servo": Servo(1e-3, delay=10**20)}, "delay must be at most"),
    ({"every": 0}, "every must be"),
    ({"every": 1.5}, "every must be"),
    ({"trace": 3}, "trace must be"),
    ({"start": (0.0, 0.0)}, "start must have shape"),
    ({"velocity": (0.0, 0.0, np.nan)}, "velocity must be finite"),
    (
        {"hand": PrescribedHand(), "start": (0.0, 0.0, 1.0)},
        "start must be the start of a prescribed motion",
    ),
    ({"hand": BandHand(), "plant": Cartesian(resonance=Resonance(400.0))}, "resonance is not"),
]


@pytest.mark.parametrize(("changed", "words"), BAD, ids=[words for _, words in BAD])
def test_bad_input_is_named(changed: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        run_of(**changed)


WRONG: list[tuple[Any, tuple[Any, ...], dict[str, Any], str]] = [
    (Cartesian, (0.0,), {}, "mass"),
    (Cartesian, ((0.1, 0.2),), {}, "mass"),
    (Cartesian, (0.1, -1.0), {}, "damping"),
    (Cartesian, (0.1, [[1, 2, 0], [0, 1, 0], [0, 0, 1]]), {}, "symmetric"),
    (Cartesian, (0.1, np.diag([1.0, -1.0, 1.0])), {}, "semidefinite"),
    (Cartesian, (0.1,), {"friction": -1.0}, "friction"),
    (Cartesian, (0.1,), {"friction": np.nan}, "friction"),
    (Cartesian, (0.1,), {"resonance": 400.0}, "resonance"),
    (Resonance, (0.0,), {}, "frequency"),
    (Resonance, (400.0,), {"mass_fraction": 1.0}, "mass_fraction"),
    (Pantograph, (), {"joint_damping": -1e-3}, "joint_damping"),
    (Pantograph, (), {"friction": -1.0}, "friction"),
    (Pantograph, (), {"centre": (0.0, 0.2)}, "point must be reached"),
    (Pantograph, (), {"masses": 0.02}, "masses"),
    (Pantograph, (), {"linkage": 0.02}, "linkage"),
    (LinkMasses, (), {"distal": 0.0, "handle": 0.0}, "handle"),
    (LinkMasses, (), {"proximal": -1.0}, "proximal"),
    (SpringHand, (-1.0,), {}, "stiffness"),
    (SpringHand, (1.0,), {"mass": -1.0}, "mass"),
    (SpringHand, (1.0,), {"force": (0.0, np.inf, 0.0)}, "force"),
    (BandHand, (200.0, 17.0), {}, "tension must be less than stiffness"),
    (BandHand, (), {"damping": -0.1}, "damping"),
    (BandHand, (0.0,), {}, "stiffness"),
    (Stationary, ((0.0, 0.0),), {}, "point"),
    (Strokes, ((0, 0, 0), (0, 0, 0), 1.0), {}, "end"),
    (Strokes, ((0, 0, 0), (1, 0, 0), 0.0), {}, "speed"),
    (Strokes, ((-1e308, 0, 0), (1e308, 0, 0), 1.0), {}, "end must be at a finite distance"),
    (Strokes, ((0, 0, 0), (1, 0, 0), 1e-320), {}, "speed must be at least"),
    (Strokes, ((0, 0, 0), (1e-300, 0, 0), 1e30), {}, "speed must make"),
    (Strokes, ((0, 0, 0), (1, 0, 0), 1.0, 1.5), {}, "count"),
    (Waypoints, ([0.0, 0.0], np.zeros((2, 3))), {}, "times"),
    (Waypoints, ([0.0], np.zeros((2, 3))), {}, "points"),
]


@pytest.mark.parametrize(("kind", "given", "named", "words"), WRONG)
def test_wrong_parts_are_named(
    kind: Any, given: tuple[Any, ...], named: dict[str, Any], words: str
) -> None:
    with pytest.raises(ParameterError, match=words):
        kind(*given, **named)


@pytest.mark.parametrize("name", ["run.csv", "run.mcap", "run"])
@pytest.mark.parametrize("most", [1000, 40, 7, 1])
def test_a_written_trace_is_read_back_thinned_out_evenly(
    tmp_path: FilePath, most: int, name: str
) -> None:
    surface_to_end = (WALL, Cartesian(0.1, 1.0), SpringHand(100.0, 2.0), Servo(1e-3))
    ask = partial(simulate, *surface_to_end, Stationary((0.0, 0.0, -1e-3)), 0.04)
    whole, read = ask().table, load_trace(ask(trace=tmp_path / name), most).table
    step = -(-len(whole) // most)
    assert len(read) <= most
    np.testing.assert_allclose(read, whole[::step], rtol=1e-11)


def test_the_parts_of_a_trace_are_its_columns_by_name() -> None:
    run = run_of()
    names = [name.split(" [")[0] for name in HEADER.split(",")]
    for part, head in (("velocity", "v"), ("applied", "applied "), ("anchor", "anchor ")):
        columns = [names.index(head + axis) for axis in "xyz"]
        np.testing.assert_array_equal(getattr(run, part), run.table[:, columns])

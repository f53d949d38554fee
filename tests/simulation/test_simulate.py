"""The public functions: motions, hands, traces in memory and files, many runs, invalid input."""

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
from tests.simulation.limit_cycle_definition import is_moving, velocity_spread

from asperity.core.errors import ParameterError
from asperity.recording.recording import open_recording
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
from asperity.simulation.onset_search import felt_speed
from asperity.simulation.trace import COLUMNS, DecimatedTrace
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

WAVE = Sinusoid(amplitude=0.3e-3, period=2e-3, phase=0.3)
WALL = Surface(WAVE, "W", 500.0)
HAND = SpringHand(300.0, 3.0, mass=0.03, force=(0.0, 0.0, -0.5))
COUPLED = [[2.0, 0.5, 0.1], [0.5, 1.0, -0.2], [0.1, -0.2, 0.7]]  # N s/m
STROKES = Strokes((0.0, 0.0, -1e-3), (8e-3, 0.0, -1e-3), speed=0.08, count=3)
JOB: dict[str, Any] = {
    "surface": WALL,
    "plant": Cartesian(0.05, 1.0),
    "hand": HAND,
    "servo": Servo(1e-3, delay=1),
    "motion": STROKES,
    "duration": 0.4,
}


def run_of(**changes: Any) -> Run:
    return simulate(**{**JOB, **changes})


@pytest.mark.parametrize(("law", "trace"), [("C", True), ("D", False)])
def test_samples_at_the_force_limit_and_below_the_depth_are_counted(law: str, trace: bool) -> None:
    """A hand of 8 N on a device of 3.3 N sinks in; every sample counts, written or not."""
    surface = Surface(WAVE, law, 300.0, clamp="backed", max_depth=0.5e-3)
    hand = SpringHand(100.0, 2.0, force=(0.0, 0.0, -8.0))
    case = {"surface": surface, "hand": hand, "servo": Servo(1e-3, max_force=3.3)}
    traced = run_of(**case)
    run = run_of(**case, trace=trace, every=7)
    force = np.linalg.norm(traced.table[:, 7:10], axis=1)
    points = np.ascontiguousarray(traced.table[:, 1:4])
    depth = surface.law.contact.depth(WAVE, points)
    assert run.force_limited == np.sum(force > 3.3 * (1.0 - 1e-9)) > 100
    assert run.too_deep == np.sum(depth > 0.5e-3) > 100
    assert run.deepest == pytest.approx(depth.max())
    assert run.deepest > 10e-3
    assert run.to_dict()["too_deep"] == run.too_deep
    gentle = run_of(surface=surface.to_depth(3e-3))
    assert (gentle.force_limited, gentle.too_deep, gentle.deepest) == (0, 0, 0.0)


def test_strokes_alternate_and_stop() -> None:
    assert STROKES.period == pytest.approx(0.1)
    assert STROKES.duration == pytest.approx(0.3)
    times = np.array([0.0, 0.025, 0.1, 0.125, 0.2, 0.225, 0.3, 9.0])
    x = np.array([0.0, 2e-3, 8e-3, 6e-3, 0.0, 2e-3, 8e-3, 8e-3])
    np.testing.assert_allclose(STROKES.at(times)[:, 0], x, atol=1e-15)
    back = Strokes((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0, 2)
    assert back.at(np.array([7.0]))[0, 0] == 1.0


def test_anchor_follows_the_motion() -> None:
    run = run_of()
    np.testing.assert_allclose(run.anchor, STROKES.at(run.time), atol=1e-15)
    assert run.samples == 400
    assert run.duration == pytest.approx(0.4)
    np.testing.assert_array_equal(run.position[0], STROKES.start)
    assert run.velocity[0].max() == 0.0


def test_every_decimates_only_the_trace() -> None:
    whole, decimated, untraced = run_of(), run_of(every=7), run_of(trace=False)
    np.testing.assert_array_equal(decimated.table, whole.table[::7])
    assert untraced.table.shape == (0, 31)
    assert whole.ledger == decimated.ledger == untraced.ledger
    sparse = run_of(every=10**30)
    np.testing.assert_array_equal(sparse.table, whole.table[:1])
    assert sparse.ledger == whole.ledger


@pytest.mark.parametrize("max_rows", [0, 1, 10, 57, 400, 1000])
@pytest.mark.parametrize("chunk", [17, 16_384])
def test_max_rows_decimates_evenly(
    monkeypatch: pytest.MonkeyPatch, max_rows: int, chunk: int
) -> None:
    module = importlib.import_module(
        "asperity.simulation.simulate"
    )  # the package exports a function of that name
    monkeypatch.setattr(module, "CHUNK_SAMPLES", chunk)
    whole, decimated = run_of(), run_of(max_rows=max_rows)
    rows = whole.table[:: -(-400 // max_rows)] if max_rows else whole.table[:0]
    assert len(decimated.table) == len(rows) <= max_rows
    assert decimated.ledger == whole.ledger
    np.testing.assert_array_equal(decimated.table, rows)


@pytest.mark.parametrize("every", [1, 3, 20])
def test_tail_statistics_do_not_depend_on_decimation(every: int) -> None:
    rest: dict[str, Any] = {"motion": Stationary((0.0, 0.0, -1e-3)), "velocity": (0.3, 0.0, 0.0)}
    whole, untraced = run_of(**rest, every=every), run_of(**rest, every=every, max_rows=0)
    assert whole.tail is not None
    assert untraced.tail is not None
    assert untraced.tail.is_complete
    assert untraced.tail.velocity_spread == whole.tail.velocity_spread
    dense = run_of(**rest)
    assert whole.tail.velocity_spread == pytest.approx(velocity_spread(dense), rel=1e-12)
    assert whole.tail.velocity_spread > 1e-9  # the handle swings
    extent = np.array_split(dense.position, 4)[3].std(axis=0).sum()
    assert whole.tail.position_spread == pytest.approx(extent, rel=1e-12)
    felt = felt_speed(whole.tail.velocity_spread, whole.tail.position_spread)
    assert (whole.tail.velocity_spread > felt) == is_moving(dense)


def test_tail_statistics_need_enough_rows() -> None:
    tail = run_of(duration=3e-3, max_rows=0).tail
    assert tail is not None
    assert not tail.is_complete
    assert run_of(trace=False).tail is None
    with pytest.raises(ParameterError, match="max_rows must be a whole number"):
        run_of(max_rows=-1)


def test_memory_without_trace_does_not_grow_with_duration() -> None:
    def peak(duration: float) -> int:
        still = Stationary((0.0, 0.0, -1e-3))
        return traced_peak(lambda: run_of(duration=duration, motion=still, max_rows=0))

    peak(20.0)
    assert peak(400.0) < 1.05 * peak(40.0)  # 86 MB with all rows in memory


def test_chunked_run_equals_whole_run(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = run_of(every=3)
    module = importlib.import_module(
        "asperity.simulation.simulate"
    )  # the package exports a function of that name
    monkeypatch.setattr(module, "CHUNK_SAMPLES", 17)
    progress: list[float] = []
    chunked = run_of(every=3, progress=progress.append)
    # Sums are accumulated in a different order.
    np.testing.assert_allclose(chunked.table, whole.table, rtol=1e-12, atol=1e-18)
    assert progress == sorted(progress)
    assert progress[-1] == 1.0
    assert len(progress) == 24


def test_trace_file_contains_the_trace(tmp_path: FilePath) -> None:
    path = tmp_path / "run.mcap"
    run, whole = run_of(trace=path), run_of()
    recording = open_recording(path)
    assert recording.columns == COLUMNS
    np.testing.assert_array_equal(recording.table(), whole.table)
    assert run.ledger == whole.ledger
    assert run.path == str(path)
    assert run.to_dict()["trace"] == str(path)


def test_unwritable_trace_is_an_error_with_its_name(tmp_path: FilePath) -> None:
    with pytest.raises(ParameterError, match="trace cannot be written"):
        run_of(trace=tmp_path / "missing" / "run.mcap")
    with pytest.raises(ParameterError, match=r"\.mcap.*export.*run\.csv"):
        run_of(trace=tmp_path / "run.csv")
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


def test_full_disk_ends_the_run_with_whole_blocks(tmp_path: FilePath) -> None:
    """A limit on file size simulates a full disk: a short write, then an error."""
    (tmp_path / "tests_job.py").write_text(_JOB)
    path, size = tmp_path / "run.mcap", 5_000_000
    # Compile first, so that the size limit affects only the trace.
    script = "from tests_job import job\nfrom asperity.simulation import simulate\nsimulate(**job)"
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, check=True, timeout=60)
    script = _FULL_DISK.format(paths=[str(tmp_path)], size=size, trace=str(path))
    process = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True
    )
    recording = open_recording(path)
    assert "trace cannot be written any further (File too large)" in process.stdout
    assert f"{recording.rows} rows are in {path}" in process.stdout
    assert size - 2_000_000 < path.stat().st_size <= size
    times = recording["time"]
    assert len(times) == recording.rows > 10_000
    np.testing.assert_allclose(times, 1e-4 * np.arange(len(times)), atol=1e-12)


@pytest.mark.skipif(not FilePath("/dev/full").exists(), reason="this system has no /dev/full")
def test_disk_without_space_is_an_error(tmp_path: FilePath) -> None:
    full = tmp_path / "run.mcap"
    full.symlink_to("/dev/full")
    with pytest.raises(ParameterError, match=r"trace cannot be written.*No space left on device"):
        run_of(trace=full)


def test_memory_with_trace_file_does_not_grow_with_duration(tmp_path: FilePath) -> None:
    """Peak of the allocations by Python and NumPy at ten times the duration."""
    peaks = []
    options: dict[str, Any] = {"servo": Servo(1e-4), "every": 5}
    for duration in (4.0, 40.0):
        run = partial(run_of, trace=tmp_path / "run.mcap", duration=duration, **options)
        run_of(trace=tmp_path / "run.mcap", every=5)
        peaks.append(traced_peak(run))
    assert peaks[1] < 1.1 * peaks[0]
    # Negative control: a trace in memory grows.
    assert traced_peak(partial(run_of, duration=40.0, **options)) > 2.0 * peaks[1]


def test_parallel_runs_equal_sequential_runs() -> None:
    jobs = [
        {**JOB, "surface": Surface(WAVE, letter, 300.0), "plant": plant}
        for letter in "WF"
        for plant in (Cartesian(0.05, 1.0), Pantograph())
    ]
    for run, job in zip(simulate_many(jobs, workers=3), jobs, strict=True):
        expected = simulate(**job)
        np.testing.assert_array_equal(run.table, expected.table)
        assert run.ledger == expected.ledger


def test_run_is_serializable_as_json() -> None:
    run = run_of(plant=Pantograph(), duration=0.01)
    plain = json.loads(json.dumps(run.to_dict()))
    assert plain["notes"][0].startswith("Link masses of the pantograph are a guess")
    assert plain["samples"] == 10
    for part in (
        JOB["plant"],
        Pantograph(),
        HAND,
        BandHand(),
        PrescribedHand(),
        STROKES,
        Servo(1e-3),
    ):
        json.dumps(part.to_dict(), allow_nan=False)
    json.dumps(Waypoints([0.0], [[0.0, 0.0, 0.0]]).to_dict())
    json.dumps(Cartesian(resonance=Resonance(400.0)).to_dict())


def test_velocities_at_rest_become_exactly_zero() -> None:
    """Long after the last stroke they are zero, not subnormal numbers such as 1e-310."""
    run = run_of(
        motion=Stationary((0.0, 0.0, 0.05)), start=(1e-3, 0.0, 0.05), duration=40.0, every=100
    )
    magnitudes = np.abs(run.table[:, 1:7])
    assert not ((magnitudes > 0.0) & (magnitudes < 1e-150)).any()


def test_unbalanced_energy_ledger_is_detected() -> None:
    assert run_of().is_energy_balanced
    # Friction holds the handle: the exchanged energy is rounding of the band's stored energy.
    sticking = run_of(
        plant=Cartesian(0.05, 1.0, friction=5.0),
        hand=BandHand(),
        motion=Stationary((0.0, 0.0, 0.01)),
        start=(0.0, 0.0, 1e-3),
    )
    assert abs(sticking.ledger.closure) > 1e-9 * sticking.ledger.exchanged
    assert sticking.ledger.exchanged < 1e-15 * sticking.ledger.stored_before
    assert sticking.is_energy_balanced
    stiff = run_of(hand=SpringHand(1e12))  # thousands of radians per sample
    assert abs(stiff.ledger.closure) > 1e-9 * stiff.ledger.exchanged
    assert not stiff.is_energy_balanced


@pytest.mark.parametrize("kind", ["axes", "coupled", "resonance"])
def test_energy_balance_of_overdamped_loops_closes(kind: str) -> None:
    """From 0.1 g to 10 kg, and b T/m up to 1e6, where e^{bT/m} has no number."""
    rng = np.random.default_rng(4)
    for _case in range(12):
        masses = 10.0 ** rng.uniform(-4.0, 1.0, 3)
        period = float(10.0 ** rng.uniform(-4.0, -2.5))
        ratio = 10.0 ** rng.uniform(0.0, 6.0)
        plant = Cartesian(
            masses.tolist(),
            COUPLED if kind == "coupled" else 1.0,
            friction=float(rng.choice([0.0, 0.3])),
            resonance=Resonance(float(rng.uniform(1.0, 300.0))) if kind == "resonance" else None,
        )
        damping = float(ratio * masses.min() / period)
        run = run_of(
            plant=plant,
            hand=SpringHand(300.0, damping, force=(0.0, 0.0, -1.0)),
            servo=Servo(period),
            duration=200.0 * period,
            trace=False,
        )
        ledger = run.ledger
        assert abs(ledger.closure) <= 1e-9 * ledger.exchanged, f"b T/m = {ratio:.3g}, {masses}"


@pytest.mark.parametrize("rows", [10**15, 10**18])
def test_trace_larger_than_memory_is_an_error(rows: int) -> None:
    with pytest.raises(ParameterError, match=f"trace needs memory for {rows} rows"):
        DecimatedTrace(rows, None)


INVALID_ARGUMENTS: list[tuple[dict[str, Any], str]] = [
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


@pytest.mark.parametrize(
    ("changes", "message"), INVALID_ARGUMENTS, ids=[message for _, message in INVALID_ARGUMENTS]
)
def test_invalid_arguments_are_named_in_the_error(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        run_of(**changes)


INVALID_PARTS: list[tuple[Any, tuple[Any, ...], dict[str, Any], str]] = [
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


@pytest.mark.parametrize(("kind", "arguments", "keywords", "message"), INVALID_PARTS)
def test_invalid_parameters_of_parts_are_named_in_the_error(
    kind: Any, arguments: tuple[Any, ...], keywords: dict[str, Any], message: str
) -> None:
    with pytest.raises(ParameterError, match=message):
        kind(*arguments, **keywords)


@pytest.mark.parametrize("name", ["run.mcap", "run"])
@pytest.mark.parametrize("max_rows", [1000, 40, 7, 1])
def test_trace_in_a_file_is_decimated_evenly(tmp_path: FilePath, max_rows: int, name: str) -> None:
    parts = (WALL, Cartesian(0.1, 1.0), SpringHand(100.0, 2.0), Servo(1e-3))
    run = partial(simulate, *parts, Stationary((0.0, 0.0, -1e-3)), 0.04)
    whole = run().table
    loaded = open_recording(run(trace=tmp_path / name).path).table(max_rows)
    step = -(-len(whole) // max_rows)
    assert len(loaded) <= max_rows
    np.testing.assert_array_equal(loaded, whole[::step])


def test_trace_attributes_are_the_columns_of_that_name() -> None:
    run = run_of()
    names = [name for name, _unit in COLUMNS]
    for part, prefix in (("velocity", "v"), ("applied", "applied "), ("anchor", "anchor ")):
        columns = [names.index(prefix + axis) for axis in "xyz"]
        np.testing.assert_array_equal(getattr(run, part), run.table[:, columns])

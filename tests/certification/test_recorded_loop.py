"""Recordings of loops: energies, stiffness and lag, limit cycles, samples that lack."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asperity import ParameterError
from asperity.certification.recorded_loop import RecordedSamples, certify_recording, read_samples
from asperity.core.checks import FloatArray
from asperity.recording.recording import open_recording
from asperity.recording.table_export import export_recording
from asperity.recording.writer import RecordingWriter
from asperity.report.pages.run_report import recording_facts
from asperity.report.sentences.certification_sentences import recording_answer
from asperity.report.sentences.texts import energy_text

PERIOD = 1e-3


def make_samples(heights: FloatArray, lag: int = 0, stiffness: float = 1500.0) -> RecordedSamples:
    """Return samples of a wall whose force is late by some samples."""
    positions = np.zeros((len(heights), 3))
    positions[:, 2] = heights
    forces = np.zeros_like(positions)
    late = np.concatenate([np.full(lag, heights[0]), heights[: len(heights) - lag]])
    forces[:, 2] = stiffness * np.maximum(-late, 0.0)
    return RecordedSamples("wall", PERIOD * np.arange(len(heights)), positions, forces)


@pytest.mark.parametrize("lag", [0, 1, 2, 3])
def test_stiffness_and_lag_of_a_wall_are_exact(lag: int) -> None:
    heights = 1e-3 * np.sin(0.07 * np.arange(4000)) + 2e-4 * np.sin(0.31 * np.arange(4000))
    result = certify_recording(make_samples(heights, lag))
    assert result.lag == lag
    assert result.stiffness == pytest.approx(1500.0, rel=1e-9)


def test_held_and_trapezoidal_work_differ_by_half_the_products_of_changes() -> None:
    samples = make_samples(1e-3 * np.sin(0.05 * np.arange(2000)), lag=1)
    result = certify_recording(samples)
    products = np.diff(samples.forces, axis=0) * np.diff(samples.positions, axis=0)
    assert result.energy == pytest.approx(
        result.trapezoidal_energy - 0.5 * products.sum(), rel=1e-12
    )
    assert result.axis_energies[:2] == (0.0, 0.0)


def test_late_force_of_a_wall_violates_passivity_and_a_prompt_one_in_half_steps_does_not() -> None:
    heights = -1e-3 + 5e-4 * np.cos(0.05 * np.arange(2000))
    late = certify_recording(make_samples(heights, lag=3))
    assert late.violated_since is not None
    assert late.violation > 0.0
    taking = make_samples(heights)
    braking = RecordedSamples("b", taking.times, taking.positions, -0.0 * taking.forces)
    assert certify_recording(braking).violated_since is None


def test_limit_cycle_has_its_frequency_amplitude_and_beginning() -> None:
    times = np.arange(8000)
    cycle = np.where(times < 4000, 0.0, 2e-4 * np.sin(2.0 * np.pi * 0.04 * times))
    result = certify_recording(make_samples(-1e-3 + cycle, lag=2))
    assert result.limit_cycle is not None
    assert result.limit_cycle.axis == "z"
    assert result.limit_cycle.frequency == pytest.approx(40.0, abs=1.0)
    assert result.limit_cycle.amplitude == pytest.approx(2e-4, rel=0.05)
    assert result.limit_cycle.since == pytest.approx(4.0, abs=0.01)


def test_oscillation_within_the_encoder_and_one_that_ends_are_no_limit_cycles() -> None:
    times = np.arange(8000)
    wave = np.sin(2.0 * np.pi * 0.04 * times)
    within = 1e-5 * np.round(-100.0 + 0.6 * wave)
    assert certify_recording(make_samples(within, lag=2)).limit_cycle is None
    ending = -1e-3 + 2e-4 * wave * np.exp(-times / 800.0)
    assert certify_recording(make_samples(ending, lag=2)).limit_cycle is None


def test_missing_samples_are_counted() -> None:
    samples = make_samples(-1e-3 + 1e-4 * np.sin(0.1 * np.arange(1000)))
    kept = np.ones(1000, dtype=bool)
    kept[[200, 500, 501]] = False
    thinned = RecordedSamples(
        "thinned", samples.times[kept], samples.positions[kept], samples.forces[kept]
    )
    result = certify_recording(thinned)
    assert (result.late_samples, result.missing_samples) == (2, 3)


def test_table_with_units_equals_a_recording(tmp_path: Path) -> None:
    samples = make_samples(-1e-3 + 1e-4 * np.sin(0.1 * np.arange(100)))
    rows = np.column_stack([samples.times, samples.positions, samples.forces])
    table = tmp_path / "run.csv"
    exported = tmp_path / "exported.csv"
    lines = [
        ",".join(f"{value:.17g}" for value in row) for row in rows * [1e3, 1e3, 1e3, 1e3, 1, 1, 1]
    ]
    table.write_text("t [ms],x [mm],y [mm],z [mm],fx [N],fy [N],fz [N]\n" + "\n".join(lines))
    columns = (("time", "s"), *[(axis, "m") for axis in "xyz"])
    columns += tuple((f"applied {axis}", "N") for axis in "xyz")
    recording = tmp_path / "run.mcap"
    writer = RecordingWriter(recording, columns)
    writer.append(rows)
    writer.close()
    first = read_samples(table)
    second = read_samples(recording)
    export_recording(open_recording(recording), exported)
    assert read_samples(exported).forces == pytest.approx(second.forces)
    assert first.positions == pytest.approx(second.positions, abs=1e-15)
    assert first.forces == pytest.approx(second.forces)


@pytest.mark.parametrize("step", [55e-6, 0.0])
def test_energy_along_exact_positions_is_named_beside_the_one_in_encoder_steps(
    tmp_path: Path, step: float
) -> None:
    samples = make_samples(-1e-3 + 1e-4 * np.sin(0.1 * np.arange(100)))
    heights = samples.positions[:, 2]
    rounded = step * np.round(heights / step) if step else heights
    work = np.concatenate([[0.0], np.cumsum(samples.forces[:-1, 2] * np.diff(rounded))])
    columns = (("time", "s"), *[(axis, "m") for axis in "xyz"])
    columns += tuple((f"applied {axis}", "N") for axis in "xyz")
    path = tmp_path / "run.mcap"
    metadata = {"servo": {"position_resolution": step}}
    with RecordingWriter(path, (*columns, ("supplied", "J")), metadata) as writer:
        writer.append(np.column_stack([samples.times, samples.positions, samples.forces, work]))
    result = certify_recording(read_samples(path))
    answer = recording_answer(result)
    facts = dict(recording_facts(open_recording(path)))
    if step:
        assert result.measured_energy == pytest.approx(work[-1])
        assert abs(work[-1] - result.energy) > 0.1 * abs(work[-1])
        measured = f"Energy to the hand: {energy_text(work[-1])}, as measured in encoder steps of"
        assert f"along the exact positions of the simulation. {measured} 55 µm." in answer
        assert facts["Supplied"] == "energy to the hand, as measured in encoder steps of 55 µm"
    else:
        assert result.measured_energy is None
        assert "encoder" not in answer
        assert "Supplied" not in facts


@pytest.mark.parametrize("is_early", [True, False])
def test_force_before_the_delay_of_an_early_recording_is_shifted(
    tmp_path: Path, is_early: bool
) -> None:
    heights = -1e-3 + 1e-4 * np.sin(0.1 * np.arange(100))
    prompt, late = make_samples(heights), make_samples(heights, lag=3)
    late.forces[:3] = 0.0
    forces = (prompt if is_early else late).forces
    columns = (("time", "s"), *[(axis, "m") for axis in "xyz"])
    columns += tuple((f"applied {axis}", "N") for axis in "xyz")
    metadata = {"made_by": "run", "servo": {"delay": 3, "position_resolution": 1e-5}}
    metadata |= {} if is_early else {"has_applied_delay": True}
    path = tmp_path / "run.mcap"
    with RecordingWriter(path, (*columns, ("supplied", "J")), metadata) as writer:
        writer.append(np.column_stack([late.times, late.positions, forces, np.zeros(100)]))
    samples = read_samples(path)
    np.testing.assert_array_equal(samples.forces, late.forces)
    assert (samples.measured_energy is None) == is_early
    facts = dict(recording_facts(open_recording(path)))
    assert ("Applied, supplied" in facts) == is_early


def test_oscillation_of_a_hand_that_a_recording_moves_is_no_limit_cycle() -> None:
    cycle = make_samples(-1e-3 + 2e-4 * np.sin(0.25 * np.arange(8000)), lag=2)
    text = recording_answer(certify_recording(cycle))
    assert "A limit cycle along z" in text
    text = recording_answer(certify_recording(replace(cycle, is_moved=True)))
    assert "An oscillation of a moved hand along z" in text
    assert "cycle" not in text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,x,y,z,fx,fy,fz\n0,0,0,0,0,0,0\n", "no column t with its unit"),
        ("t [s],x [m],y [m],z [m],fx [N],fy [N]\n", "no column fz"),
        ("t [s],x [m],y [m],z [m],fx [N],fy [N],fz [m]\n", "N"),
        ("t [s],x [m],y [m],z [m],fx [N],fy [N],fz [N]\n0,0,0\n", "without seven numbers"),
        (
            "t [s],x [m],y [m],z [m],fx [N],fy [N],fz [N]\n" + "1,0,0,0,0,0,0\n" * 20,
            "time does not increase after row 1",
        ),
        ("t [s],x [m],y [m],z [m],fx [N],fy [N],fz [N]\n0,0,0,0,0,0,nan\n", "not finite"),
        ("t [s],x [m],y [m],z [m],fx [N],fy [N],fz [N]\n0,0,0,0,0,0,0\n", "16 are needed"),
    ],
)
def test_bad_tables_are_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(ParameterError, match=message):
        read_samples(path)

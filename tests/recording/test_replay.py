"""Replay of recordings: forces are recomputed bit for bit, and differences are reported."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import asperity as asp
from asperity.certification.recorded_loop import certify_recording, read_samples
from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.recording import recorded_field as field
from asperity.recording import replay
from asperity.recording.recording import open_recording
from asperity.recording.replay import (
    COMPARED_COLUMNS,
    recorded_field,
    recorded_limits,
    recorded_surface_on,
)
from asperity.recording.row_encoding import row_type
from asperity.recording.writer import RecordingWriter
from asperity.report.sentences.loop_text import recording_answer, replay_answer
from asperity.simulation import Cartesian, Servo, SpringHand, Strokes, simulate
from asperity.simulation.trace import COLUMNS

WAVE = asp.Sinusoid(amplitude=0.3e-3, period=2e-3, direction=(1.0, 0.3))
X, Y = np.meshgrid(np.arange(24), np.arange(20))
MAP = asp.HeightMap(1e-4 * np.sin(0.7 * X + 0.2) * np.cos(0.9 * Y) ** 3, 1e-4)
SERVO = Servo(
    1e-4,
    delay=1,
    position_resolution=1e-6,
    force_resolution=1e-3,
    max_force=2.0,
    virtual_damping=0.2,
    velocity_share=0.3,
)
HAND = SpringHand(stiffness=(300.0, 300.0, 0.0), damping=2.0, mass=0.05, force=(0.0, 0.0, -1.0))
STROKES = Strokes((-0.005, 0.0, -1e-3), (0.005, 0.002, -1e-3), speed=0.05, count=5)


def make_recording(
    path: Path, texture: asp.Sinusoid | asp.HeightMap = WAVE, law: str = "F", **options: Any
) -> asp.Recording:
    friction = {"friction": 0.5, "friction_modulation": 0.6} if law in "CDH" else {}
    surface = asp.Surface(texture, law, 700.0, 0.4e-3, clamp="whole", **friction)  # type: ignore[arg-type]  # by name
    simulate(surface, Cartesian(0.02, 1.0), HAND, SERVO, STROKES, 2.0, trace=path, **options)
    return open_recording(path)


@pytest.mark.parametrize(("texture", "law"), [(WAVE, "F"), (MAP, "B"), (WAVE, "H")])
def test_replayed_forces_are_bit_identical(
    tmp_path: Path, texture: asp.Sinusoid | asp.HeightMap, law: str
) -> None:
    recording = make_recording(tmp_path / "run.mcap", texture, law)
    result = asp.replay(recording)
    assert (result.is_identical, result.rows, result.first_difference, result.notes) == (
        True,
        20_000,
        None,
        (),
    )
    assert repr(result) == "<Replay of 20000 rows, the same bit for bit>"
    assert np.abs(recording["commanded x"]).max() > 0.1
    assert bool(recording["law held"].any()) is (law != "B")


@pytest.mark.parametrize("law", ["C", "D"])
def test_rows_at_the_force_limit_and_below_the_depth_are_counted(tmp_path: Path, law: str) -> None:
    surface = asp.Surface(WAVE, law, 700.0, 0.4e-3)
    hand = SpringHand(stiffness=(300.0, 300.0, 0.0), damping=2.0, mass=0.05, force=(0.0, 0.0, -2.5))
    path = tmp_path / "run.mcap"
    run = simulate(surface, Cartesian(0.02, 1.0), hand, SERVO, STROKES, 0.1, trace=path)
    recording = open_recording(path)
    limits = recorded_limits(recording)
    assert limits is not None
    assert 100 < limits.force_limited == run.force_limited < 1000
    assert 100 < limits.too_deep == run.too_deep <= 1000
    assert limits.deepest == pytest.approx(run.deepest)
    text = f"The probe was below max_depth, 400 µm, in {limits.too_deep} samples, up to "
    assert text in recording_answer(recording)
    assert certify_recording(read_samples(path)).limits == limits
    assert asp.replay(recording).limits == limits


def test_gain_of_a_recording_counts_the_steps_that_the_loop_rounded_to(tmp_path: Path) -> None:
    """Positions are recorded exactly, and a step of 50 µm lies between neighbours."""
    surface = asp.Surface(WAVE, "W", 700.0, 0.4e-3)
    path = tmp_path / "run.mcap"
    servo = Servo(1e-3, position_resolution=5e-5, max_force=5.0)
    simulate(surface, Cartesian(0.05, 1.0), HAND, servo, STROKES, 0.5, trace=path)
    result = certify_recording(read_samples(path))
    assert result.position_step == (5e-5, 5e-5, 5e-5)
    assert result.gain < 1.2 * 700.0


def test_limits_of_a_recording_without_a_surface_are_unknown(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with RecordingWriter(path, COLUMNS) as writer:
        writer.append(np.zeros((20, len(COLUMNS))))
    assert recorded_limits(open_recording(path)) is None


def test_truncated_file_replays_to_its_end(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    make_recording(path)
    path.write_bytes(path.read_bytes()[:-2_000_000])
    result = asp.replay(open_recording(path))
    assert result.is_identical
    assert 4096 <= result.rows < 20_000


@pytest.mark.parametrize("row", [1, 5017, 2 * 4096])
def test_replay_ends_before_the_first_missing_sample(tmp_path: Path, row: int) -> None:
    whole = make_recording(tmp_path / "whole.mcap")
    rows = np.delete(np.concatenate([*whole.blocks()]), [row, 9000], axis=0)
    path = tmp_path / "run.mcap"
    attachments = {replay.TEXTURE_FILE: whole.attachment(replay.TEXTURE_FILE)}
    with asp.RecordingWriter(path, whole.columns, whole.metadata, attachments) as writer:  # type: ignore[arg-type]  # bytes
        writer.append(rows)
    result = asp.replay(path)
    assert (result.is_identical, result.rows, result.recorded_rows) == (True, row, 19_998)
    assert result.missing_before == pytest.approx((row + 1) * SERVO.period)
    assert result.to_dict()["missing_before"] == result.missing_before
    assert repr(result).startswith(f"<Replay of {row} of 19998 rows, up to a missing sample, ")
    words = replay_answer(result)
    assert words.startswith(f"All {row} rows before the first missing sample are reproduced")
    assert f"Samples are missing before row {row} of 19998, at " in words
    with asp.RecordingWriter(path, whole.columns, whole.metadata, attachments) as writer:  # type: ignore[arg-type]  # bytes
        writer.append(rows[row:])
    with pytest.raises(ParameterError, match="samples are missing before its first row, at "):
        asp.replay(path)


def change_value(path: Path, row: int, column: int, value: float) -> None:
    """Change one value of a recording and update the checksum of its block."""
    recording = open_recording(path)
    block, at = recording._chunks[row // 4096], row % 4096
    kind = row_type(len(COLUMNS))
    data = bytearray(path.read_bytes())
    place = block.rows_start + at * kind.itemsize + kind.itemsize - 8 * (len(COLUMNS) - column)
    struct.pack_into("<d", data, place, value)
    checksum = zlib.crc32(data[block.rows_start : block.end])
    struct.pack_into("<I", data, block.rows_start - 16, checksum)
    path.write_bytes(data)


def test_first_difference_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recording = make_recording(path)
    names = recording.names
    column, row = names.index("commanded y"), 9000
    value = float(recording["commanded y"][row])
    change_value(path, row, column, value + 0.25)
    result = asp.replay(open_recording(path))
    assert (result.is_identical, result.differing_rows) == (False, 1)
    assert result.first_difference is not None
    assert (result.first_difference.row, result.first_difference.column) == (row, "commanded y")
    assert (result.first_difference.recorded_value, result.first_difference.replayed_value) == (
        value + 0.25,
        value,
    )
    assert result.max_force_difference == pytest.approx(0.25)
    # A difference in the last bit is reported as well.
    change_value(path, row, column, float(np.nextafter(value, 9.0)))
    assert asp.replay(open_recording(path)).differing_rows == 1


def test_sign_of_zero_is_a_difference_and_equal_nans_are_not() -> None:
    block = np.zeros((4, 1 + len(COMPARED_COLUMNS)))
    block[:, 0] = np.arange(4)
    replayed = np.zeros((4, len(COMPARED_COLUMNS)))
    block[1, 2], block[2, 3], replayed[2, 2] = -0.0, np.nan, np.nan
    result = replay._compare(replay.Replay("", 0, 0, None, 0.0), 100, block, replayed)
    assert (result.rows, result.differing_rows, result.max_force_difference) == (4, 1, 0.0)
    assert result.first_difference is not None
    assert (result.first_difference.row, result.first_difference.column) == (101, "commanded y")


def test_state_is_carried_from_row_to_row(tmp_path: Path) -> None:
    """A changed position also changes later rows, through the anchor and the filtered velocity."""
    path = tmp_path / "run.mcap"
    recording = make_recording(path)
    change_value(path, 9000, 1, float(recording["x"][9000]) + 1e-3)
    result = asp.replay(open_recording(path))
    assert result.differing_rows > 10
    assert result.first_difference is not None
    assert result.first_difference.row == 9000


def test_another_surface_is_noted(tmp_path: Path) -> None:
    recording = make_recording(tmp_path / "run.mcap")
    other = asp.Sinusoid(amplitude=0.3e-3, period=2.1e-3, direction=(1.0, 0.3))
    result = asp.replay(recording, recorded_surface_on(recording, other))
    assert not result.is_identical
    assert result.max_force_difference > 1e-3
    (note,) = result.notes
    assert note.startswith("Recorded on another surface: content ")
    assert asp.replay(recording, recorded_surface_on(recording, WAVE)).notes == ()


def test_changed_version_formula_and_files_are_noted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text("before")
    about = {"files": {str(scene): replay.file_digest(scene), "gone.x3p": "0" * 16}}
    recording = make_recording(tmp_path / "run.mcap", metadata=about)
    assert asp.replay(recording).notes == ()
    scene.write_text("after")
    monkeypatch.setattr(replay, "__version__", "9.9")
    monkeypatch.setattr(replay, "formula_digest", lambda _law: "another")
    notes = asp.replay(recording).notes
    assert notes[0] == f"Recorded by asperity {asp.__version__}; this is 9.9."
    assert notes[1] == "The formula of law F is another one than it was."
    assert notes[2].startswith(f"The file {scene} has changed since")
    assert len(notes) == 3


def test_recordings_that_cannot_be_replayed_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def assert_refused(message: str, recording: asp.Recording) -> None:
        with pytest.raises(ParameterError, match=message):
            asp.replay(recording)

    path = tmp_path / "run.mcap"
    assert_refused("each 2th|holds every", make_recording(path, every=2))
    monkeypatch.setattr(field, "MAX_BYTES", 8)
    assert_refused("does not hold its surface", make_recording(path))
    monkeypatch.undo()
    columns = (("time", "s"), ("x", "m"))
    with asp.RecordingWriter(path, columns) as writer:
        writer.append(np.zeros((1, 2)))
    assert_refused("does not say which surface", open_recording(path))
    whole = make_recording(path)
    with asp.RecordingWriter(path, columns, whole.metadata) as writer:
        pass
    assert_refused("has no rows", open_recording(path))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"sampler": ["os"]}, r"texture of an unknown kind \(os\)"),
        ({"sampler": ["asperity.core.files"]}, "unknown kind"),
        ({"record": "Nothing"}, "its surface cannot be read"),
        ({"law": "Z"}, "law"),
        ({"clamp": "tight"}, "clamp"),
        ({"texture_content": "0"}, "holds another texture than its metadata"),
        ({"law_arguments": ["no number"]}, "its surface cannot be read"),
    ],
)
def test_manipulated_metadata_is_refused(
    tmp_path: Path, changes: dict[str, Any], words: str
) -> None:
    surface = asp.Surface(WAVE, "B")
    data = field.field_attachments(surface)
    metadata = field.field_metadata(surface)
    path = tmp_path / "run.mcap"
    with asp.RecordingWriter(path, COLUMNS, {"surface": metadata | changes}, data) as writer:
        writer.append(np.zeros((2, len(COLUMNS))))
    with pytest.raises(ParameterError, match=words):
        recorded_field(open_recording(path))


def test_recorded_field_equals_the_surface(tmp_path: Path) -> None:
    recording = make_recording(tmp_path / "run.mcap", MAP, "B")
    points: FloatArray = np.random.default_rng(2).uniform(0.0, 2e-3, (50, 2))
    np.testing.assert_array_equal(recorded_field(recording).height(points), MAP.height(points))
    assert set(COMPARED_COLUMNS) <= set(recording.names)
    assert recording.metadata["surface"]["law"] == "B"

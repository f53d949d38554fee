"""A recording replays by itself: bit by bit, and what differs is named."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import asperity as asp
from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.recording import recorded_field as field
from asperity.recording import replay
from asperity.recording.recording import open_recording
from asperity.recording.replay import COMPARED_COLUMNS, recorded_field, recorded_surface_on
from asperity.recording.row_encoding import row_type
from asperity.simulation import Cartesian, Servo, SpringHand, Strokes, simulate
from asperity.simulation.trace import COLUMNS

WAVE = asp.Sinusoid(amplitude=0.3e-3, period=2e-3, direction=(1.0, 0.3))
X, Y = np.meshgrid(np.arange(24), np.arange(20))
MAP = asp.HeightMap(1e-4 * np.sin(0.7 * X + 0.2) * np.cos(0.9 * Y) ** 3, 1e-4)
SERVO = Servo(
    1e-4, delay=1, position_resolution=1e-6, force_resolution=1e-3, max_force=2.0,
    virtual_damping=0.2, velocity_share=0.3,
)  # fmt: skip
HAND = SpringHand(stiffness=(300.0, 300.0, 0.0), damping=2.0, mass=0.05, force=(0.0, 0.0, -1.0))
WAY = Strokes((-0.005, 0.0, -1e-3), (0.005, 0.002, -1e-3), speed=0.05, count=5)


def recorded(
    path: Path, texture: asp.Sinusoid | asp.HeightMap = WAVE, law: str = "F", **options: Any
) -> asp.Recording:
    surface = asp.Surface(texture, law, stiffness=700.0, max_depth=0.4e-3, clamp="whole")
    simulate(surface, Cartesian(0.02, 1.0), HAND, SERVO, WAY, 2.0, trace=path, **options)
    return open_recording(path)


@pytest.mark.parametrize(("texture", "law"), [(WAVE, "F"), (MAP, "B")])
def test_the_law_gives_the_same_bits(
    tmp_path: Path, texture: asp.Sinusoid | asp.HeightMap, law: str
) -> None:
    recording = recorded(tmp_path / "run.mcap", texture, law)
    found = asp.replay(recording)
    assert (found.is_identical, found.rows, found.first_difference, found.notes) == (
        True,
        20_000,
        None,
        (),
    )
    assert repr(found) == "<Replay of 20000 rows, the same bit for bit>"
    assert np.abs(recording["commanded x"]).max() > 0.1
    assert bool(recording["law held"].any()) is (law == "F")


def test_a_file_that_is_cut_replays_to_its_end(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recorded(path)
    path.write_bytes(path.read_bytes()[:-2_000_000])
    found = asp.replay(open_recording(path))
    assert found.is_identical
    assert 4096 <= found.rows < 20_000


def spoilt(path: Path, row: int, column: int, value: float) -> None:
    """Change one number of a recording, and the checksum of its block with it."""
    recording = open_recording(path)
    block, at = recording._chunks[row // 4096], row % 4096
    kind = row_type(len(COLUMNS))
    data = bytearray(path.read_bytes())
    place = block.rows_start + at * kind.itemsize + kind.itemsize - 8 * (len(COLUMNS) - column)
    struct.pack_into("<d", data, place, value)
    checksum = zlib.crc32(data[block.rows_start : block.end])
    struct.pack_into("<I", data, block.rows_start - 16, checksum)
    path.write_bytes(data)


def test_the_first_row_that_differs_is_named(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recording = recorded(path)
    names = recording.names
    column, row = names.index("commanded y"), 9000
    value = float(recording["commanded y"][row])
    spoilt(path, row, column, value + 0.25)
    found = asp.replay(open_recording(path))
    assert (found.is_identical, found.differing_rows) == (False, 1)
    assert found.first_difference is not None
    assert (found.first_difference.row, found.first_difference.column) == (row, "commanded y")
    assert (found.first_difference.recorded_value, found.first_difference.replayed_value) == (
        value + 0.25,
        value,
    )
    assert found.max_force_difference == pytest.approx(0.25)
    # The last bit counts.
    spoilt(path, row, column, float(np.nextafter(value, 9.0)))
    assert asp.replay(open_recording(path)).differing_rows == 1


def test_the_sign_of_zero_counts_and_what_is_no_number() -> None:
    block = np.zeros((4, 1 + len(COMPARED_COLUMNS)))
    block[:, 0] = np.arange(4)
    replayed = np.zeros((4, len(COMPARED_COLUMNS)))
    block[1, 2], block[2, 3], replayed[2, 2] = -0.0, np.nan, np.nan
    found = replay._compare(replay.Replay("", 0, 0, None, 0.0), 100, block, replayed)
    assert (found.rows, found.differing_rows, found.max_force_difference) == (4, 1, 0.0)
    assert found.first_difference is not None
    assert (found.first_difference.row, found.first_difference.column) == (101, "commanded y")


def test_the_state_goes_from_row_to_row(tmp_path: Path) -> None:
    """Another position changes the rows after it, too: the anchor, and the filtered velocity."""
    path = tmp_path / "run.mcap"
    recording = recorded(path)
    spoilt(path, 9000, 1, float(recording["x"][9000]) + 1e-3)
    found = asp.replay(open_recording(path))
    assert found.differing_rows > 10
    assert found.first_difference is not None
    assert found.first_difference.row == 9000


def test_another_surface_is_said(tmp_path: Path) -> None:
    recording = recorded(tmp_path / "run.mcap")
    other = asp.Sinusoid(amplitude=0.3e-3, period=2.1e-3, direction=(1.0, 0.3))
    found = asp.replay(recording, recorded_surface_on(recording, other))
    assert not found.is_identical
    assert found.max_force_difference > 1e-3
    (note,) = found.notes
    assert note.startswith("Recorded on another surface: content ")
    assert asp.replay(recording, recorded_surface_on(recording, WAVE)).notes == ()


def test_what_has_changed_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text("before")
    about = {"files": {str(scene): replay.file_digest(scene), "gone.x3p": "0" * 16}}
    recording = recorded(tmp_path / "run.mcap", metadata=about)
    assert asp.replay(recording).notes == ()
    scene.write_text("after")
    monkeypatch.setattr(replay, "__version__", "9.9")
    monkeypatch.setattr(replay, "formula_digest", lambda _law: "another")
    notes = asp.replay(recording).notes
    assert notes[0] == "Recorded by asperity 0.1.0; this is 9.9."
    assert notes[1] == "The formula of law F is another one than it was."
    assert notes[2].startswith(f"The file {scene} has changed since")
    assert len(notes) == 3


def test_what_cannot_be_replayed_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(words: str, recording: asp.Recording) -> None:
        with pytest.raises(ParameterError, match=words):
            asp.replay(recording)

    path = tmp_path / "run.mcap"
    refused("each 2th|holds every", recorded(path, every=2))
    monkeypatch.setattr(field, "MAX_BYTES", 8)
    refused("does not hold its surface", recorded(path))
    monkeypatch.undo()
    columns = (("time", "s"), ("x", "m"))
    with asp.RecordingWriter(path, columns) as writer:
        writer.append(np.zeros((1, 2)))
    refused("does not say which surface", open_recording(path))
    whole = recorded(path)
    with asp.RecordingWriter(path, columns, whole.metadata) as writer:
        pass
    refused("has no rows", open_recording(path))


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
def test_a_recording_runs_no_code_and_believes_nothing(
    tmp_path: Path, changes: dict[str, Any], words: str
) -> None:
    surface = asp.Surface(WAVE, "B")
    data = field.field_attachments(surface)
    said = field.field_metadata(surface)
    path = tmp_path / "run.mcap"
    with asp.RecordingWriter(path, COLUMNS, {"surface": said | changes}, data) as writer:
        writer.append(np.zeros((2, len(COLUMNS))))
    with pytest.raises(ParameterError, match=words):
        recorded_field(open_recording(path))


def test_the_recorded_field_is_the_surface(tmp_path: Path) -> None:
    recording = recorded(tmp_path / "run.mcap", MAP, "B")
    points: FloatArray = np.random.default_rng(2).uniform(0.0, 2e-3, (50, 2))
    np.testing.assert_array_equal(recorded_field(recording).height(points), MAP.height(points))
    assert set(COMPARED_COLUMNS) <= set(recording.names)
    assert recording.metadata["surface"]["law"] == "B"

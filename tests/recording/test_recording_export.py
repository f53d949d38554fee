"""Export of recordings to CSV and MATLAB, without loss of precision."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from asperity.core.errors import ParameterError
from asperity.recording.recording import Recording, open_recording
from asperity.recording.table_export import export_recording
from asperity.recording.writer import RecordingWriter

COLUMNS = (("time", "s"), ("x", "m"), ("applied x", "N"))


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    table = np.random.default_rng(0).normal(size=(9001, 3))
    table[:, 0] = np.arange(9001) * 1e-4
    with RecordingWriter(tmp_path / "run.mcap", COLUMNS, {"law": "B"}) as writer:
        writer.append(table)
    return open_recording(tmp_path / "run.mcap")


def test_csv_export_is_lossless(recording: Recording, tmp_path: Path) -> None:
    fractions: list[float] = []
    export_recording(recording, tmp_path / "run.csv", fractions.append)
    assert (tmp_path / "run.csv").read_text().startswith("time [s],x [m],applied x [N]\n")
    table = np.loadtxt(tmp_path / "run.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(table, recording.table())
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0


def test_matlab_has_columns_by_name(recording: Recording, tmp_path: Path) -> None:
    export_recording(recording, tmp_path / "run.mat")
    contents = loadmat(tmp_path / "run.mat")
    np.testing.assert_array_equal(contents["applied_x"][:, 0], recording["applied x"])
    np.testing.assert_array_equal(contents["time"][:, 0], recording["time"])
    assert contents["units"]["applied_x"][0, 0][0] == "N"
    assert '"law": "B"' in contents["about"][0]


def test_failed_export_is_an_error_and_leaves_no_file(recording: Recording, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"output must end in .csv, .mat"):
        export_recording(recording, tmp_path / "run.xls")
    with pytest.raises(ParameterError, match="output cannot be written: No such file"):
        export_recording(recording, tmp_path / "no" / "run.csv")
    assert {path.name for path in tmp_path.iterdir()} == {"run.mcap"}


def test_failed_export_leaves_an_existing_file_unchanged(
    recording: Recording, tmp_path: Path
) -> None:
    data = bytearray(recording.path.read_bytes())
    data[recording._chunks[1].rows_start + 100] ^= 1
    recording.path.write_bytes(data)
    (tmp_path / "run.csv").write_text("precious")
    with pytest.raises(ParameterError, match="is damaged"):
        export_recording(recording, tmp_path / "run.csv")
    assert (tmp_path / "run.csv").read_text() == "precious"

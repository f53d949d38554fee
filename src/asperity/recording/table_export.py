"""Export of the rows of a recording as CSV or MATLAB."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO

from asperity.core.errors import ParameterError
from asperity.core.files import json_text, open_output
from asperity.recording.recording import Recording

Progress = Callable[[float], object]
# A variable of MATLAB's format 5 has fewer bytes.
_MAX_MAT_BYTES = 2**31 - 1


def export_recording(
    recording: Recording, path: str | os.PathLike[str], progress: Progress | None = None
) -> None:
    """Write the rows to a file, atomically; the suffix decides the format.

    No digit is lost: text has 17 digits, the other format is binary. Columns are named as in the
    recording: in CSV with their units, for MATLAB with underscores for blanks.

    Args:
        recording: the recording.
        path: file that ends in .csv or .mat.
        progress: called now and then with the completed fraction, in [0, 1].

    Raises:
        ParameterError: for another suffix, a file that cannot be written, or more rows than the
            format takes.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in TABLE_WRITERS:
        raise ParameterError("output", f"must end in {', '.join(TABLE_WRITERS)}", str(path))
    with open_output("output", path) as stream:
        TABLE_WRITERS[suffix](recording, stream, progress or (lambda _part: None))


def _write_csv(recording: Recording, stream: IO[bytes], progress: Progress) -> None:
    head = ",".join([f"{name} [{unit}]" for name, unit in recording.columns])
    stream.write(f"{head}\n".encode())
    row = ",".join(["%.17g"] * len(recording.columns)) + "\n"
    done = 0
    for block in recording.blocks():
        stream.write((row * len(block) % tuple(block.ravel().tolist())).encode())
        done += len(block)
        progress(done / recording.rows)


def _write_mat(recording: Recording, stream: IO[bytes], progress: Progress) -> None:
    from scipy.io import savemat

    if recording.rows * 8 > _MAX_MAT_BYTES:
        max_rows = _MAX_MAT_BYTES // 8
        requirement = f"has room for {max_rows} rows in .mat, not {recording.rows}"
        raise ParameterError("output", requirement)
    table = recording.table()
    progress(0.5)
    columns = {_variable_name(name): table[:, [i]] for i, name in enumerate(recording.names)}
    units = {_variable_name(name): unit for name, unit in recording.columns}
    about = json_text(recording.metadata)
    content = {**columns, "units": units, "about": about}
    savemat(stream, content, long_field_names=True)  # type: ignore[arg-type]  # streams are taken, too


def _variable_name(name: str) -> str:
    return name.replace(" ", "_")


TABLE_WRITERS: Mapping[str, Callable[[Recording, IO[bytes], Progress], None]] = {
    ".csv": _write_csv,
    ".mat": _write_mat,
}

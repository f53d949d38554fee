"""Recordings on disk: lossless, readable when truncated, and readable by other MCAP libraries."""

from __future__ import annotations

import io
import os
import shutil
import struct
import subprocess
import sys
import time
import zlib
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench.stress import recording_kills
from mcap.reader import make_reader
from mcap.records import Chunk, MessageIndex
from mcap.stream_reader import StreamReader
from mcap.writer import Writer as PeerWriter
from mcap_ros2.decoder import DecoderFactory
from rich.console import Console

import asperity as asp
from asperity.core.errors import ParameterError
from asperity.core.files import write_bytes
from asperity.recording import mcap, writer
from asperity.recording.recording import Recording, is_recording, open_recording
from asperity.recording.row_encoding import row_type, schema_columns, schema_text
from asperity.recording.writer import RecordingWriter

COLUMNS = (("time", "s"), ("x", "m"), ("applied x", "N"), ("law held", "1"))
ROW = row_type(len(COLUMNS)).itemsize


def random_rows(count: int, seed: int = 0) -> np.ndarray:
    """Return rows with random bit patterns and increasing times."""
    bits = np.random.default_rng(seed).integers(0, 2**63, (count, len(COLUMNS)), dtype=np.uint64)
    table = bits.view(np.float64)
    table[::7, 1], table[1::7, 1], table[2::7, 1] = np.nan, -np.inf, -0.0
    table[:, 0] = 1e-4 * np.arange(count)
    return table


def write_recording(path: Path, table: np.ndarray, block: int = 100, close: bool = True) -> Path:
    out = RecordingWriter(path, COLUMNS, {"law": "B"}, {"a.bin": b"abc"})
    for first in range(0, len(table), block):
        out.append(table[first : first + block])
    out.flush()
    (out.close if close else partial(abandon, out))()
    return path


def abandon(out: RecordingWriter) -> None:
    """Leave a recording unfinished, as a killed process does."""
    out._file.close()


def assert_same(actual: np.ndarray, expected: np.ndarray) -> None:
    assert actual.shape == expected.shape
    np.testing.assert_array_equal(actual.view(np.uint64), expected.view(np.uint64))


@pytest.mark.parametrize("block", [1, 100, 4096, 20_000])
def test_round_trip_is_bit_identical(tmp_path: Path, block: int) -> None:
    table = random_rows(9001 if block > 1 else 301)
    recording = open_recording(write_recording(tmp_path / "run.mcap", table, block))
    assert_same(recording.table(), table)
    assert (recording.rows, recording.columns, recording.is_complete, recording.unread_bytes) == (
        len(table),
        COLUMNS,
        True,
        0,
    )
    assert recording.metadata == {"law": "B"}
    assert recording.attachment("a.bin") == b"abc"
    assert recording.attachment("b.bin") is None
    assert recording.duration == pytest.approx(table[-1, 0])
    assert_same(recording["applied x"], np.ascontiguousarray(table[:, 2]))
    assert sum(map(len, recording.blocks())) == recording.rows


@pytest.mark.parametrize("max_rows", [10_000, 4097, 100, 7, 1])
def test_table_is_decimated_evenly(tmp_path: Path, max_rows: int) -> None:
    rows = random_rows(9001)
    table = open_recording(write_recording(tmp_path / "run.mcap", rows)).table(max_rows)
    assert len(table) <= max_rows
    assert_same(table, rows[:: -(-9001 // max_rows)])


def test_mcap_library_reads_the_same_rows(tmp_path: Path) -> None:
    table = random_rows(9001)
    table[:, 1:] = np.random.default_rng(1).normal(size=(9001, 3))
    with write_recording(tmp_path / "run.mcap", table).open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 9001
        assert summary.statistics.message_end_time == 900_000_000
        assert [one.name for one in reader.iter_metadata()] == ["asperity"]
        assert [(one.name, one.data) for one in reader.iter_attachments()] == [("a.bin", b"abc")]
        rows = [
            (message.sequence, row.time, row.x, row.applied_x, row.law_held)
            for _schema, _channel, message, row in reader.iter_decoded_messages()
        ]
        # Reading in reverse uses the index of the rows.
        last = next(iter(reader.iter_messages(reverse=True)))[2]
    assert_same(np.array(rows)[:, 1:], table)
    assert [row[0] for row in rows] == list(range(9001))
    assert last.sequence == 9000


def test_index_and_footer_offsets_are_right(tmp_path: Path) -> None:
    data = write_recording(tmp_path / "run.mcap", random_rows(9001)).read_bytes()
    chunks, indices = [], []
    for record in StreamReader(io.BytesIO(data), emit_chunks=True, validate_crcs=True).records:
        if isinstance(record, Chunk):
            chunks.append(record)
        elif isinstance(record, MessageIndex):
            indices.append(record)
    assert len(chunks) == len(indices) == 3
    for chunk, index in zip(chunks, indices, strict=True):
        times, places = zip(*index.records, strict=True)
        assert list(places) == list(range(0, len(chunk.data), ROW))
        logged = np.frombuffer(chunk.data, row_type(len(COLUMNS)))["logged"]
        assert list(times) == logged.tolist()
        assert (chunk.message_start_time, chunk.message_end_time) == (times[0], times[-1])
    # The footer holds the start of the summary and its checksum.
    start, _offsets, checksum = struct.unpack_from("<QQI", data, len(data) - 28)
    assert data[start] == mcap.Opcode.SCHEMA
    assert checksum == zlib.crc32(data[start:-12])


def test_truncated_file_opens_with_its_complete_blocks(tmp_path: Path) -> None:
    """Truncation inside the header is an error; the writer never leaves such a file."""
    table = random_rows(40)
    writer = RecordingWriter(tmp_path / "blocks.mcap", COLUMNS, {})
    header_size = (tmp_path / "blocks.mcap").stat().st_size
    for first in range(0, 40, 10):
        writer.append(table[first : first + 10])
        writer.flush()
    writer.close()
    data = (tmp_path / "blocks.mcap").read_bytes()
    cut, row_counts = tmp_path / "cut.mcap", set()
    for size in range(header_size, len(data), 3):
        cut.write_bytes(data[:size])
        recording = open_recording(cut)
        assert_same(recording.table(), table[: recording.rows])
        assert recording.rows >= 10 * ((size - header_size) // (10 * (ROW + 16) + 200))
        assert recording.is_complete or recording.rows in {0, 10, 20, 30, 40}
        assert "not closed" in repr(recording) or recording.is_complete
        row_counts.add(recording.rows)
    assert row_counts == {0, 10, 20, 30, 40}
    for size in range(1, header_size, 3):
        cut.write_bytes(data[:size])
        with pytest.raises(ParameterError, match="cannot be read: it"):
            open_recording(cut)


def test_last_block_overwritten_with_zeros_is_dropped(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    table = random_rows(9001)
    data = bytearray(write_recording(path, table, close=False).read_bytes())
    data[-20_000:] = bytes(20_000)  # the index of the last block, and the end of its rows
    path.write_bytes(data)
    recording = open_recording(path)
    assert (recording.rows, recording.is_complete) == (8192, False)
    assert recording.unread_bytes > 20_000
    assert_same(recording.table(), table[:8192])


def test_damaged_block_is_an_error(tmp_path: Path) -> None:
    path = write_recording(tmp_path / "run.mcap", random_rows(9001))
    data = bytearray(path.read_bytes())
    data[(ROW + 16) * 4096 + 50 * ROW] ^= 1
    path.write_bytes(data)
    with pytest.raises(ParameterError, match="the block after row 4096 is damaged"):
        open_recording(path).table()


def test_rows_are_flushed_after_half_a_second(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    path = tmp_path / "run.mcap"
    out = RecordingWriter(path, COLUMNS)
    for wait, rows in ((0.1, 0), (0.3, 0), (0.2, 3), (0.3, 3), (0.3, 5)):
        now[0] += wait
        out.append(random_rows(1))
        assert open_recording(path).rows == rows
    assert repr(out) == "<RecordingWriter of run.mcap, 5 rows written>"
    out.append(random_rows(1))
    out.close()
    out.close()  # again: nothing to do
    assert open_recording(path).rows == 6


def test_existing_file_is_replaced_only_by_a_complete_header(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    write_bytes("path", path, b"precious")
    with pytest.raises(ParameterError, match="columns must begin"):
        RecordingWriter(path, (("x", "m"),))
    assert path.read_text() == "precious"
    abandon(RecordingWriter(path, COLUMNS))
    assert open_recording(path).rows == 0
    assert [one.name for one in tmp_path.iterdir()] == ["run.mcap"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_full_disk_and_missing_folder_are_errors(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"path cannot be written: .*No space left"):
        RecordingWriter("/dev/full", COLUMNS)
    with pytest.raises(ParameterError, match=r"trace cannot be written: .*No such file"):
        RecordingWriter(tmp_path / "no" / "run.mcap", COLUMNS, argument="trace")


_LIMITED_RECORDER = """
import resource, signal, sys
import numpy as np
from asperity.core.errors import ParameterError
from asperity.recording.writer import RecordingWriter
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
try:
    out = RecordingWriter(sys.argv[1], (("time", "s"), ("x", "m")))
    out.append(np.arange(40_000.0).reshape(-1, 2))
except ParameterError as error:
    print(error)
"""


def record_with_file_size_limit(size: int, path: Path) -> str:
    """Return the output of a process that records with a limit on the file size.

    The limit stands for a full disk: writes are short at first, then fail.
    """
    script = [sys.executable, "-c", _LIMITED_RECORDER, str(path), str(size)]
    done = subprocess.run(script, capture_output=True, text=True, check=True, timeout=60)
    return done.stdout


def test_disk_that_fills_up_leaves_whole_blocks(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    output = record_with_file_size_limit(400_000, path)
    recording = open_recording(path)
    message = "path cannot be written any further (File too large): 4096 rows are in"
    assert output.startswith(message)
    assert (recording.rows, recording.unread_bytes) == (4096, 0)
    assert_same(recording.table(), np.arange(40_000.0).reshape(-1, 2)[:4096])


def test_full_disk_leaves_an_existing_file_unchanged(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_text("precious")
    output = record_with_file_size_limit(100, path)
    assert output.startswith("path cannot be written: [Errno 27] File too large")
    assert path.read_text() == "precious"
    assert [one.name for one in tmp_path.iterdir()] == ["run.mcap"]


def write_foreign_mcap(path: Path) -> None:
    with path.open("wb") as stream:
        peer = PeerWriter(stream)
        peer.start()
        schema = peer.register_schema("a", "jsonschema", b"{}")
        channel = peer.register_channel("/a", "json", schema)
        peer.add_message(channel, 0, b"{}", 0)
        peer.finish()


def write_later_version(path: Path) -> None:
    data = write_recording(path, random_rows(3)).read_bytes()
    path.write_bytes(data.replace(b"\x01\0\0\x001", b"\x01\0\0\x002", 1))


def write_compressed(path: Path) -> None:
    data = bytearray(write_recording(path, random_rows(3)).read_bytes())
    at = data.index(struct.pack("<Q", 3 * ROW)) + 8 + 4
    assert struct.unpack_from("<I", data, at - 4)[0] == zlib.crc32(
        data[at + 12 : at + 12 + 3 * ROW]
    )
    data[at] = 4
    path.write_bytes(data)


def make_folder(path: Path) -> None:
    path.mkdir()


BAD: dict[str, tuple[Callable[[Path], object], str]] = {
    "missing": (lambda path: path.exists(), "No such file"),
    "empty": (lambda path: path.write_bytes(b""), "it is empty"),
    "a folder": (make_folder, "not a regular file"),
    "a picture": (
        lambda path: path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(99)),
        "not an MCAP recording",
    ),
    "magic alone": (lambda path: path.write_bytes(mcap.MAGIC), "ends before its first row"),
    "of others": (write_foreign_mcap, "it was not written by asperity"),
    "later": (write_later_version, "of format 2, of asperity .*; this asperity reads format 1"),
    "compressed": (write_compressed, "blocks are compressed"),
}


@pytest.mark.parametrize("name", BAD)
def test_unreadable_files_are_errors(tmp_path: Path, name: str) -> None:
    make, message = BAD[name]
    path = tmp_path / "run.mcap"
    make(path)
    with pytest.raises(ParameterError, match=f"recording .*run.mcap cannot be read: .*{message}"):
        open_recording(path)


def test_flipped_bits_raise_only_parameter_errors(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    data = write_recording(path, random_rows(40), block=40).read_bytes()
    rng = np.random.default_rng(5)
    for _ in range(500):
        damaged = bytearray(data)
        for at in rng.integers(len(mcap.MAGIC), len(data), 3):
            damaged[at] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        with suppress(ParameterError):
            open_recording(path).table()


def contents(path: Path) -> tuple[object, ...]:
    recording = open_recording(path)
    files = {name: recording.attachment(name) for name in recording._attachments}
    rows = recording.table().tobytes(), recording.duration
    return recording.metadata, recording.version, recording.columns, files, rows


def test_flipped_bits_change_nothing_in_silence(tmp_path: Path) -> None:
    """A recording is read as it was written, or refused, or not closed: it ends earlier."""
    path = tmp_path / "run.mcap"
    data = write_recording(path, random_rows(40), block=10).read_bytes()
    whole = contents(path)
    rng = np.random.default_rng(7)
    outcomes = Counter[str]()
    for bit in rng.choice(8 * len(data), 1500, replace=False).tolist():
        damaged = bytearray(data)
        damaged[bit // 8] ^= 1 << bit % 8
        path.write_bytes(damaged)
        outcome = "refused"
        with suppress(ParameterError):
            outcome = "equal" if contents(path) == whole else "changed"
            if not open_recording(path).is_complete:
                outcome = "not closed"
        outcomes[outcome] += 1
    assert outcomes["changed"] == 0
    assert outcomes["refused"] > outcomes["equal"] > 0  # the latter in the index at the end


def test_recordings_without_a_checksum_of_the_metadata_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those of early versions; their metadata can change in silence, which is the control."""
    path = tmp_path / "run.mcap"
    encode = mcap._encode_part

    def leave_out(part: Any) -> bytes:
        texts = isinstance(part, dict) and {**part}
        return encode({key: x for key, x in texts.items() if key != "checksum"} if texts else part)

    monkeypatch.setattr(mcap, "_encode_part", leave_out)
    data = write_recording(path, random_rows(3)).read_bytes()
    monkeypatch.undo()
    assert open_recording(path).metadata == {"law": "B"}
    path.write_bytes(data.replace(b'"law": "B"', b'"law": "C"'))
    assert open_recording(path).metadata == {"law": "C"}
    data = write_recording(path, random_rows(3)).read_bytes()
    path.write_bytes(data.replace(b'"law": "B"', b'"law": "C"'))
    with pytest.raises(ParameterError, match="its metadata is damaged: the checksum is wrong"):
        open_recording(path)


def test_recordings_are_recognised_by_their_first_bytes(tmp_path: Path) -> None:
    path = write_recording(tmp_path / "anything", random_rows(3))
    assert is_recording(path)
    path.write_bytes(b"time [s]\n")
    assert not is_recording(path)
    assert not is_recording(tmp_path)


def test_columns_round_trip_through_the_schema(tmp_path: Path) -> None:
    assert schema_columns(schema_text(COLUMNS)) == COLUMNS
    for bad in ("X", "x_y", "1x", "x ", "", "x y"):
        columns = (("time", "s"), (bad, "m"), ("x y", "m"))
        with pytest.raises(ParameterError, match="columns must"):
            schema_text(columns)
    with pytest.raises(mcap.DamagedError, match="no table"):
        schema_columns("float64 time # [s]\nstring x # [m]\n")
    out = RecordingWriter(tmp_path / "run.mcap", COLUMNS)
    with pytest.raises(ParameterError, match=r"block must have the shape \(rows, 4\)"):
        out.append(np.zeros((3, 5)))
    out.close()
    with pytest.raises(ParameterError, match="column is unknown: 'applied'; did you mean"):
        open_recording(tmp_path / "run.mcap")["applied"]


def test_killed_process_loses_less_than_a_second() -> None:
    """Kill a few recording processes; the benchmark kills many more."""
    assert writer.MAX_WAIT <= 0.5
    assert recording_kills.run(8, Console(quiet=True)) == {}


def test_public_interface_of_recordings(tmp_path: Path) -> None:
    path = write_recording(tmp_path / "run.mcap", random_rows(3))
    recording = asp.open_recording(path)
    assert type(recording) is asp.Recording is Recording
    assert repr(recording) == "<Recording run.mcap, 3 rows, 0.0002 s>"
    data = recording.to_dict()
    assert (data["rows"], data["whole"], data["columns"][2]) == (
        3,
        True,
        {"name": "applied x", "unit": "N"},
    )
    link = tmp_path / "link.mcap"
    os.symlink(path, link)
    RecordingWriter(link, COLUMNS).close()
    assert link.is_symlink()
    assert open_recording(path).rows == 0
    shutil.rmtree(tmp_path)
    with pytest.raises(ParameterError, match="No such file"):
        recording.table()

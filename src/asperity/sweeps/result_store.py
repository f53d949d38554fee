"""The results folder of a sweep: one line per case, appended when the case is done.

A process that is killed at any moment leaves whole lines, and at most one torn line at the end,
which is removed when the folder is opened again.
"""

from __future__ import annotations

import json
import re
import weakref
from array import array
from collections.abc import Iterable, Iterator, Mapping
from io import BufferedReader, FileIO
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from asperity.core.errors import ParameterError, escape_unprintable
from asperity.core.files import json_text, open_input, write_bytes
from asperity.core.processes import defer_interrupt
from asperity.sweeps.compute_cases import Outcome

PLAN_FILE, CASES_FILE, _LOCK_FILE = "sweep.json", "cases.jsonl", ".lock"
_MISSING = -1
_LINE = re.compile(rb'\{"case": (\d+), .*\}\n')
_INFINITIES = {"inf": float("inf"), "-inf": -float("inf")}


class ResultStore:
    """Outcomes of cases on disk; no other process can use the folder until it is released.

    Args:
        folder: a new or empty folder, or that of the same sweep.
        plan: plain data that identifies the sweep.
        n_cases: number of cases.

    Attributes:
        path: the folder.
        n_done: number of cases that are recorded.

    Raises:
        ParameterError: for a folder that cannot be used.
    """

    def __init__(self, folder: Path, plan: Mapping[str, Any], n_cases: int) -> None:
        self.path, self.n_done = folder, 0
        self._offsets = array("q", [_MISSING]) * n_cases
        self._lock = _lock_folder(folder)
        try:
            _check_plan(folder, plan)
            self._stream, self._reader = _open_cases(folder / CASES_FILE)
            self._end = self._find_cases()
        except BaseException:
            self._lock.release()
            raise
        weakref.finalize(self, self._stream.close)
        weakref.finalize(self, self._reader.close)

    def release(self) -> None:
        """Let other processes write to the folder; the outcomes can still be read."""
        self._lock.release()

    def _find_cases(self) -> int:
        """Note where each case begins; return the end of the last whole line."""
        end = 0
        for line in self._reader:
            match = _LINE.fullmatch(line)
            if match is not None and int(match[1]) < len(self._offsets):
                self._note(int(match[1]), end)
            if line.endswith(b"\n"):
                end += len(line)
        self._stream.truncate(end)
        return end

    def _note(self, index: int, offset: int) -> None:
        self.n_done += self._offsets[index] == _MISSING
        self._offsets[index] = offset

    def __contains__(self, index: int) -> bool:
        return self._offsets[index] != _MISSING

    def record(self, outcomes: Iterable[Outcome]) -> None:
        """Append outcomes.

        Raises:
            ParameterError: if they cannot be written; what was recorded before stays.
        """
        lines, offsets = [], []
        offset = self._end
        for one in outcomes:
            lines.append(_case_line(one))
            offsets.append((one.index, offset))
            offset += len(lines[-1])
        with defer_interrupt():
            self._append(b"".join(lines))
            for index, at in offsets:
                self._note(index, at)
            self._end = offset

    def _append(self, data: bytes) -> None:
        try:
            self._stream.seek(self._end)
            written = 0
            while written < len(data):  # the disk may have room for a part
                written += self._stream.write(data[written:])
        except OSError as error:
            self._stream.truncate(self._end)
            words = f"cannot be written: {error.strerror}; the same command goes on from here"
            raise ParameterError("output", words, str(self.path)) from None

    def outcome(self, index: int) -> Outcome:
        """Return a recorded outcome."""
        self._reader.seek(self._offsets[index])
        data = json.loads(self._reader.readline())
        rows = tuple({name: _decode(v) for name, v in row.items()} for row in data["rows"])
        return Outcome(index, rows, data["error"])

    def outcomes(self) -> Iterator[Outcome]:
        """Yield the recorded outcomes in the order of their numbers."""
        return (self.outcome(index) for index in range(len(self._offsets)) if index in self)


def _case_line(outcome: Outcome) -> bytes:
    data = {"case": outcome.index, "error": outcome.error, "rows": outcome.rows}
    return json.dumps(data, allow_nan=False, ensure_ascii=False).encode() + b"\n"


def _decode(value: Any) -> Any:
    """Return a number that JSON has no token for."""
    return _INFINITIES.get(value, value) if isinstance(value, str) else value


def _open_cases(path: Path) -> tuple[FileIO, BufferedReader]:
    """Return the file of the outcomes, unbuffered for writing and for reading."""
    try:
        path.touch()
        return path.open("r+b", buffering=0), path.open("rb")
    except OSError as error:
        words = f"cannot be written: {error.strerror}"
        raise ParameterError("output", words, str(path.parent)) from None


def _lock_folder(folder: Path) -> FileLock:
    """Return the lock of a folder, which is made where there is none."""
    name = escape_unprintable(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = FileLock(folder / _LOCK_FILE, timeout=0)
        lock.acquire()
    except Timeout:
        raise ParameterError("output", f"is in use by another sweep: {name}") from None
    except OSError as error:
        words = f"must be a folder that can be written: {error.strerror}"
        raise ParameterError("output", words, name) from None
    return lock


def _check_plan(folder: Path, plan: Mapping[str, Any]) -> None:
    """Check that a folder is empty or holds this sweep, and write the plan into an empty one."""
    path, text = folder / PLAN_FILE, json_text(plan)
    if not path.exists():
        if any(one.name != _LOCK_FILE for one in folder.iterdir()):
            words = "is neither empty nor the folder of a sweep"
            raise ParameterError("output", f"{words}: {escape_unprintable(folder)}")
        write_bytes("output", path, text.encode())
        return
    try:
        with open_input(path) as stream:
            recorded = json.loads(stream.read())
    except (OSError, ValueError):
        recorded = {}
    differing = [name for name, value in json.loads(text).items() if recorded.get(name) != value]
    if differing:
        same = set(differing) <= {"asperity", "package"}
        words = "was computed by another version" if same else "holds another sweep"
        which = f"{words} (other {', '.join(differing)}): {escape_unprintable(folder)}"
        raise ParameterError("output", f"{which}; choose another folder")

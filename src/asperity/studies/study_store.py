"""The folder of a study: one line per answer, with codes in place of stimuli.

A line is written and synchronized before the next trial. A process that is killed leaves whole
lines, and at most one torn line at the end, which is removed when the participant goes on. What was
presented is not recorded: it follows from the design, the number of the participant and the answers
before, see :class:`~asperity.studies.methods.Method`.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import os
import re
import shutil
from base64 import b32encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from filelock import FileLock, Timeout

from asperity.core.errors import ParameterError, escape_unprintable
from asperity.core.files import json_text, open_input, to_plain_data, write_bytes
from asperity.core.version import __version__
from asperity.recording.replay import file_digest
from asperity.studies.methods import METHODS, Method, Presentation
from asperity.studies.study_file import Study, build_study

STUDY_FILE, ANSWERS_FILE, KEY_FILE = "study.json", "answers.jsonl", "key.csv"
TABLE_FILES = ("trials", "table")
DERIVED_FILES = (
    KEY_FILE,
    "report.html",
    *(f"{name}.{kind}" for name in TABLE_FILES for kind in ("csv", "parquet")),
)
"""Files that a report writes; they hold data of all participants."""
_NUMBER_FILE, _LOCK_FILE = "participant.json", ".lock"
SCHEMA = 1
_CODE = re.compile(r"(?=.*\d)[A-Za-z0-9][A-Za-z0-9_-]{0,15}")
_CODE_LENGTH = 6  # of a stimulus


@dataclass(frozen=True)
class TrialRecord:
    """An answered trial.

    Attributes:
        participant: code of the participant.
        run: number of the sitting, from 1.
        trial: number of the trial, from 1.
        presentation: what was presented.
        answer: as given.
        response_time: from the question to the answer [s].
        started: start of the trial, ISO 8601.
    """

    participant: str
    run: int
    trial: int
    presentation: Presentation
    answer: str
    response_time: float
    started: str


def check_participant(code: str) -> str:
    """Return the code of a participant.

    Raises:
        ParameterError: for a text that may be a name.
    """
    if _CODE.fullmatch(code) is None:
        words = "must be a code of letters and digits, such as P01, and no name"
        raise ParameterError("participant", words, escape_unprintable(code))
    return code


def stimulus_code(seed: int, participant: str, values: Mapping[str, Any]) -> str:
    """Return the code of a stimulus for a participant, which does not reveal its values.

    Example:
        >>> stimulus_code(1, "P01", {"surface.law": "A"})
        'BVUDHY'
    """
    text = json.dumps([seed, participant, to_plain_data(values)], sort_keys=True)
    return b32encode(hashlib.sha256(text.encode()).digest()).decode()[:_CODE_LENGTH]


def stimulus_codes(study: Study, participant: str, presentation: Presentation) -> list[str]:
    """Return the codes of the intervals of a trial."""
    seed = study.design.seed
    return [stimulus_code(seed, participant, values) for values in presentation.intervals]


def write_study(folder: Path, study: Study) -> None:
    """Write a study into an empty folder, or check that a folder holds it.

    Raises:
        ParameterError: for a folder that holds something else, or that cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with FileLock(folder / _LOCK_FILE):
            _check_or_write(folder, study)
    except OSError as error:
        words = f"must be a folder that can be written: {error.strerror}"
        raise ParameterError("output", words, escape_unprintable(folder)) from None


def _check_or_write(folder: Path, study: Study) -> None:
    path, text = folder / STUDY_FILE, json_text(_describe(study))
    if not path.exists():
        if any(one.name != _LOCK_FILE for one in folder.iterdir()):
            words = "is neither empty nor the folder of a study"
            raise ParameterError("output", words, escape_unprintable(folder))
        write_bytes("output", path, text.encode())
        return
    recorded, given = _read_json(path), json.loads(text)
    differing = [name for name, value in given.items() if recorded.get(name) != value]
    if differing:
        words = f"holds another study or version (other {', '.join(differing)}): choose another"
        raise ParameterError("output", words, escape_unprintable(folder))


def _describe(study: Study) -> dict[str, Any]:
    """Return plain data that identifies a study."""
    path = study.sections.get("texture", {}).get("path")
    digest = file_digest(study.folder / path) if isinstance(path, str) else None
    return {
        "schema": SCHEMA,
        "asperity": __version__,
        "file": digest,
        **{f"[{name}]": section for name, section in study.content.items()},
    }


def _read_json(path: Path) -> dict[str, Any]:
    try:
        with open_input(path) as stream:
            content = json.loads(stream.read())
    except ValueError:
        content = None
    if not isinstance(content, dict):
        raise ParameterError("folder", f"has a damaged file: {escape_unprintable(path)}")
    return content


def read_study(folder: str | Path) -> Study:
    """Return the study of a folder.

    Raises:
        ParameterError: for a folder of something else, or of another version.
    """
    path = Path(folder) / STUDY_FILE
    if not path.is_file():
        words = "is no folder of a study: asperity study run makes one"
        raise ParameterError("folder", words, escape_unprintable(folder))
    content = _read_json(path)
    if content.get("schema") != SCHEMA:
        words = f"is of another version: schema {content.get('schema')!r}, not {SCHEMA}"
        raise ParameterError("folder", words, escape_unprintable(folder))
    sections = {name[1:-1]: part for name, part in content.items() if name.startswith("[")}
    return build_study(sections, Path(folder))


def list_participants(folder: str | Path) -> dict[str, int]:
    """Return the numbers of the participants by code, in the order of the numbers."""
    found = {
        path.parent.name: int(_read_json(path)["number"])
        for path in Path(folder).glob(f"*/{_NUMBER_FILE}")
    }
    return dict(sorted(found.items(), key=lambda item: item[1]))


def read_trials(folder: str | Path) -> list[TrialRecord]:
    """Return the answered trials of all participants, with what was presented.

    Args:
        folder: of a study.

    Raises:
        ParameterError: for another folder, a damaged file, or answers of another version.
    """
    study = read_study(folder)
    records = []
    for code, number in list_participants(folder).items():
        lines, _ = _read_lines(Path(folder) / code / ANSWERS_FILE)
        records += replay_answers(study, code, number, lines)[1]
    return records


def replay_answers(
    study: Study, participant: str, number: int, lines: Sequence[Mapping[str, Any]]
) -> tuple[Method, list[TrialRecord]]:
    """Return the method after recorded answers, and the trials.

    Raises:
        ParameterError: if the answers do not belong to these stimuli.
    """
    method = METHODS[study.design.kind].make(study.design, number, study.design.seed)
    records = []
    for count, line in enumerate(lines, start=1):
        shown = method.next()
        if (
            shown is None
            or line["trial"] != count
            or stimulus_codes(study, participant, shown) != line["codes"]
        ):
            words = f"trial {count} of {participant} was not made by this study and version"
            raise ParameterError("folder", words)
        method.answer(line["answer"])
        own = (line[name] for name in ("answer", "response_time", "started"))
        records.append(TrialRecord(participant, line["run"], count, shown, *own))
    return method, records


_KEYS = {"run", "trial", "codes", "answer", "response_time", "started"}


def _read_lines(path: Path) -> tuple[list[dict[str, Any]], int]:
    """Return the whole lines of a file, and where the last one ends."""
    content = path.read_bytes() if path.exists() else b""
    end = content.rfind(b"\n") + 1
    lines = []
    for count, line in enumerate(content[:end].splitlines(), start=1):
        try:
            data = json.loads(line)
        except ValueError:
            data = None
        if not isinstance(data, dict) or set(data) != _KEYS:
            raise ParameterError("folder", f"has a damaged line {count} in {path}")
        lines.append(data)
    return lines, end


class Participant:
    """A participant whose answers are recorded; use it in a ``with``, which locks its folder.

    Args:
        folder: of the study.
        study: the study, see :func:`write_study`.
        code: of the participant.
        resume: whether to go on after recorded answers.

    Attributes:
        path: folder of the participant.
        code: as given.
        number: position in the counterbalanced order, from 0.
        run: number of the sitting.
        method: after the recorded answers.
        trial: number of the next trial.

    Raises:
        ParameterError: for a participant who exists, unless ``resume``, or who is done; for a
            folder in use.
    """

    def __init__(self, folder: Path, study: Study, code: str, *, resume: bool = False) -> None:
        self.path, self.code, self._study = folder / check_participant(code), code, study
        self._lock = FileLock(self.path / _LOCK_FILE, timeout=0)
        self.number = self._enter(folder, resume=resume)
        try:
            lines, self._end = _read_lines(self.path / ANSWERS_FILE)
            self.method, _ = replay_answers(study, code, self.number, lines)
            if lines and self.method.next() is None:
                raise ParameterError("participant", f"{code} has answered all {len(lines)} trials")
            self._stream = (self.path / ANSWERS_FILE).open("ab", buffering=0)
        except BaseException:
            self._lock.release()
            raise
        self._stream.truncate(self._end)
        self.trial = len(lines) + 1
        self.run = 1 + max((line["run"] for line in lines), default=0)

    def _enter(self, folder: Path, *, resume: bool) -> int:
        """Return the number of a new or returning participant, whose folder is locked."""
        with FileLock(folder / _LOCK_FILE):
            known = list_participants(folder)
            if resume != (self.code in known):
                words = "exists already: --resume goes on where it stopped"
                if resume:
                    words = f"is unknown; known: {', '.join(known) or 'none'}"
                raise ParameterError("participant", f"{self.code} {words}")
            self.path.mkdir(exist_ok=True)
            try:
                self._lock.acquire()
            except Timeout:
                words = f"{self.code} is in another session now"
                raise ParameterError("participant", words) from None
            if not resume:
                known[self.code] = min(set(range(len(known) + 1)) - set(known.values()))
                text = json_text({"number": known[self.code]})
                write_bytes("output", self.path / _NUMBER_FILE, text.encode())
            return known[self.code]

    def codes(self, presentation: Presentation) -> list[str]:
        """Return the codes of the intervals of a trial."""
        return stimulus_codes(self._study, self.code, presentation)

    def record(self, answer: str, response_time: float, started: str) -> None:
        """Record the answer to the current trial, and go on to the next.

        Raises:
            ParameterError: if it cannot be written; what was recorded before stays.
        """
        presentation = self.method.next()
        assert presentation is not None  # an answer belongs to a trial
        line = {
            "run": self.run, "trial": self.trial, "codes": self.codes(presentation),
            "answer": answer, "response_time": response_time, "started": started,
        }  # fmt: skip
        self._append(json.dumps(line, allow_nan=False).encode() + b"\n")
        self.method.answer(answer)
        self.trial += 1

    def _append(self, data: bytes) -> None:
        try:
            written = 0
            while written < len(data):
                written += self._stream.write(data[written:])
            os.fsync(self._stream.fileno())
        except OSError as error:
            self._stream.truncate(self._end)
            words = f"cannot be written: {error.strerror}; --resume goes on from here"
            raise ParameterError("output", words, escape_unprintable(self.path)) from None
        self._end += len(data)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()
        self._lock.release()


def write_key(folder: str | Path) -> Path:
    """Write which stimulus each code stands for, and return the path: this unblinds the study.

    Args:
        folder: of a study.

    Raises:
        ParameterError: as for :func:`read_trials`.
    """
    study, seed = read_study(folder), read_study(folder).design.seed
    rows = {
        (record.participant, stimulus_code(seed, record.participant, values)): values
        for record in read_trials(folder)
        for values in record.presentation.intervals
    }
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["participant", "code", *study.arguments])
    for (participant, code), values in sorted(rows.items()):
        writer.writerow([participant, code, *(values.get(key, "") for key in study.arguments)])
    path = Path(folder) / KEY_FILE
    write_bytes("folder", path, text.getvalue().encode())
    return path


def remove_participant(folder: str | Path, code: str) -> list[str]:
    """Delete all data of a participant, and return the names of what was deleted.

    Tables and reports of the study hold data of all participants, so they are deleted, too.

    Args:
        folder: of a study.
        code: of the participant.

    Raises:
        ParameterError: for an unknown participant, or one in a session.
    """
    read_study(folder)
    known = list_participants(folder)
    if check_participant(code) not in known:
        words = f"{code} is unknown; known: {', '.join(known) or 'none'}"
        raise ParameterError("participant", words)
    path = Path(folder) / code
    try:
        with FileLock(path / _LOCK_FILE, timeout=0):
            derived = [one for one in DERIVED_FILES if (Path(folder) / one).exists()]
            for name in derived:
                (Path(folder) / name).unlink()
            shutil.rmtree(path)
    except Timeout:
        raise ParameterError("participant", f"{code} is in a session now") from None
    return [f"{code}/", *derived]

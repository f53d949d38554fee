"""The folder of a study: one line per answer, with codes in place of stimuli.

A line is written and synchronized before the next trial. A process that is killed leaves whole
lines, and at most one torn line at the end, which is removed when the participant goes on. What was
presented is not recorded: it follows from the design, the number of the participant and the answers
before, see :class:`~asperity.studies.design.Method`.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import stat
from collections.abc import Iterable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, Self

from asperity.core.errors import ParameterError
from asperity.core.files import append_bytes, json_text, text_digest, write_bytes
from asperity.core.version import __version__
from asperity.recording.replay import file_digest
from asperity.studies.design import Method, Presentation, TrialRecord, describe_source
from asperity.studies.methods import METHODS
from asperity.studies.study_file import Study, build_study
from asperity.sweeps.sweep_result import LOCK_FILE, check_plan, lock_folder

STUDY_FILE = "study.json"
ANSWERS_FILE = "answers.jsonl"
KEY_FILE = "key.json"
DERIVED_FILES = (KEY_FILE, "report.html", "trials.csv", "table.csv")
"""Files that a report writes; they hold data of all participants."""
_NUMBER_FILE = "number.txt"
SCHEMA = 1
_CODE = re.compile(r"(?=.*\d)[A-Za-z0-9][A-Za-z0-9_-]{0,15}")
_NUMBER = re.compile(r"\d{1,9}\s*")
# Types of the entries of a line of answers; early versions did not state ``simulated``.
_TYPES = {
    "run": int,
    "trial": int,
    "codes": list,
    "answer": str,
    "response_time": float,
    "started": str,
    "simulated": str,
}


def check_participant(code: str) -> str:
    """Return the code of a participant.

    Raises:
        ParameterError: for a text that may be a name.
    """
    if _CODE.fullmatch(code) is None:
        reason = "must be a code of letters and digits, such as P01, and no name"
        raise ParameterError("participant", reason, code)
    return code


def stimulus_codes(study: Study, participant: str, presentation: Presentation) -> list[str]:
    """Return the codes of the intervals of a trial, which do not reveal their values."""
    seed = study.design.seed
    texts = (json_text([seed, participant, values]) for values in presentation.intervals)
    return [text_digest(text)[:8] for text in texts]


def write_study(folder: Path, study: Study, simulated: str = "") -> None:
    """Write a study into an empty folder, or check that a folder holds it.

    Args:
        folder: the folder.
        study: the study.
        simulated: whose answers it is for, see
            :attr:`~asperity.studies.design.TrialRecord.simulated`; others are refused.

    Raises:
        ParameterError: for a folder that holds something else, or that cannot be written.
    """
    path = study.sections.get("texture", {}).get("path")
    digest = file_digest(study.folder / path) if isinstance(path, str) else None
    sections = {f"[{name}]": section for name, section in study.content.items()}
    plan = {"schema": SCHEMA, "asperity": __version__, "file": digest, **sections}
    plan["simulated"] = simulated or None
    with lock_folder(folder):
        if (folder / STUDY_FILE).exists():
            _check_source(folder, simulated)
        check_plan(folder / STUDY_FILE, plan, "study")


def _check_source(folder: Path, simulated: str) -> None:
    """Check that a folder is for the answers of a source.

    Raises:
        ParameterError: if it is for others, or no folder of a study.
    """
    recorded = str(_read_plan(folder).get("simulated") or "")
    if recorded != simulated:
        holds = f"holds answers of {describe_source(recorded)}"
        raise ParameterError(
            "output",
            f"{holds}, with which those of {describe_source(simulated)} must not be mixed"
            ": choose another folder",
            str(folder),
        )


def _read_plan(folder: str | Path) -> dict[str, Any]:
    """Return the content of the file of a study.

    Raises:
        ParameterError: for a folder of something else, a damaged file, or another version.
    """
    try:
        content = json.loads((Path(folder) / STUDY_FILE).read_bytes())
    except FileNotFoundError:
        raise _no_study(folder) from None
    except (OSError, ValueError, RecursionError):
        content = None
    if not isinstance(content, dict):
        raise ParameterError("folder", f"has a damaged file {STUDY_FILE}", str(folder))
    if (schema := content.get("schema")) != SCHEMA:
        raise ParameterError("folder", f"is of another version: schema {schema!r}, not {SCHEMA}")
    return content


def _no_study(folder: str | Path) -> ParameterError:
    words = "is no folder of a study, which a session of it makes"
    return ParameterError("folder", words, str(folder))


def read_study(folder: str | Path) -> Study:
    """Return the study of a folder.

    Raises:
        ParameterError: for a folder of something else, a damaged one, or of another version.
    """
    content = _read_plan(folder)
    sections = {name[1:-1]: part for name, part in content.items() if name.startswith("[")}
    return build_study(sections, Path(folder))


def list_participants(folder: str | Path) -> dict[str, int]:
    """Return the numbers of the participants by code, in the order of the numbers.

    Raises:
        ParameterError: for a participant whose number cannot be read.
    """
    numbered = [(_read_number(path), path.name) for path in _list_folders(folder)]
    return {code: number for number, code in sorted(numbered)}


def _list_folders(folder: str | Path) -> list[Path]:
    """Return the folders of the participants; one without number and answers is of nobody."""
    paths = sorted([path for path in Path(folder).glob("*") if _CODE.fullmatch(path.name)])
    return [path for path in paths if _has_data(path)]


def _has_data(path: Path) -> bool:
    """Return whether a folder holds data of a participant, in whatever state."""
    if path.is_dir() and not os.access(path, os.R_OK | os.X_OK):
        return True
    answers = path / ANSWERS_FILE
    is_answered = os.path.lexists(answers) and (answers.is_dir() or answers.lstat().st_size > 0)
    return is_answered or os.path.lexists(path / _NUMBER_FILE) or any(path.glob("trial-*.mcap"))


def _read_number(path: Path) -> int:
    try:
        text = (path / _NUMBER_FILE).read_text("ascii")
    except (OSError, ValueError):
        text = ""
    if _NUMBER.fullmatch(text) is None:
        raise ParameterError(
            "folder",
            f"has no number of {path.name} in {path.name}/{_NUMBER_FILE}"
            f": restore the file, or remove {path.name}",
        )
    return int(text)


def _unknown_error(code: str, codes: Iterable[str]) -> ParameterError:
    text = f"{code} is unknown; known: {', '.join(codes) or 'none'}"
    return ParameterError("participant", text)


def _check_known(folder: str | Path, code: str, *, is_new: bool) -> dict[str, int]:
    """Check that a participant exists, or is new; return the numbers of all by code."""
    known = list_participants(folder)
    if code in known and is_new:
        raise ParameterError(
            "participant",
            f"{code} exists already: {{resume}} goes on where it stopped",
            resume=True,
        )
    if code not in known and not is_new:
        raise _unknown_error(code, known)
    return known


def read_trials(folder: str | Path) -> list[TrialRecord]:
    """Return the answered trials of all participants, with what was presented.

    Args:
        folder: of a study.

    Raises:
        ParameterError: for another folder, a damaged file, or answers of another version.
    """
    study = read_study(folder)
    known = list_participants(folder)
    trials: list[TrialRecord] = []
    for code, number in known.items():
        trials += _replay(Path(folder) / code, study, number)[1]
    return trials


def _replay(path: Path, study: Study, number: int) -> tuple[Method, list[TrialRecord]]:
    """Return the method after the recorded answers of a participant, and the trials.

    Raises:
        ParameterError: for a damaged file, or answers that do not belong to these stimuli.
    """
    method = METHODS[study.design.kind].make(study.design, number, study.design.seed)
    records: list[TrialRecord] = []
    try:
        lines = (path / ANSWERS_FILE).read_bytes().split(b"\n")
    except OSError as error:
        raise ParameterError(
            "folder", f"has no answers of {path.name}: {path.name}/{ANSWERS_FILE}: {error.strerror}"
        ) from None
    for count, line in enumerate(lines[:-1], start=1):  # the last one is empty or torn
        shown: Any = method.next()
        try:
            record = _parse_line(line, study, shown, path.name)
        except (ValueError, TypeError, AttributeError, RecursionError):
            words = f"has a damaged line {count}, or one of another study, in"
            raise ParameterError("folder", f"{words} {path.name}/{ANSWERS_FILE}") from None
        codes = shown and stimulus_codes(study, path.name, shown)
        if (record.trial, record.codes) != (count, codes):
            reason = f"trial {count} of {path.name} was not made by this study and version"
            raise ParameterError("folder", reason)
        method.answer(record.answer)
        records.append(record)
    return method, records


def _parse_line(
    line: bytes, study: Study, presentation: Presentation, participant: str
) -> TrialRecord:
    """Return the trial of a line.

    Raises:
        ValueError, TypeError, AttributeError, RecursionError: for a damaged line.
    """
    entries = json.loads(line)
    check = entries.pop("check", None)  # early versions have none
    wrong = [name for name, value in entries.items() if type(value) is not _TYPES.get(name)]
    if wrong or check not in {None, _line_check(entries, study)}:
        raise ValueError
    return TrialRecord(presentation, participant=participant, **entries)


def _line_check(entries: dict[str, Any], study: Study) -> str:
    """Return the digest of the entries of a line and of the study."""
    return text_digest(json_text([study.content, entries]))


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
        study: as given.
        number: position in the counterbalanced order, from 0.
        run: number of the sitting.
        method: after the recorded answers.
        simulated: whose answers the folder is for, see
            :attr:`~asperity.studies.design.TrialRecord.simulated`.
        trial: number of the next trial.

    Raises:
        ParameterError: for a participant who exists, unless ``resume``, or who is done; for a
            folder in use.
    """

    def __init__(self, folder: Path, study: Study, code: str, *, resume: bool = False) -> None:
        self.path = folder / check_participant(code)
        self.code = code
        self.study = study
        self.simulated = str(_read_plan(folder).get("simulated") or "")
        answers = self.path / ANSWERS_FILE
        with lock_folder(folder), ExitStack() as stack:
            known = _check_known(folder, code, is_new=not resume)
            self.number = known.get(code, min(set(range(len(known) + 1)) - set(known.values())))
            stack.enter_context(lock_folder(self.path))
            self._stream = stack.enter_context(answers.open("ab", buffering=0))
            self._stream.truncate(answers.read_bytes().rfind(b"\n") + 1)  # without a torn line
            write_bytes("output", self.path / _NUMBER_FILE, str(self.number).encode())
            self.method, records = _replay(self.path, study, self.number)
            if self.method.next() is None:
                reason = f"{code} has answered all {len(records)} trials"
                raise ParameterError("participant", reason)
            self._release = stack.pop_all().close
        self.trial = len(records) + 1
        self.run = 1 + max((record.run for record in records), default=0)

    def codes(self, presentation: Presentation) -> list[str]:
        """Return the codes of the intervals of a trial."""
        return stimulus_codes(self.study, self.code, presentation)

    def record(self, answer: str, response_time: float, started: str) -> None:
        """Record the answer to the current trial, and go on to the next.

        Raises:
            ParameterError: if it cannot be written; what was recorded before stays.
        """
        presentation = self.method.next()
        assert presentation is not None  # an answer belongs to a trial
        line: dict[str, Any] = {
            "run": self.run,
            "trial": self.trial,
            "codes": self.codes(presentation),
            "answer": answer,
            "response_time": float(response_time),
            "started": started,
            "simulated": self.simulated,
        }
        line["check"] = _line_check(line, self.study)
        append_bytes("output", self._stream, json.dumps(line).encode() + b"\n", durable=True)
        self.method.answer(answer)
        self.trial += 1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._release()


def write_key(folder: str | Path) -> None:
    """Write what each code of each participant stands for (JSON): this unblinds the study.

    Args:
        folder: of a study.

    Raises:
        ParameterError: as for :func:`read_trials`.
    """
    key: dict[str, dict[str, Any]] = {}
    simulated = {}
    for record in read_trials(folder):
        if record.simulated:
            simulated["simulated"] = record.simulated
        stimuli = zip(record.codes, record.presentation.intervals, strict=True)
        key.setdefault(record.participant, {}).update(stimuli)
    write_bytes("folder", Path(folder) / KEY_FILE, json_text(simulated | key).encode())


def find_derived_files(folder: str | Path) -> list[str]:
    """Return the names of the files in the folder of a study that a report has written."""
    return [name for name in DERIVED_FILES if os.path.lexists(Path(folder) / name)]


def remove_participant(folder: str | Path, code: str) -> list[str]:
    """Delete all data of a participant, and return the names of what was deleted.

    Tables and reports of the study hold data of all participants, so they are deleted, too.

    Damaged, missing or read-only files of the study or of the participant do not prevent it. What
    a link points to outside stays, and is named.

    Args:
        folder: of a study.
        code: of the participant.

    Raises:
        ParameterError: for an unknown participant, one in a session, or files that the system does
            not delete.
    """
    path = Path(folder) / check_participant(code)
    _allow_changes(path.parent)
    known = _list_folders(folder)
    if not known and not os.path.lexists(path.parent / STUDY_FILE):
        raise _no_study(folder)
    is_replaced = path.is_symlink() or path.is_file()  # where the folder was
    if path not in known and not is_replaced and not os.path.lexists(path / ANSWERS_FILE):
        raise _unknown_error(code, [participant.name for participant in known])
    locked = path.parent if is_replaced else path
    derived = find_derived_files(folder)
    names = [f"{code}/", *derived]
    for name in names:
        _allow_all_changes(path.parent / name)
    names += _link_texts(path)
    lock = locked / LOCK_FILE
    if lock.is_symlink() or lock.is_dir():
        _delete(lock)  # it is damaged: a session locks a file
    with lock_folder(locked):
        for name in (*derived, code):
            _delete(path.parent / name)
    return names


def _delete(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink()


def _allow_all_changes(path: Path) -> None:
    """Give the owner all rights to a file or folder and to all in it."""
    _allow_changes(path)
    if path.is_symlink():
        return
    for parent, folders, files in os.walk(path):  # top down: a folder is opened after its change
        for name in (*folders, *files):
            _allow_changes(Path(parent) / name)


def _allow_changes(path: Path) -> None:
    if not path.is_symlink():
        with suppress(OSError):  # the deletion tells
            path.chmod(path.stat().st_mode | stat.S_IRWXU)


def _link_texts(path: Path) -> list[str]:
    """Return the links that are deleted with a participant, whose targets are not."""
    paths = [path] if path.is_symlink() else sorted(path.rglob("*"))
    links = [path for path in paths if path.is_symlink()]
    return [f"{link.name} (a link; {os.readlink(link)} stays)" for link in links]

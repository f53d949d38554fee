"""Damaged folders of studies: one line each, and removal of a participant in all of them."""

from __future__ import annotations

import os
import random
import shutil
import tomllib
from contextlib import suppress
from pathlib import Path

import pytest
from tests.studies.study_texts import COMPARISON, make_study
from tests.studies.test_study_store import answer_all, finish

from asperity.core.errors import AsperityError, ParameterError
from asperity.studies.design import TrialRecord
from asperity.studies.study_file import build_study
from asperity.studies.study_report import study_report, write_report
from asperity.studies.study_result import StudyResult, analyse
from asperity.studies.study_store import (
    ANSWERS_FILE,
    DERIVED_FILES,
    STUDY_FILE,
    Participant,
    read_study,
    read_trials,
    remove_participant,
    write_study,
)

COUNT = 100
DEEP = b"[" * 100_000
GARBAGE = (b"", b"[]", b"null", b"-1", b"\xff\xfe\x00", b"{}\n", b"9" * 5000, DEEP, b"NaN\n")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    study = make_study(tmp_path)
    data = tmp_path / "data"
    write_study(data, study, "guessing")
    for code in ("P01", "P02"):
        finish(data, study, code)
    return data


def damage(folder: Path, random_numbers: random.Random) -> None:
    """Damage one to three entries of a folder: content, length, rights, or what they are."""
    for _ in range(random_numbers.randint(1, 3)):
        files = sorted([path for path in folder.rglob("*") if path.is_file()])
        if not files:
            return
        if damage_folder(folder, random_numbers):
            continue
        path = random_numbers.choice(files)
        content = bytearray(path.read_bytes())
        kind = random_numbers.choice(("flip", "cut", "garbage", "delete", "folder", "repeat"))
        if kind == "flip" and content:
            content[random_numbers.randrange(len(content))] ^= 1 << random_numbers.randrange(8)
        elif kind == "cut":
            del content[random_numbers.randint(0, len(content)) :]
        elif kind == "garbage":
            content = bytearray(random_numbers.choice(GARBAGE))
        path.unlink()
        if kind == "folder":
            path.mkdir()
        elif kind != "delete":
            path.write_bytes(content * (2 if kind == "repeat" else 1))


def damage_folder(folder: Path, random_numbers: random.Random) -> bool:
    """Replace, link or lock one of the two folders of participants, in two of five cases."""
    path = folder / random_numbers.choice(("P01", "P02"))
    kind = random_numbers.choice(("file", "link", "broken link", "locked", *6 * ["none"]))
    if kind == "none" or path.is_symlink() or not path.is_dir() or not os.access(path, os.W_OK):
        return False
    if kind == "locked":
        path.chmod(0)
        return True
    moved = path.rename(folder.parent / f"{folder.name} {path.name}")
    if kind == "file":
        path.write_bytes(random_numbers.choice(GARBAGE))
    else:
        path.symlink_to(moved if kind == "link" else "nowhere")
    return True


def read_all(folder: Path, *, has_page: bool) -> StudyResult | None:
    """Return the result of a folder, after a session; ``None`` if it is refused in one line.

    Its page, which takes half a second, is written too if ``has_page``.
    """
    with suppress(ParameterError):
        study = read_study(folder)
        with Participant(folder, study, "P01", resume=True) as person:
            answer_all(person)
    message = ""
    try:
        result = study_report(folder)
        if has_page:
            write_report(folder, result)
    except AsperityError as error:
        result = None
        message = str(error)
    assert "\n" not in message
    return result


def test_damaged_folders_are_refused_in_one_line_and_removal_works(
    folder: Path, tmp_path: Path
) -> None:
    whole = {(one.participant, one.trial): one.answer for one in read_trials(folder)}
    n_refused = 0
    for seed in range(COUNT):
        copy = tmp_path / f"copy {seed}"
        shutil.copytree(folder, copy)
        for name in DERIVED_FILES:
            (copy / name).write_text("rows of P02")
        numbers = random.Random(seed)
        damage(copy, numbers)
        result = read_all(copy, has_page=seed % 8 == 0)
        n_refused += result is None
        for one in result.trials if result else ():
            assert whole[one.participant, one.trial] == one.answer or one.run == 2
        person = copy / "P02"
        is_other = person.is_symlink() or person.is_file()
        if is_other or any(map(os.path.exists, (person / ANSWERS_FILE, person / "number.txt"))):
            remove_participant(copy, "P02")
            assert not os.path.lexists(person)
            assert not [name for name in DERIVED_FILES if (copy / name).exists()]
    assert COUNT // 4 < n_refused < COUNT  # a control: they are damaged, and not all beyond use


@pytest.mark.parametrize("content", GARBAGE)
@pytest.mark.parametrize("name", ["number.txt", ANSWERS_FILE, f"../{STUDY_FILE}"])
def test_a_participant_is_removed_from_each_damaged_file(
    folder: Path, name: str, content: bytes
) -> None:
    (folder / "P01" / name).write_bytes(content)
    remove_participant(folder, "P01")
    assert not any("P01" in path.name for path in folder.rglob("*"))


@pytest.mark.parametrize("kind", ["file", "link", "nowhere", "locked", "read-only"])
def test_a_participant_is_removed_whose_folder_is_something_else(folder: Path, kind: str) -> None:
    """What a link points to stays, and is named."""
    path = folder / "P02"
    if kind in {"locked", "read-only"}:
        for place in (path / ANSWERS_FILE, path, folder):
            place.chmod(0 if kind == "locked" else 0o500)
    else:
        moved = path.rename(folder.parent / "moved")
    if kind == "file":
        path.write_bytes(b"")
    elif kind in {"link", "nowhere"}:
        path.symlink_to(moved if kind == "link" else "nowhere")
    names = remove_participant(folder, "P02")
    assert not os.path.lexists(path)
    assert any(" stays)" in name for name in names) == (kind in {"link", "nowhere"})
    assert kind != "link" or (moved / ANSWERS_FILE).exists()
    assert list(study_report(folder).answered) == ["P01"]


def test_what_is_no_participant_is_not_deleted(folder: Path) -> None:
    (folder / "raw1").mkdir()
    (folder / "raw1" / "thesis.txt").write_text("mine")
    with pytest.raises(ParameterError, match="raw1 is unknown; known: P01, P02"):
        remove_participant(folder, "raw1")
    with pytest.raises(ParameterError, match="is no folder of a study"):
        remove_participant(folder / "raw1", "P01")
    assert (folder / "raw1" / "thesis.txt").exists()


def test_answers_without_a_number_do_not_disappear_from_the_report(folder: Path) -> None:
    (folder / "P02" / "number.txt").unlink()
    with pytest.raises(ParameterError, match=r"has no number of P02 in P02/number\.txt: restore"):
        study_report(folder)
    remove_participant(folder, "P02")
    assert list(study_report(folder).answered) == ["P01"]


@pytest.mark.parametrize(
    ("old", "new"), [(b'"answer": "1"', b'"answer": "2"'), (b'"run": 1', b'"run": 3')]
)
def test_a_changed_answer_is_found(folder: Path, old: bytes, new: bytes) -> None:
    for code in ("P01", "P02"):
        path = folder / code / ANSWERS_FILE
        path.write_bytes(path.read_bytes().replace(old, new))
    with pytest.raises(ParameterError, match="damaged line"):
        read_trials(folder)


def test_a_changed_question_is_found(folder: Path) -> None:
    path = folder / STUDY_FILE
    path.write_text(path.read_text("utf-8").replace("rougher", "softer"), "utf-8")
    with pytest.raises(ParameterError, match="damaged line 1"):
        read_trials(folder)


@pytest.mark.parametrize("value", [None, True, 5, 1.5, "", "x", [], ["a"], [[1]], [{}]])
@pytest.mark.parametrize("section", ["study", "vary", "method", "exclusion", "texture", "device"])
def test_sections_of_another_type_are_refused(section: str, value: object) -> None:
    content = tomllib.loads(COMPARISON) | {section: value}
    with pytest.raises(ParameterError):
        build_study(content, Path())


def test_counts_that_no_study_has_are_refused() -> None:
    content = tomllib.loads(COMPARISON)
    content["method"]["repeats"] = 10**30
    with pytest.raises(ParameterError, match="repeats must be at most 10000"):
        build_study(content, Path())


def test_people_and_simulated_observers_are_not_mixed(folder: Path, tmp_path: Path) -> None:
    study = read_study(folder)
    with pytest.raises(ParameterError, match=r"holds answers of simulated observers \(guessing\)"):
        write_study(folder, study)
    with pytest.raises(ParameterError, match=r"with which those of simulated observers \(typical"):
        write_study(folder, study, "typical")
    people = tmp_path / "people"
    write_study(people, make_study(tmp_path))
    with (
        Participant(people, study, "P09") as person,
        pytest.raises(ParameterError, match="P09 belongs to people: simulated answers"),
    ):
        answer_all(person)
    with Participant(people, study, "P10") as person:
        person.record("1", 1.0, "")
    shutil.copytree(folder / "P02", people / "P02")
    mixed = r"must not mix .*\(guessing\), such as P02, and of people, such as P10"
    with pytest.raises(ParameterError, match=mixed):
        study_report(people)
    remove_participant(people, "P10")
    assert study_report(people).simulated == "guessing"  # the record tells, wherever it lies


def test_every_record_of_a_simulated_observer_is_marked(folder: Path) -> None:
    result = study_report(folder)
    names = write_report(folder, result)
    assert names[:2] == ["key.json", "report.html"]
    for path in (*folder.glob("*.*"), *folder.glob("P0*/answers.jsonl")):
        if path.suffix in {".json", ".jsonl", ".csv", ".html"}:
            assert "guessing" in path.read_text("utf-8"), path
    for table in (result, result.trial_table):
        assert {row["simulated"] for row in table.table_rows()} == {"guessing"}
    assert result.to_dict()["study"]["simulated"] == "guessing"
    assert "simulated observers (guessing)" in result.to_html().split("</h1>")[0]


def test_reports_of_people_do_not_name_simulation(folder: Path) -> None:
    study = read_study(folder)
    trials: list[TrialRecord] = [
        TrialRecord(one.presentation, one.answer, "P01", 1, one.trial, 1.0, "", one.codes)
        for one in read_trials(folder)
        if one.participant == "P01"
    ]
    assert "simulated" not in analyse(study.design, trials, study.content).to_html()

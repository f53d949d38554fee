"""The folder of a study: whole lines, codes alone, one session at a time, one command to delete."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from tests.studies.study_texts import COMPARISON, make_study

from asperity.core.errors import ParameterError
from asperity.studies.design import Presentation
from asperity.studies.live.player import Stimuli
from asperity.studies.live.trial_session import simulate_session
from asperity.studies.simulated_participants import Observer, Strength
from asperity.studies.study_file import Study
from asperity.studies.study_store import (
    ANSWERS_FILE,
    DERIVED_FILES,
    KEY_FILE,
    Participant,
    check_participant,
    list_participants,
    read_study,
    read_trials,
    remove_participant,
    write_key,
    write_study,
)


class Chooser(Observer):
    """An observer who answers at random without feeling anything."""

    def answer(
        self, presentation: Presentation, _strength: Strength, rng: np.random.Generator
    ) -> str:
        return str(rng.choice(presentation.answers))


def answer_all(person: Participant) -> None:
    simulate_session(person, Stimuli(person.study), Chooser())


@pytest.fixture
def study(tmp_path: Path) -> Study:
    return make_study(tmp_path)


@pytest.fixture
def folder(tmp_path: Path, study: Study) -> Path:
    write_study(tmp_path / "data", study, "guessing")
    return tmp_path / "data"


def finish(folder: Path, study: Study, code: str) -> int:
    with Participant(folder, study, code) as person:
        answer_all(person)
        return person.trial - 1


def read_key(folder: Path) -> dict[str, dict[str, dict[str, float]]]:
    write_key(folder)
    key: dict[str, dict[str, dict[str, float]]] = json.loads((folder / KEY_FILE).read_text("utf-8"))
    return key


def test_trials_are_read_with_what_was_presented(folder: Path, study: Study) -> None:
    count = finish(folder, study, "P01")
    trials = read_trials(folder)
    assert [one.trial for one in trials] == list(range(1, count + 1))
    pairs = {
        frozenset(v["surface.stiffness"] for v in one.presentation.intervals) for one in trials
    }
    assert pairs == {frozenset(p) for p in ((61.5, 83.5), (61.5, 97.5), (83.5, 97.5))}
    assert {one.answer for one in trials} <= {"1", "2"}


def test_a_torn_line_is_dropped_and_its_trial_is_asked_again(folder: Path, study: Study) -> None:
    finish(folder, study, "P01")
    path = folder / "P01" / ANSWERS_FILE
    whole = path.read_bytes()
    path.write_bytes(whole[:-7])
    before = read_trials(folder)
    with Participant(folder, study, "P01", resume=True) as person:
        assert (person.trial, person.run) == (len(before) + 1, 2)
        answer_all(person)
    again, first = path.read_bytes().splitlines(), whole.splitlines()
    assert again[:-1] == first[:-1]
    # A session that goes on gives what one gives that was not stopped.
    assert json.loads(again[-1])["answer"] == json.loads(first[-1])["answer"]


def test_a_damaged_line_in_the_middle_is_refused(folder: Path, study: Study) -> None:
    finish(folder, study, "P01")
    path = folder / "P01" / ANSWERS_FILE
    first, *rest = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join([first[:10] + b"\n", *rest]))
    with pytest.raises(ParameterError, match="damaged line 1"):
        read_trials(folder)
    unchecked = re.sub(rb', "check": "\w+"', b"", first)  # of an early version
    path.write_bytes(b"".join([unchecked, *rest]))
    assert len(read_trials(folder)) == 1 + len(rest)
    path.write_bytes(b"".join([unchecked.replace(b'"trial": 1', b'"trial": 2'), *rest]))
    with pytest.raises(ParameterError, match="trial 1 of P01 was not made by this study"):
        read_trials(folder)


def test_answers_of_another_seed_are_refused(folder: Path, study: Study) -> None:
    finish(folder, study, "P01")
    text = (folder / "study.json").read_text("utf-8")
    content = json.loads(text)
    content["[study]"]["seed"] = 2
    (folder / "study.json").write_text(json.dumps(content))
    with pytest.raises(ParameterError, match="damaged line 1, or one of another study, in P01"):
        read_trials(folder)


def test_only_codes_are_written_until_the_key_is(folder: Path, study: Study) -> None:
    finish(folder, study, "P01")
    for path in (folder / "P01").iterdir():
        text = path.name + path.read_text("utf-8")
        assert not any(secret in text for secret in ("stiffness", "61.5", "83.5", "97.5"))
    assert not (folder / KEY_FILE).exists()
    key = read_key(folder)
    assert key.pop("simulated") == "guessing"
    assert key.keys() == {"P01"}
    assert {one["surface.stiffness"] for one in key["P01"].values()} == {61.5, 83.5, 97.5}
    lines = (folder / "P01" / ANSWERS_FILE).read_text("utf-8").splitlines()
    codes = {code for line in lines for code in json.loads(line)["codes"]}
    assert codes == key["P01"].keys()


def test_codes_of_participants_differ(folder: Path, study: Study) -> None:
    for code in ("P01", "P02"):
        finish(folder, study, code)
    key = read_key(folder)
    assert len({*key["P01"], *key["P02"]}) == 6


def test_another_study_or_folder_is_refused(tmp_path: Path, folder: Path) -> None:
    other = make_study(tmp_path, COMPARISON.replace("rougher", "softer"))
    with pytest.raises(ParameterError, match=r"holds another study \(other \[study\]\)"):
        write_study(folder, other, "guessing")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.txt").write_text("mine")
    with pytest.raises(ParameterError, match="is neither empty nor the folder of a study"):
        write_study(tmp_path / "full", other)
    with pytest.raises(ParameterError, match="is no folder of a study"):
        read_study(tmp_path / "full")
    path = folder / "study.json"
    path.write_text(path.read_text("utf-8").replace('"schema": 1', '"schema": 9'))
    with pytest.raises(ParameterError, match="of another version: schema 9, not 1"):
        read_study(folder)


def test_participants_exist_once_and_sit_once(folder: Path, study: Study) -> None:
    with Participant(folder, study, "P01"):
        with pytest.raises(ParameterError, match=r"is in use by another process, got .*P01"):
            Participant(folder, study, "P01", resume=True)
        with pytest.raises(ParameterError, match="P01 exists already: resume=True goes on"):
            Participant(folder, study, "P01")
        with pytest.raises(ParameterError, match=r"is in use by another process, got .*P01"):
            remove_participant(folder, "P01")
    with pytest.raises(ParameterError, match="P02 is unknown; known: P01"):
        Participant(folder, study, "P02", resume=True)
    with Participant(folder, study, "P01", resume=True) as person:
        answer_all(person)
        count = person.trial - 1
    with pytest.raises(ParameterError, match=f"P01 has answered all {count} trials"):
        Participant(folder, study, "P01", resume=True)


def test_a_freed_number_is_given_again(folder: Path, study: Study) -> None:
    for code in ("P01", "P02", "P03"):
        finish(folder, study, code)
    for name in DERIVED_FILES:
        (folder / name).write_text("rows of P02")
    assert remove_participant(folder, "P02") == ["P02/", *DERIVED_FILES]
    assert not any("P02" in path.name for path in folder.rglob("*"))
    finish(folder, study, "P09")
    assert list_participants(folder) == {"P01": 0, "P09": 1, "P03": 2}
    with pytest.raises(ParameterError, match="P02 is unknown; known: P01, P03, P09"):
        remove_participant(folder, "P02")


@pytest.mark.parametrize(
    "code", ["Ada Lovelace", "Ada", "", "../P01", "P01/x", "P01\n", "é1", "P" * 20]
)
def test_names_and_paths_are_no_codes(code: str) -> None:
    with pytest.raises(ParameterError, match="must be a code of letters and digits, such as P01"):
        check_participant(code)
    assert check_participant("p-01_b") == "p-01_b"

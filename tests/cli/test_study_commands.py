"""The command ``study``: from the file to the report, and refusals in one line."""

from __future__ import annotations

import csv
import json
import os
import pty
import select
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tests.cli.conftest import Call
from tests.studies.study_texts import COMPARISON

import asperity as asp
from asperity.studies.live.player import Stimuli
from asperity.studies.methods import METHODS
from asperity.studies.simulated_participants import surface_strength
from asperity.studies.study_file import load_study
from asperity.studies.study_store import ANSWERS_FILE, DERIVED_FILES, list_participants, read_trials

COMMAND = "study"
EXAMPLES = Path(__file__).parents[2] / "examples" / "studies"
SIMULATED = ("--simulate", "typical")
TRIED = "{}-simulated-typical"
STUDY = TRIED.format("study")


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("study.toml").write_text(COMPARISON)
    return "study.toml"


@pytest.mark.parametrize("kind", METHODS)
def test_a_template_of_each_kind_runs_as_it_is(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert call("init", kind, "mine.toml") == (
        0, "Written: mine.toml; now: asperity study plan mine.toml --effect 1.5\n", "",
    )  # fmt: skip
    assert "{" not in Path("mine.toml").read_text("utf-8")
    for participant in ("P01", "P02", "P03"):
        code, out, err = call("run", "mine.toml", "--participant", participant, *SIMULATED)
        assert (code, err) == (0, "")
        assert f"{participant}: " in out
    code, out, err = call("report", TRIED.format("mine"))
    assert (code, err) == (0, "")
    assert "Written in mine-simulated-typical: key.json, report.html, trials.csv" in out
    question = load_study("mine.toml").design.question
    assert question in Path(TRIED.format("mine"), "report.html").read_text("utf-8")


def test_the_report_is_that_of_python(call: Call, file: str, tmp_path: Path) -> None:
    for participant in ("P01", "P02", "P03"):
        assert call("run", file, "--participant", participant, *SIMULATED)[0] == 0
    assert not {path.name for path in Path(STUDY).iterdir()} & set(DERIVED_FILES)
    assert call("report", STUDY, "--json", "result.json")[0] == 0
    result = asp.study_report(STUDY)
    result.to_csv(tmp_path / "other.csv")
    assert Path(STUDY, "table.csv").read_bytes() == Path("other.csv").read_bytes()
    with Path(STUDY, "trials.csv").open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(read_trials(STUDY)) == 9
    assert json.loads(Path("result.json").read_text("utf-8"))
    code, out, _ = call("remove", STUDY, "P02")
    assert (code, out[:45]) == (0, "Deleted in study-simulated-typical: P02/, key")
    assert not any("P02" in str(path) for path in Path(STUDY).rglob("*"))
    assert not {path.name for path in Path(STUDY).iterdir()} & set(DERIVED_FILES)


def test_a_plan_states_the_power(call: Call, file: str) -> None:
    options = ("--participants", "12", "--simulations", "10")
    code, out, err = call("plan", file, "--effect", "3", *options)
    assert (code, err) == (0, "")
    assert "With 12 participants" in out
    assert out.strip() == asp.plan_study(file, 3.0, participants=12, simulations=10).text


def test_a_plan_has_the_strength_of_the_scene(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert call("init", "detection", "mine.toml")[0] == 0
    text = Path("mine.toml").read_text("utf-8").replace("trials = 40", "trials = 5")
    reached = []
    for stiffness in ("25 N/m", "100 N/m"):
        Path("mine.toml").write_text(text.replace("100 N/m", stiffness), "utf-8")
        plan = asp.plan_study("mine.toml", 3.0, participants=3, simulations=1)
        assert f"The levels reach {plan.reach:.2g} times what is just felt." in plan.text
        reached.append(plan.reach)
    assert reached[1] == pytest.approx(4.0 * reached[0], rel=0.05)
    stimuli = Stimuli(load_study("mine.toml"))
    highest = {"surface.law": "D", "texture.amplitude": 1e-4}
    felt = surface_strength(*stimuli.surface_and_device(highest))
    assert reached[1] == pytest.approx(felt)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("init comparisons a.toml", "kind is unknown: 'comparisons'; did you mean 'comparison'"),
        ("init comparison a.txt", "file must be a file that ends in .toml"),
        ("init comparison study.toml", "study.toml"),
        ("run study.toml --participant Ada", "participant must be a code of letters and digits"),
        ("run none.toml --participant P01", "none.toml"),
        ("run study.toml --participant P01 --resume --simulate typical", "P01 is unknown; known"),
        ("run study.toml --participant P01 --simulate typicl", "typicl"),
        ("run study.toml --participant P01 --driver replay:x.mcap", "driver must be a device"),
        ("run above.toml --participant P01", "stiffness = 900 N/m is refused: 900 N/m is above"),
        ("report nowhere", "folder is no folder of a study"),
        ("report .", "folder is no folder of a study"),
        ("remove nowhere P01", "folder is no folder of a study"),
        ("plan study.toml --effect -1", "effect"),
        ("plan study.toml --effect 2 --participants 2", "participants must be at least 3"),
        ("plan study.toml --effect 1", "effect must differ from 1"),
        ("runn study.toml", "did you mean 'run'"),
    ],
)
def test_bad_input_is_one_line(call: Call, file: str, arguments: str, message: str) -> None:
    Path("above.toml").write_text(COMPARISON.replace("97.5 N/m", "900 N/m"))
    before = sorted(Path().rglob("*"))
    code, out, err = call(*arguments.split())
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err
    left = {str(path) for path in Path().rglob("*")} - {str(path) for path in before}
    assert all(name.endswith((".lock", STUDY, "study.json", "P01")) for name in left)
    assert file == "study.toml"


def test_a_participant_and_a_study_exist_once(call: Call, file: str) -> None:
    run = ("run", file, "--participant", "P01", *SIMULATED)
    assert call(*run)[0] == 0
    code, _, err = call(*run)
    assert (code, "P01 exists already: --resume goes on" in err) == (2, True)
    code, _, err = call(*run, "--resume")
    assert (code, "P01 has answered all 3 trials" in err) == (2, True)
    Path("study.toml").write_text(COMPARISON.replace("rougher", "softer"))
    code, _, err = call("run", file, "--participant", "P02", *SIMULATED)
    assert (code, "output holds another study (other [study])" in err) == (2, True)


def test_a_seeded_study_replays_bit_for_bit(call: Call, file: str) -> None:
    for folder in ("one", "two"):
        assert call("run", file, "--participant", "P01", "-o", folder, *SIMULATED)[0] == 0
    lines = [
        [
            {
                name: value
                for name, value in json.loads(line).items()
                if name not in {"started", "check"}
            }
            for line in (Path(folder) / "P01" / ANSWERS_FILE).read_text("utf-8").splitlines()
        ]
        for folder in ("one", "two")
    ]
    assert lines[0] == lines[1]


def test_a_study_is_done_in_the_terminal(file: str) -> None:
    """On the simulated device, with the keys of a person who reads what is shown."""
    command = [sys.executable, "-m", "asperity", "study", "run", file, "--participant", "P01"]
    master, terminal = pty.openpty()
    process = subprocess.Popen(
        [*command, "--terminal"], stdin=terminal, stdout=terminal, stderr=terminal
    )
    os.close(terminal)
    shown, answered, end = "", 0, time.monotonic() + 240.0
    while process.poll() is None and time.monotonic() < end:
        if select.select([master], [], [], 0.1)[0]:
            try:
                shown += os.read(master, 4096).decode()
            except OSError:  # the terminal is closed
                break
        if "WELCOME" in shown and "[Escape] stop" in shown and not answered:
            os.write(master, b" ")
            answered = 1
        if shown.count("WHICH ONE IS ROUGHER?") >= answered > 0 and shown.rstrip().endswith("stop"):
            os.write(master, b"2")
            answered += 1
    os.close(master)
    assert process.wait(timeout=60) == 0
    assert [one.answer for one in read_trials("study-simulated-device")] == ["2", "2", "2"]
    assert "THE END" in shown
    assert not any(secret in shown for secret in ("stiffness", "61.5", "83.5", "97.5"))


def test_without_a_terminal_nobody_is_registered(file: str) -> None:
    command = [sys.executable, "-m", "asperity", "study", "run", file, "--participant", "P01"]
    done = subprocess.run(
        [*command, "--terminal"],
        check=False,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    assert (done.returncode, "terminal is needed" in done.stderr) == (2, True)
    assert list_participants("study-simulated-device") == {}


@pytest.mark.parametrize("name", ["alive", "click"])
def test_the_study_of_our_own_is_ready_to_run(call: Call, tmp_path: Path, name: str) -> None:
    path, folder = str(EXAMPLES / f"{name}.toml"), str(tmp_path / name)
    study = load_study(path)
    Stimuli(study).check_all()
    assert study.design.participants == 12
    for participant in ("P01", "P02", "P03"):
        arguments = ("run", path, "--participant", participant, "-o", folder, *SIMULATED)
        code, out, _ = call(*arguments)
        assert (code, "36 answers" in out) == (0, True)
    assert call("report", folder)[0] == 0
    texts = {file.name: file.read_text("utf-8") for file in EXAMPLES.glob("*.md")}
    assert texts.keys() == {"README.md", "consent.md", "preregistration.md", "paper_statements.md"}
    for rule in ("0.2 s", "30 s", "20 %", "60 %"):
        assert rule in texts["preregistration.md"]
    assert study.design.options["exclusion"] == {
        "shortest_response": 0.2, "longest_response": 30.0, "largest_omission": 0.2,
        "least_correct": 0.0, "least_consistency": 0.6,
    }  # fmt: skip


def test_the_study_of_friction_has_the_same_texture_with_and_without_it() -> None:
    study = load_study(str(EXAMPLES / "real.toml"))
    assert [dict(one) for one in study.design.conditions] == [
        {"surface.friction": friction} for friction in (0.0, 0.2, 0.4)
    ]
    # Law H for all: the file of the scene names it, and what friction it has is the condition.
    scene = (EXAMPLES / "board.toml").read_text("utf-8")
    assert 'law = "H"' in scene
    assert "friction =" not in scene
    other = load_study(str(EXAMPLES / "alive.toml")).design
    assert study.design.participants == other.participants == 12
    for name in ("exclusion", "repeats"):
        assert study.design.options[name] == other.options[name]

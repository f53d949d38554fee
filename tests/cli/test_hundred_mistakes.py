"""A hundred wrong commands: each one line that names the mistake and offers what was meant."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from tests.cli.conftest import Call

from asperity.cli.main import COMMANDS

MISTAKES: list[tuple[str, tuple[str, ...]]] = [
    # Commands.
    ("campare cloth", ("'campare'", "did you mean 'compare'?")),
    ("COMPARE cloth", ("'COMPARE'", "did you mean 'compare'?")),
    ("analyse cloth --law H", ("'analyse'", "did you mean 'analyze'?")),
    ("limit cloth", ("'limit'", "did you mean 'limits'")),
    ("surface", ("'surface'", "did you mean 'surfaces'?")),
    ("device touch", ("'device'", "did you mean 'devices'?")),
    ("calibrat --driver simulated", ("'calibrat'", "did you mean 'calibrate'?")),
    ("simulation scene.toml", ("'simulation'", "did you mean 'simulate'?")),
    ("onsets scene.toml", ("'onsets'", "did you mean 'onset'?")),
    ("replay run.mcap", ("'replay'", "did you mean 'recording replay'?")),
    ("record cloth", ("'record'", "did you mean 'run --record'?")),
    ("help", ("'help'", "did you mean '--help'?")),
    ("recording inf run.mcap", ("'inf'", "did you mean 'info'?", "known: export, info, plot")),
    ("cloth --device touch", ("'cloth'", "known: analyze, bake", "compare")),
    ("--vresion", ("--vresion", "did you mean '--version'?")),
    ("envelop --device touch", ("'envelop'", "did you mean 'envelope'?")),
    ("envelope --device tuoch", ("device is unknown: 'tuoch'", "did you mean 'touch'")),
    ("study report nowhere", ("folder", "asperity study run makes one")),
    ("certify nothing.so", ("renderer is no file", "'nothing.so'")),
    ("design cloth --texture-force 3kg", ("texture_force", "'3kg'")),
    ("sweep cloth --vary texture.magnifi=1,2", ("texture.magnifi", "texture.magnify")),
    # Options misspelt.
    ("compare cloth --devise touch", ("--devise", "did you mean '--device'?")),
    ("compare cloth -device touch", ("no option -device", "did you mean '--device'?")),
    ("compare cloth -html r.html", ("no option -html", "did you mean '--html'?")),
    ("compare cloth --htlm r.html", ("--htlm", "did you mean '--html'?")),
    ("compare cloth --Device touch", ("--Device", "did you mean '--device'?")),
    ("compare cloth --devices touch", ("--devices", "did you mean '--device'?")),
    ("compare cloth --stifness 500N/m", ("--stifness", "did you mean '--stiffness'?")),
    ("compare cloth --max_depth 1mm", ("--max_depth", "did you mean '--max-depth'?")),
    ("compare cloth --depth 1mm", ("--depth", "did you mean '--max-depth'?")),
    ("compare cloth --velocity 0.1m/s", ("--velocity", "did you mean '--speed'?")),
    ("compare cloth --no-cach", ("--no-cach", "did you mean '--no-cache'?")),
    ("reproduce --skip-experiment", ("--skip-experiment;", "did you mean '--skip-experiments'?")),
    ("doctor --jason", ("--jason", "did you mean '--json'?")),
    ("cache --clean", ("--clean", "did you mean '--clear'?")),
    # Options of other commands.
    ("compare cloth --law H", ("compare has no option --law", "'--laws'", "analyze, limits")),
    (
        "analyze cloth --laws WA",
        ("analyze has no option --laws", "'--law'", "compare, sweep, envelope, design, onset"),
    ),
    (
        "compare cloth --output r.html",
        ("--output", "did you mean '--html'?", "option of sweep, prepare, bake"),
    ),
    ("compare cloth --driver simulated", ("--driver", "option of calibrate, lab, run")),
    ("compare cloth --duration 2s", ("--duration", "option of sweep, simulate, onset, run")),
    ("analyze cloth --law H --clamp whole", ("--clamp", "option of export;")),
    ("export cloth --html e.html -o t.h", ("--html", "compare, analyze, limits")),
    ("run cloth --html r.html", ("run has no option --html", "see asperity run --help")),
    ("lab cloth --html l.html", ("lab has no option --html", "see asperity lab --help")),
    ("show land.x3p --law H", ("show has no option --law", "analyze, limits")),
    # Missing and additional arguments.
    ("compare", ("SURFACE", "such as asperity compare cloth --device touch")),
    ("compare cloth touch", ("(touch)", "such as asperity compare cloth --device touch")),
    ("compare cloth --html", ("'--html' requires an argument",)),
    ("compare cloth --full=yes", ("'--full' does not take a value",)),
    ("analyze cloth --law", ("'--law' requires an argument",)),
    ("prepare land.x3p", ("--output", "such as asperity prepare land.x3p -o land.npz")),
    ("bake cloth", ("--output", "such as asperity bake cloth -o cloth.field")),
    ("export cloth --law H", ("--output", "such as asperity export cloth --law H -o texture.h")),
    ("calibrate --driver simulated", ("--output", "such as asperity calibrate --driver")),
    ("compare cloth --device touch --device omega.3", ("--device once",)),
    # Surfaces.
    ("compare clot", ("'clot'", "did you mean 'cloth'?")),
    ("compare Cloht", ("'Cloht'", "did you mean 'cloth'?")),
    ("compare sandpapr:grit=P60", ("'sandpapr'", "did you mean 'sandpaper'?")),
    ("compare sandpaper:grit=60", ("'60'", "did you mean 'P60'?")),
    ("compare sandpaper:gritt=P60", ("sandpaper.gritt", "did you mean 'grit'?")),
    ("compare sinusoid", ("amplitude is missing", "asperity surfaces sinusoid")),
    ("compare sinusoid:amplitude=0.8mm", ("period is missing", "asperity surfaces sinusoid")),
    ("compare sinusoid:amplitude=0.8,period=1mm", ("amplitude needs a unit: write 0.8mm",)),
    ("compare sinusoid:amplitude=1mm,periode=1mm", ("periode", "did you mean 'period'?")),
    ("compare sinusoid:amplitude=1mm,period=1N", ("period", "'1N'", "another dimension")),
    ("compare sinusoid:1mm,1mm", ("kind:argument=value", "'1mm'")),
    ("compare sinusoid,amplitude=1mm,period=1mm", ("sinusoid,amplitude=1mm", "no such file")),
    ("surfaces clotth", ("'clotth'", "did you mean 'cloth'?")),
    # Files and folders.
    ("compare ghost.x3p", ("ghost.x3p: no such file",)),
    ("compare land.xp3", ("land.xp3: no such file", "did you mean 'land.x3p'?")),
    ("compare folder.x3p", ("folder.x3p is a directory", "a file is expected")),
    ("compare empty.x3p", ("empty.x3p is empty",)),
    ("show cloth", ("'cloth'", "asperity surfaces cloth")),
    ("simulate ghost.toml", ("ghost.toml cannot be read",)),
    ("simulate cloth", ("'cloth'", "scene file (.toml)")),
    ("simulate wrong_key.toml", ("surface.stifness", "did you mean 'stiffness'?")),
    ("simulate wrong_section.toml", ("[surfaces]", "did you mean 'surface'?")),
    ("init scene", ("'scene'", ".toml")),
    ("init scene.toml", ("scene.toml", "--force replaces it")),
    ("recording info ghost.mcap", ("ghost.mcap cannot be read",)),
    ("recording info notes.txt", ("notes.txt", "no", "MCAP")),
    ("compare cloth --html nowhere/r.html", ("html", "nowhere", "does not")),
    ("compare cloth --html folder.x3p", ("html", "not a folder", "'folder.x3p'")),
    ("compare cloth --plugin ghost.py", ("plugin ghost.py cannot be read",)),
    ("maps cloth -o cloth.jpg", ("output", ".png", "'cloth.jpg'")),
    ("export cloth --law H -o texture.txt", ("output", ".h", "'texture.txt'")),
    # Devices and laws.
    ("compare cloth --device omega3", ("'omega3'", "did you mean 'omega.3'?")),
    ("compare cloth --device touch;tuch", ("'tuch'", "did you mean 'touch'")),
    ("analyze cloth --device touch,omega.3", ("'touch,omega.3'", "single device")),
    ("devices omega.7", ("'omega.7'", "did you mean 'omega.3'?")),
    ("run cloth --driver simulate", ("'simulate'", "did you mean 'simulated'?")),
    ("compare cloth --laws W;X", ("'X'", "known: A, B, C")),
    ("compare cloth --laws WW", ("names law W twice",)),
    ("compare cloth --laws god-objekt", ("'god-objekt'", "did you mean 'god-object'")),
    ("lab cloth --law Z", ("law is unknown: 'Z'", "known: A, B, C")),
    ("analyze cloth --law G --friction 0.5", ("friction", "law W, C, D, F, H can")),
    ("analyze cloth --law H --rendering fields", ("'fields'", "did you mean 'field'?")),
    # Quantities and lists.
    ("compare cloth --stiffness 500", ("stiffness needs a unit: write 500N/m",)),
    ("compare cloth --stiffness 500n/m", ("stiffness", "write 500N/m", "'500n/m'")),
    ("compare cloth --stiffness 0,5N/mm", ("stiffness", "0.5N/mm", "'0,5N/mm'")),
    ("compare cloth --max-depth 0.5MM", ("max_depth", "write 0.5mm", "'0.5MM'")),
    ("compare cloth --max-depth 0.1,0.5mm", ("max_depth needs a unit: write 0.1mm",)),
    ("compare cloth --max-depth '0.1mm 0.5mm'", ("max_depth", "commas or semicolons")),
    ("limits cloth --speed 0.1Hz", ("speed", "'1.5 m/s'", "another dimension", "'0.1Hz'")),
    ("compare cloth --speed 100mm", ("speed", "'1.5 m/s'", "another dimension", "'100mm'")),
    ("run cloth --duration 10", ("duration needs a unit: write 10s",)),
    ("onset scene.toml --delays '0 2 5'", ("delays", "commas or semicolons", "'0 2 5'")),
    ("scan scene.toml --strokes '1; 2'", ("strokes must be a single value", "'1; 2'")),
    ("warm --jobs two", ("jobs must be a number", "'two'")),
    # Settings.
    ("analyze cloth --law F --set friction=0.1N", ("friction", "device.friction=0.1N")),
    ("analyze cloth --law F --set fricton=0.1", ("'fricton'", "did you mean 'friction'")),
    ("analyze cloth --set devise.friction=80mN", ("'devise.friction'", "'device.friction'")),
    ("analyze cloth --set max_stiffness", ("NAME=VALUE", "'max_stiffness'")),
]
"""Commands and the words that their messages contain."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the current folder, with the files that the commands name."""
    monkeypatch.chdir(tmp_path)
    for name in ("cloth", "folder.x3p"):
        (tmp_path / name).mkdir()
    texts = {
        "empty.x3p": "",
        "land.x3p": "PK",
        "notes.txt": "no numbers",
        "scene.toml": '[texture]\nkind = "cloth"\n',
        "wrong_key.toml": '[texture]\nkind = "cloth"\n[surface]\nstifness = "1 N/m"\n',
        "wrong_section.toml": '[texture]\nkind = "cloth"\n[surfaces]\nlaw = "C"\n',
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def faults_of(code: int, out: str, err: str, words: tuple[str, ...]) -> list[str]:
    """Return what is wrong with the answer to a wrong command."""
    faults = [f"lacks {word!r}" for word in words if word not in err]
    faults += [] if code == 2 else [f"exit code {code}"]
    faults += ["standard output"] if out else []
    faults += [] if err.startswith("asperity: ") and err.count("\n") == 1 else ["not one line"]
    return faults


def test_a_hundred_different_commands_name_every_command() -> None:
    commands = [command for command, _words in MISTAKES]
    assert len(commands) == len(set(commands)) >= 100
    assert {command.split()[0] for command in commands} >= set(COMMANDS)
    assert all(words for _command, words in MISTAKES)


@pytest.mark.parametrize(("command", "words"), MISTAKES, ids=[command for command, _ in MISTAKES])
def test_mistake_is_one_line_that_names_it(
    command: str, words: tuple[str, ...], call: Call, folder: Path
) -> None:
    before = sorted(folder.rglob("*"))
    answer = call(*shlex.split(command))
    assert faults_of(*answer, words) == [], answer[2]
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize(
    ("answer", "fault"),
    [
        ((0, "", "asperity: word\n"), "exit code 0"),
        ((2, "", "asperity: other\n"), "lacks 'word'"),
        ((2, "table\n", "asperity: word\n"), "standard output"),
        ((2, "", "Usage: asperity\n\nError: word\n"), "not one line"),
        ((2, "", "asperity: word\nasperity: word\n"), "not one line"),
    ],
)
def test_faulty_answer_is_detected(answer: tuple[int, str, str], fault: str) -> None:
    assert faults_of(*answer, ("word",)) == [fault]


def test_correct_command_is_no_mistake(call: Call) -> None:
    assert "exit code 0" in faults_of(*call("surfaces", "cloth"), ())


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("separator", [",", ";", ", ", "; "])
def test_lists_have_commas_or_semicolons(separator: str, call: Call) -> None:
    """A list with either separator is read up to its last value, which is wrong on purpose."""
    scene, last = "scene.toml", "9 lumps"
    for command, value in (
        ("compare cloth --max-depth", "1mm"),
        ("compare cloth --device", "touch"),
        ("compare cloth --laws", "W"),
        ("analyze cloth --extent", "1mm"),
        (f"scan {scene} --speeds", "0.1m/s"),
        (f"scan {scene} --depths", "1mm"),
        (f"onset {scene} --delays", "0"),
        ("show land.x3p --pitch", "1um"),
        ("maps cloth -o c.png --spacing", "1um"),
    ):
        answer = call(*command.split(), f"{value}{separator}{last}")
        assert faults_of(*answer, (f"{last}'",)) == [], answer[2]
        assert f"{value}{separator}{last}" not in answer[2]

"""Output, options and errors of ``asperity compare``."""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import numpy as np
import pytest
from click.testing import CliRunner
from tests.report.report_pages import check_alone, check_alts

import asperity as asp
from asperity.analysis.results import comparison_rows
from asperity.cli.main import COMMANDS, cli

Call = Callable[..., tuple[int, str, str]]

SPEC = "sinusoid:amplitude=0.8mm,period=1mm"
DATA = Path(__file__).parents[3] / "shared" / "data"
needs_data = pytest.mark.skipif(
    not DATA.is_dir(), reason="the real surfaces of ../shared/data are not there"
)


def test_table_has_one_row_per_law_with_the_letter_first(call: Call) -> None:
    code, out, err = call("compare", SPEC)
    assert code == 0
    assert err == ""
    rows = [line.split()[0] for line in out.splitlines() if line[:2].strip() and line[1:2] == " "]
    for letter in "WABCDEFGH":
        assert letter in rows
    assert "omega.3" in out
    assert "Default scanning speed 0.1 m/s" in out


def test_json_is_the_only_output_on_stdout(call: Call) -> None:
    code, out, err = call("compare", SPEC, "--laws", "AD", "--json", "-")
    data = json.loads(out)
    assert (code, err) == (0, "")
    assert [row["law"] for row in data["laws"]] == ["A", "D"]
    assert data["laws"][1]["q"]["value"] == "inf"


def test_html_is_the_only_output_on_stdout(call: Call) -> None:
    code, out, err = call("compare", SPEC, "--laws", "WA", "--html", "-")
    assert (code, err) == (0, "")
    assert out.lstrip().lower().startswith("<!doctype html>")
    assert out.rstrip().endswith("</html>")


def test_json_and_html_files_are_complete(call: Call, tmp_path: Path) -> None:
    json_path, html_path = tmp_path / "a.json", tmp_path / "a.html"
    code, out, _err = call(
        "compare", SPEC, "--laws", "WC", "--json", str(json_path), "--html", str(html_path)
    )
    assert code == 0
    assert json.loads(json_path.read_text("utf-8"))["schema"] == 4
    assert "</html>" in html_path.read_text("utf-8")
    assert html_path.stat().st_size < 3_000_000
    assert str(html_path) in out.replace("\n", "")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.html", "a.json"]


def test_html_page_shows_its_command_and_the_hash_of_the_result(call: Call, tmp_path: Path) -> None:
    data, path = tmp_path / "a.json", tmp_path / "it's <b>\x1b[31m.html"
    call("compare", SPEC, "--laws", "W", "--json", str(data), "--html", str(path))
    text = path.read_text("utf-8")
    assert hashlib.sha256(data.read_bytes()).hexdigest()[:12] in check_alone(text).text
    page_text = check_alone(text).text
    assert f"asperity compare {SPEC} --laws W --json {data} --html '" in page_text
    assert "it'\"'\"'s <b>\\x1b[31m.html'" in page_text
    assert "\x1b" not in text


@needs_data
def test_html_page_of_a_measured_surface_is_below_3_mb(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "land.html"
    # A baked field of law H takes a minute, and gives a page of the same size.
    options = ["--magnify", "20", "--device", "touch", "--rendering", "search"]
    options += ["--html", str(path)]
    assert call("compare", str(DATA / "sample-land.x3p"), *options)[0] == 0
    text = path.read_text("utf-8")
    check_alts(check_alone(text), text)
    assert path.stat().st_size < 3_000_000


def test_stiffness_above_the_limit_is_reported_and_not_an_error(call: Call) -> None:
    code, out, _err = call("compare", SPEC, "--laws", "A", "--stiffness", "9000N/m")
    assert code == 0
    assert "may buzz" in out


def test_options_reach_the_result(call: Call) -> None:
    parameters = "--stiffness=500 N/m;--max-depth=0.2mm;--friction=0.3;--max-deflection=0.5mm"
    options = [*parameters.split(";"), "--modulation-depth=0.5", "--device=TOUCH"]
    _code, out, _err = call("compare", SPEC, "--laws", "F", *options, "--json", "-")
    data = json.loads(out)
    assert (data["stiffness"], data["max_depth"], data["device"]["id"]) == (500.0, 0.0002, "touch")
    # q_F of these parameters by the exact one-dimensional maximum, on a grid of phases.
    x = np.linspace(0, 1e-3, 200_001)
    m = (1 + 0.5 * np.sin(2 * np.pi * x / 1e-3)) / 2
    slope = np.abs(0.25 * 2 * np.pi / 1e-3 * np.cos(2 * np.pi * x / 1e-3))
    a, b = 0.3 * 0.2e-3 * ((1 - m) / 0.5e-3 + slope), 0.3 * (1 - m)
    t = 1 + a**2 + b**2
    expected = np.sqrt((t + np.sqrt(t**2 - 4 * a**2)) / 2).max()
    assert data["laws"][0]["q"]["value"] == pytest.approx(expected, rel=1e-8)


def test_options_override_the_scene_file(call: Call, tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(
        '[texture]\nkind = "sinusoid"\namplitude = "0.4 mm"\nperiod = "1.5 mm"\n'
        '[surface]\nlaw = "C"\nstiffness = "800 N/m"\nmax_depth = "0.5 mm"\n'
        '[device]\nid = "pantograph"\n'
    )
    _code, out, _err = call("compare", str(scene), "--laws", "A", "--json", "-")
    data = json.loads(out)
    assert (data["stiffness"], data["device"]["id"]) == (800.0, "pantograph")
    _code, out, _err = call(
        "compare",
        str(scene),
        "--laws",
        "A",
        "--json",
        "-",
        "--stiffness",
        "300N/m",
        "--device",
        "inverse3",
    )
    data = json.loads(out)
    assert (data["stiffness"], data["device"]["id"]) == (300.0, "inverse3")


@needs_data
@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("sample-land.x3p", ["--magnify", "20", "--device", "touch"]),
        ("testing.x3p", ["--magnify", "0.01"]),
        ("dektak-1.csv", ["--magnify", "20", "--magnify-height", "500"]),
    ],
)
def test_measured_surfaces_are_compared(call: Call, name: str, options: list[str]) -> None:
    code, out, _err = call("compare", str(DATA / name), *options, "--laws", "WACG", "--json", "-")
    data = json.loads(out)
    assert code == 0
    assert len(data["laws"]) == 4
    assert any("magnified" in step for step in data["texture"]["preparation"])
    assert all(row["q"]["value"] >= 1.0 for row in data["laws"])


@needs_data
def test_measured_file_with_too_many_missing_points_is_refused(call: Call) -> None:
    pytest.importorskip("SurfaceTopography", reason="SurfaceTopography is not installed")
    code, out, err = call("compare", str(DATA / "frt-2.frt"))
    assert (code, out) == (2, "")
    assert "27.4 % of its points" in err
    assert "--max-missing" in err


BAD = [
    (["none.x3p"], "none.x3p"),
    (["sinusoid:amplitude=0.8mm"], "period"),
    (["sinusoid:amplitude=nan,period=1mm"], "amplitude"),
    (["sinusoid:amplitude=0.8mm,period=-1mm"], "period"),
    (["sinusiod:amplitude=0.8mm,period=1mm"], "did you mean 'sinusoid'"),
    ([SPEC, "--stiffness", "0"], "stiffness"),
    ([SPEC, "--stiffness", "-5N/m"], "stiffness"),
    ([SPEC, "--stiffness", "nan"], "stiffness"),
    ([SPEC, "--max-depth", "0mm"], "max_depth"),
    ([SPEC, "--max-depth", "inf"], "max_depth"),
    ([SPEC, "--modulation-depth", "1.2"], "modulation_depth"),
    ([SPEC, "--laws", "AB", "--friction", "0.3"], "law A, B cannot have it, law W, C, D, F, H can"),
    ([SPEC, "--laws", "W", "--set", "continuity=2"], "continuity has no effect"),
    ([SPEC, "--laws", "AXB"], "law"),
    ([SPEC, "--laws", "god-objct"], "did you mean 'god-object'"),
    ([SPEC, "--device", "omga.3"], "did you mean 'omega.3'"),
    ([SPEC, "--device", "none.toml"], "none.toml"),
    ([SPEC, "--outliers", "6"], "outliers"),
    ([SPEC, "--html", "no/such/folder/r.html"], "html"),
    ([SPEC, "--json", "no/such/folder/r.json"], "json"),
    ([SPEC, "--json", "-", "--html", "-"], "standard output"),
    ([SPEC, "--no-such-option"], "--no-such-option"),
]


@pytest.mark.parametrize(("arguments", "message"), BAD, ids=lambda v: str(v)[-40:])
def test_invalid_input_gives_a_one_line_error_and_writes_no_file(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = call("compare", *arguments)
    assert code == 2
    assert out == ""
    assert message in err
    assert "Traceback" not in err
    if "--no-such-option" not in arguments:
        assert len(err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def _write_invalid_maps(folder: Path) -> dict[str, list[str]]:
    """Write surfaces that must be refused; return the options to read each of them."""
    rng = np.random.default_rng(0)
    good = rng.normal(size=(8, 8)) * 1e-5
    holes = good.copy()
    holes[:3] = np.nan
    for name, array in {
        "row.npy": good[:1],
        "small.npy": good[:3, :3],
        "missing.npy": good * np.nan,
        "holes.npy": holes,
        "infinite.npy": np.where(good > 1e-5, np.inf, good),
        "good.npy": good,
    }.items():
        np.save(folder / name, array)
    (folder / "empty.x3p").write_bytes(b"")
    (folder / "cut.npy").write_bytes((folder / "good.npy").read_bytes()[:200])
    (folder / "words.txt").write_text("this is no surface\n")
    (folder / "picture.png").write_bytes(b"\x89PNG\r\n\x1a\n" + hashlib.sha256(b"x").digest())
    pitch = ["--pitch", "10um"]
    names = [path.name for path in folder.iterdir() if path.name != "good.npy"]
    options = dict.fromkeys(names, pitch)
    options["good.npy"] = []  # the pitch is missing
    return options


def test_invalid_files_give_a_one_line_error(call: Call, tmp_path: Path) -> None:
    for name, options in _write_invalid_maps(tmp_path).items():
        code, out, err = call("compare", str(tmp_path / name), *options)
        assert (code, out) == (2, ""), name
        assert len(err.strip().splitlines()) == 1, (name, err)


@pytest.mark.parametrize(
    "options",
    [
        ["--magnify", "0"],
        ["--magnify", "-2"],
        ["--magnify", "nan"],
        ["--s-cutoff", "5um"],
        ["--s-cutoff", "-1mm"],
        ["--pitch", "0"],
        ["--height-range", "-1mm"],
        ["--magnify-height", "0"],
    ],
)
def test_invalid_preparation_options_name_the_option(
    call: Call, tmp_path: Path, options: list[str]
) -> None:
    path = tmp_path / "map.npy"
    np.save(path, np.random.default_rng(0).normal(size=(8, 8)) * 1e-5)
    code, out, err = call("compare", str(path), "--pitch", "10um", *options)
    assert (code, out) == (2, "")
    assert options[0].removeprefix("--").replace("-", "_") in err


LOOSE_GRIP = """stiffness = "0 N/m"
damping = "2 N*s/m"
mass = "0 g"
[thresholds]
points = [
    { frequency = "10 Hz", unnoticed = "1 um", felt = "2 um" },
    { frequency = "500 Hz", unnoticed = "0.1 um", felt = "0.2 um" },
]
"""


@pytest.mark.parametrize("command", ["compare", "limits"])
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--speed", "0 m/s"], "speed must be positive [m/s], got 0.0"),
        (["--speed=-0.1m/s"], "speed must be positive [m/s], got -0.1"),
        (["--grip", "{grip}"], "stiffness must be positive [N/m], got 0.0"),
        (["--set", "apparent_mass=0g"], "apparent_mass must be positive"),
        (["--set", "apparent_mass=-45g"], "apparent_mass must be positive"),
        (["--set", "damping=-0.5N*s/m"], "damping must be positive"),
    ],
)
def test_zero_speeds_loose_grips_and_negative_masses_are_refused(
    call: Call, tmp_path: Path, command: str, options: list[str], message: str
) -> None:
    grip, page = tmp_path / "grip.toml", tmp_path / "page.html"
    grip.write_text(LOOSE_GRIP, "utf-8")
    given = [one.format(grip=grip) for one in options]
    code, out, err = call(command, SPEC, *given, "--html", str(page))
    assert (code, out, page.exists()) == (2, "", False)
    assert message in " ".join(err.split())


@pytest.mark.parametrize("command", ["compare", "limits"])
def test_a_grip_with_a_stiffness_is_accepted(call: Call, tmp_path: Path, command: str) -> None:
    grip = tmp_path / "grip.toml"
    grip.write_text(LOOSE_GRIP.replace('"0 N/m"', '"1 N/m"'), "utf-8")
    assert call(command, SPEC, "--grip", str(grip))[0] == 0


def test_thresholds_beyond_their_frequencies_are_named_for_all_laws(call: Call) -> None:
    """A wave of 0.1 mm at 0.06 m/s is at 600 Hz; the thresholds end at 500 Hz."""
    for speed, is_beyond in (("0.06m/s", True), ("0.02m/s", False)):
        spec = "sinusoid:amplitude=20um,period=0.1mm"
        options = ("--speed", speed, "--set", "update_rate=20kHz", "--why")
        code, out, _err = call("compare", spec, *options)
        assert code == 0
        assert ("nothing counts as felt" in " ".join(out.split())) is is_beyond


def test_next_commands_have_the_depth_that_a_press_chose(call: Call) -> None:
    spec = "sinusoid:amplitude=0.4mm,period=1.5mm"
    code, out, _err = call("compare", spec, "--device", "falcon", "--laws", "C", "--press", "100mN")
    assert code == 0
    texture = asp.Sinusoid(amplitude=0.4e-3, period=1.5e-3)
    (row,) = asp.compare(texture, "falcon", "C", press=0.1).rows
    commands = _next_commands(out)
    assert [command[0] for command in commands] == ["lab", "run", "export"]
    for command in commands:
        depth = command[command.index("--max-depth") + 1]
        assert float(depth.removesuffix("um")) == pytest.approx(1e6 * row.surface.max_depth)


def test_help_and_version_are_printed(call: Call) -> None:
    code, out, _err = call("--help")
    assert code == 0
    assert "compare" in out
    code, out, _err = call("--version")
    assert (code, out.split()[0]) == (0, "asperity,")


@pytest.mark.parametrize("arguments", [[], *([command] for command in COMMANDS)])
def test_help_imports_no_heavy_package(arguments: list[str]) -> None:
    """Start-up stays fast: ``--help`` of no command imports a numerical library."""
    code = (
        f"import sys; sys.argv = {['asperity', *arguments, '--help']}\n"
        "from asperity.cli.main import main\n"
        "try: main()\nexcept SystemExit: pass\n"
        "heavy = {'numpy', 'scipy', 'sympy', 'numba', 'matplotlib', 'pint', 'rich', 'jinja2'}\n"
        "sys.exit(str(sorted(heavy & set(sys.modules))) if heavy & set(sys.modules) else 0)"
    )
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, env=os.environ
    )
    assert process.returncode == 0, process.stderr


def test_comparing_shipped_laws_does_not_import_sympy() -> None:
    code = (
        "import sys, asperity as asp\n"
        "asp.compare(asp.Sinusoid(amplitude=1e-4, period=1e-3))\n"
        "sys.exit('sympy was loaded' if 'sympy' in sys.modules else 0)"
    )
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, env=os.environ
    )
    assert process.returncode == 0, process.stderr


def _next_commands(out: str) -> list[list[str]]:
    lines = out.split("\nNext:\n")[1].splitlines()
    return [shlex.split(line)[1:] for line in lines]


@pytest.mark.parametrize("options", [[], ["--magnify", "1.1", "--magnify-height", "1.05"]])
def test_after_not_felt_the_next_command_makes_it_felt(call: Call, options: list[str]) -> None:
    """The change was computed again, with what was typed: the printed command is run."""
    source = ["compare", "sinusoid:amplitude=3um,period=0.3mm", "--device", "touch"]
    code, out, _err = call(*source, "--laws", "CH", "--max-depth", "6um", *options)
    assert code == 0
    assert "Nothing of this texture will be felt" in out
    (command,) = _next_commands(out)
    assert command[: len(source)] == source
    code, out, _err = call(*command)
    assert code == 0
    assert "RMS is felt." in " ".join(out.split())
    _code, out, _err = call("compare", "sinusoid:amplitude=1pm,period=1mm", "--laws", "C")
    assert _next_commands(out) == [["envelope", "--device", "omega.3"]]


def test_next_command_names_a_device_file_as_typed(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "my arm.toml"
    path.write_text('max_stiffness = "1 N/mm"\n')
    flat = "sinusoid:amplitude=1pm,period=1mm"
    _code, out, _err = call("compare", flat, "--laws", "C", "--device", str(path))
    assert _next_commands(out) == [["envelope", "--device", str(path)]]
    scene = tmp_path / "scene.toml"
    texture = '[texture]\nkind = "sinusoid"\namplitude = "1 pm"\nperiod = "1 mm"\n'
    scene.write_text(f'{texture}[device]\nmax_stiffness = "1 N/mm"\n')
    _code, out, _err = call("compare", str(scene), "--laws", "C")
    assert _next_commands(out) == [["limits", str(scene)]]


def test_reasons_are_shown_on_request_with_options(call: Call) -> None:
    """The answer is two sentences; options are named, not arguments of Python."""
    command = ["compare", "sinusoid:amplitude=0.4mm,period=2mm", "--laws", "C"]
    _code, brief, _err = call(*command, "--max-depth", "0.3mm")
    assert "--why" in brief
    assert "Why:" not in brief
    assert "pressed to 0.8 mm it keeps contact (--max-depth 0.8mm)." in " ".join(brief.split())
    _code, full, _err = call(*command, "--max-depth", "0.3mm", "--why")
    reasons = " ".join(full.split("\nWhy:\n")[1].split("\n\n")[0].split())
    assert "simulated loops cycle" in reasons
    assert "simulated loops cycle" not in full.split("\nWhy:")[0]
    assumed = [text.split("\nAssumed:\n")[1].split("\n\n")[0] for text in (brief, full)]
    assert assumed[0].split() == ["-", "Default", "scanning", "speed", "0.1", "m/s"]
    assert "were not tested with people" in " ".join(assumed[1].split())


def test_rows_appear_on_a_terminal_when_they_are_ready(
    call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Above the progress bar; what is printed at the end is that without a terminal."""
    command = ("compare", "sinusoid:amplitude=0.2mm,period=2mm", "--laws", "WC")
    expected = call(*command, width=100)
    stream = io.StringIO()
    monkeypatch.setattr(stream, "isatty", lambda: True)
    monkeypatch.setattr(sys, "stderr", stream)
    slow = partial(wait, comparison_rows._compute_row)
    monkeypatch.setattr(comparison_rows, "_compute_row", slow)
    assert call(*command, width=100) == expected
    frames = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", stream.getvalue())
    _before, after = re.split(r"^W .*N/m", frames, maxsplit=1, flags=re.M)
    assert "law C (2 of 2)" in re.split(r"^C .*N/m", after, flags=re.M)[0]


def wait(compute: Callable[..., Any], *arguments: Any) -> Any:
    """Compute a row after some refreshes of the terminal."""
    time.sleep(0.4)
    return compute(*arguments)


def test_next_commands_run_the_recommended_law(call: Call, tmp_path: Path) -> None:
    """With the options of the file, device, plugin and law that it takes, ready to paste."""
    path = tmp_path / "two words.npy"
    np.save(path, 2e-4 * np.sin(np.linspace(0.0, 12.0 * np.pi, 400)))
    device = tmp_path / "mine.toml"
    device.write_text('id = "other"\nname = "Mine"\nmax_stiffness = "900N/m"\n')
    options = ["--pitch", "20um", "--periodic", "--set", "apparent_mass=60g"]
    options += ["--set", "modulation_depth=0.5"]
    code, out, err = call("compare", str(path), "--laws", "WFC", "--device", str(device), *options)
    assert (code, err) == (0, "")
    commands = _next_commands(out)
    assert [one[0] for one in commands] == ["lab", "run", "export"]
    for name, source, *rest in commands:
        assert source == str(path)
        assert "modulation_depth=0.5" not in rest  # of law F, C was recommended
        assert rest[:3] == ["--law", "C", "--stiffness"]
        kept = (["--pitch", "20um"], ["--set", "apparent_mass=60g"], ["--periodic"])
        for words in (*kept, ["--device", str(device)]):
            assert " ".join(words) in " ".join(rest)
        command = cli.get_command(click.Context(cli), name)
        assert command is not None
        command.make_context(name, [source, *rest])
    _name, *arguments = commands[2]
    target = tmp_path / "texture.h"
    assert call("export", *arguments[:-1], str(target))[0] == 0
    assert target.exists()


def test_compare_without_arguments_asks_on_a_terminal(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Each answer is checked at once: what is wrong is explained and asked for again."""
    code = CliRunner().invoke(cli, ["compare"]).exit_code
    assert code == 2
    terminal = SimpleNamespace(stdin=SimpleNamespace(isatty=lambda: True))
    monkeypatch.setattr("asperity.cli.guidance.sys", terminal)
    wave = "sinusoid:amplitude=0.1mm,period=2mm"
    answers = ["?", "sinusoidd", wave, "?", "tuoch", "touch", "0.2", "0.2mm"]
    done = CliRunner().invoke(cli, ["compare"], input="\n".join([*answers, ""]))
    text = " ".join(done.output.split())
    assert "known: " in text
    assert "did you mean 'sinusoid'" in text
    assert "did you mean 'touch'" in text
    assert "max_depth needs a unit" in text
    assert f"asperity compare {wave} --device touch --max-depth 0.2mm" in text
    assert "on the 3D Systems Touch" in text
    path = tmp_path / "wave.npy"
    np.save(path, 2e-4 * np.sin(np.linspace(0.0, 12.0 * np.pi, 400)))
    answers = [str(path), "20um", "touch", ""]
    done = CliRunner().invoke(cli, ["compare"], input="\n".join([*answers, ""]))
    assert "pitch must be given" in done.output
    assert f"asperity compare {path} --pitch 20um --device touch\n" in done.output

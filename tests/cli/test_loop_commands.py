"""``asperity simulate``, ``onset``, ``scan`` and ``recording``."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from tests.report.report_pages import check_alone, check_alts

import asperity as asp
from asperity.cli.main import cli

Call = Callable[..., tuple[int, str, str]]

SCENE = """
[texture]
kind = "sinusoid"
amplitude = "0.4 mm"
period = "2 mm"
[surface]
law = "A"
stiffness = "400 N/m"
max_depth = "1 mm"
[device]
apparent_mass = "50 g"
damping = "1 N*s/m"
update_rate = "4 kHz"
delay_samples = 1
[hand]
kind = "spring"
stiffness = "300 N/m"
damping = "3 N*s/m"
"""
STILL = '[motion]\nkind = "still"\npoint = ["0 mm", "0 mm", "-0.5 mm"]\n[run]\nduration = "0.2 s"\n'
STROKES = """[motion]
kind = "strokes"
start = ["0 mm", "0 mm", "-0.5 mm"]
end = ["8 mm", "0 mm", "-0.5 mm"]
speed = "0.1 m/s"
"""


@pytest.fixture
def still(tmp_path: Path) -> str:
    path = tmp_path / "still.toml"
    path.write_text(SCENE + STILL)
    return str(path)


def test_long_simulation_needs_confirmation(call: Call, still: str, tmp_path: Path) -> None:
    trace = tmp_path / "run.mcap"
    code, _out, err = call("simulate", still, "--duration", "1e9s", "--trace", str(trace))
    assert code == 2
    assert "duration of 1e+09 s is 4e+12 samples, which take about 32 days" in " ".join(err.split())
    assert "a trace of 1.2e+06 GB; --yes simulates it" in " ".join(err.split())
    assert not trace.exists()
    trace.write_text("kept")
    code, _out, err = call("simulate", still, "--trace", str(trace))
    assert (code, "trace exists" in err, trace.read_text()) == (2, True, "kept")


@pytest.fixture
def strokes(tmp_path: Path) -> str:
    path = tmp_path / "strokes.toml"
    path.write_text(SCENE + STROKES)
    return str(path)


def test_simulate_prints_the_energy_ledger(call: Call, still: str) -> None:
    code, out, err = call("simulate", still)
    assert (code, err) == (0, "")
    assert "Law A at 400 N/m" in out
    assert "comes to rest" in " ".join(out.split())
    assert "texture, exact" in out
    residual = re.search(r"Residual: (\S+) of", " ".join(out.split()))
    assert residual is not None
    assert float(residual[1]) < 1e-9
    assert max(map(len, out.splitlines())) <= 80


def test_final_velocity_is_the_same_with_and_without_a_trace(
    call: Call, still: str, tmp_path: Path
) -> None:
    path, page = tmp_path / "trace.mcap", tmp_path / "run.html"
    _code, plain, _err = call("simulate", still)
    _code, traced, _err = call("simulate", still, "--trace", str(path))
    assert traced.startswith(plain)
    call("simulate", still, "--html", str(page))
    text = " ".join(plain.split())
    match = re.search(r"velocity varies by \S+ \S+ in", text)
    assert match is not None
    assert match[0] in " ".join(page.read_text(encoding="utf-8").split())


def test_simulate_writes_json_and_html(call: Call, strokes: str, tmp_path: Path) -> None:
    code, out, _err = call(
        "simulate", strokes, "--json", "-", "--law", "B", "--stiffness", "300N/m"
    )
    assert code == 0
    data = json.loads(out)
    assert data["scene"]["surface"]["law"] == "B"
    assert data["scene"]["surface"]["stiffness"] == 300.0
    ledger = data["run"]["ledger"]
    assert sum(ledger["supplied"]) == pytest.approx(ledger["supplied_sum"])
    assert abs(ledger["closure"]) < 1e-9 * ledger["exchanged"]
    code, out, _err = call("simulate", strokes, "--html", str(tmp_path / "run.html"))
    text = (tmp_path / "run.html").read_text(encoding="utf-8")
    assert code == 0
    assert text.count("<svg") == 1
    check_alts(check_alone(text), text)
    assert "://" not in re.sub(r"data:[^\"]*", "", text)
    assert "Energy ledger" in text


def test_trace_columns_have_units(call: Call, still: str, tmp_path: Path) -> None:
    recorded, path = str(tmp_path / "trace.mcap"), str(tmp_path / "trace.csv")
    page = str(tmp_path / "run.html")
    code, out, _err = call("simulate", still, "--trace", recorded, "--every", "2", "--html", page)
    assert code == 0
    assert f"Trace: {recorded}" in out
    assert call("recording", "export", recorded, "-o", path)[0] == 0
    with open(path, encoding="utf-8") as file:
        names = file.readline().strip().split(",")
    assert names[:4] == ["time [s]", "x [m]", "y [m]", "z [m]"]
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    assert table.shape == (400, len(names))
    assert table[1, 0] == pytest.approx(2 / 4000)
    assert "<svg" in Path(page).read_text(encoding="utf-8")


def test_recorded_run_is_replayed_bit_for_bit_and_exported(
    call: Call, still: str, tmp_path: Path
) -> None:
    path, page = str(tmp_path / "run.mcap"), tmp_path / "run.html"
    code, out, _err = call("simulate", still, "--trace", path, "--html", str(page))
    assert (code, f"Trace: {path}" in out) == (0, True)
    assert "<svg" in page.read_text(encoding="utf-8")
    code, out, _err = call("recording", "info", path)
    assert code == 0
    assert out.startswith("800 rows, 200 ms at 4 kHz: law A at 400 N/m on sinusoid")
    assert re.search(r"commanded z +[-0-9.]+ +[0-9.]+ +N", out)
    assert call("recording", "replay", path)[:2] == (
        0,
        "All 800 rows are reproduced bit for bit.\n",
    )
    Path(still).write_text(Path(still).read_text(encoding="utf-8") + "\n", encoding="utf-8")
    code, out, _err = call(
        "recording", "replay", path, "--surface", "sinusoid:amplitude=0.3mm,period=2mm,phase=30deg"
    )
    assert code == 0
    replay_text = " ".join(out.split())
    assert re.match(r"\d+ of 800 rows differ; the first is row \d+, at .*: commanded", replay_text)
    assert f"The file {still} has changed since".replace(" ", "") in replay_text.replace(" ", "")
    assert "Recorded on another surface" in replay_text
    for name in ("run.csv", "run.mat", "page.html", "run.png", "run.svg"):
        verb = "export" if name[:3] == "run" and name[-3:] in {"csv", "mat"} else "plot"
        code, out, _err = call("recording", verb, path, "-o", str(tmp_path / name))
        assert (code, out) == (0, f"Saved: {tmp_path / name}\n")
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    check_alts(check_alone(text), text)
    code, out, _err = call("recording", "info", path, "--json", "-")
    about = json.loads(out)["about"]
    assert about["device"]["name"]
    assert about["scene"] + "\n" == Path(still).read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "about",
    [
        {},
        {"surface": {"law": "B"}, "servo": {"delay": 1}, "device": "touch"},
        {"surface": 3, "servo": {"period": "often"}, "every": "other", "hand": {}},
    ],
)
def test_recording_with_other_metadata_is_shown_and_cannot_be_replayed(
    call: Call, tmp_path: Path, about: dict[str, Any]
) -> None:
    path = tmp_path / "run.mcap"
    with asp.RecordingWriter(path, (("time", "s"), ("x", "m")), about) as writer:
        writer.append(np.array([[0.0, 1.0], [0.5, 2.0]]))
    code, out, err = call("recording", "info", str(path))
    assert (code, err) == (0, "")
    assert out.startswith("2 rows, 500 ms.\n")
    for verb in (["replay", str(path)], ["plot", str(path), "-o", str(tmp_path / "a.png")]):
        code, out, err = call("recording", *verb)
        assert (code, out, err.count("\n")) == (2, "", 1)


def test_truncated_recording_without_a_complete_block_has_no_rows(
    call: Call, tmp_path: Path
) -> None:
    path = tmp_path / "run.mcap"
    with asp.RecordingWriter(path, (("time", "s"), ("x", "m"))) as writer:
        writer.append(np.zeros((2, 2)))
    start = asp.open_recording(path)._chunks[0].start
    path.write_bytes(path.read_bytes()[: start + 20])
    code, out, err = call("recording", "info", str(path))
    assert (code, err) == (0, "")
    assert out.startswith(
        "0 rows, 0 s. The recording was not closed, and contains no complete block.\n"
    )
    assert "nan" not in out
    code, out, _err = call("recording", "info", str(path), "--json", "-")
    assert [column["least"] for column in json.loads(out)["columns"]] == [None, None]
    with asp.RecordingWriter(path, (("time", "s"), ("x", "m"))):
        pass
    assert call("recording", "info", str(path))[1].startswith("0 rows, 0 s. Nothing was recorded.")


def test_recording_of_a_later_format_is_refused(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with asp.RecordingWriter(path, (("time", "s"), ("x", "m"))) as writer:
        writer.append(np.zeros((2, 2)))
    path.write_bytes(path.read_bytes().replace(b"\x01\0\0\x001", b"\x01\0\0\x002", 1))
    picture, table = str(tmp_path / "a.png"), str(tmp_path / "a.csv")
    for verb, *output in (["info"], ["replay"], ["plot", "-o", picture], ["export", "-o", table]):
        code, out, err = call("recording", verb, str(path), *output)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert "it is of format 2" in err
    assert [item.name for item in tmp_path.iterdir()] == ["run.mcap"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["info", "{still}"], "it is not an MCAP recording"),
        (["info", "."], "not a regular file"),
        (["replay", "missing.mcap"], "No such file"),
        (["export", "{run}", "-o", "a.xls"], "must end in .csv, .mat"),
        (["export", "{run}", "-o", "{run}"], "must be another file than the recording"),
        (["export", "{run}", "-o", "no/a.csv"], "folder that exists"),
        (["plot", "{run}", "-o", "a.gif"], "must end in .html, .svg, .png, .pdf"),
        (["plot", "{run}", "-o", "a.png", "-o", "b.png"], "output is given twice"),
        (["replay", "{run}", "--surface", "no:thing=1"], "surface"),
    ],
)
def test_invalid_recording_input_gives_a_one_line_error(
    call: Call, still: str, tmp_path: Path, arguments: list[str], words: str
) -> None:
    run = tmp_path / "run.mcap"
    call("simulate", still, "--trace", str(run), "--duration", "10ms")
    filled = [argument.format(still=still, run=run) for argument in arguments]
    code, out, err = call("recording", *filled)
    assert (code, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_full_disk_is_reported(call: Call, still: str, tmp_path: Path) -> None:
    full = tmp_path / "full.mcap"
    os.symlink("/dev/full", full)
    code, out, err = call("simulate", still, "--trace", str(full))
    assert (code, out) == (2, "")
    assert "trace cannot be written" in err
    assert "Traceback" not in err


def test_onset_brackets_the_critical_stiffness(call: Call, still: str, tmp_path: Path) -> None:
    options = ["--delays", "0; 2", "--starts", "2", "--tolerance", "0.2", "--laws", "WC"]
    code, out, err = call("onset", still, *options, "--lowest", "100N/m")
    assert (code, err) == (0, "")
    rows = [line.split() for line in out.splitlines() if re.match(r"[WC] +[02] ", line)]
    assert len(rows) == 4
    assert max(map(len, out.splitlines())) <= 80
    code, out, _err = call("onset", still, *options, "--lowest", "100N/m", "--json", "-")
    onsets = json.loads(out)["onsets"]
    assert [(onset["law"], onset["delay"]) for onset in onsets] == [
        ("W", 0),
        ("W", 2),
        ("C", 0),
        ("C", 2),
    ]
    for onset in onsets:
        assert onset["quiet"] < onset["cycling"] <= 1.2 * onset["quiet"] * (1 + 1e-9)
        assert onset["cycling"] > onset["delay_rule"]
    code, _out, _err = call("onset", still, *options, "--html", str(tmp_path / "o.html"))
    text = (tmp_path / "o.html").read_text(encoding="utf-8")
    assert "Onset against delay" in text
    check_alts(check_alone(text), text)


def test_scan_separates_energy_gain_from_loss(call: Call, strokes: str, tmp_path: Path) -> None:
    options = ["--laws", "AF", "--speeds", "0.05m/s; 0.1m/s", "--strokes", "3"]
    code, out, err = call("scan", strokes, *options)
    assert (code, err) == (0, "")
    summary = " ".join(out.split())
    assert "A stroke delivers energy: A always, F never." in summary
    assert "The field of the law itself does: A always, F never." in summary
    assert max(map(len, out.splitlines())) <= 80
    code, out, _err = call("scan", strokes, *options, "--depths", "0.2mm;0.4mm", "--json", "-")
    results = json.loads(out)["strokes"]
    assert [(stroke["law"], stroke["speed"], stroke["depth"]) for stroke in results[:3]] == [
        ("A", 0.05, 2e-4),
        ("A", 0.05, 4e-4),
        ("A", 0.1, 2e-4),
    ]
    assert len(results) == 8
    code, _out, _err = call("scan", strokes, *options, "--html", str(tmp_path / "s.html"))
    text = (tmp_path / "s.html").read_text(encoding="utf-8")
    assert "Energy per stroke" in text
    check_alts(check_alone(text), text)


BAD = [
    (["simulate", "sinusoid:amplitude=1mm,period=1mm"], "must be a scene file"),
    (["simulate", "{still}", "--duration", "0s"], "duration must be positive"),
    (["simulate", "{still}", "--every", "1.5"], "every must be a whole number"),
    (["simulate", "{still}", "--every", "0"], "every must be a whole number"),
    (["simulate", "{still}", "--trace", "trace.xls"], "trace must end in .mcap"),
    (["simulate", "{still}", "--trace", "no/trace.mcap"], "folder that exists"),
    (["simulate", "{still}", "--json", "-", "--html", "-"], "cannot both"),
    (["simulate", "{still}", "--trace", "a.csv", "--json", "a.csv"], "cannot both"),
    (["simulate", "{still}", "--html", "a.html", "--json", "./a.html"], "cannot both"),
    (["simulate", "{still}", "--duration", "1e300s"], "duration must be at most"),
    (["simulate", "{still}", "--stiffness", "1" + "0" * 400], "stiffness must be finite"),
    (["onset", "{still}", "--delays", "1e20"], "delay must be at most"),
    (["simulate", "{still}", "--device", "omega.3"], "else --set apparent_mass=50g"),
    (["simulate", "{still}", "--law", "Z"], "law"),
    (["simulate", "{still}", "--friction", "0.3"], "law A cannot have it, law W, C, D, F, H can"),
    (["onset", "{still}", "--laws", "WF", "--set", "continuity=2"], "law H does"),
    (["onset", "{strokes}"], "must be at rest"),
    (["onset", "{still}", "--delays", "1.5"], "delays must be a whole number"),
    (["onset", "{still}", "--delays", "-1"], "delay must be a whole number"),
    (["onset", "{still}", "--starts", "0"], "starts must be a whole number"),
    (["onset", "{still}", "--laws", "WW"], "twice"),
    (["onset", "{still}", "--starts", "1;9"], "starts must be a single value"),
    (["onset", "{still}", "--starts", "1e12"], "starts must be a whole number, 1 to"),
    (["onset", "{still}", "--tolerance", "1e-18"], "tolerance must be at least"),
    (["onset", "{still}", "--lowest", "1e7N/m"], "lowest must be below the highest"),
    (["onset", "{still}", "--stiffness", "100N/m"], "stiffness is the result of onset"),
    (["onset", "{still}", "--duration", "0.5ms"], "duration must be at least 16 samples"),
    (["scan", "{still}"], "motion must be"),
    (["scan", "{strokes}", "--speeds", "fast"], "speeds must be a quantity"),
    (["scan", "{strokes}", "--speeds", "0m/s"], "speeds must be positive"),
    (["scan", "{strokes}", "--strokes", "0"], "count must be positive"),
]


@pytest.mark.parametrize(("arguments", "message"), BAD, ids=[" ".join(a)[:60] for a, _m in BAD])
def test_invalid_input_gives_a_one_line_error_and_writes_no_file(
    call: Call,
    still: str,
    strokes: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    filled = [text.format(still=still, strokes=strokes) for text in arguments]
    code, out, err = call(*filled)
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.strip().splitlines()) == 1
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("command", ["simulate", "onset", "scan"])
def test_help_names_the_scene_argument(command: str) -> None:
    result = CliRunner().invoke(cli, [command, "--help"])
    assert result.exit_code == 0
    assert "SCENE" in result.output


def test_diverged_run_is_written_as_strict_json(call: Call, still: str) -> None:
    scene = Path(still)
    scene.write_text(scene.read_text() + 'velocity = ["1e300 m/s", 0, 0]\n')
    code, out, err = call("simulate", still, "--json", "-")
    assert (code, err) == (0, "")
    run = json.loads(out)["run"]
    assert run["stop_message"] == "diverged"
    assert run["ledger"]["stored_before"] is None
    assert run["state"][1] == 0.0


def test_stiffness_that_makes_the_body_too_fast_is_refused(call: Call, still: str) -> None:
    scene = Path(still)
    scene.write_text(scene.read_text().replace("300 N/m", "1e300 N/m"))
    code, out, err = call("simulate", still, "--json", "-")
    assert (code, out) == (2, "")
    assert "stiffness makes the body too fast" in err


def test_run_stops_when_the_plant_leaves_its_workspace(call: Call, tmp_path: Path) -> None:
    text = SCENE.replace('apparent_mass = "50 g"\n', "").replace(
        '[device]\ndamping = "1 N*s/m"\nupdate_rate = "4 kHz"\ndelay_samples = 1\n',
        '[device]\nid = "pantograph"\n',
    )
    far = STROKES.replace("8 mm", "200 mm").replace("0.1 m/s", "0.3 m/s")
    (tmp_path / "far.toml").write_text(text + far)
    code, out, err = call("simulate", str(tmp_path / "far.toml"))
    assert (code, err) == (0, "")
    words = " ".join(out.split())
    assert "The run stopped: it left the workspace: from (" in words
    assert "an arm is stretched or folded within a sample" in words

"""The command ``sweep``: the table, going on where it stopped, and refusals in one line."""

from __future__ import annotations

import csv
import json
import runpy
import shutil
from pathlib import Path

import pytest
from tests.cli.conftest import Call

import asperity as asp
from asperity.cli import simulation_commands
from asperity.sweeps.case_runs import RUN_KINDS
from asperity.sweeps.sweep_result import CASES_FILE

COMMAND = "sweep"
ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
COUNTING = str(ROOT / "tests" / "sweeps" / "counting_run.py")
PRESS, STROKE = (str(ROOT / "examples" / name) for name in ("press.toml", "stroke.toml"))
SURFACE = "sinusoid:amplitude=0.1mm"
VARY = ("--vary", "texture.period=1mm:2mm:3log", "--vary", "device=touch,omega.3")


def read_csv(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def test_the_command_is_the_function(call: Call, tmp_path: Path) -> None:
    folder, report = tmp_path / "run", tmp_path / "run.html"
    options = ("--laws", "WA", "--jobs", "1", "-o", str(folder), "--html", str(report))
    code, out, err = call(SURFACE, *VARY, *options, "--json", str(tmp_path / "run.json"))
    assert (code, err) == (0, "")
    assert "6 cases of compare over texture.period [m], device.id: no cases fail." in out
    vary = {"texture.period": "1mm:2mm:3log", "device": "touch,omega.3"}
    result = asp.sweep(SURFACE, vary, laws="WA", processes=1)
    result.to_csv(tmp_path / "other.csv")
    assert (folder / "table.csv").read_bytes() == (tmp_path / "other.csv").read_bytes()
    rows = json.loads((tmp_path / "run.json").read_text("utf-8"))["rows"]
    assert rows == result.table_rows()
    assert "Sweep of sinusoid" in report.read_text("utf-8")
    first = read_csv(folder / "table.csv")[0]
    assert (first["texture.period [m]"], first["law"]) == ("0.001", "W")
    compared = asp.compare("sinusoid:amplitude=0.1mm,period=1mm", "touch", "WA")
    expected = compared["A"].recommended_stiffness
    assert rows[1]["recommended stiffness [N/m]"] == expected


def test_the_same_command_goes_on_and_another_is_refused(call: Call, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    options = ("--laws", "W", "--jobs", "1", "-o", str(folder))
    assert call(SURFACE, *VARY, *options)[0] == 0
    table = (folder / "table.csv").read_bytes()
    cases = folder / CASES_FILE
    lines = cases.read_bytes().splitlines(keepends=True)
    cases.write_bytes(b"".join(lines[:2]) + lines[2][:20])
    assert call(SURFACE, *VARY, *options)[0] == 0
    assert cases.read_bytes() == b"".join(lines)
    assert (folder / "table.csv").read_bytes() == table
    code, out, err = call(SURFACE, *VARY[:2], *options)
    assert (code, out) == (2, "")
    assert "output holds another sweep (other vary, cases): choose another folder" in err
    assert err.count("\n") == 1


def test_onsets_and_strokes_of_a_scene(call: Call, tmp_path: Path) -> None:
    options = ("--laws", "C", "--jobs", "1")
    onset = ("--run", "onset", "--delays", "1;2", "--starts", "2", "-o", str(tmp_path / "a"))
    code, _, err = call(PRESS, "--vary", "texture.period=1mm,2mm", *onset, *options)
    assert (code, err) == (0, "")
    rows = read_csv(tmp_path / "a" / "table.csv")
    assert [row["delay [samples]"] for row in rows] == ["1", "2"] * 2
    direct = asp.onset(PRESS, "C", [1, 2], n_phases=2).table_rows()
    assert float(rows[0]["cycling [N/m]"]) == direct[0]["cycling [N/m]"]
    scan = ("--run", "scan", "--strokes", "3", "--speeds", "0.1m/s", "-o", str(tmp_path / "b"))
    code, _, err = call(STROKE, "--vary", "hand.stiffness=200N/m:300N/m:2", *scan, *options)
    assert (code, err) == (0, "")
    rows = read_csv(tmp_path / "b" / "table.csv")
    assert [row["hand.stiffness [N/m]"] for row in rows] == ["200.0", "300.0"]
    assert rows[0]["energy per stroke [J]"] != rows[1]["energy per stroke [J]"]


def test_errors_are_rows_of_the_table(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(RUN_KINDS, "counting", runpy.run_path(COUNTING)["COUNTING"])
    scene = tmp_path / "scene.toml"
    scene.write_text('[texture]\nkind = "sinusoid"\namplitude = "0.1 mm"\nperiod = "1 mm"\n')
    vary = ("--vary", "texture.kind=sinusoid,cloth")
    code, out, err = call(
        str(scene), *vary, "--run", "counting", "-o", str(tmp_path / "run"),
        "--jobs", "1", width=150,
    )  # fmt: skip
    assert (code, err) == (0, "")
    assert "1 case fails" in out
    assert "cloth.amplitude is unknown" in out
    rows = read_csv(tmp_path / "run" / "table.csv")
    assert [bool(row["error"]) for row in rows] == [False, True]
    code, _, err = call(str(scene), *vary, "--run", "counted")
    assert (code, "run is unknown: 'counted'" in err) == (2, True)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "vary is missing"),
        (["--vary", "texture.period"], "vary must be KEY=VALUES"),
        (["--vary", "texture.period=1mm,2mm"] * 2, "vary names a key twice"),
        (["--vary", "texture.perod=1mm,2mm"], "did you mean 'texture.period'"),
        (["--vary", "texture.period=1mm:4N:3"], "the unit is of another dimension"),
        (["--vary", "texture.period=4mm:1mm:3"], "START must be less than STOP"),
        (["--vary", "texture.period=1mm,2mm", "--run", "limit"], "did you mean 'limits'"),
        (["--vary", "texture.period=1mm,2mm", "--delays", "1"], "delays is unknown"),
        (["--vary", "texture.period=1mm,2mm", "--jobs", "0"], "jobs must be a whole number"),
        (["--vary", "texture.period=1mm,2mm", "--run", "scan"], "needs a section [hand]"),
        (["--vary", "texture.period=1mm,2mm", "-o", "{file}"], "must be a folder that can be"),
        (["--vary", "texture.period=1mm:2mm", "--design", "sobol:7"], "N a power of two"),
    ],
)  # fmt: skip
def test_bad_input_is_one_line(call: Call, tmp_path: Path, options: list[str], words: str) -> None:
    (tmp_path / "file").write_text("")
    used = [option.format(file=tmp_path / "file") for option in options]
    jobs = [] if "--jobs" in used else ["--jobs", "1"]
    code, out, err = call(SURFACE, *used, *jobs)
    assert (code, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1


def test_many_cases_need_yes(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulation_commands, "_MAX_UNASKED_CASES", 5)
    monkeypatch.setattr("asperity.sweeps.run_sweep.estimate_case_time", lambda _plan: 600.0)
    options = ("--laws", "W", "--jobs", "1", "-o", str(tmp_path / "run"))
    code, out, err = call(SURFACE, *VARY, *options)
    assert (code, out) == (2, "")
    words = "vary makes 6 cases, which take about 1:00:00 on 1 processes here; --yes computes them"
    assert words in err
    assert not (tmp_path / "run").exists()
    assert call(SURFACE, *VARY, *options, "--yes")[0] == 0


def test_table_is_read_back(call: Call, tmp_path: Path) -> None:
    options = ("--laws", "WA", "--jobs", "1", "-o", str(tmp_path / "run"))
    code, out, _err = call(SURFACE, *VARY, *options)
    assert code == 0
    path = tmp_path / "run" / "table.csv"
    assert f"Table: {path}" in out
    text = path.read_bytes()
    rows = read_csv(path)
    result = asp.sweep(
        SURFACE, {"texture.period": "1mm:2mm:3log", "device": "touch,omega.3"}, laws="WA",
        processes=1,
    )  # fmt: skip
    assert [*rows[0]] == list(result.columns)
    for row, expected in zip(rows, result.table_rows(), strict=True):
        for name, value in expected.items():
            written = str(value).lower() if isinstance(value, bool) else str(value)
            assert row[name] == (written if value is not None else "")
    shutil.rmtree(tmp_path / "run")
    assert call(SURFACE, *VARY, *options)[0] == 0
    assert path.read_bytes() == text


def test_result_as_xarray() -> None:
    pytest.importorskip("xarray", reason="not run: no xarray here")
    vary = {"texture.period": "1mm:2mm:3log", "device": "touch,omega.3"}
    result = asp.sweep(SURFACE, vary, laws="WA", processes=1)
    data = result.to_xarray()
    assert dict(data.sizes) == {"texture.period [m]": 3, "device.id": 2, "law": 2}
    assert data["recommended stiffness [N/m]"].attrs == {"units": "N/m"}
    row = result.table_rows()[5]
    place = {"texture.period [m]": row["texture.period [m]"], "device.id": "touch", "law": "A"}
    assert (row["law"], row["device.id"]) == ("A", "touch")
    assert float(data["q"].sel(place)) == row["q"]


def test_a_measured_surface_and_a_change_of_its_file(call: Call, tmp_path: Path) -> None:
    land = DATA / "sample-land.x3p"
    if not land.exists():
        pytest.skip(f"not run: no {land.name} here")
    shutil.copy(land, tmp_path / land.name)
    scene, folder = tmp_path / "scene.toml", tmp_path / "run"
    scene.write_text(f'[texture]\nkind = "file"\npath = "{land.name}"\n[surface]\nlaw = "A"\n')
    options = ("--run", "limits", "--jobs", "1", "-o", str(folder))
    vary = ("--vary", "texture.magnify=1,20")
    assert call(str(scene), *vary, *options)[0] == 0
    rows = read_csv(folder / "table.csv")
    direct = asp.limits(asp.load_texture(land, magnify=20), law="A").table_rows()[0]
    assert float(rows[1]["resolved force RMS [N]"]) == direct["resolved force RMS [N]"]
    assert rows[0]["resolved force RMS [N]"] != rows[1]["resolved force RMS [N]"]
    (tmp_path / land.name).write_bytes(land.read_bytes() + b"\0")
    code, _, err = call(str(scene), *vary, *options)
    assert (code, "holds another sweep (other files)" in err) == (2, True)

"""Output, options and errors of ``asperity analyze``."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

Call = Callable[..., tuple[int, str, str]]

SPEC = "sinusoid:amplitude=0.2mm,period=1mm"
DATA = Path(__file__).parents[3] / "shared" / "data"
needs_data = pytest.mark.skipif(
    not DATA.is_dir(), reason="the real surfaces of ../shared/data are not there"
)


COMMAND = "analyze"  # what the fixture "call" runs
WIDTH = 100


def section(out: str, head: str) -> list[str]:
    """Return the lines below a heading, up to the next empty line."""
    lines = out.splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith(head)) + 1
    last = next((i for i in range(first, len(lines)) if not lines[i].strip()), len(lines))
    return lines[first:last]


@pytest.mark.parametrize("width", [80, 100, 120])
@pytest.mark.parametrize("law", ["B", "D", "F"])
def test_output_fits_the_terminal_width(call: Call, width: int, law: str) -> None:
    code, out, err = call(SPEC, "--law", law, "--device", "pantograph", width=width)
    assert (code, err) == (0, "")
    assert max(len(line) for line in out.splitlines()) <= width
    assert "…" not in out


def test_q_has_both_bounds_a_method_and_a_location(call: Call) -> None:
    """For A q is √(1 + (2πA/l)²) = 1.60597, attained where the height is steepest."""
    _code, out, _err = call(SPEC, "--law", "A", "--device", "pantograph")
    row = next(line for line in out.splitlines() if re.match(r"q +\d", line))
    _name, lower, upper, method = row.split()[:4]
    assert float(lower) <= math.hypot(1.0, 0.4 * math.pi) <= float(upper)
    assert float(upper) - float(lower) < 2e-5
    assert method == "closed"
    assert re.search(r"\(-?0\.?5?, 0, .*\) mm", row)


def test_deciding_criterion_is_marked_and_undecided_ones_give_a_reason(call: Call) -> None:
    _code, out, _err = call(SPEC, "--law", "A", "--device", "omega.3")
    marked = [line for line in out.splitlines() if line.startswith("→")]
    assert len(marked) == 1
    assert marked[0].split()[1] == "leak"
    text = " ".join(out.split())
    assert "paper (1) not decidable: needs damping" in text
    assert "not applicable: the law is not conservative" in text
    assert "v* not decidable: needs damping" in text


def test_energy_of_the_worst_loop_has_bounds_for_law_a(call: Call) -> None:
    """W = k D 2A = 1000 · 0.1 mm · 0.4 mm = 40 µJ."""
    _code, out, _err = call(SPEC, "--law", "A", "--max-depth", "0.1mm", "--stiffness", "1000N/m")
    energy = next(line for line in section(out, "Worst loop") if line.startswith("energy"))
    low, high = re.findall(r"[\d.]+", energy)[:2]
    assert float(low) <= 40.0 <= float(high) < 40.1
    assert "µJ per traversal (certified)" in energy


def test_force_jumps_are_listed(call: Call) -> None:
    _code, out, _err = call(SPEC, "--law", "god-object", "--max-depth", "0.4mm")
    rows = [line for line in section(out, "Continuity") if re.match(r" *[\d.]+ µm", line)]
    assert len(rows) == 8
    assert rows[-1].split()[:2] == ["400", "µm"]
    assert "onset" in next(line for line in out.splitlines() if re.match(r"q +∞", line))


def test_json_is_the_only_output_on_stdout(call: Call) -> None:
    code, out, err = call(SPEC, "--law", "D", "--json", "-")
    data = json.loads(out)
    assert (code, err) == (0, "")
    assert (data["schema"], data["law"], data["device"]["id"]) == (4, "D", "omega.3")
    assert data["q"]["upper"] == "inf"


def test_html_is_the_only_output_on_stdout(call: Call) -> None:
    code, out, err = call(SPEC, "--law", "W", "--html", "-")
    assert (code, err) == (0, "")
    assert out.lstrip().lower().startswith("<!doctype html>")
    assert out.rstrip().endswith("</html>")


def test_json_and_html_files_are_complete(call: Call, tmp_path: Path) -> None:
    json_path, html_path = tmp_path / "a.json", tmp_path / "a.html"
    code, out, _err = call(SPEC, "--law", "A", "--json", str(json_path), "--html", str(html_path))
    assert code == 0
    assert json.loads(json_path.read_text("utf-8"))["schema"] == 4
    assert "</html>" in html_path.read_text("utf-8")
    assert html_path.stat().st_size < 3_000_000
    assert str(html_path) in out.replace("\n", "")
    assert sorted(item.name for item in tmp_path.iterdir()) == ["a.html", "a.json"]


def test_options_reach_the_result(call: Call) -> None:
    options = ["--law", "friction-modulation", "--stiffness", "500 N/m", "--max-depth", "0.2mm"]
    options += ["--friction", "0.3", "--max-deflection", "0.5mm", "--modulation-depth", "0.5"]
    _code, out, _err = call(SPEC, *options, "--device", "TOUCH", "--json", "-")
    data = json.loads(out)
    assert (data["law"], data["stiffness"], data["max_depth"]) == ("F", 500.0, 0.0002)
    assert data["law_parameters"] == {
        "friction": 0.3,
        "max_deflection": 0.0005,
        "modulation_depth": 0.5,
    }
    assert data["device"]["id"] == "touch"
    assert not any("Default" in sentence for sentence in data["assumptions"])


@pytest.mark.parametrize(
    ("direction", "expected"),
    [("y", [0, 1]), ("X", [1, 0]), ("0 -3", [0, -1]), ("3,4", [0.6, 0.8])],
)
def test_direction_option_sets_the_direction_of_the_leak(
    call: Call, direction: str, expected: list[float]
) -> None:
    _code, out, _err = call(
        "tile:", "--law", "A", "--direction", direction, "--json", "-", "--tolerance", "0.5"
    )
    line = json.loads(out)["leak"]["line"]
    assert line["direction"] == pytest.approx(expected, abs=1e-12)


def test_tolerance_and_work_limit_set_the_relative_gap_of_q(call: Call, tmp_path: Path) -> None:
    x, y = np.meshgrid(np.arange(20.0), np.arange(16.0))
    np.save(tmp_path / "map.npy", 3e-5 * np.sin(x + 0.4 * y))
    options = [str(tmp_path / "map.npy"), "--pitch", "50um", "--law", "C", "--json", "-"]
    gaps = {}
    for accuracy in (["--tolerance", "1e-5"], ["--tolerance", "0.3"], ["--work-limit", "1"]):
        q = json.loads(call(*options, *accuracy)[1])["q"]
        gaps[accuracy[1]] = q["upper"] / q["lower"] - 1.0
        assert ("work limit" in q["note"]) == (accuracy[0] == "--work-limit")
    assert gaps["1e-5"] <= 1e-5 < gaps["0.3"] <= 0.3


def test_options_override_the_scene_file(call: Call, tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(
        '[texture]\nkind = "sinusoid"\namplitude = "0.1 mm"\nperiod = "1.5 mm"\n'
        '[surface]\nlaw = "G"\nstiffness = "800 N/m"\nmax_depth = "0.5 mm"\nclamp = "whole"\n'
        '[device]\nid = "pantograph"\n'
    )
    data = json.loads(call(str(scene), "--json", "-")[1])
    assert (data["law"], data["stiffness"], data["device"]["id"]) == ("G", 800.0, "pantograph")
    assert data["clamp"] == "whole"
    overrides = ["--law", "A", "--stiffness", "300N/m", "--device", "touch"]
    data = json.loads(call(str(scene), *overrides, "--json", "-")[1])
    assert (data["law"], data["stiffness"], data["device"]["id"]) == ("A", 300.0, "touch")


def test_device_without_data_leaves_criteria_undecided(call: Call, tmp_path: Path) -> None:
    (tmp_path / "bare.toml").write_text('name = "Bare"\nmax_force = "3 N"\n')
    code, out, err = call(SPEC, "--law", "C", "--device", str(tmp_path / "bare.toml"))
    assert (code, err) == (0, "")
    text = " ".join(out.split())
    assert "is not known to be passive: " in text
    assert "not decidable: needs max_stiffness" in text
    assert "not decidable: needs update_rate, damping" in text


@needs_data
@pytest.mark.parametrize("law", ["D", "E"])
def test_measured_surface_is_analyzed(call: Call, law: str) -> None:
    code, out, _err = call(
        str(DATA / "sample-land.x3p"), "--magnify", "20", "--law", law, "--json", "-"
    )
    data = json.loads(out)
    assert code == 0
    assert any("magnified 20" in step for step in data["assumptions"])
    assert bool(data["continuity"]["jumps"]) == (law == "D")
    assert data["one_sided"]["upper"] == pytest.approx(1.0)
    assert (data["leak"]["energy"] > 1e-3) == (law == "E")


BAD = [
    (["none.x3p", "--law", "A"], "none.x3p"),
    (["sinusoid:amplitude=0.8mm", "--law", "A"], "period"),
    (["sinusoid:amplitude=0.8mm,period=1mm,waves=3", "--law", "A"], "waves"),
    (["sinusiod:amplitude=0.8mm,period=1mm", "--law", "A"], "did you mean 'sinusoid'"),
    ([SPEC, "--law", "X"], "law"),
    ([SPEC, "--law", "AB"], "law"),
    ([SPEC, "--law", ""], "law"),
    ([SPEC, "--law", "god-objct"], "did you mean 'god-object'"),
    ([SPEC, "--law", "A", "--max-depth", "0mm"], "max_depth"),
    ([SPEC, "--law", "A", "--max-depth", "-1mm"], "max_depth"),
    ([SPEC, "--law", "A", "--max-depth", "inf"], "max_depth"),
    ([SPEC, "--law", "A", "--max-depth", "1 N"], "max_depth"),
    ([SPEC, "--law", "A", "--stiffness", "0"], "stiffness"),
    ([SPEC, "--law", "F", "--modulation-depth", "2"], "modulation_depth"),
    ([SPEC, "--law", "H", "--continuity", "0"], "continuity"),
    ([SPEC, "--law", "A", "--device", "omga.3"], "did you mean 'omega.3'"),
    ([SPEC, "--law", "A", "--device", "none.toml"], "none.toml"),
    ([SPEC, "--law", "A", "--tolerance", "0"], "tolerance"),
    ([SPEC, "--law", "A", "--tolerance", "1 mm"], "tolerance"),
    ([SPEC, "--law", "A", "--work-limit", "0"], "work_limit"),
    ([SPEC, "--law", "A", "--work-limit", "2.5"], "work_limit"),
    ([SPEC, "--law", "A", "--direction", "up"], "direction"),
    ([SPEC, "--law", "A", "--direction", "0,0"], "direction"),
    ([SPEC, "--law", "A", "--direction", "1,2,3"], "direction"),
    ([SPEC, "--law", "A", "--direction", "1,nan"], "direction"),
    ([SPEC, "--law", "A", "--extent", "1;2;3"], "extent"),
    ([SPEC, "--law", "A", "--extent", "-1mm"], "extent"),
    ([SPEC, "--law", "A", "--outliers", "6"], "outliers"),
    ([SPEC, "--law", "A", "--html", "no/such/folder/r.html"], "html"),
    ([SPEC, "--law", "A", "--json", "-", "--html", "-"], "standard output"),
    ([SPEC, "--law", "A", "--no-such-option"], "--no-such-option"),
]


@pytest.mark.parametrize(("arguments", "message"), BAD, ids=lambda value: str(value)[-40:])
def test_invalid_input_gives_a_one_line_error_and_writes_no_file(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = call(*arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert "Traceback" not in err
    if "--no-such-option" not in arguments:
        assert len(err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_flat_map_is_analyzed_without_nan(call: Call, tmp_path: Path) -> None:
    np.save(tmp_path / "flat.npy", np.full((8, 8), 1e-3))
    options = ["--pitch", "10um", "--form", "0"]
    for law in "ADG":
        code, out, err = call(str(tmp_path / "flat.npy"), *options, "--law", law)
        assert (code, err) == (0, ""), law
        assert "nan" not in out.lower(), law
    code, out, _err = call(str(tmp_path / "flat.npy"), *options, "--law", "A", "--html", "-")
    assert code == 0
    assert "</html>" in out

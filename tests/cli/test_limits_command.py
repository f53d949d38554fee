"""Output, options and errors of ``asperity limits``."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

Call = Callable[..., tuple[int, str, str]]

SPEC = "sinusoid:amplitude=0.1mm,period=1mm"
DATA = Path(__file__).parents[3] / "shared" / "data"
needs_data = pytest.mark.skipif(
    not DATA.is_dir(), reason="the real surfaces of ../shared/data are not there"
)
BENCH = """
name = "Bench"
max_stiffness = "2 N/mm"
position_resolution = "15 um"
force_resolution = "2 mN"
friction = "30 mN"
bandwidth = "400 Hz"
update_rate = "10 kHz"
"""


COMMAND = "limits"  # what the fixture "call" runs
WIDTH = 100


@pytest.fixture
def device_path(tmp_path: Path) -> str:
    (tmp_path / "bench.toml").write_text(BENCH)
    return str(tmp_path / "bench.toml")


def row(out: str, number: int) -> str:
    return next(line for line in out.splitlines() if line.startswith(f"{number} "))


@pytest.mark.parametrize("width", [80, 100, 120])
def test_each_limit_is_one_row_that_starts_with_its_number(call: Call, width: int) -> None:
    code, out, err = call(SPEC, "--device", "pantograph", "--law", "A", width=width)
    assert (code, err) == (0, "")
    assert max(len(line) for line in out.splitlines()) <= width
    assert "…" not in out
    for number in range(1, 7):
        assert row(out, number)
    assert re.search(r"α v T < l +50 µm +1 mm +yes", row(out, 1))
    assert "needs force_resolution" in row(out, 4)
    assert re.search(r"v / l < F₀ +100 Hz +400 Hz +yes", row(out, 6))
    assert "below 0.4 m/s" in row(out, 6)
    assert "Default speed 0.1 m/s" in out
    heading = next(line for line in out.splitlines() if "condition" in line)
    assert (" for " in heading) == ("share of the height variance" in out) == (width >= 96)


def test_options_reach_the_result(call: Call, device_path: str) -> None:
    options = ["--speed", "0.3 m/s", "--law", "groove-wall-normal", "--time-samples", "8"]
    options += ["--position-samples=7", "--force-steps", "6", "--stiffness=400N/m"]
    options += ["--max-depth", "0.3mm"]
    _code, out, _err = call(SPEC, "--device", device_path, *options, "--json", "-")
    data = json.loads(out)
    assert (data["speed"], data["law"], data["stiffness"]) == (0.3, "A", 400.0)
    assert data["max_depth"] == pytest.approx(0.3e-3)
    sides = {limit["number"]: (limit["left"], limit["right"]) for limit in data["limits"]}
    q = math.hypot(1.0, 2 * math.pi * 0.1)
    expected = {
        1: (8 * 0.3 / 1e4, 1e-3),
        2: (7 * 15e-6, 1e-3),
        3: (8 * 15e-6, 1e-3),
        4: (6 * 2e-3, 0.04),
        5: (q * 400.0, 2000.0),
        6: (300.0, 400.0),
    }
    for number, pair in expected.items():
        assert sides[number] == (pytest.approx(pair[0]), pytest.approx(pair[1], rel=1e-6))


def test_limit_that_fails_is_reported_and_not_an_error(call: Call, device_path: str) -> None:
    code, out, _err = call(SPEC, "--device", device_path, "--speed", "0.5m/s", "--law", "A")
    assert code == 0
    assert re.search(r"500 Hz +400 Hz +no", row(out, 6))
    assert "limit 6 (device structure) fails" in " ".join(out.split())
    assert "Below 0.4 m/s they hold" in " ".join(out.split())


def test_law_parameters_reach_the_result(call: Call) -> None:
    options = ["--law", "F", "--friction", "0.3", "--max-deflection", "0.5mm"]
    options += ["--modulation-depth", "0.5", "--stiffness", "600N/m"]
    _code, out, _err = call(SPEC, *options, "--max-depth", "0.2mm", "--json", "-")
    force = json.loads(out)["waves"][0]["force"]
    assert force == pytest.approx(600.0 * 0.2e-3 * 0.3 * 0.5 / 2, rel=1e-6)


def test_json_is_the_only_output_on_stdout(call: Call) -> None:
    code, out, err = call(SPEC, "--json", "-")
    assert (code, err) == (0, "")
    assert json.loads(out)["device"]["id"] == "omega.3"


def test_html_is_the_only_output_on_stdout(call: Call) -> None:
    code, out, err = call(SPEC, "--html", "-")
    assert (code, err) == (0, "")
    assert out.lower().startswith("<!doctype html>")
    assert out.rstrip().endswith("</html>")


def test_json_and_html_files_are_complete(call: Call, tmp_path: Path) -> None:
    json_path, html_path = tmp_path / "a.json", tmp_path / "a.html"
    code, out, _err = call(SPEC, "--json", str(json_path), "--html", str(html_path))
    assert code == 0
    assert json.loads(json_path.read_text("utf-8"))["schema"] == 4
    assert "</html>" in html_path.read_text("utf-8")
    assert html_path.stat().st_size < 500_000
    assert str(html_path) in out.replace("\n", "")
    assert sorted(item.name for item in tmp_path.iterdir()) == ["a.html", "a.json"]


def test_options_override_the_scene_file(call: Call, tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(
        '[texture]\nkind = "sinusoid"\namplitude = "0.1 mm"\nperiod = "1.5 mm"\n'
        '[surface]\nlaw = "G"\nstiffness = "800 N/m"\nmax_depth = "0.5 mm"\n'
        '[device]\nid = "pantograph"\n'
    )
    _code, out, _err = call(str(scene), "--json", "-")
    data = json.loads(out)
    assert (data["law"], data["stiffness"], data["device"]["id"]) == ("G", 800.0, "pantograph")
    options = ["--law", "A", "--stiffness", "300N/m", "--device", "touch"]
    _code, out, _err = call(str(scene), *options, "--json", "-")
    data = json.loads(out)
    assert (data["law"], data["stiffness"], data["device"]["id"]) == ("A", 300.0, "touch")


@needs_data
@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("sample-land.x3p", ["--magnify", "20"]),
        ("dektak-1.csv", ["--magnify", "20", "--magnify-height", "500"]),
    ],
)
def test_measured_surfaces_have_all_limits(
    call: Call, device_path: str, name: str, options: list[str]
) -> None:
    code, out, _err = call(
        str(DATA / name), *options, "--device", device_path, "--law", "A", "--json", "-"
    )
    data = json.loads(out)
    assert code == 0
    assert not data["spectrum"]["exact"]
    assert len(data["waves"]) > 3
    assert all(limit["holds"] is not None for limit in data["limits"])
    assert any("magnified" in words for words in data["assumptions"])


BAD = [
    (["none.x3p"], "none.x3p"),
    (["sinusoid:amplitude=0.8mm"], "period"),
    ([SPEC, "--speed", "0"], "speed"),
    ([SPEC, "--speed", "-1m/s"], "speed"),
    ([SPEC, "--speed", "nan"], "speed"),
    ([SPEC, "--speed", "1 m"], "another dimension"),
    ([SPEC, "--speed", "fast"], "speed"),
    ([SPEC, "--time-samples", "1"], "time_samples must be at least 2"),
    ([SPEC, "--force-steps", "many"], "force_steps"),
    ([SPEC, "--law", "X"], "law"),
    ([SPEC, "--law", "god-objct"], "did you mean 'god-object'"),
    ([SPEC, "--device", "omga.3"], "did you mean 'omega.3'"),
    ([SPEC, "--stiffness", "0"], "stiffness"),
    ([SPEC, "--outliers", "6"], "outliers"),
    ([SPEC, "--html", "no/such/folder/r.html"], "html"),
    ([SPEC, "--json", "-", "--html", "-"], "standard output"),
    ([SPEC, "--no-such-option"], "--no-such-option"),
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


def test_device_value_with_two_units_is_refused(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "wrong.toml"
    path.write_text('[max_stiffness]\nvalue = "5 N/mm"\nunit = "N/m"\n')
    code, out, err = call(SPEC, "--device", str(path))
    assert (code, out) == (2, "")
    assert "device.max_stiffness has its unit twice, in '5 N/mm' and in unit = 'N/m': remove" in err


def test_flat_map_is_reported_as_having_no_texture(call: Call, tmp_path: Path) -> None:
    np.save(tmp_path / "flat.npy", np.full((8, 8), 1e-3))
    code, out, _err = call(
        str(tmp_path / "flat.npy"), "--pitch", "10um", "--form", "0", "--law", "A"
    )
    assert code == 0
    assert "there is no texture to feel" in out

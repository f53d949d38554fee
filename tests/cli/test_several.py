"""``asperity compare`` for several devices and depths: one table, one page, one JSON."""

from __future__ import annotations

import io
import json
import re
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.console import Console

import asperity as asp
from asperity.analysis.results.device_comparisons import compare_devices
from asperity.cli.main import main
from asperity.core.errors import ParameterError
from asperity.core.units import format_quantity
from asperity.report.document.terminal import print_page
from asperity.report.pages.comparison_report import comparisons_page

Call = Callable[..., tuple[int, str, str]]
SPEC = "sinusoid:amplitude=0.2mm,period=2mm"
BARE = 'name = "Bare"\nmax_force = "3 N"\n'


COMMAND = "compare"  # what the fixture "call" runs
WIDTH = 100


def test_devices_and_depths_give_one_table(call: Call) -> None:
    options = ["--device", "touch,inverse3", "--max-depth", "0.1mm; 0.3mm", "--laws", "WC"]
    code, out, err = call(SPEC, *options)
    assert (code, err) == (0, "")
    rows = [line.split("  ") for line in out.splitlines() if re.search(r"\d N/m", line[:60])]
    cells = [[cell.strip() for cell in row if cell.strip()] for row in rows]
    # Cases in which nothing is felt are in brackets.
    assert [[*row[:2], row[2].strip("()")] for row in cells[:4]] == [
        [device, depth, "C"]
        for device in ("3D Systems Touch", "Haply Inverse3")
        for depth in ("100 µm", "300 µm")
    ]
    code, out, err = call(SPEC, *options, "--json", "-")
    assert (code, err) == (0, "")
    result = json.loads(out)
    cases = [(case["device"]["id"], case["max_depth"]) for case in result["comparisons"]]
    assert cases == [("touch", 1e-4), ("touch", 3e-4), ("inverse3", 1e-4), ("inverse3", 3e-4)]
    assert result["missing_data"] == []


def test_each_case_equals_a_comparison_of_its_own(call: Call) -> None:
    several = json.loads(call(SPEC, "--device", "omega.3; touch", "--laws", "WA", "--json", "-")[1])
    for case in several["comparisons"]:
        device = case["device"]["id"]
        single = json.loads(call(SPEC, "--device", device, "--laws", "WA", "--json", "-")[1])
        assert single == case


def test_one_device_and_depth_give_a_single_comparison(call: Call) -> None:
    result = json.loads(call(SPEC, "--max-depth", "0.1mm", "--laws", "W", "--json", "-")[1])
    assert (result["max_depth"], result["device"]["id"]) == (1e-4, "omega.3")


def test_scene_provides_values_that_options_omit(call: Call, tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(
        '[texture]\nkind = "sinusoid"\namplitude = "0.2 mm"\nperiod = "2 mm"\n'
        '[surface]\nmax_depth = "0.2 mm"\n[device]\nid = "touch"\n'
    )
    depths = ["--max-depth", "0.1mm;0.3mm"]
    cases = json.loads(call(str(scene), "--laws", "W", *depths, "--json", "-")[1])["comparisons"]
    assert [(case["device"]["id"], case["max_depth"]) for case in cases] == [
        ("touch", 1e-4),
        ("touch", 3e-4),
    ]
    devices = ["--device", "touch,inverse3"]
    cases = json.loads(call(str(scene), "--laws", "W", *devices, "--json", "-")[1])["comparisons"]
    assert [case["max_depth"] for case in cases] == [2e-4, 2e-4]


def test_set_applies_to_each_device(call: Call) -> None:
    options = ["--device", "touch,inverse3", "--set", "max_stiffness=700N/m", "--laws", "W"]
    cases = json.loads(call(SPEC, *options, "--json", "-")[1])["comparisons"]
    assert [case["device"]["data"]["max_stiffness"]["value"] for case in cases] == [700.0, 700.0]


def test_html_page_has_every_case(call: Call) -> None:
    options = ["--device", "touch,2diy", "--max-depth", "0.1mm;0.2mm", "--laws", "WC"]
    code, page, err = call(SPEC, *options, "--html", "-")
    assert (code, err) == (0, "")
    for words in ("3D Systems Touch, 100 µm deep", "3D Systems Touch, 200 µm deep", "2diy"):
        assert words in page
    assert "add max_stiffness = " in page
    assert len(page) < 3_000_000


def test_device_without_max_stiffness_shows_a_hint(call: Call) -> None:
    code, out, err = call(SPEC, "--device", "touch,2diy", "--laws", "W")
    assert (code, err) == (0, "")
    assert re.search(r"2diy +– +K₀ missing", out)
    text = " ".join(out.split())
    assert 'measure it, and add max_stiffness = "... N/m" to its file' in text
    assert "2diy can be compared with --set max_stiffness=...N/m" in text
    code, _out, err = call(SPEC, "--device", "2diy", "--laws", "W")
    assert (code, err.count("\n")) == (2, 1)
    assert "to its file; 2diy can be compared with --set max_stiffness=...N/m" in err


def test_error_when_no_device_has_max_stiffness(call: Call, tmp_path: Path) -> None:
    """The table shows the missing data, and the exit code is 2."""
    for name in ("a", "b"):
        (tmp_path / f"{name}.toml").write_text(BARE)
    both = f"{tmp_path / 'a.toml'},{tmp_path / 'b.toml'}"
    code, out, err = call(SPEC, "--device", both)
    assert (code, err.count("\n")) == (2, 1)
    assert out.count("K₀ missing") == 2
    assert (
        'a: the stiffest smooth wall that held is unknown; measure it, and add max_stiffness = "'
        in err
    )
    code, out, err = call(SPEC, "--device", str(tmp_path / "a.toml"))
    assert (code, out, err.count("\n")) == (2, "", 1)
    code, out, _err = call(SPEC, "--device", both, "--json", "-")
    assert code == 2
    assert [item["device"] for item in json.loads(out)["missing_data"]] == ["a", "b"]


def test_hint_completes_the_device_file(tmp_path: Path) -> None:
    texture = asp.Sinusoid(2e-4, 2e-3)
    path = tmp_path / "bare.toml"
    path.write_text(BARE)
    (missing,) = compare_devices(texture, [path], laws="W").missing_data
    path.write_text(BARE + missing.hint.replace("...", "900") + "\n")
    result = compare_devices(texture, [path], laws="W")
    assert result.missing_data == ()
    assert result.comparisons[0].device.max_stiffness == 900.0


def test_device_path_may_contain_a_comma(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "mine, old.toml"
    path.write_text(BARE + 'max_stiffness = "900 N/m"\n')
    code, out, _err = call(SPEC, "--device", str(path), "--laws", "W", "--json", "-")
    assert (code, json.loads(out)["device"]["name"]) == (0, "Bare")


WRONG = [
    (["--device", "touch,tuch"], "did you mean 'touch'"),
    (["--device", "touch,Touch"], "device names one device twice"),
    (["--device", ","], "device is unknown"),
    (["--device", "a" * 5000], "device is unknown"),
    (["--device", "touch", "--device", "inverse3"], "device is given twice"),
    (["--max-depth", "0.1mm; 0.5"], "max_depth needs a unit: write 0.5mm"),
    (["--max-depth", "0.1mm; -1mm"], "max_depth must be positive"),
    (["--max-depth", ";"], "max_depth must be"),
    (["--max-depth", "0.1mm; 100um"], "max_depth contains a depth twice"),
]


@pytest.mark.parametrize(("options", "message"), WRONG, ids=lambda value: " ".join(value)[:40])
def test_invalid_input_gives_a_one_line_error(call: Call, options: list[str], message: str) -> None:
    code, out, err = call(SPEC, *options, "--laws", "W")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err


def test_other_commands_refuse_several_devices(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["asperity", "limits", SPEC, "--device", "touch,inverse3"])
    with pytest.raises(SystemExit, match="2"):
        main()
    assert "device must be a single device: only compare takes several" in capsys.readouterr().err


@pytest.mark.parametrize("width", [40, 60, 200])
def test_narrow_table_drops_columns_and_truncates_nothing(width: int) -> None:
    result = compare_devices(asp.Sinusoid(2e-4, 2e-3), ["touch", "2diy"], [1e-4, 2e-4], "WC")
    stream = io.StringIO()
    print_page(comparisons_page(result), Console(file=stream, width=width, highlight=False))
    output = stream.getvalue()
    assert "…" not in output
    assert max(map(len, output.splitlines())) <= width
    headings = next(line for line in output.splitlines() if re.match(" *device  ", line))
    assert ("texture" in headings) == (width > 60)
    assert re.search(r"3D Systems( Touch)? +200 µm +\(?C", output)


def test_recommendation_names_the_best_case_and_counts_the_others() -> None:
    coarse, fine = asp.Sinusoid(2e-4, 2e-3), asp.Sinusoid(1e-9, 2e-3)
    result = compare_devices(coarse, ["touch", "omega.3", "2diy"], [1e-4, 4e-4], "WC")
    recommended = [case for case in result.comparisons if case.recommended]
    best = max(recommended, key=lambda case: case.recommended_row.resolved_force)
    stiffness = format_quantity(best.recommended_row.recommended_stiffness, "N/m")
    assert best.max_depth == 4e-4
    assert result.recommendation.startswith(
        f"Best on the Force Dimension omega.3, pressed to 400 µm: law C from {stiffness}, felt, "
    )
    assert result.recommendation.endswith(
        "Of 4 cases: felt in 4. No smooth wall is known to have held on 2diy."
    )
    assert result.to_dict()["recommendation"] == result.recommendation
    (none,) = compare_devices(fine, ["touch"], laws="C").comparisons
    assert not none.recommended
    assert compare_devices(fine, ["touch"], laws="C").recommendation == "Of 1 case: not felt in 1."
    assert compare_devices(fine, ["2diy"], laws="C").recommendation.startswith("No smooth wall")


def test_empty_list_of_devices_is_an_error() -> None:
    with pytest.raises(ParameterError, match="device must be one or several"):
        compare_devices(asp.Sinusoid(2e-4, 2e-3), [])

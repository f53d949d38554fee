"""``asperity show``: the table, the JSON and the page of a measured surface."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.report.report_pages import check_alone, check_alts

import asperity as asp
from asperity.report import html_text
from asperity.report.pages.measured_report import measured_sections

Call = Callable[..., tuple[int, str, str]]
PLAIN = ["--pitch", "2um", "--unit", "m"]


WIDTH = 120


@pytest.fixture
def source(tmp_path: Path) -> str:
    y, x = np.mgrid[:80, :100] * 2e-6
    heights = (
        3e-6 * np.sin(2 * np.pi * x / 20e-6) + 1e-6 * np.cos(2 * np.pi * y / 100e-6) + 0.02 * x
    )
    heights[10:13, 20:24] = np.nan
    np.save(tmp_path / "map.npy", heights)
    return str(tmp_path / "map.npy")


def first_table(out: str) -> list[list[str]]:
    """Return the cells of the first table, which are separated by two blanks, row by row."""
    lines = out.splitlines()
    rule = next(i for i, line in enumerate(lines) if set(line.strip()) == {"─"})
    rows = []
    for line in lines[rule + 1 :]:
        if not line.strip():
            break
        rows.append(re.split(r"\s{2,}", line.strip()))
    return rows


def test_surface_parameters_are_listed_after_each_step(call: Call, source: str) -> None:
    code, out, err = call("show", source, *PLAIN, "--l-cutoff", "80um")
    assert (code, err) == (0, "")
    rows = first_table(out)
    assert [row[0] for row in rows] == [
        "as read",
        "levelled",
        "holes filled",
        "S-filter 8 µm",
        "L-filter 80 µm",
    ]
    assert all(len(row) == 12 for row in rows)
    assert re.search(r"^Sdr\s+developed interfacial area ratio", out, re.MULTILINE)
    assert re.search(r"Sal \d.* µm \(autocorrelation length\)", out)
    assert out.startswith(
        f"Roughness Sq of {float(rows[-1][1]):g} µm RMS: the waves shorter than 80 µm"
    )
    assert "Form, waviness" not in out
    assert "pitch 2 µm as given" in out
    heights = np.load(source)
    sq = float(rows[0][1])
    assert sq == pytest.approx(np.nanstd(heights) * 1e6, rel=5e-3)


@pytest.mark.parametrize("width", [30, 40, 60, 80, 200])
def test_narrow_table_drops_columns_and_truncates_no_number(
    call: Call, source: str, width: int
) -> None:
    code, out, _ = call("show", source, *PLAIN, "--l-cutoff", "80um", width=width)
    assert code == 0
    assert "…" not in out
    assert max(len(line) for line in out.splitlines()) <= width
    wide = {
        row[0]: row[1:]
        for row in first_table(call("show", source, *PLAIN, "--l-cutoff", "80um")[1])
    }
    for row in first_table(out):
        assert set(row[1:]) <= set(wide[row[0]])
    assert ("More in a wider terminal" in out) == (width < 100)


def test_json_has_stages_and_parts(call: Call, source: str) -> None:
    code, out, _ = call("show", source, *PLAIN, "--json", "-")
    assert code == 0
    data = json.loads(out)
    assert data["source"] == "map.npy"
    assert [stage["name"] for stage in data["stages"]][:2] == ["as read", "levelled"]
    assert data["stages"][1]["removed"]["range"] == pytest.approx(0.02 * 99 * 2e-6, rel=0.2)
    assert set(data["stages"][0]["values"]) >= {"Sq", "Sa", "Sdr"}
    # 3 µm waves 20 µm long on a map 158 µm wide: texture for L = 80 µm.
    assert data["parts"]["nesting"] == 80e-6
    assert data["parts"]["texture"]["rms"] == pytest.approx(3e-6 / np.sqrt(2), rel=0.2)
    assert data["Sal"] < 20e-6


def test_html_page_shows_each_step_and_what_it_removed(
    call: Call, source: str, tmp_path: Path
) -> None:
    page = tmp_path / "page.html"
    code, out, err = call("show", source, *PLAIN, "--l-cutoff", "80um", "--html", str(page))
    assert (code, err) == (0, "")
    assert f"Report: {page}" in out.replace("\n", "")
    text = page.read_text(encoding="utf-8")
    for words in (
        "After each step",
        "Levelled",
        "S-filter 8 µm",
        "L-filter 80 µm",
        "autocorrelation length",
        "ISO 25178-2:2021, 4.4.3",
        "what the step removed",
    ):
        assert words in text
    assert text.count("<svg") == 3
    check_alts(check_alone(text), text)


def test_profile_and_prepared_file_are_shown(call: Call, tmp_path: Path) -> None:
    x = np.arange(600) * 1e-6
    np.save(tmp_path / "line.npy", 1e-6 * np.sin(2 * np.pi * x / 50e-6))
    prepared = str(tmp_path / "line.npz")
    line = str(tmp_path / "line.npy")
    code, out, _ = call("show", line, "--pitch", "1um", "--unit", "m", "--l-cutoff", "100um")
    assert code == 0
    assert "P/RSm" in out
    assert "Sal" not in out
    assert call("prepare", line, "--pitch", "1um", "--unit", "m", "-o", prepared)[0] == 0
    page = tmp_path / "page.html"
    code, prepared_out, _ = call("show", prepared, "--html", str(page))
    assert code == 0
    assert [row[0] for row in first_table(prepared_out)] == ["as read", "levelled", "S-filter 4 µm"]
    assert page.read_text(encoding="utf-8").count("<svg") == 1


def test_prepare_prints_the_same_table_and_json(call: Call, source: str, tmp_path: Path) -> None:
    target = str(tmp_path / "ready.npz")
    code, out, _ = call("prepare", source, *PLAIN, "-o", target)
    assert code == 0
    assert [row[0] for row in first_table(out)] == [
        "as read",
        "levelled",
        "holes filled",
        "S-filter 8 µm",
    ]
    code, out, _ = call("prepare", source, *PLAIN, "-o", target, "--json", "-", "--force")
    assert json.loads(out)["stages"][0]["name"] == "as read"
    code, _, err = call("prepare", source, *PLAIN, "-o", target, "--json", target, "--force")
    assert code == 2
    assert "json must be another file than" in err
    before = Path(target).read_bytes()
    code, _, err = call("prepare", source, "-o", target)
    assert (code, "output exists" in err, Path(target).read_bytes() == before) == (2, True, True)


def test_texture_specification_is_refused(call: Call) -> None:
    code, out, err = call("show", "sinusoid:amplitude=1mm,period=2mm")
    assert (code, out) == (2, "")
    assert len(err.strip().splitlines()) == 1


def test_comparison_reports_of_measured_surfaces_have_the_section(source: str) -> None:
    texture = asp.load_texture(source, pitch=2e-6, unit="m", magnify=20)
    (section,) = measured_sections(texture)
    table = section.blocks[0]
    assert [row.cells[0].text for row in table.rows][-1] == "magnified"  # type: ignore[union-attr]  # a table of cells
    assert measured_sections(asp.Sinusoid(1e-4, 1e-3)) == []
    text = html_text(asp.compare(texture, laws="W"))
    assert "Surface parameters" in text


@pytest.mark.parametrize("command", [["show"], ["prepare", "-o", "surface.npz"]])
def test_surface_of_the_catalogue_is_refused_where_a_file_is_expected(
    call: Call, command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = call(command[0], "cloth", *command[1:])
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "must be a measured file" in err
    assert "asperity surfaces cloth" in err


def test_folder_hides_no_surface_of_the_catalogue(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "knurl").mkdir()
    code, out, _err = call("limits", "knurl", "--law", "W", "--json", "-")
    assert code == 0
    assert '"knurl"' in out


def test_headline_follows_the_requested_filter(call: Call, source: str) -> None:
    assert call("show", source, *PLAIN)[1].startswith("Texture of ")
    long = call("show", source, *PLAIN, "--l-cutoff", "0.16mm")[1]
    assert "ISO 25178-3 takes at least 160 µm" in " ".join(long.split("\n\n")[0].split())
    out = call("show", source, *PLAIN, "--l-cutoff", "80um", "--json", "-")[1]
    assert json.loads(out)["parts"] is None


def test_cutoff_alone_asks_which(call: Call, source: str) -> None:
    code, out, err = call("show", source, "--cutoff", "0.8mm")
    assert (code, out) == (2, "")
    assert "did you mean '--s-cutoff' or '--l-cutoff'?" in err


def test_output_is_not_written_over_the_file_that_is_read(
    call: Call, source: str, tmp_path: Path
) -> None:
    before = Path(source).read_bytes()
    link = tmp_path / "link.html"
    link.symlink_to(source)
    plate = tmp_path / "mine.toml"
    plate.write_text('id = "mine"\nmax_stiffness = "1 kN/m"\n')
    for arguments, name in (
        (("show", source, *PLAIN, "--json", source), "json must be another file"),
        (("show", source, *PLAIN, "--html", link), "html must be another file"),
        (
            ("compare", "knurl", "--laws", "W", "--device", plate, "--json", plate),
            "json must be another file",
        ),
    ):
        code, out, err = call(*map(str, arguments), "--force")
        assert (code, out) == (2, "")
        assert name in err
    assert Path(source).read_bytes() == before
    assert plate.read_text().startswith('id = "mine"')


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names of files are text")
def test_name_that_is_not_unicode_is_written_with_question_marks(
    call: Call, source: str, tmp_path: Path
) -> None:
    name = os.fsdecode(os.fsencode(tmp_path) + b"/b\xff.npy")
    Path(source).rename(name)
    page, data = tmp_path / "b.html", tmp_path / "b.json"
    code, _, err = call("show", name, *PLAIN, "--html", str(page), "--json", str(data))
    assert (code, err) == (0, "")
    assert "b?.npy" in page.read_text("utf-8")
    assert json.loads(data.read_text("utf-8"))["stages"]

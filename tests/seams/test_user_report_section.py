"""A user-defined section on the page of a result, through the public interface only."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import asperity as asp
from asperity.cli.main import main
from asperity.report import add_section, html_text
from asperity.report.document import page
from asperity.report.document.page import Cell, Row, Section, Table


def paint_section(comparison: asp.Comparison) -> Section | None:
    """Return a section with the thickness of a coat of paint; none for an almost flat surface."""
    height = comparison.texture.peak_to_valley
    if height < 1e-5:
        return None
    rows = [Row([Cell(row.law.letter, "l"), f"{1e3 * height:.3g} mm"]) for row in comparison.rows]
    return Section("Paint", [Table(("law", "thickness"), rows)], caption="One coat.")


@pytest.fixture(autouse=True)
def _register_section(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "_USER_SECTIONS", {})
    add_section(asp.Comparison, paint_section)


def test_section_is_on_the_page_of_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "report.html"
    arguments = ["compare", "sinusoid:amplitude=0.1mm,period=1mm", "--laws", "WC"]
    monkeypatch.setattr("sys.argv", ["asperity", *arguments, "--html", str(path)])
    main()
    text = path.read_text("utf-8")
    assert text.count("<h2>Paint</h2>") == 1
    assert text.count("<td>0.2 mm</td>") == 2
    assert text.index("Strength and support") < text.index("Paint") < text.index("<h2>Assumptions")


def test_section_may_be_none() -> None:
    text = html_text(asp.compare(asp.Sinusoid(1e-6, 1e-3), laws="W"))
    assert "Paint" not in text


def test_section_is_added_once_and_only_to_its_result() -> None:
    add_section(asp.Comparison, paint_section)
    text = html_text(asp.compare(asp.Sinusoid(1e-4, 1e-3), laws="W"))
    assert text.count("<h2>Paint</h2>") == 1
    other = html_text(asp.analyze(asp.Surface(asp.Sinusoid(1e-4, 1e-3), "W")))
    assert "Paint" not in other


def test_documented_example_as_a_plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (Path(__file__).parents[2] / "docs/howto/reports.md").read_text("utf-8")
    code = re.search(r"```python\n(.*?)```", text[text.index("## Add a section") :], re.DOTALL)
    command = re.search(r"`asperity (compare knurl .*?)`", text)
    assert code is not None
    assert command is not None
    monkeypatch.setattr(page, "_USER_SECTIONS", {})
    monkeypatch.chdir(tmp_path)
    Path("paint.py").write_text(code[1])
    monkeypatch.setattr("sys.argv", ["asperity", *command[1].split(), "--laws", "W"])
    main()
    assert Path("report.html").read_text("utf-8").count("<h2>Paint</h2>") == 1
    assert page._USER_SECTIONS == {}  # registered until the command ends

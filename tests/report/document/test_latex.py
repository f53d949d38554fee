"""A comparison as LaTeX: what a document needs to read it, and what it says."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

import asperity as asp
from asperity.devices import parse_device
from asperity.report.document.latex import escape_latex

HOSTILE = r"50 % of {a}_b & #1 $x$ ~ \input{secret} ^ <q⁺> ∞ 日本 é"


@pytest.fixture(scope="module")
def result() -> asp.Comparison:
    device = parse_device({"name": HOSTILE, "max_stiffness": "900 N/m"}, "mine")
    return asp.compare(asp.Sinusoid(0.2e-3, 2e-3), device, "WAC")


def test_every_special_character_is_escaped() -> None:
    text = escape_latex(HOSTILE)
    plain = re.sub(r"\$[^$]*\$|\\(textbackslash|textasciicircum)\{\}|\\[&%$#_{}]", "", text)
    assert not set(plain) & set("\\{}$&#^_~%<>")
    assert "é" in plain
    assert "日" not in plain
    assert all(character.isascii() or character == "é" for character in text)


def test_tables_and_paragraph_are_complete(result: asp.Comparison) -> None:
    """Environments and groups are closed; each row has a cell for each column."""
    text = result.to_latex()
    assert re.findall(r"\\begin\{(\w+)\}", text) == ["table", "tabular"]
    assert re.findall(r"\\end\{(\w+)\}", text) == ["tabular", "table"]
    groups = re.sub(r"\\[{}]", "", text)
    assert groups.count("{") == groups.count("}")
    columns = re.search(r"\\begin\{tabular\}\{([lr]+)\}", text)
    assert columns is not None
    rows = [line for line in text.splitlines() if line.endswith(r"\\")]
    assert len(rows) == 1 + len(result.rows)
    assert {len(re.findall(r"(?<!\\)&", row)) for row in rows} == {len(columns[1]) - 1}
    paragraph = text.split("\n\n")[0]
    best = result.recommended_row
    assert best is not None
    for words in (
        f"asperity {asp.__version__}",
        "Campion and Hayward, 2008",
        "sinusoid: amplitude 200",
        f"Law {best.law.letter} (",
        f"at {best.surface.stiffness:g} N/m",
        "Assumptions: ",
    ):
        assert words in paragraph
    assert "for law A" not in paragraph  # which was not chosen


def test_a_document_with_it_compiles(result: asp.Comparison, tmp_path: Path) -> None:
    program = shutil.which("pdflatex")
    if program is None:
        pytest.skip("not run: no pdflatex here")
    (tmp_path / "table.tex").write_text(result.to_latex(), encoding="utf-8")
    document = "\\documentclass{article}\\begin{document}\\input{table}\\end{document}\n"
    (tmp_path / "paper.tex").write_text(document, encoding="utf-8")
    command = [program, "-interaction=nonstopmode", "-halt-on-error", "paper.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout

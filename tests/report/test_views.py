"""The display methods of results that notebooks and Rich call."""

from __future__ import annotations

import copy
import html
import io
import pickle
import re
import subprocess
import sys
import tempfile
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from rich.console import Console

import asperity as asp
from asperity import report
from asperity.analysis.results.device_comparisons import compare_devices
from asperity.core.display import Displayable, Plottable, Reportable
from asperity.devices import parse_device
from asperity.measured.reading.measured_file import MeasurementSummary, show
from asperity.paper.table_two import TableTwo
from asperity.report import find_page
from asperity.report.document.terminal import print_page
from asperity.simulation import Cartesian, Run, Servo, SpringHand, Stationary, simulate

WAVE = asp.Sinusoid(2e-4, 2e-3)
HOSTILE = "<script>alert(1)</script>"
VOID = {"br", "img", "meta", "hr", "line", "link", "input"}


def run(trace: bool | Path = True) -> Run:
    hand = SpringHand(stiffness=200.0, damping=2.0)
    still, servo = Stationary((0.0, 0.0, -1e-3)), Servo(1e-3)
    return simulate(asp.Surface(WAVE, "C"), Cartesian(0.05), hand, servo, still, 0.1, trace=trace)


def make_file_summary() -> MeasurementSummary:
    x = np.arange(200) * 1e-5
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "ridge.txt")
        np.savetxt(path, np.column_stack([x, 1e-6 * np.sin(9e3 * x)]), header="x [m] z [m]")
        return show(path)


def make_recording() -> Path:
    path = Path(tempfile.mkdtemp(), "run.mcap")
    run(trace=path)
    return path


FACTORIES: dict[str, Any] = {
    "texture": lambda: WAVE,
    "map": lambda: asp.named_surface("tile"),
    "surface": lambda: asp.Surface(WAVE, "F"),
    "comparison": lambda: asp.compare(WAVE, laws="WC"),
    "several": lambda: compare_devices(WAVE, ["omega.3", "2diy"], laws="W"),
    "analysis": lambda: asp.analyze(asp.Surface(WAVE, "B")),
    "limits": lambda: asp.limits(WAVE, law="C"),
    "bound": lambda: result("analysis").q,
    "passivity": lambda: result("analysis").passivity,
    "device": lambda: asp.load_device("touch"),
    "run": run,
    "run without a trace": lambda: run(trace=False),
    "recording": lambda: asp.open_recording(make_recording()),
    "replay": lambda: asp.replay(result("recording")),
    "file": make_file_summary,
    "table": lambda: TableTwo((), "nothing"),
}
WITH_PICTURE = {"texture", "map", "surface", "comparison", "analysis", "limits", "run", "recording"}
WITH_REPORT = {"comparison", "several", "analysis", "limits", "file"}


@cache
def result(name: str) -> Any:
    return FACTORIES[name]()


class Tags(HTMLParser):
    """Collects tags and asserts that each non-void tag is closed in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: set[str] = set()
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        del attrs
        self.seen.add(tag)
        self.open += [] if tag in VOID else [tag]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


# --- notebooks ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", FACTORIES)
def test_notebook_view_is_well_formed_and_self_contained(name: str) -> None:
    text = result(name)._repr_html_()
    tags = Tags(text)
    assert tags.open == []
    assert tags.seen <= {"div", "p", "strong", "small", "img", "br"} | {
        "table",
        "thead",
        "tbody",
        "tr",
        "th",
        "td",
    }
    assert ("img" in tags.seen) == (name in WITH_PICTURE)
    assert 60 < len(text) < 400_000
    assert "http" not in re.sub(r'base64,[^"]+', "", text)


def test_tag_parser_detects_unclosed_tags() -> None:
    with pytest.raises(AssertionError):
        Tags("<div><p></div>")


def test_notebook_view_has_the_answer_of_the_report() -> None:
    comparison = result("comparison")
    text = comparison._repr_html_()
    assert f"<strong>{comparison.recommendation[:40]}" in text
    assert text.count("<tr") == 1 + 2 * len(comparison.rows)
    assert text.count('<tr style="font-weight: bold"') == 2  # of the table, and of the verdicts
    assert "closed form" in result("bound")._repr_html_()
    assert "law F, friction modulation, at 1000 N/m" in result("surface")._repr_html_()


def test_foreign_texts_are_escaped() -> None:
    device = parse_device({"name": HOSTILE, "notes": [HOSTILE], "max_stiffness": 1000.0}, "mine")
    for value in (asp.compare(WAVE, device, "C"), device):
        text = value._repr_html_()
        assert HOSTILE not in text
        assert "&lt;script&gt;" in text


def test_failing_picture_falls_back_to_the_repr(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing_plot(_result: Any) -> str:
        raise RuntimeError("no fonts")

    monkeypatch.setattr("asperity.report.pictures.plotting.plot", failing_plot)
    assert result("limits")._repr_html_() is None
    assert result("bound")._repr_html_() is not None  # has no picture, so the plot does not matter
    assert Displayable()._repr_html_() is None


def test_notebook_pictures_ignore_and_keep_rc_settings() -> None:
    expected = WAVE._repr_html_()
    with mpl.rc_context({"lines.linewidth": 9.0, "font.size": 30.0, "font.family": "serif"}):
        before = dict(mpl.rcParams)
        assert WAVE._repr_html_() == expected
        assert dict(mpl.rcParams) == before
        user_figure = WAVE.plot()._repr_png_()
    assert user_figure != WAVE.plot()._repr_png_()  # figures of ``plot`` use the user's settings


def test_matplotlib_is_imported_lazily_and_without_pyplot() -> None:
    code = """
import sys, asperity as asp
wave = asp.Sinusoid(2e-4, 2e-3)
repr(wave), wave.describe()
assert "matplotlib" not in sys.modules and "jinja2" not in sys.modules
assert "<img" in wave._repr_html_() and wave.plot()._repr_png_().startswith(b"\\x89PNG")
assert "matplotlib" in sys.modules and "matplotlib.pyplot" not in sys.modules
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_views_in_an_ipython_session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))  # folder of the history
    shell = pytest.importorskip("IPython.core.interactiveshell", reason="not run: no IPython here")
    session = shell.InteractiveShell.instance()
    try:
        session.run_cell("import asperity as asp")
        execution = session.run_cell(
            'asp.compare("sinusoid:amplitude=0.2mm,period=2mm", laws="WC")'
        )
        formats, _metadata = session.display_formatter.format(execution.result)
        assert formats["text/html"].startswith("<div>")
        assert formats["text/plain"].startswith("<Comparison of 2 laws")
        figure, _metadata = session.display_formatter.format(execution.result.plot())
        assert figure["image/png"]
    finally:
        shell.InteractiveShell.clear_instance()


# --- figures and pages ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(WITH_PICTURE))
def test_plot_method_returns_the_picture_of_the_report(name: str) -> None:
    value = result(name)
    assert isinstance(value, Plottable)
    figure = value.plot()
    assert isinstance(figure, Figure)
    assert [axes.get_title() for axes in figure.axes] == [
        axes.get_title() for axes in report.plot(value).axes
    ]
    assert figure._repr_png_().startswith(b"\x89PNG")
    with pytest.raises(asp.ParameterError, match="picture must be"):
        value.plot("nonsense")


def test_view_of_several_devices_begins_with_the_recommendation() -> None:
    text = html.unescape(result("several")._repr_html_())
    assert text.index(result("several").recommendation) < text.index("<table")
    assert result("several").missing_data[0].sentence in text


def test_plot_selects_one_picture_by_name() -> None:
    assert len(result("comparison").plot("merit").axes) == 1
    assert len(result("comparison").plot().axes) > 1


def test_plot_of_a_run_without_trace_is_an_error() -> None:
    with pytest.raises(asp.ParameterError, match="trace must be kept in memory"):
        result("run without a trace").plot()


@pytest.mark.parametrize("name", sorted(WITH_REPORT))
def test_to_html_returns_or_writes_the_report(name: str, tmp_path: Path) -> None:
    value = result(name)
    assert isinstance(value, Reportable)
    path = tmp_path / "report.html"
    assert value.to_html(path) is None
    text = path.read_text(encoding="utf-8")
    assert text.lstrip().startswith("<!DOCTYPE html>")
    assert text == (value.to_html() if name == "limits" else report.html_text(value))


def test_to_html_reports_an_unwritable_path(tmp_path: Path) -> None:
    with pytest.raises(asp.ParameterError, match=r"path cannot be written: .*got .*nowhere"):
        result("several").to_html(tmp_path / "nowhere" / "report.html")
    assert not hasattr(result("bound"), "to_html")


# --- Rich -----------------------------------------------------------------------------------------


def on_console(width: int, print_to: Any) -> str:
    console = Console(width=width, record=True, file=io.StringIO(), highlight=False)
    print_to(console)
    return console.export_text()


@pytest.mark.parametrize("name", sorted(WITH_REPORT))
@pytest.mark.parametrize("width", [50, 100, 160])
def test_rich_prints_the_report_of_the_command_line(name: str, width: int) -> None:
    value = result(name)
    text = on_console(width, lambda console: console.print(value))
    expected = on_console(width, lambda console: print_page(find_page(value), console))
    assert text.split() == expected.split()
    assert len(text.splitlines()) > 4
    assert max(len(line.rstrip()) for line in text.splitlines()) <= width
    if name != "analysis":  # its code lines are wider than the terminal
        lines = zip(text.splitlines(), expected.splitlines(), strict=True)
        assert all(line.rstrip() == other.rstrip() for line, other in lines)


def test_rich_prints_other_results_as_their_repr() -> None:
    text = on_console(100, lambda console: console.print(WAVE))
    assert text.strip() == repr(WAVE)


# --- value semantics ------------------------------------------------------------------------------


def test_display_mixins_keep_equality_hash_copy_and_pickle() -> None:
    bound, device = result("bound"), result("device")
    assert pickle.loads(pickle.dumps(bound)) == bound
    assert hash(copy.deepcopy(bound)) == hash(bound)
    assert copy.copy(device) == device == pickle.loads(pickle.dumps(device))
    assert bound != result("analysis").one_sided
    assert asp.Surface(WAVE, "C") != asp.Surface(WAVE, "C")  # surfaces compare by identity
    new = asp.Sinusoid(2e-4, 2e-3)
    assert pickle.loads(pickle.dumps(new)).describe() == WAVE.describe()
    assert not vars(Displayable()) | vars(Plottable()) | vars(Reportable())

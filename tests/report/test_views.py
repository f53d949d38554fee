"""What notebooks and Rich show of results, by the methods that they call."""

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
from asperity.analysis.compare import compare_devices
from asperity.core.display import Displayable, Plottable, Reportable
from asperity.devices import parse_device
from asperity.paper.table_two import TableTwo
from asperity.report.terminal import print_page
from asperity.report.views import find_page
from asperity.simulation import Cartesian, Run, Servo, SpringHand, Stationary, simulate
from asperity.textures.texture_loading import MeasurementSummary, summarize_file

WAVE = asp.Sinusoid(2e-4, 2e-3)
HOSTILE = "<script>alert(1)</script>"
VOID = {"br", "img", "meta", "hr", "line", "link", "input"}


def run(trace: bool | Path = True) -> Run:
    hand = SpringHand(stiffness=200.0, damping=2.0)
    still, servo = Stationary((0.0, 0.0, -1e-3)), Servo(1e-3)
    return simulate(asp.Surface(WAVE, "C"), Cartesian(0.05), hand, servo, still, 0.1, trace=trace)


def shown_file() -> MeasurementSummary:
    x = np.arange(200) * 1e-5
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "ridge.txt")
        np.savetxt(path, np.column_stack([x, 1e-6 * np.sin(9e3 * x)]), header="x [m] z [m]")
        return summarize_file(path)


def recorded() -> Path:
    path = Path(tempfile.mkdtemp(), "run.mcap")
    run(trace=path)
    return path


MAKERS: dict[str, Any] = {
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
    "recording": lambda: asp.open_recording(recorded()),
    "replay": lambda: asp.replay(result("recording")),
    "file": shown_file,
    "table": lambda: TableTwo((), "nothing"),
}
PICTURED = {"texture", "map", "surface", "comparison", "analysis", "limits", "run", "recording"}
REPORTED = {"comparison", "several", "analysis", "limits", "file"}


@cache
def result(name: str) -> Any:
    return MAKERS[name]()


class Tags(HTMLParser):
    """Every tag that is opened and, unless it is void, closed again."""

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


@pytest.mark.parametrize("name", MAKERS)
def test_a_notebook_shows_words_tables_and_a_picture(name: str) -> None:
    text = result(name)._repr_html_()
    tags = Tags(text)
    assert tags.open == []
    assert tags.seen <= {"div", "p", "strong", "small", "img", "br"} | {
        "table", "thead", "tbody", "tr", "th", "td",
    }  # fmt: skip
    assert ("img" in tags.seen) == (name in PICTURED)
    assert 60 < len(text) < 400_000
    assert "http" not in re.sub(r'base64,[^"]+', "", text)


def test_tags_that_are_not_closed_are_noticed() -> None:
    with pytest.raises(AssertionError):
        Tags("<div><p></div>")


def test_the_answer_is_that_of_the_command_line() -> None:
    found = result("comparison")
    text = found._repr_html_()
    assert f"<strong>{found.recommendation[:40]}" in text
    assert text.count("<tr") == 1 + len(found.rows)
    assert text.count('<tr style="font-weight: bold"') == 1
    assert "closed form" in result("bound")._repr_html_()
    assert "law F, friction modulation, at 1000 N/m" in result("surface")._repr_html_()


def test_words_of_others_are_escaped() -> None:
    device = parse_device({"name": HOSTILE, "notes": [HOSTILE], "max_stiffness": 1000.0}, "mine")
    for shown in (asp.compare(WAVE, device, "C"), device):
        text = shown._repr_html_()
        assert HOSTILE not in text
        assert "&lt;script&gt;" in text


def test_what_cannot_be_shown_is_its_repr(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(_result: Any) -> str:
        raise RuntimeError("no fonts")

    monkeypatch.setattr("asperity.report.pictures.plotting.plot", fails)
    assert result("limits")._repr_html_() is None
    assert result("bound")._repr_html_() is not None  # it has no picture
    assert Displayable()._repr_html_() is None


def test_pictures_look_alike_whatever_the_settings_are_and_leave_them() -> None:
    wanted = WAVE._repr_html_()
    with mpl.rc_context({"lines.linewidth": 9.0, "font.size": 30.0, "font.family": "serif"}):
        before = dict(mpl.rcParams)
        assert WAVE._repr_html_() == wanted
        assert dict(mpl.rcParams) == before
        drawn = WAVE.plot()._repr_png_()
    assert drawn != WAVE.plot()._repr_png_()  # a figure of the user's has the user's settings


def test_nothing_of_pyplot_is_loaded_and_nothing_of_matplotlib_before_a_picture() -> None:
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


def test_a_notebook_session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))  # where it keeps what was typed
    shell = pytest.importorskip("IPython.core.interactiveshell", reason="not run: no IPython here")
    session = shell.InteractiveShell.instance()
    try:
        session.run_cell("import asperity as asp")
        done = session.run_cell('asp.compare("sinusoid:amplitude=0.2mm,period=2mm", laws="WC")')
        shown, _metadata = session.display_formatter.format(done.result)
        assert shown["text/html"].startswith("<div>")
        assert shown["text/plain"].startswith("<Comparison of 2 laws")
        figure, _metadata = session.display_formatter.format(done.result.plot())
        assert figure["image/png"]
    finally:
        shell.InteractiveShell.clear_instance()


# --- figures and pages ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(PICTURED))
def test_plot_is_the_picture_of_the_report(name: str) -> None:
    shown = result(name)
    assert isinstance(shown, Plottable)
    figure = shown.plot()
    assert isinstance(figure, Figure)
    assert [axes.get_title() for axes in figure.axes] == [
        axes.get_title() for axes in report.plot(shown).axes
    ]
    assert figure._repr_png_().startswith(b"\x89PNG")
    with pytest.raises(asp.ParameterError, match="picture must be"):
        shown.plot("nonsense")


def test_several_begin_with_their_answer() -> None:
    said = html.unescape(result("several")._repr_html_())
    assert said.index(result("several").recommendation) < said.index("<table")
    assert result("several").missing_data[0].sentence in said


def test_one_picture_of_several() -> None:
    assert len(result("comparison").plot("merit").axes) == 1
    assert len(result("comparison").plot().axes) > 1


def test_a_run_without_a_trace_has_no_picture() -> None:
    with pytest.raises(asp.ParameterError, match="trace must be kept in memory"):
        result("run without a trace").plot()


@pytest.mark.parametrize("name", sorted(REPORTED))
def test_to_html_is_the_report(name: str, tmp_path: Path) -> None:
    shown = result(name)
    assert isinstance(shown, Reportable)
    text = shown.to_html()
    assert text == report.html_text(shown)
    assert text.lstrip().startswith("<!DOCTYPE html>")
    path = tmp_path / "report.html"
    assert shown.to_html(path) is None
    assert path.read_text(encoding="utf-8") == text


def test_a_page_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    with pytest.raises(asp.ParameterError, match=r"path cannot be written: .*got .*nowhere"):
        result("several").to_html(tmp_path / "nowhere" / "report.html")
    assert not hasattr(result("bound"), "to_html")


# --- Rich -----------------------------------------------------------------------------------------


def on_console(width: int, say: Any) -> str:
    console = Console(width=width, record=True, file=io.StringIO(), highlight=False)
    say(console)
    return console.export_text()


@pytest.mark.parametrize("name", sorted(REPORTED))
@pytest.mark.parametrize("width", [50, 100, 160])
def test_rich_prints_what_the_command_line_does(name: str, width: int) -> None:
    shown = result(name)
    text = on_console(width, lambda console: console.print(shown))
    wanted = on_console(width, lambda console: print_page(find_page(shown), console))
    assert text.split() == wanted.split()
    assert len(text.splitlines()) > 4
    assert max(len(line.rstrip()) for line in text.splitlines()) <= width
    if name != "analysis":  # its lines of code go on beyond the width of a terminal
        lines = zip(text.splitlines(), wanted.splitlines(), strict=True)
        assert all(line.rstrip() == other.rstrip() for line, other in lines)


def test_rich_prints_the_rest_as_it_did() -> None:
    text = on_console(100, lambda console: console.print(WAVE))
    assert text.strip() == repr(WAVE)


# --- results are what they were -------------------------------------------------------------------


def test_values_are_equal_and_hashed_and_copied_as_before() -> None:
    bound, device = result("bound"), result("device")
    assert pickle.loads(pickle.dumps(bound)) == bound
    assert hash(copy.deepcopy(bound)) == hash(bound)
    assert copy.copy(device) == device == pickle.loads(pickle.dumps(device))
    assert bound != result("analysis").one_sided
    assert asp.Surface(WAVE, "C") != asp.Surface(WAVE, "C")  # surfaces are themselves alone
    new = asp.Sinusoid(2e-4, 2e-3)
    assert pickle.loads(pickle.dumps(new)).describe() == WAVE.describe()
    assert not vars(Displayable()) | vars(Plottable()) | vars(Reportable())

"""The script of a page, run in a headless browser if one is installed."""

from __future__ import annotations

import csv
import html
import io
import json
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from tests.report.report_pages import Reader

import asperity as asp
from asperity.report import html_text
from asperity.report.document.html import render_page
from asperity.report.document.page import Page, picture_section
from asperity.report.pictures import style

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
BROWSER = next((found for found in map(shutil.which, NAMES) if found), None)
needs_browser = pytest.mark.skipif(BROWSER is None, reason="not run: no browser (chromium) here")


def dump_dom(page: str, path: Path) -> str:
    """Return the DOM of a page after its scripts have run."""
    path.write_text(page, "utf-8")
    profile = f"--user-data-dir={path.parent / 'browser'}"
    options = (
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--virtual-time-budget=3000",
        "--dump-dom",
    )
    command = [str(BROWSER), *options, profile, "--window-size=1100,900", path.as_uri()]
    done = subprocess.run(command, capture_output=True, check=True, timeout=120)
    return done.stdout.decode("utf-8")


def evaluate_script(page: str, path: Path, script: str) -> Any:
    """Return the result of a script run after the page's own, without the security policy."""
    unrestricted = re.sub(r"<meta http-equiv[^>]*>", "", page)
    injected = (
        "<script>const result = (() => {" + script + "})();"
        "document.body.append(Object.assign(document.createElement('pre'),"
        "{id: 'result', textContent: JSON.stringify(result)}))</script></body>"
    )
    dom = dump_dom(unrestricted.replace("</body>", injected), path)
    match = re.search(r'<pre id="result">(.*?)</pre>', dom, re.DOTALL)
    assert match is not None, "the script stopped"
    return json.loads(html.unescape(match[1]))


@pytest.fixture(scope="module")
def page() -> str:
    return html_text(asp.compare(asp.Sinusoid(0.2e-3, 2e-3), laws="WAC", max_depth=0.3e-3))


@needs_browser
def test_content_security_policy_allows_only_the_own_script(page: str, tmp_path: Path) -> None:
    injected = page.replace("</body>", "<script>document.title = 'taken'</script></body>")
    dom = dump_dom(injected, tmp_path / "page.html")
    assert dom.count('class="tools"') == 8
    assert dom.count('type="checkbox"') == 3
    assert "<title>taken" not in dom
    assert "<title>Sinusoid on the " in dom


POINTER = """
const figure = document.querySelectorAll("figure")[3], svg = figure.querySelector("svg");
const panels = JSON.parse(figure.querySelector("script").textContent), panel = panels[1];
const [x, y] = toSvgPoint(panel, expandValues(panel.series[0].x)[100], panel.series[0].y[100]);
const at = new DOMPoint(x, y).matrixTransform(svg.getScreenCTM());
svg.dispatchEvent(new PointerEvent("pointermove", { clientX: at.x, clientY: at.y }));
const box = figure.querySelector(".reading");
const reading = [...box.children].map((line) => line.textContent);
const marks = svg.querySelectorAll(".marks circle").length;
svg.dispatchEvent(new PointerEvent("pointerleave"));
return [reading, marks, box.hidden, panel];
"""


@needs_browser
def test_pointer_shows_values_of_the_nearest_points(page: str, tmp_path: Path) -> None:
    reading, marks, hidden, panel = evaluate_script(page, tmp_path / "page.html", POINTER)
    assert reading[0] == panel["name"] == "A, groove wall normal"
    assert reading[1].startswith("along the scan line: ")
    for line, series in zip(reading[2:], panel["series"], strict=True):
        name, value = line.replace("−", "-").split(": ")
        assert name == series["name"]
        assert float(value.split()[0]) == pytest.approx(series["y"][100], rel=1e-3)
        assert value.split()[1] in ("mm", "µm")
    assert marks == 2
    assert hidden is True


ZOOM = """
const svg = document.querySelectorAll("figure svg")[0], seen = [svg.getAttribute("viewBox")];
const [plus, minus, whole] = svg.closest("figure").querySelectorAll(".tools button");
const turn = (ctrlKey) => {
  const event = new WheelEvent("wheel", { deltaY: -300, ctrlKey, cancelable: true });
  svg.dispatchEvent(event);
  seen.push(svg.getAttribute("viewBox"));
  return event.defaultPrevented;
};
const trapped = [turn(false), turn(true)];
const press = (key) => svg.dispatchEvent(new KeyboardEvent("keydown", { key, cancelable: true }));
press("ArrowRight");
for (const button of [null, minus, plus, whole]) {
  button?.click();
  seen.push(svg.getAttribute("viewBox"));
}
return [trapped, seen, press("ArrowDown")];
"""


@needs_browser
def test_ctrl_wheel_zooms_and_plain_wheel_scrolls(page: str, tmp_path: Path) -> None:
    trapped, view_boxes, is_default = evaluate_script(page, tmp_path / "page.html", ZOOM)
    assert trapped == [False, True]
    boxes = [[float(part) for part in one.split()] for one in view_boxes]
    first, plain, zoomed, moved, less, more, whole = boxes
    assert plain == first == whole
    assert zoomed[2] == pytest.approx(first[2] / np.e)
    assert zoomed[2] / zoomed[3] == pytest.approx(first[2] / first[3])
    assert moved[0] == pytest.approx(zoomed[0] + 0.1 * zoomed[2])
    assert less[2] == pytest.approx(1.5 * zoomed[2])
    assert more[2] == pytest.approx(zoomed[2])
    assert is_default is True  # the full view leaves arrow keys to the page


SORTING = """
const table = document.querySelector("table:has(tr[data-law])");
const laws = () => [...table.tBodies[0].rows].map((row) => row.dataset.law).join("");
const press = (column) => {
  const heading = table.querySelectorAll("th")[column];
  heading.querySelector("button").click();
  return [laws(), heading.getAttribute("aria-sort")];
};
const values = ["0", "~37 µJ", "1.5 mN", "400 N/m", "−2 mm", "∞", "none", "3 m"].map(cellValue);
return [laws(), press(2), press(2), press(0), values];
"""


@needs_browser
def test_headings_sort_the_laws(page: str, tmp_path: Path) -> None:
    """Numbers by value whatever their unit, first the greatest; words by their letters."""
    first, down, up, letters, values = evaluate_script(page, tmp_path / "page.html", SORTING)
    assert sorted(first) == ["A", "C", "W"]
    assert down == ["WCA", "descending"]
    assert up == ["ACW", "ascending"]
    assert letters == ["ACW", "ascending"]
    assert values == [0, 37e-6, 1.5e-3, 400, -2e-3, None, None, 3]


LAWS = """
const box = document.querySelector('.laws input[name="A"]');
box.click();
const figures = [...document.querySelectorAll("figure")];
const of = (figure) => JSON.parse(figure.querySelector("script").textContent);
const hidden = [...document.querySelectorAll('[data-law="A"]')].map((one) =>
  one.hidden || getComputedStyle(one).visibility === "hidden");
const axes = [...document.querySelectorAll('[data-law="A"] .shared')].map((one) =>
  getComputedStyle(one).visibility);
const others = [...document.querySelectorAll('[data-law="C"]')].map((one) =>
  one.hidden || getComputedStyle(one).visibility === "hidden");
const csv = figures.map((figure) => csvFile(of(figure)));
const svg = figures.map((figure) => svgFile(figure.querySelector("svg"), "0 0 72 36"));
document.querySelectorAll(".laws button")[0].click();
return { hidden, axes, others, csv, svg, again: csvFile(of(figures[3])) };
"""


@needs_browser
def test_hidden_laws_are_left_out_of_saved_files(page: str, tmp_path: Path) -> None:
    result = evaluate_script(page, tmp_path / "page.html", LAWS)
    assert len(result["hidden"]) >= 8  # rows of four tables, three panels, one labelled point
    assert all(result["hidden"])
    assert not any(result["others"])
    assert set(result["axes"]) == {"visible"}
    forces = [*csv.reader(io.StringIO(result["csv"][3]))]
    assert not [name for name in forces[0] if name.startswith("A")]
    unit = forces[0][1].split()[-1]
    assert forces[0][3:] == [
        "C, change of height: along the scan line [mm]",
        f"C, change of height: normal {unit}",
        f"C, change of height: tangential {unit}",
    ]
    series = Reader(page).numbers[3][2]["series"]
    assert [float(row[4]) for row in forces[1:]] == series[0]["y"]
    digits = [len(row[3].replace(".", "").lstrip("0")) for row in forces[1:]]
    assert max(digits) <= 8  # no rounding noise
    assert "A, groove" in result["again"]
    fields = [*csv.reader(io.StringIO(result["csv"][4]))]
    assert fields[0][2].endswith("curl / k [1]")
    assert all(np.isfinite([float(cell) for cell in fields[1][:3]]))
    for text in result["svg"]:
        root = ET.fromstring(text)
        assert root.tag == "{http://www.w3.org/2000/svg}svg"
        assert (root.get("width"), root.get("height")) == ("72pt", "36pt")
        assert "var(" not in text
        assert root[0].text  # the title describes the picture
        assert "#1d2733" in text


def three_scales() -> Figure:
    figure = style.new_figure(8.0, 3.0)
    for axes, scale in zip(figure.subplots(1, 3), ("linear", "log", "symlog"), strict=True):
        axes.plot([0.02, 0.7, 30.0], [0.3, 2.0, 11.0], label="line")
        axes.set_xscale(scale)
        axes.set_yscale(scale)
    return figure


@needs_browser
def test_script_and_svg_positions_agree_on_every_scale(tmp_path: Path) -> None:
    text = render_page(
        Page("title", "answer", [], [picture_section("One", three_scales, "Three lines.")])
    )
    script = """
    const panels = JSON.parse(document.querySelector("figure script").textContent);
    return panels.map((panel) => {
      const { x, y } = panel.series[0];
      return x.map((value, i) => toSvgPoint(panel, value, y[i]));
    });
    """
    positions = evaluate_script(text, tmp_path / "page.html", script)
    paths = re.findall(r'<path d="M ([^"]*)" clip-path', text)
    for points, path in zip(positions, paths, strict=True):
        numbers = np.array(re.findall(r"-?\d+\.?\d*", path), dtype=float).reshape(-1, 2)
        assert np.abs(np.array(points) - numbers).max() < 0.01

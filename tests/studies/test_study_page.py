"""A whole study by keyboard in a real browser, on the simulated device."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.lab.axe import needs_axe
from tests.lab.browser import Browser, needs_browser
from tests.lab.page.test_accessibility import LOOKS, check_looks
from tests.lab.started import Started
from tests.studies.study_texts import COMPARISON

from asperity.lab.access import page_files
from asperity.recording.recording import open_recording
from asperity.studies.live.screens import PAGE_PACKAGE
from asperity.studies.study_store import ANSWERS_FILE, read_trials

RUN = (sys.executable, "-m", "asperity", "study", "run", "--no-browser")
STUDY = COMPARISON.replace("interval", "masking_noise = true\ninterval")
TITLE = "document.getElementById('title')?.textContent"
WIDE = LOOKS[:2]  # light and dark
QUESTION = "Which one is rougher?"
SHOWN = "document.documentElement.outerHTML + JSON.stringify(globalThis.study.view)"


def await_title(page: Browser, title: str) -> None:
    page.until(f"{TITLE} === {json.dumps(title)}")


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with Browser("about:blank", tmp_path_factory.mktemp("browser")) as one:
        yield one


def start(folder: Path, *options: str) -> Started:
    path = folder / "study.toml"
    path.write_text(STUDY)
    arguments = (str(path), "--participant", "P01", "-o", str(folder / "data"), *options)
    return Started(*arguments, command=RUN)


def finish(session: Started) -> int:
    """Wait for the end of a session; return its exit code."""
    session.process.communicate(timeout=60)
    return int(session.process.returncode)


@needs_browser
def test_a_study_is_done_by_keyboard_alone(browser: Browser, tmp_path: Path) -> None:
    session = start(tmp_path)
    try:
        browser.said.clear()
        browser.call("Page.navigate", url=session.address)
        await_title(browser, "Welcome")
        browser.press("Enter")
        shown = ""
        for trial in range(3):
            await_title(browser, "First")
            await_title(browser, QUESTION)
            shown += browser.ask(SHOWN)
            if trial == 1:
                browser.press("p")
                await_title(browser, "Pause")
                browser.press(" ")
                await_title(browser, QUESTION)
            browser.press("2" if trial else "1")
        await_title(browser, "The end")
        assert finish(session) == 0
    finally:
        session.close()
    assert [one.answer for one in read_trials(tmp_path / "data")] == ["1", "2", "2"]
    for secret in ("stiffness", "61.5", "83.5", "97.5"):
        assert secret not in shown
    assert browser.said == []
    lines = (tmp_path / "data" / "P01" / ANSWERS_FILE).read_text("utf-8").splitlines()
    for number, line in enumerate(lines, start=1):
        codes = "-".join(json.loads(line)["codes"])
        recorded = open_recording(tmp_path / "data" / "P01" / f"trial-{number:04d}-{codes}.mcap")
        assert recorded.is_complete
        assert recorded["answer"][-1] == float(json.loads(line)["answer"])


@needs_browser
def test_escape_stops_and_a_closed_page_pauses(browser: Browser, tmp_path: Path) -> None:
    session = start(tmp_path)
    try:
        browser.call("Page.navigate", url=session.address)
        await_title(browser, "Welcome")
        browser.press("Enter")
        await_title(browser, QUESTION)
        browser.press("1")
        await_title(browser, "First")
        browser.call("Page.navigate", url="about:blank")
        browser.call("Page.navigate", url=session.address)
        await_title(browser, "Pause")
        browser.press("Enter")
        await_title(browser, QUESTION)
        browser.press("Escape")
        output, _ = session.process.communicate(timeout=60)
        assert "P01: 1 answer in " in output
        assert "stopped; --resume goes on" in output
        await_title(browser, "Stopped")
        assert browser.ask("document.getElementById('keys').offsetHeight") == 0
    finally:
        session.close()
    again = start(tmp_path, "--resume")
    try:
        browser.call("Page.navigate", url=again.address)
        await_title(browser, "Welcome")
        browser.press("Escape")
        assert finish(again) == 0
    finally:
        again.close()


@needs_browser
def test_buttons_and_the_noise_start_by_a_key(browser: Browser, tmp_path: Path) -> None:
    session = start(tmp_path)
    try:
        browser.call("Page.navigate", url=session.address)
        await_title(browser, "Welcome")
        assert not browser.ask("globalThis.study.noise.isOn")
        browser.press("x")
        browser.until("globalThis.study.noise.context !== null")
        level = (
            "import('./masking_noise.js').then(({fillPink}) => {"
            " const s = new Float32Array(65536); fillPink(s);"
            " const power = (step) => { let sum = 0; for (let k = step; k < s.length; k++)"
            " sum += (s[k] - s[k - step]) ** 2; return sum / (s.length - step); };"
            " return [Math.max(...s.map(Math.abs)), power(1), power(64)]; })"
        )
        peak, fast, slow = browser.ask(level)
        assert 0.1 < peak <= 1.0
        assert 0.0 < fast < slow  # more power at low frequencies than white noise, where they agree
        browser.ask("document.querySelector('[data-key=Enter]').click()")
        await_title(browser, QUESTION)
        browser.ask("document.querySelector('[data-key=\"2\"]').click()")
        await_title(browser, "First")
        browser.press("Escape")
        assert finish(session) == 0
    finally:
        session.close()
    assert [one.answer for one in read_trials(tmp_path / "data")] == ["2"]


@needs_browser
@needs_axe
def test_axe_finds_nothing(browser: Browser, tmp_path: Path) -> None:
    session = start(tmp_path)
    try:
        browser.call("Page.navigate", url=session.address)
        await_title(browser, "Welcome")
        check_looks(browser, WIDE)
        browser.press("Enter")
        await_title(browser, QUESTION)
        check_looks(browser, WIDE)
        browser.press("Escape")
        assert finish(session) == 0
    finally:
        session.close()


def relative_luminance(colour: str) -> float:
    """Return the relative luminance of a colour #rrggbb, WCAG 2."""
    parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_contrast_is_that_of_wcag_aa() -> None:
    text = page_files(PAGE_PACKAGE)["study.css"][1].decode()
    themes = re.findall(r":root \{([^}]*)\}", text)
    assert len(themes) == 2
    for theme in themes:
        colours = dict(re.findall(r"--(\w+): (#\w{6})", theme))
        ground = relative_luminance(colours["ground"])
        for name, least in (("ink", 7.0), ("quiet", 4.5), ("accent", 4.5), ("line", 3.0)):
            pair = sorted((ground, relative_luminance(colours[name])))
            assert (pair[1] + 0.05) / (pair[0] + 0.05) >= least, name


def test_the_page_is_served_alone() -> None:
    scripts = {"study.css", "study.js", "masking_noise.js"}
    assert page_files(PAGE_PACKAGE).keys() == {"", "index.html", *scripts}

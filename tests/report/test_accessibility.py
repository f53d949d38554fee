"""The rules of axe-core on report pages, light and dark, wide and narrow."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path
from typing import Any

import pytest
from tests.lab.browser import Browser, needs_browser
from tests.report.browsed import open_page

ROOT = Path(__file__).parents[2]
PACKAGES = ("axe_core_python", "axe_playwright_python", "pytest_playwright_axe")


def find_axe() -> Path | None:
    """Return the script of axe-core: of ASPERITY_AXE, of npm or of a Python package."""
    named = os.environ.get("ASPERITY_AXE")
    candidates = [Path(named)] if named else []
    candidates.append(ROOT / "node_modules" / "axe-core" / "axe.min.js")
    for package in PACKAGES:
        spec = importlib.util.find_spec(package)
        for folder in (spec.submodule_search_locations or ()) if spec else ():
            candidates += Path(folder).rglob("axe.min.js")
    return next((one for one in candidates if one.is_file()), None)


AXE = find_axe()
needs_axe = pytest.mark.skipif(
    AXE is None,
    reason="not run: no axe-core here (npm install axe-core, or ASPERITY_AXE=axe.min.js)",
)
_RUN = """axe.run(document, { resultTypes: ["violations"] }).then(({ violations }) =>
  violations.map(({ id, nodes }) => `${id}: ${nodes.slice(0, 3).map((one) => one.html)}`))"""


def violations(browser: Browser) -> list[str]:
    """Return the violated rules of the open page with some of their elements."""
    assert AXE is not None
    browser.ask(AXE.read_text("utf-8") + ";1")
    found: Any = browser.ask(_RUN)
    return [str(one) for one in found]


@needs_browser
@needs_axe
@pytest.mark.parametrize(("width", "dark"), [(1280, False), (1280, True), (400, False)])
def test_pages_violate_no_rule(
    browser: Browser, report_pages: dict[str, Path], width: int, dark: bool
) -> None:
    for name, path in report_pages.items():
        open_page(browser, path, width, dark=dark)
        assert (name, violations(browser)) == (name, [])


@needs_browser
@needs_axe
@pytest.mark.parametrize(
    ("fault", "rule"),
    [
        ("document.querySelector('svg').removeAttribute('aria-label')", "svg-img-alt"),
        ("document.querySelector('h1').style.color = '#ccc'", "color-contrast"),
        ("document.documentElement.lang = ''", "html-has-lang"),
        ("document.querySelector('th').replaceChildren()", "empty-table-header"),
    ],
)
def test_fault_is_a_violation(
    browser: Browser, report_pages: dict[str, Path], fault: str, rule: str
) -> None:
    open_page(browser, report_pages["comparison"], 1280)
    browser.ask(fault)
    assert [one for one in violations(browser) if one.startswith(rule)]

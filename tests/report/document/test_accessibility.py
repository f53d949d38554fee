"""The rules of axe-core on report pages, light and dark, wide and narrow."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tests.lab.axe import AXE, needs_axe
from tests.lab.browser import Browser, needs_browser
from tests.report.browsed import open_page

_RUN = """axe.run(document, { resultTypes: ["violations"], %s }).then(({ violations }) =>
  violations.map(({ id, nodes }) => `${id}: ${nodes.slice(0, 3).map((one) => one.html)}`))"""


def violations(browser: Browser, rule: str = "") -> list[str]:
    """Return the violated rules of the open page with some of their elements; all, or one rule."""
    assert AXE is not None
    browser.ask(AXE.read_text("utf-8") + ";1")
    found: Any = browser.ask(_RUN % (f"runOnly: ['{rule}']" if rule else ""))
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
        ("document.querySelector('th').scope = 'none'", "scope-attr-valid"),
    ],
)
def test_fault_is_a_violation(
    browser: Browser, report_pages: dict[str, Path], fault: str, rule: str
) -> None:
    open_page(browser, report_pages["comparison"], 1280)
    browser.ask(fault)
    assert violations(browser, rule)

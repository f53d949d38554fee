"""The guided tour in a real browser: each step finds what it tells of, and nothing else."""

from __future__ import annotations

import json
import re

import pytest
from tests.lab.browser import Browser, needs_browser

TITLES = ("W is quiet", "A feels alive", "B buzzes above its limit", "D clicks", "C is soft",
          "H avoids all of these")  # fmt: skip


def text(page: Browser, name: str) -> str:
    return str(page.ask(f"document.getElementById('{name}').textContent"))


def numbers_are_what_is_measured(page: Browser, number: int) -> None:
    """Whether a step tells of limits as they are, and of what was felt."""
    limits, told = page.ask("lab.tour.limits"), text(page, "tour-why")
    law = {3: "B", 5: "C"}[number]
    assert f"{1e-3 * limits[law]:.2f} kN/m, {100 * limits[law] / limits['W']:.0f}\u00a0%" in told
    if number == 3:
        assert f"set to 8.00 kN/m, {8000 / limits[law]:.1f} times that" in told
        return
    times = float(re.search(r"yields ([\d.]+) times", text(page, "tour-found"))[1])  # type: ignore[index]  # it is there
    wall, soft = page.ask("[lab.tour.kept, lab.tour.gauge.felt]")
    assert times > 2
    assert times == pytest.approx(wall / soft, rel=0.06)


@needs_browser
def test_the_tour_shows_itself_to_its_end_by_keys(page: Browser) -> None:
    former = page.ask("lab.news.settings")
    page.press("t")
    page.press("v")
    for number, title in enumerate(TITLES, 1):
        assert text(page, "tour-title") == title
        page.until("lab.tour.found")
        page.until("document.getElementById('tour').classList.contains('found')")
        assert text(page, "tour-place").startswith(f"Step {number} of 6")
        assert text(page, "tour-found").startswith("✓")
        if number == 2:
            assert "fed the hand" in text(page, "verdict")
        if number == 3:
            assert text(page, "limit-words").startswith("▲ above the limit")
            assert text(page, "limit-words").endswith(": smooth-wall rule (quiet against buzz)")
        if number in (3, 5):
            numbers_are_what_is_measured(page, number)
        page.press("n")
    assert page.ask("document.getElementById('tour').hidden")
    # As it was before.
    page.until(
        f"JSON.stringify(lab.news.settings) === `{json.dumps(former, separators=(',', ':'))}`"
    )
    assert page.said == []


@needs_browser
def test_what_is_not_there_is_not_found(page: Browser) -> None:
    # The hand goes in the loops of the step on law A, on the wall.
    starts = page.ask("lab.news.starts")
    page.press("t")
    page.ask("lab.tour.go(1); lab.tour.act.law = 'W'; lab.tour.show(true); lab.tour.start(0)")
    page.until("lab.tour.gauge.way > 8e-3")
    assert text(page, "tour-title") == TITLES[1]
    assert not page.ask("lab.tour.found")
    assert not page.ask("lab.ledger.fed")
    page.press("t")
    page.until(f"lab.news.starts === {starts} + 2 && lab.news.state === 'running'")

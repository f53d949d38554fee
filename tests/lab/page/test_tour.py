"""The guided tour in a real browser: each step finds what it tells of, and nothing else."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from tests.lab.browser import Browser, needs_browser
from tests.lab.page.test_look import colour, shown

TITLES = (
    "W is quiet",
    "A feels alive",
    "B buzzes above its limit",
    "D clicks",
    "C is soft",
    "H avoids all of these",
    "Friction takes energy",
)


def text(page: Browser, name: str) -> str:
    return str(page.ask(f"document.getElementById('{name}').textContent"))


def numbers_are_what_is_measured(page: Browser, number: int) -> None:
    """Whether a step tells of limits as they are, and of what was felt."""
    limits, told = page.ask("lab.tour.limits"), text(page, "tour-explanation")
    law = {3: "B", 5: "C"}[number]
    assert f"{limits[law]:.0f} N/m, {100 * limits[law] / limits['W']:.0f}\u00a0%" in told
    if number == 3:
        assert f"set to 8000 N/m, {8000 / limits[law]:.2g} times that" in told
        return
    times = float(re.search(r"yields ([\d.]+) times", text(page, "tour-result"))[1])  # type: ignore[index]  # it is there
    # The progress stays what it was at the end, while the hand goes on.
    soft = float(re.search(r"felt: ([\d.]+) N/m", text(page, "tour-progress"))[1])  # type: ignore[index]  # it is there
    assert times > 2
    assert times == pytest.approx(page.ask("lab.tour.reference") / soft, rel=0.025)


def views_have_their_height(page: Browser) -> None:
    """The tour squeezes no view, and nothing of it is below the window."""
    page.until("lab.hasCurrentPictures")
    # A message, as of a loop that was late, takes a line for a while.
    page.until("document.getElementById('section').clientHeight > 250")
    section = shown(page, "section")
    assert page.ask("document.documentElement.scrollHeight <= innerHeight")
    # The line of the surface is in the picture, from its left to its right.
    ink = np.abs(section - colour(page, "ink")).max(axis=-1) < 60.0
    assert (ink[:, 10:-10].any(axis=0)).mean() > 0.95
    assert np.ptp(np.nonzero(ink[:, 10:-10].any(axis=1))[0]) > 40


def what_is_told_is_one(page: Browser) -> None:
    """The step on the wall tells one number, of progress and of its result, also later."""
    told = []
    for _moment in range(2):
        for name in ("tour-progress", "tour-result"):
            told += re.findall(r"(?:varies|varied) by ([\d.]+ [mµ]?N)", text(page, name))
        page.ask("Object.assign(lab.hand, { pressDepth: 2e-4 }).requestMotion()")
        page.let_loop_run(1.5)
    assert len(told) == 4
    assert len(set(told)) == 1
    assert float(told[0].split()[0]) * {"N": 1.0, "mN": 1e-3, "µN": 1e-6}[told[0].split()[1]] < 0.15


@needs_browser
def test_the_tour_shows_itself_to_its_end_by_keys(page: Browser) -> None:
    former = page.ask("lab.status.settings")
    page.resize(1280, 800)  # a laptop
    page.press("t")
    page.press("v")
    for number, title in enumerate(TITLES, 1):
        page.expect_text("tour-title", title)
        page.until("lab.tour.isStepCompleted")
        page.until("document.getElementById('tour').classList.contains('completed')")
        page.expect_text("tour-step", f"Step {number} of 7", exact=False)
        page.expect_text("tour-result", "✓", exact=False)
        views_have_their_height(page)
        if number == 1:
            what_is_told_is_one(page)
        if number == 2:
            assert "fed the hand" in text(page, "verdict")
        if number == 3:
            assert "law B delivers energy" in text(page, "limit-text")
            page.expect_text("limit-text", "No stiffness is stable: ", exact=False)
        if number in (3, 5):
            numbers_are_what_is_measured(page, number)
        page.press("n")
    assert page.ask("document.getElementById('tour').hidden")
    # As it was before.
    page.until(
        f"JSON.stringify(lab.status.settings) === `{json.dumps(former, separators=(',', ':'))}`"
    )
    assert page.said == []


@needs_browser
def test_what_is_not_there_is_not_found(page: Browser) -> None:
    # The hand goes in the loops of the step on law A, on the wall.
    starts = page.ask("lab.status.start_count")
    page.press("t")
    page.ask(
        "lab.tour.goTo(1); lab.tour.task.law = 'W'; lab.tour.setDemo(true); lab.tour.startTask(0)"
    )
    page.until("lab.tour.metrics.pathLength > 8e-3")
    page.expect_text("tour-title", TITLES[1])
    assert not page.ask("lab.tour.isStepCompleted")
    assert not page.ask("lab.energyMeter.suppliesEnergy")
    page.press("t")
    page.until(f"lab.status.start_count === {starts} + 2 && lab.status.state === 'running'")


@needs_browser
def test_a_page_that_is_closed_in_mid_tour_leaves_nothing_to_the_next(page: Browser) -> None:
    former = page.ask("lab.status.settings")
    address, fragment = page.ask("[location.href.split('#')[0], location.hash]")
    page.press("t")
    page.until("lab.tour.isActive && lab.status.settings.texture.includes('0.4mm')")
    page.until("lab.status.settings.law === 'W' && lab.status.state === 'running'")
    assert page.ask("location.hash") == fragment  # a page that is loaded again has no tour
    page.ask("lab.tour.goTo(1), lab.tour.goTo(2), lab.tour.goTo(3)")  # and more requests
    page.call("Page.navigate", url="about:blank")
    page.call("Page.navigate", url=f"{address}?again")
    page.until("globalThis.lab?.status?.has_control && lab.status.state === 'running'")
    page.until(f"JSON.stringify(lab.status.settings) === JSON.stringify({json.dumps(former)})")
    page.let_loop_run(1.0)
    assert page.ask("lab.status.settings") == former
    # The hand is that of the page, free.
    page.until("lab.probeState() && !lab.probeState().isInside")

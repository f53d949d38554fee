"""The page in a real browser: fingers and pens, what it says when something ends, and contrast."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from tests.lab.browser import Browser, needs_browser
from tests.lab.client import heard, joined, news, say
from tests.lab.started import Started

# Of WCAG 2.2, level AA: text, large text, and what is no text but tells something.
CONTRASTS = """((text, large, line) => {
  const number = colour => colour.match(/[\\d.]+/g).map(Number);
  const light = colour => {
    const [r, g, b] = colour.map(value => value / 255)
      .map(value => value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const ratio = (one, other) => {
    const [low, high] = [light(one), light(other)].sort((a, b) => a - b);
    return (high + 0.05) / (low + 0.05);
  };
  const ground = one => {
    for (; one; one = one.parentElement) {
      const colour = number(getComputedStyle(one).backgroundColor);
      if ((colour[3] ?? 1) === 1) return colour.slice(0, 3);
    }
    return [255, 255, 255];
  };
  const low = [], walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  let count = 0;
  while (walk.nextNode()) {
    const one = walk.currentNode.parentElement, style = getComputedStyle(one);
    const words = walk.currentNode.data.trim();
    if (!words || !one.checkVisibility() || one.closest(":disabled")) continue;
    const size = parseFloat(style.fontSize), bold = style.fontWeight >= 700;
    const found = ratio(number(style.color), ground(one));
    count++;
    if (found < (size >= 24 || bold && size >= 18.66 ? large : text)) low.push([words, found]);
  }
  const root = getComputedStyle(document.documentElement);
  const named = name => {
    const value = root.getPropertyValue(`--${name}`).trim();
    return [1, 3, 5].map(at => parseInt(value.slice(at, at + 2), 16));
  };
  for (const name of ["ink", "blue", "orange", "green", "red", "soft"]) {
    const found = ratio(named(name), named("card"));
    if (found < line) low.push([name, found]);
  }
  return [count, low];
})"""


@needs_browser
@pytest.mark.parametrize("dark", [False, True])
def test_all_that_is_written_can_be_read(page: Browser, dark: bool) -> None:
    page.resize(1280, 900, dark=dark)
    page.ask("document.querySelectorAll('details').forEach(one => one.open = true)")
    count, low = page.ask(f"{CONTRASTS}(4.5, 3, 3)")
    assert count > 60
    assert low == []
    # More than black on white is never there: the measure can fail.
    assert len(page.ask(f"{CONTRASTS}(21.1, 21.1, 21.1)")[1]) > count
    page.resize(1280, 900)


def place(page: Browser, name: str) -> dict[str, float]:
    """Return the middle of a view on the screen."""
    box = page.ask(f"document.getElementById('{name}').getBoundingClientRect().toJSON()")
    return {"x": box["x"] + 0.5 * box["width"], "y": box["y"] + 0.5 * box["height"]}


@needs_browser
def test_a_finger_presses_and_lifts(page: Browser) -> None:
    at = place(page, "relief")
    page.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[at])
    page.until("lab.hand.isPressed && lab.probeState().force[2] > 0.02")
    before = page.ask("lab.hand.x")
    page.call("Input.dispatchTouchEvent", type="touchMove", touchPoints=[{**at, "x": at["x"] + 40}])
    page.until(f"lab.hand.isPressed && lab.hand.x > {before} + 5e-4")
    page.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    page.until("!lab.hand.isPressed && !lab.probeState().isInside")
    # The page has neither scrolled nor zoomed.
    assert page.ask("[scrollX, scrollY, visualViewport.scale]") == [0, 0, 1]


@needs_browser
def test_a_pen_presses_as_hard_as_it_is_pressed(page: Browser) -> None:
    at = place(page, "relief")

    def pen(kind: str, force: float, buttons: int) -> None:
        page.call(
            "Input.dispatchMouseEvent",
            type=kind,
            button="left",
            buttons=buttons,
            force=force,
            clickCount=1,
            pointerType="pen",
            **at,
        )

    depths = []
    for force in (0.25, 0.75):
        pen("mousePressed", force, 1)
        page.until(f"lab.hand.isPressed && Math.abs(lab.hand.pressure - 2 * {force}) < 0.01")
        depths.append(-page.ask("lab.hand.height"))
        pen("mouseReleased", 0.0, 0)
        page.until("!lab.hand.isPressed")
    assert depths == pytest.approx([0.5 * 4e-4, 1.5 * 4e-4], rel=0.02)


def loop_of(lab: Started) -> int:
    """Return the process of the loop: of those below the lab's, the one that holds the wheel."""
    server = lab.process.pid
    for place in Path(f"/proc/{server}/task").iterdir():
        for number in (place / "children").read_text().split():
            if "/asperity-" in Path(f"/proc/{number}/maps").read_text():
                return int(number)
    raise AssertionError("no loop")


@needs_browser
def test_a_loop_that_has_stopped_is_said_with_its_reason_and_starts_again(
    page: Browser, lab: Started
) -> None:
    starts = page.ask("lab.status.start_count")
    os.kill(loop_of(lab), signal.SIGKILL)
    page.until("lab.status.state == 'stopped'")
    words = page.ask("document.getElementById('alarm').innerText")
    assert "The loop has stopped: the process of the loop ended" in words
    assert page.ask("document.getElementById('state').textContent") == "stopped"
    page.ask("document.getElementById('start').click()")
    page.until(f"lab.status.state == 'running' && lab.status.start_count == {starts + 1}")
    page.until("document.getElementById('alarm').hidden || !/stopped/.test(alarm.innerText)")
    page.until("lab.frame.newest[0] < 60")


@needs_browser
def test_a_surface_that_cannot_be_is_said_and_the_former_stays(page: Browser) -> None:
    before = page.ask("lab.status.settings.texture")
    page.ask(
        "{ const field = document.getElementById('texture'); field.value = 'velvet';"
        "field.dispatchEvent(new Event('change')); }"
    )
    page.until("/velvet/.test(document.getElementById('alarm').innerText)")
    assert page.ask("lab.status.settings.texture") == before
    rows = page.ask("lab.frame.firstRow")
    page.until(f"lab.status.state == 'running' && lab.frame.firstRow > {rows}")


@needs_browser
def test_a_page_that_watches_says_so_and_takes_over(page: Browser, lab: Started) -> None:
    page.call("Page.navigate", url="about:blank")
    with joined(lab) as other:
        if not heard(other, lambda m: news(control_available=True)(m) or news(has_control=True)(m))[
            "has_control"
        ]:
            say(other, "take_control")
            heard(other, news(has_control=True))
        page.call("Page.navigate", url=lab.address)
        page.until("globalThis.lab?.status && !lab.status.has_control")
        words = "document.getElementById('alarm').innerText"
        assert "Another page has control; this page is read-only." in page.ask(words)
        assert page.ask("document.getElementById('stiffness').disabled")
        assert page.ask("document.getElementById('take-control').hidden")
        page.until("lab.frame")
        assert page.ask("document.getElementById('tour-start').disabled")
        for key in "tnv":  # which do what the disabled button does
            page.press(key)
        assert not page.ask("lab.tour.isActive")
    page.until("!document.getElementById('take-control').hidden")
    page.ask("document.getElementById('take-control').click()")
    page.until("lab.status.has_control && !document.getElementById('stiffness').disabled")

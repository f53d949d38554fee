"""The page in a real browser: it lives, obeys, and says what has happened."""

from __future__ import annotations

import random
from io import BytesIO

import numpy as np
import pytest
from PIL import Image
from tests.lab.browser import Browser, needs_browser

from asperity.lab.site import page_files

MOST_BYTES = 1_000_000
ACTIONS = 150


def test_the_page_is_small_and_comes_from_here_alone() -> None:
    files = page_files()
    assert sum(len(content) for _kind, content in files.values()) < MOST_BYTES
    for name, (_kind, content) in files.items():
        text = content.decode("utf-8")
        assert "http://" not in text, name
        assert "https://" not in text, name


def inside(page: Browser, name: str, x: float, y: float) -> tuple[float, float]:
    """Return the place on the screen of a point of a view, in shares of its size."""
    box = page.ask(f"document.getElementById('{name}').getBoundingClientRect().toJSON()")
    return box["x"] + x * box["width"], box["y"] + y * box["height"]


def colours_in(page: Browser, name: str) -> int:
    """Return how many colours a view shows."""
    box = page.ask(f"document.getElementById('{name}').getBoundingClientRect().toJSON()")
    picture = np.asarray(Image.open(BytesIO(page.picture())).convert("RGB"))
    top, left = int(box["y"]), int(box["x"])
    part = picture[top : top + int(box["height"]), left : left + int(box["width"])]
    return len(np.unique(part.reshape(-1, 3), axis=0))


@needs_browser
def test_the_pointer_presses_and_the_force_is_drawn(page: Browser) -> None:
    page.mouse("mouseMoved", *inside(page, "relief", 0.5, 0.5))
    page.mouse("mousePressed", *inside(page, "relief", 0.5, 0.5), 1)
    page.until("lab.probeState().force[2] > 0.02 && lab.latencies.length > 0")
    assert page.ask("document.getElementById('readout').textContent").startswith("probe")
    page.mouse("mouseReleased", *inside(page, "relief", 0.5, 0.5))
    page.until("!lab.probeState().inside && lab.probeState().probe[2] > 2e-4")
    assert min(colours_in(page, name) for name in ("relief", "cut")) > 20


@needs_browser
def test_all_is_done_by_keyboard(page: Browser) -> None:
    for key, reached in (
        (" ", "lab.probeState().force[2] > 0.02"), (" ", "lab.probeState().probe[2] > 2e-4"),
        ("ArrowRight", "lab.hand.x != 0"), ("x", "lab.news.settings.law == 'A'"),
        ("m", "lab.hand.motion == 'stroke'"), ("m", "lab.hand.motion == 'loop'"),
    ):  # fmt: skip
        page.press(key)
        page.until(f"{reached} && lab.news.state == 'running'")
    assert "law=A" in page.ask("location.hash")


@needs_browser
def test_law_a_feeds_the_hand_and_the_ledger_says_so(page: Browser) -> None:
    page.ask("lab.hand.press = 2e-4, lab.hand.loop = 5e-4, lab.hand.x = 0, lab.hand.wish()")
    page.until("document.getElementById('ledger').classList.contains('fed')")
    assert "fed the hand" in page.ask("document.getElementById('verdict').textContent")
    page.press("w")
    page.until("lab.news.settings.law == 'W' && lab.news.state == 'running'")
    page.press("r")
    page.until("!document.getElementById('ledger').classList.contains('fed')")


@needs_browser
@pytest.mark.parametrize(("width", "dark"), [(360, False), (1280, True), (3840, False)])
def test_it_fits_every_screen(page: Browser, width: int, dark: bool) -> None:
    page.resize(width, 900 if width < 2000 else 2160, dark=dark)
    page.ask("new Promise(done => setTimeout(done, 300))")
    assert page.ask("document.documentElement.scrollWidth <= innerWidth")
    words = "document.querySelector('#cut').getAttribute('aria-label')"
    assert page.ask(words).startswith("A cut through the surface")
    if width > 360:
        assert page.ask("document.documentElement.scrollHeight <= innerHeight + 120")
    ground = page.ask("getComputedStyle(document.body).backgroundColor")
    assert (ground == "rgb(20, 24, 26)") is dark


@needs_browser
def test_whatever_is_done_nothing_breaks(page: Browser) -> None:
    page.resize(1280, 900)
    chance = random.Random(7)
    keys = ["w", "a", "c", "x", "m", "r", " ", "+", "-", "ArrowLeft", "ArrowUp", "PageUp",
            "PageDown", "Tab", "Escape"]  # fmt: skip
    page.ask("lab.most = 0; lab.watch = setInterval(() => { const at = lab.frame.greatest;"
             "const low = lab.frame.least; for (const k of [7, 8, 9])"
             "lab.most = Math.max(lab.most, at[k], -low[k]); }, 4)")  # fmt: skip
    for _ in range(ACTIONS):
        view, act = chance.choice(["relief", "cut"]), chance.random()
        place = inside(page, view, chance.random(), chance.random())
        if act < 0.3:
            page.press(chance.choice(keys))
        elif act < 0.7:
            page.mouse("mouseMoved", *place, chance.choice([0, 1]))
        elif act < 0.8:
            page.mouse(chance.choice(["mousePressed", "mouseReleased"]), *place, 1)
        elif act < 0.9:
            page.mouse("mouseWheel", *place, deltaX=0, deltaY=chance.choice([-100, 100]))
        else:
            x, y = chance.uniform(0, 1280), chance.uniform(0, 900)
            page.mouse("mouseMoved", x, y)
    page.until("lab.news?.state == 'running'")
    page.ask("clearInterval(lab.watch)")
    assert page.ask("lab.faults") == 0
    assert page.said == []
    assert 0.0 < page.ask("lab.most") <= page.ask("lab.news.max_force") * (1 + 1e-9)


@needs_browser
def test_a_lost_connection_is_said_and_comes_back(page: Browser) -> None:
    # What no page of ours sends.
    page.ask("lab.hand.say('steer', {})")
    page.until("document.getElementById('state').textContent == 'connection lost'")
    words = page.ask("document.getElementById('alarm').innerText")
    assert 'The lab has closed the connection: "steer" has target, cosine' in words
    page.until("lab.news?.steers && lab.news.state == 'running'")
    numbers = page.ask("lab.frame.first")
    page.until(f"lab.frame.first > {numbers} && lab.frame.number < 1e4")

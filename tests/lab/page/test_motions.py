"""Motions of the hand: loops show curl, and a quiet contact shows that a limit is conservative."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from tests.lab.browser import Browser, needs_browser

from asperity.report.sentences.texts import limit_text

FED = "document.getElementById('energy-card').classList.contains('supplies-energy')"
QUIET = "The limit is conservative for this hand: in "


def text(page: Browser, name: str) -> str:
    return str(page.ask(f"document.getElementById('{name}').textContent"))


def choose(page: Browser, motion: str) -> None:
    page.ask(f"document.querySelector('#motion [value={motion}]').click()")
    assert page.ask("lab.hand.motion") == motion


def render(page: Browser, law: str, stiffness: float) -> None:
    """Render another law as a user does, by key and slider, and wait for its pictures."""
    page.press(law.lower())
    page.until(f"lab.status.settings.law === '{law}' && lab.status.state === 'running'")
    value = f"1000 * Math.log10({stiffness} / 10) / 3"
    page.ask(
        "{ const slider = document.getElementById('stiffness'); slider.step = 'any';"
        f"slider.value = {value}; slider.dispatchEvent(new Event('change')); }}"
    )
    page.until(
        f"lab.status.settings.stiffness === {stiffness} && lab.status.state === 'running'"
        "&& lab.hasCurrentPictures"
    )


@pytest.fixture(autouse=True)
def still_hand(page: Browser) -> Iterator[None]:
    """The hand follows the pointer before and after, not pressed."""
    page.ask("document.activeElement.blur()")
    yield
    choose(page, "pointer")
    page.ask("lab.hand.isLatched = false; lab.hand.loopSpeed = 20; lab.hand.requestMotion(); 1")


def use_device(page: Browser, name: str) -> None:
    page.ask(
        f"{{ const field = document.getElementById('device'); field.value = '{name}';"
        "field.dispatchEvent(new Event('change')); }"
    )
    page.until(f"lab.status.settings.device === '{name}' && lab.status.state === 'running'")


@pytest.fixture
def light_device(page: Browser) -> Iterator[None]:
    """A device of 45 g with a lower limit, so that contacts show what is above it."""
    used = page.ask("lab.status.settings.device")
    use_device(page, "touch-x")
    yield
    use_device(page, used)


@needs_browser
@pytest.mark.parametrize("x", [0.1e-3, 0.9e-3])
def test_loops_are_offered_where_the_field_has_curl_and_feed_the_hand(
    page: Browser, x: float
) -> None:
    render(page, "A", 250.0)
    page.until("document.getElementById('motion-note').textContent.startsWith('This field has')")
    page.ask(f"Object.assign(lab.hand, {{ x: {x}, y: 0, pressDepth: 2e-4 }}); 1")
    sense = 20.0 if x < 0.5e-3 else -20.0
    choose(page, "loop")
    page.until(f"lab.hand.loopSpeed === {sense}")
    # On the nearest flank, in the sense that gains energy there: sin rises at 0, and falls at 1 mm.
    place, speed = page.ask("[lab.hand.x, lab.hand.loopSpeed]")
    assert place == pytest.approx(1e-3 * round(1e3 * x), abs=0.3e-3)
    assert speed == sense
    page.expect_text("motion-note", "")
    page.press("r")
    page.until(FED)
    # In the other sense the hand does work on the field.
    page.ask("lab.hand.loopSpeed *= -1; lab.hand.requestMotion(); 1")
    page.let_loop_run(1.0)
    page.press("r")
    page.until("!lab.energyMeter.awaitsFreeProbe")
    page.let_loop_run(1.5)
    assert not page.ask(FED)


# Wrong places of loops in random pictures of law A on sin(π x), whose points are as far apart as
# those of the page (72 x 36), at most 0.2 mm.
WRONG_PLACES = """
import("./feeding_loop.js").then(({ findFeedingLoop }) => {
  let state = 1;
  const random = (low, high) => {
    state = state * 48271 % 2147483647;
    return low + (high - low) * state / 2147483647;
  };
  const wrong = [];
  for (let n = 0; n < 1000; n++) {
    const left = random(-6, -3), bottom = random(-4, -1);
    const dx = random(0.05, 0.2), dz = random(0.05, 0.2), curl = [];
    const columns = Math.ceil((random(3, 6) - left) / dx), rows = Math.ceil((1 - bottom) / dz);
    for (let j = 0; j < rows; j++) for (let i = 0; i < columns; i++) {
      const x = left + i * dx, z = bottom + j * dz;
      const isTextured = z < 0.2 * Math.sin(Math.PI * x) && z > -0.2;
      curl.push(isTextured ? -Math.cos(Math.PI * x) : 0);
    }
    const box = [left, left + (columns - 1) * dx, bottom, bottom + (rows - 1) * dz];
    const section = { box, columns, rows, curl, hasCurl: true };
    for (const x of [-0.9, 0.1, 0.9]) {
      const loop = findFeedingLoop(section, { x, z: -0.12, radiusX: 0.5, radiusZ: 0.12 });
      const flank = Math.round(x), isNear = loop && Math.abs(loop.x - flank) < 0.3;
      if (!isNear || loop.sense !== (flank ? -1 : 1)) wrong.push([n, x]);
    }
  }
  return wrong;
})
"""


@needs_browser
def test_the_nearest_flank_is_found_wherever_the_points_of_the_picture_are(page: Browser) -> None:
    assert page.ask(WRONG_PLACES) == []


@needs_browser
def test_without_curl_there_is_no_hint_and_loops_stay_in_place(page: Browser) -> None:
    render(page, "C", 250.0)
    page.ask("lab.hand.x = 0.4e-3; 1")
    page.until("document.getElementById('section-note').textContent.startsWith('no curl')")
    page.expect_text("motion-note", "")
    choose(page, "loop")
    assert page.ask("[lab.hand.x, lab.hand.loopSpeed]") == [0.4e-3, 20.0]


@needs_browser
def test_the_tour_shows_law_a_alive_without_being_asked(page: Browser) -> None:
    starts = page.ask("lab.status.start_count")
    page.press("t")
    page.until(f"lab.status.start_count > {starts}")
    page.press("n")
    page.expect_text("tour-title", "A feels alive")
    page.until("lab.tour.isStepCompleted && lab.hand.motion === 'loop'")
    page.expect_text("tour-demo", "Try it")
    # The next step waits for the user, as before.
    page.press("n")
    assert not page.ask("lab.tour.isDemo")
    page.press("t")
    page.until(f"lab.status.start_count === {starts} + 2 && lab.status.state === 'running'")


@needs_browser
@pytest.mark.usefixtures("light_device")
def test_a_quiet_contact_above_the_limit_says_that_it_is_conservative(page: Browser) -> None:
    render(page, "C", 800.0)
    page.until("lab.status.limit.stiffness > 0 && lab.status.limit.stiffness < 800")
    assert QUIET not in text(page, "limit-text")  # nothing is touched
    page.ask("Object.assign(lab.hand, { x: 0.5e-3, y: 0, z: null, pressDepth: 1e-3 }); 1")
    page.press(" ")
    page.until(f"document.getElementById('limit-text').textContent.includes('{QUIET}')", 30.0)
    limit = page.ask("lab.status.limit.stiffness")
    page.expect_text(
        "limit-text", f"▲ above the limit of {limit_text(limit)} for law C", exact=False
    )
    # The same contact below the limit exceeds none.
    render(page, "C", 600.0)
    page.until("document.getElementById('limit-text').textContent.startsWith('below the limit')")
    page.let_loop_run(5.0)
    assert QUIET not in text(page, "limit-text")
    # Far above it the force oscillates, by one step of the encoder.
    render(page, "C", 9000.0)
    page.until("lab.quietContact.metrics.forceAmplitude > 0.05")
    page.let_loop_run(5.0)
    page.expect_text("limit-text", "▲ above the limit", exact=False)
    assert QUIET not in text(page, "limit-text")

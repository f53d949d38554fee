"""A picture that is not yet of the law shown is grey, and says of which law it is."""

from __future__ import annotations

import re

import pytest
from tests.lab.browser import Browser, needs_browser
from tests.lab.page.test_look import change, shown

SETTLED = "lab.status.state === 'running' && lab.status.pictures_current"


def choose(page: Browser, law: str) -> None:
    page.press(law.lower())
    page.until(f"lab.status.settings.law === '{law}' && {SETTLED}")


def text(page: Browser, name: str) -> str:
    return str(page.ask(f"document.getElementById('{name}').textContent"))


def colourfulness(page: Browser, name: str) -> float:
    """Return the greatest difference of the channels of a pixel, in the upper half of a view."""
    page.ask("new Promise(done => setTimeout(done, 300))")
    pixels = shown(page, name)
    return float((pixels.max(axis=-1) - pixels.min(axis=-1)).max())


@needs_browser
def test_a_picture_of_another_law_is_grey_and_says_so(page: Browser) -> None:
    choose(page, "A")
    page.until("lab.hasCurrentPictures")
    page.until("document.getElementById('section-note').textContent.startsWith('curl up to')")
    assert colourfulness(page, "section") > 60.0
    # No new picture comes.
    page.ask("globalThis.sendPicture = lab.pictures.send; lab.pictures.send = () => false; 1")
    choose(page, "C")
    page.until("document.getElementById('section-note').textContent.includes('computing')")
    assert re.fullmatch(r"of law A at [\d.]+ k?N/m: computing …", text(page, "section-note"))
    label = page.ask("document.getElementById('section').getAttribute('aria-label')")
    assert "curl" not in label
    assert "of law A" in label
    assert page.ask("lab.section.label") == "law A"  # in the picture, too
    assert colourfulness(page, "section") < 20.0
    # The relief is that of the surface, whatever the law.
    assert "heights" in text(page, "relief-note")
    assert not page.ask("document.getElementById('relief').classList.contains('stale')")
    assert not page.ask("lab.hasCurrentPictures")
    assert page.ask("document.getElementById('save-png').disabled")
    # Of the law that is rendered again, but requested before: not shown as current.
    choose(page, "A")
    page.ask("new Promise(done => setTimeout(done, 300))")
    assert "of law A" in text(page, "section-note")
    choose(page, "C")
    page.ask("lab.pictures.send = globalThis.sendPicture; 1")
    page.until("lab.hasCurrentPictures")
    page.until("document.getElementById('section-note').textContent.startsWith('no curl')")
    page.until("!document.getElementById('section').classList.contains('stale')")
    page.until("!document.getElementById('save-png').disabled")
    assert page.said == []


@needs_browser
def test_a_picture_of_another_surface_is_grey(page: Browser) -> None:
    former = page.ask("lab.status.settings.texture")
    page.ask("globalThis.sendPicture = lab.pictures.send; lab.pictures.send = () => false; 1")
    with pytest.raises(AssertionError, match="in vain"):
        page.until("document.getElementById('relief').classList.contains('stale')", 1.0)
    page.ask(
        "{ const field = document.getElementById('texture');"
        "field.value = 'sinusoid:amplitude=0.1mm,period=3mm';"
        "field.dispatchEvent(new Event('change')); }"
    )
    page.until("lab.status.settings.texture.includes('3mm') && lab.status.pictures_current")
    page.until("document.getElementById('relief').classList.contains('stale')")
    page.until(
        "document.getElementById('relief-note').textContent"
        " === 'of the previous surface: computing …'"
    )
    page.ask("lab.pictures.send = globalThis.sendPicture; 1")
    page.until("lab.hasCurrentPictures && !document.querySelector('.stale')")
    change(page, "texture", former)


@needs_browser
def test_a_part_of_the_view_without_a_picture_is_requested_at_once_and_says_so(
    page: Browser,
) -> None:
    page.until("lab.hasCurrentPictures && lab.section.covers(lab.sectionBox())")
    # A slow picture before: the next one would come after eight times its time.
    page.ask("lab.pictures.requests.section.nextTime = performance.now() + 1e6")
    drawn = "lab.texts = []; const c = CanvasRenderingContext2D.prototype, fill = c.fillText;"
    drawn += "c.fillText = function (text, ...place) { lab.texts.push(text);"
    drawn += " fill.call(this, text, ...place); }"
    page.ask(f"(() => {{ {drawn} }})()")
    # A slow server, so that the view is drawn before the picture comes.
    page.ask("globalThis.sendPicture = lab.pictures.send; 1")
    late = "setTimeout(() => globalThis.sendPicture.apply(lab.pictures, content), 500)"
    page.ask(f"lab.pictures.send = (...content) => {{ {late}; return true; }}; 1")
    page.ask("Object.assign(lab.hand, { x: lab.hand.x + 0.02 }).requestMotion()")
    page.until("!lab.section.covers(lab.sectionBox())", 20.0)
    page.until("lab.section.covers(lab.sectionBox())", 20.0)
    page.ask("lab.pictures.send = globalThis.sendPicture; 1")
    assert page.ask("lab.texts.includes('computing …')")
    assert page.said == []


@needs_browser
def test_strokes_leave_the_view_in_place(page: Browser) -> None:
    """A view that followed the probe to each end of a stroke had no picture of a half."""
    page.ask("document.querySelector('#motion [value=stroke]').click()")
    page.let_loop_run(2.0)
    page.until("lab.section.covers(lab.sectionBox())")
    box = page.ask("lab.sectionBox()")
    reached = []
    for _moment in range(12):
        page.let_loop_run(0.4)
        reached.append(page.ask("lab.probeState().probe[0]"))
        assert page.ask("lab.sectionBox()") == box
        assert page.ask("lab.section.covers(lab.sectionBox())")
    assert max(reached) - min(reached) > 0.5 * (box[1] - box[0])
    page.ask("document.querySelector('#motion [value=pointer]').click()")

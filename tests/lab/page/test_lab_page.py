"""The page in a real browser: it lives, obeys, and says what has happened."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from PIL import Image
from tests.lab.browser import Browser, needs_browser
from tests.lab.started import Started

from asperity.lab.access import page_files
from asperity.lab.scene_state import RANGES

MOST_BYTES = 1_000_000
# One question: between two of them the meter may begin again.
SUPPLIES_ENERGY = """document.getElementById('energy-card').classList.contains('supplies-energy')
&& document.getElementById('verdict').textContent === '⚠ the field has fed the hand'"""


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
    page.until("lab.probeState().force[2] > 0.02")
    assert page.ask("document.getElementById('readout').textContent").startswith("probe")
    page.mouse("mouseReleased", *inside(page, "relief", 0.5, 0.5))
    page.until("!lab.probeState().isInside && lab.probeState().probe[2] > 2e-4")
    assert min(colours_in(page, name) for name in ("relief", "section")) > 20


@needs_browser
def test_all_is_done_by_keyboard(page: Browser) -> None:
    for key, reached in (
        (" ", "lab.probeState().force[2] > 0.02"),
        (" ", "lab.probeState().probe[2] > 2e-4"),
        ("ArrowRight", "lab.hand.x != 0"),
        ("x", "lab.status.settings.law == 'A'"),
        ("m", "lab.hand.motion == 'stroke'"),
        ("m", "lab.hand.motion == 'loop'"),
    ):
        page.press(key)
        page.until(f"{reached} && lab.status.state == 'running'")
    assert "law=A" in page.ask("location.hash")


@needs_browser
def test_a_parameter_of_a_law_has_a_tooltip(page: Browser) -> None:
    page.press("h")
    page.until("lab.status.settings.law == 'H' && lab.status.state == 'running'")
    tooltip = page.ask("document.getElementById('continuity').title")
    assert tooltip.startswith("parameter c of law H")
    page.press("a")
    page.until("lab.status.settings.law == 'A' && lab.status.state == 'running'")


@needs_browser
def test_law_a_feeds_the_hand_and_the_ledger_says_so(page: Browser) -> None:
    page.press("a")
    page.until("lab.status.settings.law == 'A' && lab.status.state == 'running'")
    page.ask("Object.assign(lab.hand, { loopRadius: 5e-4, x: 0, y: 0 })")
    page.ask("lab.hand.setMotion({ motion: 'loop', pressDepth: 2e-4 })")
    page.until(SUPPLIES_ENERGY)
    page.press("w")
    page.until("lab.status.settings.law == 'W' && lab.status.state == 'running'")
    page.press("r")
    page.until(f"!({SUPPLIES_ENERGY})")


@needs_browser
@pytest.mark.parametrize(("width", "dark"), [(360, False), (1280, True), (3840, False)])
def test_it_fits_every_screen(page: Browser, width: int, dark: bool) -> None:
    page.resize(width, 900 if width < 2000 else 2160, dark=dark)
    page.ask("new Promise(done => setTimeout(done, 300))")
    assert page.ask("document.documentElement.scrollWidth <= innerWidth")
    words = "document.querySelector('#section').getAttribute('aria-label')"
    assert page.ask(words).startswith("Section through the surface")
    if width > 360:
        assert page.ask("document.documentElement.scrollHeight <= innerHeight + 120")
    ground = page.ask("getComputedStyle(document.body).backgroundColor")
    assert (ground == "rgb(20, 24, 26)") is dark


@needs_browser
def test_a_lost_connection_is_said_and_comes_back(page: Browser) -> None:
    # What no page of ours sends.
    page.ask("lab.hand.send('steer', {})")
    page.until("document.getElementById('state').textContent == 'connection lost'")
    words = page.ask("document.getElementById('alarm').innerText")
    assert 'The server closed the connection: "steer" has target, cosine' in words
    page.until("lab.status?.has_control && lab.status.state == 'running'")
    numbers = page.ask("lab.frame.firstRow")
    page.until(f"lab.frame.firstRow > {numbers} && lab.frame.number < 1e4")


@needs_browser
def test_without_shared_memory_all_comes_as_messages(page: Browser, lab: Started) -> None:
    assert page.ask("lab.connection.usesBuffer")
    script = "Object.defineProperty(globalThis, 'crossOriginIsolated', {value: false})"
    added = page.call("Page.addScriptToEvaluateOnNewDocument", source=script)
    try:
        page.call("Page.navigate", url="about:blank")
        page.call("Page.navigate", url=lab.address)
        page.until("globalThis.lab?.frame && lab.hasPictures && lab.status.state == 'running'")
        page.until("lab.status.has_control")  # once the page before is known to be gone
        assert not page.ask("lab.connection.usesBuffer")
        numbers = page.ask("lab.frame.number")
        page.until(f"lab.frame.number > {numbers} + 100")
    finally:
        page.call("Page.removeScriptToEvaluateOnNewDocument", **added)
    assert page.ask("lab.errorCount") == 0


# The thread's own source, and what reads its memory, one after the other: what is said, and heard.
_THROUGH_MEMORY = """((size, count) => {
  const [COMMANDS, socket] = ((postMessage, WebSocket) => {
    let onmessage; %s; return [COMMANDS, () => socket];
  })(() => {}, class {});
  const shared = { positions: new SharedArrayBuffer(8), ring: new SharedArrayBuffer(8 * size) };
  const said = [], heard = [], written = one => (typeof one === "string" ? one : [...one].join());
  const line = Object.assign(Object.create(Object.getPrototypeOf(lab.connection)), {
    usesBuffer: true,
    positions: new Int32Array(shared.positions), ring: new Float64Array(shared.ring),
    receive(one) { heard.push(written(typeof one === "string" ? one : new Float64Array(one))); },
  });
  COMMANDS.setBuffer(shared); COMMANDS.open(""); COMMANDS.useBuffer(true);
  const come = one => { said.push(written(one)); socket().onmessage({ data: one.buffer ?? one }); };
  for (let k = 0; k < count; k++) {
    const long = k * 7 %% 31;
    const numbers = Float64Array.from({ length: long + 1 }, (_, j) => k + j / 64);
    come(k %% 3 ? numbers : "é€".repeat(long) + k);
    if (k %% 5 === 4) line.readBuffer();
  }
  const late = count - heard.length;
  while (heard.length < said.length && said.length < 3 * count) { come("more"); line.readBuffer(); }
  return [late, heard.length, said.length, heard.every((one, k) => one === said[k])];
})"""


@needs_browser
def test_what_comes_through_the_memory_is_whole_and_in_its_order(page: Browser) -> None:
    through = _THROUGH_MEMORY % page_files()["socket_worker.js"][1].decode()
    # Memory that holds the longest twice, and is often full; memory with room.
    for size in (150, 1000):
        late, heard, said, same = page.ask(f"{through}({size}, 400)")
        assert (heard == said, same) == (True, True)
        assert (late > 20) is (size == 150)


@needs_browser
def test_friction_takes_energy_and_its_anchor_is_drawn(page: Browser) -> None:
    slide = """((value) => {
      const slider = document.getElementById('friction-coefficient');
      slider.value = value; slider.dispatchEvent(new Event('change'));
    })"""
    page.ask("lab.connection.send('change', { changes: { law: 'H' } })")
    page.until("lab.status.settings.law === 'H' && lab.status.state === 'running'")
    assert page.ask("document.getElementById('taken').hidden")
    limits = page.ask(
        "['min', 'max'].map(end => +document.getElementById('friction-coefficient')[end])"
    )
    assert tuple(limits) == RANGES["friction"]
    page.ask(f"{slide}(0.4)")
    page.until("lab.status.friction && lab.status.state === 'running'")
    page.until("!document.getElementById('taken').hidden")
    page.expect_text("friction-note", "presliding stiffness", exact=False)
    page.ask("lab.hand.setMotion({ motion: 'stroke', pressDepth: 4e-4, strokeAmplitude: 2e-3 })")
    page.until("lab.probeState().anchor && lab.energyMeter.takenByFriction > 2e-4")
    # What friction takes, the hand gives: within what sampling explains.
    page.let_loop_run(1.0)
    taken, given, bound = page.ask("""[lab.energyMeter.takenByFriction,
      lab.energyMeter.energy, lab.energyMeter.samplingBound]""")
    assert abs(taken + given) < bound + 0.2 * taken
    probe, anchor = page.ask("[lab.probeState().probe, lab.probeState().anchor]")
    assert 0.0 < abs(probe[0] - anchor[0]) < 2e-3
    for law, reason in (("A", "would not end its leak"), ("F", "that of law F itself")):
        page.ask(f"lab.connection.send('change', {{ changes: {{ law: '{law}' }} }})")
        page.until(f"lab.status.settings.law === '{law}' && lab.status.state === 'running'")
        page.until(f"document.getElementById('friction-note').textContent.includes({reason!r})")
        page.until("document.getElementById('friction-coefficient').disabled")
        page.until("!lab.probeState().anchor")
    page.ask("lab.hand.setMotion({ motion: 'pointer', isLatched: false })")
    assert page.said == []

"""Two laws side by side on the page: chosen by key, judged at a glance, not offered in the tour."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from tests.lab.browser import Browser, needs_browser
from tests.lab.page.test_recommendation import stiffness_text
from tests.lab.test_state import CONTRASTS

BOTH = (
    "lab.secondLane.isShown && lab.secondLane.status.state === 'running' && lab.secondLane.frame"
    " && lab.hasCurrentPictures && lab.secondLane.pictures.areCurrent"
)


def text(page: Browser, name: str) -> str:
    return str(page.ask(f"document.getElementById('{name}').innerText"))


@pytest.fixture(scope="module", autouse=True)
def two_lanes(page: Browser) -> Iterator[None]:
    """Law A with law H beside it, chosen by keys."""
    page.ask("document.activeElement.blur()")
    assert not page.ask("document.getElementById('beside-section').checkVisibility()")
    page.press("a")
    page.until("lab.status.settings.law === 'A'")
    page.press("2")
    page.until(f"lab.secondLane.status?.settings.law === 'H' && {BOTH}")
    yield
    page.until("!lab.tour.isActive")
    if page.ask("lab.secondLane.isShown"):
        page.press("2")
        page.until("!lab.secondLane.isShown")
    page.press("c")
    page.until("lab.status.settings.law === 'C' && lab.status.state === 'running'")


@needs_browser
def test_a_is_alive_and_h_is_not_under_one_hand(page: Browser) -> None:
    assert [text(page, name) for name in ("section-title", "beside-title")] == ["Law A", "Law H"]
    assert page.ask("[lab.section.hasCurl, lab.secondLane.section.hasCurl]") == [True, False]
    page.ask("Object.assign(lab.hand, { x: 1e-4, y: 0, pressDepth: 2e-4 }); 1")
    page.ask("document.querySelector('#motion [value=loop]').click()")
    page.press("r")
    page.until("/alive: gave/.test(document.getElementById('verdict-first').innerText)")
    assert "⚠" in text(page, "verdict-first")
    page.until("lab.energyMeter.energy > 1e-4")
    page.expect_text("verdict-second", "not alive", exact=False)
    faulty = "[...document.querySelectorAll('figure.faulty')].map(one => one.innerText.slice(0, 5))"
    assert page.ask(faulty) == ["Law A"]
    # The energies count from one moment, and the scales are common.
    assert page.ask("lab.secondLane.energyMeter.energy < 0.3 * lab.energyMeter.energy")
    note = text(page, "beside-note")
    assert note.startswith("Same for both: hand (its motion sample by sample)")
    assert stiffness_text(page.ask("lab.status.settings.stiffness")) in note
    assert "behind" in text(page, "beside-trace-note")
    # Other laws beside each other are other verdicts: here both feed the hand.
    page.ask(
        "{ const field = document.getElementById('beside'); field.value = 'A';"
        "field.dispatchEvent(new Event('change')); }"
    )
    page.until("/alive: gave/.test(document.getElementById('verdict-second').innerText)")
    page.press("2")
    page.until("!lab.secondLane.isShown && lab.status.beside.state === 'stopped'")
    page.expect_text("section-title", "Section below the probe")
    page.ask("document.querySelector('#motion [value=pointer]').click()")
    page.ask("lab.secondLane.lastLaw = 'H'")
    page.press("2")
    page.until(f"lab.secondLane.status?.settings.law === 'H' && {BOTH}")
    assert page.said == []


@needs_browser
def test_loops_are_placed_by_the_field_that_has_curl(page: Browser) -> None:
    """Loops that law H leaves in place go to where law A gains energy, once it is beside it."""
    page.press("2")
    page.until("!lab.secondLane.isShown")
    page.press("h")
    page.until("lab.status.settings.law === 'H' && lab.hasCurrentPictures")
    # About a crest, where the halves of a loop gain opposite energies.
    page.ask("Object.assign(lab.hand, { x: 0.5e-3, y: 0, pressDepth: 2e-4 }); 1")
    page.ask("document.querySelector('#motion [value=loop]').click()")
    assert page.ask("lab.hand.x") == 0.5e-3
    page.ask("lab.secondLane.lastLaw = 'A'")
    page.press("2")
    page.until(f"lab.secondLane.status?.settings.law === 'A' && {BOTH}")
    assert page.ask("[lab.section.hasCurl, lab.secondLane.section.hasCurl]") == [False, True]
    page.until("lab.hand.x !== 0.5e-3")
    page.press("r")
    page.until("/alive: gave/.test(document.getElementById('verdict-second').innerText)")
    page.expect_text("verdict-first", "not alive", exact=False)
    page.ask("document.querySelector('#motion [value=pointer]').click()")
    hint = "document.getElementById('motion-note').textContent"
    page.until(
        f"{hint} === 'The field of law A has curl: loops feed the hand, straight strokes hide it.'"
    )
    page.press("2")
    page.until("!lab.secondLane.isShown")
    page.press("a")
    page.until("lab.status.settings.law === 'A'")
    page.ask("lab.secondLane.lastLaw = 'H'")
    page.press("2")
    page.until(f"lab.secondLane.status?.settings.law === 'H' && {BOTH}")
    assert page.said == []


@needs_browser
@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("size", [(1280, 800), (400, 800)])
def test_all_can_be_read_and_nothing_is_wider_than_the_page(
    page: Browser, dark: bool, size: tuple[int, int]
) -> None:
    page.resize(*size, dark=dark)
    page.ask("new Promise(done => setTimeout(done, 300))")
    first, second = page.ask(
        "['section', 'beside-section'].map(id => document.getElementById(id))"
        ".map(one => one.getBoundingClientRect())"
        ".map(({ x, y, width, height }) => [x, y, width, height])"
    )
    assert first[2:] == pytest.approx(second[2:], abs=1.0)
    is_stacked = second[1] > first[1] + 100
    assert is_stacked == (size[0] == 400)
    assert page.ask("document.documentElement.scrollWidth") <= size[0]
    count, low = page.ask(f"{CONTRASTS}(4.5, 3, 3)")
    assert count > 60
    assert low == []
    page.resize(1280, 900)


@needs_browser
def test_a_file_shows_both_laws(page: Browser) -> None:
    drawing = page.ask("lab.toSvg()")
    assert drawing.count("<svg") == 7
    for law in "AH":
        assert f">law {law}<" in drawing
        assert f">law {law}: force" in drawing


@needs_browser
def test_the_tour_shows_one_law(page: Browser) -> None:
    starts = page.ask("lab.status.start_count")
    page.press("t")
    page.until(f"lab.tour.isActive && lab.status.start_count > {starts}")
    page.until("!lab.secondLane.isShown && lab.status.settings.beside === ''")
    page.until("/guided tour/.test(document.getElementById('beside-note').innerText)")
    page.until("lab.status.beside.state === 'stopped'")
    page.press("2")
    page.press("t")
    page.until(f"!lab.tour.isActive && lab.status.start_count === {starts} + 2")
    # The second law is that of before, in the address, too.
    page.until(f"lab.secondLane.status?.settings.law === 'H' && {BOTH}")
    page.until("location.hash.includes('beside=H')")
    assert page.said == []


@needs_browser
def test_a_tour_that_ends_with_its_page_restores_the_second_law(page: Browser) -> None:
    address = page.ask("location.href.split('#')[0]")
    page.press("t")
    page.until("lab.tour.isActive && lab.status.settings.texture.includes('0.4mm')")
    page.until("lab.status.settings.beside === '' && lab.status.state === 'running'")
    page.call("Page.navigate", url="about:blank")
    page.call("Page.navigate", url=f"{address}?again")  # whose address holds no settings
    page.until(f"globalThis.lab?.status?.has_control && {BOTH}")
    assert page.ask("lab.secondLane.status.settings.law") == "H"


@needs_browser
def test_a_field_with_curl_is_never_said_to_be_not_alive(page: Browser) -> None:
    """What sampling may explain is no proof that the field gains nothing."""
    findings = """((hasCurl, energy) => {
      const verdict = Object.create(lab.secondLane.verdicts[0]);
      Object.assign(verdict, { hasCurl, energyMeter: { energy, suppliesEnergy: false } });
      return verdict.findings[0];
    })"""
    for energy in (0.0, 4.27e-3):
        text, is_fault = page.ask(f"{findings}(true, {energy})")
        assert "not alive" not in text
        assert text.startswith("has curl")
        assert not is_fault
        assert page.ask(f"{findings}(false, {energy})")[0].startswith("not alive")
    assert "4.27 mJ" in page.ask(f"{findings}(true, 4.27e-3)")[0]


@needs_browser
def test_traces_of_long_strokes_show_a_line_in_a_faint_band(page: Browser) -> None:
    """A force that varies faster than the picture resolves is no filled block."""
    opaque = page.ask("""(() => {
      const { columns } = lab.connection.layout, width = Object.keys(columns).length;
      const plot = new lab.traces.constructor(document.createElement("canvas"));
      const stroke = {};
      plot.scaledCanvas = { clear: () => [context, 800, 300] };
      const canvas = Object.assign(document.createElement("canvas"), { width: 800, height: 300 });
      const context = canvas.getContext("2d");
      for (let k = 0; k < 500; k++) {
        const row = new Float64Array(width), low = new Float64Array(width).fill(-1);
        row[columns.time ?? 0] = 0.01 * k;
        plot.addFrame({ newest: row, minima: low, maxima: low.map(value => -value) }, columns);
      }
      plot.draw(0);
      const strip = context.getImageData(100, 110, 600, 80).data;
      let count = 0;
      for (let k = 3; k < strip.length; k += 4) count += strip[k] > 200;
      return count / (600 * 80);
    })()""")
    assert 0.005 < opaque < 0.2


@needs_browser
def test_the_second_pane_names_the_law_that_was_chosen_before_its_loop_runs(page: Browser) -> None:
    """Its session has the law of the first lane until it is started."""
    titles = page.ask("""(() => {
      const { secondLane, status } = lab, { law } = status.settings;
      const settings = { ...status.settings, beside: law === "H" ? "A" : "H" };
      const beside = { ...status.beside, state: "starting", message: "", settings };
      beside.settings = { ...settings, law };
      secondLane.setStatus({ ...status, settings, beside });
      const names = ["beside-title", "beside-trace-title", "second-curve"];
      const found = names.map(name => document.getElementById(name).textContent.toLowerCase());
      secondLane.setStatus(status);
      return [`law ${settings.beside}`.toLowerCase(), ...found];
    })()""")
    assert titles == [titles[0]] * 4


@needs_browser
def test_a_narrow_pane_requests_a_box_that_the_server_accepts(page: Browser) -> None:
    left, right, bottom, top = page.ask("""(() => {
      const canvas = lab.section.scaledCanvas, { width } = canvas;
      canvas.width = 2;
      const box = lab.sectionBox();
      canvas.width = width;
      return box;
    })()""")
    assert 0.0 < top - bottom <= 4.0 * (right - left)

"""axe-core finds nothing wrong with the page; not run where there is no axe.min.js."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import pytest
from tests.lab.axe import AXE, needs_axe
from tests.lab.browser import Browser, needs_browser
from tests.lab.page.test_motions import use_device

_RUN = (
    "axe.run(document, {resultTypes: ['violations']}).then(({violations, passes}) => ["
    "passes.length, violations.map(({id, nodes}) =>"
    " `${id}: ${nodes.map(({html, failureSummary}) => html + failureSummary).join('; ')}`)])"
)


LOOKS = ((1280, False), (1280, True), (400, False), (400, True))  # width, and whether it is dark


def violations(page: Browser) -> list[str]:
    """Return what axe-core finds wrong, after a check that it has found anything at all."""
    assert AXE is not None
    page.ask("new Promise(done => setTimeout(done, 300))")
    if not page.ask("Boolean(globalThis.axe)"):
        page.ask(f"{AXE.read_text(encoding='utf-8')}; 1")
    passes, found = page.ask(_RUN)
    assert passes > 20
    return list(found)


def check_looks(page: Browser, looks: Sequence[tuple[int, bool]] = LOOKS[::3]) -> None:
    """Check the page as it is in some looks, by default in the first and the last."""
    for width, dark in looks:
        page.resize(width, 800, dark=dark)
        assert violations(page) == [], (width, dark)


@pytest.fixture
def everything_open(page: Browser) -> Iterator[None]:
    """All parts that can be folded are open."""
    page.until("lab.status.recommendation.reason && lab.hasCurrentPictures")
    page.ask("for (const part of document.querySelectorAll('details')) part.open = true; 1")
    yield
    page.ask("for (const part of document.querySelectorAll('details')) part.open = false; 1")
    page.resize(1280, 900)


@needs_browser
@needs_axe
@pytest.mark.usefixtures("everything_open")
def test_axe_finds_nothing(page: Browser) -> None:
    check_looks(page, LOOKS)
    # A field that feeds the hand, above the limit of a light device, with a hint; then the loops.
    former = page.ask("lab.status.settings.device")
    use_device(page, "touch-x")
    page.press("a")
    page.until("lab.status.settings.law === 'A' && lab.hasCurrentPictures")
    page.ask(
        "{ const slider = document.getElementById('stiffness');"
        "slider.value = 660; slider.dispatchEvent(new Event('change')); }"
    )
    page.until("document.getElementById('motion-note').textContent")
    page.until("document.querySelector('.above-limit') !== null")
    check_looks(page)
    page.ask("document.querySelector('#motion [value=loop]').click()")
    page.until("lab.energyMeter.suppliesEnergy")
    check_looks(page)
    page.ask("document.querySelector('#motion [value=pointer]').click()")
    # The tour, before and after its first step.
    page.press("t")
    page.until("lab.tour.isActive && lab.status.state === 'running'")
    check_looks(page)
    page.press("v")
    page.until("document.querySelector('#tour.completed') !== null")
    check_looks(page)
    page.press("t")
    page.until("lab.status.state === 'running' && !lab.tour.isActive")
    use_device(page, former)


@needs_browser
@needs_axe
@pytest.mark.usefixtures("everything_open")
def test_axe_finds_what_is_wrong(page: Browser) -> None:
    page.ask("document.getElementById('texture').insertAdjacentHTML('afterend', '<input>'); 1")
    (found,) = violations(page)
    assert found.startswith("label: ")
    page.ask("document.querySelector('#texture + input').remove(); 1")
    page.ask("document.getElementById('surface').style.color = '#c0c0c0'; 1")
    (found,) = violations(page)
    assert found.startswith("color-contrast: ")
    page.ask("document.getElementById('surface').style.color = ''; 1")

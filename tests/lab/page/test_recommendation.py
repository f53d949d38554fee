"""The page shows what the command compare recommends, and applies it."""

from __future__ import annotations

import random

from tests.lab.browser import Browser, needs_browser
from tests.lab.page.test_motions import render

import asperity as asp
from asperity.lab.scene_state import make_scene_state
from asperity.report.sentences.texts import limit_text
from asperity.scene import load_scene

DEPTH = 1e-6 * round(random.uniform(300.0, 340.0), 3)
"""[m]; another in each run, so that no result is in the cache."""


def text(page: Browser, name: str) -> str:
    return str(page.ask(f"document.getElementById('{name}').textContent"))


def stiffness_text(value: float) -> str:
    """Return a stiffness [N/m] as the page shows it."""
    return f"{float(f'{value:.3g}'):.10g} N/m"


def change_depth(page: Browser, depth: float) -> None:
    page.ask(
        "{ const field = document.getElementById('max_depth');"
        f"field.value = '{1e3 * depth:.6f}'; field.dispatchEvent(new Event('change')); }}"
    )
    page.until(f"Math.abs(lab.status.settings.max_depth - {depth}) < 1e-12")


@needs_browser
def test_the_recommendation_comes_from_compare_and_is_applied(page: Browser) -> None:
    settings = page.ask("lab.status.settings")
    change_depth(page, DEPTH)
    # Nothing of the former depth is shown, and the loop runs meanwhile.
    page.until("!lab.status.recommendation.reason")
    assert text(page, "recommendation") == "computing …"
    assert page.ask("document.getElementById('apply-recommendation').hidden")
    row = page.ask("lab.frame.firstRow")
    page.until(f"lab.frame.firstRow > {row} + 100 && !lab.status.recommendation.reason")
    page.until("lab.status.recommendation.reason")
    depth = page.ask("lab.status.settings.max_depth")
    used = {"max_depth": depth, "device": settings["device"]}
    state = make_scene_state(load_scene(settings["texture"])).with_changes(used)
    surface = state.setup.surface
    result = asp.compare(surface.texture, state.rated_device, max_depth=depth, clamp=surface.clamp)
    best = result.recommended_row
    assert best is not None
    assert page.ask("lab.status.recommendation.reason") == result.recommendation
    named = f"law {best.law.letter} at {stiffness_text(best.recommended_stiffness)}"
    page.expect_text("recommendation", f"{named}: {best.tier}")
    note = text(page, "recommendation-note")
    assert f"limit {limit_text(best.stability_limit.stiffness)} (plausible)" in note
    assert "Assumed hand: tool held like a pen" in text(page, "recommendation-reason")
    # Applied by the button, as a user does it.
    page.expect_text("apply-recommendation", f"Use {named}")
    page.ask("document.getElementById('apply-recommendation').click()")
    page.until(
        f"lab.status.settings.law === '{best.law.letter}' && lab.status.state === 'running'"
        f"&& lab.status.settings.stiffness === {best.recommended_stiffness}"
    )
    # The law is no reason to compare again.
    page.expect_text("recommendation", f"{named}: {best.tier}")
    assert page.ask("document.getElementById('apply-recommendation').disabled")
    assert page.said == []
    # Other tests continue with the same lab.
    change_depth(page, settings["max_depth"])
    render(page, settings["law"], settings["stiffness"])


@needs_browser
def test_a_device_that_cannot_be_compared_says_why(page: Browser) -> None:
    former = page.ask("lab.status.settings.device")
    page.ask(
        "{ const field = document.getElementById('device'); field.value = '2diy';"
        "field.dispatchEvent(new Event('change')); }"
    )
    page.until("lab.status.settings.device === '2diy' && lab.status.recommendation.reason")
    page.expect_text("recommendation", "none")
    assert "needs max_stiffness to compare laws" in text(page, "recommendation-note")
    assert page.ask("document.getElementById('apply-recommendation').hidden")
    page.ask(
        f"{{ const field = document.getElementById('device'); field.value = '{former}';"
        "field.dispatchEvent(new Event('change')); }"
    )
    page.until(f"lab.status.settings.device === '{former}' && lab.status.state === 'running'")

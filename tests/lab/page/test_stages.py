"""The guided tour begins from any stage, and all of that is given back at its end."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from queue import Queue
from typing import Any

import pytest
from tests.lab.browser import Browser, needs_browser
from tests.lab.started import Started

from asperity.core.errors import ParameterError
from asperity.lab.scene_state import (
    PREVIOUS_SCENE,
    TOUR_SCENE,
    SavedScenes,
    SceneState,
    make_scene_state,
)
from asperity.lab.session import Session
from asperity.scene import load_scene
from asperity.simulation import SpringHand

PAGE = Path(__file__).parents[3] / "src/asperity/lab/page/tour.js"
SCENE = """
[texture]
kind = "knurl"
[surface]
law = "F"
stiffness = "300 N/m"
friction = 0.3
clamp = "lateral"
[device]
"""
BAND = '[hand]\nkind = "band"\ntension = "0.03 N"\nstiffness = "150 N/m"\ndamping = "0.5 N*s/m"\n'
SPRING = """[hand]
kind = "spring"
stiffness = ["300 N/m", "300 N/m", "0 N/m"]
force = ["0 N", "0 N", "-1 N"]
"""
OWN = 'id = "touch-x"\napparent_mass = "33 g"\nmax_force = "3 N"\ndelay_samples = 2\n'
FIVE = 'id = "pantograph"\njoint_damping = "4 mN*m*s"\n'
PLACE = '[run]\ncentre = ["-10 mm", "95 mm"]\nbrakes = "always"\n'
SCENES = {
    "band": OWN + BAND,
    "spring with a force": OWN + SPRING,
    "five-bar": FIVE + SPRING + PLACE,
    "five-bar and band": FIVE + BAND,
}


def stage_of(name: str, folder: Path) -> SceneState:
    path = folder / "scene.toml"
    path.write_text(SCENE + SCENES[name])
    return make_scene_state(load_scene(str(path)), str(path)).with_changes({"magnify": 1.3})


def tour_settings() -> dict[str, Any]:
    """Return what all steps of the tour set, as the page does."""
    block = re.search(r"const TOUR_SETTINGS = \{.*?\n(.*?)\};", PAGE.read_text("utf-8"), re.DOTALL)
    assert block is not None
    pairs = re.findall(r'(\w+): ("[^"]*"|[\d.e-]+)', block[1])
    return {name: value[1:-1] if value[0] == '"' else float(value) for name, value in pairs}


@pytest.mark.parametrize("name", SCENES)
def test_the_tour_knows_its_own_stage_and_no_other(tmp_path: Path, name: str) -> None:
    stage, stages, wanted = stage_of(name, tmp_path), SavedScenes(), tour_settings()
    assert len(wanted) == 9
    tour = stages.apply_changes(stage, {"saved_scene": TOUR_SCENE, **wanted})
    plain = make_scene_state(load_scene("sinusoid:amplitude=0.4mm,period=2mm")).with_changes(wanted)
    for part in ("surface", "hand", "servo", "plant", "safety"):
        assert str(getattr(tour.setup, part)) == str(getattr(plain.setup, part))
    assert isinstance(tour.setup.hand, SpringHand)
    # A second beginning, as after a reload of the page, forgets nothing.
    again = stages.apply_changes(
        tour.with_changes({"law": "H"}), {"saved_scene": TOUR_SCENE, **wanted}
    )
    assert (
        stages.apply_changes(
            again.with_changes({"law": "D", "delay": 1}), {"saved_scene": PREVIOUS_SCENE}
        )
        is stage
    )
    # There is nothing more to go back to.
    assert stages.apply_changes(tour, {"saved_scene": PREVIOUS_SCENE}) is tour
    with pytest.raises(ParameterError, match="saved_scene is not stored"):
        stages.apply_changes(stage, {"saved_scene": "beside"})


def test_without_that_the_hand_of_the_tour_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="is an elastic band without"):
        stage_of("band", tmp_path).with_changes(tour_settings())


def test_wishes_for_the_stage_before_are_not_made_of_the_next(tmp_path: Path) -> None:
    session = Session(stage_of("band", tmp_path), lambda: None)
    try:
        session._requests = Queue()
        for changes in (
            {"law": "A"},
            {"saved_scene": TOUR_SCENE, "law": "W"},
            {"stiffness": 9.0},
            {"saved_scene": PREVIOUS_SCENE},
            {"law": "H"},
        ):
            session.change(changes)
        assert session._next_requests() == [
            {"law": "A"},
            {"saved_scene": TOUR_SCENE, "law": "W", "stiffness": 9.0},
            {"saved_scene": PREVIOUS_SCENE, "law": "H"},
        ]
    finally:
        assert session.pointer_hand is not None
        session.pointer_hand.close()


def test_what_a_page_requested_before_it_was_closed_is_not_done(tmp_path: Path) -> None:
    session = Session(stage_of("band", tmp_path), lambda: None)
    try:
        for changes in ({"saved_scene": TOUR_SCENE, "law": "W"}, {"law": "A"}):
            session.change(changes)
        session.start()
        session.end_tour()
        requests = session._next_requests()
        assert [one for one in requests if isinstance(one, Mapping)] == [
            {"saved_scene": PREVIOUS_SCENE}
        ]
        assert len(requests) == 2  # the start is still there
        # Without a tour the changes of a page that is closed are done.
        session.change({"law": "A"})
        session.end_tour()
        assert session._next_requests() == [{"law": "A"}]
        # There was no tour: a loop that is stopped stays so.
        session._apply_changes({"saved_scene": PREVIOUS_SCENE})
        assert session.start_count == 0
    finally:
        assert session.pointer_hand is not None
        session.pointer_hand.close()


@pytest.fixture
def toured(tmp_path: Path, browser: Browser) -> Iterator[Browser]:
    """The page of a lab whose hand is a band on a device of its own."""
    stage_of("band", tmp_path)
    lab = Started(str(tmp_path / "scene.toml"))
    browser.said.clear()
    browser.resize(1280, 900)
    browser.call("Page.navigate", url=lab.address)
    browser.until("globalThis.lab?.frame && lab.hasPictures && lab.status.state === 'running'")
    yield browser
    browser.call("Page.navigate", url="about:blank")
    assert lab.end() == (0, "")


@needs_browser
def test_the_tour_is_shown_with_a_band_and_gives_it_back(toured: Browser) -> None:
    page = toured
    page.press("+")
    page.press("m")
    page.press("m")
    page.press("m")
    former, span = page.ask("lab.status.settings"), page.ask("lab.viewWidth")
    page.press("t")
    page.press("v")
    for _step in range(2):
        page.until("lab.tour.isStepCompleted")
        page.press("n")
    page.until("document.getElementById('alarm').hidden")  # once the next law has compiled
    assert page.ask("lab.status.settings.hand_stiffness") == 800
    page.press("t")
    page.until(f"lab.status.settings.device === '{former['device']}'")
    page.until("lab.status.state === 'running'")
    assert page.ask("lab.status.settings") == former
    assert page.ask("lab.viewWidth") == pytest.approx(span)
    # A band has no such number: nothing of the tour's stands in the field.
    field = page.ask(
        "(({ value, disabled }) => [value, disabled])(document.getElementById('hand_stiffness'))"
    )
    assert field == ["", True]
    assert page.said == []

"""What is shown at first, and what the page may change of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from asperity.core.errors import ParameterError
from asperity.lab.scene_state import DEFAULT_SURFACE, SceneState, make_scene_state
from asperity.scene import load_scene
from asperity.scene.scene_keys import scene_template
from asperity.textures import Sinusoid


@pytest.fixture(scope="module")
def stage() -> SceneState:
    return make_scene_state(load_scene(DEFAULT_SURFACE))


@pytest.mark.parametrize(
    "changes",
    [
        {"law": "H"},
        {"stiffness": 700.0},
        {"max_depth": 1e-3},
        {"continuity": 0.5, "law": "H"},
        {"magnify_height": 2.0, "magnify": 3.0},
        {"texture": "grating:height=100um,period=3mm"},
        {"law": "B", "stiffness": 50.0},
    ],
)
def test_a_surface_changes_while_the_loop_runs(stage: SceneState, changes: dict[str, Any]) -> None:
    changed = stage.with_changes(changes)
    assert not stage.needs_restart(changed)
    assert {name: changed.settings[name] for name in changes} == changes


def test_a_surface_is_magnified_and_comes_back(stage: SceneState) -> None:
    assert isinstance(plain := stage.setup.surface.texture, Sinusoid)
    larger = stage.with_changes({"magnify": 3.0}).with_changes(
        {"magnify_height": 2.0, "device": "omega.3"}
    )
    assert isinstance(shown := larger.setup.surface.texture, Sinusoid)
    assert shown.period == pytest.approx(3.0 * plain.period)
    assert shown.amplitude == pytest.approx(2.0 * plain.amplitude)
    assert larger.with_changes({"magnify": 1.0}).setup.surface.texture is plain
    other = stage.with_changes({"texture": "grating:height=100um,period=3mm", "magnify": 2.0})
    assert other.settings["magnify"] == 2.0
    assert (
        other.with_changes({"texture": DEFAULT_SURFACE, "magnify": 1.0}).setup.surface.texture
        is plain
    )


@pytest.mark.parametrize(
    "changes",
    [{"device": "premium-1.5"}, {"delay": 3}, {"hand_stiffness": 900.0}, {"hand_damping": 1.0}],
)
def test_device_delay_and_hand_take_another_loop(
    stage: SceneState, changes: dict[str, Any]
) -> None:
    changed = stage.with_changes({"law": "A", **changes})
    assert stage.needs_restart(changed)
    assert changed.settings == {**stage.settings, "law": "A", **changes}


def test_the_limit_is_asked_for_with_the_delay_that_was_chosen(stage: SceneState) -> None:
    assert stage.rated_device is stage.setup.device
    late = stage.with_changes({"delay": 4})
    assert late.rated_device.value("delay_samples") == 4.0
    assert late.setup.device.value("delay_samples") is None
    assert late.with_changes({"delay": 0}).rated_device is stage.setup.device


def test_several_wishes_come_together_in_any_order(stage: SceneState) -> None:
    one = stage.with_changes({"delay": 2, "device": "touch", "stiffness": 400.0})
    other = stage.with_changes({"stiffness": 400.0, "device": "touch", "delay": 2})
    assert one.settings == other.settings
    assert one.settings["device"] == "touch"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"stiffness": 0.5}, "stiffness must be 1 to 20000"),
        ({"stiffness": "many"}, "stiffness"),
        ({"delay": 101}, "delay must be 0 to 100"),
        ({"law": "Q"}, "law"),
        ({"modulation_depth": 0.5}, "modulation_depth cannot be changed"),  # law C has none
        ({"law": "F", "friction": -1.0}, "friction"),
        ({"magnify": 0.0}, "magnify must be 0.01 to 1000"),
        ({"texture": "examples/demo.toml"}, "texture must be a kind"),
        ({"texture": "/etc/passwd"}, "texture must be a kind"),
        ({"texture": "file:path=/etc/passwd"}, "texture must be a kind"),
        ({"device": "./mine.TOML"}, "device must be a device of the catalogue"),
        ({"colour": "red"}, "colour cannot be changed"),
    ],
)
def test_what_cannot_be_is_refused(stage: SceneState, changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        stage.with_changes(changes)


def test_a_scene_keeps_its_own_hand_and_law(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(scene_template())
    shown = make_scene_state(load_scene(str(path)), str(path), {"stiffness": 123.0})
    assert shown.settings["hand_stiffness"] == 300.0
    assert shown.settings["stiffness"] == 123.0
    assert shown.setup.servo.period == 1e-3
    # Nobody is harmed, so what ends a real loop is only counted.
    assert shown.setup.safety.beyond_depth == "warn"


def test_a_surface_that_ends_is_felt_in_its_middle(tmp_path: Path) -> None:
    from PIL import Image

    path = tmp_path / "map.png"
    Image.effect_noise((40, 30), 20.0).save(path)
    scene = load_scene(str(path), {"pitch": 1e-4, "height_range": 1e-4})
    stage = make_scene_state(scene, str(path))
    assert stage.centre == pytest.approx((1.95e-3, 1.45e-3), abs=1e-4)
    # The page may come back to the file of the start, which it cannot name otherwise.
    away = stage.with_changes({"texture": DEFAULT_SURFACE})
    assert away.with_changes({"texture": str(path)}).setup.surface.texture is scene.texture


def test_friction_is_changed_and_kept_for_the_next_law_that_can_have_it() -> None:
    state = make_scene_state(load_scene("sinusoid:amplitude=0.2mm,period=2mm"))
    assert state.settings["friction"] == 0.0
    slides = state.with_changes({"law": "H", "friction": 0.4})
    assert slides.settings["friction"] == 0.4
    assert slides.setup.surface.contact_friction is not None
    leaks = slides.with_changes({"law": "A"})
    assert leaks.settings["friction"] == 0.0  # it would not end the leak
    assert leaks.with_changes({"law": "W"}).settings["friction"] == 0.4
    ice = slides.with_changes({"friction": 0.0})
    assert ice.setup.surface.contact_friction is None
    # Law F has friction of its own, which that of a surface without friction is not.
    assert ice.with_changes({"law": "F"}).settings["friction"] == 0.8
    assert ice.with_changes({"law": "F", "friction": 0.0}).settings["friction"] == 0.0
    with pytest.raises(ParameterError, match="friction must be 0 to 2"):
        state.with_changes({"friction": -0.1})

"""The scene of a recording: recorded values are restored, missing ones replaced by defaults."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from asperity.recording.recording import open_recording
from asperity.scene import load_scene
from asperity.scene.recorded_scene import load_recorded_scene
from asperity.scene.setup import Setup, make_setup

SCENE = """
[texture]
kind = "sinusoid"
amplitude = "0.2 mm"
period = "2 mm"
[surface]
law = "C"
stiffness = "300 N/m"
[device]
id = "touch"
damping = "0.5 N*s/m"
update_rate = "2 kHz"
[hand]
kind = "spring"
stiffness = ["300 N/m", "200 N/m", "100 N/m"]
damping = "3 N*s/m"
[motion]
kind = "still"
point = ["0.3 mm", "0 mm", "-0.5 mm"]
[run]
duration = "0.02 s"
velocity_share = 0.4
"""


@pytest.fixture(scope="module")
def setup(tmp_path_factory: pytest.TempPathFactory) -> Setup:
    path = tmp_path_factory.mktemp("scene") / "scene.toml"
    path.write_text(SCENE, encoding="utf-8")
    return make_setup(load_scene(str(path)))


def test_surface_and_device_are_restored(setup: Setup, tmp_path: Path) -> None:
    setup.simulate(trace=tmp_path / "run.mcap")
    scene, notes = load_recorded_scene(open_recording(tmp_path / "run.mcap"))
    assert scene.surface["law"].letter == "C"
    assert (scene.surface["stiffness"], scene.surface["max_depth"]) == (300.0, 0.4e-3)
    points = np.random.default_rng(0).uniform(-3e-3, 3e-3, (50, 2))
    np.testing.assert_array_equal(
        scene.texture.height(points), setup.surface.texture.height(points)
    )
    assert scene.device is not None
    assert scene.device.id == "touch"
    assert scene.device.value("damping") == 0.5
    assert scene.device.value("update_rate") == 2000.0
    assert scene.loop["run"]["velocity_share"] == 0.4
    assert "motion" not in scene.loop  # given by the recorded rows
    assert not any("device" in note for note in notes)


def test_hand_of_a_simulated_loop_is_restored(setup: Setup, tmp_path: Path) -> None:
    setup.simulate(trace=tmp_path / "run.mcap")
    scene, notes = load_recorded_scene(open_recording(tmp_path / "run.mcap"))
    assert scene.loop["hand"]["kind"] == "spring"
    assert scene.loop["hand"]["stiffness"] == ["300.0 N/m", "200.0 N/m", "100.0 N/m"]
    assert notes == ()

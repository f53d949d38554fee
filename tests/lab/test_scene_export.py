"""What is saved does the same again: on any surface, device and hand, wherever it is moved to."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from tests.helpers.user_modules import imported

import asperity as asp
from asperity.cli.plugins import plugin_contents
from asperity.core.files import to_plain_data
from asperity.lab.clips import HAND_FILE, RECORDING_FILE, SCENE_FILE, Clip, extract_clip
from asperity.lab.scene_state import SceneState, make_scene_state
from asperity.recording import recorded_field as field
from asperity.recording.recording import open_recording
from asperity.scene import load_scene
from asperity.scene.setup import Setup, make_setup
from asperity.servo.driver_loop import DriverLoop, build_program, no_clock
from asperity.servo.drivers.pointer import PointerHand, pointer_driver
from asperity.servo.fault import EndReason
from asperity.servo.loop_memory import LoopMemory

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENES = """
[texture]
kind = "sinusoid"
amplitude = "0.2 mm"
period = "2 mm"
[surface]
law = "C"
stiffness = "300 N/m"
[device]
"""
SPRING = (
    '[hand]\nkind = "spring"\nstiffness = ["500 N/m", "400 N/m", "600 N/m"]\ndamping = "3 N*s/m"\n'
)
BAND = '[hand]\nkind = "band"\ntension = "0.2 N"\ndamping = "0.5 N*s/m"\n'
MASS = 'id = "touch-x"\napparent_mass = "60 g"\n'
FIVE = 'id = "pantograph"\njoint_damping = "4 mN*m*s"\nupdate_rate = "1 kHz"\n'
PLACE = '[run]\ncentre = ["-10 mm", "95 mm"]\nbrakes = "always"\nvelocity_share = 0.4\n'
KINDS = {
    "kind": "sinusoid:amplitude=0.2mm,period=2mm",
    "knurl": "knurl:profile_angle=150deg,flat=0.5",
    "band": SCENES + MASS + BAND,
    "five-bar": SCENES + FIVE + SPRING + PLACE,
    "five-bar and band": SCENES + FIVE + BAND,
    "measured": "map.png",
}
LAST_BIT = 1e-15  # m or N: law H searches from where it was, and may end in another last bit


def made(name: str, folder: Path) -> SceneState:
    """Return a stage by the name of what is special of it."""
    text = KINDS[name]
    if name == "measured":
        Image.effect_noise((40, 30), 20.0).save(folder / text)
        told = {"pitch": 2e-4, "height_range": 2e-4, "s_cutoff": 8e-4}
        return make_scene_state(
            load_scene(str(folder / text), told), str(folder / text), preparation=told
        )
    if "[" not in text:
        return make_scene_state(load_scene(text), text)
    (folder / "scene.toml").write_text(text)
    return make_scene_state(load_scene(str(folder / "scene.toml")), str(folder / "scene.toml"))


def felt(stage: SceneState, duration: float = 0.9) -> Clip:
    """Let a hand go round, up, down into the surface and up, as fast as it can be computed."""
    setup, shared = stage.setup, LoopMemory()
    samples = round(duration / setup.servo.period)
    x, y = stage.centre
    low, high = setup.surface.texture.extremes
    place = y if y else 0.0
    wheel = PointerHand((x + 1e-3, place, high + 6e-4))
    middle = 0.5 * (low + high)
    wheel.request_motion(
        (x, place, middle), (1e-3, 0.0, 0.0), (0.0, 0.0, high - middle + 6e-4), 9.0
    )
    driver = pointer_driver(setup.plant, setup.hand, setup.servo, wheel)
    with wheel:
        loop = DriverLoop(driver, setup.servo, setup.safety, 1.0, shared.block(), no_clock())
        cause, _code = loop.run(build_program(setup.rendered, driver), driver.open(), samples)
        assert cause is EndReason.FINISHED
        return extract_clip(stage, shared, wheel)


def unpacked(kept: Clip, folder: Path) -> Path:
    folder.mkdir()
    zipfile.ZipFile(BytesIO(kept.archive())).extractall(folder)
    return folder


def again(folder: Path) -> Setup:
    return make_setup(load_scene(str(folder / SCENE_FILE)))


@pytest.mark.parametrize(("law", "magnified"), [("C", 1.7), ("H", 1.0)])
@pytest.mark.parametrize("name", KINDS)
def test_the_scene_does_the_same_again(
    tmp_path: Path, name: str, law: str, magnified: float
) -> None:
    folder = tmp_path / "here"
    folder.mkdir()
    stage = made(name, folder).with_changes({"law": law, "magnify": magnified, "delay": 1})
    kept = felt(stage)
    place = unpacked(kept, tmp_path / "there")
    shutil.rmtree(folder)  # the archive was moved, and what was measured is gone
    setup = again(place)
    for part in ("servo", "plant", "hand"):
        assert to_plain_data(getattr(setup, part)) == to_plain_data(getattr(stage.setup, part))
    run = setup.simulate()
    assert len(run.table) == len(kept.rows) > 600
    most = LAST_BIT if law == "H" else 0.0
    assert np.abs(run.position - kept.rows[:, 1:4]).max() <= most
    assert np.abs(run.commanded - kept.rows[:, 4:7]).max() <= most
    assert np.abs(kept.rows[:, 4:7]).max() > 0.05
    found = asp.replay(open_recording(place / RECORDING_FILE))
    assert found.max_force_difference <= most
    assert found.is_identical or law == "H"


def test_what_a_law_held_before_is_not_in_it(tmp_path: Path) -> None:
    kept = felt(made("kind", tmp_path).with_changes({"law": "F"}))
    place = unpacked(kept, tmp_path / "there")
    recording = open_recording(place / RECORDING_FILE)
    assert asp.replay(recording).is_identical
    assert recording["law anchor x"].any()
    assert np.abs(again(place).simulate().commanded - kept.rows[:, 4:7]).max() == 0.0


def test_a_first_mode_is_in_the_scene(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(
        SCENES + 'id = "omega.3"\nbandwidth = "200 Hz"\n' + SPRING + "[run]\nresonance = true\n"
    )
    stage = make_scene_state(load_scene(str(tmp_path / "scene.toml")), str(tmp_path / "scene.toml"))
    kept = felt(stage, 4.0)
    setup = again(unpacked(kept, tmp_path / "there"))
    assert to_plain_data(setup.plant) == to_plain_data(stage.setup.plant)
    # How its two masses swing at the beginning is not: that dies out.
    away = np.abs(setup.simulate().position - kept.rows[:, 1:4])
    assert away.max() < 1e-5
    assert away[-200:].max() < 1e-7


def test_a_surface_that_is_too_large_is_named_by_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = felt(made("measured", tmp_path))
    monkeypatch.setattr(field, "MAX_BYTES", 1000)
    place = unpacked(kept, tmp_path / "there")
    assert str(tmp_path / "map.png") in (place / SCENE_FILE).read_text()
    run = again(place).simulate()
    assert np.abs(run.commanded - kept.rows[:, 4:7]).max() == 0.0


def test_a_law_of_ones_own_is_in_the_archive_and_named(
    tmp_path: Path, own_law: dict[str, Any]
) -> None:
    (letter,) = own_law
    stage = made("kind", tmp_path).with_changes({"law": letter})
    kept = felt(replace(stage, plugin_files=plugin_contents()))
    place = unpacked(kept, tmp_path / "there")
    assert {path.name for path in place.iterdir()} == {
        RECORDING_FILE,
        SCENE_FILE,
        HAND_FILE,
        "own_law.py",
    }
    assert (place / "own_law.py").read_bytes() == (EXAMPLES / "own_law.py").read_bytes()
    first = (place / SCENE_FILE).read_text().splitlines()[0]
    assert first == "# In this folder: asperity simulate scene.toml --plugin own_law.py"
    run = again(place).simulate()
    assert np.abs(run.commanded - kept.rows[:, 4:7]).max() == 0.0
    assert np.abs(kept.rows[:, 4:7]).max() > 0.05
    # As it is typed in another process; without the file the law is not known.
    for words, code in (
        (first.partition("asperity ")[2].split(), 0),
        (["simulate", SCENE_FILE], 2),
    ):
        command = [sys.executable, "-m", "asperity", *words]
        done = subprocess.run(command, cwd=place, capture_output=True, check=False, timeout=120)
        assert done.returncode == code


def test_files_of_one_name_stand_beside_each_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = []
    for place in ("one", "two"):
        (tmp_path / place).mkdir()
        (tmp_path / place / "law.py").write_text(place)
        files.append(str(tmp_path / place / "law.py"))
    monkeypatch.setattr("asperity.cli.plugins._LOADED_FILES", files)
    assert plugin_contents() == {"law.py": b"one", "1_law.py": b"two"}


def test_a_texture_of_ones_own_is_made_from_what_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "my_eggs.py").write_text((EXAMPLES / "own_texture.py").read_text())
    with imported(tmp_path, "my_eggs") as own:
        monkeypatch.setitem(asp.textures.catalogue.CATALOGUE, "egg-box", own.EGG_BOX)
        stage = made("kind", tmp_path).with_changes(
            {"texture": "egg-box:amplitude=0.1mm,period=2mm"}
        )
        for magnified in (1.0, 1.5):
            kept = felt(stage.with_changes({"magnify": magnified}))
            run = again(unpacked(kept, tmp_path / f"there {magnified}")).simulate()
            assert np.abs(run.commanded - kept.rows[:, 4:7]).max() == 0.0

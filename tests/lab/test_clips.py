"""What was felt is kept: the recording replays, and the scene does the same again."""

from __future__ import annotations

import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.lab.clips import (
    HAND_FILE,
    RECORDING_FILE,
    SCENE_FILE,
    Clip,
    _find_segment,
    extract_clip,
)
from asperity.lab.scene_state import SceneState, make_scene_state
from asperity.loop.shared_trace import COLUMNS
from asperity.recording.recording import open_recording
from asperity.recording.replay import replay
from asperity.scene import load_scene
from asperity.scene.setup import make_setup
from asperity.servo.driver_loop import DriverLoop, build_program, no_clock
from asperity.servo.drivers.pointer import PointerHand, pointer_driver
from asperity.servo.fault import EndReason
from asperity.servo.loop_memory import LoopMemory

LAW = "C"
SURFACE = "sinusoid:amplitude=0.2mm,period=2mm"


def felt(stage: SceneState, duration: float) -> tuple[LoopMemory, PointerHand]:
    """Let a hand go round, up, down into the surface and up, as fast as it can be computed."""
    setup, shared, wheel = stage.setup, LoopMemory(), PointerHand((2e-3, 0.0, 6e-4))
    samples = round(duration / setup.servo.period)
    driver = pointer_driver(setup.plant, setup.hand, setup.servo, wheel)
    wheel.request_motion((0.0, 0.0, 6e-4), (2e-3, 0.0, 0.0), (0.0, 0.0, 1e-3), 9.0)
    loop = DriverLoop(driver, setup.servo, setup.safety, 1.0, shared.block(), no_clock())
    cause, _code = loop.run(build_program(setup.surface, driver), driver.open(), samples)
    assert cause is EndReason.FINISHED
    return shared, wheel


@pytest.fixture(scope="module")
def stage() -> SceneState:
    first = make_scene_state(load_scene(SURFACE), SURFACE)
    return first.with_changes({"law": LAW, "magnify": 1.5, "delay": 2, "hand_damping": 2.0})


@pytest.fixture(scope="module")
def kept(stage: SceneState) -> Clip:
    shared, wheel = felt(stage, 0.9)
    with wheel:
        return extract_clip(stage, shared, wheel)


def test_the_recording_replays_bit_for_bit(kept: Clip, tmp_path: Path) -> None:
    kept.write(tmp_path)
    found = replay(open_recording(tmp_path / RECORDING_FILE))
    assert found.is_identical
    assert found.rows == len(kept.rows) > 600
    assert np.abs(kept.rows[:, 4:7]).max() > 0.05


def test_the_scene_goes_the_same_way(kept: Clip, tmp_path: Path) -> None:
    archive = zipfile.ZipFile(BytesIO(kept.archive()))
    assert archive.namelist() == [RECORDING_FILE, SCENE_FILE, HAND_FILE]
    archive.extractall(tmp_path)
    run = make_setup(load_scene(str(tmp_path / SCENE_FILE))).simulate()
    assert len(run.table) == len(kept.rows)
    assert np.abs(run.position - kept.rows[:, 1:4]).max() < 1e-12
    assert np.abs(run.commanded - kept.rows[:, 4:7]).max() < 1e-9
    # Another hand goes another way: it is not the surface alone that counts.
    text = (tmp_path / SCENE_FILE).read_text().replace('damping = ["2.0 ', 'damping = ["3.0 ')
    (tmp_path / SCENE_FILE).write_text(text)
    other = make_setup(load_scene(str(tmp_path / SCENE_FILE))).simulate()
    assert np.abs(other.position - kept.rows[:, 1:4]).max() > 1e-6


def test_it_begins_where_the_probe_is_free(stage: SceneState, kept: Clip) -> None:
    assert (kept.rows[0, 4:10] == 0.0).all()
    assert kept.rows[0, 0] == 0.0
    shared, wheel = felt(stage, 0.15)
    with wheel, pytest.raises(ParameterError, match="must start with a free probe"):
        extract_clip(stage, shared, wheel)


def test_what_was_on_its_way_when_the_probe_came_free_is_left_out() -> None:
    rows = np.zeros((30, len(COLUMNS)))
    names = [name for name, _unit in COLUMNS]
    rows[5:25, names.index("share")] = 1.0  # it came before, and goes after
    rows[3:9, names.index("inside")] = 1.0
    # The last force, of row 8, waits for two samples, and is held for one more.
    assert _find_segment(rows, delay=2) == (12, 25)
    assert _find_segment(rows, delay=0) == (10, 25)

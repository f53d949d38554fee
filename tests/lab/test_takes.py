"""What was felt is kept: the recording replays, and the scene does the same again."""

from __future__ import annotations

import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from asperity.errors import ParameterError
from asperity.lab.stage import Stage, make_stage
from asperity.lab.takes import HAND, RECORDING, SCENE, Take, _stretch, take
from asperity.recording.recording import open_recording
from asperity.recording.replay import replay
from asperity.scene import load_scene
from asperity.scene.setup import make_setup
from asperity.servo.drivers.steered import Wheel, steered_driver
from asperity.servo.fault import Cause
from asperity.servo.kernels.published import COLUMNS
from asperity.servo.loop import Loop, no_clock, render
from asperity.servo.shared import Shared

LAW = "C"
SURFACE = "sinusoid:amplitude=0.2mm,period=2mm"


def felt(stage: Stage, samples: int) -> tuple[Shared, Wheel]:
    """Let a hand go round, up, down into the surface and up, as fast as it can be computed."""
    setup, shared, wheel = stage.setup, Shared(), Wheel((2e-3, 0.0, 6e-4))
    driver = steered_driver(setup.plant, setup.hand, setup.servo, wheel)
    wheel.steer((0.0, 0.0, 6e-4), (2e-3, 0.0, 0.0), (0.0, 0.0, 1e-3), 9.0)
    loop = Loop(driver, setup.servo, setup.safety, 1.0, shared.board(), no_clock())
    cause, _code = loop.run(render(setup.surface, driver), driver.open(), samples)
    assert cause is Cause.FINISHED
    return shared, wheel


@pytest.fixture(scope="module")
def stage() -> Stage:
    first = make_stage(load_scene(SURFACE), SURFACE)
    return first.changed({"law": LAW, "magnify": 1.5, "delay": 2, "hand_damping": 2.0})


@pytest.fixture(scope="module")
def kept(stage: Stage) -> Take:
    shared, wheel = felt(stage, 900)
    with wheel:
        return take(stage, shared, wheel)


def test_the_recording_replays_bit_for_bit(kept: Take, tmp_path: Path) -> None:
    kept.write(tmp_path)
    found = replay(open_recording(tmp_path / RECORDING))
    assert found.same
    assert found.rows == len(kept.rows) > 600
    assert np.abs(kept.rows[:, 4:7]).max() > 0.05


def test_the_scene_goes_the_same_way(kept: Take, tmp_path: Path) -> None:
    archive = zipfile.ZipFile(BytesIO(kept.archive()))
    assert archive.namelist() == [RECORDING, SCENE, HAND]
    archive.extractall(tmp_path)
    run = make_setup(load_scene(str(tmp_path / SCENE))).simulate()
    assert len(run.table) == len(kept.rows)
    assert np.abs(run.position - kept.rows[:, 1:4]).max() < 1e-12
    assert np.abs(run.commanded - kept.rows[:, 4:7]).max() < 1e-9
    # Another hand goes another way: it is not the surface alone that counts.
    text = (tmp_path / SCENE).read_text().replace('damping = ["2.0 ', 'damping = ["3.0 ')
    (tmp_path / SCENE).write_text(text)
    other = make_setup(load_scene(str(tmp_path / SCENE))).simulate()
    assert np.abs(other.position - kept.rows[:, 1:4]).max() > 1e-6


def test_it_begins_where_the_probe_is_free(stage: Stage, kept: Take) -> None:
    assert (kept.rows[0, 4:10] == 0.0).all()
    assert kept.rows[0, 0] == 0.0
    shared, wheel = felt(stage, 150)
    with wheel, pytest.raises(ParameterError, match="begins where the probe is free"):
        take(stage, shared, wheel)


def test_what_was_on_its_way_when_the_probe_came_free_is_left_out() -> None:
    rows = np.zeros((30, len(COLUMNS)))
    names = [name for name, _unit in COLUMNS]
    rows[5:25, names.index("share")] = 1.0  # it came before, and goes after
    rows[3:9, names.index("inside")] = 1.0
    # The last force, of row 8, waits for two samples, and is held for one more.
    assert _stretch(rows, delay=2) == (12, 25)
    assert _stretch(rows, delay=0) == (10, 25)

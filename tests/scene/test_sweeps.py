"""Sweeps of one scene over laws, speeds and depths."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from threading import Event

import pytest

from asperity.core.errors import ParameterError
from asperity.scene import load_scene
from asperity.scene.setup import Setup, make_setup
from asperity.scene.sweeps import map_threads, sweep_strokes
from asperity.simulation import Stationary, Strokes

SCENE = """
[texture]
kind = "sinusoid"
amplitude = "0.1 mm"
period = "2 mm"
[surface]
law = "C"
stiffness = "300 N/m"
[device]
apparent_mass = "45 g"
update_rate = "1 kHz"
[hand]
kind = "spring"
stiffness = ["300 N/m", "300 N/m", "{vertical}"]
damping = "3 N*s/m"
[motion]
kind = "strokes"
start = ["0 mm", "0 mm", "{height}"]
end = ["4 mm", "0 mm", "{height}"]
speed = "0.2 m/s"
"""


def load_setup(folder: Path, height: str = "-0.3 mm", vertical: str = "300 N/m") -> Setup:
    path = folder / "scene.toml"
    path.write_text(SCENE.format(height=height, vertical=vertical), encoding="utf-8")
    return make_setup(load_scene(str(path)))


def test_strokes_are_listed_by_law_then_speed_then_depth(tmp_path: Path) -> None:
    fractions: list[float] = []
    strokes = sweep_strokes(
        load_setup(tmp_path),
        ["A", "C"],
        speeds=[0.2, 0.4],
        depths=[0.2e-3, 0.3e-3],
        strokes=2,
        progress=fractions.append,
    ).strokes
    order = [(stroke.law, stroke.speed, stroke.depth) for stroke in strokes]
    assert order == [
        (law, speed, depth) for law in "AC" for speed in (0.2, 0.4) for depth in (0.2e-3, 0.3e-3)
    ]
    assert sorted(fractions) == [k / 8 for k in range(1, 9)]


def test_default_depth_is_that_of_the_motion(tmp_path: Path) -> None:
    (stroke,) = sweep_strokes(load_setup(tmp_path), ["C"], speeds=[0.4], strokes=2).strokes
    assert stroke.depth == pytest.approx(0.3e-3)


def test_invalid_sweeps_are_refused(tmp_path: Path) -> None:
    setup = load_setup(tmp_path)
    with pytest.raises(ParameterError, match='must be kind = "strokes" to be scanned'):
        sweep_strokes(replace(setup, motion=Stationary((0.0, 0.0, -1e-3))), ["C"])
    with pytest.raises(ParameterError, match="motion of the scene is not below z = 0"):
        sweep_strokes(load_setup(tmp_path, height="0.1 mm"), ["C"])
    with pytest.raises(ParameterError, match="the hand has no stiffness along z"):
        sweep_strokes(load_setup(tmp_path, vertical="0 N/m"), ["C"], depths=[1e-4])
    assert isinstance(setup.motion, Strokes)


def test_map_threads_keeps_order_and_sets_the_event_at_the_end() -> None:
    ended = Event()
    assert map_threads(pow, [(2, 3), (3, 2), (5, 1)], ended) == (8, 9, 5)
    assert ended.is_set()
    ended.clear()
    with pytest.raises(ZeroDivisionError):
        map_threads(divmod, [(1, 1), (1, 0)], ended)
    assert ended.is_set()

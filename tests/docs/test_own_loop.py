"""Code of the page "In your own loop": frames, servo loop and C function."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import asperity as asp
from asperity.devices import load_device

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "own-loop.md"
_RUN = re.compile(r"^```\{run\}\n(.*?)^```$", re.M | re.S)
_C = re.compile(r"^```c\n(.*?)^```$", re.M | re.S)
_CPP = re.compile(r"^```cpp\n(.*?)^```$", re.M | re.S)
_EXPORT = re.compile(r"^\$ asperity (export sinusoid.*)$", re.M)
EFFECT = PAGE.parents[2] / "examples" / "export" / "chai3d_effect.hpp"
STAND_IN = PAGE.parents[2] / "tests" / "export" / "cpp" / "chai3d.h"
# Where the outward normal of a wall points, in the words of each frame's source.
NORMALS = {
    ("CHAI3D, libdhd", "lying"): (0, 0, 1),
    ("CHAI3D, libdhd", "standing"): (1, 0, 0),
    ("OpenHaptics", "lying"): (0, 1, 0),
    ("OpenHaptics", "standing"): (0, 0, 1),
    ("H3D, HAPI", "lying"): (0, 1, 0),
    ("H3D, HAPI", "standing"): (0, 0, 1),
    ("Haply Inverse3", "lying"): (0, 0, 1),
    ("Haply Inverse3", "standing"): (0, -1, 0),
    ("Haption Virtuose", "lying"): (0, 0, 1),
    ("Haption Virtuose", "standing"): (1, 0, 0),
}
# Where the user's right is.
RIGHTS = {
    "CHAI3D, libdhd": (0, 1, 0),
    "OpenHaptics": (1, 0, 0),
    "H3D, HAPI": (1, 0, 0),
    "Haply Inverse3": (1, 0, 0),
    "Haption Virtuose": (0, 1, 0),
}


@pytest.fixture(scope="module")
def page() -> dict[str, Any]:
    """Return the names that the code blocks of the page define; their asserts have held."""
    names: dict[str, Any] = {}
    for block in _RUN.findall(PAGE.read_text("utf-8")):
        lines = [line for line in block.splitlines() if not re.match(r":[\w-]+:", line)]
        exec(compile("\n".join(lines), str(PAGE), "exec"), names)
    return names


def _rotation_errors(
    rotation: Callable[[str, str], np.ndarray], frame: str, wall: str
) -> list[str]:
    """Return descriptions of the errors of a rotation."""
    turn = rotation(frame, wall)
    errors = []
    if not np.array_equal(turn.T @ turn, np.eye(3)):
        errors.append("not orthonormal")
    if round(np.linalg.det(turn)) != 1:
        errors.append("not right-handed")
    if tuple(turn @ [0.0, 0.0, 1.0]) != NORMALS[frame, wall.partition(",")[0]]:
        errors.append("the normal does not come out of the wall")
    if tuple(turn @ [1.0, 0.0, 0.0]) != RIGHTS[frame]:
        errors.append("x is not the user's right")
    return errors


def test_rotation_of_every_frame_is_correct(page: dict[str, Any]) -> None:
    errors = {
        (frame, wall): _rotation_errors(page["rotation"], frame, wall)
        for frame in page["FRAMES"]
        for wall in page["WALLS"]
    }
    assert len(errors) == len(NORMALS)
    assert {case: messages for case, messages in errors.items() if messages} == {}


def test_wrong_rotation_is_detected(page: dict[str, Any]) -> None:
    rotation, frame, wall = page["rotation"], "OpenHaptics", "lying, like a table"
    mirrored = np.diag([1.0, 1.0, -1.0])  # Unity's
    assert _rotation_errors(lambda f, w: mirrored @ rotation(f, w), frame, wall) == [
        "not right-handed"
    ]
    assert len(_rotation_errors(lambda f, w: -rotation(f, w), frame, wall)) == 3
    assert len(_rotation_errors(lambda f, w: rotation(f, w).T, "CHAI3D, libdhd", wall)) == 1
    assert "not orthonormal" in _rotation_errors(lambda f, w: 1e-3 * rotation(f, w), frame, wall)


def test_frames_equal_the_axes_of_the_device_catalogue(page: dict[str, Any]) -> None:
    directions = {
        "to the right": page["RIGHT"],
        "up": page["UP"],
        "towards the user": page["TOWARDS"],
        "forward": page["AWAY"],
    }
    frames = {"omega.3": "CHAI3D, libdhd", "touch": "OpenHaptics", "inverse3": "Haply Inverse3"}
    for device, frame in frames.items():
        description = load_device(device).axes
        axes, unit = page["FRAMES"][frame]
        match = re.match(r"x (.*?), y (.*?), z ([\w ]+)", description)
        assert match is not None
        assert np.array_equal([directions[part.strip()] for part in match.groups()], axes)
        assert unit == (1e-3 if "millimetres" in description else 1.0)


@pytest.mark.parametrize("wall", ["lying, like a table", "standing, facing the user"])
@pytest.mark.parametrize("frame", ["CHAI3D, libdhd", "OpenHaptics", "Haply Inverse3"])
def test_tick_returns_the_outward_force_in_every_frame(
    page: dict[str, Any], frame: str, wall: str
) -> None:
    turn, unit = page["rotation"](frame, wall), page["FRAMES"][frame][1]
    tick, surface = page["tick"], page["surface"]
    names = {"R": turn, "unit": unit, "origin": np.array([0.01, -0.02, 0.03]) / unit}
    before = {name: tick.__globals__[name] for name in names}
    tick.__globals__.update(names)
    try:
        probe = np.array([0.11e-3, 0.3e-3, -0.35e-3])
        position = turn @ probe / unit + names["origin"]
        np.testing.assert_allclose(tick(position), turn @ surface.force(probe), rtol=1e-6)
        assert tick(position) @ turn[:, 2] > 0.1
        assert not tick(np.full(3, np.nan)).any()
        deep = turn @ [0.0, 0.0, -0.1] / unit + names["origin"]
        assert np.linalg.norm(tick(deep)) == pytest.approx(page["MAX_FORCE"])
    finally:
        tick.__globals__.update(before)


def test_force_of_law_f_depends_on_its_state(page: dict[str, Any]) -> None:
    path, sticky = page["path"], page["sticky"]
    np.testing.assert_allclose(page["forces"], sticky.trace(path), rtol=0, atol=1e-12)
    assert np.abs(sticky.force(path) - sticky.trace(path)).max() > 0.01


@pytest.fixture(scope="module")
def law_c(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return the C function of the page, compiled."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("not run: no C compiler here")
    folder = tmp_path_factory.mktemp("c")
    _tick, source = _C.findall(PAGE.read_text("utf-8"))
    (folder / "law_c.c").write_text(source, encoding="utf-8")
    command = [compiler, "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O2", "-shared"]
    subprocess.run([*command, "-fPIC", "-o", "law_c.so", "law_c.c", "-lm"], cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "law_c.so")).law_c


def _forces(law_c: Any, points: np.ndarray, *numbers: float) -> np.ndarray:
    vector = ctypes.c_double * 3
    rows = []
    for point in points:
        out = vector()
        law_c(vector(*point), *map(ctypes.c_double, numbers), out)
        rows.append(list(out))
    return np.array(rows)


def test_c_function_gives_the_force_of_law_c(law_c: Any) -> None:
    amplitude, period, stiffness = 0.2e-3, 1e-3, 800.0
    surface = asp.Surface(asp.Sinusoid(amplitude, period), "C", stiffness)
    points = np.random.default_rng(3).uniform(-1e-3, 1e-3, (500, 3))
    expected = surface.force(points)
    atol = 1e-12 * stiffness * 1e-3
    forces = _forces(law_c, points, stiffness, amplitude, period)
    np.testing.assert_allclose(forces, expected, rtol=0, atol=atol)
    assert 100 < np.count_nonzero(expected[:, 2]) < 400
    perturbed = _forces(law_c, points, stiffness, 1.0001 * amplitude, period)
    assert np.abs(perturbed - expected).max() > 100 * atol
    assert not _forces(law_c, np.full((1, 3), np.nan), stiffness, amplitude, period).any()


@pytest.fixture(scope="module")
def header(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder with the header that the first command of the page writes."""
    folder = tmp_path_factory.mktemp("header")
    (command,) = _EXPORT.findall(PAGE.read_text("utf-8"))
    program = [sys.executable, "-m", "asperity", *command.split()]
    subprocess.run(program, cwd=folder, check=True, capture_output=True)
    return folder


def test_first_block_renders_the_exported_force(header: Path) -> None:
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("not run: no C compiler here")
    assert PAGE.read_text("utf-8").index('#include "texture.h"') < 700  # the page begins with it
    (header / "tick.c").write_text(_C.findall(PAGE.read_text("utf-8"))[0], encoding="utf-8")
    command = [compiler, "-std=c99", "-Wall", "-Wextra", "-Werror", "-O2", "-shared", "-fPIC"]
    subprocess.run([*command, "-o", "tick.so", "tick.c", "-lm"], cwd=header, check=True)
    tick = ctypes.CDLL(str(header / "tick.so")).haptic_tick
    surface = asp.Surface(asp.Sinusoid(0.2e-3, 1e-3), "C", 800.0, clamp="backed")
    points = np.random.default_rng(4).uniform(-0.4e-3, 0.4e-3, (200, 3))
    expected = surface.force(points)
    assert 50 < np.count_nonzero(expected[:, 2]) < 150
    atol = 1e-9 * 800.0 * 1e-3
    np.testing.assert_allclose(_forces(tick, points), expected, rtol=0, atol=atol)


def test_chai3d_object_lies_before_the_user(page: dict[str, Any]) -> None:
    """The quarter turn of the page makes the object's axes those of the lying wall."""
    (block,) = _CPP.findall(PAGE.read_text("utf-8"))
    numbers = re.search(r"rotateAboutGlobalAxisDeg\(([^)]*)\)", block)
    assert numbers is not None
    *axis, angle = map(float, numbers[1].split(","))
    assert axis == [0.0, 0.0, 1.0]
    cos, sin = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    expected = page["rotation"]("CHAI3D, libdhd", "lying, like a table")
    np.testing.assert_allclose(turn, expected, atol=1e-15)


def test_chai3d_block_compiles(header: Path) -> None:
    compiler = shutil.which("c++")
    if compiler is None:
        pytest.skip("not run: no C++ compiler here")
    for file in (EFFECT, STAND_IN):
        shutil.copy(file, header)
    (block,) = _CPP.findall(PAGE.read_text("utf-8"))
    (header / "page.cpp").write_text(block, encoding="utf-8")
    command = [compiler, "-std=c++11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "page.cpp"]
    subprocess.run(command, cwd=header, check=True)

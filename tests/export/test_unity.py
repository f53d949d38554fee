"""The folder for Unity: its files, its axes, its loop under mono with a stand-in of UnityEngine."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench.stress.callers import build_unity_loop, missing_tool, run_on_files
from bench.stress.unity_loop import run_loop
from tests.helpers.c_programs import kernel_ticks, run_command, tool

import asperity as asp

WAVE = "sinusoid:amplitude=0.1mm,period=2mm"
FLAT = ("0", "0", "0", "1", "0", "0", "0")
"""Rotation and origin of a patch in the axes of the world."""
FAST = ("0", "1", "1e9")
needs_mono = pytest.mark.skipif(
    missing_tool("Unity") is not None, reason=f"not run: no {missing_tool('Unity')} here"
)


def generic_surface(law: str = "C") -> asp.Surface:
    """Return a surface whose force distinguishes its three axes."""
    vectors = [[2100.0, 700.0], [-500.0, 2900.0]]
    texture = asp.Fourier([6e-5, 9e-5], vectors, [0.3, 1.1])
    return asp.Surface(texture, law, 800.0, max_depth=2e-4, clamp="backed")


@pytest.fixture(scope="module")
def positions() -> Any:
    """Return positions in Unity's axes, y up, the first outside of the body."""
    rng = np.random.default_rng(4)
    rows = np.column_stack([*rng.uniform(-2e-3, 2e-3, (2, 300)), rng.uniform(-3e-4, 1e-4, 300)])
    rows[0, 2] = 1e-2
    return rows[:, [0, 2, 1]]


@pytest.fixture(scope="module")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return a function of positions and options that returns the forces of the component."""
    if missing_tool("Unity") is not None:
        pytest.skip(f"not run: no {missing_tool('Unity')} here")
    folder = tmp_path_factory.mktemp("unity")
    command = build_unity_loop(generic_surface(), folder)

    def run(rows: Any, *options: str) -> Any:
        return run_on_files(command, rows, folder, *options)[0]

    return run


def forces(rows: Any) -> Any:
    """Return the forces in Unity's axes at positions in those of a flat patch."""
    found = kernel_ticks(generic_surface(), np.ascontiguousarray(rows[:, [0, 2, 1]]))
    return found[:, [0, 2, 1]]


def test_library_for_windows_exports_the_functions(tmp_path: Path) -> None:
    dump = tool("x86_64-w64-mingw32-objdump")
    asp.export_code(WAVE, tmp_path / "Wall", law="C", stiffness=800, lang="unity", name="wall")
    library = tmp_path / "Wall" / "Plugins" / "x86_64" / "wall.dll"
    text = run_command(dump, "-p", library)
    assert "pei-x86-64" in text
    assert {"wall_force", "wall_abi_version", "wall_info", "wall_abi_1"} <= set(text.split())


def test_y_is_up_and_the_axes_are_left_handed(loop: Any, positions: Any) -> None:
    found = loop(positions, *FAST, *FLAT)
    assert (found == forces(positions)).all()
    assert (found[:, 1] >= 0.0).all()
    # Right-handed axes with the same directions of x and y are not those of Unity.
    mirrored = positions * [1.0, 1.0, -1.0]
    assert np.abs(found - forces(mirrored) * [1.0, 1.0, -1.0]).max() > 0.01


def test_wall_that_faces_the_viewer_pushes_towards_the_viewer(loop: Any, positions: Any) -> None:
    half = repr(float(np.sqrt(0.5)))
    turned = np.column_stack([positions[:, 0], positions[:, 2], -positions[:, 1]])
    found = loop(turned, *FAST, "-" + half, "0", "0", half, "0", "0", "0")
    expected = forces(positions)
    expected = np.column_stack([expected[:, 0], expected[:, 2], -expected[:, 1]])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7)
    assert found[:, 2].min() < -0.01
    assert found[:, 2].max() < 1e-7


def test_frame_of_a_device_in_millimetres(loop: Any, positions: Any) -> None:
    """The patch lies 1 m right of and 2 m above the device, which is drawn twice as large."""
    frame = ("0", "0", "0", "1", "3", "1", "-5", "2")
    patch = ("0", "0", "0", "1", "5", "5", "-5")
    found = loop(1e3 * (positions + np.array([1.0, 2.0, 0.0])), "0", "1e-3", "1e9", *patch, *frame)
    np.testing.assert_allclose(found, forces(positions), rtol=0, atol=1e-9)


def test_long_force_is_shortened_and_not_turned(loop: Any, positions: Any) -> None:
    found = loop(positions, "0", "1", "0.05", *FLAT)
    expected = forces(positions)
    length = np.linalg.norm(expected, axis=1)
    assert (length > 0.05).sum() > 50
    share = np.minimum(1.0, 0.05 / np.maximum(length, 0.05))
    np.testing.assert_allclose(found, expected * share[:, None], rtol=0, atol=1e-15)


def test_loop_that_begins_inside_has_no_force_until_it_is_out(loop: Any, positions: Any) -> None:
    rows = np.vstack([np.tile([0.0, -2e-4, 0.0], (5, 1)), positions])
    found = loop(rows, *FAST, *FLAT)
    assert forces(rows)[:5, 1].min() > 0.01
    assert not found[:5].any()
    assert (found[5:] == forces(positions)).all()


def test_callback_of_haplys_example(loop: Any, positions: Any) -> None:
    found = loop(positions, "haply", "1", "1e9", *FLAT)
    single = positions.astype(np.float32).astype(float)
    assert (found == forces(single).astype(np.float32)).all()


@needs_mono
def test_loop_of_a_kilohertz_allocates_nothing(tmp_path: Path) -> None:
    differing, said = run_loop(1.0, tmp_path)
    assert differing == 0
    assert said.startswith("allocated 0 bytes, latest tick ")

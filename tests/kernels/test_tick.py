"""The servo tick by itself: a user-defined loop calls it as the simulation does."""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType

import numpy as np
import pytest
from tests.helpers.user_modules import imported

from asperity.contacts.warm_start import new_warm_start
from asperity.core.checks import FloatArray
from asperity.kernels import tick
from asperity.kernels.fuse import fuse_on_texture
from asperity.laws.clamps import NONE
from asperity.simulation import Cartesian, PrescribedHand, Servo, Strokes, simulate
from asperity.surface import Surface
from asperity.textures import HeightMap, Sinusoid

SERVO = Servo(
    1e-4,
    position_resolution=5e-6,
    force_resolution=5e-3,
    max_force=0.4,
    virtual_damping=0.3,
    velocity_share=0.2,
)
STROKES = Strokes((0.1e-3, 0.0, -0.05e-3), (7e-3, 3e-3, -0.25e-3), speed=0.05, count=3)

DEVICE = """
from asperity.core.compiled import Kernels
from asperity.kernels.tick import initial_servo_state, servo_tick

KERNELS = Kernels(loops=("device_batch",))


def device_batch(positions, forces, settings, memory, texture, law):
    state = initial_servo_state(positions[0, 0], positions[0, 1], positions[0, 2], settings)
    for i in range(positions.shape[0]):
        state = servo_tick(
            state, settings, positions[i, 0], positions[i, 1], positions[i, 2], memory, texture, law
        )
        forces[i, 0] = state.fx
        forces[i, 1] = state.fy
        forces[i, 2] = state.fz
    return state
"""


@pytest.fixture(scope="module")
def device(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    folder = tmp_path_factory.mktemp("device")
    (folder / "my_device.py").write_text(DEVICE, encoding="utf-8")
    with imported(folder, "my_device") as module:
        yield module


def commanded_forces(device: ModuleType, surface: Surface, positions: FloatArray) -> FloatArray:
    """Return the forces of the device's loop at these positions of the handle."""
    fused = fuse_on_texture(surface.law, surface.texture.sampler, NONE, (device, tick))
    forces = np.empty_like(positions)
    arguments = surface.texture.arguments, surface.law_arguments
    memory = new_warm_start(surface.law.contact.max_evaluations)
    state = fused.device_batch(positions, forces, SERVO.settings, memory, *arguments)
    assert isinstance(state, tick.ServoState)
    assert (state.fx, state.fy, state.fz) == tuple(forces[-1])
    return forces


@pytest.mark.parametrize("letter", ["C", "F", "D"])
def test_user_defined_loop_equals_the_simulation(device: ModuleType, letter: str) -> None:
    """Bitwise, with reading, anchor of the law, virtual damping, force limit and rounding."""
    heights = 1e-4 * np.random.default_rng(3).normal(size=(8, 9))
    texture = HeightMap(heights, 0.5e-3) if letter == "D" else Sinusoid(0.2e-3, 2e-3)
    surface = Surface(texture, letter, 900.0)
    run = simulate(surface, Cartesian(0.05), PrescribedHand(), SERVO, STROKES, 0.3)
    forces = commanded_forces(device, surface, np.ascontiguousarray(run.position))
    np.testing.assert_array_equal(forces, run.commanded)
    lengths = np.linalg.norm(forces, axis=1)
    assert 0.1 < lengths.max() <= 0.4 * (1.0 + 1e-12)
    # Negative control: in reverse order the state, carried from tick to tick, differs.
    reversed_forces = commanded_forces(device, surface, np.ascontiguousarray(run.position[::-1]))[
        ::-1
    ]
    assert np.abs(reversed_forces - forces).max() > 0.01


def test_damping_and_force_steps_change_the_command(device: ModuleType) -> None:
    surface = Surface(Sinusoid(0.2e-3, 2e-3), "C", 900.0)
    positions = np.ascontiguousarray(STROKES.at(np.arange(3000) * 1e-4))
    forces = commanded_forces(device, surface, positions)
    law_forces = surface.force(5e-6 * np.floor(positions / 5e-6 + 0.5))
    is_unlimited = np.linalg.norm(law_forces, axis=1) < 0.3
    assert is_unlimited.any()
    damped = np.abs(forces - law_forces)[is_unlimited].max()
    assert 5e-3 < damped < 0.1
    steps = forces / 5e-3
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)


def test_default_state_rests_at_the_origin() -> None:
    assert tick.ServoState() == tick.initial_servo_state(0.0, 0.0, 0.0, SERVO.settings)
    assert tick.initial_servo_state(1.2e-5, -1e-6, 3.7e-6, SERVO.settings)[:4] == (
        1e-5,
        0.0,
        5e-6,
        0.0,
    )

"""The exported energy is the potential of the exported force."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.helpers.c_programs import as_exported, energies, header, library, ticks

from asperity.laws import LAWS, Law
from asperity.laws.clamps import NONE
from asperity.surface import Surface
from asperity.textures import Texture

WITH_POTENTIAL = "WCDH"


@pytest.mark.parametrize("clamp", ["none", "backed"])
def test_force_is_minus_the_gradient_of_the_energy(
    clamp: str, make_texture: Callable[[str], Texture], tmp_path: Path
) -> None:
    texture = make_texture("map")
    surfaces = {
        x: as_exported(Surface(texture, x, max_depth=2e-4, clamp=clamp)) for x in WITH_POTENTIAL
    }
    headers = {x: header(s, x, max_evaluations=np.inf) for x, s in surfaces.items()}
    program = library(tmp_path, "gcc", headers, "-O1")
    rng = np.random.default_rng(4)
    xy = texture.domain.points(rng.uniform(0.1, 0.9, (150, 2)))
    points = np.column_stack([xy, texture.height(xy) - rng.uniform(2e-5, 6e-4, 150)])
    for x, surface in surfaces.items():
        force, step = ticks(program, x, points)[:, :3], 1e-8
        slope = np.empty_like(points)
        for axis in range(3):
            offset = np.zeros(3)
            offset[axis] = step
            up, down = (
                energies(program, x, np.ascontiguousarray(points + s * offset)) for s in (1, -1)
            )
            slope[:, axis] = (up - down) / (2.0 * step)
        error = np.abs(force + slope).max(axis=1)
        # The energy has a kink (ridge, clamp, floor) between some pairs of points.
        size = surface.stiffness * 1e-3
        assert np.median(error) < 1e-7 * size
        assert np.quantile(error, 0.97) < 1e-5 * size


def test_energy_of_law_h_on_a_sinusoid_equals_that_of_the_general_solver(
    make_texture: Callable[[str], Texture], tmp_path: Path
) -> None:
    """A sinusoid has its own solver for law H; the energy must be that of the general solver."""
    texture = make_texture("sinusoid")
    surface = Surface(texture, "H")
    program = library(tmp_path, "gcc", {"h": header(surface, "h")}, "-O1")
    points = np.array([[1e-4, 2e-4, -3e-4], [3e-4, -2e-4, -1e-4], [0.0, 0.0, 5e-3]])
    split = np.empty((3, 3))
    from asperity.contacts import split_evaluation, split_optimality, split_solver
    from asperity.kernels.fuse import fuse_on_texture

    loops = fuse_on_texture(
        surface.law, texture.sampler, NONE, (split_evaluation, split_solver, split_optimality)
    )
    loops.split_batch(points, split, surface.continuity, texture.arguments)
    np.testing.assert_array_equal(energies(program, "h", points), surface.stiffness * split[:, 0])


@pytest.mark.parametrize("letter", sorted(set(LAWS) - set(WITH_POTENTIAL)))
def test_laws_without_a_potential_export_no_energy(letter: str, wave: Texture) -> None:
    assert "t_energy" not in header(Surface(wave, letter), "t")


def test_energy_is_exported_only_with_a_conservative_clamp(wave: Texture) -> None:
    assert "t_energy" in header(Surface(wave, "C", clamp="whole"), "t")
    assert "t_energy" not in header(Surface(wave, "C", clamp="lateral"), "t")


def test_user_defined_conservative_law_exports_its_energy(wave: Texture, tmp_path: Path) -> None:
    law = Law("S", "stiffening", "vertical", lambda c: c.k * c.depth**3 * 1e7 * c.w)
    program = library(tmp_path, "gcc", {"s": header(Surface(wave, law), "s")}, "-O1")
    points = np.array([[1e-4, 2e-4, -3e-4]])
    depth = wave.height(np.ascontiguousarray(points[:, :2]))[0] + 3e-4
    np.testing.assert_allclose(
        energies(program, "s", points), 1000.0 * 1e7 * depth**4 / 4.0, rtol=1e-12
    )

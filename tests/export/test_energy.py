"""The exported energy is the potential of the exported force."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.helpers.c_programs import energies, header, library, ticks

from asperity.clamps import NONE
from asperity.laws import LAWS, Law
from asperity.surface import Surface
from asperity.textures import Texture

WITH_POTENTIAL = "WCDH"


@pytest.mark.parametrize("clamp", ["none", "backed"])
def test_the_force_is_minus_its_gradient(
    clamp: str, make_texture: Callable[[str], Texture], tmp_path: Path
) -> None:
    texture = make_texture("map")
    surfaces = {x: Surface(texture, x, max_depth=2e-4, clamp=clamp) for x in WITH_POTENTIAL}
    headers = {x: header(s, x, max_evaluations=np.inf) for x, s in surfaces.items()}
    made = library(tmp_path, "gcc", headers, "-O1")
    rng = np.random.default_rng(4)
    xy = texture.domain.points(rng.uniform(0.1, 0.9, (150, 2)))
    at = np.column_stack([xy, texture.height(xy) - rng.uniform(2e-5, 6e-4, 150)])
    for x, surface in surfaces.items():
        force, step = ticks(made, x, at)[:, :3], 1e-8
        slope = np.empty_like(at)
        for axis in range(3):
            move = np.zeros(3)
            move[axis] = step
            up, down = (energies(made, x, np.ascontiguousarray(at + s * move)) for s in (1, -1))
            slope[:, axis] = (up - down) / (2.0 * step)
        error = np.abs(force + slope).max(axis=1)
        # A kink of the energy (ridge, clamp, floor) between the two points is met now and then.
        size = surface.stiffness * 1e-3
        assert np.median(error) < 1e-7 * size
        assert np.quantile(error, 0.97) < 1e-5 * size


def test_the_energy_of_a_texture_kind_of_its_own_solver(
    make_texture: Callable[[str], Texture], tmp_path: Path
) -> None:
    """A sinusoid has a closed form of law H: its energy is that of the general solver's value."""
    texture = make_texture("sinusoid")
    surface = Surface(texture, "H")
    made = library(tmp_path, "gcc", {"h": header(surface, "h")}, "-O1")
    at = np.array([[1e-4, 2e-4, -3e-4], [3e-4, -2e-4, -1e-4], [0.0, 0.0, 5e-3]])
    split = np.empty((3, 3))
    from asperity.contacts.split import optimality as conditions
    from asperity.contacts.split import solver
    from asperity.contacts.split import split_evaluation as answers
    from asperity.kernels.fuse import fuse_on_texture

    loops = fuse_on_texture(surface.law, texture.sampler, NONE, (answers, solver, conditions))
    loops.split_batch(at, split, surface.continuity, texture.arguments)
    np.testing.assert_array_equal(energies(made, "h", at), surface.stiffness * split[:, 0])


@pytest.mark.parametrize("letter", sorted(set(LAWS) - set(WITH_POTENTIAL)))
def test_others_have_none(letter: str, wave: Texture) -> None:
    assert "t_energy" not in header(Surface(wave, letter), "t")


def test_nor_under_a_clamp_that_spoils_it(wave: Texture) -> None:
    assert "t_energy" in header(Surface(wave, "C", clamp="whole"), "t")
    assert "t_energy" not in header(Surface(wave, "C", clamp="lateral"), "t")


def test_a_law_of_one_s_own_has_one(wave: Texture, tmp_path: Path) -> None:
    law = Law("S", "stiffening", "vertical", lambda c: c.k * c.depth**3 * 1e7 * c.w)
    made = library(tmp_path, "gcc", {"s": header(Surface(wave, law), "s")}, "-O1")
    at = np.array([[1e-4, 2e-4, -3e-4]])
    depth = wave.height(np.ascontiguousarray(at[:, :2]))[0] + 3e-4
    np.testing.assert_allclose(energies(made, "s", at), 1000.0 * 1e7 * depth**4 / 4.0, rtol=1e-12)

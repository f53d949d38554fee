"""Law H below a sinusoid: the closed form compared with the general method, and its conditions."""

from __future__ import annotations

import math
from types import ModuleType

import numpy as np
import pytest

from asperity.analysis.energy.field_energy import split_state
from asperity.core.checks import FloatArray
from asperity.kernels.fuse import fuse_surface
from asperity.laws.clamps import NONE
from asperity.surface import Surface
from asperity.textures.kinds import sinusoid_sampler as sinusoid
from asperity.textures.kinds.sinusoid import Sinusoid

PERIOD = 1e-3
CASES = [(part, c) for part in (0.05, 0.4, 3.0) for c in (0.3, 1.0, 4.0)]


def _surface(part: float, c: float) -> Surface:
    texture = Sinusoid(part * PERIOD, PERIOD, phase=0.4, direction=(1.0, 2.0))
    return Surface(texture, "H", 1.0, continuity=c)


def _general(surface: Surface) -> ModuleType:
    """Return the general loops, which use only the nearest points of the sinusoid."""
    return fuse_surface(surface.law, (sinusoid,), NONE)


def _probes(surface: Surface, count: int) -> FloatArray:
    """Return probes at all depths; a third of them close to where the god-object splits."""
    texture, c = surface.texture, surface.continuity
    assert isinstance(texture, Sinusoid)
    rng = np.random.default_rng(7)
    xy = rng.uniform(-2e-3, 2e-3, (count, 2))
    z = texture.height(xy) - texture.peak_to_valley * 10 ** rng.uniform(-3, 0.3, count)
    near = slice(0, count // 3)
    along = PERIOD * (0.25 - texture.phase / (2.0 * math.pi))
    along += rng.uniform(-0.05, 0.05, count // 3) * PERIOD
    xy[near] = along[:, None] * np.array(texture.direction)
    onset = c / (1.0 + c) / texture.bounds[1]
    z[near] = texture.amplitude - onset * (1.0 + rng.uniform(-0.1, 0.5, count // 3))
    points = np.column_stack([xy, z])
    return points[texture.height(xy) > z]


@pytest.mark.parametrize(("part", "c"), CASES)
def test_force_and_jacobian_agree_with_the_general_method(part: float, c: float) -> None:
    surface = _surface(part, c)
    points = _probes(surface, 3000)
    force, jacobian = np.empty((len(points), 3)), np.empty((len(points), 3, 3))
    arguments = (surface.texture.arguments, surface.law_arguments)
    _general(surface).jacobian_batch(points, force, jacobian, *arguments)
    reference, exact = surface.force_and_jacobian(points)
    np.testing.assert_allclose(surface.force(points), reference, rtol=0.0, atol=1e-18)
    amplitude = surface.texture.extremes[1]
    error = np.linalg.norm(force - reference, axis=1) / np.maximum(amplitude, np.abs(points[:, 2]))
    assert np.quantile(error, 0.99) < 3e-14
    # Where atoms have just separated, the general method is accurate to the root of rounding.
    assert error.max() < 1e-10
    difference = np.linalg.norm(jacobian - exact, axis=(1, 2)) / max(1.0, c)
    assert np.quantile(difference, 0.98) < 1e-8


@pytest.mark.parametrize(("part", "c"), CASES)
def test_energy_atoms_and_gap_agree_with_the_general_method(part: float, c: float) -> None:
    surface = _surface(part, c)
    points = _probes(surface, 2000)
    out = np.empty((len(points), 3))
    _general(surface).split_batch(points, out, c, surface.texture.arguments)
    state = split_state(surface, points)
    rounding = 4e-15 * (PERIOD + surface.texture.extremes[1]) * np.sqrt(2.0 * state.potential)
    assert (np.abs(out[:, 0] - state.potential) <= rounding).all()
    assert (state.gap <= rounding).all()
    # Atoms that have just separated may count as one.
    assert np.mean(out[:, 1] == state.atoms) > 0.98
    assert set(state.atoms) == {1, 2}


@pytest.mark.parametrize("c", [0.3, 1.0, 4.0])
def test_split_region_and_force_equal_their_formulas(c: float) -> None:
    """The region is |u| < μ s with h(s) + (1 - μ) s/h'(s) = z; there f = k (c u, h(s) - z)."""
    surface = _surface(0.4, c)
    texture, mu = surface.texture, 1.0 / (1.0 + c)
    assert isinstance(texture, Sinusoid)
    crest = PERIOD * (0.25 - texture.phase / (2.0 * math.pi))
    kappa, a = 2.0 * math.pi / PERIOD, texture.amplitude
    for s in (0.02 * PERIOD, 0.2 * PERIOD, 0.45 * PERIOD):
        h, slope = a * math.cos(kappa * s), -a * kappa * math.sin(kappa * s)
        z = h + (1.0 - mu) * s / slope
        for part, atoms in ((0.0, 2), (0.99, 2), (-0.99, 2), (1.01, 1), (-1.01, 1)):
            u = part * mu * s
            point = np.array([[*((crest + u) * np.array(texture.direction)), z]])
            assert split_state(surface, point).atoms[0] == atoms
            if atoms == 2:
                lateral = c * u * np.array(texture.direction)
                expected = [*lateral, h - z]
                np.testing.assert_allclose(surface.force(point)[0], expected, atol=1e-15)


def test_profile_with_a_step_in_its_flank_has_more_than_two_atoms() -> None:
    """The profile is even about the crest and monotone, but h + s/h' is not monotone.

    The closed form therefore holds for sinusoids only; even and monotone is not sufficient.
    """
    from asperity.textures.kinds.fourier import Fourier

    # Similar to h' = -sin u (1 - 0.98 sin² u): level halfway down.
    kappa = 2.0 * math.pi / PERIOD
    texture = Fourier([1e-3, 0.3e-3], [kappa, 3.0 * kappa], [math.pi / 2, math.pi / 2])
    x = np.linspace(0.0, 0.5 * PERIOD, 2001)[1:-1]
    derivatives = texture.derivatives(np.column_stack([x, 0 * x]))
    assert (derivatives[:, 1] < 1e-9).all()  # monotone from the crest to the trough
    medial = derivatives[:, 0] + x / derivatives[:, 1]
    assert (np.diff(medial) > 0.0).any()
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(0, PERIOD, 4000), np.zeros(4000), np.zeros(4000)])
    points[:, 2] = texture.height(points[:, :2]) - rng.uniform(0.0, 2e-3, 4000)
    assert split_state(Surface(texture, "H", 1.0), points).atoms.max() > 2


@pytest.mark.parametrize("z", [0.999, 0.0, -1.0, -10.0, -1e6])
@pytest.mark.parametrize("c", [1e-6, 1.0, 1e6])
def test_extreme_depths_and_continuities_give_finite_results(z: float, c: float) -> None:
    """The force is finite, the Jacobian within its bounds, and the gap negligible."""
    surface = Surface(Sinusoid(0.8e-3, PERIOD), "H", 1.0, continuity=c)
    x = np.concatenate([[0.25, 0.75, -0.75, 1000.25], np.random.default_rng(1).uniform(-1, 1, 40)])
    points = np.column_stack([x * PERIOD, 0 * x, np.full_like(x, 0.8e-3 * z)])
    force, jacobian = surface.force_and_jacobian(points)
    assert np.isfinite(force).all()
    values = np.linalg.eigvalsh(-jacobian)
    assert values.max() <= 1.0 + 1e-9
    assert values.min() >= -c * (1.0 + 1e-9) - 1e-9
    state = split_state(surface, points)
    assert (state.gap <= 1e-7 * state.potential + 1e-22).all()

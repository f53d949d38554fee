"""Law H compared with a brute-force search of its definition, and pop-through of thin plates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial import cKDTree

from asperity.analysis.energy.field_energy import split_state
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import Profile
from asperity.textures.texture import Texture

PERIOD = 1e-3
TEXTURES: dict[str, Texture] = {
    "gentle": Sinusoid(0.05 * PERIOD, PERIOD),
    "middle": Sinusoid(0.4 * PERIOD, PERIOD, phase=-1.1),
    "noise": Profile(1e-4 * np.random.default_rng(2).normal(size=30), 0.1e-3, periodic=True),
}


def _probes(texture: Texture, count: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    x = rng.uniform(0.0, 2e-3, count)
    depth = texture.peak_to_valley * 10 ** rng.uniform(-1, 0.3, count)
    return np.column_stack([x, 0 * x, texture.height(np.column_stack([x, 0 * x])) - depth])


Distance = Callable[[np.ndarray], np.ndarray]


def _distance(texture: Texture) -> Distance:
    """Return the distance to the free set by a k-d tree of many points of the profile.

    It shares no code with the package's nearest points.
    """
    x = np.linspace(-4e-3, 6e-3, 400_001)
    tree = cKDTree(np.column_stack([x, texture.height(np.column_stack([x, 0 * x]))]))

    def distance(y: np.ndarray) -> np.ndarray:
        inside = texture.height(np.column_stack([y[:, 0], 0 * y[:, 0]])) > y[:, 1]
        return np.asarray(inside * tree.query(y)[0])

    return distance


def _definition(distance: Distance, p: np.ndarray, c: float) -> float:
    """Return (1 - μ) max_y [φ(y) - |p - y|²/(2μ)] by a search over y on ever finer grids."""
    mu = 1.0 / (1.0 + c)
    steps = np.stack(np.meshgrid(*[np.linspace(-1, 1, 9)] * 2), -1).reshape(-1, 2)
    best, reach, value = p, 3.0 * max(1.0, 1.0 / c) * float(distance(p[None])[0]), 0.0
    for _ in range(45):
        y = best + reach * steps
        gain = (1.0 - mu) * 0.5 * (distance(y) ** 2 - np.square(p - y).sum(axis=1) / mu)
        best, reach, value = y[np.argmax(gain)], 0.75 * reach, float(gain.max())
    return value


@pytest.mark.parametrize("name", ["middle", "noise"])
@pytest.mark.parametrize("c", [0.5, 1.0, 4.0])
def test_energy_equals_its_definition(name: str, c: float) -> None:
    """The maximum is attained at y = p - (z̄ - p)/c, and no search exceeds it."""
    texture = TEXTURES[name]
    points = _probes(texture, 30, seed=4)
    surface, distance = Surface(texture, "H", 1.0, continuity=c), _distance(texture)
    state = split_state(surface, points)
    assert set(state.atoms) >= {1, 2}
    y = (points - surface.force(points) / c)[:, [0, 2]]
    square = np.square(points[:, [0, 2]] - y).sum(axis=1)
    attained = 0.5 * (c * distance(y) ** 2 / (1.0 + c) - c * square)
    # Chords of 25 nm deviate from the profile by 1e-6 of the smallest of these depths.
    np.testing.assert_allclose(state.potential, attained, rtol=2e-6)
    result = [_definition(distance, p, c) for p in points[:4, [0, 2]]]
    assert (np.array(result) <= state.potential[:4] * (1.0 + 2e-6)).all()
    # The search is accurate to 2 % even at kinks.
    assert (np.array(result) >= state.potential[:4] * 0.98).all()


def test_plate_pops_through_at_its_depth() -> None:
    """Compared with the energy of a plate by its definition, with φ from both sides."""
    texture, c, thickness = TEXTURES["gentle"], 2.0, 0.5e-3
    surface = Surface(texture, "H", 1.0, continuity=c)
    upper, (low, top) = _distance(texture), texture.extremes
    depth, underside = 0.5 * c / (1.0 + c) * thickness, top - thickness

    def energy(x: float, z: float) -> float:
        def distance(y: np.ndarray) -> np.ndarray:
            return np.minimum(upper(y), np.maximum(y[:, 1] - underside, 0.0))

        return _definition(distance, np.array([x, z]), c)

    for part, is_equal in ((0.5, True), (0.98, True), (1.35, False)):
        z = top - part * depth
        whole = split_state(surface, [[0.5e-3, 0.0, z]]).potential[0]
        assert bool(abs(energy(0.5e-3, z) / whole - 1.0) < 1e-3) is is_equal, part
    # Every path through the plate passes its middle below the troughs.
    barrier = c / (1.0 + c) * (low - underside) ** 2 / 8.0
    energies = [energy(x, 0.5 * (low + underside)) for x in (0.25e-3, 0.6e-3, 0.75e-3)]
    assert barrier * (1.0 - 1e-3) <= min(energies) < 1.05 * barrier


@pytest.mark.parametrize("c", [0.5, 1.0, 3.0])
def test_pop_through_depth_is_sharp_for_a_flat_plate(c: float) -> None:
    """3 % below that depth the energy of the plate differs."""
    thickness = 0.8e-3
    surface = Surface(Profile(np.zeros(8), 1e-3), "H", 1.0, continuity=c, max_depth=1e-3)
    depth = 0.5 * c / (1.0 + c) * thickness

    def distance(y: np.ndarray) -> np.ndarray:
        return np.maximum(np.minimum(-y[:, 1], y[:, 1] + thickness), 0.0)

    for part, is_equal in ((0.9, True), (0.999, True), (1.03, False)):
        z = -part * depth
        whole = split_state(surface, [[3e-3, 0.0, z]]).potential[0]
        assert whole == pytest.approx(0.5 * z * z)
        energy = _definition(distance, np.array([3e-3, z]), c)
        assert bool(abs(energy / whole - 1.0) < 1e-4) is is_equal, part


def test_split_state_outside_contact_has_no_atoms() -> None:
    state = split_state(Surface(TEXTURES["gentle"], "H"), [[0.0, 0.0, 1e-3], [0.1e-3, 0.0, 2e-3]])
    assert repr(state) == "<SplitState of 2 points, into 0 points at most>"

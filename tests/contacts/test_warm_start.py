"""The warm-started search: the same points as without, within its budget and error bound.

Cost is counted in evaluations of the surface; ``make bench`` measures their time.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bench.speed.ticks import adversarial_textures
from bench.stress.nearest_exhaustive import Case, search_exhaustively

from asperity.contacts.warm_start import (
    BUDGET,
    MAX_ERROR_BOUND,
    TRUNCATED_TICKS,
    UNLIMITED,
    WARM_START_SIZE,
    new_warm_start,
)
from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.report.sentences.loop_text import search_error_text
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary, simulate
from asperity.simulation.plants import sampled_plant
from asperity.simulation.simulate import Simulation
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid
from asperity.textures.texture import Texture

PITCH = 50e-6
RNG = np.random.default_rng(71)
STIFFNESS = 700.0


def correlated_noise(*shape: int) -> FloatArray:
    """Return noise of 60 µm that is correlated over a few nodes [m]."""
    from scipy.ndimage import gaussian_filter

    noise = gaussian_filter(np.random.default_rng(72).standard_normal(shape), 2.0, mode="wrap")
    return np.asarray(60e-6 * noise / noise.std())


TEXTURES: dict[str, Texture] = {
    "map": HeightMap(correlated_noise(40, 50), PITCH),
    "periodic map": HeightMap(correlated_noise(40, 50), PITCH, periodic=True),
    "profile": Profile(correlated_noise(120), PITCH),
    "periodic profile": Profile(correlated_noise(120), PITCH, periodic=True),
    "waves": Fourier([60e-6, 40e-6, 20e-6], [[6e3, 1e3], [-2e3, 7e3], [1e4, 9e3]]),
    "parallel waves": Fourier([60e-6, 30e-6], [[6e3, 3e3], [1.2e4, 6e3]]),
    "sinusoid": Sinusoid(0.1e-3, 1e-3, 0.4, (2.0, 1.0)),
}
SPLIT = ("map", "periodic map", "profile", "sinusoid")
EXTENT = 2.5e-3


def stroke(texture: Texture, deepest: float, count: int = 250) -> FloatArray:
    """Return a path (n, 3) [m] beyond the border and back, in and out of contact, with jumps."""
    angle = np.linspace(0.0, 2.0 * np.pi, count)
    xy = EXTENT * (0.5 + 0.9 * np.column_stack([np.sin(angle), np.sin(2.0 * angle + 0.4)]))
    jumps = RNG.integers(0, count, 8)
    xy[jumps] = RNG.uniform(-0.5, 1.5, (8, 2)) * EXTENT
    depth = deepest * np.sin(3.0 * angle + 0.2)
    return np.ascontiguousarray(np.column_stack([xy, texture.height(xy) - depth]))


PATHS = [(letter, name) for name in TEXTURES for letter in "DH" if letter == "D" or name in SPLIT]


@pytest.mark.parametrize(("letter", "name"), PATHS)
def test_path_forces_equal_point_forces(letter: str, name: str):
    """The warm start changes nothing, across ridges, borders, copies and jumps."""
    texture = TEXTURES[name]
    surface = Surface(texture, letter, STIFFNESS)
    path = stroke(texture, 0.5e-3)
    expected = surface.force(path)
    assert ((expected == 0.0).all(axis=1)).sum() > 50
    scale = np.abs(expected).max()
    # H is accurate to the square root of EPS where a god-object starts to split.
    tolerance = 1e-12 if letter == "D" else 1e-7
    np.testing.assert_allclose(surface.trace(path), expected, rtol=0.0, atol=tolerance * scale)


@pytest.mark.parametrize(("letter", "share", "mean"), [("D", 0.9, 20.0), ("H", 0.6, 90.0)])
def test_warm_start_saves_evaluations(letter: str, share: float, mean: float):
    texture = TEXTURES["map"]
    surface = Surface(texture, letter, STIFFNESS)
    path = np.linspace([0.4e-3, 0.6e-3, -0.25e-3], [1.9e-3, 1.2e-3, -0.2e-3], 400)
    warm, cold = evaluation_counts(surface, path), evaluation_counts(surface, path, cold=True)
    assert warm.sum() < share * cold.sum()
    assert warm.mean() < mean


def evaluation_counts(surface: Surface, path: FloatArray, cold: bool = False) -> FloatArray:
    """Return the number of evaluations at each point of a path, (n,)."""
    return trace_with_bounds(surface, path, UNLIMITED, cold)[1][:, 1]


def trace_with_bounds(
    surface: Surface, path: FloatArray, budget: float, cold: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Return forces (n, 3) [N], and error bounds [m] and evaluations (n, 2), along a path."""
    forces, bounds = np.empty((len(path), 3)), np.empty((len(path), 2))
    arguments = surface.texture.arguments, surface.law_arguments
    memory = new_warm_start(budget)
    step = 1 if cold else len(path)
    for i in range(0, len(path), step):
        memory = new_warm_start(budget) if cold else memory
        part = slice(i, i + step)
        surface._path_loops.path_batch(path[part], forces[part], bounds[part], memory, *arguments)
    return forces, bounds


# --- adversarial textures -------------------------------------------------------------------------

SIDE = 40
ADVERSARIES = adversarial_textures(SIDE)


def adversarial_probes(name: str) -> tuple[HeightMap, FloatArray]:
    """Return a surface and probes at and beyond max_depth, and at its centre of curvature."""
    texture, centre = ADVERSARIES[name]
    deep = Surface(texture).max_depth
    xy = RNG.uniform(0.1, 0.9, (24, 2)) * SIDE * PITCH
    depth = deep * RNG.choice([0.3, 1.0, 1.0, 2.5], 24)
    probes = np.column_stack([xy, texture.height(xy) - depth])
    return texture, np.ascontiguousarray(
        np.concatenate([probes, centre, centre + np.array([1e-7, 0, 0])])
    )


@pytest.mark.parametrize("name", ADVERSARIES)
def test_closest_point_within_budget_respects_its_error_bound(name: str):
    """Compared with the exhaustive search, with budgets small enough to be used up."""
    texture, probes = adversarial_probes(name)
    nearest = search_exhaustively(Case(texture, 5e-6, 1e-3), probes)
    surface = Surface(texture, "D", STIFFNESS)
    extent = SIDE * PITCH
    for budget in (12.0, 40.0, 120.0, 400.0, UNLIMITED / 2**20):
        force, bounds = trace_with_bounds(surface, probes, budget, cold=True)
        distances = np.linalg.norm(force, axis=1) / STIFFNESS
        assert (bounds[:, 1] <= budget + 3.0).all()
        assert (distances - bounds[:, 0] <= nearest + 1e-12 * extent).all()
        assert (distances >= nearest - 1e-6 * extent).all()
        if budget == 12.0:
            assert (bounds[:, 0] > 0.0).any()
    # With a large budget the search ends, except where a continuum of points is equally near.
    assert (bounds[:-2, 0] == 0.0).all()


@pytest.mark.parametrize("name", ADVERSARIES)
def test_error_bound_holds_for_tiny_budgets(name: str):
    """Where the descent is truncated, the returned point is not a minimum."""
    texture, probes = adversarial_probes(name)
    surface = Surface(texture, "D", STIFFNESS)
    xy = RNG.uniform(0.1, 0.9, (200, 2)) * SIDE * PITCH
    depth = surface.max_depth * RNG.choice([0.1, 0.3, 1.0], 200)
    shallow_probes = np.column_stack([xy, texture.height(xy) - depth])
    probes = np.ascontiguousarray(np.concatenate([probes[:-2], shallow_probes]))
    nearest = np.linalg.norm(surface.force(probes), axis=1) / STIFFNESS
    for budget in (2.0, 5.0, 8.0, 12.0, 20.0):
        force, bounds = trace_with_bounds(surface, probes, budget, cold=True)
        distances = np.linalg.norm(force, axis=1) / STIFFNESS
        assert (distances - bounds[:, 0] <= nearest * (1.0 + 1e-9)).all()


@pytest.mark.parametrize("law", ["D", "H"])
@pytest.mark.parametrize("direction", [(0.0, 8e3), (3e3, 0.0)], ids=["plane", "line"])
def test_evaluation_cost_grows_with_the_number_of_waves(law: str, direction: tuple[float, float]):
    """The same surface with each wave written as 40: the time of a tick stays bounded."""
    vectors = [[6e3, 0.0], direction]
    two_waves = Fourier([90e-6, 60e-6], vectors)
    eighty_waves = Fourier(np.repeat([90e-6 / 40, 60e-6 / 40], 40), np.repeat(vectors, 40, axis=0))
    surface, split_surface = (
        Surface(texture, law, STIFFNESS, max_depth=1e-3) for texture in (two_waves, eighty_waves)
    )
    xy = RNG.uniform(0.0, EXTENT, (60, 2))
    probes = np.column_stack([xy, two_waves.height(xy) - RNG.uniform(2e-4, 2e-2, 60)])
    expected, budget = surface.force(probes), 300.0 if law == "D" else 900.0
    _force, unlimited = trace_with_bounds(surface, probes, UNLIMITED, cold=True)
    force, bounds = trace_with_bounds(split_surface, probes, budget, cold=True)
    cost = 32.0  # 0.4 per wave
    # Boxes of the plane search cost 1 and 0.1 per wave: 9.0 in place of 1.2.
    least_cost = cost if direction[1] == 0.0 else 9.0 / 1.2
    assert (bounds[:, 1] - budget).max() <= 12.0 * cost
    truncated = bounds[:, 0] > 0.0
    # These searches need more evaluations than the budget allows.
    assert truncated[unlimited[:, 1] > 2.0 * budget / least_cost].all()
    assert truncated.mean() > 0.2
    error = np.linalg.norm(force - expected, axis=1) / STIFFNESS
    distance = np.abs(np.linalg.norm(force, axis=1) - np.linalg.norm(expected, axis=1)) / STIFFNESS
    deviation = distance if law == "D" else error
    assert (deviation <= bounds[:, 0] + 1e-6 * EXTENT).all()


def test_truncated_search_does_miss_the_closest_point():
    """Negative control: with a small budget some points are farther than the closest one."""
    is_farther = []
    for name in ADVERSARIES:
        texture, probes = adversarial_probes(name)
        surface = Surface(texture, "D", STIFFNESS)
        expected = np.linalg.norm(surface.force(probes[:-2]), axis=1)
        force, _bounds = trace_with_bounds(surface, probes[:-2], 12.0, cold=True)
        is_farther.append(np.linalg.norm(force, axis=1) > expected * (1.0 + 1e-6))
    assert np.concatenate(is_farther).sum() >= 3


@pytest.mark.parametrize("name", ADVERSARIES)
def test_split_force_within_budget_respects_its_error_bound(name: str):
    texture, probes = adversarial_probes(name)
    surface = Surface(texture, "H", STIFFNESS)
    probes = probes[:-2]
    expected = surface.force(probes)
    for budget in (150.0, 400.0, 1200.0):
        force, bounds = trace_with_bounds(surface, probes, budget, cold=True)
        error = np.linalg.norm(force - expected, axis=1) / STIFFNESS
        assert (bounds[:, 1] <= budget + 12.0).all()
        assert (error <= bounds[:, 0] + 1e-7 * np.abs(expected).max() / STIFFNESS).all()
        if budget == 150.0:
            assert (bounds[:, 0] > 0.0).any()


def test_truncated_split_force_does_deviate():
    """Negative control: some error is a noticeable part of its bound."""
    worst = 0.0
    for name in ADVERSARIES:
        texture, probes = adversarial_probes(name)
        surface = Surface(texture, "H", STIFFNESS)
        expected = surface.force(probes[:-2])
        force, bounds = trace_with_bounds(surface, probes[:-2], 60.0, cold=True)
        error = np.linalg.norm(force - expected, axis=1) / STIFFNESS
        worst = max(worst, float(np.max(error[bounds[:, 0] > 0.0] / bounds[bounds[:, 0] > 0.0, 0])))
    assert 1e-3 < worst <= 1.0


def test_warm_start_counts_truncated_ticks():
    texture, probes = adversarial_probes("needles")
    surface = Surface(texture, "D", STIFFNESS)
    memory = new_warm_start(40.0)
    first = surface.trace(probes, memory)
    _force, bounds = trace_with_bounds(surface, probes, 40.0)
    assert memory[TRUNCATED_TICKS] == (bounds[:, 0] > 0.0).sum() > 0
    assert memory[MAX_ERROR_BOUND] == bounds[:, 0].max() > 0.0
    # Reproducible.
    np.testing.assert_array_equal(surface.trace(probes, new_warm_start(40.0)), first)


@pytest.mark.parametrize(
    "warm_start", [np.zeros(WARM_START_SIZE), np.ones(WARM_START_SIZE + 1), [1.0] * WARM_START_SIZE]
)
def test_invalid_warm_start_is_an_error(warm_start: FloatArray):
    with pytest.raises(ParameterError, match="warm_start must be an array of"):
        Surface(TEXTURES["map"], "D").trace(np.zeros((1, 3)), warm_start)


@pytest.mark.parametrize("budget", [0.0, -1.0, np.nan])
def test_budget_must_be_positive(budget: float):
    with pytest.raises(ParameterError, match="budget must be"):
        new_warm_start(budget)
    assert new_warm_start(7.0)[BUDGET] == 7.0


# --- simulations ----------------------------------------------------------------------------------


def test_simulation_counts_truncated_searches():
    texture, _centre = ADVERSARIES["needles"]
    surface, servo = Surface(texture, "D", STIFFNESS), Servo(2.5e-4)
    body = sampled_plant(Cartesian(0.05), SpringHand(300.0, 3.0), servo)
    anchor = np.linspace([0.5e-3, 0.5e-3, -1e-3], [1.5e-3, 1.2e-3, -1e-3], 201)
    results = []
    for budget in (30.0, 30.0, None):
        simulation = Simulation(surface, body, servo, anchor[0], np.zeros(3))
        simulation.max_evaluations = budget or simulation.max_evaluations
        simulation.reset()
        simulation.run(anchor)
        results.append((*simulation.search_truncation, *simulation.state))
    assert results[0] == results[1]
    assert results[0][0] > 10
    assert 0.0 < results[0][1] < 2e-3
    assert results[2][0] < results[0][0]


@pytest.mark.parametrize(
    ("letter", "phrase"), [("D", "nearer by at most 2 µm"), ("H", "at most 1.4 mN")]
)
def test_report_of_a_run_mentions_truncated_searches(letter: str, phrase: str):
    surface = Surface(TEXTURES["sinusoid"], letter, STIFFNESS)
    still = Stationary((0.0, 0.0, -0.1e-3))
    run = simulate(surface, Cartesian(0.05), SpringHand(300.0, 3.0), Servo(1e-3), still, 0.05)
    assert (run.truncated_ticks, run.search_error) == (0, 0.0)
    message = search_error_text(replace(run, truncated_ticks=3, search_error=2e-6))
    assert message.startswith("In 3 of 50 samples")
    assert phrase in message

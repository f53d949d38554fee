"""The query of a servo's tick: the same point tick after tick, in time, and certain where it says.

Work is counted in looks, evaluations of the surface: what a look takes is in ``make bench``.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bench.nearest_exhaustive import Case, search_exhaustively
from bench.ticks import adversarial_textures

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
from asperity.report.loop.run_report import search_error_text
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary, simulate
from asperity.simulation.plants import sampled_plant
from asperity.simulation.simulate import Simulation
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid
from asperity.textures.texture import Texture

PITCH = 50e-6
RNG = np.random.default_rng(71)
STIFFNESS = 700.0


def rough(*shape: int) -> FloatArray:
    """Return noise of 60 µm that is correlated over a few nodes [m]."""
    from scipy.ndimage import gaussian_filter

    noise = gaussian_filter(np.random.default_rng(72).standard_normal(shape), 2.0, mode="wrap")
    return np.asarray(60e-6 * noise / noise.std())


TEXTURES: dict[str, Texture] = {
    "map": HeightMap(rough(40, 50), PITCH),
    "periodic map": HeightMap(rough(40, 50), PITCH, periodic=True),
    "profile": Profile(rough(120), PITCH),
    "periodic profile": Profile(rough(120), PITCH, periodic=True),
    "waves": Fourier([60e-6, 40e-6, 20e-6], [[6e3, 1e3], [-2e3, 7e3], [1e4, 9e3]]),
    "parallel waves": Fourier([60e-6, 30e-6], [[6e3, 3e3], [1.2e4, 6e3]]),
    "sinusoid": Sinusoid(0.1e-3, 1e-3, 0.4, (2.0, 1.0)),
}
SPLIT = ("map", "periodic map", "profile", "sinusoid")
EXTENT = 2.5e-3


def stroke(texture: Texture, deepest: float, count: int = 250) -> FloatArray:
    """Return a path (n, 3) [m] over the border and back, in and out of contact, with leaps."""
    turn = np.linspace(0.0, 2.0 * np.pi, count)
    xy = EXTENT * (0.5 + 0.9 * np.column_stack([np.sin(turn), np.sin(2.0 * turn + 0.4)]))
    leap = RNG.integers(0, count, 8)
    xy[leap] = RNG.uniform(-0.5, 1.5, (8, 2)) * EXTENT
    depth = deepest * np.sin(3.0 * turn + 0.2)
    return np.ascontiguousarray(np.column_stack([xy, texture.height(xy) - depth]))


PATHS = [(letter, name) for name in TEXTURES for letter in "DH" if letter == "D" or name in SPLIT]


@pytest.mark.parametrize(("letter", "name"), PATHS)
def test_a_path_has_the_forces_of_its_points(letter: str, name: str):
    """What is remembered makes no difference: over ridges, borders and copies, and after leaps."""
    texture = TEXTURES[name]
    surface = Surface(texture, letter, STIFFNESS)
    path = stroke(texture, 0.5e-3)
    alone = surface.force(path)
    assert ((alone == 0.0).all(axis=1)).sum() > 50
    size = np.abs(alone).max()
    # H is exact to the root of the rounding unit where a god-object begins to split.
    close = 1e-12 if letter == "D" else 1e-7
    np.testing.assert_allclose(surface.trace(path), alone, rtol=0.0, atol=close * size)


@pytest.mark.parametrize(("letter", "share", "mean"), [("D", 0.9, 20.0), ("H", 0.6, 90.0)])
def test_what_is_remembered_saves_looks(letter: str, share: float, mean: float):
    texture = TEXTURES["map"]
    surface = Surface(texture, letter, STIFFNESS)
    path = np.linspace([0.4e-3, 0.6e-3, -0.25e-3], [1.9e-3, 1.2e-3, -0.2e-3], 400)
    together, alone = looks(surface, path), looks(surface, path, forgotten=True)
    assert together.sum() < share * alone.sum()
    assert together.mean() < mean


def looks(surface: Surface, path: FloatArray, forgotten: bool = False) -> FloatArray:
    """Return the looks of each point of a path, (n,)."""
    return told(surface, path, UNLIMITED, forgotten)[1][:, 1]


def told(
    surface: Surface, path: FloatArray, budget: float, forgotten: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Return forces (n, 3) [N] and gap [m] and looks (n, 2) of each point of a path."""
    out, said = np.empty((len(path), 3)), np.empty((len(path), 2))
    arguments = surface.texture.arguments, surface.law_arguments
    memory = new_warm_start(budget)
    step = 1 if forgotten else len(path)
    for i in range(0, len(path), step):
        memory = new_warm_start(budget) if forgotten else memory
        part = slice(i, i + step)
        surface._path_loops.path_batch(path[part], out[part], said[part], memory, *arguments)
    return out, said


# --- adversaries ----------------------------------------------------------------------------------

SIDE = 40
ADVERSARIES = adversarial_textures(SIDE)


def below(name: str) -> tuple[HeightMap, FloatArray]:
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
def test_a_foot_within_the_budget_is_as_near_as_it_says(name: str):
    """Against the exhaustive search; few looks, so that the budget is used up."""
    texture, probes = below(name)
    nearest = search_exhaustively(Case(texture, 5e-6, 1e-3), probes)
    surface = Surface(texture, "D", STIFFNESS)
    extent = SIDE * PITCH
    for budget in (40.0, 120.0, 400.0, UNLIMITED / 2**20):
        force, said = told(surface, probes, budget, forgotten=True)
        found = np.linalg.norm(force, axis=1) / STIFFNESS
        assert (said[:, 1] <= budget + 3.0).all()
        assert (found - said[:, 0] <= nearest + 1e-12 * extent).all()
        assert (found >= nearest - 1e-6 * extent).all()
        if budget == 40.0:
            assert (said[:, 0] > 0.0).any()
    # Looks enough: nothing is left open, but where a continuum of points is equally near.
    assert (said[:-2, 0] == 0.0).all()


@pytest.mark.parametrize("name", ADVERSARIES)
def test_no_budget_is_so_small_that_a_gap_is_claimed_wrongly(name: str):
    """Where it ends on the way down, the point that is taken is no minimum."""
    texture, probes = below(name)
    surface = Surface(texture, "D", STIFFNESS)
    xy = RNG.uniform(0.1, 0.9, (200, 2)) * SIDE * PITCH
    depth = surface.max_depth * RNG.choice([0.1, 0.3, 1.0], 200)
    more = np.column_stack([xy, texture.height(xy) - depth])
    probes = np.ascontiguousarray(np.concatenate([probes[:-2], more]))
    nearest = np.linalg.norm(surface.force(probes), axis=1) / STIFFNESS
    for budget in (2.0, 5.0, 8.0, 12.0, 20.0):
        force, said = told(surface, probes, budget, forgotten=True)
        found = np.linalg.norm(force, axis=1) / STIFFNESS
        assert (found - said[:, 0] <= nearest * (1.0 + 1e-9)).all()


@pytest.mark.parametrize("law", ["D", "H"])
@pytest.mark.parametrize("direction", [(0.0, 8e3), (3e3, 0.0)], ids=["plane", "line"])
def test_a_look_at_many_waves_costs_as_many_more(law: str, direction: tuple[float, float]):
    """The same surface, each of its two waves written as 40: the time of a tick stays bounded."""
    vectors = [[6e3, 0.0], direction]
    few = Fourier([90e-6, 60e-6], vectors)
    many = Fourier(np.repeat([90e-6 / 40, 60e-6 / 40], 40), np.repeat(vectors, 40, axis=0))
    one, other = (Surface(texture, law, STIFFNESS, max_depth=1e-3) for texture in (few, many))
    xy = RNG.uniform(0.0, EXTENT, (60, 2))
    probes = np.column_stack([xy, few.height(xy) - RNG.uniform(2e-4, 2e-2, 60)])
    exact, budget = one.force(probes), one.law.contact.max_evaluations
    _force, free = told(one, probes, UNLIMITED, forgotten=True)
    force, said = told(other, probes, budget, forgotten=True)
    cost = 32.0  # 0.4 of each wave
    assert (said[:, 1] <= budget + 3.0 * cost).all()
    unsure = said[:, 0] > 0.0
    # More than so many evaluations would have been late.
    assert unsure[free[:, 1] > 2.0 * budget / cost].all()
    assert unsure.mean() > 0.2
    error = np.linalg.norm(force - exact, axis=1) / STIFFNESS
    distance = np.abs(np.linalg.norm(force, axis=1) - np.linalg.norm(exact, axis=1)) / STIFFNESS
    wrong = distance if law == "D" else error
    assert (wrong <= said[:, 0] + 1e-6 * EXTENT).all()


def test_without_its_gap_a_foot_would_be_claimed_wrongly():
    """The negative control: under a small budget some foot is farther than the nearest point."""
    wrong = []
    for name in ADVERSARIES:
        texture, probes = below(name)
        surface = Surface(texture, "D", STIFFNESS)
        exact = np.linalg.norm(surface.force(probes[:-2]), axis=1)
        force, _said = told(surface, probes[:-2], 12.0, forgotten=True)
        wrong.append(np.linalg.norm(force, axis=1) > exact * (1.0 + 1e-6))
    assert np.concatenate(wrong).sum() >= 3


@pytest.mark.parametrize("name", ADVERSARIES)
def test_a_split_force_within_the_budget_is_right_to_its_gap(name: str):
    texture, probes = below(name)
    surface = Surface(texture, "H", STIFFNESS)
    probes = probes[:-2]
    exact = surface.force(probes)
    for budget in (150.0, 400.0, 1200.0):
        force, said = told(surface, probes, budget, forgotten=True)
        error = np.linalg.norm(force - exact, axis=1) / STIFFNESS
        assert (said[:, 1] <= budget).all()
        assert (error <= said[:, 0] + 1e-7 * np.abs(exact).max() / STIFFNESS).all()
        if budget == 150.0:
            assert (said[:, 0] > 0.0).any()


def test_some_split_force_is_wrong_where_it_says_so():
    """The negative control of the bound: without it forces would be claimed wrongly."""
    worst = 0.0
    for name in ADVERSARIES:
        texture, probes = below(name)
        surface = Surface(texture, "H", STIFFNESS)
        exact = surface.force(probes[:-2])
        force, said = told(surface, probes[:-2], 60.0, forgotten=True)
        error = np.linalg.norm(force - exact, axis=1) / STIFFNESS
        worst = max(worst, float(np.max(error[said[:, 0] > 0.0] / said[said[:, 0] > 0.0, 0])))
    assert 1e-3 < worst <= 1.0


def test_a_memory_counts_the_ticks_that_were_cut_short():
    texture, probes = below("needles")
    surface = Surface(texture, "D", STIFFNESS)
    memory = new_warm_start(40.0)
    first = surface.trace(probes, memory)
    _force, said = told(surface, probes, 40.0)
    assert memory[TRUNCATED_TICKS] == (said[:, 0] > 0.0).sum() > 0
    assert memory[MAX_ERROR_BOUND] == said[:, 0].max() > 0.0
    # The same every time.
    np.testing.assert_array_equal(surface.trace(probes, new_warm_start(40.0)), first)


@pytest.mark.parametrize(
    "warm_start", [np.zeros(WARM_START_SIZE), np.ones(WARM_START_SIZE + 1), [1.0] * WARM_START_SIZE]
)
def test_another_array_is_no_warm_start(warm_start: FloatArray):
    with pytest.raises(ParameterError, match="warm_start must be an array of"):
        Surface(TEXTURES["map"], "D").trace(np.zeros((1, 3)), warm_start)


@pytest.mark.parametrize("budget", [0.0, -1.0, np.nan])
def test_a_budget_is_positive(budget: float):
    with pytest.raises(ParameterError, match="budget must be"):
        new_warm_start(budget)
    assert new_warm_start(7.0)[BUDGET] == 7.0


# --- simulations ----------------------------------------------------------------------------------


def test_a_simulation_tells_how_often_its_search_was_cut_short():
    texture, _centre = ADVERSARIES["needles"]
    surface, servo = Surface(texture, "D", STIFFNESS), Servo(2.5e-4)
    body = sampled_plant(Cartesian(0.05), SpringHand(300.0, 3.0), servo)
    anchor = np.linspace([0.5e-3, 0.5e-3, -1e-3], [1.5e-3, 1.2e-3, -1e-3], 201)
    found = []
    for budget in (30.0, 30.0, None):
        simulation = Simulation(surface, body, servo, anchor[0], max_evaluations=budget)
        simulation.run(anchor)
        found.append((*simulation.search_truncation, *simulation.state))
    assert found[0] == found[1]
    assert found[0][0] > 10
    assert 0.0 < found[0][1] < 2e-3
    assert found[2][0] < found[0][0]


@pytest.mark.parametrize(
    ("letter", "words"), [("D", "nearer by at most 2 µm"), ("H", "at most 1.4 mN")]
)
def test_the_answer_of_a_run_says_so(letter: str, words: str):
    surface = Surface(TEXTURES["sinusoid"], letter, STIFFNESS)
    still = Stationary((0.0, 0.0, -0.1e-3))
    run = simulate(surface, Cartesian(0.05), SpringHand(300.0, 3.0), Servo(1e-3), still, 0.05)
    assert (run.truncated_ticks, run.search_error) == (0, 0.0)
    said = search_error_text(replace(run, truncated_ticks=3, search_error=2e-6))
    assert said.startswith("In 3 of 50 samples")
    assert words in said

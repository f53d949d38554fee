"""The theorems behind the criteria: adversarial motions, storage, eigenvalues, a counterexample."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from asperity.analysis import characteristic_number, loop_work, one_sided_number
from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.closed_loops import AbsorbingFriction, polygon_length
from asperity.analysis.energy.field_energy import split_state
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.passivity.verdict import Passivity, passivity
from asperity.devices import parse_device
from asperity.surface import Surface
from asperity.textures.kinds.fourier import Fourier
from asperity.textures.kinds.sinusoid import Sinusoid

WAVE = Sinusoid(0.1e-3, 2e-3, phase=0.4, direction=(3.0, 1.0))
STEEP = Sinusoid(0.8e-3, 1e-3)
# Sharp crests, round troughs: q = 8.7 but q⁺ = 5.5 for law C (MATH section 4), in millimetres.
SHARP = Fourier([1e-4, 4e-5, 2e-5], 2e3 * np.pi * np.array([1.0, 2.0, 3.0]), [np.pi / 2] * 3)
RIG = {"damping": "2 N*s/m", "update_rate": "4 kHz"}
SIGMA, T = 2.0, 1.0 / 4000.0


def assess(surface: Surface, fields: dict[str, Any]) -> Passivity:
    q, plus = characteristic_number(surface), one_sided_number(surface)
    return passivity(surface, parse_device(fields, "mine"), q, plus, worst_loop(surface))


# --- the theorems: adversarial motions of the probe -----------------------------------------------


def energy_gain(forces: np.ndarray, path: np.ndarray, loss: float, delay: int = 0) -> float:
    """Return the energy that the hand gains on a path (n, 3): work of the held forces less damping.

    The path is periodic, so that delayed samples are those of the previous period.
    """
    steps = np.roll(path, -1, axis=0) - path
    held = np.roll(forces, delay, axis=0)
    return float(np.sum(held * steps) - loss * np.sum(steps * steps))


def oscillate(surface: Surface, bound: Bound, period: int, size: float, slack: bool = False) -> Any:
    """Return forces, path and stiffness of a straight oscillation along the stiffest direction."""
    at = np.array(bound.at) - [0.0, 0.0, 2.0 * size]
    jacobian = surface.jacobian([at])[0]
    values, vectors = np.linalg.eigh(-0.5 * (jacobian + jacobian.T))
    direction = vectors[:, 0 if slack else -1]
    x = size * np.cos(2.0 * np.pi * np.arange(period) / period)
    path = at + x[:, None] * direction
    return surface.force(path), path, float(abs(values[0 if slack else -1]))


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_oscillation_gains_energy_only_above_the_limit(delay: int) -> None:
    """The limit of the delay rule is sharp where q = q⁺ (law C on a sinusoid)."""
    surface = Surface(WAVE, "C", 1000.0, 0.2e-3)
    plus = one_sided_number(surface)
    sharp = plus.upper * (0.5 + delay) * 1000.0
    gains = {}
    for period in (2, 3, 4, 7, 40, 200):
        forces, path, _ = oscillate(surface, plus, period, 1e-9)
        gains[period] = [energy_gain(forces, path, part * sharp, delay) for part in (0.99, 1.001)]
    assert max(below for below, _above in gains.values()) > 0.0
    assert max(above for _below, above in gains.values()) < 0.0


def test_one_sided_rule_is_sharp_where_q_is_much_larger() -> None:
    """On sharp crests without delay q⁺ decides, although q is 1.57 times as large."""
    surface = Surface(SHARP, "C", 1000.0, 0.5e-3)
    q, plus = characteristic_number(surface), one_sided_number(surface)
    assert (q.lower, plus.lower) == (pytest.approx(8.685, abs=1e-3), pytest.approx(5.533, abs=1e-3))
    forces, path, stiffest = oscillate(surface, plus, 2, 1e-9)
    assert stiffest == pytest.approx(1000.0 * plus.lower, rel=1e-4)
    assert energy_gain(forces, path, 0.5 * 0.999 * 1000.0 * plus.lower) > 0.0
    assert energy_gain(forces, path, 0.5 * 1.001 * 1000.0 * plus.lower) < 0.0
    # At the witness of q the field is slack: without delay no oscillation gains energy there.
    for period in (2, 3, 10):
        forces, path, slack = oscillate(surface, q, period, 1e-9, slack=True)
        assert slack == pytest.approx(1000.0 * q.lower, rel=1e-4)
        assert energy_gain(forces, path, 1e-3) < 0.0
    # With one sample of delay it does, up to k q/2.
    forces, path, _ = oscillate(surface, q, 2, 1e-9, slack=True)
    assert energy_gain(forces, path, 0.5 * 0.999 * 1000.0 * q.lower, delay=1) > 0.0
    assert energy_gain(forces, path, 0.5 * 1.001 * 1000.0 * q.lower, delay=1) < 0.0


@pytest.mark.parametrize("delay", [1, 2, 3])
def test_law_d_with_delay_delivers_energy_across_its_ridge_at_any_damping(delay: int) -> None:
    """The probe stays d samples on each side, so that the held force is that of the other side."""
    surface = Surface(STEEP, "D", 10.0)
    for loss in (1e3, 1e6):
        size = 1e-3 * 10.0 / loss * 1e-3
        side = np.repeat([-1.0, 1.0], delay)
        path = np.array([0.25e-3, 0.0, 0.0]) + size * side[:, None] * [1.0, 0.0, 0.0]
        forces = surface.force(path)
        assert energy_gain(forces, path, loss, delay) > 0.0
        assert energy_gain(forces, path, loss, 0) < 0.0


# --- the theorems: storage ------------------------------------------------------------------------


def potential(surface: Surface) -> Callable[[np.ndarray], np.ndarray]:
    """Return the stored energy [J], from its definition."""
    k, texture = surface.stiffness, surface.texture

    def stored(points: np.ndarray) -> np.ndarray:
        if surface.law.letter == "H":
            return split_state(surface, points).potential
        level = 0.0 if surface.law.letter == "W" else texture.height(points[:, :2])
        depth = np.maximum(level - points[:, 2], 0.0)
        if surface.law.letter == "D":
            closest_point = texture.nearest(points)
            depth = np.where(depth > 0.0, np.linalg.norm(points - closest_point, axis=1), 0.0)
        return 0.5 * k * depth**2

    return stored


def random_walk(surface: Surface, scale: float, seed: int, steps: int) -> np.ndarray:
    """Return random walks (steps, scenes, 3) near the surface, in and out of contact."""
    rng = np.random.default_rng(seed)
    scenes = 40
    sizes = scale * 10.0 ** rng.uniform(-4.0, 0.0, (1, scenes, 1))
    path = np.cumsum(sizes * rng.normal(size=(steps, scenes, 3)), axis=0)
    top = surface.texture.extremes[1]
    path[..., 2] = top - np.abs(path[..., 2] + scale * rng.uniform(0, 1, scenes)) % scale
    return path


@pytest.mark.parametrize(
    ("letter", "texture", "steps"),
    [("C", WAVE, 400), ("C", SHARP, 400), ("D", STEEP, 400), ("H", STEEP, 40), ("H", SHARP, 8)],
)
def test_energy_gained_never_exceeds_the_stored_energy(
    letter: str, texture: Any, steps: int
) -> None:
    """At k q⁺ = 2σ₀/T: Σ f_i Δ_i - σ₀/T |Δ_i|² <= U_0 - U_n at every n, for any motion."""
    surface = Surface(texture, letter, 1000.0, 0.5e-3)
    loss = 0.5 * 1000.0 * one_sided_number(surface).upper
    path = random_walk(surface, 0.5e-3, seed=3, steps=steps)
    assert storage_margin(surface, path, loss) > -1e-16


def storage_margin(surface: Surface, path: np.ndarray, loss: float, delay: int = 0) -> float:
    """Return the minimum of U_0 - U_n - gained_n over all scenes and n [J]."""
    shape = path.shape
    forces = surface.force(path.reshape(-1, 3)).reshape(shape)
    stored = potential(surface)(path.reshape(-1, 3)).reshape(shape[:2])
    held = np.concatenate([np.repeat(forces[:1], delay, axis=0), forces])[: shape[0]]
    steps = np.diff(path, axis=0)
    gained = np.cumsum((held[:-1] * steps).sum(-1) - loss * (steps * steps).sum(-1), axis=0)
    return float((stored[0] - stored[1:] - gained).min())


@pytest.mark.parametrize("letter", "CDH")
def test_stored_energy_is_exceeded_with_less_damping(letter: str) -> None:
    """Negative control: with 0.9 of the required damping an oscillation gains energy."""
    surface = Surface(WAVE, letter, 1000.0, 0.5e-3)
    loss = 0.5 * 1000.0 * one_sided_number(surface).lower
    at = np.array(one_sided_number(surface).at) - [0.0, 0.0, 1e-6]
    stiff = -0.5 * (surface.jacobian([at])[0] + surface.jacobian([at])[0].T)
    direction = np.linalg.eigh(stiff)[1][:, -1]
    sides = np.where(np.arange(100) % 2 == 0, -1e-8, 1e-8)
    path = (at + sides[:, None] * direction)[:, None, :]
    assert storage_margin(surface, path, 0.9 * loss) < -1e-14
    assert storage_margin(surface, path, 1.01 * loss) > 0.0


@pytest.mark.parametrize(("letter", "texture"), [("C", WAVE), ("H", STEEP), ("W", WAVE)])
@pytest.mark.parametrize("delay", [1, 3])
def test_energy_gained_with_delay_never_exceeds_the_stored_energy(
    letter: str, texture: Any, delay: int
) -> None:
    """At k (q⁺/2 + d q) = σ₀/T, for random walks and square waves of a hand initially at rest."""
    surface = Surface(texture, letter, 1000.0, 0.5e-3)
    q, plus = characteristic_number(surface), one_sided_number(surface)
    loss = 1000.0 * (0.5 * plus.upper + delay * q.upper)
    path = random_walk(surface, 0.5e-3, seed=4, steps=20 if letter == "H" else 400)
    assert storage_margin(surface, path, loss, delay) > -1e-16
    square = path[:20][np.arange(240) // (2 * delay + 1) % 20]
    assert storage_margin(surface, square, loss, delay) > -1e-16


# --- the theorems: a device with a mass -----------------------------------------------------------


def sample_response(
    mass: float, damping: float, period: float
) -> tuple[float, float, float, float]:
    """Return a, b, c, d of the exact response over a sample: p += a v + b F, v = c v + d F."""
    rates = np.array([[0.0, 1.0, 0.0], [0.0, -damping / mass, 1.0 / mass], [0.0, 0.0, 0.0]])
    response = expm(period * rates)
    return response[0, 1], response[0, 2], response[1, 1], response[1, 2]


@pytest.mark.parametrize(("letter", "texture"), [("C", WAVE), ("H", STEEP)])
def test_stored_energy_never_exceeds_the_energy_supplied_by_the_hand(
    letter: str, texture: Any
) -> None:
    """Free masses under random hand forces, with damping at the limit of the one-sided rule."""
    surface = Surface(texture, letter, 1000.0, 0.5e-3)
    damping = 0.5 * 1000.0 * one_sided_number(surface).upper * T
    rng = np.random.default_rng(11)
    stored = potential(surface)
    worst, deepest = math.inf, 0.0
    for mass in (0.01, 0.1):
        a, b, c, d = sample_response(mass, damping, T)
        p = np.column_stack([rng.uniform(0, 2e-3, (60, 2)), np.full(60, texture.extremes[1])])
        v = rng.normal(size=(60, 3)) * 0.02
        energy = 0.5 * mass * (v * v).sum(1) + stored(p)
        supplied = np.zeros(60)
        for _ in range(1500):
            rise = texture.extremes[1] - 0.15e-3 - p[:, 2]
            hand = rng.normal(size=(60, 3)) * 0.3
            hand[:, 2] += 400.0 * rise - 2.0 * v[:, 2]
            total = surface.force(p) + hand
            move = a * v + b * total
            p, v = p + move, c * v + d * total
            supplied += (hand * move).sum(1)
            now = 0.5 * mass * (v * v).sum(1) + stored(p)
            worst = min(worst, float((energy + supplied - now).min()))
            deepest = max(deepest, float((texture.height(p[:, :2]) - p[:, 2]).max()))
    assert worst > -1e-15
    assert 0.1e-3 < deepest < 0.5e-3 or letter == "H"


def spectral_radius(
    k: float, mass: float, damping: float, delay: int, virtual: float = 0.0
) -> float:
    """Return the spectral radius of a mass on a delayed spring with a virtual damper."""
    a, b, c, d = sample_response(mass, damping, T)
    # The state: x, v and the d + 1 previous samples.
    size = delay + 4
    matrix = np.zeros((size, size))
    held = np.zeros(size)  # the force held, in terms of the state
    history = [0, *range(2, size)]
    held[history[delay]] -= k
    held[history[delay]] -= virtual / T
    held[history[delay + 1]] += virtual / T
    unit = np.eye(size)
    matrix[0] = unit[0] + a * unit[1] + b * held
    matrix[1] = c * unit[1] + d * held
    for index in range(2, size):
        matrix[index] = unit[history[index - 2]]
    return float(np.abs(np.linalg.eigvals(matrix)).max())


@pytest.mark.parametrize("delay", [0, 1, 2, 4])
def test_delay_rule_of_a_wall_is_the_stability_limit_of_a_heavy_mass(delay: int) -> None:
    """The limit k < b/((d + 1/2) T) from eigenvalues of mass, damper and delayed, held spring."""
    limit = assess(Surface(WAVE, "W"), {**RIG, "delay_samples": delay}).stability_limit.stiffness
    assert limit == pytest.approx(SIGMA / ((delay + 0.5) * T), rel=1e-15)
    heavy = 10.0
    assert spectral_radius(0.999 * limit, heavy, SIGMA, delay) < 1.0
    assert spectral_radius(1.001 * limit, heavy, SIGMA, delay) > 1.0
    # A passive loop is stable with any hand, here masses of every size.
    for mass in (1e-6, 1e-4, 1e-2, 1.0, 100.0):
        assert spectral_radius(0.999 * limit, mass, SIGMA, delay) < 1.0


def test_paper_condition_is_not_sufficient_with_two_samples_of_delay() -> None:
    paper_limit = assess(Surface(WAVE, "W"), RIG).criterion("paper (1)").limit
    assert paper_limit is not None
    assert [spectral_radius(paper_limit, 10.0, SIGMA, delay) < 1.0 for delay in (0, 1, 2)] == [
        True,
        True,
        False,
    ]
    surface = Surface(WAVE, "W", paper_limit)
    verdicts = [assess(surface, {**RIG, "delay_samples": d}).verdict for d in (0, 1, 2)]
    assert verdicts == ["passive", "passive", "not passive"]


@pytest.mark.parametrize("virtual", [0.5, -0.5])
def test_virtual_damping_limit_against_eigenvalues(virtual: float) -> None:
    """Light masses attain K T/2 + b_v; with b_v < 0 heavy masses attain K T/2 - b_v."""
    rig = {**RIG, "delay_samples": 0, "virtual_damping": virtual}
    limit = assess(Surface(WAVE, "W"), rig).stability_limit.stiffness
    assert limit is not None
    critical = 1e-7 if virtual > 0.0 else 10.0
    assert spectral_radius(0.999 * limit, critical, SIGMA, 0, virtual) < 1.0
    assert spectral_radius(1.001 * limit, critical, SIGMA, 0, virtual) > 1.0


@pytest.mark.parametrize("virtual", [0.5, -0.5])
@pytest.mark.parametrize("delay", [0, 1, 2])
def test_virtual_damping_with_delay_is_stable_at_its_limit(virtual: float, delay: int) -> None:
    rig = {**RIG, "delay_samples": delay, "virtual_damping": virtual}
    limit = assess(Surface(WAVE, "W"), rig).stability_limit.stiffness
    assert limit is not None
    for mass in 10.0 ** np.arange(-7.0, 5.0):
        assert spectral_radius(0.999 * limit, mass, SIGMA, delay, virtual) < 1.0


@settings(max_examples=300, deadline=None)
@given(
    k=st.floats(1.0, 1e5),
    virtual=st.floats(-3.0, 3.0),
    delay=st.integers(0, 5),
    turns=st.integers(1, 200),
)
def test_passive_spring_gains_no_energy_at_any_frequency(
    k: float, virtual: float, delay: int, turns: int
) -> None:
    """An oscillating spring with a virtual damper gains energy only without a passive verdict."""
    rig = {**RIG, "delay_samples": delay, "virtual_damping": virtual}
    verdict = assess(Surface(WAVE, "W", k), rig).verdict
    angle = np.pi * turns / 200
    x = np.exp(1j * angle * np.arange(400))
    velocity = (x - np.roll(x, 1)) / T
    held = np.roll(-k * x - virtual * velocity, delay)
    displacement = np.roll(x, -1) - x
    gained = float(
        np.sum((held * displacement.conj()).real - SIGMA / T * np.abs(displacement) ** 2)
    )
    scale = float(np.sum(np.abs(held * displacement)))
    if verdict == "passive":
        assert gained <= 1e-12 * scale


def test_not_passive_verdicts_have_a_frequency_that_gains_energy() -> None:
    """The converse of the previous test, on a grid of frequencies."""
    rng = np.random.default_rng(5)
    angles = np.pi * np.arange(1, 2521) / 2520  # contains every πm/(d + 1), d <= 5
    seen = set()
    for _ in range(300):
        k, virtual, delay = 10.0 ** rng.uniform(2, 5), rng.uniform(-3, 3), int(rng.integers(0, 6))
        rig = {**RIG, "delay_samples": delay, "virtual_damping": virtual}
        verdict = assess(Surface(WAVE, "W", k), rig).verdict
        spring = k * np.sin((delay + 0.5) * angles) / (2.0 * np.sin(angles / 2.0))
        most = float((spring - virtual / T * np.cos((delay + 1) * angles)).max())
        seen.add(verdict)
        if verdict == "not passive":
            assert most > SIGMA / T * (1.0 - 1e-5)
        if verdict == "passive":
            assert most <= SIGMA / T * (1.0 + 1e-12)
    assert seen == {"passive", "not passive", "undecided"}


# --- the counter-example --------------------------------------------------------------------------


def test_counterexample_to_the_paper_s_condition() -> None:
    """At equality in (1) the paper's loop in law A gains below 0.2275 m/s (MATH section 4)."""
    k, length, height, period = 1000.0, 2e-3, 0.8e-3, 1e-4
    surface = Surface(Sinusoid(height, length), "A", k)
    q = characteristic_number(surface)
    damping = 2.0 * period * k * q.value
    corners = np.array([[0, 0, 0], [length / 4, 0, 0], [length / 4, 0, height], [0, 0, height]])
    energy = loop_work(surface, corners)
    friction = AbsorbingFriction(energy / polygon_length(corners), math.inf, energy, corners)
    leak = replace(worst_loop(surface), energy=energy, vertices=corners, absorbing=friction)
    rig = parse_device({"damping": damping, "update_rate": 1.0 / period, "delay_samples": 0}, "p")
    result = passivity(surface, rig, q, one_sided_number(surface), leak)
    assert result.criterion("paper (1)").limit == pytest.approx(k, rel=1e-14)
    assert result.critical_speed == pytest.approx(0.2275, abs=5e-5)
    assert (result.verdict, result.decided_by) == ("not passive", "leak")
    # Sampled finely at that damping, the loop gains energy below the speed and loses it above.
    for speed, is_gaining in ((0.99, True), (1.01, False)):
        path = sample_polygon(corners, speed * result.critical_speed * 1e-7)
        gained = energy_gain(surface.force(path), path, damping / 1e-7)
        assert (gained > 0.0) is is_gaining
    # Sampled at T = 1e-4 s the hold adds energy; slow loops gain.
    path = sample_polygon(corners, 0.5 * result.critical_speed * period)
    assert energy_gain(surface.force(path), path, damping / period) > 0.0


def sample_polygon(corners: np.ndarray, stride: float) -> np.ndarray:
    """Return points of a closed polygon, at most about a stride apart on each edge."""
    points = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = max(round(float(np.linalg.norm(end - start)) / stride), 1)
        points.append(start + np.arange(count)[:, None] / count * (end - start))
    return np.concatenate(points)

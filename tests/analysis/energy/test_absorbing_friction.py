"""Dry friction that absorbs the gain of every closed path: bounds, and the loops found."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from asperity.analysis.energy.absorbing_friction import region_floor
from asperity.analysis.energy.closed_loops import NO_FRICTION
from asperity.analysis.energy.field_energy import loop_work, steady_work
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.gain.theorems import residual_bound
from asperity.surface import Surface
from asperity.textures.kinds.noise import Noise
from asperity.textures.kinds.sinusoid import Sinusoid

K, DEPTH = 1000.0, 0.8e-3
STEEP = Sinusoid(0.8e-3, 2e-3)
SLOPE = 0.8 * math.pi
STRETCH = math.hypot(1.0, SLOPE)
# Law, greatest W/length of loops of an independent search [N], proved bound [N].
KNOWN = (
    ("A", 0.2875, K * DEPTH * SLOPE / STRETCH),
    ("B", 0.0998, K * DEPTH * (STRETCH - 1.0) / (STRETCH + 1.0)),
    ("E", 0.2095, K * DEPTH * SLOPE / STRETCH),
    ("G", 0.2305, K * DEPTH * SLOPE / STRETCH),
)
# Law, law whose force is -∇U, and its share c as a function of the stretch S.
SPLITS = (
    ("A", "C", lambda stretch: stretch**-2),
    ("B", "C", lambda stretch: 2.0 / (1.0 + stretch)),
    ("E", "D", lambda stretch: 1.0 / stretch),
    ("G", "W", lambda stretch: 1.0 / stretch),
)


@pytest.mark.parametrize(("letter", "least", "bound"), KNOWN)
def test_greatest_energy_per_length_on_a_sinusoid(letter: str, least: float, bound: float) -> None:
    surface = Surface(STEEP, letter, K, DEPTH)
    leak = worst_loop(surface)
    friction = leak.absorbing
    assert least <= friction.found <= bound
    assert friction.upper == pytest.approx(bound, rel=1e-9)
    assert friction.found > 1.2 * leak.energy / leak.length
    work = loop_work(surface, friction.vertices, 1e-6)
    assert work == pytest.approx(friction.found * friction.length, rel=1e-4)
    floor = region_floor(surface, np.ascontiguousarray(friction.vertices[:, :2]))
    assert (friction.vertices[:, 2] >= floor - 1e-12).all()


@pytest.mark.parametrize(("letter", "gradient", "share"), SPLITS)
def test_residual_bound_is_the_greatest_residual(
    letter: str, gradient: str, share: Callable[[float], float]
) -> None:
    """The force is -∇U + r, |r| at most the bound, attained where the slope is steepest."""
    rng = np.random.default_rng(5)
    texture = Sinusoid(0.3e-3, 2e-3, direction=(0.6, 0.8))
    stretch = math.hypot(1.0, texture.bounds[0])
    depth = 0.2e-3
    surface = Surface(texture, letter, K, depth)
    xy = rng.uniform(-2e-3, 2e-3, (4000, 2))
    inside = depth * rng.uniform(0.0, 1.0, 4000) ** 0.2
    points = np.column_stack([xy, surface.law.contact.contact_height(texture, xy) - inside])
    pull = share(stretch) * Surface(texture, gradient, K).force(points)
    residual = surface.force(points) - pull
    worst = float(np.linalg.norm(residual, axis=1).max())
    bound = residual_bound(surface)
    assert worst <= bound * (1.0 + 1e-12)
    # Right below a steep flank the distance is less than the depth, the residual of E too.
    assert worst > (0.6 if letter == "E" else 0.95) * bound
    # Another potential leaves more: the share is the best one.
    other = surface.force(points) - 0.5 * pull
    assert float(np.linalg.norm(other, axis=1).max()) > (0.6 if letter == "E" else 1.0) * bound


def test_clamp_that_holds_a_part_of_the_force_has_no_bound() -> None:
    assert math.isfinite(residual_bound(Surface(STEEP, "B", K, DEPTH, clamp="backed")))
    assert math.isinf(residual_bound(Surface(STEEP, "B", K, DEPTH, clamp="lateral")))


def test_friction_of_a_conservative_law_is_zero_and_scales_with_the_stiffness() -> None:
    assert worst_loop(Surface(STEEP, "H", K, DEPTH)).absorbing == NO_FRICTION
    soft, stiff = (worst_loop(Surface(STEEP, "G", k, DEPTH)).absorbing for k in (100.0, 300.0))
    assert stiff.found == pytest.approx(3.0 * soft.found, rel=1e-12)
    assert stiff.upper == pytest.approx(3.0 * soft.upper, rel=1e-12)


def test_map_is_searched_in_all_directions() -> None:
    surface = Surface(Noise(50e-6, 4e-3, seed=2), "B", K)
    every = worst_loop(surface)
    along = worst_loop(surface, (1.0, 0.0))
    assert every.energy > 1.05 * along.energy
    assert every.description.endswith("the worst of 177 lines in 13 directions")
    assert loop_work(surface, every.vertices) == pytest.approx(every.energy, rel=1e-9)
    ends = every.vertices[:, :2] - surface.texture.domain.origin
    assert (np.abs(ends - 2e-3) < 2e-3 + 1e-9).all()
    assert along.energy / along.length < every.absorbing.found <= every.absorbing.upper


def test_steady_work_is_that_of_the_third_turn() -> None:
    """The first turn of a path that winds loads the anchor; later ones gain."""
    surface = Surface(STEEP, "F", K, 1e-3)
    x = 1e-3 * np.array([0.2, 1.2, 1.2, 0.2, 0.2, -0.8, -0.8, 0.2])
    z = -1e-3 * np.array([0.1, 0.1, 1.0, 1.0, 0.1, 0.1, 1.0, 1.0])
    vertices = np.roll(np.column_stack([x, 0.0 * x, z]), -2, axis=0)
    parts = np.linspace(0.0, 1.0, 2000, endpoint=False)[:, None]
    edges = zip(vertices, np.roll(vertices, -1, axis=0), strict=True)
    turn = np.concatenate([start + parts * (end - start) for start, end in edges])
    path = np.concatenate([np.tile(turn, (3, 1)), turn[:1]])
    forces = surface.trace(path)
    works = (0.5 * (forces[1:] + forces[:-1]) * np.diff(path, axis=0)).sum(axis=1)
    first, _second, third = works.reshape(3, -1).sum(axis=1)
    assert steady_work(surface, vertices) == pytest.approx(third, rel=1e-3)
    assert loop_work(surface, vertices) == pytest.approx(first, rel=1e-3)
    assert third > first + 1e-5
    leak = worst_loop(surface)
    assert leak.steady is not None
    assert leak.steady > max(leak.energy, third)
    stateless = Surface(STEEP, "A", K)
    assert steady_work(stateless, vertices) == loop_work(stateless, vertices)

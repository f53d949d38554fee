"""Friction of a surface beside the force of its law: definition, Jacobian, work and bad input."""

from __future__ import annotations

import pickle
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from bench.stress import friction as friction_stress

from asperity.analysis.energy.straight_scan import friction_scan
from asperity.core.errors import ParameterError
from asperity.frictional import accepts_friction
from asperity.laws import LAWS, Law
from asperity.rendering import bake
from asperity.surface import Surface
from asperity.textures import Fourier, Sinusoid

MU, A = 0.7, 0.6
GENERIC = Fourier([1.1e-4, 0.7e-4], [[5000.0, 1200.0], [-1900.0, 6100.0]], [0.3, 1.9])
WAVE = Sinusoid(1.5e-4, 1e-3, phase=0.4, direction=(1.0, 0.35))


def random_path(count: int, seed: int, depth: float) -> np.ndarray:
    """Return a closed path (count + 1, 3) [m] of three harmonics, in and out of contact."""
    rng = np.random.default_rng(seed)
    phase = 2.0 * np.pi * np.linspace(0.0, 1.0, count + 1)[:, None]
    path = np.tile(rng.uniform(-1e-3, 1e-3, 3), (count + 1, 1))
    path[:, 2] = -0.3 * depth
    size = np.array([4e-4, 4e-4, depth])
    for harmonic in (1.0, 2.0, 3.0):
        path += size / harmonic * rng.normal(0.0, 0.6, 3) * np.sin(harmonic * phase)
        path += size / harmonic * rng.normal(0.0, 0.6, 3) * (np.cos(harmonic * phase) - 1.0)
    return path


def potential(surface: Surface, points: np.ndarray) -> np.ndarray:
    """Return U [J] by the work from outside, by the midpoint rule along z."""
    top = surface.texture.extremes[1] + 2e-5
    share = (np.arange(4000) + 0.5) / 4000
    steps = (top - points[:, 2]) / 4000
    line = np.repeat(points[:, None], 4000, axis=1)
    line[..., 2] += share * (top - points[:, 2])[:, None]
    force = surface.without_friction().force(line.reshape(-1, 3))[:, 2].reshape(line.shape[:2])
    return np.asarray(force.sum(axis=1) * steps)


@pytest.mark.parametrize("law", "WCDH")
@pytest.mark.parametrize("modulation", [0.0, A])
def test_trace_equals_the_definition(law: str, modulation: float) -> None:
    surface = Surface(WAVE, law, friction=MU, friction_modulation=modulation)
    path = random_path(300, 5, surface.max_depth)
    plain = surface.without_friction()
    base = plain.force(path)
    normal = np.sqrt(2.0 * surface.stiffness * np.maximum(potential(surface, path), 0.0))
    height = path[:, 2] + base[:, 2] / surface.stiffness
    if law == "W":
        height = WAVE.height(path[:, :2])
    low, high = WAVE.extremes
    relative = (2.0 * height - low - high) / (high - low)
    limit = MU * normal * (1.0 - modulation * (1.0 + relative) / 2.0)
    kappa = surface.contact_friction.presliding_stiffness  # type: ignore[union-attr]  # it has
    assert kappa == surface.stiffness * (2.0 / 3.0 if law == "W" else 0.25)
    expected = base.copy()
    d = np.zeros(2)
    for i in range(len(path)):
        if i:
            d = d + path[i, :2] - path[i - 1, :2]
        length = np.hypot(*d)
        if length > limit[i] / kappa:
            d = d * (limit[i] / kappa / length)
        expected[i, :2] -= kappa * d
    error = np.abs(surface.trace(path) - expected).max()
    assert error < 2e-3 * np.abs(expected).max()  # the midpoint rule of the potential
    assert np.abs(expected - base).max() > 0.05 * np.abs(base).max()


@pytest.mark.parametrize("law", "WCDH")
def test_jacobian_equals_differences_of_the_force(law: str) -> None:
    surface = Surface(GENERIC if law == "C" else WAVE, law, friction=MU, friction_modulation=A)
    rng = np.random.default_rng(3)
    points = rng.uniform(-1e-3, 1e-3, (60, 3))
    points[:, 2] = -rng.uniform(1e-4, 2e-4, 60)
    angle = rng.uniform(0.0, 7.0, 60)
    direction = np.column_stack([np.cos(angle), np.sin(angle)])
    zero = np.zeros((60, 2))
    slip = surface.force(points, direction) - surface.force(points)
    kappa = surface.contact_friction.presliding_stiffness  # type: ignore[union-attr]  # it has
    at_limit = direction * (np.hypot(*slip[:, :2].T) / kappa)[:, None]
    step = 1e-8
    for deflection, sliding, margin in ((0.3 * at_limit, False, 0.0), (at_limit, True, 1e-7)):
        flags = np.full(60, sliding)
        exact = surface.jacobian(points, deflection, flags)
        start = deflection + margin * direction
        for axis in range(3):
            offset = np.zeros(3)
            offset[axis] = step
            ahead = surface.force(points + offset, start + offset[:2])
            behind = surface.force(points - offset, start - offset[:2])
            error = np.abs((ahead - behind) / (2.0 * step) - exact[:, :, axis]).max(axis=1)
            size = np.abs(exact).max(axis=(1, 2))
            assert np.quantile(error / size, 0.9) < 4e-3
    alone = surface.without_friction().jacobian(points)
    np.testing.assert_array_equal(surface.jacobian(points), alone)
    np.testing.assert_allclose(surface.jacobian(points, zero) - alone, -kappa * PLANE, atol=1e-9)


@pytest.mark.parametrize("law", "WCD")
@pytest.mark.parametrize("unit", [1e-3, 1e3])
def test_friction_is_the_same_in_other_units(law: str, unit: float) -> None:
    """Lengths of a kilometre: the anchor slips after hundreds of metres."""
    texture = Sinusoid(0.12 * unit, unit, phase=0.4, direction=(1.0, 0.3))
    surface = Surface(texture, law, 1.0, 0.15 * unit, friction=MU, friction_modulation=A)
    points = unit * np.array([[0.2, 0.1, -0.2], [-0.7, 0.4, -0.15], [0.45, -0.9, -0.25]])
    deflection = 9.0 * unit * np.array([[0.6, 0.8], [1.0, 0.0], [-0.8, 0.6]])
    one = Sinusoid(0.12, 1.0, phase=0.4, direction=(1.0, 0.3))
    metre = Surface(one, law, 1.0, 0.15, friction=MU, friction_modulation=A)
    flags = np.ones(3, bool)
    expected = metre.jacobian(points / unit, deflection / unit, flags)
    np.testing.assert_allclose(surface.jacobian(points, deflection, flags), expected, atol=1e-9)
    scan = friction_scan(surface)
    expected_scan = friction_scan(metre)
    assert scan is not None
    assert expected_scan is not None
    assert scan.remaining == pytest.approx(expected_scan.remaining, rel=1e-6)
    assert scan.mean / unit == pytest.approx(expected_scan.mean, rel=1e-6)


PLANE = np.tile(np.diag([1.0, 1.0, 0.0]), (60, 1, 1))


def trapezoidal_work(force: np.ndarray, path: np.ndarray) -> float:
    return float((0.5 * (force[1:] + force[:-1]) * np.diff(path, axis=0)).sum())


def three_turns(surface: Surface, path: np.ndarray) -> tuple[float, float]:
    """Return the work on three turns of a closed path, and what discretisation may add [J]."""
    turns = np.vstack([path, path[1:], path[1:]])
    step = np.diff(turns, axis=0)
    allowed = surface.stiffness * (step**2).sum() / 8.0 * 2.0
    return trapezoidal_work(surface.trace(turns), turns), float(allowed)


def pressed_detour(depth: float, length: float) -> np.ndarray:
    """Return a closed path along in light contact, down, back, and up."""
    corners = [[0, 0, -1e-6], [length, 0, -1e-6], [length, 0, -depth], [0, 0, -depth]]
    ends = np.array([*corners, corners[0]])
    share = np.linspace(0.0, 1.0, 400, endpoint=False)[:, None]
    sides = [ends[i] + share * (ends[i + 1] - ends[i]) for i in range(4)]
    return np.vstack([*sides, ends[:1]])


def test_no_closed_path_gains_where_the_papers_friction_does() -> None:
    """See bench.stress.friction for a million of them."""
    gains = dict.fromkeys("WCDHF", 0)
    paths = [pressed_detour(3e-4, 2e-4), *[random_path(400, seed, 3e-4) for seed in range(60)]]
    friction = {"friction": 0.8, "friction_modulation": 0.89}
    for law in gains:
        own = {"max_deflection": 2e-4} if law == "F" else friction
        surface = Surface(WAVE, law, max_depth=3e-4, **own)  # type: ignore[arg-type]  # by name
        for path in paths:
            work, allowed = three_turns(surface, path)
            gains[law] += work > allowed
    assert gains == {"W": 0, "C": 0, "D": 0, "H": 0, "F": 1}


def test_tick_inequality_in_exact_arithmetic() -> None:
    """V₊ - V <= -f Δp + (k Δz² + κ u²)/2 along x, with the numbers of the kernel."""
    surface = Surface(WAVE, "W", 1024.0, friction=1.0, friction_modulation=1.0).to_depth(3e-4)
    surface = surface._replace(
        _explicit_parameters={**surface._explicit_parameters, "presliding_stiffness": 512.0}
    )
    rng = np.random.default_rng(8)
    path = np.zeros((10_001, 3))
    path[:, 0] = np.cumsum(rng.normal(0.0, 2e-5, 10_001))
    path[:, 2] = 1e-4 - 4e-4 * rng.random(10_001)
    force = surface.trace(path)
    k, kappa = Fraction(1024), Fraction(512)
    worst = Fraction(-1)
    slips = 0
    for i in range(10_000):
        x, z, x1, z1 = map(Fraction, [*path[i, [0, 2]], *path[i + 1, [0, 2]]])
        fx, fz, fx1 = map(Fraction, [force[i, 0], force[i, 2], force[i + 1, 0]])
        d, d1 = -fx / kappa, -fx1 / kappa
        slips += abs(d + x1 - x - d1) > Fraction(1, 10**9)
        energy = k * (min(z1, 0) ** 2 - min(z, 0) ** 2) / 2 + kappa * (d1**2 - d**2) / 2
        held = -fx * (x1 - x) - fz * (z1 - z)
        worst = max(worst, energy - held - (k * (z1 - z) ** 2 + kappa * (x1 - x) ** 2) / 2)
    assert worst < Fraction(1, 10**18)  # rounding of forces of 0.3 N over steps of 0.1 mm
    assert slips > 3000


def test_baked_field_and_user_defined_law_have_friction() -> None:
    baked = bake(Surface(WAVE, "H", max_depth=2e-4, friction=0.4, friction_modulation=0.5))
    exact = Surface(WAVE, "H", max_depth=2e-4, friction=0.4, friction_modulation=0.5)
    path = random_path(200, 2, 2e-4)
    size = np.abs(exact.trace(path)).max()
    np.testing.assert_allclose(baked.trace(path), exact.trace(path), atol=0.1 * size)
    law = Law("S", "stiffening", "vertical", lambda c: c.k * c.depth**3 * 1e7 * c.w)
    surface = Surface(WAVE, law, friction=0.4)
    slip = surface.force([[2e-4, 1e-4, -2e-4]], [[1.0, 0.0]]) - surface.force([[2e-4, 1e-4, -2e-4]])
    depth = WAVE.height([[2e-4, 1e-4]])[0] + 2e-4
    assert slip[0, 0] == pytest.approx(-0.4 * 1000.0 * np.sqrt(2e7 * depth**4 / 4.0), rel=1e-9)
    field = Law("T", "cubic", "vertical", lambda c: c.k * c.depth * c.w * (1 + c.h), "")
    assert not accepts_friction(field)


def test_friction_is_carried_by_copies() -> None:
    surface = Surface(WAVE, "H", friction=0.4, presliding_stiffness=150.0, friction_modulation=0.3)
    for copy in (surface.to_stiffness(2000.0), pickle.loads(pickle.dumps(surface))):
        assert copy.contact_friction.arguments == (0.4, 0.3, 0.0, 150.0, 0.0)
    share = Surface(WAVE, "C", friction=0.4).to_stiffness(2000.0)
    assert share.contact_friction.presliding_stiffness == 500.0  # type: ignore[union-attr]  # it has
    assert surface.to_law("A").friction == 0.0
    assert surface.to_law("F").friction == 0.4
    assert surface.to_law("A").to_law("C").friction == 0.4
    assert surface.digest != surface.without_friction().digest == Surface(WAVE, "H").digest
    assert [x for x in LAWS if Surface(WAVE, x, friction=0.3).contact_friction] == list("WCDH")
    assert Surface(WAVE, "C", clamp="lateral", friction=0.3).contact_friction is None


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"friction": -0.1}, "friction must not be negative"),
        ({"friction": 0.4, "presliding_stiffness": 0.0}, "presliding_stiffness must be positive"),
        ({"friction": 0.4, "presliding_stiffness": -5.0}, "presliding_stiffness must be positive"),
        ({"friction": 0.4, "friction_modulation": 1.01}, "friction_modulation must be 0 to 1"),
        ({"law": "F", "presliding_stiffness": 100.0}, "law F .* has state of its own"),
        ({"friction": float("nan")}, "friction"),
    ],
)
def test_wrong_friction_is_refused(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        Surface(WAVE, **{"law": "H", **arguments})


def test_sample_of_the_stress_run() -> None:
    """Closed paths under a noisy limit, and closed loops at the rule and at twice the rule."""
    wall = Surface(WAVE, "W", 1000.0, 3e-4, friction=0.8, friction_modulation=0.8)
    works = friction_stress.walk(wall, 300)
    assert (works.above, works.gains) == (0, 0)
    assert friction_stress.walk(wall, 300, reach=2e-4).gains > 0
    for steps in ("exact", "rubbed", "bounded"):
        assert friction_stress.close_loops(9, 1.0, steps).beyond == 0
    assert friction_stress.close_loops(9, 2.0).gains > 0


@pytest.mark.parametrize(
    ("ratio", "amplitude", "difference"),
    [(2.0, 1.0, 1e-9), (1.0, 1.0, 0.01), (0.9, 0.995, 1.0), (0.5, 0.79, 1.0), (0.25, 0.48, 1.0)],
)
def test_sliding_friction_is_that_of_law_f_where_the_limit_is_gentle(
    ratio: float, amplitude: float, difference: float
) -> None:
    """κ over the greatest slope of the limit; law F at the default has μ 0.72 and a 0.889."""
    texture, depth = Sinusoid(1e-4, 1e-3), 2e-4
    x = np.linspace(0.0, 6e-3, 48_001)
    path = np.column_stack([x, 0.0 * x, np.full_like(x, -depth)])
    expected = Surface(texture, "F", 1000.0, depth, max_deflection=1e-6).trace(path)[24_000:, 0]
    modulation = 1.6 / 1.8
    slope = 0.72 * 1000.0 * depth * modulation / 2.0 * 2.0 * np.pi / 1e-3
    friction = {"friction": 0.72, "friction_modulation": modulation}
    mended = Surface(texture, "W", 1000.0, depth, presliding_stiffness=ratio * slope, **friction)  # type: ignore[arg-type]  # by name
    force = mended.trace(path)[24_000:, 0]
    assert force.std() / expected.std() == pytest.approx(amplitude, abs=0.01)
    assert np.abs(force - expected).max() <= difference * np.abs(expected).max()

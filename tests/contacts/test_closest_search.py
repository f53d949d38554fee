"""The certificates of the search: what an evaluation at its centre proves about a box.

They are tested on cubic polynomials, whose bounds K and T are known exactly: each certificate holds
on random boxes and is sharp on a constructed one.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from asperity.contacts import closest_search, distance_bounds
from asperity.contacts.sampler_interface import EXPAND, ROUNDING_SLACK
from asperity.core.compiled import EPS

Point = tuple[float, ...]
Cubic = np.ndarray  # coefficients of x^i y^j, i + j <= 3, shape (4, 4)
LEVEL = (0.0, 0.0, 0.0)  # a probe below the origin
UNLIMITED = (1.0 - ROUNDING_SLACK * EPS, 1e9)  # keep everything nearer, unlimited budget


Sampler = Callable[..., tuple[float, ...]]


@pytest.fixture
def link_sampler(monkeypatch: pytest.MonkeyPatch) -> Callable[[Sampler], None]:
    """Return a function that binds a sampler as the linker does."""

    def bind(sampler: Sampler) -> None:
        monkeypatch.setattr(distance_bounds, "sample_hessian", sampler)
        monkeypatch.setattr(closest_search, "sample_hessian", sampler)
        monkeypatch.setattr(distance_bounds, "evaluation_cost", closest_search.evaluation_cost)

    return bind


def evaluate_box(
    probe: Sequence[float], box: Sequence[float], k: float, t: float, best: Point, c: Cubic
) -> tuple[Point, bool, float]:
    """Decide a box (centre, half-widths) with bounds K and T: the best point, is it open, left.

    A half-width of 0 makes it a segment of a line.
    """
    x, y, z = map(float, probe)
    cx, cy, a, b = box
    frame = (0.0, 0.0, 1.0, 0.0, 1.0, 1.0 if b > 0.0 else 0.0)
    corners = (cx - a, cx + a, cy - b, cy + b) if b > 0.0 else (cx - a, cx + a, 0.0, 0.0)
    factor, left = UNLIMITED
    minimum = (best[0], best[1] if b > 0.0 else 0.0, 0.0, -np.inf, 0.0, 0.0, 0.0)
    ball, bounds = (x, y, z, best[2] * factor), (-np.inf, np.inf, k, t, k, EXPAND)
    result, _near, _last, is_open, left = closest_search.expand_and_prune(
        ball, frame, corners, bounds, best, minimum, minimum, left, c
    )
    return result, is_open, left


def derivative(c: Cubic, x: np.ndarray, y: np.ndarray, dx: int = 0, dy: int = 0) -> np.ndarray:
    """Return a derivative of the polynomial."""
    poly = np.polynomial.polynomial
    coefficients = poly.polyder(poly.polyder(c, dx, axis=0), dy, axis=1)
    return np.asarray(poly.polyval2d(x, y, coefficients))


def curvature(x: float, y: float, c: Cubic) -> tuple[float, ...]:
    """Return height and derivatives like a sampler."""
    orders = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]
    at = np.array(x), np.array(y)
    return tuple(float(derivative(c, *at, *order)) for order in orders)


def cubic(rng: np.random.Generator, scale: float) -> Cubic:
    """Return a random polynomial whose tangent plane has a height of about 1."""
    c = rng.normal(size=(4, 4)) * scale
    c[0, 0], c[1, 0], c[0, 1] = rng.normal(size=3)
    c[np.add.outer(range(4), range(4)) > 3] = 0.0
    return c


def stationary_probe(c: Cubic, x: float, y: float, depth: float) -> np.ndarray:
    """Return a probe whose distance is stationary at the surface point over x, y."""
    h, hx, hy, *_second = curvature(x, y, c)
    down = np.array([hx, hy, -1.0]) / np.sqrt(1.0 + hx**2 + hy**2)
    return np.array([x, y, h]) + depth * down


def bounds(c: Cubic, a: float, b: float) -> tuple[float, float]:
    """Return K and T on the box |x| <= a, |y| <= b: convex, so attained at its corners."""
    corners = np.array(list(itertools.product((-a, a), (-b, b))))
    xx, xy, yy = (derivative(c, *corners.T, *order) for order in ((2, 0), (1, 1), (0, 2)))
    matrices = np.stack([xx, xy, xy, yy], axis=-1).reshape(-1, 2, 2)
    t = np.array([derivative(c, *np.zeros((2, 1)), 3 - n, n)[0] for n in range(4)])
    third_bound = np.sqrt((t**2) @ [1.0, 3.0, 3.0, 1.0])
    return float(np.linalg.norm(matrices, 2, axis=(1, 2)).max()), float(third_bound)


def expansion(c: Cubic, probe: np.ndarray, xy: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return φ, ∇φ/2 and Q at points (n, 2)."""
    h, hx, hy, hxx, hxy, hyy = (
        derivative(c, *xy.T, *order) for order in ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    )
    gap, offset = h - probe[2], xy - probe[:2]
    slope = np.stack([hx, hy], axis=-1)
    hessian = np.stack([hxx, hxy, hxy, hyy], axis=-1).reshape(-1, 2, 2)
    q = np.eye(2) + slope[:, :, None] * slope[:, None, :] + gap[:, None, None] * hessian
    return (offset**2).sum(axis=1) + gap**2, offset + gap[:, None] * slope, q


def box_points(a: float, b: float, count: int) -> np.ndarray:
    x, y = np.linspace(-a, a, count), np.linspace(-b, b, count)
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def remainders(c: Cubic, probe: np.ndarray, a: float, b: float) -> tuple[float, float]:
    h, hx, hy, hxx, hxy, hyy = curvature(0.0, 0.0, c)
    hessian_norm = float(np.sqrt(hxx**2 + 2.0 * hxy**2 + hyy**2))
    return distance_bounds.taylor_remainders(
        float(np.hypot(a, b)), h - probe[2], float(np.hypot(hx, hy)), hessian_norm, *bounds(c, a, b)
    )


# --- remainders of Taylor's formula ---------------------------------------------------------------


@pytest.mark.parametrize("scale", [0.1, 1.0, 10.0])
def test_taylor_remainders_bound_all_changes(scale: float):
    rng = np.random.default_rng(41)
    for _ in range(150):
        c, probe = cubic(rng, scale), np.append(rng.normal(size=2), -rng.exponential(2.0))
        a, b = rng.uniform(0.01, 0.8, 2)
        change, lift = remainders(c, probe, a, b)
        xy = box_points(a, b, 15)
        _phi, _slope, q = expansion(c, probe, xy)
        centre = expansion(c, probe, np.zeros((1, 2)))[2]
        assert np.linalg.norm(q - centre, 2, axis=(1, 2)).max() <= change * (1 + 1e-12)
        plane = c[0, 0] + xy @ [c[1, 0], c[0, 1]]
        assert np.abs(derivative(c, *xy.T) - plane).max() <= lift * (1 + 1e-12)


@pytest.mark.parametrize(
    ("slope", "hessian", "third"),
    [(1.0, 1.0, 0.0), (0.0, 0.0, 1.0), (2.0, 0.5, 3.0), (0.0, 1.0, 1.0)],
)
def test_taylor_remainders_are_sharp(slope: float, hessian: float, third: float):
    """Along x in a small box: the change is 3 h_x h_xx + (h - z) h_xxx, the lift h_xx r²/2."""
    c = np.zeros((4, 4))
    c[:, 0] = [0.5, slope, hessian / 2.0, third / 6.0]
    probe, r = np.array([0.3, 0.0, -1.5]), 1e-5
    change, lift = remainders(c, probe, r, 0.0)
    end = np.array([[r, 0.0]])
    q = expansion(c, probe, np.array([[0.0, 0.0], end[0]]))[2]
    assert change * (1 - 1e-3) <= q[1, 0, 0] - q[0, 0, 0] <= change
    raised = derivative(c, *end.T)[0] - 0.5 - slope * r
    assert lift * (1 - 1e-3) <= raised + 1e-16 <= lift + 2e-16


def test_lift_includes_the_third_derivative():
    c = np.zeros((4, 4))
    c[3, 0] = 1.0 / 6.0
    _change, lift = remainders(c, np.array([0.0, 0.0, -1.0]), 1e-2, 0.0)
    assert lift == pytest.approx(1e-6 / 6.0, rel=1e-12)


# --- pruning a box --------------------------------------------------------------------------------


def is_pruned(c: Cubic, probe: np.ndarray, a: float, b: float, enough: float) -> bool:
    h, hx, hy, _hxx, _hxy, _hyy = curvature(0.0, 0.0, c)
    _phi, _slope, q = expansion(c, probe, np.zeros((1, 2)))
    entries = (float(q[0, 0, 0]), float(q[0, 0, 1]), float(q[0, 1, 1]))
    low, _high = distance_bounds.symmetric_eigenvalues(*entries)
    offset = (-probe[0], -probe[1], h - probe[2])
    change, lift = remainders(c, probe, a, b)
    return distance_bounds.can_prune(offset, hx, hy, entries, low, change, lift, a, b, enough)


def distance_lower_bound(c: Cubic, probe: np.ndarray, a: float, b: float) -> float:
    """Return the least φ at which a box is not pruned, by bisection: its lower bound."""
    low, high = 0.0, 2.0 * float(expansion(c, probe, np.zeros((1, 2)))[0][0])
    for _ in range(30):
        middle = 0.5 * (low + high)
        if is_pruned(c, probe, a, b, middle):
            low = middle
        else:
            high = middle
    return low


@pytest.mark.parametrize("scale", [0.1, 1.0, 3.0])
def test_pruned_box_contains_no_minimum(scale: float):
    rng = np.random.default_rng(42)
    pruned_count = 0
    for _ in range(120):
        c, (a, b) = cubic(rng, scale), rng.uniform(0.02, 0.3, 2) / max(scale, 1.0)
        # The stationary point lies in the box or near it.
        wide = rng.choice([1.0, 4.0]) * rng.uniform(-1.0, 1.0, 2)
        probe = stationary_probe(c, *(np.array([a, b]) * wide), rng.exponential())
        xy = box_points(a, b, 21)
        phi, slope, q = expansion(c, probe, xy)
        if not is_pruned(c, probe, a, b, np.inf):
            # Pruned by distance: then φ is greater everywhere in the box.
            assert phi.min() >= distance_lower_bound(c, probe, a, b) * (1 - 1e-6)
            continue
        pruned_count += 1
        # Where φ is nearly level and convex, the Newton step leaves the box.
        step = np.linalg.solve(q, slope[:, :, None])[:, :, 0]
        convex = np.linalg.eigvalsh(q)[:, 0] > 0.0
        assert not (convex & (np.abs(step) < 0.01 * np.array([a, b])).all(axis=1)).any()
    assert 12 < pruned_count < 108


def test_taylor_bound_is_sharp():
    """Q is slightly negative at the centre, and L r compensates: φ decreases by both along x."""
    c = np.zeros((4, 4))
    c[:, 0] = [0.0, 0.0, -1.05 / 2.0, -1.5 / 6.0]
    probe, r = np.array([0.0, 0.0, -1.0]), 0.05
    exact = expansion(c, probe, box_points(r, 0.0, 201))[0].min()
    bound = distance_lower_bound(c, probe, r, 0.0)
    assert 1.25 * (exact - 1.0) <= bound - 1.0 <= exact - 1.0 < 0.0


def test_tangent_plane_bound_is_sharp():
    """The surface curves down towards the probe, which is below the edge of the box."""
    c = np.zeros((4, 4))
    c[:, 0] = [0.0, 0.0, -1.0 / 2.0, 4.0 / 6.0]
    r = 0.2
    probe = np.array([-r, 0.0, -3.0])
    exact = expansion(c, probe, box_points(r, 0.0, 201))[0].min()
    assert exact == pytest.approx((3.0 - 0.5 * r**2 - 4.0 * r**3 / 6.0) ** 2, rel=1e-9)
    assert exact * (1 - 1e-6) <= distance_lower_bound(c, probe, r, 0.0) <= exact * (1 + 1e-8)


@pytest.mark.parametrize(("share", "pruned"), [(0.99, False), (1.04, True)])
def test_box_is_pruned_iff_it_has_no_level_point(share: float, pruned: bool):
    """The slope changes by at most q r + L r²/2 within the box."""
    gap, third, r = 1.0, 0.4, 0.3
    c = np.zeros((4, 4))
    c[3, 0] = -third / 6.0
    # Q = 1 and L = T (h - z), approximately; the probe's x sets the slope at the centre.
    probe = np.array([-share * (r + 0.5 * third * gap * r * r), 0.0, -gap])
    slopes = expansion(c, probe, box_points(r, 0.0, 401))[1][:, 0]
    assert (slopes.min() < 0.0) != pruned
    assert is_pruned(c, probe, r, 0.0, np.inf) == pruned


# --- evaluating a box -----------------------------------------------------------------------------


def test_closed_box_contains_no_better_minimum(link_sampler: Callable[[Sampler], None]):
    """Random boxes of surfaces in two dimensions; minima by a dense grid."""
    link_sampler(curvature)
    rng = np.random.default_rng(43)
    closed = with_minima = 0
    for _ in range(600):
        c, (a, b) = cubic(rng, 0.6), rng.uniform(0.02, 0.2, 2)
        position = rng.choice([1.0, 4.0]) * rng.uniform(-1.0, 1.0, 2)
        probe = stationary_probe(c, *(np.array([a, b]) * position), rng.exponential())
        best = (9.0, 9.0, 1e9, 0.0, 0.0, 0.0)
        result, is_open, _left = evaluate_box(probe, (0.0, 0.0, a, b), *bounds(c, a, b), best, c)
        if is_open:
            continue
        closed += 1
        xy = box_points(a, b, 41)
        phi, slope, q = expansion(c, probe, xy)
        step = -np.linalg.solve(q, slope[:, :, None])[:, :, 0]
        # From here Newton's method leads to a minimum well inside the box.
        inside = (np.abs(xy + step) < 0.95 * np.array([a, b])).all(axis=1)
        level = (np.linalg.eigvalsh(q)[:, 0] > 0.0) & inside & (np.abs(step) < 0.03 * a).all(axis=1)
        if level.any():
            with_minima += 1
            assert result[2] <= phi[level].min() * (1 + 1e-12)
    assert closed > 80
    assert with_minima > 20


def profile_as_map(x: float, _y: float, c: np.ndarray) -> tuple[float, ...]:
    h, h1, h2 = (float(np.polynomial.Polynomial(c).deriv(n)(x)) for n in range(3))
    return h, h1, 0.0, h2, 0.0, 0.0


@pytest.mark.parametrize("across", [1e-3, 0.0])
def test_closed_interval_contains_no_better_minimum(
    across: float, link_sampler: Callable[[Sampler], None]
):
    """In one dimension all minima are roots of a quintic; an interval may contain several."""
    link_sampler(profile_as_map)
    rng = np.random.default_rng(44)
    closed = with_minima = 0
    for _ in range(6000):
        c = rng.normal(size=4) * [1.0, 1.0, 0.8, 0.6]
        x, z, r = 0.3 * rng.normal(), -rng.exponential(1.0), rng.uniform(0.02, 0.5)
        ends = abs(2 * c[2] + 6 * c[3] * r), abs(2 * c[2] - 6 * c[3] * r)
        start, box = (9.0, 9.0, 1e9, 0.0, 0.0, 0.0), (0.0, 0.0, r, across)
        probe = (x, 0.0, z)
        result, is_open, _left = evaluate_box(probe, box, max(ends), 6 * abs(c[3]), start, c)
        if is_open:
            continue
        closed += 1
        h = np.polynomial.Polynomial(c)
        phi = np.polynomial.Polynomial([-x, 1.0]) ** 2 + (h - z) ** 2
        roots = phi.deriv().roots()
        real = roots[np.abs(roots.imag) < 1e-9].real
        minima = real[(np.abs(real) < 0.999 * r) & (phi.deriv(2)(real) > 1e-6)]
        if len(minima):
            with_minima += 1
            assert result[2] <= phi(minima).min() * (1 + 1e-9)
    assert closed > 2000
    assert with_minima > 200


def test_box_stays_open_when_the_descent_leaves_it(
    monkeypatch: pytest.MonkeyPatch, link_sampler: Callable[[Sampler], None]
):
    """Newton's method was expected to end in the box and did not, so the box is divided."""
    link_sampler(profile_as_map)
    flat, end = np.zeros(4), (0.0, 0.0)
    monkeypatch.setattr(
        closest_search, "descend_within_budget", lambda *_: ((*end, 0.5, 0.0, 0.0, 0.0), 1.0)
    )
    start = (9.0, 9.0, 1e9, 0.0, 0.0, 0.0)
    for x, y in ((0.3, 0.0), (0.101, 0.0), (-0.101, 0.0), (0.0, 0.101), (0.0, -0.101), (0.1, 0.1)):
        end = x, y
        probe = (0.05, 0.0, -1.0)
        best, is_open, _left = evaluate_box(probe, (0.0, 0.0, 0.1, 0.1), 0.0, 0.0, start, flat)
        assert (best[:2], is_open) == (end, max(abs(x), abs(y)) > 0.1)
        best, is_open, _left = evaluate_box(probe, (0.0, 0.0, 0.1, 0.0), 0.0, 0.0, start, flat)
        assert (best[0], is_open) == (x, abs(x) > 0.1)


def test_descent_starts_at_the_best_point_or_a_newton_step(
    monkeypatch: pytest.MonkeyPatch, link_sampler: Callable[[Sampler], None]
):
    """At the best point if it lies in the box; above a plane Newton's step ends over the probe."""
    link_sampler(profile_as_map)
    starts: list[tuple[float, ...]] = []

    def record_start(*arguments: float) -> tuple[tuple[float, ...], float]:
        starts.append(arguments[3:5])
        return (*starts[-1], *[0.0] * 4), 1.0

    monkeypatch.setattr(closest_search, "descend_within_budget", record_start)
    flat, newton_point = np.zeros(4), (0.52, 0.31)
    for x, y in itertools.product((0.45, -0.45, 0.61), (0.35, -0.35, 0.41)):
        is_inside = (x, y) == (0.45, 0.35)
        best = (x, y, 1e9, 0.0, 0.0, 0.0)
        probe = (*newton_point, -1.0)
        evaluate_box(probe, (0.5, 0.3, 0.1, 0.1), 0.0, 0.0, best, flat)
        assert starts.pop() == pytest.approx((x, y) if is_inside else newton_point, abs=1e-15)
        evaluate_box((0.52, 0.0, -1.0), (0.5, 0.0, 0.1, 0.0), 0.0, 0.0, best, flat)
        assert starts.pop()[0] == pytest.approx(0.45 if x == 0.45 else 0.52, abs=1e-15)


def test_every_evaluation_of_an_undecided_box_is_charged(
    monkeypatch: pytest.MonkeyPatch, link_sampler: Callable[[Sampler], None]
):
    """Once, at the centre, at the cost of the kind."""
    link_sampler(curvature)
    monkeypatch.setattr(closest_search, "evaluation_cost", lambda _texture: 7.0)
    best, wide_bounds = (0.5, 0.0, 1e9, 0.0, 0.0, 0.0), (1e3, 1e3)
    box = (0.0, 0.0, 0.1, 0.1)
    _best, is_open, left = evaluate_box(LEVEL, box, *wide_bounds, best, np.zeros((4, 4)))
    assert is_open
    assert UNLIMITED[1] - left == 7.0


def test_level_point_on_the_border_is_not_pruned_by_rounding(
    link_sampler: Callable[[Sampler], None],
):
    """On planes of any slope: the slack for rounding grows with Q."""
    link_sampler(curvature)
    rng = np.random.default_rng(46)
    for slope in np.geomspace(1.0, 1e5, 100):
        c, (a, b) = np.zeros((4, 4)), rng.uniform(0.01, 0.3, 2)
        c[1, 0] = slope
        probe = stationary_probe(c, a, b, rng.exponential())
        assert not is_pruned(c, probe, a, b, np.inf)
        start = (9.0, 9.0, 1e99, 0.0, 0.0, 0.0)
        on_line = (probe[0], 0.0, probe[2])
        best, *_rest = evaluate_box(on_line, (0.0, 0.0, a, 0.0), 0.0, 0.0, start, c)
        assert best[0] == pytest.approx(a, rel=1e-9)


def test_interval_is_pruned_iff_it_has_no_level_point(link_sampler: Callable[[Sampler], None]):
    """The slope at the centre is just below and just above the greatest change in the interval."""
    link_sampler(profile_as_map)
    gap, third, r = 1.0, 0.4, 0.3
    c = np.array([0.0, 0.0, 0.0, -third / 6.0])
    limit = r + 0.5 * third * gap * r * r
    for share, pruned in ((0.99, False), (1.04, True)):
        start = (9.0, 9.0, 1e9, 0.0, 0.0, 0.0)
        probe = (-share * limit, 0.0, -gap)
        best, is_open, _left = evaluate_box(probe, (0.0, 0.0, r, 0.0), third * r, third, start, c)
        assert (best == start and not is_open) == pruned


def test_descent_ends_at_a_local_minimum(link_sampler: Callable[[Sampler], None]):
    """Far away the Newton steps are too long and are halved until φ decreases."""
    rng = np.random.default_rng(47)
    for _ in range(100):
        link_sampler(curvature)
        c, start = cubic(rng, 1.0), 3.0 * rng.normal(size=2)
        probe = np.append(rng.normal(size=2), -rng.exponential(2.0))
        x, y, phi, *_surface = distance_bounds.descend(*probe, *start, c)
        _phi, slope, q = expansion(c, probe, np.array([[x, y]]))
        assert np.hypot(*slope[0]) <= 1e-6 * np.linalg.norm(q[0], 2)
        assert np.linalg.eigvalsh(q[0])[0] > 0.0
        assert phi <= expansion(c, probe, start[None])[0][0]
        link_sampler(profile_as_map)
        h = np.polynomial.Polynomial(c[:, 0])
        squared_distance = np.polynomial.Polynomial([-probe[0], 1.0]) ** 2 + (h - probe[2]) ** 2
        x, y, phi, *_profile = distance_bounds.descend(*probe, start[0], probe[1], c[:, 0])
        assert y == probe[1]
        assert abs(squared_distance.deriv()(x)) <= 1e-6 * squared_distance.deriv(2)(x)
        assert phi <= squared_distance(start[0])


def test_descent_respects_its_budget(link_sampler: Callable[[Sampler], None]):
    """A truncated descent returns the lowest point evaluated."""
    link_sampler(curvature)
    c, probe = cubic(np.random.default_rng(48), 1.0), (0.3, -0.2, -1.0)
    last = np.inf
    for budget in range(1, 40):
        best, left = distance_bounds.descend_within_budget(*probe, 3.0, -2.0, float(budget), c)
        assert left >= 0.0
        assert best[2] <= last
        last = best[2]
    assert left > 0.0
    assert best == distance_bounds.descend(*probe, 3.0, -2.0, c)


def test_division_visits_every_box_once():
    """Three levels deep, from every side: 64 boxes, the nearest first."""
    for u, v in itertools.product((0.1, 3.3, 7.9), repeat=2):
        visited, stack = [], np.empty((256, 5))
        minimum, frame = (u, v, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0, 1.0, 1.0)
        count = closest_search.push_box((0.0, 8.0, 0.0, 8.0), 0.0, stack, 0)
        while count > 0:
            count -= 1
            box = tuple(stack[count, :4].tolist())
            if box[1] - box[0] == 1.0:
                visited.append((int(box[2]), int(box[0])))
            else:
                count = closest_search.split_box(frame, minimum, box, stack, count, None)
        assert sorted(visited) == [(i, j) for i in range(8) for j in range(8)]
        assert visited[0] == (int(v), int(u))


def test_supporting_bound_holds_on_random_boxes_and_is_sharp_on_a_plane():
    """φ is nowhere below it; on a plane, however steep, it is the squared distance."""
    rng = np.random.default_rng(11)
    for _ in range(200):
        c = cubic(rng, rng.choice([0.1, 1.0, 10.0]))
        c[1, 0] *= rng.choice([1.0, 30.0])
        probe, (a, b) = rng.normal(size=3), rng.uniform(0.05, 0.5, 2)
        h, *_rest = derivatives = curvature(0.0, 0.0, c)
        offset = (-probe[0], -probe[1], h - probe[2])
        _k, t = bounds(c, a, b)
        bound = distance_bounds.supporting_bound(offset, derivatives, t, a, b)
        phi, _p, _q = expansion(c, probe, box_points(a, b, 41))
        assert bound <= phi.min() * (1.0 + 1e-12)
    plane = (0.0, 40.0, -9.0, 0.0, 0.0, 0.0)
    normal = np.array([-40.0, 9.0, 1.0]) / np.sqrt(1682.0)
    offset = tuple(0.3 * normal + 0.2 * np.array([1.0, 0.0, 40.0]) / np.sqrt(1601.0))
    bound = distance_bounds.supporting_bound(offset, plane, 0.0, 0.1, 0.1)
    assert bound == pytest.approx(0.09, rel=1e-10)


def test_minimum_excludes_a_box_where_its_supporting_function_is_convex(
    link_sampler: Callable[[Sampler], None],
):
    """Wherever it says so, no sampled point of the box is closer; it does for many minima."""
    link_sampler(curvature)
    rng = np.random.default_rng(12)
    frame, answers = (0.0, 0.0, 1.0, 0.0, 1.0, 1.0), []
    for _ in range(300):
        c = cubic(rng, rng.choice([0.1, 0.3]))
        probe = stationary_probe(c, 0.0, 0.0, rng.uniform(0.1, 2.0))
        h, hx, hy, *_rest = curvature(0.0, 0.0, c)
        best = (0.0, 0.0, float(probe @ probe - 2 * h * probe[2] + h * h), h, hx, hy)
        minimum = closest_search.minimum_at(tuple(probe), frame, best, c)
        side = rng.uniform(0.1, 1.0) / np.sqrt(2.0)
        box, (k, t) = (-side, side, -side, side), bounds(c, side, side)
        ball = (*probe, best[2])
        answer = closest_search.excludes_box(
            ball, frame, minimum, box, (-9.0, 9.0, k, t, k, EXPAND), c
        )
        phi, _p, _q = expansion(c, probe, box_points(side, side, 41))
        assert not answer or phi.min() >= best[2] * (1.0 - 1e-12)
        answers.append((answer, bool(phi.min() >= best[2] * (1.0 - 1e-12))))
        # The point must be in the box, and a minimum.
        outside = (2.0 * side, *minimum[1:])
        assert not closest_search.excludes_box(
            ball, frame, outside, box, (-9.0, 9.0, 0.0, 0.0, 0.0, EXPAND), c
        )
    certified, true = np.array(answers).T
    assert certified.sum() > 0.3 * true.sum()
    assert not true.all()
    beside = (0.0, 0.0, 1.01, 0.0, 0.0, 0.0)
    moved = closest_search.minimum_at((0.1, 0.0, -1.0), frame, beside, 0 * c)
    flat = (-9.0, 9.0, 0.0, 0.0, 0.0, EXPAND)
    assert not closest_search.excludes_box((0.1, 0.0, -1.0, 1.01), frame, moved, box, flat, 0 * c)


def test_axis_without_a_number_between_its_ends_is_not_halved() -> None:
    stack = np.empty((256, 5))
    end = 1.0 + EPS
    frame = (0.0, 0.0, 1.0, 0.0, 1.0, 1.0)
    minimum = (0.0,) * 7
    box = (1.0, end, 0.0, EPS)
    assert closest_search.split_box(frame, minimum, box, stack, 0, None) == 2
    assert sorted(map(tuple, stack[:2, :4])) == [
        (1.0, end, 0.0, 0.5 * EPS),
        (1.0, end, 0.5 * EPS, EPS),
    ]
    assert closest_search.split_box(frame, minimum, (1.0, end, 1.0, end), stack, 7, None) == 7


def test_full_stack_truncates_the_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """Boxes that are all open, and divided near one corner, fill any stack."""

    def examine_box(*arguments: Any) -> tuple[Any, ...]:
        _probe, _factor, _frame, _box, best, near, last, left, _texture = arguments
        return best, near, last, True, left

    monkeypatch.setattr(closest_search, "minimum_at", lambda *_: (-9.0,) * 7)
    monkeypatch.setattr(closest_search, "examine_box", examine_box)
    monkeypatch.setattr(closest_search, "box_middle", lambda low, high, *_: 0.1 * low + 0.9 * high)
    best = (0.0, 0.0, 1.0, 1.0, 0.0, 0.0)
    assert closest_search.search_boxes(0.0, 0.0, 0.0, best, 1.0, np.inf, None) == (best, 0.0)

"""Defaults of a contact, its geometry, and the descents and searches of the closest point."""

from __future__ import annotations

from itertools import pairwise

import mpmath
import numpy as np
import pytest
from tests.helpers.exact_heights import exact_height

from asperity.contacts import Contact
from asperity.contacts.closest import closest_warm as again
from asperity.contacts.closest import line_search, plane_search
from asperity.contacts.closest import plane_budget as plane_within
from asperity.contacts.warm_start import (
    BUDGET,
    ERROR_BOUND,
    EVALUATIONS,
    FIRST_POINT,
    MAX_ERROR_BOUND,
    TRUNCATED_TICKS,
    WARM_START_SIZE,
)
from asperity.contacts.warm_start import POINT_COUNT as KNOWN
from asperity.core.checks import FloatArray
from asperity.laws import LAWS
from asperity.textures import Fourier

WAVES = Fourier([0.1e-3, 0.07e-3], [[3000.0, 1000.0], [-1500.0, 2500.0]], [0.3, 1.2])
POINTS = np.random.default_rng(3).uniform(-4e-4, 4e-4, (200, 3))


def test_default_properties_of_a_contact() -> None:
    assert not Contact.single_valued
    assert not Contact.is_above_probe
    assert not Contact.clampable
    assert not Contact.supports_state
    assert Contact.begins_on_texture
    assert Contact.is_determined_by_depth
    assert (Contact.relative_cost, Contact.parameters) == (1000.0, ())


@pytest.mark.parametrize("letter", ["A", "D", "H", "W"])
def test_contact_is_below_the_contact_height(letter: str) -> None:
    """Strictly below it, not on it."""
    contact = LAWS[letter].contact
    contact_height = contact.contact_height(WAVES, POINTS[:, :2])
    inside = contact.is_in_contact(WAVES, POINTS)
    np.testing.assert_array_equal(inside, POINTS[:, 2] < contact_height)
    assert 20 < inside.sum() < 180
    on_surface = np.column_stack([POINTS[:20, :2], contact_height[:20]])
    if letter == "W":
        assert not contact.is_in_contact(WAVES, on_surface).any()


@pytest.mark.parametrize("letter", ["A", "D", "H", "W"])
def test_depth_grows_along_the_inward_direction(letter: str) -> None:
    """Straight down or against the normal, by the distance from the surface."""
    from asperity.contacts.symbols import HX, HY

    contact = LAWS[letter].contact
    xy = POINTS[:20, :2]
    derivatives = WAVES.derivatives(xy)
    is_vertical = letter in "AW"
    for row in derivatives:
        inward = contact.inward_direction().subs({HX: row[1], HY: row[2]})
        down = np.array([0.0, 0.0, -1.0] if is_vertical else [row[1], row[2], -1.0])
        expected = down / np.linalg.norm(down)
        np.testing.assert_allclose(np.array(inward, float).ravel(), expected, rtol=1e-14)
    if contact.is_determined_by_depth:
        probes = contact.probe_positions(xy, np.full(20, 3e-6), derivatives)
        np.testing.assert_allclose(contact.depth(WAVES, probes), 3e-6, rtol=1e-6)
        above = contact.probe_positions(xy, np.full(20, -3e-6), derivatives)
        np.testing.assert_allclose(contact.depth(WAVES, above), -3e-6, rtol=1e-6)


def test_coordinate_scale_and_lateral_reach_of_contacts() -> None:
    """The size of the numbers that the depth is a difference of, and where the point may lie."""
    xy = np.array([0.3, -4.0])
    for letter, size, reach in (
        ("A", 0.7, 0.0),
        ("W", 0.0, 0.0),
        ("D", 4.7, 2e-3),
        ("H", 4.7, 2e-3),
    ):
        contact = LAWS[letter].contact
        assert contact.coordinate_scale(xy, -0.7) == pytest.approx(size, rel=1e-15)
        assert contact.lateral_reach(2e-3) == reach
        assert contact.requires_search == (letter in "DH")
    slopes = np.array([[0.5, 0.3, -0.4], [0.1, 0.0, 0.0]])
    for letter, depths in (("A", [0.7, 0.3]), ("W", [0.2, 0.2]), ("D", [0.7 * 1.25**0.5, 0.3])):
        result = LAWS[letter].contact.depth_at_height(-0.2, slopes)
        np.testing.assert_allclose(result, depths, rtol=1e-14)


def test_depth_code_uses_half_the_budget_of_a_tick() -> None:
    """It searches the closest point from below the probe; a tick has 1500 evaluations."""
    assert LAWS["D"].contact.max_evaluations == 1500.0
    code = LAWS["D"].contact.depth_code()
    assert code[-2].endswith("= closest_point_within_budget(x, y, z, x, y, 750.0, texture)")
    assert code[:2] == ["if not sample_height(x, y, texture) - z > 0.0:", "    return 0.0"]
    assert LAWS["A"].contact.depth_code()[-1] == "return depth"


def test_exact_closest_point_satisfies_its_equations() -> None:
    """∇φ = 0 holds to far more digits than those of the compiled search, where it starts."""
    with mpmath.workdps(60):
        h, contact = exact_height(WAVES), LAWS["D"].contact
        for point in POINTS[:8]:
            p = [mpmath.mpf(float(value)) for value in point]
            result = contact.exact_contact(WAVES, h, p)
            assert result is not None
            depth, x, y = result
            gap = h(x, y, 0, 0) - p[2]
            assert abs(x - p[0] + gap * h(x, y, 1, 0)) < 1e-50 * abs(depth)
            assert abs(y - p[1] + gap * h(x, y, 0, 1)) < 1e-50 * abs(depth)
            assert abs(depth**2 - (x - p[0]) ** 2 - (y - p[1]) ** 2 - gap**2) < 1e-60


# --- descents -------------------------------------------------------------------------------------


def polynomial_derivatives(x: float, coefficients: tuple[float, ...]) -> tuple[float, float, float]:
    """Return h, h', h'' of a polynomial."""
    p = np.polynomial.Polynomial(coefficients)
    return float(p(x)), float(p.deriv()(x)), float(p.deriv(2)(x))


class RecordedPolynomial:
    """A polynomial along a line, its sum along x and y in the plane, and the evaluated points."""

    def __init__(self, *coefficients: float) -> None:
        self.coefficients = coefficients
        self.line: list[float] = []
        self.plane: list[FloatArray] = []

    def along(self, x: float, _texture: object) -> tuple[float, float, float]:
        self.line.append(x)
        return polynomial_derivatives(x, self.coefficients)

    def curvature(self, x: float, y: float, _texture: object) -> tuple[float, ...]:
        self.plane.append(np.array([x, y]))
        (h, hx, hxx), (g, gy, gyy) = (
            polynomial_derivatives(x, self.coefficients),
            polynomial_derivatives(y, self.coefficients),
        )
        return h + g, hx, gy, hxx, 0.0, gyy

    def descend(
        self, probe: tuple[float, float, float], start: float, monkeypatch: pytest.MonkeyPatch
    ) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Descend along a line and in the plane; return both end points."""
        monkeypatch.setattr(line_search, "sample_profile", self.along)
        monkeypatch.setattr(plane_search, "sample_hessian", self.curvature)
        x, y, z = probe
        on_line = line_search.descend(x, z, start, None)
        return on_line, plane_search.descend(x, y, z, start, 0.7 * start, None)


def test_descent_takes_few_evaluations(monkeypatch: pytest.MonkeyPatch) -> None:
    """Newton's method doubles the digits per step and ends when they no longer improve."""
    rng, line_count, plane_count = np.random.default_rng(8), 0, 0
    for _ in range(40):
        polynomial = RecordedPolynomial(*rng.normal(size=4) * [1.0, 0.5, 0.2, 0.05])
        x, y = rng.normal(size=2)
        z = 2.0 * polynomial_derivatives(x, polynomial.coefficients)[0] - rng.uniform(0.1, 0.5)
        on_line, in_plane = polynomial.descend((x, y, z), x + 0.2, monkeypatch)
        line_count, plane_count = (
            line_count + len(polynomial.line),
            plane_count + len(polynomial.plane),
        )
        h, h1, _h2 = polynomial_derivatives(on_line[0], polynomial.coefficients)
        assert abs(on_line[0] - x + (h - z) * h1) < 1e-13 * (1.0 + abs(h - z) * (1.0 + abs(h1)))
        assert on_line[2:] == pytest.approx((h, h1), rel=1e-13, abs=1e-14)
        px, py = in_plane[:2]
        (hx, gx, _), (hy, gy, _) = (
            polynomial_derivatives(coordinate, polynomial.coefficients) for coordinate in (px, py)
        )
        gap = hx + hy - z
        assert abs(px - x + gap * gx) < 1e-12 * (1.0 + abs(gap) * (1.0 + abs(gx)))
        assert abs(py - y + gap * gy) < 1e-12 * (1.0 + abs(gap) * (1.0 + abs(gy)))
        assert in_plane[3:] == pytest.approx((hx + hy, gx, gy), rel=1e-12, abs=1e-13)
    assert line_count <= 4.5 * 40
    assert plane_count <= 5 * 40


def test_descent_ends_when_rounding_dominates(monkeypatch: pytest.MonkeyPatch) -> None:
    """Near a centre of curvature the steps stop shrinking; it must not use all 200 of them."""
    for factor in (1.0 - 1e-7, 1.0 - 1e-8):
        for start in (0.05, -0.03, 0.01):
            polynomial = RecordedPolynomial(1.0, 0.3, -0.5 * factor, 0.02)
            h, h1, h2 = polynomial_derivatives(0.0, polynomial.coefficients)
            gap = -(1.0 + h1 * h1) / h2 * factor
            polynomial.descend((gap * h1, gap * h1, h - gap), start, monkeypatch)
            assert len(polynomial.line) < 60
            assert len(polynomial.plane) < 60
    # High above the origin, where heights have few significant digits left.
    high = RecordedPolynomial(
        5597.246940191622, 1.1220665821e-3, -0.4999999856541567, 0.04077, -1.158e-3
    )
    h, h1, h2 = polynomial_derivatives(0.0, high.coefficients)
    gap = -(1.0 + h1 * h1) / h2 * (1.0 - 2.8691686721844097e-08)
    high.descend((gap * h1, gap * h1, 2.0 * h - gap), 0.0022611303330464334, monkeypatch)
    assert len(high.plane) < 30
    slope = RecordedPolynomial(4188.6, 0.494, -0.5, -0.046, 0.055)
    gap = (1.0 + 0.494**2) * 0.9999986
    slope.descend((gap * 0.494, 0.0, 4188.6 - gap), -0.00032, monkeypatch)
    assert len(slope.line) < 14


def test_step_that_increases_the_distance_is_halved(monkeypatch: pytest.MonkeyPatch) -> None:
    """The next evaluation is at half the step in the same direction."""
    polynomial = RecordedPolynomial(0.0, 0.0, 0.0, 0.0, 1.0)  # h = x⁴, the probe above
    polynomial.descend((0.1, 0.2, 3.0), 0.45, monkeypatch)
    halved = 0
    for points in ([np.array([x]) for x in polynomial.line], polynomial.plane):
        best, phi = points[0], np.inf
        for at, following in pairwise(points):
            value = float(((at - [0.1, 0.2][: len(at)]) ** 2).sum() + ((at**4).sum() - 3.0) ** 2)
            if value > phi * (1.0 + 1e-9):
                np.testing.assert_allclose(following - best, 0.5 * (at - best), rtol=1e-12)
                halved += 1
            elif value <= phi:
                best, phi = at, value
    assert halved >= 2


def test_descent_is_invariant_under_scaling(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scaling all lengths by a power of two scales every evaluated point exactly."""
    cases: list[tuple[tuple[float, ...], tuple[float, float, float], float]] = [
        ((0.0, 0.0, 0.0, 0.0, 1.0), (0.1, 0.2, 3.0), 0.45),
        ((0.3, 0.5, -0.4, 0.2), (0.2, -0.1, -0.7), 0.9),
        ((1.0, 0.3, -0.4999999, 0.02), (0.33, 0.33, -0.09), 0.05),
    ]
    for coefficients, probe, start in cases:
        evaluations = []
        for scale in (1.0, 2.0**-30, 2.0**30):
            polynomial = RecordedPolynomial(
                *(c * scale ** (1 - n) for n, c in enumerate(coefficients))
            )
            x, y, z = (scale * part for part in probe)
            polynomial.descend((x, y, z), scale * start, monkeypatch)
            evaluations.append(
                np.concatenate([polynomial.line, np.ravel(polynomial.plane)]) / scale
            )
        np.testing.assert_array_equal(evaluations[1], evaluations[0])
        np.testing.assert_array_equal(evaluations[2], evaluations[0])


def test_lower_bound_of_a_box_is_the_distance_to_its_plane() -> None:
    """For a probe on the normal through the centre of the box, up to rounding."""
    rng = np.random.default_rng(5)
    for hx, hy, depth in rng.normal(size=(300, 3)):
        offset = (-hx * depth, -hy * depth, depth)
        distance = abs(depth) * np.sqrt(1.0 + hx * hx + hy * hy)
        bound = plane_search.distance_lower_bound(offset, hx, hy, 0.1, 0.0)
        assert bound == pytest.approx(distance, rel=1e-12)
        lifted_bound = plane_search.distance_lower_bound(offset, hx, hy, 0.1, 0.3 * distance)
        assert lifted_bound == pytest.approx(0.7 * distance, rel=1e-12)
        assert plane_search.distance_lower_bound(offset, hx, hy, 0.1, 2.0 * distance) == 0.0


def test_box_is_pruned_by_the_taylor_bound() -> None:
    """Above its centre only Q counts: φ ≥ φ₀ + d·Q d - 2∫(1 - t) t dt · change |d|²."""

    def is_pruned(enough: float) -> bool:
        arguments = (0.0, 0.0, 1.0), 0.0, 0.0, (0.1, 0.0, 0.1)
        return plane_search.can_prune(*arguments, 0.1, 0.6, 2.0, 0.3, 0.4, enough)

    assert is_pruned(0.975 * (1.0 - 1e-12))
    assert not is_pruned(0.975 * (1.0 + 1e-12))


def test_minimum_of_a_quadratic_over_a_box() -> None:
    """Never above a fine lattice, and below it by no more than its pitch explains."""
    rng = np.random.default_rng(2)
    s, t = np.meshgrid(np.linspace(-1.0, 1.0, 401), np.linspace(-1.0, 1.0, 401))
    inside = 0
    scale = [0.3, 0.3, 1.0, 1.0, 1.0, 1.0, 1.0]
    for px, py, qxx, qxy, qyy, *sides in scale * rng.normal(size=(300, 7)):
        a, b = np.abs(sides)
        x, y = a * s, b * t
        lattice = 2.0 * (px * x + py * y) + qxx * x * x + 2.0 * qxy * x * y + qyy * y * y
        least = plane_search.min_quadratic(px, py, qxx, qxy, qyy, a, b)
        # Beside a point of the lattice a side's parabola is lower by at most its slope.
        slack = 5e-3 * (abs(px) + abs(py) + (abs(qxx) + 2.0 * abs(qxy) + abs(qyy)) * (a + b))
        slack *= a + b
        assert lattice.min() - slack <= least + 1e-12 <= lattice.min() + 2e-12
        row, column = np.unravel_index(lattice.argmin(), lattice.shape)
        inside += 0 < row < 400 and 0 < column < 400
    assert inside > 10


@pytest.mark.parametrize("hessian_bound", [0.3, 1.4, 9.0])
@pytest.mark.parametrize(
    ("away", "slope", "curvature", "r"),
    [(0.0, 0.0, 0.2, 0.4), (0.3, 0.5, 1.3, 0.5), (-0.2, 0.1, 0.9, 0.1)],
)
def test_interval_is_pruned_exactly_at_the_taylor_bound(
    away: float,
    slope: float,
    curvature: float,
    r: float,
    hessian_bound: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """φ >= φ₀ - 2|p| r + (min(Q, 0) - L r/3) r², L = 3 K max|h'| + T max|h - z|, at h - z = -1."""
    polynomial, third_bound = RecordedPolynomial(0.7, slope, 0.5 * curvature), 0.8
    monkeypatch.setattr(line_search, "sample_profile", polynomial.along)
    p, q = away - slope, 1.0 + slope * slope - curvature
    max_curvature = min(hessian_bound, curvature + third_bound * r)
    max_slope = slope + max_curvature * r
    change = (3.0 * max_curvature * max_slope + third_bound * (1.0 + max_slope * r)) * r
    least = away**2 + 1.0 - 2.0 * abs(p) * r + (min(q, 0.0) - change / 3.0) * r * r
    for keep in (1.0, 0.5):
        for share, is_pruned in ((1.0 - 1e-9, True), (1.0 + 1e-9, False)):
            best = (-9.0, least / keep * share, 0.0, 0.0)
            result, further, left = line_search.evaluate_box(
                -away, 1.7, 0.0, r, hessian_bound, third_bound, best, keep, 50.0, None
            )
            can_be_level = abs(p) <= (abs(q) * (1.0 + 1e-6) + 0.5 * change + 1e-6) * r
            convex = q + change >= 0.0
            if is_pruned or not can_be_level or not convex:
                assert (result, further, left) == (best, False, 49.0)
            else:
                assert further or left < 49.0
                assert further == (q <= change)


def test_interval_without_level_point_or_convexity_is_pruned(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Up to the slack for rounding."""

    def is_interval_pruned(slope: float, curvature: float, away: float, third_bound: float) -> bool:
        polynomial = RecordedPolynomial(0.7, slope, 0.5 * curvature)
        monkeypatch.setattr(line_search, "sample_profile", polynomial.along)
        best = (-9.0, 1e9, 0.0, 0.0)
        arguments = (-away, 1.7, 0.0, 0.1, 50.0, third_bound, best, 1.0, 50.0, None)
        _result, further, left = line_search.evaluate_box(*arguments)
        return not further and left == 49.0

    # For a plane Q is 1 and constant: the slope vanishes at a distance of |p|.
    for away in (0.1 * (1.0 + 3e-6), 0.1 * (1.0 + 1e-6), -0.1 * (1.0 + 3e-6)):
        assert is_interval_pruned(0.0, 0.0, away, 0.0) == (abs(away) > 0.1 * (1.0 + 2e-6))
    # Q = 1 - h'' rises from -1 by 1: concave everywhere, except for a millionth.
    for third_bound, is_pruned in ((1.0, True), (30.0, False)):
        assert is_interval_pruned(0.0, 2.0, 0.0, third_bound) == is_pruned


def test_line_search_out_of_budget_relaxes_its_accuracy(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the rest of the budget it searches for points nearer by a share s: d ≥ (1 - s) d₀.

    The shares s fall to a quarter each time; squared distances are scaled by (1 - s)².
    """
    shares: list[float] = []

    def search_line(*arguments: object) -> tuple[tuple[float, ...], float]:
        shares.append(float(arguments[3]))  # type: ignore[arg-type]  # the fourth is a number
        return (0.0, 4.0, 0.0, 0.0), [0.0, 20.0, 10.0, 0.0][len(shares) - 1]

    monkeypatch.setattr(
        line_search, "descend_within_budget", lambda *_arguments: ((0.0, 4.0, 0.0, 0.0), 50.0)
    )
    monkeypatch.setattr(line_search, "search_line", search_line)
    best, gap, evaluations = line_search.search_line_within_budget(0.0, 2.0, 0.0, 100.0, None)
    np.testing.assert_allclose(shares[1:], [(1.0 - 0.25**n) ** 2 for n in (1, 2, 3)], rtol=1e-15)
    assert (best[1], gap, evaluations) == (4.0, 2.0 / 16.0, 100.0)
    monkeypatch.setattr(line_search, "search_line", lambda *_arguments: ((0.0, 4.0, 0.0, 0.0), 7.0))
    assert line_search.search_line_within_budget(0.0, 2.0, 0.0, 100.0, None)[1:] == (0.0, 68.0)


def test_plane_search_out_of_budget_relaxes_its_accuracy(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first search has three quarters of the budget; the following ones share the rest."""
    searches: list[tuple[float, float]] = []
    point = (0.1, 0.2, 4.0, 0.3, 0.4, 0.5)
    remaining = [0.0, 20.0, 10.0, 0.0]

    def search_plane(*arguments: object) -> tuple[tuple[float, ...], float]:
        searches.append((float(arguments[4]), float(arguments[5])))  # type: ignore[arg-type]  # numbers
        return point, remaining[len(searches) - 1]

    monkeypatch.setattr(
        plane_within, "descend_within_budget", lambda *arguments: (point, arguments[5])
    )
    monkeypatch.setattr(plane_within, "search_plane", search_plane)
    result = plane_within.closest_point_within_budget(0.0, 0.0, 2.0, 0.0, 0.0, 100.0, None)
    shares = [(1.0 - 0.25**n) ** 2 for n in (1, 2, 3)]
    np.testing.assert_allclose([share for share, _ in searches[1:]], shares, rtol=1e-15)
    assert [budget for _, budget in searches] == [75.0, 25.0, 20.0, 10.0]
    assert result == (0.1, 0.2, 0.3, 0.4, 0.5, 2.0 / 16.0, 100.0)
    searches, remaining = [], [7.0]
    result = plane_within.closest_point_within_budget(0.0, 0.0, 2.0, 0.0, 0.0, 100.0, None)
    assert result == (0.1, 0.2, 0.3, 0.4, 0.5, 0.0, 68.0)
    assert len(searches) == 1


@pytest.mark.parametrize("u", [0.1, 3.3, 4.0, 7.9])
def test_next_interval_visits_every_interval_once(u: float) -> None:
    """Three levels deep: 8 intervals, the nearest first, and the nearer of each pair first."""
    level, side, i = 3, 8.0, 0
    visited = []
    while level <= 3:
        if level == 0:
            visited.append(i)
        level, side, i = line_search.next_interval(level > 0, level, side, i, 3, u)
    assert sorted(visited) == list(range(8))
    assert visited[0] == int(u)
    for first in (0, 2, 4, 6):
        nearer = min((first, first + 1), key=lambda part: abs(part + 0.5 - u))
        assert visited.index(nearer) < visited.index(2 * first + 1 - nearer)


@pytest.mark.parametrize(
    ("points", "last", "start"),
    [
        (0.0, (0.1, 0.2, 0.3), (1.0, 2.0)),  # no previous tick
        (1.0, (1.0, 2.0, 2.0), (1.0, 2.0)),
        (1.0, (3.0, 5.0, -11.0), (3.0, 5.0)),  # at distance 7; the surface is 8 above
        (1.0, (9.0, 2.0, -17.0), (1.0, 2.0)),  # at distance 8 as well
        (1.0, (1.0, 10.5, -17.0), (1.0, 2.0)),
        (1.0, (1.5, 2.5, -9.0), (1.0, 2.0)),
        (1.0, (1.5, 2.5, -16.5), (1.5, 2.5)),
    ],
)
def test_warm_start_begins_at_the_last_point_if_nearer(
    points: float, last: FloatArray, start: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nearer than the point above the probe; the result is stored for the next tick."""
    calls: list[object] = []

    def search(*arguments: object) -> tuple[float, ...]:
        calls.append(arguments)
        return 0.11, 0.12, 0.13, 0.14, 0.15, 0.5, 33.0

    monkeypatch.setattr(again, "closest_point_within_budget", search)
    monkeypatch.setattr(again, "sample_height", lambda x, y, _texture: -13.0 + 2.0 * x + y)
    memory = np.arange(50.0, 50.0 + WARM_START_SIZE)
    memory[
        [KNOWN, FIRST_POINT, FIRST_POINT + 1, FIRST_POINT + 2, TRUNCATED_TICKS, MAX_ERROR_BOUND]
    ] = points, *last, 4.0, 0.4
    before = memory.copy()
    result = again.closest_point_warm(1.0, 2.0, -17.0, memory, "texture")
    assert result == (0.11, 0.12, 0.13, 0.14, 0.15)
    assert calls == [(1.0, 2.0, -17.0, *start, before[BUDGET], "texture")]
    changed = {
        KNOWN: 1.0,
        FIRST_POINT: 0.11,
        FIRST_POINT + 1: 0.12,
        FIRST_POINT + 2: 0.13,
        EVALUATIONS: 33.0,
        ERROR_BOUND: 0.5,
        TRUNCATED_TICKS: 5.0,
        MAX_ERROR_BOUND: 0.5,
    }
    for index, value in enumerate(before):
        assert memory[index] == changed.get(index, value)
    again.record_error_bound(memory, 0.25, 7.0)
    assert (
        memory[TRUNCATED_TICKS],
        memory[MAX_ERROR_BOUND],
        memory[ERROR_BOUND],
        memory[EVALUATIONS],
    ) == (6.0, 0.5, 0.25, 7.0)
    again.record_error_bound(memory, 0.0, 7.0)
    assert (memory[TRUNCATED_TICKS], memory[MAX_ERROR_BOUND], memory[ERROR_BOUND]) == (
        6.0,
        0.5,
        0.0,
    )

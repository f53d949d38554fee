"""Defaults of a contact, its geometry, and the descents and searches of the closest point."""

from __future__ import annotations

from itertools import pairwise

import mpmath
import numpy as np
import pytest
from tests.helpers.exact_heights import exact_height

from asperity.contacts import Contact, closest_search, distance_bounds
from asperity.contacts import warm_search as again
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

    def along(self, x: float, _y: float, _texture: object) -> tuple[float, ...]:
        self.line.append(x)
        h, hx, hxx = polynomial_derivatives(x, self.coefficients)
        return h, hx, 0.0, hxx, 0.0, 0.0

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
        monkeypatch.setattr(distance_bounds, "evaluation_cost", lambda _texture: 1.0)
        x, y, z = probe
        monkeypatch.setattr(distance_bounds, "sample_hessian", self.along)
        on_line = distance_bounds.descend(x, y, z, start, y, None)
        monkeypatch.setattr(distance_bounds, "sample_hessian", self.curvature)
        return on_line, distance_bounds.descend(x, y, z, start, 0.7 * start, None)


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
        assert on_line[1] == y
        assert on_line[3:] == pytest.approx((h, h1, 0.0), rel=1e-13, abs=1e-14)
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
        bound = distance_bounds.distance_lower_bound(offset, hx, hy, 0.1, 0.0)
        assert bound == pytest.approx(distance, rel=1e-12)
        lifted_bound = distance_bounds.distance_lower_bound(offset, hx, hy, 0.1, 0.3 * distance)
        assert lifted_bound == pytest.approx(0.7 * distance, rel=1e-12)
        assert distance_bounds.distance_lower_bound(offset, hx, hy, 0.1, 2.0 * distance) == 0.0


def test_box_is_pruned_by_the_taylor_bound() -> None:
    """Above its centre only Q counts: φ ≥ φ₀ + d·Q d - 2∫(1 - t) t dt · change |d|²."""

    def is_pruned(enough: float) -> bool:
        arguments = (0.0, 0.0, 1.0), 0.0, 0.0, (0.1, 0.0, 0.1)
        return distance_bounds.can_prune(*arguments, 0.1, 0.6, 2.0, 0.3, 0.4, enough)

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
        least = distance_bounds.min_quadratic(px, py, qxx, qxy, qyy, a, b)
        # Beside a point of the lattice a side's parabola is lower by at most its slope.
        slack = 5e-3 * (abs(px) + abs(py) + (abs(qxx) + 2.0 * abs(qxy) + abs(qyy)) * (a + b))
        slack *= a + b
        assert lattice.min() - slack <= least + 1e-12 <= lattice.min() + 2e-12
        row, column = np.unravel_index(lattice.argmin(), lattice.shape)
        inside += 0 < row < 400 and 0 < column < 400
    assert inside > 10


def test_search_out_of_budget_relaxes_its_accuracy(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the rest of the budget it searches for points nearer by a share s: d ≥ (1 - s) d₀.

    The first search has three quarters of the budget; the following ones share the rest. The shares
    s fall to a quarter each time; squared distances are scaled by (1 - s)².
    """
    searches: list[tuple[float, float]] = []
    point = (0.1, 0.2, 4.0, 0.3, 0.4, 0.5)
    remaining = [0.0, 20.0, 10.0, 0.0]

    def search_boxes(*arguments: object) -> tuple[tuple[float, ...], float]:
        searches.append((float(arguments[4]), float(arguments[5])))  # type: ignore[arg-type]  # numbers
        return point, remaining[len(searches) - 1]

    monkeypatch.setattr(
        closest_search, "descend_within_budget", lambda *arguments: (point, arguments[5])
    )
    monkeypatch.setattr(closest_search, "search_boxes", search_boxes)
    result = closest_search.closest_point_within_budget(0.0, 0.0, 2.0, 0.0, 0.0, 100.0, None)
    shares = [(1.0 - 0.25**n) ** 2 for n in (1, 2, 3)]
    np.testing.assert_allclose([share for share, _ in searches[1:]], shares, rtol=1e-15)
    assert [budget for _, budget in searches] == [75.0, 25.0, 20.0, 10.0]
    assert result == (0.1, 0.2, 0.3, 0.4, 0.5, 2.0 / 16.0, 100.0)
    searches, remaining = [], [7.0]
    result = closest_search.closest_point_within_budget(0.0, 0.0, 2.0, 0.0, 0.0, 100.0, None)
    assert result == (0.1, 0.2, 0.3, 0.4, 0.5, 0.0, 68.0)
    assert len(searches) == 1


def test_start_on_a_line_is_projected(monkeypatch: pytest.MonkeyPatch) -> None:
    """A warm start of parallel waves or a profile begins on the line through the probe."""
    starts: list[tuple[float, ...]] = []

    def descend(*arguments: float) -> tuple[tuple[float, ...], float]:
        starts.append(arguments[3:5])
        return (0.0,) * 6, 1.0

    frame = (1.0, 2.0, 0.6, 0.8, 1.0, 0.0)
    monkeypatch.setattr(closest_search, "search_frame", lambda *_arguments: frame)
    monkeypatch.setattr(closest_search, "descend_within_budget", descend)
    monkeypatch.setattr(closest_search, "search_boxes", lambda *_arguments: ((0.0,) * 6, 1.0))
    closest_search.closest_point_within_budget(1.0, 2.0, -1.0, 1.5, 2.5, 9.0, None)
    np.testing.assert_allclose(starts, [(1.0 + 0.7 * 0.6, 2.0 + 0.7 * 0.8)], rtol=1e-15)


@pytest.mark.parametrize("u", [0.1, 3.3, 4.0, 7.9])
def test_division_of_a_line_visits_every_interval_once(u: float) -> None:
    """Three levels deep: 8 intervals, the nearest first, and the nearer of each pair first."""
    stack, frame = np.empty((256, 5)), (0.0, 0.0, 1.0, 0.0, 1.0, 0.0)
    minimum = (u, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    count = closest_search.push_box((0.0, 8.0, 0.0, 1.0), 0.0, stack, 0)
    visited = []
    while count > 0:
        count -= 1
        west, east, south, north, _bound = stack[count].tolist()
        assert (south, north) == (0.0, 1.0)
        if east - west == 1.0:
            visited.append(int(west))
        else:
            box = (west, east, south, north)
            count = closest_search.split_box(frame, minimum, box, stack, count, None)
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

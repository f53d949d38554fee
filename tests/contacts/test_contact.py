"""What a contact promises by default, and where it is."""

from __future__ import annotations

from itertools import pairwise

import mpmath
import numpy as np
import pytest

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


def test_a_contact_promises_nothing_unless_it_says_so() -> None:
    assert not Contact.single_valued
    assert not Contact.is_above_probe
    assert not Contact.clampable
    assert not Contact.supports_state
    assert Contact.begins_on_texture
    assert Contact.is_determined_by_depth
    assert (Contact.relative_cost, Contact.parameters) == (1000.0, ())


@pytest.mark.parametrize("letter", ["A", "D", "H", "W"])
def test_inside_is_where_the_depth_is_positive(letter: str) -> None:
    """On the texture's side of where contact begins, and not on it."""
    contact = LAWS[letter].contact
    begin = contact.contact_height(WAVES, POINTS[:, :2])
    inside = contact.is_in_contact(WAVES, POINTS)
    np.testing.assert_array_equal(inside, POINTS[:, 2] < begin)
    assert 20 < inside.sum() < 180
    on = np.column_stack([POINTS[:20, :2], begin[:20]])
    if letter == "W":
        assert not contact.is_in_contact(WAVES, on).any()


@pytest.mark.parametrize("letter", ["A", "D", "H", "W"])
def test_the_depth_grows_on_the_way_inwards(letter: str) -> None:
    """Straight down, or against the normal; from the surface by as much as one goes."""
    from asperity.contacts.symbols import HX, HY

    contact = LAWS[letter].contact
    xy = POINTS[:20, :2]
    derivatives = WAVES.derivatives(xy)
    straight = letter in "AW"
    for row in derivatives:
        inward = contact.inward_direction().subs({HX: row[1], HY: row[2]})
        down = np.array([0.0, 0.0, -1.0] if straight else [row[1], row[2], -1.0])
        expected = down / np.linalg.norm(down)
        np.testing.assert_allclose(np.array(inward, float).ravel(), expected, rtol=1e-14)
    if contact.is_determined_by_depth:
        probes = contact.probe_positions(xy, np.full(20, 3e-6), derivatives)
        np.testing.assert_allclose(contact.depth(WAVES, probes), 3e-6, rtol=1e-6)
        above = contact.probe_positions(xy, np.full(20, -3e-6), derivatives)
        np.testing.assert_allclose(contact.depth(WAVES, above), -3e-6, rtol=1e-6)


def test_how_large_and_how_far_aside_the_coordinates_of_a_contact_are() -> None:
    """What the depth is a difference of, and where the point may lie."""
    xy = np.array([0.3, -4.0])
    for letter, size, aside in (
        ("A", 0.7, 0.0),
        ("W", 0.0, 0.0),
        ("D", 4.7, 2e-3),
        ("H", 4.7, 2e-3),
    ):
        contact = LAWS[letter].contact
        assert contact.coordinate_scale(xy, -0.7) == pytest.approx(size, rel=1e-15)
        assert contact.lateral_reach(2e-3) == aside
        assert contact.requires_search == (letter in "DH")
    slopes = np.array([[0.5, 0.3, -0.4], [0.1, 0.0, 0.0]])
    for letter, deep in (("A", [0.7, 0.3]), ("W", [0.2, 0.2]), ("D", [0.7 * 1.25**0.5, 0.3])):
        found = LAWS[letter].contact.depth_at_height(-0.2, slopes)
        np.testing.assert_allclose(found, deep, rtol=1e-14)


def test_a_limit_of_force_looks_half_as_often_as_a_tick() -> None:
    """At the nearest point, from right below the probe; 600 looks are a tick's."""
    assert LAWS["D"].contact.max_evaluations == 600.0
    code = LAWS["D"].contact.depth_code()
    assert code[-2].endswith("= closest_point_within_budget(x, y, z, x, y, 300.0, texture)")
    assert code[:2] == ["if not sample_height(x, y, texture) - z > 0.0:", "    return 0.0"]
    assert LAWS["A"].contact.depth_code()[-1] == "return depth"


def test_the_exact_foot_is_one_in_all_its_digits() -> None:
    """Where ∇φ = 0, to far more digits than the kernels' own foot, from which it starts."""
    with mpmath.workdps(60):
        h, contact = WAVES.exact_height(), LAWS["D"].contact
        for point in POINTS[:8]:
            p = [mpmath.mpf(float(value)) for value in point]
            found = contact.exact_contact(WAVES, h, p)
            assert found is not None
            depth, x, y = found
            gap = h(x, y, 0, 0) - p[2]
            assert abs(x - p[0] + gap * h(x, y, 1, 0)) < 1e-50 * abs(depth)
            assert abs(y - p[1] + gap * h(x, y, 0, 1)) < 1e-50 * abs(depth)
            assert abs(depth**2 - (x - p[0]) ** 2 - (y - p[1]) ** 2 - gap**2) < 1e-60


# --- descents -------------------------------------------------------------------------------------


def along(x: float, coefficients: tuple[float, ...]) -> tuple[float, float, float]:
    """Return h, h', h'' of a polynomial."""
    p = np.polynomial.Polynomial(coefficients)
    return float(p(x)), float(p.deriv()(x)), float(p.deriv(2)(x))


class Looks:
    """A polynomial of the line, the same along x and y in the plane, and where each was asked."""

    def __init__(self, *coefficients: float) -> None:
        self.coefficients = coefficients
        self.line: list[float] = []
        self.plane: list[FloatArray] = []

    def along(self, x: float, _texture: object) -> tuple[float, float, float]:
        self.line.append(x)
        return along(x, self.coefficients)

    def curvature(self, x: float, y: float, _texture: object) -> tuple[float, ...]:
        self.plane.append(np.array([x, y]))
        (h, hx, hxx), (g, gy, gyy) = along(x, self.coefficients), along(y, self.coefficients)
        return h + g, hx, gy, hxx, 0.0, gyy

    def descend(
        self, probe: tuple[float, float, float], start: float, monkeypatch: pytest.MonkeyPatch
    ) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Descend along a line and in the plane; return both ends."""
        monkeypatch.setattr(line_search, "sample_profile", self.along)
        monkeypatch.setattr(plane_search, "sample_hessian", self.curvature)
        x, y, z = probe
        on_line = line_search.descend(x, z, start, None)
        return on_line, plane_search.descend(x, y, z, start, 0.7 * start, None)


def test_a_descent_takes_few_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Newton's steps double the digits: it ends as soon as there are no more."""
    rng, on_lines, in_planes = np.random.default_rng(8), 0, 0
    for _ in range(40):
        looks = Looks(*rng.normal(size=4) * [1.0, 0.5, 0.2, 0.05])
        x, y = rng.normal(size=2)
        z = 2.0 * along(x, looks.coefficients)[0] - rng.uniform(0.1, 0.5)
        on_line, in_plane = looks.descend((x, y, z), x + 0.2, monkeypatch)
        on_lines, in_planes = on_lines + len(looks.line), in_planes + len(looks.plane)
        h, h1, _h2 = along(on_line[0], looks.coefficients)
        assert abs(on_line[0] - x + (h - z) * h1) < 1e-13 * (1.0 + abs(h - z) * (1.0 + abs(h1)))
        assert on_line[2:] == pytest.approx((h, h1), rel=1e-13, abs=1e-14)
        px, py = in_plane[:2]
        (hx, gx, _), (hy, gy, _) = (along(at, looks.coefficients) for at in (px, py))
        gap = hx + hy - z
        assert abs(px - x + gap * gx) < 1e-12 * (1.0 + abs(gap) * (1.0 + abs(gx)))
        assert abs(py - y + gap * gy) < 1e-12 * (1.0 + abs(gap) * (1.0 + abs(gy)))
        assert in_plane[3:] == pytest.approx((hx + hy, gx, gy), rel=1e-12, abs=1e-13)
    assert on_lines <= 4.5 * 40
    assert in_planes <= 5 * 40


def test_where_rounding_swamps_the_steps_a_descent_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nearly at a centre of curvature steps no longer shrink: none of 200 would be the last."""
    for share in (1.0 - 1e-7, 1.0 - 1e-8):
        for start in (0.05, -0.03, 0.01):
            looks = Looks(1.0, 0.3, -0.5 * share, 0.02)
            h, h1, h2 = along(0.0, looks.coefficients)
            gap = -(1.0 + h1 * h1) / h2 * share
            looks.descend((gap * h1, gap * h1, h - gap), start, monkeypatch)
            assert len(looks.line) < 60
            assert len(looks.plane) < 60
    # High above the origin, where each height has few digits left.
    high = Looks(5597.246940191622, 1.1220665821e-3, -0.4999999856541567, 0.04077, -1.158e-3)
    h, h1, h2 = along(0.0, high.coefficients)
    gap = -(1.0 + h1 * h1) / h2 * (1.0 - 2.8691686721844097e-08)
    high.descend((gap * h1, gap * h1, 2.0 * h - gap), 0.0022611303330464334, monkeypatch)
    assert len(high.plane) < 30
    slope = Looks(4188.6, 0.494, -0.5, -0.046, 0.055)
    gap = (1.0 + 0.494**2) * 0.9999986
    slope.descend((gap * 0.494, 0.0, 4188.6 - gap), -0.00032, monkeypatch)
    assert len(slope.line) < 14


def test_a_step_too_far_is_halved(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where φ is greater the next look is half as far on the same way."""
    looks = Looks(0.0, 0.0, 0.0, 0.0, 1.0)  # h = x⁴, the probe above
    looks.descend((0.1, 0.2, 3.0), 0.45, monkeypatch)
    halved = 0
    for places in ([np.array([x]) for x in looks.line], looks.plane):
        best, phi = places[0], np.inf
        for at, following in pairwise(places):
            now = float(((at - [0.1, 0.2][: len(at)]) ** 2).sum() + ((at**4).sum() - 3.0) ** 2)
            if now > phi * (1.0 + 1e-9):
                np.testing.assert_allclose(following - best, 0.5 * (at - best), rtol=1e-12)
                halved += 1
            elif now <= phi:
                best, phi = at, now
    assert halved >= 2


def test_a_descent_is_the_same_at_any_scale(monkeypatch: pytest.MonkeyPatch) -> None:
    """In lengths shorter by a power of two each look is shorter by just that."""
    cases: list[tuple[tuple[float, ...], tuple[float, float, float], float]] = [
        ((0.0, 0.0, 0.0, 0.0, 1.0), (0.1, 0.2, 3.0), 0.45),
        ((0.3, 0.5, -0.4, 0.2), (0.2, -0.1, -0.7), 0.9),
        ((1.0, 0.3, -0.4999999, 0.02), (0.33, 0.33, -0.09), 0.05),
    ]
    for coefficients, probe, start in cases:
        seen = []
        for scale in (1.0, 2.0**-30, 2.0**30):
            looks = Looks(*(c * scale ** (1 - n) for n, c in enumerate(coefficients)))
            x, y, z = (scale * part for part in probe)
            looks.descend((x, y, z), scale * start, monkeypatch)
            seen.append(np.concatenate([looks.line, np.ravel(looks.plane)]) / scale)
        np.testing.assert_array_equal(seen[1], seen[0])
        np.testing.assert_array_equal(seen[2], seen[0])


def test_a_piece_right_below_the_probe_is_as_far_as_its_plane() -> None:
    """On the normal through its middle: what rounding leaves aside is none, and no error."""
    rng = np.random.default_rng(5)
    for hx, hy, depth in rng.normal(size=(300, 3)):
        away = (-hx * depth, -hy * depth, depth)
        far = abs(depth) * np.sqrt(1.0 + hx * hx + hy * hy)
        found = plane_search.distance_lower_bound(away, hx, hy, 0.1, 0.0)
        assert found == pytest.approx(far, rel=1e-12)
        lifted = plane_search.distance_lower_bound(away, hx, hy, 0.1, 0.3 * far)
        assert lifted == pytest.approx(0.7 * far, rel=1e-12)
        assert plane_search.distance_lower_bound(away, hx, hy, 0.1, 2.0 * far) == 0.0


def test_a_box_is_as_far_as_taylor_s_formula_says() -> None:
    """Above its middle only Q's change counts: φ ≥ φ₀ - 2∫(1 - t) t dt · change r²."""

    def is_hopeless(enough: float) -> bool:
        given = (0.0, 0.0, 1.0), 0.0, 0.0, (2.0, 0.0, 2.0)
        return plane_search.can_prune(*given, 2.0, 0.6, 2.0, 0.3, 0.4, enough)

    assert is_hopeless(0.95 * (1.0 - 1e-12))
    assert not is_hopeless(0.95 * (1.0 + 1e-12))


@pytest.mark.parametrize("bend", [0.3, 1.4, 9.0])
@pytest.mark.parametrize(
    ("away", "slope", "turn", "r"),
    [(0.0, 0.0, 0.2, 0.4), (0.3, 0.5, 1.3, 0.5), (-0.2, 0.1, 0.9, 0.1)],
)
def test_an_interval_is_dropped_just_where_taylor_s_formula_says(
    away: float, slope: float, turn: float, r: float, bend: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """φ >= φ₀ - 2|p| r + (min(Q, 0) - L r/3) r², L = 3 K max|h'| + T max|h - z|, at h - z = -1."""
    looks, twist = Looks(0.7, slope, 0.5 * turn), 0.8
    monkeypatch.setattr(line_search, "sample_profile", looks.along)
    p, q = away - slope, 1.0 + slope * slope - turn
    most = min(bend, turn + twist * r)
    steep = slope + most * r
    change = (3.0 * most * steep + twist * (1.0 + steep * r)) * r
    least = away**2 + 1.0 - 2.0 * abs(p) * r + (min(q, 0.0) - change / 3.0) * r * r
    for keep in (1.0, 0.5):
        for share, dropped in ((1.0 - 1e-9, True), (1.0 + 1e-9, False)):
            best = (-9.0, least / keep * share, 0.0, 0.0)
            found, further, left = line_search.evaluate_box(
                -away, 1.7, 0.0, r, bend, twist, best, keep, 50.0, None
            )
            flat = abs(p) <= (abs(q) * (1.0 + 1e-6) + 0.5 * change + 1e-6) * r
            convex = q + change >= 0.0
            if dropped or not flat or not convex:
                assert (found, further, left) == (best, False, 49.0)
            else:
                assert further or left < 49.0
                assert further == (q <= change)


def test_an_interval_is_dropped_where_its_slope_cannot_vanish(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Or where it is nowhere convex; the numbers leave room for rounding."""

    def is_dropped(slope: float, turn: float, away: float, twist: float) -> bool:
        looks = Looks(0.7, slope, 0.5 * turn)
        monkeypatch.setattr(line_search, "sample_profile", looks.along)
        best = (-9.0, 1e9, 0.0, 0.0)
        given = (-away, 1.7, 0.0, 0.1, 50.0, twist, best, 1.0, 50.0, None)
        _found, further, left = line_search.evaluate_box(*given)
        return not further and left == 49.0

    # Of a plane Q is 1 and does not change: the slope vanishes at a distance of |p|.
    for away in (0.1 * (1.0 + 3e-6), 0.1 * (1.0 + 1e-6), -0.1 * (1.0 + 3e-6)):
        assert is_dropped(0.0, 0.0, away, 0.0) == (abs(away) > 0.1 * (1.0 + 2e-6))
    # Q = 1 - h'' from -1 up by 1: concave all over, but for a millionth.
    for twist, dropped in ((1.0, True), (30.0, False)):
        assert is_dropped(0.0, 2.0, 0.0, twist) == dropped


def test_a_search_out_of_looks_asks_for_less_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Unfinished it goes on with what is nearer by a share that falls to a quarter: d ≥ (1 - s) d₀.

    So the squares that it searches with are (1 - s)².
    """
    kept: list[float] = []

    def search_line(*given: object) -> tuple[tuple[float, ...], float]:
        kept.append(float(given[3]))  # type: ignore[arg-type]  # the fourth is a number
        return (0.0, 4.0, 0.0, 0.0), [0.0, 20.0, 10.0, 0.0][len(kept) - 1]

    monkeypatch.setattr(
        line_search, "descend_within_budget", lambda *_given: ((0.0, 4.0, 0.0, 0.0), 50.0)
    )
    monkeypatch.setattr(line_search, "search_line", search_line)
    best, gap, looks = line_search.search_line_within_budget(0.0, 2.0, 0.0, 100.0, None)
    np.testing.assert_allclose(kept[1:], [(1.0 - 0.25**n) ** 2 for n in (1, 2, 3)], rtol=1e-15)
    assert (best[1], gap, looks) == (4.0, 2.0 / 16.0, 100.0)
    monkeypatch.setattr(line_search, "search_line", lambda *_given: ((0.0, 4.0, 0.0, 0.0), 7.0))
    assert line_search.search_line_within_budget(0.0, 2.0, 0.0, 100.0, None)[1:] == (0.0, 43.0)


def test_a_search_of_the_plane_asks_for_less_in_the_same_way(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Half of the looks for the foot itself; what is left of them goes to what follows."""
    kept: list[tuple[float, float]] = []
    foot = (0.1, 0.2, 4.0, 0.3, 0.4, 0.5)
    left = [0.0, 20.0, 10.0, 0.0]

    def search_plane(*given: object) -> tuple[tuple[float, ...], float]:
        kept.append((float(given[4]), float(given[5])))  # type: ignore[arg-type]  # numbers
        return foot, left[len(kept) - 1]

    monkeypatch.setattr(plane_within, "descend_within_budget", lambda *given: (foot, given[5]))
    monkeypatch.setattr(plane_within, "search_plane", search_plane)
    found = plane_within.closest_point_within_budget(0.0, 0.0, 2.0, 0.0, 0.0, 100.0, None)
    shares = [(1.0 - 0.25**n) ** 2 for n in (1, 2, 3)]
    np.testing.assert_allclose([keep for keep, _ in kept[1:]], shares, rtol=1e-15)
    assert [looks for _, looks in kept] == [50.0, 50.0, 20.0, 10.0]
    assert found == (0.1, 0.2, 0.3, 0.4, 0.5, 2.0 / 16.0, 100.0)
    kept, left = [], [7.0]
    found = plane_within.closest_point_within_budget(0.0, 0.0, 2.0, 0.0, 0.0, 100.0, None)
    assert found == (0.1, 0.2, 0.3, 0.4, 0.5, 0.0, 43.0)
    assert len(kept) == 1


@pytest.mark.parametrize("u", [0.1, 3.3, 4.0, 7.9])
def test_next_interval_visits_every_part_once(u: float) -> None:
    """Three levels down from the whole: 8 parts, the nearest first, of halves the nearer."""
    level, side, i = 3, 8.0, 0
    seen = []
    while level <= 3:
        if level == 0:
            seen.append(i)
        level, side, i = line_search.next_interval(level > 0, level, side, i, 3, u)
    assert sorted(seen) == list(range(8))
    assert seen[0] == int(u)
    for first in (0, 2, 4, 6):
        nearer = min((first, first + 1), key=lambda part: abs(part + 0.5 - u))
        assert seen.index(nearer) < seen.index(2 * first + 1 - nearer)


@pytest.mark.parametrize(
    ("points", "last", "start"),
    [
        (0.0, (0.1, 0.2, 0.3), (1.0, 2.0)),  # of no tick before
        (1.0, (1.0, 2.0, 2.0), (1.0, 2.0)),
        (1.0, (3.0, 5.0, -11.0), (3.0, 5.0)),  # 7 away; the surface is 8 above
        (1.0, (9.0, 2.0, -17.0), (1.0, 2.0)),  # 8 away too
        (1.0, (1.0, 10.5, -17.0), (1.0, 2.0)),
        (1.0, (1.5, 2.5, -9.0), (1.0, 2.0)),
        (1.0, (1.5, 2.5, -16.5), (1.5, 2.5)),
    ],
)
def test_a_tick_starts_at_the_last_foot_where_that_is_nearer(
    points: float, last: FloatArray, start: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Than what is straight above; the foot that is found is where the next one starts."""
    told: list[object] = []

    def foot_within(*given: object) -> tuple[float, ...]:
        told.append(given)
        return 0.11, 0.12, 0.13, 0.14, 0.15, 0.5, 33.0

    monkeypatch.setattr(again, "closest_point_within_budget", foot_within)
    monkeypatch.setattr(again, "sample_height", lambda x, y, _texture: -13.0 + 2.0 * x + y)
    memory = np.arange(50.0, 50.0 + WARM_START_SIZE)
    memory[
        [KNOWN, FIRST_POINT, FIRST_POINT + 1, FIRST_POINT + 2, TRUNCATED_TICKS, MAX_ERROR_BOUND]
    ] = points, *last, 4.0, 0.4
    before = memory.copy()
    found = again.closest_point_warm(1.0, 2.0, -17.0, memory, "texture")
    assert found == (0.11, 0.12, 0.13, 0.14, 0.15)
    assert told == [(1.0, 2.0, -17.0, *start, before[BUDGET], "texture")]
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

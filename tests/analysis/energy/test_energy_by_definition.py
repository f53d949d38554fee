"""The components of worst loops, merit and continuity, each compared with its definition."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from asperity.analysis import loop_work
from asperity.analysis.energy import curl_columns as columns
from asperity.analysis.energy import field_energy as anchor
from asperity.analysis.energy import field_energy as loops
from asperity.analysis.energy import leak
from asperity.analysis.energy import straight_scan as scan_module
from asperity.analysis.energy.curl_columns import Layer, column_polygon, positive_interval
from asperity.analysis.energy.leak import worst_loop
from asperity.core.checks import FloatArray
from asperity.core.errors import InternalError
from asperity.core.units import round_up
from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Sinusoid
from asperity.textures.domain import ScanLine

K, L, D = 1000.0, 2e-3, 0.3e-3
ACROSS = np.array([0.6, 0.8])
SAW = Fourier([0.05e-3, 0.025e-3], np.outer([2 * math.pi / L, 4 * math.pi / L], ACROSS), [0, 0.4])
SQUARE = Law(
    "Q",
    "square",
    "vertical",
    lambda c: c.k * c.depth**2 / c.parameter("size") * c.normal,
    clampable=True,
    parameters={"size": D},
)
RNG = np.random.default_rng(21)
LUMPS = HeightMap(2e-5 * RNG.normal(size=(12, 16)), 1e-4, periodic=True)

# --- layers and columns ---------------------------------------------------------------------------


def equal_layers(top: float, bottom: float, count: int, *, held: bool = False) -> list[Layer]:
    ends = [top + (bottom - top) * i / count for i in range(count + 1)]
    return [Layer(ends[i], ends[i + 1], held) for i in range(count)]


@pytest.mark.parametrize(
    ("law", "clamp", "free", "held"),
    [
        ("A", "none", 1, 0),
        ("A", "whole", 1, 1),
        ("A", "lateral", 1, 1),
        ("A", "backed", 1, 1),
        (SQUARE, "none", 64, 0),
        (SQUARE, "whole", 64, 1),
        (SQUARE, "lateral", 64, 64),
        (SQUARE, "backed", 64, 1),
        ("C", "lateral", 0, 1),
        ("C", "whole", 0, 1),
    ],
    ids=str,
)
def test_layers_extend_from_the_surface_to_the_last_change_of_force(
    law: Any, clamp: Any, free: int, held: int
) -> None:
    """They end at max_depth, or at z_b under a clamp; a curl that is not affine has 64 layers."""
    surface = Surface(SAW, law, K, D, clamp=clamp)
    for deeper in (0.0, 1e-5):
        result, bottom = columns.depth_layers(surface, deeper), surface.clamped_depth + deeper
        expected = equal_layers(0.0, bottom if clamp == "none" else D, free) if free else []
        expected += equal_layers(D, bottom, held, held=True) if held else []
        assert len(result) == len(expected)
        for one, other in zip(result, expected, strict=True):
            assert (one.top, one.bottom) == pytest.approx((other.top, other.bottom), rel=1e-12)
            assert one.is_clamped is other.is_clamped


def test_columns_are_equally_spaced_along_the_line() -> None:
    """1024 per period of a wave; four per cell of a map, between 1024 and 4096."""
    surface, line = Surface(SAW, "A", K, D), SAW.scan_line()
    vertices = columns.curl_region_loop(surface, line, 1.0)
    along = np.unique(np.round((vertices[:, :2] @ line.direction) / line.length * 1024, 6))
    assert np.diff(along).min() == pytest.approx(1.0)
    assert np.abs(along - np.round(along)).max() < 1e-6
    assert columns._node_count(SAW, line) == 1024
    for size, expected in ((16, 1024), (301, 1200), (1100, 4096)):
        heights = np.zeros((4, size))
        heights[0, 0] = 1e-6
        texture = HeightMap(heights, 1e-4)
        cells = texture.line_segments(texture.scan_line(), 1)
        assert cells is not None
        assert len(cells.centres) == size - 1
        assert columns._node_count(texture, texture.scan_line()) == expected


def test_positive_interval_of_piecewise_linear_columns() -> None:
    """Each column is compared with a dense search for its longest positive interval."""
    levels = np.array([0.0, 0.5, 0.8, 2.0, 2.0, 3.0])
    values = RNG.normal(size=(6, 200))
    top, bottom = positive_interval(levels.tolist(), values)
    for column in range(200):
        best = (0.0, 0.0, 0.0)
        v, start = values[:, column], None
        for i in range(5):
            for part in np.linspace(0.0, 1.0, 401):
                level = levels[i] + part * (levels[i + 1] - levels[i])
                if (1.0 - part) * v[i] + part * v[i + 1] > 0.0:
                    start = level if start is None else start
                    if level - start > best[0]:
                        best = (level - start, start, level)
                else:
                    start = None
        assert bottom[column] - top[column] == pytest.approx(best[0], abs=0.02)
        if best[0] > 0.05:
            assert (top[column], bottom[column]) == pytest.approx(best[1:], abs=0.02)


def area(vertices: FloatArray) -> float:
    """Return the signed area of a polygon in the x-z plane."""
    x, z = vertices[:, 0], vertices[:, 2]
    return 0.5 * float(np.sum(x * np.roll(z, -1) - np.roll(x, -1) * z))


@pytest.mark.parametrize("periodic", [True, False])
def test_column_polygon_encloses_exactly_its_columns(periodic: bool) -> None:
    """For random columns the area is the sum of trapezia, and the widest gap is left out."""
    for _ in range(100):
        n = int(RNG.integers(4, 12))
        full = RNG.random(n) < 0.5
        x = np.arange(n + 1.0)
        full = np.append(full, full[0]) if periodic else RNG.random(n + 1) < 0.5
        height = np.where(full, RNG.uniform(0.5, 2.0, n + 1), 0.0)
        if periodic:
            height[-1] = height[0]
        low = np.zeros(n + 1) if full.all() else -RNG.random(n + 1)
        low[-1] = low[0] if periodic else low[-1]
        polygon = column_polygon(
            np.column_stack([x, 2.0 * x]), low + height, low, periodic=periodic
        )
        if not full.any():
            assert polygon.shape == (0, 3)
            continue
        assert (np.linalg.norm(np.diff(polygon, axis=0, append=polygon[:1]), axis=1) > 0.0).all()
        np.testing.assert_allclose(polygon[:, 1], 2.0 * polygon[:, 0])
        expected = 0.5 * float((height[1:] + height[:-1]).sum())
        assert abs(area(polygon)) == pytest.approx(expected, rel=1e-12)
        assert area(polygon) < 0.0  # along the tops, back along the bottoms
        width = np.ptp(polygon[:, 0])
        if not periodic:
            inside = np.flatnonzero(full)
            assert polygon[:, 0].min() == max(inside[0] - 1, 0)
            assert polygon[:, 0].max() == min(inside[-1] + 1, n)
        elif not full.all():
            runs = "".join("x" if one else "." for one in np.tile(full[:-1], 2)).split("x")
            widest = min(max(map(len, runs)), n)
            assert width == n - widest + 1


# --- lines ----------------------------------------------------------------------------------------


def test_parallel_scan_lines_are_evenly_spaced_over_a_map() -> None:
    for letter, count in (("A", 33), ("E", 4)):
        surface = Surface(LUMPS, letter, K, 2e-5)
        line = LUMPS.scan_line()
        lines = leak.parallel_scan_lines(surface, line)
        across = np.array([-line.direction[1], line.direction[0]])
        assert len(lines) == count
        places = [float((one.start - LUMPS.domain.origin) @ across) for one in lines]
        reach = float(np.abs(LUMPS.domain.spans @ across).sum())
        expected = (np.arange(count) + 0.5) / count * reach
        if min(places) < 0.0:
            expected -= reach
        np.testing.assert_allclose(sorted(places), sorted(expected), atol=1e-12)
        for one in lines:
            assert (one.length, one.periodic) == (line.length, line.periodic)
            np.testing.assert_array_equal(one.direction, line.direction)
    # For a line along y, "across" is -x: the map lies on one side of the line only.
    along_y = leak.parallel_scan_lines(
        Surface(LUMPS, "A", K, 2e-5), leak.scan_line_along(Surface(LUMPS, "A", K, 2e-5), (0.0, 1.0))
    )
    starts = sorted(float(one.start[0] - LUMPS.domain.origin[0]) for one in along_y)
    np.testing.assert_allclose(starts, (np.arange(33) + 0.5) / 33 * 16e-4, rtol=1e-9)
    profile = Surface(SAW, "A", K, D)
    assert len(leak.parallel_scan_lines(profile, SAW.scan_line())) == 1


def test_scan_line_in_a_direction_spans_the_domain() -> None:
    surface = Surface(LUMPS, "A", K, 2e-5)
    default_line = LUMPS.scan_line()
    x, y = (float(part) for part in default_line.direction)
    assert leak.scan_line_along(surface, (3.0 * x, 3.0 * y)).periodic
    assert leak.scan_line_along(surface, (-3.0 * x, -3.0 * y)).periodic
    for direction in ((0.6, 0.8), (0.0, 1.0), (-3.0, 4.0)):
        line = leak.scan_line_along(surface, direction)
        unit = np.array(direction) / math.hypot(*direction)
        if abs(float(unit @ default_line.direction)) > 1.0 - 1e-12:
            continue
        np.testing.assert_allclose(line.direction, unit, rtol=1e-15)
        assert line.length == pytest.approx(max(abs(s @ unit) for s in LUMPS.domain.spans))
        assert line.periodic is False
        np.testing.assert_array_equal(line.start, LUMPS.domain.origin)


def test_worst_loop_is_the_worst_of_all_scan_lines() -> None:
    """The description contains the depth and the number of lines."""
    surface = Surface(LUMPS, "A", K, 2e-5)
    loop = worst_loop(surface, (1.0, 0.0))
    line = LUMPS.scan_line()
    sides = [
        max(columns.sample_curl_integrals(surface, one))
        for one in leak.parallel_scan_lines(surface, line)
    ]
    assert loop.energy == pytest.approx(max(sides), rel=0.02)
    assert loop.description.endswith("depth to 0.02 mm, the worst of 33 lines in one direction")
    assert loop_work(surface, loop.vertices) == pytest.approx(loop.energy, rel=1e-12)
    assert loop.per_length == loop.energy / loop.line.length


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_column_leak_uses_the_side_that_gains_more(mirror: float) -> None:
    """The line rises more than it falls; both directions are tested."""
    start = np.array([0.1 * L, 0.0]) if mirror > 0.0 else np.array([0.55 * L, 0.0])
    line = ScanLine(start, np.array([mirror, 0.0]), 0.35 * L, periodic=False)
    surface = Surface(Sinusoid(1e-4, L), "A", K, D)
    sides = columns.sample_curl_integrals(surface, line)
    assert abs(sides[0] - sides[1]) > 0.1 * max(sides)
    loop = leak._column_leak(surface, [line])
    assert loop.energy == pytest.approx(max(sides), rel=1e-3)
    assert loop.energy <= loop.upper_per_period <= loop.energy * 1.01


def test_nearest_outlines_of_both_signs_differ() -> None:
    surface = Surface(SAW, "E", K, D)
    (first, up, _), (second, down, _) = leak._nearest_outlines(surface, SAW.scan_line())
    assert first != second
    assert abs(up[:, 0].mean() - down[:, 0].mean()) > 0.05 * L
    for polygon in (up, down):
        along = polygon[:, :2] @ ACROSS / SAW.scan_line().length * 512
        assert np.abs(along - np.round(along)).max() < 1e-6
    loop = worst_loop(surface)
    assert "nearer than 0.3 mm" in loop.description


@pytest.mark.parametrize("letter", ["A", "E"])
def test_outline_estimate_is_the_curl_integral_inside(letter: str) -> None:
    """∬|∂f_t/∂z - ∂f_z/∂t| over one sign, within max_depth of the law's contact surface."""
    texture = Sinusoid(0.1e-3, L)
    surface = Surface(texture, letter, K, D)
    line = texture.scan_line()
    t = (np.arange(400) + 0.5) / 400 * line.length
    z = np.arange(-0.6e-3, 0.1e-3, 2e-6)
    x, height = (part.ravel() for part in np.meshgrid(t, z, indexing="ij"))
    points = np.column_stack([line.start + x[:, None] * line.direction, height])
    jacobian = surface.jacobian(points)
    curl = jacobian[:, :2, 2] @ line.direction - jacobian[:, 2, :2] @ line.direction
    if letter == "A":  # the vertical depth is larger than the distance in E
        estimates = columns.sample_curl_integrals(surface, line)
        depth = surface.law.contact.depth(texture, points)
        curl = np.where(depth <= D, curl, 0.0)
    else:
        estimates = tuple(one[0] for one in leak._nearest_outlines(surface, line))
        closest_points = texture.nearest(points)
        near = np.linalg.norm(closest_points - points, axis=1) <= D
        curl = np.where(near & (height <= texture.height(points[:, :2])), curl, 0.0)
    area = line.length / 400 * 2e-6
    expected = [float(np.maximum(sign * curl, 0.0).sum()) * area for sign in (1.0, -1.0)]
    assert sorted(estimates) == pytest.approx(sorted(expected), rel=0.02)


def test_scaled_leak_multiplies_energies_and_rounds_its_bound_up() -> None:
    loop = worst_loop(Surface(SAW, "A", K, D))
    assert loop.scale(1.0) is loop
    for factor in (2.0, 0.3):
        other = loop.scale(factor)
        assert other.energy == loop.energy * factor
        assert loop.thrust is not None
        assert other.thrust == loop.thrust * factor
        assert other.upper_per_period == math.nextafter(loop.upper_per_period * factor, math.inf)
    nothing = worst_loop(Surface(SAW, "C", K, D)).scale(3.0)
    assert (nothing.energy, nothing.upper_per_period) == (0.0, 0.0)
    assert worst_loop(FRICTION).scale(2.0).thrust is None


def test_loop_energy_above_the_proved_bound_raises() -> None:
    """The tolerance is K Δ²/8 in depth, 1e-12 of each edge's work and rounding of each force."""
    surface, line = Surface(SAW, "A", K, D), SAW.scan_line()
    vertices = columns.curl_region_loop(surface, line, 1.0)
    edges = np.linalg.norm(vertices - np.roll(vertices, -1, axis=0), axis=1)
    steps = np.hypot(*(vertices[1:] - vertices[:-1])[:, :2].T).max()
    bounds = columns.curl_integral_bounds(surface, line, SAW.bounds[1] * steps**2 / 8.0)
    assert bounds is not None
    force = max(float(np.linalg.norm(one)) for one in surface.force(vertices))
    height = 1.0 + max(abs(part) for part in SAW.extremes) / D
    error = len(edges) * 1e-12 + 2.0**-28 * height
    most = max(high for _low, high in bounds) + error * force * float(edges.sum())
    leak._check_against_bound(surface, line, vertices, most * (1.0 - 1e-12))
    with pytest.raises(InternalError, match=f"a loop of {len(edges)} edges gains"):
        leak._check_against_bound(surface, line, vertices, most * (1.0 + 1e-12))


def test_orient_loop_returns_the_direction_that_gains() -> None:
    surface = Surface(SAW, "A", K, D)
    loop = columns.curl_region_loop(surface, SAW.scan_line(), 1.0)
    for vertices in (loop, loop[::-1]):
        result, energy = leak.orient_loop(surface, np.ascontiguousarray(vertices))
        assert energy > 0.0
        assert loop_work(surface, result) == pytest.approx(energy, rel=1e-12)
    empty, nothing = leak.orient_loop(surface, loop[:1])
    assert (empty.shape, nothing) == ((0, 3), 0.0)


# --- a law with state -----------------------------------------------------------------------------


FRICTION = Surface(Sinusoid(0.4e-3, L), "F", K, D, max_deflection=0.5e-3)


def test_edge_is_split_at_every_crest_it_passes() -> None:
    """At half the amplitude over ten periods, sin = 1/2 at 1/12 and 5/12 of each period."""
    surface = Surface(Sinusoid(0.2e-3, L), "A", K, D)
    for first, last in ((-5, 5), (3, 13)):
        start, end = np.array([first * L, 0.0, 1e-4]), np.array([last * L, 0.0, 1e-4])
        parts = anchor._contact_intervals(surface, start, end, L)
        cuts = [(n + part) * L for n in range(first, last) for part in (1 / 12, 5 / 12)]
        assert [part[1][0] for part in parts[:-1]] == pytest.approx(cuts, abs=1e-12)
        assert [part[0][0] for part in parts[1:]] == pytest.approx(cuts, abs=1e-12)
        assert [inside for _a, _b, inside in parts] == [False, True] * 10 + [False]
        np.testing.assert_array_equal((parts[0][0], parts[-1][1]), (start, end))


def test_friction_paths_are_those_of_the_paper() -> None:
    start, along = np.array([1e-4, 2e-4]), np.array([0.6, 0.8])
    end = start + 0.5e-3 * along
    above, light = 0.1 * D, 1e-6 * D
    expected = [[*start, above], [*start, -light], [*end, -light], [*end, -D], [*start, -D]]
    np.testing.assert_allclose(leak.friction_path(FRICTION, start, along), expected)
    line = FRICTION.texture.scan_line()
    loop = leak.light_then_deep_loop(FRICTION, line)
    works = [
        loop_work(FRICTION, leak.friction_path(FRICTION, one, sign * line.direction))
        for one in line.points(64)
        for sign in (1.0, -1.0)
    ]
    assert loop.energy == max(works)
    assert loop.energy == loop_work(FRICTION, loop.vertices)
    assert "worst of 128 starts: 0.5 mm along" in loop.description
    assert "back at 0.3 mm" in loop.description


def test_in_plane_loop_tries_the_outlines_with_the_best_estimates() -> None:
    """The four best estimates of 64 places and both directions are evaluated."""
    line = FRICTION.texture.scan_line()
    loop = leak.in_plane_loop(FRICTION, line)
    outlines = [
        leak._in_plane_outline(FRICTION, line, start, sign)
        for start in line.points(64)
        for sign in (1.0, -1.0)
    ]
    outlines.sort(key=lambda one: one[0])
    works = [loop_work(FRICTION, vertices) for _, vertices in outlines[-4:]]
    assert loop.energy == pytest.approx(max(works), rel=1e-12)
    assert loop.energy > 1.4 * max(loop_work(FRICTION, outlines[i][1]) for i in range(4))
    assert "0.3 mm" in loop.description


def test_in_plane_outline_stays_within_max_deflection() -> None:
    """The outline lies at one depth, on the side that the sign of the slope selects."""
    line, anchor = FRICTION.texture.scan_line(), np.array([0.3e-3, 0.0])
    for sign in (1.0, -1.0):
        estimate, vertices = leak._in_plane_outline(FRICTION, line, anchor, sign)
        np.testing.assert_allclose(vertices[0], [*anchor, 0.1 * D])
        np.testing.assert_allclose(vertices[1], [*anchor, -D])
        np.testing.assert_allclose(vertices[-1], [*anchor, -D])
        away = vertices[1:, :2] - anchor
        size = np.linalg.norm(away, axis=1)
        assert size.max() < 0.5e-3
        assert size.max() > 0.4999e-3
        across = np.array([-line.direction[1], line.direction[0]])
        t, side = away @ line.direction, away @ across
        slope = FRICTION.texture.gradient(vertices[1:, :2]) @ line.direction
        inner = (np.abs(side) > 1e-9) & (np.abs(slope) > 1e-6)
        assert (np.sign(side[inner]) == sign * np.sign(slope[inner])).all()
        assert inner.sum() == 127
        steps = np.linspace(-0.5e-3, 0.5e-3, 129)
        np.testing.assert_allclose(np.unique(np.round(t * 1e12)), np.round(steps * 1e12), atol=600)
        # ∬ |h'| |side| across: proportional to the squared half width of the circle.
        h = np.abs(FRICTION.texture.gradient(anchor + steps[:, None] * line.direction)[:, 0])
        expected = float((h * (0.25e-6 - steps**2)).sum())
        assert estimate == pytest.approx(expected, rel=1e-6)


# --- merit ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("letter", "ABCDEGW")
def test_merit_is_the_ripple_and_mean_slope_along_the_scan(letter: str) -> None:
    """Strength, support and lost contact are recomputed from points along the line."""
    texture = Sinusoid(0.2e-3, L, 0.4, (0.6, 0.8)) if letter != "D" else Sinusoid(2e-5, L)
    surface = Surface(texture, letter, K, 0.25e-3)
    result, line = scan_module.merit(surface), texture.scan_line()
    t = (np.arange(2048) + 0.5) / 2048 * line.length
    xy = line.start + t[:, None] * line.direction
    height = surface.law.contact.extremes(texture)[1] - 0.25e-3
    points = np.column_stack([xy, np.full(len(t), height)])
    force, jacobian = surface.force_and_jacobian(points)
    ripple = math.sqrt(float(force.var(axis=0).sum())) / K
    assert result.height == pytest.approx(height, rel=1e-12)
    assert result.ripple == pytest.approx(ripple, rel=1e-6, abs=1e-12)
    assert result.strength == pytest.approx(
        ripple / (result.gain * line.length), rel=1e-6, abs=1e-9
    )
    support = float(-jacobian[:, 2, 2].mean()) / K / result.gain
    assert result.support == pytest.approx(support, rel=1e-6)
    lost = float((force == 0.0).all(axis=1).mean())
    assert result.contact_lost == pytest.approx(lost, abs=1.0 / 1024)


@pytest.mark.parametrize("stiffness", [1e-3, 1.0, 1e6])
def test_ripple_below_rounding_is_zero(stiffness: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """A ripple of 1e-13 of the force counts as zero, one of 1e-11 does not, at any force."""
    for part, is_counted in ((1e-13, False), (1e-11, True)):
        for size in (1e-6, 1.0, 1e6):

            def scan(*_scan: Any, part: float = part, size: float = size) -> Any:
                forces = np.zeros((1, 4, 3))
                forces[0, :, 2] = size * (1.0 + part * np.array([1.0, -1.0, 1.0, -1.0]))
                return forces, np.ones((1, 4)), 0.0

            monkeypatch.setattr(scan_module, "_scan_forces_and_slopes", scan)
            result = scan_module.merit(Surface(SAW, "A", stiffness, D))
            assert (result.ripple > 0.0) is is_counted
            if is_counted:
                assert result.ripple == pytest.approx(part * size, rel=1e-3)


def test_round_up_to_three_digits_never_decreases() -> None:
    for value in 10.0 ** RNG.uniform(-3, 6, 500):
        rounded = round_up(value)
        digits = 10.0 ** (math.floor(math.log10(value)) - 2)
        assert value * (1.0 - 1e-11) <= rounded <= value + digits * (1.0 + 1e-9)
        assert abs(rounded / digits - round(rounded / digits)) < 1e-6
    assert round_up(1230.0) == 1230.0
    assert round_up(1230.0 * (1.0 + 1e-9)) == 1240.0
    assert round_up(0.0) == 0.0


def test_panel_count_on_a_plane_is_at_least_one() -> None:
    """The wavelength is infinite; the count is 1 even for 10⁶ edges."""
    assert [loops._panel_count(1e-3, np.inf, edges) for edges in (1, 10**6)] == [4, 1]

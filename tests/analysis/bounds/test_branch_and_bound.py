"""Branch and bound, the bounded Jacobian measures, and the maximization problems of the laws."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from asperity.analysis.bounds.bound import (
    CURL,
    NORM,
    ONE_SIDED,
    JacobianMeasure,
    curl_norm,
    precise_norm,
    precise_one_sided,
)
from asperity.analysis.bounds.branch_and_bound import Problem, Supremum, polish, supremum
from asperity.analysis.bounds.sampling import HeightProblem
from asperity.analysis.gain.medial_axis import crest_curvature
from asperity.analysis.gain.proofs import (
    CrestProblem,
    FrictionProblem,
    NormalChangeProblem,
    SlopeProblem,
    largest_singular_value,
    largest_symmetric_eigenvalue,
)
from asperity.core.checks import FloatArray
from asperity.core.errors import InternalError
from asperity.enclosures.cells import Cells
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Sinusoid, Texture

NUMBERS = [NORM, ONE_SIDED, CURL]
EXACT = {"norm": precise_norm, "one-sided": precise_one_sided, "curl": curl_norm}


def parametrize_measures(numbers: list[JacobianMeasure]) -> Any:
    return pytest.mark.parametrize("number", numbers, ids=lambda number: number.name)


# --- bounds of measures over cells ----------------------------------------------------------------


def random_cells(
    rng: np.random.Generator, n: int, d: int, unknown: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    c = rng.normal(size=(n, 3, 3)) * 10.0 ** rng.uniform(-3, 3, (n, 1, 1))
    size = np.linalg.norm(c, axis=(1, 2))[:, None, None]
    g = rng.normal(size=(d, n, 3, 3)) * size * 10.0 ** rng.uniform(-6, 0, (n, 1, 1))
    return c, g, unknown * size * rng.random((n, 3, 3))


def worst_of(number: JacobianMeasure, c: FloatArray, g: FloatArray, e: FloatArray) -> FloatArray:
    """Return the largest value at the corners, with the error ``e`` in its worst direction."""
    best = np.full(len(c), -np.inf)
    for corner in range(2 ** len(g)):
        signs = np.array([1.0 if corner >> axis & 1 else -1.0 for axis in range(len(g))])
        middle = c + np.einsum("d,dnij->nij", signs, g)
        for push in _pushes(number, middle):
            best = np.maximum(best, EXACT[number.name](middle + e * push))
    return best


def _pushes(number: JacobianMeasure, middle: FloatArray) -> Iterator[FloatArray]:
    if number is CURL:
        for signs in np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T:
            skew = np.zeros((3, 3))
            skew[[2, 0, 1], [1, 2, 0]], skew[[1, 2, 0], [2, 0, 1]] = signs, -signs
            yield skew
        return
    u, _s, v = np.linalg.svd(middle)
    yield np.sign(u[:, :, :1] @ v[:, :1, :])
    values, vectors = np.linalg.eigh(-0.5 * (middle + np.swapaxes(middle, 1, 2)))
    top = vectors[:, :, -1:]
    yield -np.sign(top @ np.swapaxes(top, 1, 2))
    assert (values[:, -1] >= values[:, 0]).all()


@parametrize_measures(NUMBERS)
@pytest.mark.parametrize("d", [0, 1, 2, 3])
@pytest.mark.parametrize("unknown", [0.0, 1e-6, 0.1])
def test_upper_bounds_hold_at_the_worst_point_of_a_cell(
    number: JacobianMeasure, d: int, unknown: float
) -> None:
    rng = np.random.default_rng(d)
    c, g, e = random_cells(rng, 400, d, unknown)
    worst = worst_of(number, c, g, e)
    for above in (-np.inf, float(np.median(worst)), np.inf):
        bound = number.upper_bounds(c, g, e, above)
        assert (bound >= worst).all()
        # Above the threshold it exceeds the corner values by the error and rounding only.
        close = bound > above
        corners = worst_of(number, c, g, 0.0 * e)
        size = np.linalg.norm(c, axis=(1, 2)) + np.linalg.norm(g, axis=(2, 3)).sum(axis=0)
        most = corners + math.sqrt(2.0) * 1.1 * np.linalg.norm(e, axis=(1, 2)) + 2e-7 * size
        assert (bound[close] <= most[close]).all()


def test_curl_bound_uses_a_lipschitz_constant_above_one() -> None:
    """A change of 1 in two entries has matrix norm √2 and changes the curl by 2."""
    c, g, e = np.zeros((1, 3, 3)), np.zeros((0, 1, 3, 3)), np.zeros((1, 3, 3))
    c[0, 0, 1], c[0, 1, 0] = 3.0, -3.0
    e[0, 0, 1] = e[0, 1, 0] = 1.0
    assert CURL.upper_bounds(c, g, e, 0.0)[0] == pytest.approx(8.0, rel=1e-9)
    assert replace(CURL, lipschitz=1.0).upper_bounds(c, g, e, 0.0)[0] < 8.0 - 0.5


@parametrize_measures(NUMBERS)
def test_bounds_tightened_by_1e_6_are_exceeded(number: JacobianMeasure) -> None:
    c, g, e = random_cells(np.random.default_rng(4), 200, 2, 0.0)
    worst = worst_of(number, c, g, e)
    tight = number.upper_bounds(c, g, e, 0.0) * (1.0 - 1e-6)
    assert (tight < worst).mean() > 0.5


@parametrize_measures([NORM, ONE_SIDED])
def test_accurate_bound_resolves_nearly_equal_eigenvalues(number: JacobianMeasure) -> None:
    """Near diag(1, 1, 0) the closed form of an eigenvalue has only half of the digits."""
    rng = np.random.default_rng(3)
    base = -np.diag([1.0, 1.0, 0.0])
    c = base + 1e-9 * rng.normal(size=(300, 3, 3))
    empty, exact = np.zeros((0, 300, 3, 3)), EXACT[number.name](c)
    bound = number.upper_bounds(c, empty, np.zeros_like(c), 1.0 + 1e-9)
    assert (bound >= exact).all()
    assert (bound <= np.maximum(exact, 1.0) * (1.0 + 2e-7)).all()
    sure = number.upper_bounds(c, empty, np.zeros_like(c), 1.0)
    assert np.median(sure / exact - 1.0) < 1e-12


@parametrize_measures(NUMBERS)
def test_non_finite_values_have_infinite_bounds(number: JacobianMeasure) -> None:
    c, g, e = random_cells(np.random.default_rng(4), 5, 1, 0.0)
    e[0, 1, 1] = np.inf
    c[1, 0, 0], g[0, 2, 0, 0], e[3, 0, 0] = np.nan, np.nan, np.nan
    with np.errstate(all="ignore"):
        bound = number.upper_bounds(c, g, e, 0.0)
        huge = number.upper_bounds(c * 1e200, g * 1e200, 0.0 * c, 0.0)
    assert np.isposinf(bound[:4]).all()
    assert np.isfinite(bound[4])
    assert np.isposinf(huge[[0, 4]]).all()  # the squares overflow


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("number", [NORM, ONE_SIDED])
def test_upper_bound_holds_just_above_and_below_the_threshold(
    number: JacobianMeasure, sign: float
) -> None:
    """Minus the identity with error 1e-8: the bound includes the error and rounding."""
    c, g = -np.eye(3)[None], np.zeros((1, 1, 3, 3))
    for unknown in (0.0, 1e-8):
        e = unknown * np.eye(3)[None]
        reached = float(number.accurate(c - e)[0])
        result = float(number.upper_bounds(c, g, e, threshold=1.0 + sign * 1e-9)[0])
        assert reached + 0.9e-14 <= result <= 1.0 + 2.0 * unknown + 1e-13


def test_cells_with_overflowing_corners_get_the_coarse_bound() -> None:
    """The number at the centre of the cell is finite; at the corners it is NaN."""
    c = np.diag([2e51, 1e51, 1e51])[None]
    still, empty = np.zeros_like(c), np.zeros((0, 1, 3, 3))
    assert np.isfinite(NORM.upper_bounds(c, empty, still, 0.0)).all()
    with np.errstate(all="ignore"):
        assert NORM.upper_bounds(c, 2.0 * c[None], still, 0.0)[0] >= 6e51


def test_accurate_measures_of_non_finite_matrices_are_nan() -> None:
    matrices = np.stack([np.eye(3), np.full((3, 3), np.nan), -2.0 * np.eye(3)])
    for measure, expected in ((precise_norm, [1, np.nan, 2]), (precise_one_sided, [-1, np.nan, 2])):
        np.testing.assert_array_equal(measure(matrices), expected)


# --- the search -----------------------------------------------------------------------------------


class Unit(Cells):
    """The unit cube, divided into ``count`` cells per axis."""

    default_gap = 1e-6

    def __init__(self, dimensions: int, count: int = 4) -> None:
        self.dimensions, self._count = dimensions, count

    def initial_cells(self) -> tuple[Iterator[FloatArray], FloatArray]:
        ticks = (np.arange(self._count) + 0.5) / self._count
        axes = np.meshgrid(*[ticks] * self.dimensions, indexing="ij")
        centres = np.stack(axes, axis=-1).reshape(-1, self.dimensions)
        return iter(np.array_split(centres, 3)), np.full(self.dimensions, 0.5 / self._count)

    def sample_coordinates(self, count: int = 8) -> FloatArray:
        return np.random.default_rng(0).random((count, self.dimensions))

    def enclosures(self, *_arguments: Any) -> Any:
        raise NotImplementedError  # not used by this search

    derivatives = to_plane = enclosures

    def clip_to_region(self, coordinates: FloatArray) -> FloatArray:
        return np.clip(coordinates, 0.0, 1.0)


class Hill(Problem):
    """1 - |u - top|^p, with a bound from its largest slope, reduced by the fraction ``spoil``."""

    def __init__(self, top: FloatArray, power: float = 2.0, spoil: float = 0.0) -> None:
        self.cells, self._top, self._power = Unit(len(top)), top, power
        self._slope = power * math.sqrt(len(top)) ** (power - 1.0)
        self._spoil, self.evaluated = spoil, 0

    def values(self, coordinates: FloatArray) -> FloatArray:
        distance = np.linalg.norm(coordinates - self._top, axis=1)
        return np.asarray(1.0 - distance**self._power)

    def upper_bounds(self, centres: FloatArray, half: FloatArray, threshold: float) -> FloatArray:
        self.evaluated += len(centres)
        rise = self._slope * float(np.linalg.norm(half)) * (1.0 - self._spoil)
        assert threshold >= self.floor
        return self.values(centres) + rise


@pytest.mark.parametrize("dimensions", [1, 2, 3])
@pytest.mark.parametrize("power", [1.0, 2.0])
def test_supremum_is_within_the_tolerance_of_the_exact_value(dimensions: int, power: float) -> None:
    top = np.array([0.3141, 0.7, 0.123456])[:dimensions]
    for tolerance in (1e-1, 1e-2, 1e-3):
        problem = Hill(top, power)
        result = supremum(problem, tolerance)
        assert result.lower <= 1.0 <= result.upper
        assert result.converged
        assert result.upper <= result.lower * (1.0 + tolerance) * (1.0 + 1e-15)
        assert result.cell_count == problem.evaluated
        assert result.at is not None
        assert problem.values(result.at[None])[0] == result.lower
        # An upper bound lowered by twice the gap is wrong.
        assert result.upper - 2.0 * (result.upper - result.lower) < 1.0 or result.lower == 1.0


def test_maximum_on_the_boundary_is_found() -> None:
    result = supremum(Hill(np.array([1.0, 0.0])), 1e-6)
    assert result.lower == pytest.approx(1.0, abs=1e-15)


def test_polishing_converges_to_the_maximum() -> None:
    for power, near in ((2.0, 1e-16), (1.0, 1e-10)):
        result = supremum(Hill(np.array([0.3141, 0.7]), power), 1e-2)
        assert 1.0 - result.lower <= near


def test_polishing_reduces_its_step_size() -> None:
    """Converges to 1e-8 from starts at large and small distances relative to the cell."""
    for top in ([0.3141, 0.7], [0.29997, 0.70003]):
        problem = Hill(np.array(top), 1.0)
        best, at = polish(problem, np.array([0.3, 0.7]), np.array([0.5, 0.5]), 0.0)
        assert 1.0 - best < 1e-8
        np.testing.assert_allclose(at, top, atol=1e-8)


def test_invalid_bounds_raise_an_internal_error() -> None:
    """Negative control: bounds from 5 % of the slope lie below the supremum."""
    with pytest.raises(InternalError, match="above the proved bound"):
        supremum(Hill(np.array([0.3141, 0.7]), 1.0, spoil=0.95), 1e-9, 10_000)


@pytest.mark.parametrize("limit", [1, 100, 1000])
def test_bounds_at_the_work_limit_are_valid_but_not_converged(limit: int) -> None:
    problem = Hill(np.array([0.3, 0.7, 0.1]), 1.0)
    result = supremum(problem, 1e-9, limit)
    assert not result.converged
    assert result.lower <= 1.0 <= result.upper
    assert result.cell_count <= max(limit, 64)


class Unknown(Hill):
    """A hill with bounds and values that are NaN in one half."""

    def upper_bounds(self, centres: FloatArray, half: FloatArray, threshold: float) -> FloatArray:
        return np.where(centres[:, 0] > 0.5, np.nan, super().upper_bounds(centres, half, threshold))

    def values(self, coordinates: FloatArray) -> FloatArray:
        return np.where(coordinates[:, 0] > 0.5, np.nan, super().values(coordinates))


def test_cells_with_nan_are_not_pruned() -> None:
    result = supremum(Unknown(np.array([0.3, 0.7])), 1e-3, 20_000)
    assert (result.upper, result.converged) == (math.inf, False)
    assert result.lower == pytest.approx(1.0, abs=1e-9)


def test_supremum_is_at_least_the_floor() -> None:
    problem = Hill(np.array([0.5]))
    problem.floor = 7.0
    assert supremum(problem, 1e-3) == Supremum(7.0, 7.0, None, 4, converged=True)


# --- the problems of the laws ---------------------------------------------------------------------

WAVES = Fourier([4e-4, 3e-4, 1e-4], [[2100.0, 300.0], [-500.0, 1700.0], [3100, -3100]], [0.4, 1, 2])
MAP = HeightMap(1e-4 * np.random.default_rng(2).normal(size=(7, 9)), (3e-4, 7e-4))
SINE = Sinusoid(0.4e-3, 1.5e-3, 0.7, (2.0, 1.0))


def problems(texture: Texture) -> list[Problem]:
    cells = texture.cells()
    assert cells is not None
    surface = Surface(texture, "F", max_depth=0.5e-3)
    return [
        SlopeProblem(cells, 1.0),
        SlopeProblem(cells, 0.0),
        NormalChangeProblem(cells, 1.0),
        CrestProblem(cells),
        CrestProblem(cells, 1e-5),
        FrictionProblem(surface, cells, largest_singular_value),
        FrictionProblem(surface, cells, largest_symmetric_eigenvalue),
    ]


@pytest.mark.parametrize("texture", [WAVES, MAP, SINE], ids=["waves", "map", "sinusoid"])
@pytest.mark.parametrize("level", [0, 2, 8])
def test_no_value_in_a_cell_exceeds_its_bound(texture: Texture, level: int) -> None:
    rng = np.random.default_rng(level)
    for problem in problems(texture):
        chunks, half = problem.cells.initial_cells()
        centres = np.concatenate(list(chunks))
        centres = centres[rng.integers(0, len(centres), 200)]
        fine = half / 2.0**level
        centres = centres - half + fine * (2.0 * rng.integers(0, 2**level, centres.shape) + 1.0)
        bounds = problem.upper_bounds(centres, fine, 0.0)
        best = np.zeros(len(centres))
        for _ in range(20):
            xi = rng.choice([-1.0, -0.4, 0.3, 1.0], centres.shape)
            best = np.maximum(best, problem.values(centres + fine * xi))
        assert (best <= bounds * (1.0 + 1e-14)).all()
        if level == 8:  # small cells have tight bounds
            assert np.median(bounds / np.maximum(best, problem.floor)) < 1.2


def test_slope_problem_values_are_gradient_norms() -> None:
    cells = WAVES.cells()
    assert cells is not None
    at = cells.sample_coordinates(20)
    slope = np.hypot(*WAVES.gradient(cells.to_plane(at)).T)
    np.testing.assert_allclose(SlopeProblem(cells, 1.0).values(at), slope, rtol=1e-12)
    whole = SlopeProblem(cells, 1.0).prune_threshold(2.0, 1e-3)
    assert math.hypot(1.0, whole) == pytest.approx(math.hypot(1.0, 2.0) * 1.001, rel=1e-14)


def test_crest_problem_values_are_principal_curvatures() -> None:
    cells = MAP.cells()
    assert cells is not None
    at = cells.sample_coordinates(200)
    expected = np.maximum(crest_curvature(MAP.derivatives(cells.to_plane(at))), 0.0)
    np.testing.assert_allclose(CrestProblem(cells).values(at), expected, rtol=1e-9, atol=1e-9)


def test_crest_search_stops_at_the_centre_of_curvature() -> None:
    cells = MAP.cells()
    assert cells is not None
    problem = CrestProblem(cells, 1e-3)
    assert problem.prune_threshold(2e3, 1e-6) == math.inf
    y = 1e-3 * problem.prune_threshold(800.0, 1e-6)
    assert y / (1.0 - y) == pytest.approx(4.0 * (1.0 + 1e-6), rel=1e-12)


def test_normal_change_rate_against_finite_differences() -> None:
    cells = WAVES.cells()
    assert cells is not None
    at = cells.sample_coordinates(10)
    xy, step = cells.to_plane(at), 1e-8

    def normal(points: FloatArray) -> FloatArray:
        w = np.column_stack([-WAVES.gradient(points), np.ones(len(points))])
        return np.asarray(w / np.linalg.norm(w, axis=1)[:, None])

    moves = [np.array([step, 0.0]), np.array([0.0, step])]
    turned = [(normal(xy + m) - normal(xy - m)) / (2 * step) for m in moves]
    expected = np.linalg.norm(np.stack(turned, axis=-1), 2, axis=(1, 2))
    np.testing.assert_allclose(NormalChangeProblem(cells, 1.0).values(at), expected, rtol=1e-6)


# --- law F in two entries -------------------------------------------------------------------------


def friction_jacobian(
    still: float, slope: FloatArray, depth: float, d: FloatArray, friction: float, sliding: bool
) -> FloatArray:
    """Return -J/k of law F for d_max = 1 from MATH section 3; still = 1 - m, slope = ∇m."""
    follow = np.eye(2)
    if sliding and d.any():
        follow -= np.outer(d, d) / (d @ d)
    result = np.zeros((3, 3))
    result[2, 2] = 1.0
    result[:2, :2] = friction * depth * (still * follow - np.outer(d, slope))
    result[:2, 2] = -friction * still * d
    return result


def test_two_entry_reduction_bounds_every_anchor_state() -> None:
    """The sticking anchor with the longest deflection against the slope attains the bound."""
    rng = np.random.default_rng(8)
    exceeded = {True: -math.inf, False: -math.inf}
    for _ in range(1500):
        still, depth, friction = rng.random(), 3.0 * rng.random(), 2.0 * rng.random()
        slope = rng.normal(size=2) * rng.random()
        size = float(np.hypot(*slope))
        a = np.array([friction * depth * (still + size)])
        b = np.array([friction * still])
        for measure, reduced in (
            (precise_norm, largest_singular_value),
            (lambda m: precise_one_sided(-m), largest_symmetric_eigenvalue),
        ):
            most = float(reduced(a, b)[0])
            best = friction_jacobian(still, slope, depth, -slope / size, friction, sliding=False)
            assert float(measure(best[None])[0]) == pytest.approx(most, rel=1e-12)
            for sliding in (False, True):
                angle, length = rng.uniform(0, 2 * math.pi), 1.0 if sliding else rng.random()
                d = length * np.array([math.cos(angle), math.sin(angle)])
                part = friction_jacobian(
                    still, slope, rng.random() * depth, d, friction, sliding=sliding
                )
                result = float(measure(part[None])[0])
                assert result <= most * (1.0 + 1e-12)
                exceeded[sliding] = max(exceeded[sliding], result - 0.999 * most)
    assert exceeded[True] > 0.0  # a bound a thousandth lower fails
    assert exceeded[False] > 0.0


def test_two_entry_formulas_equal_the_matrix_measures() -> None:
    rng = np.random.default_rng(9)
    a, b = rng.random(200) * 3, rng.random(200) * 3
    matrices = np.zeros((200, 3, 3))
    matrices[:, 0, 0], matrices[:, 0, 2], matrices[:, 2, 2] = a, b, 1.0
    np.testing.assert_allclose(largest_singular_value(a, b), precise_norm(matrices), rtol=1e-12)
    symmetric = precise_one_sided(-matrices)
    np.testing.assert_allclose(largest_symmetric_eigenvalue(a, b), symmetric, rtol=1e-12)


def test_height_supremum_has_only_a_lower_bound() -> None:
    texture = HeightMap(1e-4 * np.random.default_rng(3).normal(size=(8, 9)), 3e-4)
    result = supremum(HeightProblem(texture.sampling_cells()), 1e-3, work_limit=5000)
    low, high = texture.extremes
    assert low < result.lower <= high * (1.0 + 1e-14)
    assert (result.upper, result.converged) == (math.inf, False)

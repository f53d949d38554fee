"""Witnesses, samples and the components of the bound search, each compared with its definition."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from asperity.analysis.bounds import bound as witnesses
from asperity.analysis.bounds import branch_and_bound as search
from asperity.analysis.bounds import sampling
from asperity.analysis.bounds import sampling as dense
from asperity.analysis.bounds.bound import NORM, ONE_SIDED, Witness, one_sided, spectral_norm
from asperity.analysis.bounds.branch_and_bound import Problem
from asperity.analysis.bounds.problems import LawProblem
from asperity.analysis.bounds.sampling import highest_point, sample_supremum
from asperity.analysis.gain import proofs as forms
from asperity.core.checks import FloatArray
from asperity.core.errors import InternalError
from asperity.enclosures.cells import Cells
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid

WAVE = Sinusoid(0.13e-3, 0.9e-3, 0.4, (1.0, 2.0))
WAVES = Fourier([4e-4, 3e-4, 1e-4], [[2100.0, 300.0], [-500.0, 1700.0], [3100, -3100]], [0.4, 1, 2])
XY = np.array([0.21e-3, -0.34e-3])
DEPTH = 0.5e-3

# --- witnesses ------------------------------------------------------------------------------------


@pytest.mark.parametrize("far", [0.0, 400.0])
@pytest.mark.parametrize("letter", ["A", "D", "F"])
def test_witness_lies_strictly_inside_the_depth_range(letter: str, far: float) -> None:
    """The margin is 1e-9 of the maximum depth, or 1e-14 of the coordinates where that is larger."""
    surface = Surface(WAVE, letter, max_depth=DEPTH)
    xy = XY + far
    derivatives = WAVE.derivatives(xy[None])
    size = {"A": 0.0, "D": float(abs(xy).max()), "F": -abs(derivatives[0, 0])}[letter]
    least = max(1e-9 * DEPTH, 1e-14 * (abs(float(derivatives[0, 0])) + size))
    assert (least > 1e-9 * DEPTH) == (far > 0.0 and letter == "D")
    for depth, level in ((-1.0, least), (0.0, least), (0.3e-3, 0.3e-3), (1.0, DEPTH)):
        expected = surface.law.contact.probe_positions(xy[None], np.array([level]), derivatives)[0]
        np.testing.assert_array_equal(witnesses.probe_position(surface, xy, depth), expected)


def test_witness_stays_above_the_depth_clamp() -> None:
    for clamp, depth in (("none", DEPTH), ("whole", (1.0 - 1e-9) * DEPTH)):
        surface = Surface(WAVE, "A", max_depth=DEPTH, clamp=clamp)
        expected = float(WAVE.height(XY[None])[0]) - depth
        assert witnesses.probe_position(surface, XY, 1.0)[2] == pytest.approx(expected, rel=1e-14)


def test_witness_value_is_the_jacobian_measure_at_its_position() -> None:
    surface = Surface(WAVE, "F", max_depth=DEPTH, max_deflection=0.3e-3, stiffness=350.0)
    held = np.array([0.1e-3, -0.25e-3])
    for sliding in (False, True):
        witness = witnesses.witness_in_contact(surface, NORM, XY, 0.4e-3, held, sliding=sliding)
        matrix = surface.jacobian([witness.at], held[None], [sliding])[0] / 350.0
        assert witness.at == (*XY, -0.4e-3)
        assert witness.deflection == tuple(held)
        assert witness.sliding == sliding
        assert witness.value == pytest.approx(np.linalg.norm(matrix, 2), rel=1e-14)
        assert witness.size == pytest.approx(np.linalg.norm(matrix), rel=1e-14)
    plain = Surface(WAVE, "C", max_depth=DEPTH, stiffness=350.0, clamp="backed")
    for depth in (0.4e-3, 0.7e-3, 3e-3):
        seen = witnesses.witness_at_depth(plain, ONE_SIDED, XY, depth)
        matrix = plain.jacobian([seen.at])[0] / 350.0
        assert seen.at == pytest.approx((*XY, float(WAVE.height(XY[None])[0]) - depth), rel=1e-13)
        assert seen.size == pytest.approx(np.linalg.norm(matrix), rel=1e-14)
        top = np.linalg.eigvalsh(-0.5 * (matrix + matrix.T))[-1]
        assert seen.value == pytest.approx(top, rel=1e-14)
        assert seen.deflection is None


@pytest.mark.parametrize("letter", ["A", "D", "F"])
def test_witness_may_exceed_its_bound_by_rounding_error_only(letter: str) -> None:
    """The tolerance is 2⁸ round-off units, 2¹⁶ times that for heights, plus depth errors."""
    surface = Surface(WAVE, letter, max_depth=0.7e-3)
    at = (0.9, 2.5, 1e-3)
    height = abs(float(WAVE.height([at[:2]])[0]))
    size = {"A": height, "D": height + 2.5, "F": 0.0}[letter]
    for proved, norm in ((1.5, 1.0), (1.5, 2.5)):
        relative = 2.0**16 * (1.0 + height / 0.7e-3) + size / 0.7e-3 * (1.0 + proved)
        allowed = 2.0**-44 * relative * max(norm, proved)
        for part in (-1.0, 0.0, 0.999):
            value = proved + part * allowed
            result = witnesses.checked_upper_bound(surface, NORM, proved, Witness(value, norm, at))
            assert result == max(value, proved)
        for value in (proved + 1.001 * allowed, math.nan):
            state = Witness(value, norm, at, (1e-3, 2e-3)) if letter == "F" else None
            wrong = state or Witness(value, norm, at)
            if math.isnan(value):
                assert witnesses.checked_upper_bound(surface, NORM, proved, wrong) == proved
                continue
            with pytest.raises(InternalError, match="the norm of") as caught:
                witnesses.checked_upper_bound(surface, NORM, proved, wrong)
            assert ("deflection (0.001, 0.002) m" in str(caught.value)) == (letter == "F")


def test_number_of_a_theorem_is_attained_up_to_rounding() -> None:
    surface = Surface(WAVE, "A", max_depth=DEPTH)
    at = (*XY, 0.0)
    for value, lower in ((2.0 * (1.0 - 0.9e-13), 2.0), (2.0 * (1.0 - 1.2e-13), None), (1.0, None)):
        result = witnesses.checked_lower_bound(surface, NORM, 2.0, Witness(value, 1.0, at))
        assert result == (value if lower is None else lower)
    with pytest.raises(InternalError):
        witnesses.checked_lower_bound(surface, NORM, 2.0, Witness(2.1, 1.0, at))


def test_bound_from_theorem_reports_the_largest_witness() -> None:
    surface = Surface(WAVE, "B", max_depth=DEPTH)
    values = [
        witnesses.witness_in_contact(surface, NORM, XY, depth) for depth in (0.0, 0.2e-3, DEPTH)
    ]
    best = max(values, key=lambda one: one.value)
    bound = witnesses.bound_from_theorem(
        surface, NORM, 9.0, "theorem", "why", XY, [0.2e-3, DEPTH, 0.0]
    )
    assert (bound.lower, bound.upper, bound.at) == (best.value, 9.0, best.at)
    assert (bound.method, bound.note) == ("theorem", "why")


# --- parts of the search --------------------------------------------------------------------------


def test_cell_stencil_is_the_centre_and_the_corners() -> None:
    assert search._cell_stencil(1).tolist() == [[0.0], [-1.0], [1.0]]
    for d in (2, 3):
        star = search._cell_stencil(d)
        assert len(star) == 1 + 2**d == len(np.unique(star, axis=0))
        assert not star[0].any()
        assert (np.abs(star[1:]) == 1.0).all()


def test_cells_are_subdivided_into_equal_parts() -> None:
    """Few cells are divided into more than two parts per axis, up to 128 cells in total."""
    centres, half = np.array([[0.0, 10.0], [4.0, 30.0], [8.0, 50.0]]), np.array([0.5, 1.0])
    for chunk, pieces in ((16, 3), (32, 2), (1, 3), (10**6, 1)):
        result = list(search._subdivide(centres, half, 4, chunk))
        assert len(result) == pieces
        ticks = np.array([-3.0, -1.0, 1.0, 3.0])
        expected = [[x + a, y + b] for x, y in centres for a in 0.5 * ticks for b in ticks]
        np.testing.assert_array_equal(np.concatenate(result), expected)
    for d in (1, 2, 3, 4):
        for cells in (0, 1, 2, 3, 8, 9, 32, 33, 1000):
            parts = search._subdivision_count(cells, d)
            few = max(cells, 1)
            assert parts == 2 or few * parts**d <= 128
            assert few * (2 * parts) ** d > 128


def test_argmax_ignores_nan() -> None:
    assert search._argmax_ignoring_nan(np.array([1.0, math.nan, 3.0, 3.0, -math.inf])) == 2
    assert search._argmax_ignoring_nan(np.array([math.nan, -5.0])) == 1


class Line(Cells):
    """The unit interval in four cells."""

    dimensions, default_gap = 1, 1e-6

    def initial_cells(self) -> tuple[Any, FloatArray]:
        return iter([np.array([[0.125], [0.375], [0.625], [0.875]])]), np.array([0.125])

    def sample_coordinates(self, count: int = 8) -> FloatArray:
        return ((np.arange(count) + 0.5) / count)[:, None]

    def enclosures(self, *_arguments: Any) -> Any:
        raise NotImplementedError  # not used by this search

    derivatives = to_plane = enclosures

    def clip_to_region(self, coordinates: FloatArray) -> FloatArray:
        return np.clip(coordinates, 0.0, 1.0)


class Peaks(Problem):
    """Adjacent peaks of these heights, with an upper bound too low by the fraction ``short``."""

    def __init__(self, heights: FloatArray, short: float = 0.0) -> None:
        self.cells, self._heights, self._short = Line(), np.asarray(heights), short
        self.requests: list[FloatArray] = []

    def values(self, coordinates: FloatArray) -> FloatArray:
        self.requests.append(coordinates)
        place = np.clip(coordinates[:, 0], 0.0, 1.0 - 1e-12) * len(self._heights)
        index = place.astype(int)
        return np.asarray(self._heights[index] * (1.0 - (place - index - 0.37) ** 2))

    def upper_bounds(
        self,
        centres: FloatArray,
        half: FloatArray,  # noqa: ARG002 - of the interface
        threshold: float,  # noqa: ARG002 - of the interface
    ) -> FloatArray:
        return np.full(len(centres), self._heights.max() * (1.0 - self._short))


@pytest.mark.parametrize(("short", "noticed"), [(3e-9, False), (5e-9, True)])
def test_values_above_a_bound_by_more_than_rounding_raise(short: float, noticed: bool) -> None:
    """The tolerance is 2²⁴ round-off units, 3.7e-9."""
    problem = Peaks(np.array([1.0]), short)
    if noticed:
        with pytest.raises(InternalError, match="1 is attained, above the proved bound 1"):
            search.supremum(problem, 1e-12, 100)
    else:
        result = search.supremum(problem, 1e-12, 100)
        assert result.lower == result.upper == pytest.approx(1.0, abs=1e-15)


def test_sampled_supremum_climbs_from_the_best_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 65 536 samples the twelve largest start a local search; the upper bound is infinite."""
    heights, start_values = np.linspace(1.0, 2.0, 500), []

    def recorded_polish(*arguments: Any) -> Any:
        start_values.append(arguments[3])
        return search.polish(*arguments)

    monkeypatch.setattr(sampling, "polish", recorded_polish)
    problem = Peaks(heights)
    result = sample_supremum(problem)
    assert len(start_values) == 12
    assert start_values == sorted(Peaks(heights).values(Line().sample_coordinates(65_536)))[:-13:-1]
    assert (result.cell_count, result.upper, result.converged) == (65_536, math.inf, False)
    assert sum(len(points) for points in problem.requests[:16]) == 65_536
    assert result.lower == pytest.approx(2.0, rel=1e-12)
    assert result.at is not None
    assert problem.values(result.at[None])[0] == result.lower
    assert result.at[0] == pytest.approx((499 + 0.37) / 500, abs=1e-9)
    low = Peaks(heights)
    low.floor = 2.5
    nothing = sample_supremum(low)
    assert (nothing.lower, nothing.at) == (2.5, None)


@pytest.mark.parametrize("rises", [(), (0.0625,), (1.0, 0.25), (1.0,) * 60])
def test_step_sizes_of_local_search(rises: tuple[float, ...]) -> None:
    """The first step is two half-widths; it doubles after success and is divided by 512 otherwise.

    Each iteration tests five sizes, each a quarter of the previous one; the search ends at 1e-10
    or after fifty iterations.
    """
    problem, half, step_sizes = Peaks(np.array([1.0])), 0.01, []

    def values(points: FloatArray) -> FloatArray:
        # Symmetric about the current point.
        away = np.abs(points[:, 0] - points[:, 0].mean())
        sizes = np.unique(np.round(away / away.max(), 6))
        np.testing.assert_allclose(sizes, 4.0 ** np.arange(-4.0, 1.0), rtol=1e-3)
        step_sizes.append(away.max() / half)
        result = np.zeros(len(points))
        if len(step_sizes) <= len(rises):
            result[np.argmin(np.abs(away / away.max() - rises[len(step_sizes) - 1]))] = len(
                step_sizes
            )
        return result

    problem.values = values  # type: ignore[method-assign]  # records the evaluated points
    problem.cells.clip_to_region = lambda points: points  # type: ignore[method-assign]  # no clipping
    expected, step = [], 2.0
    for rise in rises[:50]:
        expected.append(step)
        step *= min(2.0 * rise, 1.0)
    while step >= 1e-10 and len(expected) < 50:
        expected.append(step)
        step /= 512.0
    best, _at = search.polish(problem, np.array([0.0]), np.array([half]), 0.0)
    assert best == float(min(len(rises), 50))
    np.testing.assert_allclose(step_sizes, expected, rtol=1e-6)


def test_highest_point_attains_the_maximum_height() -> None:
    for texture in (WAVE, WAVES):
        at = highest_point(texture)
        assert float(texture.height(at[None])[0]) == pytest.approx(texture.extremes[1], rel=1e-9)


# --- dense samples --------------------------------------------------------------------------------


def no_limit(surface: Surface) -> dense.DepthLimit:
    return lambda derivatives: np.full(len(derivatives), surface.max_depth)


@pytest.mark.parametrize(
    ("letter", "measure", "form"),
    [
        ("A", spectral_norm, forms.q_a),
        ("B", spectral_norm, forms.q_b),
        ("C", spectral_norm, forms.q_c),
        ("G", spectral_norm, forms.q_g),
        ("A", one_sided, forms.one_sided_a),
        ("C", one_sided, forms.q_c),
    ],
)
def test_dense_maximum_equals_the_closed_forms(letter: str, measure: Any, form: Any) -> None:
    surface = Surface(WAVE, letter, max_depth=0.3e-3)
    result = dense.dense_maximum(surface, measure, no_limit(surface))
    wave = WAVE.single_wave
    assert wave is not None
    assert result.value == pytest.approx(form(wave, 0.3e-3), rel=1e-12)
    probe = witnesses.probe_position(surface, np.array(result.xy), result.depth)
    matrix = surface.jacobian([probe])[0] / surface.stiffness
    exact = (NORM if measure is spectral_norm else ONE_SIDED).accurate(matrix[None])[0]
    assert exact == pytest.approx(result.value, rel=1e-6)


def test_dense_maximum_respects_the_depth_limit() -> None:
    """The number of law D grows with the depth; a negative limit leaves depth 0."""
    surface = Surface(WAVE, "D", max_depth=DEPTH)
    radius = WAVE.period**2 / (4.0 * math.pi**2 * WAVE.amplitude)
    for share in (0.6, 0.8):
        result = dense.dense_maximum(
            surface, spectral_norm, lambda d, share=share: np.full(len(d), share * radius)
        )
        assert result.value == pytest.approx(share / (1.0 - share), rel=1e-9)
        assert result.depth == pytest.approx(share * radius, rel=1e-9)
    assert dense.dense_maximum(surface, spectral_norm, lambda d: np.full(len(d), -1.0)).depth == 0.0


def test_samples_lie_at_cell_centres_or_on_grid_nodes() -> None:
    for texture in (WAVE, WAVES):
        points, spacing = dense.sample_fractions(texture)
        counts = texture.sample_counts()
        assert len(points) == math.prod(counts)
        np.testing.assert_allclose(spacing, 1.0 / np.array(counts), rtol=1e-15)
        np.testing.assert_allclose(points[0], 0.5 * spacing, rtol=1e-12)
        np.testing.assert_allclose(points[-1], 1.0 - 0.5 * spacing, rtol=1e-12)
    heights = 1e-4 * np.random.default_rng(2).normal(size=9)
    for line, last in (
        (Profile(heights, 3e-4, periodic=False), 1.0),
        (Profile(heights, 3e-4, periodic=True), None),
    ):
        points, spacing = dense.sample_fractions(line)
        assert points[0, 0] == 0.0
        assert points[-1, 0] == (last or pytest.approx(1.0 - spacing[0], rel=1e-12))
    plate = HeightMap(1e-4 * np.random.default_rng(2).normal(size=(7, 9)), (3e-4, 7e-4))
    result = dense.dense_maximum(
        Surface(plate, "A", max_depth=DEPTH), spectral_norm, lambda d: 0.0 * d[:, 0]
    )
    slope = math.sqrt(result.value**2 - 1.0)
    assert slope == pytest.approx(np.hypot(*plate.gradient([result.xy])[0]), rel=1e-9)


def test_each_block_of_samples_gives_one_candidate() -> None:
    """The best twelve of 256 blocks are returned in ascending order."""
    values = np.zeros(2560)
    values[[5, 7, 400, 2559, 1300]] = [3.0, 4.0, 1.0, 5.0, 2.0]
    result = dense._best_of_blocks(values)
    assert len(result) == 12
    assert result[-4:].tolist() == [400, 1300, 7, 2559]
    assert len(dense._best_of_blocks(np.arange(40.0))) == 12
    assert dense._best_of_blocks(np.arange(5.0)).tolist() == [0, 1, 2, 3, 4]


def test_worst_deflection_opposes_the_slope() -> None:
    surface = Surface(WAVE, "F", max_deflection=0.3e-3)
    deflection = dense.worst_deflection(surface, np.array([[3.0, -4.0], [0.0, 0.0], [0.0, 1e-9]]))
    expected = [[-0.18e-3, 0.24e-3], [-0.3e-3, 0.0], [0.0, -0.3e-3]]
    np.testing.assert_allclose(deflection, expected, rtol=1e-12)


# --- contacts of a law ----------------------------------------------------------------------------


def test_law_problem_covers_all_depths_and_anchor_states() -> None:
    """Depths are both ends if J is affine in the depth, else all; anchors stick or slide."""
    for letter, ends, coordinates in (
        ("A", (0.0, DEPTH), 1),
        ("D", (None,), 2),
        ("F", (0.0, DEPTH), 3),
    ):
        surface = Surface(WAVE, letter, max_depth=DEPTH)
        cells = WAVE.cells()
        assert cells is not None
        problem = LawProblem(surface, cells, NORM)
        at = problem.cells.sample_coordinates(400)
        assert problem.cells.dimensions == coordinates
        contacts = problem.contacts(at)
        slides = (False, True) if letter == "F" else (False,)
        assert [one.sliding for one in contacts] == [s for s in slides for _ in ends]
        for one, end in zip(contacts, [*ends] * len(slides), strict=True):
            if end is None:
                assert 0.0 <= one.depth.min() < 0.05 * DEPTH
                assert 0.95 * DEPTH < one.depth.max() <= DEPTH
            else:
                assert (one.depth == end).all()
            length = np.hypot(*one.deflection.T)
            longest = surface.parameter("max_deflection") if letter == "F" else 0.0
            assert (length <= longest * (1.0 + 1e-12)).all()
            if one.sliding:
                np.testing.assert_allclose(length, longest, rtol=1e-12)
        values = problem.values(at)
        xy = problem.cells.to_plane(at)
        best = np.zeros(len(at))
        for one in contacts:
            inside = np.clip(one.depth, 1e-9 * DEPTH, (1.0 - 1e-9) * DEPTH)
            probes = surface.law.contact.probe_positions(xy, inside, WAVE.derivatives(xy))
            state = (one.deflection, np.full(len(at), one.sliding)) if letter == "F" else ()
            matrices = surface.jacobian(probes, *state) / surface.stiffness
            best = np.maximum(best, np.linalg.norm(matrices, 2, axis=(1, 2)))
        if letter != "D":  # its probes may be nearer to another surface point
            np.testing.assert_allclose(values, best, rtol=1e-5)


def test_measures_of_vanishing_matrices_are_numbers() -> None:
    matrices = np.eye(3) * np.array([0.0, 1e-200, 1e-80, 1e-60])[:, None, None]
    matrices[:, 0, 1] = matrices[:, 1, 1]
    for measure in (spectral_norm, one_sided):
        values = measure(matrices)
        assert np.isfinite(values).all()
        np.testing.assert_allclose(values, 0.0, atol=1e-59)

"""Each component of a characteristic number compared with its definition, at generic geometry."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.analysis.gain.bound_checks import MEASURES, as_fourier

from asperity.analysis import characteristic_number
from asperity.analysis.bounds.bound import CURL, NORM, ONE_SIDED, precise_norm, precise_one_sided
from asperity.analysis.bounds.branch_and_bound import supremum
from asperity.analysis.bounds.problems import LawProblem
from asperity.analysis.gain import proofs as forms
from asperity.analysis.gain.medial_axis import crest_curvature, gain_above_crest, sharpest_crest
from asperity.analysis.gain.proofs import (
    FrictionProblem,
    largest_singular_value,
    largest_symmetric_eigenvalue,
)
from asperity.analysis.gain.theorems import derivative_bound, theorem_on
from asperity.enclosures.cells import Cells
from asperity.enclosures.taylor import TaylorModel
from asperity.surface import Surface
from asperity.textures import Fourier, Profile, Sinusoid
from asperity.textures.plane_waves import SingleWave

NUMBERS = {"norm": NORM, "one-sided": ONE_SIDED, "curl": CURL}
RNG = np.random.default_rng(77)
K = 2.0 * math.pi / 1e-3 * np.array([[0.6, 0.8], [1.2, 1.6], [1.8, 2.4]])
# A profile along (3, 4)/5 whose slope is steepest away from mean height and extremes.
LINES = Fourier([0.11e-3, 0.05e-3, 0.02e-3], K, [0.4, 2.0, -1.0])
WAVE = Sinusoid(0.13e-3, 0.9e-3, 0.4, (1.0, 2.0))

# --- numbers by theorem ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("letter", "name"),
    [
        ("A", "norm"),
        ("A", "one-sided"),
        ("A", "curl"),
        ("E", "norm"),
        ("E", "one-sided"),
        ("E", "curl"),
        ("G", "norm"),
        ("W", "norm"),
        ("W", "one-sided"),
    ],
)
@pytest.mark.parametrize("depth", [0.02e-3, 0.4e-3])
def test_number_by_theorem_equals_branch_and_bound_over_the_jacobian(
    letter: str, name: str, depth: float
) -> None:
    """The simplified problems are compared with branch and bound over the Jacobian."""
    surface = Surface(LINES, letter, max_depth=depth)
    cells = LINES.cells()
    assert cells is not None
    assert MEASURES[name][0](surface, tolerance=1e-3).sliding is False
    plain = supremum(LawProblem(surface, cells, NUMBERS[name]), 1e-6)
    bound = MEASURES[name][0](surface, tolerance=1e-6)
    assert plain.lower <= bound.upper * (1.0 + 1e-12)
    assert bound.lower <= plain.upper * (1.0 + 1e-12)
    assert bound.upper <= plain.upper * (1.0 + 3e-6)
    assert bound.lower >= plain.lower * (1.0 - 3e-6)


@pytest.mark.parametrize("depth", [0.03e-3, 0.5e-3])
def test_derivative_bounds_equal_the_formulas_of_math(depth: float) -> None:
    """MATH section 4 gives them from M >= |∇h| and K >= ‖Hess h‖ alone."""
    m, hessian = LINES.bounds
    assert m != pytest.approx(1.0, rel=0.1)
    kd = hessian * depth
    steep = math.hypot(1.0, m)
    expected = {"A": steep, "B": steep + kd, "C": 1.0 + m * m + kd, "G": max(1.0, kd)}
    for letter, value in expected.items():
        surface = Surface(LINES, letter, max_depth=depth)
        assert derivative_bound(surface, NORM) == pytest.approx(value, rel=1e-14)
        assert derivative_bound(surface, ONE_SIDED) == pytest.approx(value, rel=1e-14)
        assert derivative_bound(surface, CURL) == pytest.approx(2.0 * value, rel=1e-14)
    assert derivative_bound(Surface(LINES, "D"), NORM) == math.inf


def test_derivative_bound_of_friction_uses_the_largest_entries() -> None:
    """MATH: 2.84 for the paper's sinusoid, with a and b maximised separately."""
    paper = Surface(Sinusoid(0.8e-3, 1e-3), "F", max_depth=1e-3)
    assert derivative_bound(paper, NORM) == pytest.approx(2.84, abs=5e-3)
    options: dict[str, Any] = {"friction": 0.7, "max_deflection": 0.3e-3, "modulation_depth": 0.6}
    surface = Surface(LINES, "F", max_depth=0.4e-3, **options)
    (low, high), m = LINES.extremes, LINES.bounds[0]
    steep = 0.6 * m / (high - low)
    matrix = [[0.7 * 0.4e-3 * (0.8 / 0.3e-3 + steep), 0.7 * 0.8], [0.0, 1.0]]
    assert derivative_bound(surface, NORM) == pytest.approx(np.linalg.norm(matrix, 2), rel=1e-12)


def test_gain_above_height_is_constant_for_laws_w_e_and_h() -> None:
    """W and E have 1 at every height; H has the larger of 1 and its continuity."""
    for letter, options, expected in (
        ("W", {}, 1.0),
        ("E", {}, 1.0),
        ("H", {"continuity": 0.4}, 1.0),
        ("H", {"continuity": 2.5}, 2.5),
    ):
        surface = Surface(WAVE, letter, **options)
        above = theorem_on(surface).gain_above_height
        assert above is not None
        assert [above(surface, height) for height in (-1e-3, 0.0, 1e-3)] == [expected] * 3


# --- law F ----------------------------------------------------------------------------------------


def law_f_number_of_phase(surface: Surface, number: Any) -> Any:
    """Return the number of law F as a function of the phase of a wave, from MATH."""
    wave, m = surface.texture.single_wave, surface.texture.bounds[0]
    assert wave is not None
    mu, longest, swing = (
        surface.parameter(name) for name in ("friction", "max_deflection", "modulation_depth")
    )

    def at(phase: Any) -> Any:
        still = 0.5 * (1.0 - swing * np.sin(phase))  # 1 - m
        rise = 0.5 * swing * m / wave.amplitude * np.abs(np.cos(phase))
        a = mu * surface.max_depth * (still / longest + rise)
        return number(np.asarray(a), np.asarray(mu * still))

    return at


@pytest.mark.parametrize("number", [largest_singular_value, largest_symmetric_eigenvalue])
@pytest.mark.parametrize(
    ("deflection", "swing"),
    [(1e-3, 0.8), (0.2e-3, 0.8), (1e-9, 0.5), (5e-3, 1.0), (40e-6, 0.9), (1e-3, 0.05)],
)
def test_direct_bound_of_law_f_is_accurate_and_tight(
    number: Any, deflection: float, swing: float
) -> None:
    """Covers maxima from the trough (short deflections) to the flank; the bound is tight."""
    surface = Surface(
        WAVE, "F", max_depth=0.5e-3, friction=0.7, max_deflection=deflection, modulation_depth=swing
    )
    at = law_f_number_of_phase(surface, number)
    phases = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 4001)
    start = phases[int(np.argmax(at(phases)))]
    # Two finer grids around the maximum: the last step is 1e-9, its square is negligible.
    for width in (2e-3, 2e-6):
        near = np.clip(start + np.linspace(-width, width, 4001), phases[0], phases[-1])
        start = near[int(np.argmax(at(near)))]
    exact = float(at(start))
    cells = WAVE.cells()
    assert cells is not None
    bound = FrictionProblem(surface, cells, number).direct_bound()
    assert bound is not None
    assert bound.at is not None
    assert bound.converged
    assert bound.lower <= exact * (1.0 + 1e-13)
    assert bound.lower >= exact * (1.0 - 1e-11)
    assert exact <= bound.upper <= exact * (1.0 + 4e-6)
    assert float(at(bound.at[0] + WAVE.phase)) == pytest.approx(bound.lower, rel=1e-13)
    assert bound.cell_count == 1024


def test_cell_bounds_of_law_f_hold_and_are_tight() -> None:
    """On small cells the bounds exceed the largest sample by 1e-4 at most."""
    surface = Surface(LINES, "F", max_depth=0.5e-3, max_deflection=0.2e-3)
    cells = LINES.cells()
    assert cells is not None
    for number in (largest_singular_value, largest_symmetric_eigenvalue):
        problem = FrictionProblem(surface, cells, number)
        chunks, first = cells.initial_cells()
        centres, half = next(iter(chunks))[:20], 1e-3 * first
        upper = problem.upper_bounds(centres, half, 0.0)
        ticks = np.linspace(-1.0, 1.0, 41)[:, None] * half
        values = np.stack([problem.values(centres + tick) for tick in ticks]).max(axis=0)
        assert (values <= upper).all()
        assert (upper <= values * (1.0 + 1e-4)).all()


def test_number_of_law_f_equals_its_jacobian_at_the_worst_deflection() -> None:
    """The opposite deflection gives a smaller value."""
    options: dict[str, Any] = {"friction": 0.7, "max_deflection": 0.3e-3, "modulation_depth": 0.6}
    surface, deeper = (
        Surface(LINES, "F", max_depth=depth, stiffness=1.0, **options) for depth in (4e-4, 5e-4)
    )
    cells = LINES.cells()
    assert cells is not None
    at = cells.sample_coordinates(30)
    for number, measure in (
        (largest_singular_value, precise_norm),
        (largest_symmetric_eigenvalue, precise_one_sided),
    ):
        problem = FrictionProblem(surface, cells, number)
        values, (state,) = problem.values(at), problem.contacts(at)
        assert not state.sliding
        np.testing.assert_allclose(np.hypot(*state.deflection.T), 0.3e-3, rtol=1e-12)
        xy = cells.to_plane(at)
        points = np.column_stack([xy, -state.depth])  # the contact surface of F is the plane z = 0
        for sign, same in ((1.0, True), (-1.0, False)):
            stuck = deeper.jacobian(points, sign * state.deflection, np.zeros(30, bool))
            result = measure(stuck)
            assert (result <= values * (1.0 + 1e-12)).all()
            assert np.allclose(result, values, rtol=1e-9, atol=0.0) == same


class ConstantCell(Cells):
    """One cell with constant height and slopes within constant errors."""

    dimensions = 1

    def enclosures(self, _centres: Any, _half: Any, _names: Any) -> dict[str, Any]:
        still = np.zeros((1, 1))
        parts = {"h": (0.1e-3, 0.0), "hx": (0.0, 0.6), "hy": (0.0, 0.8)}
        return {n: TaylorModel(np.array([c]), still, np.array([e])) for n, (c, e) in parts.items()}

    initial_cells = sample_coordinates = derivatives = to_plane = clip_to_region = (
        enclosures  # not used by the problem
    )


def test_cell_bound_of_law_f_includes_the_slope_error() -> None:
    """The bound is rounded up from the value at the worst slope."""
    surface = Surface(LINES, "F", max_depth=50.0, friction=0.7, max_deflection=0.3e-3)
    problem = FrictionProblem(surface, ConstantCell(), largest_singular_value)
    worst = float(problem._entries(np.array([0.1e-3]), np.array([1.0]))[0])
    bound = float(problem.upper_bounds(np.zeros((1, 1)), np.ones(1), 0.0)[0])
    assert worst * (1.0 + 1e-13) < bound < worst * (1.0 + 2e-12)


def test_number_of_law_f_without_modulation() -> None:
    """Without modulation every phase has a = μ D/(2 d_max) and b = μ/2."""
    surface = Surface(
        WAVE, "F", max_depth=0.5e-3, friction=0.7, max_deflection=0.2e-3, modulation_depth=0.0
    )
    bound = characteristic_number(surface)
    exact = np.linalg.norm([[0.7 * 0.5 / 0.2 / 2.0, 0.35], [0.0, 1.0]], 2)
    assert bound.lower == pytest.approx(exact, rel=1e-12)
    assert bound.upper == pytest.approx(exact, rel=1e-5)


# --- closed forms ---------------------------------------------------------------------------------


def single_wave(amplitude: float, period: float) -> SingleWave:
    wave = Sinusoid(amplitude, period).single_wave
    assert wave is not None
    return wave


def random_waves(count: int) -> list[tuple[SingleWave, float]]:
    """Return random waves from gentle to steep, and depths from shallow to deep."""
    result = []
    for slope, hessian in 10.0 ** RNG.uniform(-1.5, 1.5, (count, 2)):
        period = 10.0 ** RNG.uniform(-4, -2)
        amplitude = slope * period / (2.0 * math.pi)
        depth = hessian * period**2 / (4.0 * math.pi**2 * amplitude)
        result.append((single_wave(amplitude, period), depth))
    return result


def slope_and_curvature(wave: SingleWave, depth: float, phase: Any) -> tuple[Any, Any]:
    """Return the slope, and the depth times the curvature, at phases."""
    rate = 2.0 * math.pi / wave.period
    return (
        wave.amplitude * rate * np.cos(phase),
        -depth * wave.amplitude * rate**2 * np.sin(phase),
    )


PHASES = np.linspace(-math.pi, math.pi, 20_001)


def test_q_of_law_c_is_the_largest_eigenvalue_of_its_jacobian() -> None:
    """-J/k = w wᵀ + δ Hess h with w = (-h', 1); eigenvalues at δ = 0 and at full depth."""
    for wave, depth in random_waves(150):
        slope, hessian = slope_and_curvature(wave, depth, PHASES)
        best = 1.0
        for part in (0.0, 1.0):
            a, d = slope * slope + part * hessian, 1.0
            root = np.hypot(0.5 * (a - d), slope)
            best = max(
                best,
                float(np.maximum(np.abs(0.5 * (a + d) + root), np.abs(0.5 * (a + d) - root)).max()),
            )
        value = forms.q_c(wave, depth)
        assert best <= value * (1.0 + 1e-12)
        assert value <= best * (1.0 + 1e-4)
        # It is attained at the returned phase.
        s, b = slope_and_curvature(wave, depth, forms.phase_c(wave, depth))
        at = np.linalg.norm([[s * s + b, -s], [-s, 1.0]], 2)
        assert at == pytest.approx(value, rel=1e-9)


def test_q_of_law_b_is_the_largest_norm_and_its_phase_attains_it() -> None:
    """-J/k = n wᵀ - δ ∂n/∂x e_xᵀ with w = (-h', 1) and n = w/|w|."""
    for wave, depth in random_waves(150):
        value = forms.q_b(wave, depth)

        def norm(phase: Any, part: float, wave: SingleWave = wave, depth: float = depth) -> Any:
            slope, hessian = slope_and_curvature(wave, depth, np.asarray(phase))
            w = np.stack([-slope, np.ones_like(slope)])
            s = np.hypot(*w)
            matrix = np.einsum("i...,j...->...ij", w / s, w)
            turn = np.stack([np.ones_like(slope), slope]) * (part * hessian / s**3)
            matrix[..., 0] += np.moveaxis(turn, 0, -1)
            return np.linalg.norm(matrix, 2, axis=(-2, -1))

        best = max(float(norm(PHASES[::10], part).max()) for part in (0.0, 0.5, 1.0))
        assert best <= value * (1.0 + 1e-12)
        assert value <= best * (1.0 + 1e-4)
        phase = forms.phase_b(wave, depth)
        assert max(norm(phase, 0.0), norm(phase, 1.0)) == pytest.approx(value, rel=1e-9)


def test_feasible_root_of_the_cubic_is_unique() -> None:
    """λ³ - (1 + G₁² + E²/4) λ² + (E²/2) λ - E²/4 = 0, λ > 1, E (λ - 1) <= 2 G₁ λ."""
    with_infeasible_roots = without_root = 0
    for wave, depth in random_waves(500):
        g = 2.0 * math.pi * wave.amplitude / wave.period
        e = 2.0 * math.pi * depth / wave.period
        roots = np.roots([1.0, -(1.0 + g * g + e * e / 4.0), e * e / 2.0, -e * e / 4.0])
        real = roots[np.abs(roots.imag) < 1e-9 * np.abs(roots)].real
        expected = [r for r in real if r > 1.0 and e * (r - 1.0) <= 2.0 * g * r]
        assert len(expected) <= 1
        result = forms._feasible_root(wave, depth)
        if expected:
            with_infeasible_roots += int((real > 1.0).sum()) > 1
            assert result == pytest.approx(expected[0], rel=1e-6)
            t = 1.0 / result
            assert abs(e * e / 4.0 * t * (1.0 - t) ** 2 + (1.0 + g * g) * t - 1.0) < 1e-14
        else:
            without_root += 1
            assert result == 0.0
            assert g * e > 1.0 + 2.0 * g * g
    assert with_infeasible_roots > 5
    assert without_root > 50


def test_closed_forms_of_the_curls_of_a_wave() -> None:
    """The curl of A is the largest slope, that of E the sine of the largest slope angle."""
    for wave, depth in random_waves(50):
        slope = float(np.abs(slope_and_curvature(wave, depth, PHASES)[0]).max())
        assert forms.curl_a(wave, depth) == pytest.approx(slope, rel=1e-12)
        sine = math.sin(math.atan(slope))
        assert forms.curl_e(wave, depth) == pytest.approx(sine, rel=1e-12)
        assert forms.one_sided_a(wave, depth) == pytest.approx(
            0.5 + 0.5 * math.hypot(1.0, slope), rel=1e-12
        )


def test_phases_of_the_steepest_flank_and_the_trough() -> None:
    wave = single_wave(0.3e-3, 1e-3)
    slope, hessian = slope_and_curvature(wave, 1.0, forms.phase_steepest(wave, 1e-3))
    assert slope == slope_and_curvature(wave, 1.0, PHASES)[0].max()
    assert hessian == 0.0
    _slope, hessian = slope_and_curvature(wave, 1.0, forms.phase_trough(wave, 1e-3))
    assert hessian == pytest.approx(slope_and_curvature(wave, 1.0, PHASES)[1].max(), rel=1e-12)


# --- crests ---------------------------------------------------------------------------------------


def test_crest_curvature_of_a_sphere_is_constant() -> None:
    """Where both curvatures are equal, rounding must not make the discriminant negative."""
    x, y = 0.7 * RNG.uniform(-1.0, 1.0, (2, 1000))
    z = np.sqrt(1.0 - x * x - y * y)
    ball = np.stack([z, -x / z, -y / z, -(1 - y * y) / z**3, -x * y / z**3, -(1 - x * x) / z**3], 1)
    np.testing.assert_allclose(crest_curvature(ball), 1.0, rtol=1e-6)
    np.testing.assert_allclose(crest_curvature(-ball), -1.0, rtol=1e-6)


@pytest.mark.parametrize("direction", [(1.0, 0.0), (1.0, 2.0), (-3.0, 1.0)])
@pytest.mark.parametrize("phase", [0.0, 1.1, -2.5])
def test_sharpest_crests_of_a_wave_and_of_its_fourier_form_agree(
    phase: float, direction: Any
) -> None:
    wave = Sinusoid(0.2e-3, 1.3e-3, phase, direction)
    radius = wave.period**2 / (4.0 * math.pi**2 * wave.amplitude)
    exact, result = sharpest_crest(wave), sharpest_crest(as_fourier(wave))
    assert exact is not None
    assert result is not None
    # The proved radius is at most the actual one, and lower by its tolerance at most.
    for crest, gap in ((exact, 1e-12), (result, 1e-4)):
        assert crest.radius * (1.0 - gap) <= crest.min_radius <= crest.radius
        assert crest.radius == pytest.approx(radius, rel=1e-6)
        closest_point, centre = np.array(crest.point), np.array(crest.centre)
        assert closest_point[2] == pytest.approx(wave.amplitude, rel=1e-6)
        assert float(wave.height([closest_point[:2]])[0]) == pytest.approx(
            closest_point[2], rel=1e-9
        )
        np.testing.assert_allclose(centre - closest_point, [0.0, 0.0, -radius], atol=2e-3 * radius)
        # The centre lies on the surface normal at the closest point.
        slope = wave.gradient([closest_point[:2]])[0]
        normal = np.array([-slope[0], -slope[1], 1.0]) / math.hypot(1.0, *slope)
        np.testing.assert_allclose(
            closest_point - crest.radius * normal, centre, atol=1e-12 * radius
        )


def test_centre_of_an_oblique_crest_lies_on_its_normal() -> None:
    """On a sloping crest, radius, point and centre belong to one circle."""
    x = np.linspace(0.0, 2.0 * math.pi, 40, endpoint=False)
    texture = Profile(1e-3 * (np.sin(x) + 0.4 * np.sin(3.0 * x + 1.0)), 4e-3 / 40, periodic=True)
    crest = sharpest_crest(texture)
    assert crest is not None
    closest_point, centre = np.array(crest.point), np.array(crest.centre)
    slope = float(texture.gradient([closest_point[:2]])[0, 0])
    assert abs(slope) > 1e-3
    normal = np.array([-slope, 0.0, 1.0]) / math.hypot(1.0, slope)
    np.testing.assert_allclose(
        closest_point - crest.radius * normal, centre, atol=1e-12 * crest.radius
    )
    hessian = float(texture.derivatives([closest_point[:2]])[0, 3])
    assert crest.radius == pytest.approx(-(math.hypot(1.0, slope) ** 3) / hessian, rel=1e-9)


def test_number_of_law_d_by_depth_relative_to_the_crest_radius() -> None:
    """Certified numbers equal y/(1 - y) within the tolerance."""
    crest = sharpest_crest(LINES)
    assert crest is not None
    bound = LINES.bounds[1]
    for y in (0.2, 0.45, 0.55, 0.8, 0.97):
        result = characteristic_number(Surface(LINES, "D", max_depth=y * crest.radius), 1e-6)
        exact = max(1.0, y / (1.0 - y))
        shallow = y * crest.radius * bound <= 0.5
        assert result.method == ("theorem" if shallow else "certified")
        assert result.lower == pytest.approx(exact, rel=1e-3)
        assert result.lower <= result.upper <= result.lower * (1.0 + 1.01e-6)
        height = crest.point[2] - y * (crest.point[2] - crest.centre[2])
        assert gain_above_crest(Surface(LINES, "D"), height) == pytest.approx(exact, rel=1e-9)
    half = next(d for d in (0.5 / bound, math.nextafter(0.5 / bound, 0.0)) if d * bound == 0.5)
    for depth, method in ((half, "theorem"), (half * (1.0 + 1e-9), "certified")):
        assert characteristic_number(Surface(LINES, "D", max_depth=depth)).method == method


def test_number_of_law_h_is_that_of_law_d_without_a_split() -> None:
    """The number is min(c, y/(1 - y)) from y = 1/2 on, and the witness attains it."""
    crest = sharpest_crest(WAVE)
    assert crest is not None
    for c in (1.5, 4.0):
        for y in (0.4, 0.55, 0.9 * c / (1.0 + c), c / (1.0 + c), 1.1 * c / (1.0 + c), 3.0):
            surface = Surface(WAVE, "H", max_depth=y * crest.radius, continuity=c)
            bound = characteristic_number(surface)
            exact = max(1.0, min(c, y / (1.0 - y) if y < 1.0 else math.inf))
            assert bound.upper == pytest.approx(exact, rel=1e-12)
            assert bound.upper >= exact
            assert bound.lower == pytest.approx(exact, rel=1e-4)
            assert ("too small" in bound.note) == (exact < c * (1.0 - 1e-12))


def test_number_of_law_h_is_continuous_at_the_split() -> None:
    """Below the onset by 1e-9 the two closest points coincide up to rounding."""
    for texture in (LINES, WAVE):
        crest = sharpest_crest(texture)
        assert crest is not None
        surface = Surface(texture, "H", max_depth=0.6 * crest.radius * (1.0 + 1e-9), continuity=1.5)
        bound = characteristic_number(surface)
        assert bound.upper == pytest.approx(1.5, rel=1e-12)
        assert bound.lower >= 1.5 * (1.0 - 3e-6)

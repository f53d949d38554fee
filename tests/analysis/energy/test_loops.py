"""The loops of the paper's Fig. 3 to 1e-8 of k A², and paths of a law with state."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from asperity.analysis import loop_work, worst_loop
from asperity.analysis.energy.field_energy import (
    TooSteepError,
    initial_panels,
    integrate,
    steady_work,
)
from asperity.core.errors import ParameterError
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import HeightMap

K, PERIOD, AMPLITUDE = 1000.0, 2e-3, 0.8e-3
TEXTURE = Sinusoid(amplitude=AMPLITUDE, period=PERIOD)
QUARTER = PERIOD / 4
FIGURE_3 = [[0, 0, 0], [QUARTER, 0, 0], [QUARTER, 0, AMPLITUDE], [0, 0, AMPLITUDE]]
TOLERANCE = 1e-8 * K * AMPLITUDE**2


def work(letter: str, path: object, **arguments: object) -> float:
    return loop_work(Surface(TEXTURE, letter, stiffness=K, **arguments), path)


def test_energy_of_law_a_is_half_k_a_squared() -> None:
    assert abs(work("A", FIGURE_3) - K * AMPLITUDE**2 / 2) < TOLERANCE


def test_energy_of_law_b_is_equation_12() -> None:
    root = math.sqrt(1 + 4 * math.pi**2 * AMPLITUDE**2 / PERIOD**2)
    expected = K * AMPLITUDE**2 / 2 + K * PERIOD**2 / (4 * math.pi**2) * (1 - root)
    assert abs(work("B", FIGURE_3) - expected) < TOLERANCE


@pytest.mark.parametrize("letter", "CD")
def test_energy_of_conservative_laws_is_zero(letter: str) -> None:
    assert abs(work(letter, FIGURE_3)) < TOLERANCE


def test_energy_of_law_e_is_the_integral_of_the_distance() -> None:
    def distance(z: float) -> float:
        probe = np.array([[QUARTER, 0.0, z]])
        return float(np.linalg.norm(TEXTURE.nearest(probe) - probe))

    # The distance has a kink where the closest point leaves the crest.
    kink = AMPLITUDE - PERIOD**2 / (4 * math.pi**2 * AMPLITUDE)
    expected = K * quad(distance, 0, AMPLITUDE, points=[kink], epsabs=1e-18, epsrel=1e-12)[0]
    assert abs(work("E", FIGURE_3) - expected) < TOLERANCE


def test_energy_of_law_g_is_the_arctangent_formula() -> None:
    a = 0.5e-3
    path = [[QUARTER, 0, a], [QUARTER, 0, -a], [3 * QUARTER, 0, -a], [3 * QUARTER, 0, a]]
    expected = K * a * PERIOD / math.pi * math.atan(2 * math.pi * AMPLITUDE / PERIOD)
    assert abs(work("G", path) - expected) < TOLERANCE


@pytest.mark.parametrize("light", [1e-4, 3e-4])
def test_energy_of_law_f_is_equation_27(light: float) -> None:
    """W_F = k μ (1 - m) d_max (D - a)/2 for constant m = 1/2 (modulation depth 0)."""
    deflection, depth = 0.7e-3, 1e-3
    path = [
        [0, 0, 1e-3],
        [0, 0, -light],
        [deflection, 0, -light],
        [deflection, 0, -depth],
        [0, 0, -depth],
    ]
    expected = K * 0.8 * 0.5 * deflection * (depth - light) / 2
    energy = work("F", path, modulation_depth=0.0, max_deflection=deflection)
    assert abs(energy - expected) < TOLERANCE


def test_reversed_loop_has_the_opposite_energy() -> None:
    assert work("A", FIGURE_3[::-1]) == pytest.approx(-work("A", FIGURE_3), abs=1e-18)


def test_starting_vertex_does_not_matter_without_state() -> None:
    rotated = FIGURE_3[2:] + FIGURE_3[:2]
    assert work("B", rotated) == pytest.approx(work("B", FIGURE_3), abs=1e-17)


@pytest.mark.parametrize("letter", "ABCEG")
def test_loops_in_space_against_brute_force(letter: str) -> None:
    surface = Surface(_random_map(), letter, stiffness=K)
    rng = np.random.default_rng(5)
    vertices = rng.uniform(1e-3, 2e-3, (5, 3)) - [0, 0, 2e-3]
    path = np.concatenate(
        [
            np.linspace(a, b, 20_000, endpoint=False)
            for a, b in zip(vertices, np.roll(vertices, -1, axis=0), strict=True)
        ]
        + [vertices[:1]]
    )
    force = surface.force(path)
    trapezoid = float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(path, axis=0)))
    # The trapezoidal rule has an error of second order in steps of 1/20000 of an edge.
    assert loop_work(surface, vertices) == pytest.approx(trapezoid, abs=1e-11)


def test_god_object_gains_no_energy_across_its_ridges() -> None:
    """The force jumps along the path, the energy does not; law E is the negative control."""
    surface = Surface(_random_map(), "D", stiffness=K)
    rng = np.random.default_rng(7)
    scale = 0.5 * K * 1e-6
    for _ in range(5):
        vertices = rng.uniform(1e-3, 2e-3, (5, 3)) - [0, 0, 2e-3]
        assert abs(loop_work(surface, vertices)) < 1e-9 * scale
        control = loop_work(Surface(_random_map(), "E", stiffness=K), vertices)
        assert abs(control) > 1e-4 * scale


def _random_map() -> HeightMap:
    rng = np.random.default_rng(0)
    return HeightMap(rng.normal(size=(20, 30)) * 1e-4, (2e-4, 1.5e-4))


def test_friction_loop_is_the_limit_of_small_steps() -> None:
    surface = Surface(TEXTURE, "F", stiffness=K, max_deflection=0.4e-3)
    rng = np.random.default_rng(1)
    vertices = rng.uniform(-2e-3, 2e-3, (6, 3)) - [0, 0, 1.2e-3]
    vertices[0, 2] = 1e-3
    exact = loop_work(surface, vertices)
    errors = []
    for count in (2_000, 4_000):
        path = np.concatenate(
            [
                np.linspace(a, b, count, endpoint=False)
                for a, b in zip(vertices, np.roll(vertices, -1, axis=0), strict=True)
            ]
            + [vertices[:1]]
        )
        force = surface.trace(path)
        stepped = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(path, axis=0))
        errors.append(abs(stepped - exact))
    assert errors[1] < 1e-4 * abs(exact)
    assert math.log2(errors[0] / errors[1]) == pytest.approx(1.0, abs=0.5)  # first order


GROOVES = Sinusoid(0.2e-3, 1e-3, phase=0.3, direction=(3.0, 1.0))
FLAT = HeightMap(np.full((4, 5), 0.3e-3), 0.25e-3)


@pytest.mark.parametrize("letter", "ABCDEG")
@pytest.mark.parametrize("shift", [0.0, 1.0])
def test_work_along_grooves_is_zero_up_to_rounding(letter: str, shift: float) -> None:
    """Nothing but rounding acts along them: halving panels does not lower its error."""
    surface = Surface(GROOVES, letter, stiffness=K, max_depth=0.2e-3)
    path = [[shift, 0.0, -1e-4], [shift - 1e-3, 3e-3, -1e-4]]
    assert abs(loop_work(surface, path)) < 1e-12 * (1.0 + 1e3 * shift) * K * 0.2e-3 * 3e-3


@pytest.mark.parametrize("height", [1e-5, 1e-7, 1e-9])
def test_work_of_shallow_waves_scales_with_their_height(height: float) -> None:
    """Law A pushes upwards alone, in proportion to heights; the path leaves and enters contact."""

    def relative_work(size: float) -> float:
        surface = Surface(Sinusoid(size, 1e-3, phase=0.3), "A", stiffness=K, max_depth=2.0 * size)
        path = [[5e-5, 0.0, -0.3 * size], [3e-4, 2e-4, 1.4 * size], [7e-4, -1e-4, -0.8 * size]]
        return loop_work(surface, path) / (K * size**2)

    assert relative_work(height) == pytest.approx(relative_work(1e-3), rel=1e-12)


@pytest.mark.parametrize("letter", "ABCG")
def test_flat_map_has_no_leak_but_rounding(letter: str) -> None:
    surface = Surface(FLAT, letter, stiffness=K)
    assert surface.max_depth == 1e-3
    leak = worst_loop(surface)
    assert abs(leak.energy) < 1e-10 * K * 1e-6  # tolerances of the edges of its loop
    assert abs(leak.thrust or 0.0) < 1e-12 * K * 1e-3


def test_integrand_that_is_noise_alone_is_refused() -> None:
    noise = np.random.default_rng(5)
    with pytest.raises(TooSteepError, match="tolerance cannot be reached"):
        integrate(lambda s: noise.normal(size=len(s)), 4)
    assert abs(integrate(lambda s: noise.normal(size=len(s)), 4, rounding=10.0)) < 10.0


def test_initial_panels_are_two_per_wavelength() -> None:
    """2π M/K is the period of a sinusoid of any amplitude; a flat map has infinite wavelength."""
    for amplitude in (1e-6, AMPLITUDE):
        surface = Surface(Sinusoid(amplitude, PERIOD, direction=(1.0, 2.0)), "A")
        assert [initial_panels(surface, n * PERIOD) for n in (1.0, 50.2)] == [4, 101]
    flat = Surface(HeightMap(np.zeros((5, 5)), 1e-3), "A", max_depth=1e-3)
    assert initial_panels(flat, 1e3) == 4


@pytest.mark.parametrize(
    "vertices", [[[0, 0, 0]], [[0, 0], [1, 1]], [[0, 0, 0], [math.nan, 0, 0]], "no"]
)
def test_invalid_polygons_raise(vertices: object) -> None:
    with pytest.raises(ParameterError) as caught:
        work("A", vertices)
    assert caught.value.argument == "vertices"


@pytest.mark.parametrize("tolerance", [0.0, -1e-9, math.nan])
def test_unreachable_tolerances_raise(tolerance: float) -> None:
    """Panels would be halved until the memory is exhausted."""
    surface = Surface(Sinusoid(1e-4, 1e-3), "A")
    with pytest.raises(ParameterError) as caught:
        loop_work(surface, [[0.0, 0.0, -1e-4], [1e-4, 0.0, 0.0]], tolerance)
    assert caught.value.argument == "tolerance"


def test_loop_of_a_surface_with_friction_is_not_answered_without_it() -> None:
    """Its friction takes energy around the loop, which the field alone does not."""
    texture, corners = Sinusoid(1e-4, 2e-3), np.array([[0, 0, -5e-4], [3e-3, 0, -5e-4]])
    rubbing = Surface(texture, "C", stiffness=900.0, friction=0.4)
    for work in (loop_work, steady_work):
        with pytest.raises(ParameterError, match=r"surface has friction .* surface.trace\(path\)"):
            work(rubbing, corners)
        assert work(Surface(texture, "C", stiffness=900.0), corners) == pytest.approx(
            0.0, abs=1e-18
        )
    path = np.concatenate([np.linspace(*corners, 2001), np.linspace(*corners[::-1], 2001)[1:]])
    force = rubbing.trace(path)
    assert np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(path, axis=0)) < -0.2e-3

"""Closed forms of MATH section 4 compared with dense evaluation of the exact Jacobian."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from tests.helpers.reference import exact_jacobian

from asperity.analysis import characteristic_number, one_sided_number
from asperity.analysis.bounds.bound import one_sided, spectral_norm
from asperity.analysis.gain.proofs import largest_singular_value, q_c, q_d
from asperity.surface import Surface
from asperity.textures.kinds.fourier import Fourier
from asperity.textures.kinds.sinusoid import Sinusoid

PAPER = Sinusoid(amplitude=0.8e-3, period=1e-3)
GENTLE = Sinusoid(amplitude=0.1e-3, period=2e-3, phase=0.3, direction=(1.0, 2.0))
CASES = [(PAPER, 1e-3), (GENTLE, 0.1e-3), (GENTLE, 2e-3), (Sinusoid(0.2e-3, 1e-3), 0.02e-3)]


def dense_maximum(texture: Sinusoid, letter: str, depth: float, number: str) -> float:
    """Return the largest value of the compiled Jacobian on a dense grid of positions and depths."""
    surface = Surface(texture, letter, stiffness=1.0, max_depth=depth)
    t = np.linspace(0.0, texture.period, 4001)
    depths = depth * np.array([1e-9, 0.2, 0.4, 0.6, 0.8, 1.0])
    xy = np.outer(t, texture.direction)
    top = np.zeros(len(t)) if letter == "G" else texture.height(xy)
    points = np.concatenate([np.column_stack([xy, top - d]) for d in depths])
    jacobians = surface.jacobian(points)
    if number == "q":
        return float(np.linalg.norm(jacobians, 2, axis=(1, 2)).max())
    symmetric = -0.5 * (jacobians + np.swapaxes(jacobians, 1, 2))
    return float(np.linalg.eigvalsh(symmetric)[:, -1].max())


@pytest.mark.parametrize(("texture", "depth"), CASES)
@pytest.mark.parametrize("letter", "ABCG")
def test_q_is_the_largest_spectral_norm(texture: Sinusoid, depth: float, letter: str) -> None:
    bound = characteristic_number(Surface(texture, letter, max_depth=depth))
    reference = dense_maximum(texture, letter, depth, "q")
    assert bound.method == "closed form"
    # Grid error is of second order in the step of 1/4000 of a period.
    assert reference <= bound.upper * (1 + 1e-9)
    assert reference >= bound.upper * (1 - 1e-5)
    assert bound.lower == pytest.approx(bound.upper, rel=1e-12)


@pytest.mark.parametrize(("texture", "depth"), CASES)
@pytest.mark.parametrize("letter", "ABCG")
def test_one_sided_number_is_the_largest_eigenvalue(
    texture: Sinusoid, depth: float, letter: str
) -> None:
    bound = one_sided_number(Surface(texture, letter, max_depth=depth))
    reference = dense_maximum(texture, letter, depth, "q+")
    assert bound.method == ("closed form" if letter in "AC" else "certified")
    assert reference <= bound.value * (1 + 1e-9)
    assert reference >= bound.value * (1 - 1e-5)


@pytest.mark.parametrize("letter", "ABCFG")
def test_witness_attains_the_number(letter: str) -> None:
    """The exact Jacobian at ``at``, in 30 digits, has the norm ``lower``."""
    surface = Surface(PAPER, letter, stiffness=1.0, max_depth=1e-3)
    bound = characteristic_number(surface)
    assert bound.at is not None
    x, y, z = bound.at
    deflection = (0.0, 0.0)
    if letter == "F":
        assert bound.deflection is not None
        deflection = bound.deflection
    matrix = np.array(exact_jacobian(surface, (x, y, z), deflection).tolist(), dtype=float)
    assert np.linalg.norm(matrix, 2) == pytest.approx(bound.lower, rel=1e-9)


def test_numbers_of_the_paper() -> None:
    """q_A = 5.1 of section V.A; q_F = 2.4863 exactly for the law as defined here (MATH)."""
    assert characteristic_number(Surface(PAPER, "A")).value == pytest.approx(
        math.hypot(1.0, 2 * math.pi * 0.8), rel=1e-14
    )
    bound = characteristic_number(Surface(PAPER, "F", max_depth=1e-3))
    assert bound.method == "certified"
    assert bound.lower == pytest.approx(2.4863, abs=5e-5)
    assert 0.0 <= bound.upper - bound.lower <= 1e-6 * bound.lower


def test_friction_bound_is_above_every_stick_and_slip_state() -> None:
    rng = np.random.default_rng(3)
    surface = Surface(PAPER, "F", stiffness=1.0, max_depth=1e-3)
    upper = characteristic_number(surface).upper
    points = np.column_stack([rng.uniform(0, 1e-3, (20_000, 2)), -rng.uniform(0, 1e-3, 20_000)])
    angle, size = rng.uniform(0, 2 * np.pi, 20_000), 1e-3 * rng.uniform(0, 1, 20_000) ** 0.1
    deflection = size[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    for sliding in (False, True):
        jacobians = surface.jacobian(points, deflection, np.full(20_000, sliding))
        greatest = np.linalg.norm(jacobians, 2, axis=(1, 2)).max()
        assert greatest <= upper
    # The bound is tight: sticking reaches 97 % of it.
    assert np.linalg.norm(surface.jacobian(points, deflection), 2, axis=(1, 2)).max() > 0.97 * upper


def test_closed_form_bound_of_math_is_above_the_certified_number() -> None:
    """MATH: with a and b maximised separately the bound is 2.84."""
    a = np.array([0.8e-3 * (1.8 / 2e-3 + math.pi * 0.8 / 1e-3)])
    b = np.array([0.8 * 1.8 / 2])
    assert largest_singular_value(a, b)[0] == pytest.approx(2.84, abs=5e-3)


def test_one_sided_number_of_law_c_is_below_q_on_sharp_crests() -> None:
    """MATH section 4: h = .1 cos 2πx + .04 cos 4πx + .02 cos 6πx, D = .5."""
    crests = Fourier([0.1, 0.04, 0.02], 2 * np.pi * np.array([1.0, 2.0, 3.0]), [np.pi / 2] * 3)
    surface = Surface(crests, "C", max_depth=0.5)
    assert characteristic_number(surface).value == pytest.approx(8.685, abs=5e-4)
    assert one_sided_number(surface).value == pytest.approx(5.533, abs=5e-4)


def test_largest_root_of_the_cubic_may_be_infeasible() -> None:
    """On a shallow sinusoid at large depth the cubic has a root above the true maximum."""
    flat, depth = Sinusoid(0.01e-3, 2e-3), 2e-3
    e, g = 2 * np.pi * depth / flat.period, 2 * np.pi * flat.amplitude / flat.period
    largest = max(np.roots([1, -(1 + g * g + e * e / 4), e * e / 2, -e * e / 4]).real)
    value = q_c(flat, depth)
    assert largest > 2 * value
    assert dense_maximum(flat, "C", depth, "q") == pytest.approx(value, rel=1e-5)


@pytest.mark.parametrize(("y", "expected"), [(0.4, 1.0), (0.5, 1.0), (0.75, 3.0), (1.0, math.inf)])
def test_closed_form_of_the_god_object_number(y: float, expected: float) -> None:
    depth = y * GENTLE.period**2 / (4 * math.pi**2 * GENTLE.amplitude) * (1 + 1e-15)
    assert q_d(GENTLE, depth) == pytest.approx(expected, rel=1e-12)


def test_spectral_norm_and_one_sided_against_lapack() -> None:
    rng = np.random.default_rng(0)
    matrices = rng.normal(size=(500, 3, 3)) * 10.0 ** rng.uniform(-3, 3, (500, 1, 1))
    matrices[:10] = np.eye(3)  # three equal eigenvalues
    norms = np.linalg.norm(matrices, 2, axis=(1, 2))
    np.testing.assert_allclose(spectral_norm(matrices), norms, rtol=1e-12)
    symmetric = -0.5 * (matrices + np.swapaxes(matrices, 1, 2))
    exact = np.linalg.eigvalsh(symmetric)[:, -1]
    assert (np.abs(one_sided(matrices) - exact) <= 1e-12 * norms).all()


def test_feasible_root_of_q_c_is_an_eigenvalue() -> None:
    """The feasible root is an eigenvalue of the exact Jacobian in 40 digits."""
    depth = 1e-3
    surface = Surface(PAPER, "C", stiffness=1.0, max_depth=depth)
    bound = characteristic_number(surface)
    with mpmath.workdps(40):
        matrix = exact_jacobian(surface, bound.at, digits=40)
        values = mpmath.eigsy(-(matrix + matrix.T) / 2, eigvals_only=True)
        assert abs(max(values) - bound.upper) < 1e-9 * bound.upper

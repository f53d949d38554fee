"""One sample of a linear body against an independent integration, and its energies."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from asperity.core.checks import FloatArray
from asperity.simulation.discretization import (
    LinearBody,
    Resonance,
    discretize,
    exponential,
    linear_body,
)
from asperity.simulation.hands import SpringHand

MATRIX = np.array([[2.0, 0.5, 0.1], [0.5, 1.0, -0.2], [0.1, -0.2, 0.7]])
HELD = SpringHand([100.0, 300.0, 200.0], 3.0, mass=0.05, force=(0.2, -0.3, -1.0))
AXES = [0.02, 0.03, 0.05]
BODIES = [
    linear_body(AXES, MATRIX, HELD),
    linear_body([0.05] * 3, np.zeros((3, 3)), SpringHand()),
    linear_body(AXES, MATRIX, HELD, Resonance(400.0, 0.05, 0.3)),
]


def integrated(moved: LinearBody, z: FloatArray, span: float) -> FloatArray:
    """State, loss and anchor's work by an adaptive Runge-Kutta method."""
    n = moved.order

    def rate(t: float, y: FloatArray) -> FloatArray:
        now = np.concatenate([y[:n], z[n:]])
        now[n + 3 : n + 6] += t * z[n + 6 : n + 9]
        return np.append(
            moved.dynamics @ now,
            [now @ moved.loss @ now, z[n + 6 : n + 9] @ moved.anchor_force @ now],
        )

    begin = np.append(z[:n], [0.0, 0.0])
    return solve_ivp(rate, (0.0, span), begin, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]


@pytest.mark.parametrize("moved", BODIES)
@pytest.mark.parametrize("period", [1e-4, 2e-3])
def test_one_sample_is_exact(moved: LinearBody, period: float) -> None:
    step, n = discretize(moved, period), moved.order
    z = np.random.default_rng(1).normal(size=n + 12)
    expected = integrated(moved, z, period)
    np.testing.assert_allclose(step.transition @ z, expected[:n], rtol=1e-9, atol=1e-10)
    assert z @ step.loss @ z == pytest.approx(expected[n], rel=1e-8, abs=1e-12)
    assert z[n + 6 : n + 9] @ step.anchor_work @ z == pytest.approx(
        expected[n + 1], rel=1e-8, abs=1e-12
    )


@pytest.mark.parametrize("moved", BODIES)
def test_energy_closes(moved: LinearBody) -> None:
    step, n = discretize(moved, 1e-3), moved.order
    z = np.random.default_rng(2).normal(size=n + 12)
    x = step.transition @ z
    after = np.concatenate([x, z[n:]])
    after[n + 3 : n + 6] += 1e-3 * z[n + 6 : n + 9]
    carrier = slice(n - 6, n - 3)  # the part that the hand's constant force acts on
    stored = 0.5 * (after @ moved.storage @ after - z @ moved.storage @ z)
    supplied = z[n : n + 3] @ (x[:3] - z[:3]) + z[n + 6 : n + 9] @ step.anchor_work @ z
    supplied += z[n + 9 :] @ (x[carrier] - z[carrier])
    lost = z @ step.loss @ z
    assert stored == pytest.approx(supplied - lost, rel=1e-11)
    # Negative control: without the loss it does not close.
    assert lost == 0.0 or abs(stored - supplied) > 1e-6 * abs(supplied)


def test_the_mode_rings_at_its_frequency() -> None:
    """Undamped, the two masses swing against each other at the frequency given."""
    moved = linear_body([0.04] * 3, np.zeros((3, 3)), SpringHand(), Resonance(400.0, 0.0, 0.3))
    frequencies = np.abs(np.linalg.eigvals(moved.dynamics[:, : moved.order]).imag) / (2 * np.pi)
    assert frequencies.max() == pytest.approx(400.0, rel=1e-9)


@pytest.mark.parametrize("size", [1e-3, 1.0, 40.0])
def test_exponential(size: float) -> None:
    """Against SciPy's Padé approximation, another algorithm."""
    from scipy.linalg import expm

    matrix = size * np.random.default_rng(3).normal(size=(2, 7, 7))
    expected = np.array([expm(each) for each in matrix])
    scale = np.abs(expected).max(axis=(1, 2), keepdims=True)
    assert (np.abs(exponential(matrix) - expected) < 1e-12 * scale).all()

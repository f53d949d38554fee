"""One sample of a linear body against an independent integration, and its energy balance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from asperity.core.checks import FloatArray
from asperity.simulation.discretization import (
    LinearBody,
    Resonance,
    exponential,
    integrate,
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


def integrate_numerically(body: LinearBody, z: FloatArray, span: float) -> FloatArray:
    """Return state and loss by an adaptive Runge-Kutta method."""

    def rate(_t: float, y: FloatArray) -> FloatArray:
        return np.append(body.dynamics @ y[:-1], y[:-1] @ body.loss @ y[:-1])

    return solve_ivp(rate, (0.0, span), [*z, 0.0], "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("period", [1e-4, 2e-3])
def test_sample_agrees_with_runge_kutta(body: LinearBody, period: float) -> None:
    change, loss = integrate(body.dynamics, body.loss, period)
    z = np.random.default_rng(1).normal(size=18)
    expected = integrate_numerically(body, z, period)
    np.testing.assert_allclose(z + change @ z, expected[:18], rtol=1e-9, atol=1e-10)
    assert z @ loss @ z == pytest.approx(expected[18], rel=1e-8, abs=1e-12)


@pytest.mark.parametrize("body", BODIES)
def test_energy_balance_closes(body: LinearBody) -> None:
    """In the frame of the anchor, where only the force and the hand's constant force do work."""
    change, loss = integrate(body.dynamics, body.loss, 1e-3)
    z = np.random.default_rng(2).normal(size=18)
    if not body.carrier_mass.any():
        z[6:12] = z[:6]  # the hand holds the handle itself
        change[6:12] = change[:6]
    steps = change @ z

    def stored(at: FloatArray) -> float:
        e, w, r, s = at[:12].reshape(4, 3)
        energy = body.mass @ w**2 + body.carrier_mass @ s**2
        return 0.5 * float(energy + body.coupling @ (r - e) ** 2 + body.stiffness @ r**2)

    supplied = z[12:15] @ steps[:3] + z[15:] @ steps[6:9]
    lost = z @ loss @ z
    assert stored(z + steps) - stored(z) == pytest.approx(supplied - lost, rel=1e-10)
    # Negative control: without the loss it does not close.
    assert lost == 0.0 or abs(stored(z + steps) - stored(z) - supplied) > 1e-6 * abs(supplied)


@pytest.mark.parametrize("body", BODIES)
def test_stacked_matrices_are_integrated_one_by_one(body: LinearBody) -> None:
    results = integrate(np.stack([body.dynamics] * 2), np.stack([body.loss] * 2), 1e-3)
    for result, expected in zip(results, integrate(body.dynamics, body.loss, 1e-3), strict=True):
        np.testing.assert_allclose(result, np.stack([expected] * 2), rtol=1e-12, atol=1e-18)


def test_undamped_mode_has_the_specified_frequency() -> None:
    body = linear_body([0.04] * 3, np.zeros((3, 3)), SpringHand(), Resonance(400.0, 0.0, 0.3))
    frequencies = np.abs(np.linalg.eigvals(body.dynamics).imag) / (2 * np.pi)
    assert frequencies.max() == pytest.approx(400.0, rel=1e-9)


@pytest.mark.parametrize("size", [1e-3, 1.0, 40.0])
def test_matrix_exponential_agrees_with_scipy(size: float) -> None:
    """SciPy uses a Padé approximation, a different algorithm."""
    from scipy.linalg import expm

    matrix = size * np.random.default_rng(3).normal(size=(2, 7, 7))
    expected = np.array([expm(each) for each in matrix])
    scale = np.abs(expected).max(axis=(1, 2), keepdims=True)
    assert (np.abs(exponential(matrix) - expected) < 1e-12 * scale).all()

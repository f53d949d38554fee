"""The derived Jacobians against closed forms and differences, at generic contacts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import sympy as sp

from asperity.contacts.symbols import DEPTH, POSITION, K
from asperity.derive.derivatives import derive, expand_definitions
from asperity.laws import LAWS, Law

LETTERS = "WABCDEFG"
STIFFNESS, FRICTION, MAX_DEFLECTION, MODULATION = 700.0, 0.7, 0.8e-3, 0.9
H_MID, H_HALF = 0.1e-3, 0.5e-3
DEFLECTION = np.array([0.3e-3, -0.5e-3])

ByHand = Callable[..., np.ndarray]
Differences = Callable[..., np.ndarray]


@dataclass(frozen=True)
class Patch:
    """A cubic surface around the contact (X, Y): h = h0 + g·u + uᵀHu/2 + t (e·u)³."""

    h0: float
    g: np.ndarray
    hessian: np.ndarray
    cubic: float
    e: np.ndarray

    def derivatives(self, u: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        along = float(self.e @ u)
        h = self.h0 + self.g @ u + 0.5 * u @ self.hessian @ u + self.cubic * along**3
        slope = self.g + self.hessian @ u + 3.0 * self.cubic * along**2 * self.e
        return h, slope, self.hessian + 6.0 * self.cubic * along * np.outer(self.e, self.e)

    def closest_point(self, p: np.ndarray) -> np.ndarray:
        """Return the closest point to p near the contact, by Newton's method."""
        u = np.zeros(2)
        for _ in range(12):
            h, g, hessian = self.derivatives(u)
            residual = u - p[:2] + (h - p[2]) * g
            u = u - np.linalg.solve(np.eye(2) + np.outer(g, g) + (h - p[2]) * hessian, residual)
        return u


def patches() -> list[Patch]:
    """Return steep and shallow surfaces with crests, saddles and troughs in general orientation."""
    rng = np.random.default_rng(11)
    surfaces = []
    for size in (0.2, 1.0, 5.0):
        for eigenvalues in ((-900.0, -300.0), (800.0, -500.0), (1100.0, 400.0)):
            rotation = np.linalg.qr(rng.normal(size=(2, 2)))[0]
            hessian = rotation @ np.diag(eigenvalues) @ rotation.T
            g = size * rng.normal(size=2)
            surfaces.append(Patch(rng.normal() * 2e-4, g, hessian, 3e5, rng.normal(size=2)))
    return surfaces


def symbolic_jacobian(law: Law, values: dict[str, float]) -> np.ndarray:
    derivation = derive(law)
    matrix = expand_definitions(derivation, derivation.jacobian)
    symbols = sorted(matrix.free_symbols, key=str)
    result = sp.lambdify(symbols, matrix, "numpy")(*[values[str(s)] for s in symbols])
    return np.array(result, dtype=float)


def contact_values(patch: Patch, depth: float, sliding: bool) -> dict[str, float]:
    h, g, hessian = patch.derivatives(np.zeros(2))
    follow = np.eye(2)
    if sliding:
        follow -= np.outer(DEFLECTION, DEFLECTION) / (DEFLECTION @ DEFLECTION)
    return {
        "depth": depth,
        "h": h,
        "hx": g[0],
        "hy": g[1],
        "hxx": hessian[0, 0],
        "hxy": hessian[0, 1],
        "hyy": hessian[1, 1],
        "dx": DEFLECTION[0],
        "dy": DEFLECTION[1],
        "sxx": follow[0, 0],
        "sxy": follow[0, 1],
        "syy": follow[1, 1],
        "k": STIFFNESS,
        "h_mid": H_MID,
        "h_half": H_HALF,
        "friction": FRICTION,
        "max_deflection": MAX_DEFLECTION,
        "modulation_depth": MODULATION,
    }


def modulation(h: float) -> float:
    return (1.0 + MODULATION * (h - H_MID) / H_HALF) / 2.0


def generic_depth(patch: Patch, letter: str) -> float:
    """Return a depth well inside: for D and E 60 % of the distance to the nearest focal point."""
    if LAWS[letter].contact.name != "nearest":
        return 0.7e-3
    s = np.sqrt(1.0 + patch.g @ patch.g)
    metric = np.eye(2) + np.outer(patch.g, patch.g)
    curvatures = np.linalg.eigvals(np.linalg.solve(metric, patch.hessian / s)).real
    return min(0.7e-3, 0.6 / max(-curvatures.min(), 1.0))


def closed_form_jacobian(
    letter: str, patch: Patch, depth: float, sliding: bool, jacobian_by_hand: ByHand
) -> np.ndarray:
    state: dict[str, Any] = {}
    if letter == "F":
        state = {
            "d": DEFLECTION,
            "m": modulation(patch.h0),
            "sliding": sliding,
            "m_slope": MODULATION * patch.g / (2.0 * H_HALF),
            "friction": FRICTION,
            "max_deflection": MAX_DEFLECTION,
        }
    return jacobian_by_hand(
        letter, k=STIFFNESS, depth=depth, g=patch.g, hessian=patch.hessian, **state
    )


CASES = [(letter, False) for letter in LETTERS] + [("F", True)]
IDS = [*LETTERS, "F sliding"]


@pytest.mark.parametrize(("letter", "sliding"), CASES, ids=IDS)
def test_jacobian_agrees_with_closed_form(letter: str, sliding: bool, jacobian_by_hand: ByHand):
    for patch in patches():
        depth = generic_depth(patch, letter)
        derived = symbolic_jacobian(LAWS[letter], contact_values(patch, depth, sliding))
        expected = closed_form_jacobian(letter, patch, depth, sliding, jacobian_by_hand)
        assert np.abs(derived - expected).max() <= 1e-12 * np.linalg.norm(expected, 2)


def force_on_patch(
    letter: str, patch: Patch, anchor: np.ndarray, sliding: bool, force_by_hand: ByHand
) -> Callable[[np.ndarray], np.ndarray]:
    """Return the force as a function of the probe, (n, 3) -> (n, 3)."""

    def force_at(p: np.ndarray) -> np.ndarray:
        u = patch.closest_point(p) if LAWS[letter].contact.name == "nearest" else p[:2]
        h, g, _ = patch.derivatives(u)
        depth = {
            "nominal": -p[2],
            "vertical": h - p[2],
            "nearest": float(np.sqrt((u - p[:2]) @ (u - p[:2]) + (h - p[2]) ** 2)),
        }[LAWS[letter].contact.name]
        d = p[:2] - anchor
        if sliding:
            d = d * np.hypot(*DEFLECTION) / np.hypot(*d)
        return force_by_hand(
            letter,
            k=STIFFNESS,
            depth=depth,
            g=g,
            d=d,
            m=modulation(h),
            friction=FRICTION,
            max_deflection=MAX_DEFLECTION,
        )

    return lambda points: np.array([force_at(p) for p in points])


def probe_position(patch: Patch, letter: str, depth: float) -> np.ndarray:
    n = np.array([-patch.g[0], -patch.g[1], 1.0]) / np.sqrt(1.0 + patch.g @ patch.g)
    return {
        "nominal": np.array([0.0, 0.0, -depth]),
        "vertical": np.array([0.0, 0.0, patch.h0 - depth]),
        "nearest": np.array([0.0, 0.0, patch.h0]) - depth * n,
    }[LAWS[letter].contact.name]


@pytest.mark.parametrize(("letter", "sliding"), CASES, ids=IDS)
def test_jacobian_agrees_with_differences_of_the_force(
    letter: str, sliding: bool, force_by_hand: ByHand, differences: Differences
):
    for patch in patches():
        depth = generic_depth(patch, letter)
        derived = symbolic_jacobian(LAWS[letter], contact_values(patch, depth, sliding))
        force = force_on_patch(letter, patch, -DEFLECTION, sliding, force_by_hand)
        numeric = differences(force, probe_position(patch, letter, depth)[None, :], step=1e-6)[0]
        assert np.abs(derived - numeric).max() <= 1e-8 * np.linalg.norm(derived, 2)


def test_curvature_term_of_the_god_object_is_not_small():
    """The paper's (18) omits it; at these depths the error is over 1 % of the stiffness."""
    for patch in patches():
        depth = generic_depth(patch, "D")
        n = np.array([-patch.g[0], -patch.g[1], 1.0]) / np.sqrt(1.0 + patch.g @ patch.g)
        exact = symbolic_jacobian(LAWS["D"], contact_values(patch, depth, False))
        without_curvature = -STIFFNESS * np.outer(n, n)
        assert np.linalg.norm(exact - without_curvature, 2) > 0.01 * STIFFNESS


@pytest.mark.parametrize("letter", LETTERS)
def test_saturated_jacobian_omits_the_depth_term(letter: str):
    """While a clamp holds the depth, only ∂f/∂depth ∇depth is missing."""
    derivation = derive(LAWS[letter])
    w = sp.Matrix([[sp.Symbol("hx", real=True), sp.Symbol("hy", real=True), -1]])
    gradient = {
        "nominal": sp.Matrix([[0, 0, -1]]),
        "vertical": w,
        "nearest": w / sp.sqrt(w.dot(w)),
    }[derivation.law.contact.name]
    by_depth = derivation.force.diff(DEPTH) * gradient
    remainder = derivation.jacobian - derivation.jacobian_saturated - by_depth
    assert remainder.applyfunc(sp.simplify) == sp.zeros(3, 3)


def test_explicit_position_is_differentiated():
    law = Law("P", "position", "nominal", lambda c: c.k * c.depth * c.position[0] * c.e_z)
    k, depth, x = K, DEPTH, POSITION[0]
    expected = sp.Matrix([[0, 0, 0], [0, 0, 0], [k * depth, 0, -k * x]])
    assert (derive(law).jacobian - expected).applyfunc(sp.simplify) == sp.zeros(3, 3)

"""The symbolic force of every law against independent formulas and numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp

from asperity.contacts.symbols import ContactSymbols
from asperity.derive.derivatives import symbolic_force
from asperity.laws import LAWS

# Generic values without symmetry, so that exchanged terms are detected.
VALUES = {
    "k": 700.0,
    "depth": 0.4e-3,
    "h": 0.25e-3,
    "hx": 0.6,
    "hy": -1.1,
    "dx": 0.3e-3,
    "dy": -0.5e-3,
    "h_mid": 0.1e-3,
    "h_half": 0.5e-3,
    "friction": 0.7,
    "max_deflection": 0.8e-3,
    "modulation_depth": 0.9,
    "x": 1e-3,
    "y": -2e-3,
    "z": -0.15e-3,
}
S = np.sqrt(1 + 0.6**2 + 1.1**2)
M = (1 + 0.9 * (0.25 - 0.1) / 0.5) / 2  # modulation, 0.635
SPRING = 700.0 * 0.4e-3  # k times depth, 0.28 N
BY_HAND = {
    "W": (0.0, 0.0, 0.28),
    "A": (0.0, 0.0, 0.28),
    "B": (-0.28 * 0.6 / S, 0.28 * 1.1 / S, 0.28 / S),
    "C": (-0.168, 0.308, 0.28),
    "D": (-0.28 * 0.6 / S, 0.28 * 1.1 / S, 0.28 / S),
    "E": (0.0, 0.0, 0.28),
    "F": (-0.28 * 0.7 * 0.365 * 0.3 / 0.8, 0.28 * 0.7 * 0.365 * 0.5 / 0.8, 0.28),
    "G": (-0.28 * 0.6 / S, 0.28 * 1.1 / S, 0.28 / S),
}


def evaluate(expression: Any, values: dict[str, float]) -> np.ndarray:
    numbers = {symbol: values[str(symbol)] for symbol in expression.free_symbols}
    return np.array(expression.subs(numbers).evalf(30), dtype=float).ravel()


@pytest.mark.parametrize("letter", BY_HAND)
def test_force_has_the_expected_values(letter: str):
    force = evaluate(symbolic_force(LAWS[letter]), VALUES)
    np.testing.assert_allclose(force, BY_HAND[letter], rtol=1e-14, atol=1e-16)


@pytest.mark.parametrize("letter", BY_HAND)
def test_force_agrees_with_independent_formula_at_random_contacts(
    letter: str, force_by_hand: Callable[..., np.ndarray]
):
    rng = np.random.default_rng(5)
    symbolic = symbolic_force(LAWS[letter])
    for _ in range(5):
        values = {name: value * rng.uniform(0.3, 1.5) for name, value in VALUES.items()}
        relative_height = (values["h"] - values["h_mid"]) / values["h_half"]
        expected = force_by_hand(
            letter,
            k=values["k"],
            depth=values["depth"],
            g=(values["hx"], values["hy"]),
            d=(values["dx"], values["dy"]),
            m=(1 + values["modulation_depth"] * relative_height) / 2,
            friction=values["friction"],
            max_deflection=values["max_deflection"],
        )
        error = np.abs(evaluate(symbolic, values) - expected).max()
        assert error <= 1e-14 * np.abs(expected).max()


def test_force_of_law_c_is_minus_the_gradient_of_its_energy():
    x, y, z, k = sp.symbols("x y z k", real=True)
    h = sp.Function("h")(x, y)
    energy = k * (h - z) ** 2 / 2
    gradient = sp.Matrix([energy]).jacobian([x, y, z]).T
    force = symbolic_force(LAWS["C"])
    names = {str(symbol): symbol for symbol in force.free_symbols}
    values = force.subs(
        {names["hx"]: h.diff(x), names["hy"]: h.diff(y), names["depth"]: h - z, names["k"]: k}
    )
    assert (values + gradient).applyfunc(sp.simplify) == sp.zeros(3, 1)


def test_friction_opposes_the_deflection_and_is_weakest_on_the_crest():
    valley = evaluate(symbolic_force(LAWS["F"]), VALUES | {"h": -0.4e-3})
    crest = evaluate(symbolic_force(LAWS["F"]), VALUES | {"h": 0.6e-3})
    deflection = np.array([0.3e-3, -0.5e-3])
    assert valley[:2] @ deflection < crest[:2] @ deflection < 0.0
    # m = 0.05 and 0.95 at the certified extremes with a modulation depth of 0.9.
    assert crest[0] / valley[0] == pytest.approx(0.05 / 0.95)


def test_normal_has_unit_length():
    c = ContactSymbols()
    assert sp.simplify(c.normal.dot(c.normal)) == 1
    assert sp.simplify(c.w.dot(sp.Matrix([1, 0, c.slope[0]]))) == 0
    assert sp.simplify(c.w.dot(sp.Matrix([0, 1, c.slope[1]]))) == 0


def test_undeclared_parameter_is_an_error():
    with pytest.raises(KeyError, match="does not declare"):
        ContactSymbols(("gain",)).parameter("gian")
    assert str(ContactSymbols(("gain",)).parameter("gain")) == "gain"

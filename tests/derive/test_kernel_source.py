"""The kernels as source text: scalar Python that agrees with the symbolic law."""

from __future__ import annotations

import ast
import math
from typing import Any

import numpy as np
import pytest
import sympy as sp

from asperity.contacts.symbols import ARGUMENT_ORDER
from asperity.derive.derivatives import derive, expand_definitions
from asperity.derive.generate import law_source
from asperity.laws import LAWS, Law

VALUES = {
    "x": 1e-3,
    "y": -2e-3,
    "z": -0.4e-3,
    "depth": 0.4e-3,
    "h": 0.25e-3,
    "hx": 0.6,
    "hy": -1.1,
    "hxx": -900.0,
    "hxy": 350.0,
    "hyy": 500.0,
    "dx": 0.3e-3,
    "dy": -0.5e-3,
    "sxx": 0.7,
    "sxy": -0.2,
    "syy": 0.4,
    "k": 700.0,
    "h_mid": 0.1e-3,
    "h_half": 0.5e-3,
    "friction": 0.7,
    "max_deflection": 0.8e-3,
    "modulation_depth": 0.9,
    "tx": 0.2e-3,
    "ty": -0.1e-3,
    "tz": 0.3e-3,
    "mxx": -0.3,
    "mxy": 0.2,
    "mxz": 0.15,
    "myy": -0.5,
    "myz": -0.25,
    "mzz": -0.8,
}


def functions(law: Law) -> dict[str, Any]:
    names: dict[str, Any] = {"math": math}
    exec(law_source(law), names)
    return names


def arguments(law: Law, function: str) -> list[str]:
    for node in ast.parse(law_source(law)).body:
        if isinstance(node, ast.FunctionDef) and node.name == function:
            return [argument.arg for argument in node.args.args]
    raise KeyError(function)


def call(law: Law, function: str) -> np.ndarray:
    values = [VALUES[name.removeprefix("param_")] for name in arguments(law, function)]
    return np.array(functions(law)[function](*values))


def evaluate_exactly(law: Law, matrix: Any) -> np.ndarray:
    matrix = expand_definitions(derive(law), matrix)
    numbers = {symbol: sp.Rational(VALUES[str(symbol)]) for symbol in matrix.free_symbols}
    return np.array(matrix.subs(numbers).evalf(30), dtype=float).ravel()


@pytest.mark.parametrize("law", LAWS.values(), ids=str)
def test_source_agrees_with_symbolic_force_and_jacobian(law: Law):
    derivation = derive(law)
    force, jacobian = (
        evaluate_exactly(law, derivation.force),
        evaluate_exactly(law, derivation.jacobian),
    )
    np.testing.assert_allclose(call(law, "law_force"), force, rtol=1e-13, atol=1e-15)
    force_and_jacobian = call(law, "law_jacobian")
    np.testing.assert_allclose(force_and_jacobian[:3], force, rtol=1e-13, atol=1e-15)
    assert np.abs(force_and_jacobian[3:] - jacobian).max() <= 1e-13 * np.abs(jacobian).max()


@pytest.mark.parametrize("law", [law for law in LAWS.values() if law.clampable], ids=str)
def test_source_agrees_with_symbolic_saturated_jacobian(law: Law):
    expected = evaluate_exactly(law, derive(law).jacobian_saturated)
    error = np.abs(call(law, "law_jacobian_saturated") - expected).max()
    assert error <= 1e-13 * max(np.abs(expected).max(), 1.0)


@pytest.mark.parametrize("law", LAWS.values(), ids=str)
def test_only_clampable_laws_have_a_saturated_jacobian(law: Law):
    assert ("law_jacobian_saturated" in functions(law)) == law.clampable


@pytest.mark.parametrize("law", LAWS.values(), ids=str)
def test_arguments_are_ordered_and_all_used(law: Law):
    order = [
        *(str(symbol) for symbol in ARGUMENT_ORDER),
        *(f"param_{name}" for name in law.parameters),
    ]
    for function in ("law_force", "law_jacobian"):
        names_of_arguments = arguments(law, function)
        assert names_of_arguments == sorted(names_of_arguments, key=order.index)
        body = law_source(law).split(f"def {function}(")[1].split("\ndef ")[0]
        names = [n.id for n in ast.walk(ast.parse("def f(" + body)) if isinstance(n, ast.Name)]
        assert set(names_of_arguments) <= set(names)


def test_functions_take_only_the_arguments_they_use():
    assert arguments(LAWS["W"], "law_force") == ["depth", "k"]
    assert arguments(LAWS["B"], "law_force") == ["depth", "hx", "hy", "k"]
    assert arguments(LAWS["E"], "law_jacobian") == ["depth", "hx", "hy", "k"]


@pytest.mark.parametrize(
    ("exponent", "printed"),
    [
        (2, "depth*depth"),
        (4, "depth*depth*depth*depth"),
        (-2, "k/(depth*depth)"),
        (5, "depth**5"),
        (sp.Rational(1, 2), "math.sqrt(depth)"),
    ],
)
def test_small_powers_are_products(exponent: Any, printed: str):
    source = law_source(Law("P", "power", "nominal", lambda c: c.k * c.depth**exponent * c.e_z))
    assert printed in source.split("def law_jacobian")[0]


def test_powers_of_sums_keep_their_parentheses():
    law = Law("P", "power", "nominal", lambda c: c.k * (c.depth + c.h - 2) ** 3 * c.e_z)
    expected = VALUES["k"] * (VALUES["depth"] + VALUES["h"] - 2) ** 3
    assert call(law, "law_force")[2] == pytest.approx(expected, rel=1e-14)


def test_length_of_the_normal_is_computed_once():
    for letter in "BDG":
        for function in law_source(LAWS[letter]).split("\n\n\n"):
            assert function.count("math.sqrt") <= 1


def test_whole_numbers_are_floats():
    """An integer among floats would make Numba's return type a union."""
    for law in LAWS.values():
        for node in ast.walk(ast.parse(law_source(law))):
            if isinstance(node, ast.Return) and isinstance(node.value, ast.Tuple):
                constants = [e.value for e in node.value.elts if isinstance(e, ast.Constant)]
                assert all(isinstance(value, float) for value in constants)

"""Formulas that cannot be used are refused with a reason."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp

from asperity.analysis import characteristic_number
from asperity.contacts.symbols import HXX, ContactSymbols
from asperity.derive.jacobian import derive, symbolic_force
from asperity.derive.python_source import law_source
from asperity.errors import LawError
from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures.sinusoid import Sinusoid

Formula = Callable[[ContactSymbols], Any]


def law(force: Formula, **options: Any) -> Law:
    return Law("V", "own", options.pop("contact", "vertical"), force, **options)


@pytest.mark.parametrize(
    "force",
    [
        lambda c: c.e_z * math.sin(c.depth),
        lambda c: c.e_z * np.sin(c.depth),
        lambda c: c.e_z * float(c.k),
        lambda c: c.k * c.undefined * c.e_z,
        lambda c: None,  # noqa: ARG005 - a formula that forgot its return
        lambda c: c.depth,
        lambda c: c.parameter("gain") * c.e_z,
        lambda p: -500.0 * np.asarray(p)[2:3],  # a function of positions
        lambda c: c.k * c.depth * c.w if c.depth > 1e-3 else c.w,
    ],
    ids=[
        "math",
        "numpy",
        "float",
        "attribute",
        "nothing",
        "scalar",
        "undeclared",
        "position",
        "if",
    ],
)
def test_a_force_that_is_no_formula(force: Formula):
    with pytest.raises(LawError, match=r"law V: its force is not a symbolic formula \("):
        symbolic_force(law(force))


def test_a_function_that_only_computes_is_refused_with_the_reason():
    """Wherever its numbers are asked for: nothing can be derived from them."""
    own = law(lambda c: np.sqrt(c.depth) * np.array([0.0, 0.0, 1.0]))
    surface = Surface(Sinusoid(amplitude=1e-4, period=1e-3), own)
    for ask in (lambda: surface.force([[0.0, 0.0, -1e-4]]), lambda: characteristic_number(surface)):
        with pytest.raises(LawError) as caught:
            ask()
        message = str(caught.value)
        assert message.startswith("law V: its force is not a symbolic formula (")
        assert "no callable sqrt method" in message
        assert "Functions of math and NumPy only compute numbers: use SymPy's" in message
        assert "\n" not in message


@pytest.mark.parametrize("count", [1, 2, 4])
def test_a_force_with_the_wrong_number_of_components(count: int):
    with pytest.raises(LawError, match="must have 3 components"):
        symbolic_force(law(lambda c: [c.depth] * count))


@pytest.mark.parametrize(
    ("force", "named"),
    [
        (lambda c: sp.Symbol("stiffness") * c.depth * c.e_z, "stiffness"),
        (lambda c: sp.Symbol("k") * c.depth * c.e_z, "k"),  # not the real, positive k
        (lambda c: HXX * c.depth * c.e_z, "hxx"),
        (lambda c: c.k * c.tangential(c.deflection), "dx, dy"),  # of a law without state
    ],
)
def test_a_force_with_symbols_that_the_contact_does_not_offer(force: Formula, named: str):
    with pytest.raises(LawError, match=f"force uses {named}, which the contact does not offer"):
        derive(law(force))


def test_deflection_is_offered_to_a_law_with_state():
    own = law(
        lambda c: -c.k * c.tangential(c.deflection),
        contact="nominal",
        stateful=True,
        parameters={"max_deflection": 1e-3},
    )
    force = symbolic_force(own)
    assert {str(symbol) for symbol in force.free_symbols} == {"k", "dx", "dy"}


RESERVED = ["x", "depth", "h", "hx", "hyy", "dx", "sxy", "k", "h_mid", "h_half"]


@pytest.mark.parametrize("name", [*RESERVED, "two words", "1st", ""])
def test_a_parameter_with_a_reserved_name(name: str):
    own = law(lambda c: c.k * c.depth * c.e_z, parameters={name: 1.0})
    with pytest.raises(LawError, match="cannot be the name of a parameter"):
        law_source(own)


# Names that the kernels themselves use, or that Python keeps for itself.
COLLIDING = ["s", "fx", "j00", "floor", "clamp_depth", "texture", "math", "min", "slope", "lambda"]


@pytest.mark.parametrize("name", COLLIDING)
def test_a_parameter_that_would_collide_with_the_kernels(name: str):
    own = law(
        lambda c: c.parameter(name) * c.k * c.depth * c.normal,
        parameters={name: 1.0},
        clampable=True,
    )
    with pytest.raises(LawError, match="cannot be the name of a parameter"):
        law_source(own)


@pytest.mark.parametrize("value", [sp.nan, sp.oo, sp.zoo, sp.I], ids=str)
def test_a_force_that_is_no_real_number(value: Any):
    with pytest.raises(LawError):
        law_source(law(lambda c: value * c.depth * c.e_z))


def test_a_force_that_cannot_be_printed_for_the_kernels():
    with pytest.raises(LawError):
        law_source(law(lambda c: sp.besselj(0, c.depth) * c.e_z))


def test_a_law_with_state_needs_to_know_how_far_its_anchor_may_lag():
    own = law(lambda c: -c.k * c.tangential(c.deflection), contact="nominal", stateful=True)
    with pytest.raises(LawError, match="max_deflection"):
        law_source(own)

"""Unusable formulas of laws are rejected with a reason."""

from __future__ import annotations

import ast
import keyword
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp

from asperity.analysis import characteristic_number
from asperity.contacts.symbols import ARGUMENT_ORDER, HXX, ContactSymbols
from asperity.core.errors import LawError
from asperity.derive.derivatives import derive, symbolic_force
from asperity.derive.facts import law_facts
from asperity.derive.generate import law_source
from asperity.kernels import path_loop, stateful_loops
from asperity.kernels.fuse import source_on_texture
from asperity.laws import LAWS, Law
from asperity.laws.clamps import BACKED, NONE
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

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
        lambda c: None,  # noqa: ARG005 - a formula without return value
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
def test_force_that_is_not_symbolic_is_an_error(force: Formula):
    with pytest.raises(LawError, match=r"law V: its force is not a symbolic formula \("):
        symbolic_force(law(force))


@pytest.mark.parametrize(
    "force",
    [
        lambda c: 1000 * c.depth * c.w,
        lambda c: (c.k * c.depth + 5 * c.depth) * c.w,
        lambda c: c.k * c.depth * (1 + (c.k * c.depth) ** 2) * c.w,
        lambda c: sp.tanh(c.k * c.depth) * c.e_z,
    ],
    ids=["constant", "sum", "stiffening in k", "saturating in k"],
)
def test_force_that_is_not_proportional_to_the_stiffness_is_an_error(force: Formula):
    with pytest.raises(LawError, match="law V: force must be k times a formula without k"):
        symbolic_force(law(force))


@pytest.mark.parametrize(
    ("force", "words"),
    [
        (lambda c: c.k * sp.floor(c.depth) * c.e_z, "must have derivatives"),
        (lambda c: c.k * sp.Mod(c.depth, 2) * c.e_z, "must have derivatives"),
        (lambda c: c.k * sp.Piecewise((c.depth, c.depth < 1)) * c.e_z, "needs a last piece"),
    ],
    ids=["floor", "Mod", "open pieces"],
)
def test_force_without_derivative_or_value_is_an_error(force: Formula, words: str):
    with pytest.raises(LawError, match=f"law V: .*{words}"):
        symbolic_force(law(force))


@pytest.mark.parametrize(
    ("share", "vanishes"),
    [
        (lambda c: c.depth * sp.Min(1, 1 / c.depth), True),
        (lambda c: c.depth * sp.Max(1, 1 / c.depth), False),
        (lambda c: c.depth * sp.Piecewise((1, c.depth < 1), (1 / c.depth, True)), True),
        (lambda c: c.depth * sp.Max(c.slope[0], 1 / c.depth), False),
    ],
)
def test_saturated_force_is_taken_where_contact_begins(share: Formula, vanishes: bool):
    assert law_facts(law(lambda c: c.k * share(c) * c.w)).vanishes_at_contact is vanishes


def test_force_is_proportional_to_the_stiffness_in_any_form():
    for force in (
        lambda c: sp.sqrt(c.k**2) * c.depth * c.w,
        lambda c: (c.k**2 * c.depth / c.k) * c.w,
        lambda c: sp.Piecewise((c.k * c.depth, c.depth < 1e-4), (1e-4 * c.k, True)) * c.e_z,
        lambda c: ((c.k + 1) * c.depth - c.depth) * c.w,
    ):
        symbolic_force(law(force))


def test_numpy_function_is_an_error_with_the_reason():
    """The error is the same wherever its numbers are requested: nothing can be derived from it."""
    definition = law(lambda c: np.sqrt(c.depth) * np.array([0.0, 0.0, 1.0]))
    surface = Surface(Sinusoid(amplitude=1e-4, period=1e-3), definition)
    for compute in (
        lambda: surface.force([[0.0, 0.0, -1e-4]]),
        lambda: characteristic_number(surface),
    ):
        with pytest.raises(LawError) as caught:
            compute()
        message = str(caught.value)
        assert message.startswith("law V: its force is not a symbolic formula (")
        assert "no callable sqrt method" in message
        assert "Functions of math and NumPy only compute numbers: use SymPy's" in message
        assert "\n" not in message


@pytest.mark.parametrize("count", [1, 2, 4])
def test_force_must_have_three_components(count: int):
    with pytest.raises(LawError, match="must have 3 components"):
        symbolic_force(law(lambda c: [c.depth] * count))


@pytest.mark.parametrize(
    ("force", "symbols"),
    [
        (lambda c: sp.Symbol("stiffness") * c.depth * c.e_z, "stiffness"),
        (
            lambda c: sp.Symbol("k") * c.depth * c.e_z,
            "k",
        ),  # a different symbol from the real, positive k
        (lambda c: HXX * c.depth * c.e_z, "hxx"),
        (lambda c: c.k * c.tangential(c.deflection), "dx, dy"),  # in a law without state
    ],
)
def test_symbols_that_the_contact_does_not_offer_are_an_error(force: Formula, symbols: str):
    with pytest.raises(LawError, match=f"force uses {symbols}, which the contact does not offer"):
        derive(law(force))


def test_law_with_state_may_use_the_deflection():
    definition = law(
        lambda c: -c.k * c.tangential(c.deflection),
        contact="nominal",
        stateful=True,
        parameters={"max_deflection": 1e-3},
    )
    force = symbolic_force(definition)
    assert {str(symbol) for symbol in force.free_symbols} == {"k", "dx", "dy"}


RESERVED = ["x", "depth", "h", "hx", "hyy", "dx", "sxy", "k", "h_mid", "h_half"]


@pytest.mark.parametrize("name", RESERVED)
def test_parameter_named_like_a_contact_symbol_is_an_error(name: str):
    definition = law(lambda c: c.k * c.depth * c.e_z, parameters={name: 1.0})
    reason = f"called '{name}': formulas on the vertical contact have another symbol of that name"
    with pytest.raises(LawError, match=reason):
        law_source(definition)


@pytest.mark.parametrize("name", ["two words", "1st", ""])
def test_parameter_name_must_be_an_identifier(name: str):
    definition = law(lambda c: c.k * c.depth * c.e_z, parameters={name: 1.0})
    with pytest.raises(LawError, match="needs a name like a variable's"):
        law_source(definition)


def test_derivative_symbols_are_reserved_on_their_contact_only():
    def law_with_q11(contact: str) -> Law:
        return law(lambda c: c.k * c.depth * c.e_z, contact=contact, parameters={"q11": 1.0})

    assert "def law_force" in law_source(law_with_q11("vertical"))
    with pytest.raises(LawError, match="formulas on the nearest contact have another symbol"):
        law_source(law_with_q11("nearest"))


def names_in_code(text: str) -> set[str]:
    """Return all names of functions, arguments, variables and modules in a source text."""
    nodes = list(ast.walk(ast.parse(text)))
    functions = [node for node in nodes if isinstance(node, ast.FunctionDef)]
    names = {node.id for node in nodes if isinstance(node, ast.Name)}
    arguments = {a.arg for f in functions for a in f.args.args}
    return names | arguments | {f.name for f in functions}


def test_parameters_may_have_any_name_of_the_compiled_code():
    """All at once: the names in the fused modules of the laws, and Python's keywords."""
    wave = Sinusoid(amplitude=1e-4, period=1e-3)
    texts = []
    for letter in "BHF":
        shipped = LAWS[letter]
        modules = (stateful_loops, path_loop, *shipped.contact.kernels())
        clamp = BACKED if shipped.clampable else NONE
        texts.append(source_on_texture(shipped, wave.sampler, clamp, modules))
    code_names = set().union(*map(names_in_code, texts)) | {
        *keyword.kwlist,
        "weights",
        "below",
        "double",
    }
    assert code_names >= {"gap", "count", "weights", "below", "law_force", "probe_force", "texture"}
    contact_symbols = {str(symbol) for symbol in ARGUMENT_ORDER}
    names = sorted(name for name in code_names - contact_symbols if name.isidentifier())
    assert len(names) > 150

    def force(c: ContactSymbols) -> Any:
        return sum(c.parameter(name) for name in names) * c.k * c.depth * c.normal

    expected_surface = Surface(wave, "B", clamp="backed")
    definition = law(force, parameters=dict.fromkeys(names, 1.0 / len(names)), clampable=True)
    points = np.array([[1e-4, 0.0, -1e-5], [3e-4, 2e-4, -5e-4]])
    expected = expected_surface.force_and_jacobian(points)
    results = Surface(wave, definition, clamp="backed").force_and_jacobian(points)
    for value, expected_value in zip(results, expected, strict=True):
        np.testing.assert_allclose(value, expected_value, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("value", [sp.nan, sp.oo, sp.zoo, sp.I], ids=str)
def test_force_that_is_not_real_is_an_error(value: Any):
    with pytest.raises(LawError):
        law_source(law(lambda c: value * c.depth * c.e_z))


def test_force_without_kernel_code_is_an_error():
    with pytest.raises(LawError):
        law_source(law(lambda c: sp.besselj(0, c.depth) * c.e_z))


def test_law_with_state_needs_max_deflection():
    definition = law(lambda c: -c.k * c.tangential(c.deflection), contact="nominal", stateful=True)
    with pytest.raises(LawError, match="max_deflection"):
        law_source(definition)

"""Which laws are conservative, by a proof that detects small deviations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp

from asperity.contacts.symbols import ContactSymbols
from asperity.derive.derivatives import curl_verdict
from asperity.laws import LAWS, Law
from asperity.surface import Surface
from asperity.textures import Sinusoid

Formula = Callable[[ContactSymbols], Any]


def law(contact: str, force: Formula, **options: Any) -> Law:
    return Law("V", "own", contact, force, **options)


def scaled_slopes(c: ContactSymbols, factor: Any) -> Any:
    """Return law C with its lateral force scaled by a factor."""
    return c.k * c.depth * sp.Matrix([-factor * c.slope[0], -factor * c.slope[1], 1])


@pytest.mark.parametrize("letter", "WCD")
def test_shipped_laws_that_are_conservative(letter: str):
    verdict = curl_verdict(LAWS[letter])
    assert verdict.conservative
    assert verdict.curl == sp.zeros(3, 1)


@pytest.mark.parametrize("letter", "ABEG")
def test_shipped_laws_with_a_curl_are_not_conservative(letter: str):
    verdict = curl_verdict(LAWS[letter])
    assert not verdict.conservative
    assert verdict.reason == "the curl is not zero"
    assert verdict.curl != sp.zeros(3, 1)


def test_friction_modulation_is_not_a_field_of_position():
    verdict = curl_verdict(LAWS["F"])
    assert not verdict.conservative
    assert "deflection" in verdict.reason


def test_curl_of_law_a_is_that_of_the_paper():
    k, hx, hy = sp.Symbol("k", positive=True), *sp.symbols("hx hy", real=True)
    assert sp.simplify(curl_verdict(LAWS["A"]).curl - k * sp.Matrix([hy, -hx, 0])) == sp.zeros(3, 1)


CONSERVATIVE: dict[str, Law] = {
    "hardening god-object": law("nearest", lambda c: c.k * c.depth**3 * c.normal),
    "Hertz god-object": law("nearest", lambda c: c.k * c.depth ** sp.Rational(3, 2) * c.normal),
    "exponential height": law("vertical", lambda c: c.k * (sp.exp(c.depth) - 1) * c.w),
    "D by another root": law("nearest", lambda c: c.k * c.depth * c.w / c.w.norm()),
    "C in floats": law("vertical", lambda c: 0.1 * c.k * c.depth * c.w),
    "C by its parts": law("vertical", lambda c: scaled_slopes(c, 1)),
    # U = k δ₀² h/2: the stiffness of the wall depends on the height.
    "graded wall": law(
        "nominal", lambda c: c.k * (c.depth * c.h * c.e_z - c.depth**2 / 2 * c.tangential(c.slope))
    ),
    "nothing": law("nominal", lambda c: 0 * c.e_z),
}
NOT_CONSERVATIVE: dict[str, Law] = {
    "C with slopes 0.01 % too steep": law(
        "vertical", lambda c: scaled_slopes(c, sp.Rational(10001, 10000))
    ),
    "C with slopes 1e-9 too steep": law("vertical", lambda c: scaled_slopes(c, 1 + 1e-9)),
    "C with one slope of the wrong sign": law(
        "vertical", lambda c: c.k * c.depth * sp.Matrix([-c.slope[0], c.slope[1], 1])
    ),
    "D weighted by the height of the foot": law(
        "nearest", lambda c: c.k * c.h * c.depth * c.normal
    ),
    "D weighted by the tilt": law("nearest", lambda c: c.k * c.depth * c.normal[2] * c.normal),
    "graded wall of the wrong sign": law(
        "nominal", lambda c: c.k * (c.depth * c.h * c.e_z + c.depth**2 / 2 * c.tangential(c.slope))
    ),
    # Curl-free inside, but a closed path may enter and leave contact at different places.
    "lateral force at once": law("nominal", lambda c: c.k * c.tangential(c.slope)),
}


@pytest.mark.parametrize("law_definition", CONSERVATIVE.values(), ids=list(CONSERVATIVE))
def test_user_defined_law_is_conservative(law_definition: Law):
    assert curl_verdict(law_definition).conservative


@pytest.mark.parametrize("law_definition", NOT_CONSERVATIVE.values(), ids=list(NOT_CONSERVATIVE))
def test_user_defined_law_is_not_conservative(law_definition: Law):
    assert not curl_verdict(law_definition).conservative


# --- jumps of the contact point -------------------------------------------------------------------
#
# For the nearest contact a smooth formula f(p, δ, h, h_x, h_y) with zero curl on every surface is
# always c(p, δ) n + b(p, δ) = -∇U(p, δ), and δ does not jump: the force may jump, U never does.
# Only a piecewise formula can hide a jump of its potential.


def loop_across_the_ridge(definition: Law, plain: Callable[[Any], Any]) -> tuple[float, float]:
    """Return the work around a loop below a crest, and the greatest work along one of its sides."""
    surface = plain(Surface(Sinusoid(0.4e-3, 1e-3, phase=0.0), definition, stiffness=1000.0))
    corners = np.array([[0.05, -0.6], [0.45, -0.6], [0.45, -0.1], [0.05, -0.1]]) * 1e-3
    steps = (np.arange(400) + 0.5) / 400
    work = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        path = a + steps[:, None] * (b - a)
        points = np.column_stack([path[:, 0], np.zeros(400), path[:, 1]])
        force = surface.force(points)
        work.append(float((force[:, [0, 2]] @ (b - a)).mean()))
    return sum(work), max(abs(w) for w in work)


def graded_god_object(c: ContactSymbols) -> Any:
    """U = k δ² (1 + z/1 mm)/2: a god-object whose stiffness depends on the probe's height."""
    z = c.position[2]
    grade = 1 + 1000 * z
    return c.k * (c.depth * grade * c.normal - 500 * c.depth**2 * c.e_z)


def two_sided_god_object(c: ContactSymbols) -> Any:
    """Twice as stiff on the falling flank: no curl, but the energy jumps at the ridge."""
    return c.k * c.depth * c.normal * sp.Piecewise((1, c.slope[0] > 0), (2, True))


def test_potential_of_position_and_distance_is_conservative(plain: Callable[[Any], Any]):
    definition = law("nearest", graded_god_object)
    loop, side = loop_across_the_ridge(definition, plain)
    assert abs(loop) < 2e-3 * side  # measured, independently of the proof
    assert curl_verdict(definition).curl == sp.zeros(3, 1)
    assert curl_verdict(definition).conservative


def test_piecewise_formula_is_not_conservative(plain: Callable[[Any], Any]):
    definition = law("nearest", two_sided_god_object)
    loop, side = loop_across_the_ridge(definition, plain)
    assert abs(loop) > 0.1 * side  # measured, independently of the proof
    assert not curl_verdict(definition).conservative


def test_piecewise_formula_on_vertical_contact_is_not_conservative():
    stiffer_high = sp.Piecewise((1, ContactSymbols().h > 0), (2, True))
    definition = law("vertical", lambda c: c.k * c.depth * c.w * stiffer_high)
    assert not curl_verdict(definition).conservative


def test_force_that_jumps_along_the_normal_is_conservative():
    """U = k δ (1 mm) is continuous, though its gradient is not."""
    definition = law("vertical", lambda c: c.k * c.w / 1000)
    assert curl_verdict(definition).conservative

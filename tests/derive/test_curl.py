"""Which laws are conservative, and that the proof can tell."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp

from asperity.contacts.symbols import ContactSymbols
from asperity.derive.curl import curl_verdict
from asperity.laws import LAWS, Law
from asperity.surface import Surface
from asperity.textures import Sinusoid

Formula = Callable[[ContactSymbols], Any]


def law(contact: str, force: Formula, **options: Any) -> Law:
    return Law("V", "own", contact, force, **options)


def scaled_slopes(c: ContactSymbols, factor: Any) -> Any:
    """C, with its lateral force wrong by a factor."""
    return c.k * c.depth * sp.Matrix([-factor * c.slope[0], -factor * c.slope[1], 1])


@pytest.mark.parametrize("letter", "WCD")
def test_conservative_by_proof(letter: str):
    verdict = curl_verdict(LAWS[letter])
    assert verdict.conservative
    assert verdict.curl == sp.zeros(3, 1)


@pytest.mark.parametrize("letter", "ABEG")
def test_not_conservative_with_a_curl(letter: str):
    verdict = curl_verdict(LAWS[letter])
    assert not verdict.conservative
    assert verdict.reason == "the curl is not zero"
    assert verdict.curl != sp.zeros(3, 1)


def test_friction_modulation_is_no_field_of_position():
    verdict = curl_verdict(LAWS["F"])
    assert not verdict.conservative
    assert "deflection" in verdict.reason


def test_the_curl_of_the_groove_is_the_one_of_the_paper():
    k, hx, hy = sp.Symbol("k", positive=True), *sp.symbols("hx hy", real=True)
    assert sp.simplify(curl_verdict(LAWS["A"]).curl - k * sp.Matrix([hy, -hx, 0])) == sp.zeros(3, 1)


CONSERVATIVE: dict[str, Law] = {
    "hardening god-object": law("nearest", lambda c: c.depth**3 * c.normal),
    "Hertz god-object": law("nearest", lambda c: c.k * c.depth ** sp.Rational(3, 2) * c.normal),
    "exponential height": law("vertical", lambda c: c.k * (sp.exp(c.depth) - 1) * c.w),
    "D by another root": law("nearest", lambda c: c.k * c.depth * c.w / c.w.norm()),
    "C in floats": law("vertical", lambda c: 0.1 * c.k * c.depth * c.w),
    "C by its parts": law("vertical", lambda c: scaled_slopes(c, 1)),
    # U = k δ₀² h/2: the height is felt through the wall.
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
    # Curl-free inside, but a closed path may enter at one place and leave at another.
    "lateral force at once": law("nominal", lambda c: c.k * c.tangential(c.slope)),
}


@pytest.mark.parametrize("own", CONSERVATIVE.values(), ids=list(CONSERVATIVE))
def test_a_law_of_ones_own_that_is_conservative(own: Law):
    assert curl_verdict(own).conservative


@pytest.mark.parametrize("own", NOT_CONSERVATIVE.values(), ids=list(NOT_CONSERVATIVE))
def test_a_law_of_ones_own_that_is_not(own: Law):
    assert not curl_verdict(own).conservative


# --- where the contact jumps ----------------------------------------------------------------------
#
# For the nearest contact a smooth formula f(p, δ, h, h_x, h_y) with zero curl on every surface is
# always c(p, δ) n + b(p, δ) = -∇U(p, δ), and δ does not jump: the force may jump, U never does.
# Only a formula in pieces can hide a jump of its potential.


def loop_across_the_ridge(own: Law, plain: Callable[[Any], Any]) -> tuple[float, float]:
    """Return the work of a loop below a crest, and the work of one side of it alone."""
    surface = plain(Surface(Sinusoid(0.4e-3, 1e-3, phase=0.0), own, stiffness=1000.0))
    corners = np.array([[0.05, -0.6], [0.45, -0.6], [0.45, -0.1], [0.05, -0.1]]) * 1e-3
    steps = (np.arange(400) + 0.5) / 400
    work = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        path = a + steps[:, None] * (b - a)
        points = np.column_stack([path[:, 0], np.zeros(400), path[:, 1]])
        force = surface.force(points)
        work.append(float((force[:, [0, 2]] @ (b - a)).mean()))
    return sum(work), max(abs(w) for w in work)


def tall_god_object(c: ContactSymbols) -> Any:
    """U = k δ² (1 + z/1 mm)/2: a god-object whose spring changes with the height of the probe."""
    z = c.position[2]
    grade = 1 + 1000 * z
    return c.k * (c.depth * grade * c.normal - 500 * c.depth**2 * c.e_z)


def two_sided_god_object(c: ContactSymbols) -> Any:
    """Twice as stiff on the falling flank: no curl anywhere, but its energy jumps at the ridge."""
    return c.k * c.depth * c.normal * sp.Piecewise((1, c.slope[0] > 0), (2, True))


def test_a_potential_in_position_and_distance_is_conservative(plain: Callable[[Any], Any]):
    own = law("nearest", tall_god_object)
    loop, side = loop_across_the_ridge(own, plain)
    assert abs(loop) < 2e-3 * side  # measured, whatever the proof says
    assert curl_verdict(own).curl == sp.zeros(3, 1)
    assert curl_verdict(own).conservative


def test_a_formula_in_pieces_is_not_conservative(plain: Callable[[Any], Any]):
    own = law("nearest", two_sided_god_object)
    loop, side = loop_across_the_ridge(own, plain)
    assert abs(loop) > 0.1 * side  # measured, whatever the proof says
    assert not curl_verdict(own).conservative


def test_a_formula_in_pieces_on_the_vertical_contact_is_not_conservative():
    stiffer_high = sp.Piecewise((1, ContactSymbols().h > 0), (2, True))
    own = law("vertical", lambda c: c.k * c.depth * c.w * stiffer_high)
    assert not curl_verdict(own).conservative


def test_a_force_that_jumps_along_the_normal_at_contact_is_conservative():
    """U = k δ (1 mm) is continuous, though its gradient is not."""
    own = law("vertical", lambda c: c.k * c.w / 1000)
    assert curl_verdict(own).conservative

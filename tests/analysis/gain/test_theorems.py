"""Theorems belong to law objects: a user-defined law with a shipped letter has none."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.analysis.gain.test_gain_by_definition import LINES

from asperity.analysis.bounds.bound import NORM
from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.straight_scan import merit
from asperity.analysis.gain.characteristic import (
    characteristic_number,
    curl_number,
    one_sided_number,
)
from asperity.analysis.gain.medial_axis import sharpest_crest
from asperity.analysis.gain.theorems import THEOREMS, Constant, Theorem
from asperity.laws import LAWS, Law
from asperity.surface import Surface
from asperity.textures import Fourier, Sinusoid

STEEP = Sinusoid(amplitude=0.8e-3, period=1e-3)


def law_with_formula_of(letter: str, formula_of: str, factor: float = 1.0) -> Law:
    """Return a user-defined law with the letter of one shipped law and the formula of another."""
    law = LAWS[formula_of]

    def force(c: Any) -> Any:
        return factor * law.force(c)

    return Law(
        letter, "borrowed", law.contact, force, parameters=law.arguments, stateful=law.stateful
    )


@pytest.mark.parametrize("letter", ["E", "D", "H"])
def test_law_with_a_shipped_letter_has_the_numbers_of_its_formula(letter: str) -> None:
    """The formula of B under another letter has the merit and numbers of B."""
    b, borrowed = Surface(STEEP, "B"), Surface(STEEP, law_with_formula_of(letter, "B"))
    expected, result = merit(b), merit(borrowed)
    for name in ("strength", "support", "ripple", "gain", "contact_lost"):
        assert getattr(result, name) == pytest.approx(getattr(expected, name), rel=1e-9)
    for number in (characteristic_number, one_sided_number, curl_number):
        assert number(borrowed, 1e-3).value == pytest.approx(number(b).value, rel=2e-3)


def test_user_defined_god_object_does_not_use_the_theorem_of_law_d() -> None:
    """Twice the force of D under the letter D has q⁺ = 2, not the 1 of law D."""
    shallow = Sinusoid(amplitude=0.05e-3, period=1e-3)
    borrowed = Surface(shallow, law_with_formula_of("D", "D", 2.0))
    assert one_sided_number(borrowed, 1e-3).value == pytest.approx(2.0, rel=2e-3)
    q = characteristic_number(borrowed, 1e-3)
    assert q.value == pytest.approx(2.0, rel=2e-3)
    assert continuity(borrowed, q).continuous
    steep = Surface(STEEP, law_with_formula_of("D", "D", 2.0))
    q = characteristic_number(steep, work_limit=10_000)
    assert q.method == "sampled"
    assert not continuity(steep, q).continuous


def test_a_theorem_of_the_table_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half the smooth wall, whose number is known without a search."""
    law = law_with_formula_of("half", "W", 0.5)
    surface = Surface(STEEP, law)
    assert characteristic_number(surface).method == "certified"
    half = Constant(0.5, "-J = k e_z e_zᵀ/2")
    theorem = Theorem({NORM: half}, gain_above_height=lambda _surface, _height: 0.5)
    monkeypatch.setitem(THEOREMS, law, theorem)
    q = characteristic_number(surface)
    assert (q.value, q.method, q.note) == (0.5, "theorem", half.reason)
    assert q.lower == pytest.approx(0.5, rel=1e-12)
    assert (
        one_sided_number(surface).method == "certified"
    )  # the theorem does not cover the one-sided number
    assert merit(surface).gain == 0.5


def test_shipped_laws_have_theorems() -> None:
    assert THEOREMS.keys() == set(LAWS.values())


def test_law_d_on_many_waves_uses_the_hessian_bound() -> None:
    """Without a certified crest y = D K, where K is the sum of a |k|²."""
    angles = np.arange(5.0)
    vectors = (
        6000.0
        * np.column_stack([np.cos(angles), np.sin(angles)])
        * [[1.0], [1.1], [0.9], [1.3], [0.7]]
    )
    many = Fourier(np.full(5, 0.02e-3), vectors, angles)
    hessian = 0.02e-3 * float((vectors**2).sum())
    bound = characteristic_number(Surface(many, "D", max_depth=0.7 / hessian))
    assert bound.upper == pytest.approx(0.7 / 0.3, rel=1e-9)
    assert bound.method == "certified"


def test_number_of_law_d_is_infinite_from_the_crest_radius_on() -> None:
    """Infinite at exactly the radius of the sharpest crest, finite just above it."""
    crest = sharpest_crest(LINES)
    assert crest is not None
    for depth, infinite in ((crest.radius, True), (crest.radius * (1.0 - 1e-3), False)):
        bound = characteristic_number(Surface(LINES, "D", max_depth=depth))
        assert (bound.lower == math.inf) is infinite
        assert bound.method == "certified"
        if infinite:
            assert bound.at == crest.centre
            assert "onset" in bound.note

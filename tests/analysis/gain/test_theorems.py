"""Theorems belong to law objects: a law that borrows a letter borrows none."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.analysis.gain.test_gain_by_definition import LINES

from asperity.analysis.bounds.bound import NORM
from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.merit import merit
from asperity.analysis.gain.characteristic import (
    characteristic_number,
    curl_number,
    one_sided_number,
)
from asperity.analysis.gain.medial_axis import sharpest_crest
from asperity.analysis.gain.theorems import Constant, Theorem, register_theorem, theorem_of
from asperity.core.errors import ParameterError
from asperity.laws import LAWS, Law
from asperity.surface import Surface
from asperity.textures import Fourier, Sinusoid

STEEP = Sinusoid(amplitude=0.8e-3, period=1e-3)


def like(letter: str, formula_of: str, factor: float = 1.0) -> Law:
    """Return a law of a user's own with a shipped law's letter and another's formula."""
    law = LAWS[formula_of]

    def force(c: Any) -> Any:
        return factor * law.force(c)

    return Law(letter, "borrowed", law.contact, force, parameters=law.arguments,
               stateful=law.stateful)  # fmt: skip


@pytest.mark.parametrize("letter", ["E", "D", "H"])
def test_a_borrowed_letter_changes_no_number(letter: str) -> None:
    """The formula of B under another law's letter has B's merit and B's numbers."""
    b, own = Surface(STEEP, "B"), Surface(STEEP, like(letter, "B"))
    expected, found = merit(b), merit(own)
    for name in ("strength", "support", "ripple", "gain", "contact_lost"):
        assert getattr(found, name) == pytest.approx(getattr(expected, name), rel=1e-9)
    for number in (characteristic_number, one_sided_number, curl_number):
        assert number(own, 1e-3).value == pytest.approx(number(b).value, rel=2e-3)


def test_the_god_object_of_another_is_not_law_d() -> None:
    """Twice D's force under D's letter: q⁺ is 2, not D's 1, and q need not say where it jumps."""
    shallow = Sinusoid(amplitude=0.05e-3, period=1e-3)
    own = Surface(shallow, like("D", "D", 2.0))
    assert one_sided_number(own, 1e-3).value == pytest.approx(2.0, rel=2e-3)
    q = characteristic_number(own, 1e-3)
    assert q.value == pytest.approx(2.0, rel=2e-3)
    assert continuity(own, q).continuous
    steep = Surface(STEEP, like("D", "D", 2.0))
    q = characteristic_number(steep, work_limit=10_000)
    assert q.method == "sampled"
    assert not continuity(steep, q).continuous


def test_a_user_defined_theorem_is_used() -> None:
    """Half the smooth wall: its numbers are known without a search."""
    law = like("half", "W", 0.5)
    surface = Surface(STEEP, law)
    assert characteristic_number(surface).method == "certified"
    half = Constant(0.5, "-J = k e_z e_zᵀ/2")
    register_theorem(law, Theorem({NORM: half}, gain_above_height=lambda _surface, _height: 0.5))
    q = characteristic_number(surface)
    assert (q.value, q.method, q.note) == (0.5, "theorem", half.reason)
    assert q.lower == pytest.approx(0.5, rel=1e-12)
    assert one_sided_number(surface).method == "certified"  # it does not cover the others
    assert merit(surface).gain == 0.5
    with pytest.raises(ParameterError, match="already has a theorem"):
        register_theorem(law, Theorem())


@pytest.mark.parametrize("law", ["E", None, "half"])
def test_a_theorem_belongs_to_a_law_not_to_a_letter(law: Any) -> None:
    with pytest.raises(ParameterError, match="must be a Law"):
        register_theorem(law, Theorem())


def test_every_shipped_law_has_its_entry_and_none_can_be_replaced() -> None:
    for law in LAWS.values():
        assert theorem_of(law) != Theorem()
        with pytest.raises(ParameterError, match="already has a theorem"):
            register_theorem(law, Theorem())


def test_law_d_on_many_waves_has_the_bound_of_their_second_derivatives() -> None:
    """Where no crest is certified: y = D K, K the sum of a |k|²; an extent gives the crest's."""
    angles = np.arange(5.0)
    vectors = (
        6000.0
        * np.column_stack([np.cos(angles), np.sin(angles)])
        * [[1.0], [1.1], [0.9], [1.3], [0.7]]
    )
    many = Fourier(np.full(5, 0.02e-3), vectors, angles)
    hessian = 0.02e-3 * float((vectors**2).sum())
    found = characteristic_number(Surface(many, "D", max_depth=0.7 / hessian))
    assert found.upper == pytest.approx(0.7 / 0.3, rel=1e-9)
    assert found.method == "certified"


def test_law_d_down_to_the_very_onset_is_infinite() -> None:
    """At the sharpest crest's radius, to the last bit; just above it is a number."""
    crest = sharpest_crest(LINES)
    assert crest is not None
    for depth, infinite in ((crest.radius, True), (crest.radius * (1.0 - 1e-3), False)):
        found = characteristic_number(Surface(LINES, "D", max_depth=depth))
        assert (found.lower == math.inf) is infinite
        assert found.method == "certified"
        if infinite:
            assert found.at == crest.centre
            assert "onset" in found.note

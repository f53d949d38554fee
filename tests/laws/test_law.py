"""What a law may be, and that it stays what it is."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from asperity.contacts.symbols import ContactSymbols
from asperity.core.errors import LawError
from asperity.laws import LAWS, Law


def wall(c: ContactSymbols) -> Any:
    return c.k * c.depth * c.e_z


def test_a_law_needs_only_a_letter_a_name_a_contact_and_a_formula():
    law = Law("V", "plain-wall", "nominal", wall)
    assert (law.clampable, law.stateful, dict(law.parameters)) == (False, False, {})
    assert str(law) == "V (plain-wall)"


@pytest.mark.parametrize("letter", ["", "1", "a b", "A-B", "§"])
def test_the_letter_is_a_word(letter: str):
    with pytest.raises(LawError, match="letter or a word"):
        Law(letter, "name", "nominal", wall)


@pytest.mark.parametrize("contact", ["", "Nominal", "below", None])
def test_the_contact_is_one_of_the_known(contact: str):
    with pytest.raises(LawError, match=r"must be one of nominal, vertical, nearest.*got"):
        Law("V", "name", contact, wall)


def test_the_formula_is_a_function():
    with pytest.raises(LawError, match="force must be a function"):
        Law("V", "name", "nominal", "k*depth")


def test_a_law_cannot_be_changed():
    given = {"gain": 2.0}
    law = Law("V", "name", "nominal", wall, parameters=given)
    given["gain"] = 3.0
    assert dict(law.parameters) == {"gain": 2.0}
    with pytest.raises(TypeError):
        law.parameters["gain"] = 4.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        law.letter = "U"


@pytest.mark.parametrize("law", LAWS.values(), ids=str)
def test_every_shipped_law_has_a_line_for_tables(law: Law):
    assert 10 < len(law.summary) < 80
    assert not law.summary.endswith(".")

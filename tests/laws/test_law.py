"""Definition of a law: its valid arguments, and immutability."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from asperity.contacts.symbols import ContactSymbols
from asperity.core.errors import LawError
from asperity.laws import LAWS, Law


def wall(c: ContactSymbols) -> Any:
    return c.k * c.depth * c.e_z


def test_law_defaults():
    law = Law("V", "plain-wall", "nominal", wall)
    assert (law.clampable, law.stateful, dict(law.parameters)) == (False, False, {})
    assert str(law) == "V (plain-wall)"


@pytest.mark.parametrize("letter", ["", "1", "a b", "A-B", "§"])
def test_invalid_letter_is_an_error(letter: str):
    with pytest.raises(LawError, match="letter or a word"):
        Law(letter, "name", "nominal", wall)


@pytest.mark.parametrize("contact", ["", "Nominal", "below", None])
def test_unknown_contact_is_an_error(contact: str):
    with pytest.raises(LawError, match=r"must be one of nominal, vertical, nearest.*got"):
        Law("V", "name", contact, wall)


def test_formula_must_be_a_function():
    with pytest.raises(LawError, match="force must be a function"):
        Law("V", "name", "nominal", "k*depth")


def test_law_is_immutable():
    parameters = {"gain": 2.0}
    law = Law("V", "name", "nominal", wall, parameters=parameters)
    parameters["gain"] = 3.0
    assert dict(law.parameters) == {"gain": 2.0}
    with pytest.raises(TypeError):
        law.parameters["gain"] = 4.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        law.letter = "U"


@pytest.mark.parametrize("law", LAWS.values(), ids=str)
def test_shipped_laws_have_a_one_line_description(law: Law):
    assert 10 < len(law.summary) < 80
    assert not law.summary.endswith(".")

"""Lookup of laws by letter and name."""

from __future__ import annotations

import pytest

from asperity.core.errors import ParameterError
from asperity.laws import LAWS, Law, find_law, find_laws

NAMES = {
    "W": "smooth-wall",
    "A": "groove-wall-normal",
    "B": "groove-texture-normal",
    "C": "change-of-height",
    "D": "god-object",
    "E": "god-object-wall-normal",
    "F": "friction-modulation",
    "G": "force-shading",
}
CONTACTS = {
    **dict.fromkeys("WFG", "nominal"),
    **dict.fromkeys("ABC", "vertical"),
    **dict.fromkeys("DE", "nearest"),
}


def test_laws_are_ordered_with_the_wall_first():
    assert "".join(LAWS)[:8] == "WABCDEFG"


@pytest.mark.parametrize(("letter", "name"), NAMES.items())
def test_find_law_accepts_letters_and_names(letter: str, name: str):
    spellings = [letter, letter.lower(), f" {letter} ", name, name.upper(), name.replace("-", "_")]
    spellings.append(name.replace("-", " "))
    assert {find_law(spelling) for spelling in spellings} == {LAWS[letter]}
    assert (LAWS[letter].letter, LAWS[letter].name) == (letter, name)


@pytest.mark.parametrize(("letter", "contact"), CONTACTS.items())
def test_contact_of_each_law(letter: str, contact: str):
    assert LAWS[letter].contact.name == contact


def test_only_laws_of_unbounded_depth_are_clampable():
    assert {letter for letter, law in LAWS.items() if law.clampable} == set("ABCFG")


def test_only_friction_modulation_has_state():
    assert {letter for letter, law in LAWS.items() if law.stateful} == {"F"}


def test_find_law_accepts_a_law():
    law = Law("V", "own", "nominal", lambda c: c.k * c.depth * c.e_z)
    assert find_law(law) is law


@pytest.mark.parametrize(
    ("name", "nearest"),
    [("god-objet", "god-object"), ("force-shadng", "force-shading"), ("smoothwall", "smooth-wall")],
)
def test_unknown_law_suggests_similar_names(name: str, nearest: str):
    with pytest.raises(ParameterError, match=f"did you mean .*'{nearest}'") as caught:
        find_law(name)
    assert caught.value.argument == "law"
    assert repr(name) in str(caught.value)


@pytest.mark.parametrize("argument", [3, None, b"A", ["A"]])
def test_invalid_type_of_law_is_an_error(argument: object):
    with pytest.raises(ParameterError, match="letter, a name or a Law"):
        find_law(argument)


@pytest.mark.parametrize(
    ("laws", "letters"),
    [
        ("WBD", "WBD"),
        ("gfe", "GFE"),
        ("D", "D"),
        ("god-object", "D"),
        ("A, god-object,f", "ADF"),
        (["C", "smooth-wall", LAWS["G"]], "CWG"),
        (("E",), "E"),
    ],
)
def test_several_laws_keep_the_requested_order(laws: object, letters: str):
    result = find_laws(laws)
    assert "".join(law.letter for law in result) == letters


@pytest.mark.parametrize(
    ("laws", "argument", "message"),
    [
        ("", "laws", "at least one"),
        ("  ", "laws", "at least one"),
        ([], "laws", "at least one"),
        ("ABA", "laws", "names law A twice"),
        ("D,god-object", "laws", "names law D twice"),
        ("AXB", "law", "'X'"),
        (["A", "nothing"], "law", "'nothing'"),
    ],
)
def test_invalid_lists_of_laws_are_an_error(laws: object, argument: str, message: str):
    with pytest.raises(ParameterError, match=message) as caught:
        find_laws(laws)
    assert caught.value.argument == argument

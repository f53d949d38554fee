"""Finding laws by letter and by name."""

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


def test_the_wall_comes_first_and_the_letters_follow():
    assert "".join(LAWS)[:8] == "WABCDEFG"


@pytest.mark.parametrize(("letter", "name"), NAMES.items())
def test_every_spelling_finds_the_law(letter: str, name: str):
    spellings = [letter, letter.lower(), f" {letter} ", name, name.upper(), name.replace("-", "_")]
    spellings.append(name.replace("-", " "))
    assert {find_law(spelling) for spelling in spellings} == {LAWS[letter]}
    assert (LAWS[letter].letter, LAWS[letter].name) == (letter, name)


@pytest.mark.parametrize(("letter", "contact"), CONTACTS.items())
def test_every_law_names_its_contact(letter: str, contact: str):
    assert LAWS[letter].contact.name == contact


def test_only_the_laws_on_an_unbounded_depth_are_clampable():
    assert {letter for letter, law in LAWS.items() if law.clampable} == set("ABCFG")


def test_only_friction_modulation_carries_state():
    assert {letter for letter, law in LAWS.items() if law.stateful} == {"F"}


def test_a_law_is_returned_as_it_is():
    own = Law("V", "own", "nominal", lambda c: c.k * c.depth * c.e_z)
    assert find_law(own) is own


@pytest.mark.parametrize(
    ("wrong", "nearest"),
    [("god-objet", "god-object"), ("force-shadng", "force-shading"), ("smoothwall", "smooth-wall")],
)
def test_an_unknown_law_offers_the_nearest(wrong: str, nearest: str):
    with pytest.raises(ParameterError, match=f"did you mean .*'{nearest}'") as caught:
        find_law(wrong)
    assert caught.value.argument == "law"
    assert repr(wrong) in str(caught.value)


@pytest.mark.parametrize("wrong", [3, None, b"A", ["A"]])
def test_what_is_no_text_is_no_law(wrong: object):
    with pytest.raises(ParameterError, match="letter, a name or a Law"):
        find_law(wrong)


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
def test_several_laws_in_the_order_asked_for(laws: object, letters: str):
    found = find_laws(laws)
    assert "".join(law.letter for law in found) == letters


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
def test_several_laws_that_cannot_be(laws: object, argument: str, message: str):
    with pytest.raises(ParameterError, match=message) as caught:
        find_laws(laws)
    assert caught.value.argument == argument

"""Declared arguments: parsing, validation, signatures and docstrings."""

from __future__ import annotations

import inspect
from typing import Any

import pytest

from asperity.core.arguments import (
    MAX_DEPTH,
    STIFFNESS,
    Argument,
    Form,
    document_arguments,
    parse_arguments,
)
from asperity.core.errors import ParameterError
from asperity.measured.file_arguments import FILE_ARGUMENTS, PREPARATION_ARGUMENTS
from asperity.measured.preparation import prepare
from asperity.scene.scene_file import CLAMP, LAW
from asperity.surface import Surface
from asperity.textures import load_texture

VALID = [
    ("quantity", "1.5 mm", 1.5e-3),
    ("quantity", "2m", 2.0),
    ("pair", "5 µm; 8 µm", (5e-6, 8e-6)),
    ("pair", "5 µm, 8 µm", (5e-6, 8e-6)),
    ("pair", "5 µm", 5e-6),
    ("vector", "1m 0.4m", [1.0, 0.4]),
    ("vector", "1 400 mm", [1e-3, 0.4]),
    ("vector", ["1 mm", 0], [1e-3, 0.0]),
    ("items", ["1 mm", "2 mm"], [1e-3, 2e-3]),
    ("vectors", "3 1 m; -1m 4m", [[3.0, 1.0], [-1.0, 4.0]]),
    ("vectors", "3 m; 4m", [3.0, 4.0]),
    ("space", "1mm; 0; -2mm", (1e-3, 0.0, -2e-3)),
    ("plane", ["37.5 mm", "0.1 m"], (37.5e-3, 0.1)),
    ("axes", "3m", 3.0),
    ("axes", ["1m", "2m", "3m"], (1.0, 2.0, 3.0)),
    ("direction", "Y", (0.0, 1.0)),
    ("direction", "1,0.5", (1.0, 0.5)),
    ("integer", "3", 3),
    ("switch", "Yes", True),
    ("switch", False, False),
    ("channel", "2", 2),
    ("channel", "height", "height"),
    ("text", "um", "um"),
    ("size", "1.5GiB", 1610612736),
    ("size", "2 kB", 2000),
    ("size", "512B", 512),
    ("size", "0", 0),
]


@pytest.mark.parametrize(("form", "text", "value"), VALID)
def test_each_form_parses_text_numbers_and_lists(form: Form, text: Any, value: Any) -> None:
    unit = "" if form in {"integer"} else "m"
    parsed = Argument("length", "of something", unit, form=form).parse(text)
    assert parsed == value
    assert type(parsed) is type(value)


INVALID = [
    ("quantity", "3 N", "dimension"),
    ("size", "4000", "needs a unit: write 4000MB or 4000GB"),
    ("size", 4000, "needs a unit: write 4000MB or 4000GB"),
    ("quantity", "3", "needs a unit: write 3mm or 3um or 3m"),
    ("pair", "3mm; 4", "write 4mm or 4um or 4m"),
    ("pair", 3, "write 3mm"),
    ("vector", "1 0.4", "write 1mm"),
    ("vectors", "3m 1m; -1 4", "write -1mm"),
    ("items", [1, 2], "write 1mm"),
    ("space", "0; 0; 3", "write 3mm"),
    ("axes", 3, "write 3mm"),
    ("pair", "1;2;3", "1 or 2 quantities"),
    ("space", "1;2", "3 quantities"),
    ("plane", "1;2;3", "2 quantities"),
    ("axes", "1;2", "3 quantities"),
    ("direction", "0,0", "must have a length"),
    ("direction", "up", "must be x, y"),
    ("integer", "2.5", "whole number"),
    ("switch", "perhaps", "true or false"),
    ("channel", True, "name or a whole number"),
    ("text", 3, "must be text"),
]


@pytest.mark.parametrize(("form", "text", "message"), INVALID)
def test_each_form_refuses_invalid_values(form: Form, text: Any, message: str) -> None:
    with pytest.raises(ParameterError, match=message) as error:
        Argument("length", "of something", "m", form=form).parse(text)
    assert error.value.argument == "length"


def test_bounds_apply_to_every_component() -> None:
    sides = Argument("extent", "of the part", "m", form="pair", must_be_positive=True)
    assert sides.validate([1e-3, 2e-3]) == [1e-3, 2e-3]
    with pytest.raises(ParameterError, match=r"extent must be positive \[m\], got -0.002"):
        sides.validate([1e-3, -2e-3])
    share = Argument("share", "of all", maximum=1.0)
    with pytest.raises(ParameterError, match="share must be 0 to 1"):
        share.validate(1.5)
    count = Argument("count", "of steps", form="integer", minimum=1)
    with pytest.raises(ParameterError, match="count must be a whole number, 1 or more"):
        count.validate(0)


def test_error_for_an_unknown_key_suggests_the_nearest() -> None:
    arguments = (Argument("gain", "of the spring"), Argument("phase", "at the origin", "rad"))
    assert parse_arguments("surface", {"gain": "2.5"}, arguments) == {"gain": 2.5}
    with pytest.raises(ParameterError, match=r"surface\.gian is unknown; did you mean 'gain'"):
        parse_arguments("surface", {"gian": "2.5"}, arguments)


def _keywords(function: Any, *excluded: str) -> dict[str, inspect.Parameter]:
    parameters = inspect.signature(function).parameters
    return {name: parameter for name, parameter in parameters.items() if name not in excluded}


def test_signatures_match_the_declared_arguments() -> None:
    """The keywords of Python functions have the declared names, order and defaults."""
    names = [argument.name for argument in FILE_ARGUMENTS]
    assert (
        list(_keywords(load_texture, "path", "cutoff")) == names
    )  # cutoff: former name of s_cutoff
    prepare_keywords = _keywords(prepare, "raw", "progress", "on_stage")
    assert list(prepare_keywords) == [argument.name for argument in PREPARATION_ARGUMENTS]
    for argument in PREPARATION_ARGUMENTS:
        if argument.form != "switch":
            assert prepare_keywords[argument.name].default == argument.default, argument.name
    surface_keywords = _keywords(Surface, "texture", "law_parameters")
    for argument in (LAW, STIFFNESS, MAX_DEPTH, CLAMP):
        assert surface_keywords[argument.name].default == argument.default


def test_docstrings_list_the_declared_arguments() -> None:
    for function, arguments in ((load_texture, FILE_ARGUMENTS), (prepare, PREPARATION_ARGUMENTS)):
        text = inspect.getdoc(function) or ""
        for argument in arguments:
            assert f"\n    {argument.name}: {argument.description}" in text


@pytest.mark.parametrize(
    "indent", ["    ", "        "]
)  # Python 3.13 removes the indentation of the code
def test_list_of_arguments_is_indented_like_its_placeholder(indent: str) -> None:
    def function() -> None: ...

    function.__doc__ = f"One.\n\n{indent}{{arguments}}\n{indent}last"
    document_arguments((Argument("gain", "of the spring"), Argument("phase", "at 0", "rad")))(
        function
    )
    lines = ["gain: of the spring.", "phase: at 0 [rad].", "last"]
    assert function.__doc__ == "One.\n\n" + "\n".join(indent + line for line in lines)
    function.__doc__ = None  # python -OO
    assert document_arguments(())(function).__doc__ is None

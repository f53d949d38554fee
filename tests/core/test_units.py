"""Parsing and formatting of quantities with units."""

from __future__ import annotations

import pytest

from asperity.core import units
from asperity.core.errors import ParameterError
from asperity.core.units import format_quantity, parse_quantity


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("0.8mm", "m", 0.0008),
        ("0.8 mm", "m", 0.0008),
        ("500N/m", "N/m", 500.0),
        ("500 N/m", "N/m", 500.0),
        ("0.5 N/mm", "N/m", 500.0),
        ("5 µm", "m", 5e-6),
        ("5um", "m", 5e-6),
        ("1e-3 m", "m", 1e-3),
        ("2 rad/mm", "rad/m", 2000.0),
        ("90 deg", "rad", 1.5707963267948966),
        ("5 1/mm", "1/m", 5000.0),
        ("2 N*s/m", "N*s/m", 2.0),
        ("2 N s m^-1", "N*s/m", 2.0),
        ("2 kg*s**-2", "N/m", 2.0),
        ("3 mm²", "m**2", 3e-6),
        ("3", "", 3.0),
        (3, "", 3.0),
        ("0", "m", 0.0),
        (0, "N/m", 0.0),
        ("20", "", 20.0),
    ],
)
def test_quantities_are_parsed_in_si_units(text: str | float, unit: str, value: float) -> None:
    assert parse_quantity("x", text, unit) == value


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("5 N", "m"),
        ("abc", "m"),
        ("5 foo", "m"),
        ("nan", "m"),
        ("inf", "m"),
        ("", "m"),
        ("5 mm", ""),
        (True, "m"),
        (None, "m"),
        ("5 m; import os", "m"),
        ("1e999", "m"),
        pytest.param(10**400, "m", id="400 digits"),
        pytest.param(-(10**5000), "m", id="5000 digits"),
        pytest.param("1" + "0" * 5000, "m", id="5000 digits as text"),
        pytest.param("1e" + "9" * 5000 + " mm", "m", id="an exponent of 5000 digits"),
        ("1 m*9**9**9", "m"),
        ("1 m**99999", "m"),
        ("1 m^(2)", "m"),
        ("1 2 m", "m"),
        ("1 m*9", "m"),
        ("1 m.__class__", "m"),
        ("1 m[0]", "m"),
        ("1 m*", "m"),
        ("1 *m", "m"),
        pytest.param("1 " + "m*" * 40 + "m", "m", id="a long unit"),
        pytest.param("1 " + "m " * 50_000 + "!", "m", id="100 kB of units"),
    ],
)
def test_error_for_an_invalid_quantity_names_the_argument(text: object, unit: str) -> None:
    with pytest.raises(ParameterError) as error:
        parse_quantity("period", text, unit)
    assert error.value.argument == "period"


@pytest.mark.parametrize(
    ("number", "unit", "suggestions"),
    [
        ("500", "N/m", "500N/m"),
        (500, "N/m", "500N/m"),
        ("1.50 ", "m", "1.50mm or 1.50um or 1.50m"),
        (-1e-3, "m", "-0.001mm or -0.001um or -0.001m"),
        ("90", "rad", "90deg or 90rad"),
        (2, "s", "2s or 2ms"),
        (3, "N*s/m", "3N*s/m"),
    ],
)
def test_number_without_a_unit_is_refused_with_suggestions(
    number: str | float, unit: str, suggestions: str
) -> None:
    """Each suggestion is a valid quantity."""
    with pytest.raises(ParameterError) as error:
        parse_quantity("length", number, unit)
    assert str(error.value) == f"length needs a unit: write {suggestions}, got {number!r}"
    for suggestion in suggestions.split(" or "):
        assert parse_quantity("length", suggestion, unit) != 0.0
    assert parse_quantity("length", number, "") == float(number)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.0008, "m", "0.8 mm"),
        (5e-6, "m", "5 µm"),
        (0.00165, "J", "1.65 mJ"),
        (5000.0, "N/m", "5000 N/m"),
        (975.69, "N/m", "976 N/m"),
        (0.0, "J", "0 J"),
    ],
)
def test_quantities_are_formatted_with_si_prefixes(value: float, unit: str, text: str) -> None:
    assert format_quantity(value, unit) == text


def test_common_unit_factors_equal_those_of_pint() -> None:
    for unit, factors in units._SI_FACTORS.items():
        for name, factor in factors.items():
            assert units._UNIT_PATTERN.fullmatch(name) is not None
            assert factor == units._unit_registry().Quantity(1.0, name).to(unit).magnitude, name

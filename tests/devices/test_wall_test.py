"""Wall tests in a device file: their contents and errors."""

from __future__ import annotations

import pytest

from asperity.core.errors import ParameterError
from asperity.devices import Datum, Device, WallTest, load_device, parse_device

FULL = {
    "value": "1.8 N/mm",
    "directions": ["x", "z", "x"],
    "cycled": "2 N/mm",
    "update_rate": "1 kHz",
    "positions": "stepped",
    "lightest": 0.7,
    "source": "tried",
    "verified": "measured",
}


def test_all_fields_of_a_wall_test_are_parsed() -> None:
    test = parse_device({"max_stiffness": FULL}, "mine").wall_test
    assert test == WallTest(
        1800.0, "N/m", "tried", True, (), "measured", ("x", "z"), 2000.0, 1000.0, "stepped", 0.7
    )
    assert test.to_dict() == {
        "value": 1800.0,
        "unit": "N/m",
        "source": "tried",
        "verified": "measured",
        "also": [],
        "directions": ["x", "z"],
        "cycled": 2000.0,
        "update_rate": 1000.0,
        "positions": "stepped",
        "lightest": 0.7,
    }


def test_plain_stiffness_is_a_wall_test_without_details() -> None:
    wall_test = parse_device({"max_stiffness": "1 kN/m"}, "mine").wall_test
    assert wall_test == WallTest(1000.0, "N/m", "given by the user", False)
    device = Device("x", "x", {"max_stiffness": Datum(1000.0, "N/m", "given by the user", False)})
    assert device.wall_test == wall_test
    assert parse_device({}, "mine").wall_test is None


def test_only_the_papers_wall_was_measured() -> None:
    pedigrees = {
        name: load_device(name).data["max_stiffness"].pedigree
        for name in ("omega.3", "touch", "inverse3", "pantograph")
    }
    assert pedigrees == {
        "omega.3": "read",
        "touch": "read",
        "inverse3": "read",
        "pantograph": "measured",
    }


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"cycled": "1.8 N/mm"}, r"cycled must be above the stiffness that held, 1800 N/m"),
        ({"cycled": "2 N"}, "another dimension"),
        ({"cycled": -1}, "must be positive"),
        ({"update_rate": 0}, r"update_rate must be positive"),
        ({"lightest": 1.2}, "must be at most 1"),
        ({"lightest": 0}, r"lightest must be positive"),
        ({"positions": "fine"}, "'exact' or 'stepped'"),
        ({"positions": ["exact"]}, "'exact' or 'stepped'"),
        ({"directions": "z"}, "list of 'x', 'y' and 'z'"),
        ({"directions": ["up"]}, "list of 'x', 'y' and 'z'"),
        ({"directions": [["x"]]}, "list of 'x', 'y' and 'z'"),
        ({"verified": "seen"}, "'measured' or 'simulated'"),
        ({"verified": ["read"]}, "'measured' or 'simulated'"),
        ({"heard": 3}, "unknown key 'heard'"),
        ({"also": [{"value": 3, "cycled": 4}]}, "unknown key 'cycled'"),
    ],
)
def test_invalid_wall_test_is_an_error(change: dict[str, object], message: str) -> None:
    with pytest.raises(ParameterError, match=message) as caught:
        parse_device({"max_stiffness": {**FULL, **change}}, "mine")
    assert "device.max_stiffness" in str(caught.value)


def test_wall_fields_are_unknown_in_other_fields() -> None:
    with pytest.raises(ParameterError, match="unknown key 'cycled'"):
        parse_device({"update_rate": {"value": 1000, "cycled": 3}}, "mine")

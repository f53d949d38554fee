"""Device files of users: their valid contents, and errors that name the reason."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from asperity.core.errors import ParameterError
from asperity.devices import load_device, parse_device


def test_load_device_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(
        'name = "My arm"\naxes = "x right"\nnotes = ["old"]\nmax_stiffness = "1.2 N/mm"\n'
        '[update_rate]\nvalue = 2\nunit = "kHz"\nsource = "measured"\nverified = true\n'
        '[[update_rate.also]]\nvalue = "1 kHz"\nsource = "by USB 2"\n'
    )
    device = load_device(path)
    assert (device.id, device.name, device.axes, device.notes) == (
        "mine",
        "My arm",
        "x right",
        ("old",),
    )
    assert device.max_stiffness == pytest.approx(1200.0)
    rate = device.data["update_rate"]
    assert (rate.value, rate.source, rate.verified) == (2000.0, "measured", True)
    assert [(datum.value, datum.source, datum.verified) for datum in rate.also] == [
        (1000.0, "by USB 2", False)
    ]
    stiffness = device.data["max_stiffness"]
    assert (stiffness.source, stiffness.verified, stiffness.also) == (
        "given by the user",
        False,
        (),
    )


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_byte_order_mark_is_ignored(tmp_path: Path, mark: bytes) -> None:
    path = tmp_path / "mine.TOML"
    path.write_bytes(mark + b"max_force = '5 N'\r\n")
    assert load_device(str(path)).value("max_force") == 5.0


@pytest.mark.parametrize(
    ("content", "field", "value"),
    [
        ({"delay_samples": 0}, "delay_samples", 0.0),
        ({"delay_samples": "3"}, "delay_samples", 3.0),
        ({"delay_samples": {"value": 2, "unit": "1"}}, "delay_samples", 2.0),
        ({"virtual_damping": 0}, "virtual_damping", 0.0),
        ({"virtual_damping": "-3 N*s/m"}, "virtual_damping", -3.0),
        ({"friction": 0}, "friction", 0.0),
        ({"base_distance": 0}, "base_distance", 0.0),
        ({"damping": "0.5 N*s/m"}, "damping", 0.5),
        ({"damping": {"value": 0.5, "unit": "N s/mm"}}, "damping", 500.0),
        ({"max_stiffness": {"value": "5", "unit": "N/mm"}}, "max_stiffness", 5000.0),
        ({"position_resolution": {"value": 55, "unit": "um"}}, "position_resolution", 5.5e-5),
    ],
)
def test_valid_values_are_parsed(content: dict[str, object], field: str, value: float) -> None:
    assert parse_device(content, "mine").value(field) == value


@pytest.mark.parametrize(
    ("field", "value", "unit"),
    [
        ("max_force", "12 N", "N"),
        ("max_stiffness", "5 N/mm", "N/m"),
        ("position_resolution", "10 um", "m"),
    ],
)
def test_unit_in_value_and_field_is_an_error(field: str, value: str, unit: str) -> None:
    with pytest.raises(ParameterError, match=f"device.{field} has its unit twice, in .{value}."):
        parse_device({field: {"value": value, "unit": unit}}, "mine")


INVALID_CONTENT = [
    ({"max_stifness": "3 N/m"}, "did you mean 'max_stiffness'"),
    ({"dampening": 3}, "did you mean 'damping'"),
    ({"max_stiffness": "3 N"}, "another dimension"),
    ({"max_stiffness": {"value": 3, "unit": "N"}}, r"max_stiffness\.unit .*another dimension"),
    ({"max_stiffness": {"value": 3, "unit": "furlongg"}}, "not understood"),
    ({"max_stiffness": {"value": 3, "unit": "2 N/m"}}, r"max_stiffness\.unit"),
    ({"max_stiffness": {"value": 3, "unit": ""}}, r"max_stiffness\.unit"),
    ({"max_stiffness": {"value": 3, "unit": 7}}, "must be text such as 'N/m'"),
    ({"max_stiffness": {"value": 3, "unit": "1"}}, "must be text such as 'N/m'"),
    ({"delay_samples": {"value": 3, "unit": 1}}, "plain number"),
    ({"max_stiffness": "1200"}, "max_stiffness needs a unit: write 1200N/m, got '1200'"),
    ({"max_stiffness": {"value": "1200"}}, "needs a unit: write 1200N/m"),
    ({"apparent_mass": "45"}, "apparent_mass needs a unit: write 45g or 45kg"),
    ({"max_stiffness": 0}, "must be positive"),
    ({"max_stiffness": -1}, "must be positive"),
    ({"max_stiffness": "1e-400 N/m"}, "must be positive"),
    ({"max_stiffness": "many"}, "quantity"),
    ({"max_stiffness": [3]}, "quantity"),
    ({"max_stiffness": True}, "quantity"),
    ({"max_stiffness": {"value": False, "unit": "N/m"}}, "must be a number"),
    ({"max_stiffness": {"value": True, "unit": "N/mm"}}, "must be a number"),
    ({"max_stiffness": math.inf}, "must be finite"),
    ({"max_stiffness": math.nan}, "must be finite"),
    ({"max_stiffness": {"value": math.nan, "unit": "N/mm"}}, "must be finite"),
    ({"max_stiffness": "inf N/m"}, "quantity"),
    ({"max_stiffness": "1e400 N/m"}, "must be finite"),
    ({"max_stiffness": {"value": 1e308, "unit": "kN/mm"}}, "must be finite"),
    ({"max_stiffness": 10**400}, "must be finite"),
    ({"max_stiffness": {"source": "x"}}, "no value"),
    ({"max_stiffness": {}}, "no value"),
    ({"max_stiffness": {"value": 3, "units": "N/m"}}, "unknown key 'units'"),
    ({"max_stiffness": {"value": 3, "verified": "yes"}}, "true or false"),
    ({"max_stiffness": {"value": 3, "verified": 1}}, "true or false"),
    ({"max_stiffness": {"value": 3, "source": 4}}, r"source must be text"),
    ({"max_stiffness": {"value": 3, "source": ""}}, r"source must be text"),
    ({"max_stiffness": {"value": 3, "also": 4}}, "must be a list of tables"),
    ({"max_stiffness": {"value": 3, "also": [4]}}, "must be a list of tables"),
    ({"max_stiffness": {"value": 3, "also": [{"value": 0}]}}, r"also must be positive"),
    ({"max_stiffness": {"value": 3, "also": [{"value": 1, "also": []}]}}, "unknown key 'also'"),
    ({"damping": 0}, r"damping must be positive"),
    ({"damping": -0.5}, r"damping must be positive"),
    ({"joint_damping": 0.0}, r"joint_damping must be positive"),
    ({"update_rate": 0}, r"update_rate must be positive"),
    ({"update_rate": "0 kHz"}, r"update_rate must be positive"),
    ({"friction": -0.1}, "must not be negative"),
    ({"delay_samples": -1}, "whole number, 0 or more"),
    ({"delay_samples": 1.5}, "whole number"),
    ({"delay_samples": "1 ms"}, "must be a number"),
    ({"delay_samples": {"value": 1, "unit": "ms"}}, "plain number"),
    ({"delay_samples": True}, "must be a number"),
    ({"encoder_counts": 0}, "whole number, 1 or more"),
    ({"virtual_damping": math.inf}, "must be finite"),
    ({"max_force": "3 N", "continuous_force": "4 N"}, "must not be greater than max_force, 3 N"),
    ({"id": 5}, r"device\.id must be text"),
    ({"id": " "}, r"device\.id must be text"),
    ({"name": "two\nlines"}, r"device\.name must be text on one line"),
    ({"name": "\x1b[31mred"}, r"device\.name must be text on one line"),
    ({"axes": 3}, r"device\.axes must be text"),
    ({"notes": "one"}, "list of sentences"),
    ({"notes": [1]}, r"device\.notes must be text"),
]


@pytest.mark.parametrize(("content", "message"), INVALID_CONTENT, ids=lambda value: str(value)[:60])
def test_invalid_content_is_an_error(content: dict[str, object], message: str) -> None:
    with pytest.raises(ParameterError, match=message) as caught:
        parse_device(content, "mine")
    assert "device" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 700


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("max_stiffness = 1200", "device.max_stiffness needs a unit: write 1200N/m, got 1200"),
        ("apparent_mass = 0.045", "write 0.045g or 0.045kg"),
        ("[damping]\nvalue = 2.5\nsource = 'x'", "device.damping needs a unit: write 2.5N"),
        ("[damping]\nvalue = '1 N*s/m'\n[[damping.also]]\nvalue = 2.5", "write 2.5N"),
        ("[max_stiffness]\nvalue = '2 N/mm'\ncycled = 2500", "cycled needs a unit: write 2500N/m"),
        ("[max_stiffness]\nvalue = '2 N/mm'\nupdate_rate = 1", "update_rate needs a unit"),
    ],
)
def test_number_without_unit_is_an_error(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(ParameterError, match=re.escape(message)):
        load_device(tmp_path / "mine.toml")


def test_numbers_with_units_or_without_dimension_are_valid(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(
        "delay_samples = 2\nfriction = 0\n"
        "[max_stiffness]\nvalue = 2\nunit = 'N/mm'\nlightest = 0.8\ncycled = '2.5 N/mm'\n"
        "[[max_stiffness.also]]\nvalue = 3\nunit = 'N/mm'\n"
    )
    device = load_device(tmp_path / "mine.toml")
    assert (device.value("delay_samples"), device.value("friction")) == (2.0, 0.0)
    assert device.wall_test is not None
    assert (device.max_stiffness, device.wall_test.cycled) == (2000.0, 2500.0)


def test_corrected_contents_are_valid() -> None:
    """Control: the invalid contents above are rejected only for their error."""
    parse_device({"max_force": "3 N", "continuous_force": "3 N"}, "mine")
    parse_device({"max_stiffness": {"value": 3, "unit": "N/m", "verified": True}}, "mine")
    parse_device({"name": "μ-arm · 2", "notes": ["a", "b"]}, "mine")


INVALID_FILES = {
    "broken.toml": b"a = = b",
    "twice.toml": b"max_force = 1\nmax_force = 2",
    "latin.toml": "name = 'Gerät'".encode("latin-1"),
    "sixteen.toml": "max_force = 1".encode("utf-16"),
    "digits.toml": b"max_force = " + b"9" * 5000,
    "deep.toml": b"max_force = " + b"[" * 3000,
}


@pytest.mark.parametrize("name", list(INVALID_FILES))
def test_invalid_toml_is_an_error(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(INVALID_FILES[name])
    with pytest.raises(ParameterError, match=f"{name} is (not valid TOML|nested too deeply)"):
        load_device(tmp_path / name)


def test_unreadable_files_are_an_error(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="cannot be read"):
        load_device(tmp_path / "none.toml")
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(ParameterError, match="cannot be read"):
        load_device(tmp_path / "folder.toml")
    with pytest.raises(ParameterError, match="device"):
        load_device("a\0b.toml")

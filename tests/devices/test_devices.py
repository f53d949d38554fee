"""The catalogue and device files."""

from __future__ import annotations

from pathlib import Path

import pytest

from asperity.devices import device_names, load_device, parse_device
from asperity.errors import ParameterError


def test_catalogue_has_the_four_devices_with_sources() -> None:
    assert {"omega.3", "touch", "inverse3", "pantograph"} <= set(device_names())
    for name in device_names():
        device = load_device(name)
        assert device.max_stiffness > 0.0
        for datum in device.data.values():
            assert datum.source
            assert datum.value > 0.0


@pytest.mark.parametrize(
    ("name", "field", "value"),
    [
        ("omega.3", "max_stiffness", 5000.0),
        ("omega.3", "max_force", 12.0),
        ("touch", "max_stiffness", 400.0),
        ("touch", "max_force", 3.3),
        ("inverse3", "max_stiffness", 1000.0),
        ("inverse3", "force_resolution", 0.014),
        ("pantograph", "position_resolution", 15e-6),
    ],
)
def test_sourced_numbers(name: str, field: str, value: float) -> None:
    datum = load_device(name).data[field]
    assert datum.value == pytest.approx(value, rel=1e-12)
    assert datum.verified


def test_remembered_numbers_are_not_verified() -> None:
    assert not load_device("omega.3").data["update_rate"].verified
    assert not load_device("touch").data["friction"].verified


def test_case_does_not_matter() -> None:
    assert load_device("OMEGA.3").id == "omega.3"


def test_unknown_device_offers_the_nearest() -> None:
    with pytest.raises(ParameterError, match=r"did you mean 'omega\.3'"):
        load_device("omega3")


def test_device_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(
        'name = "My arm"\nmax_stiffness = "1.2 N/mm"\n'
        '[update_rate]\nvalue = 2\nunit = "kHz"\nsource = "measured"\nverified = true\n'
    )
    device = load_device(path)
    assert (device.id, device.name) == ("mine", "My arm")
    assert device.max_stiffness == pytest.approx(1200.0)
    assert device.data["update_rate"].value == pytest.approx(2000.0)
    assert device.data["update_rate"].verified
    assert not device.data["max_stiffness"].verified


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"max_stifness": "3 N/m"}, "did you mean 'max_stiffness'"),
        ({"max_stiffness": "3 N"}, "another dimension"),
        ({"max_stiffness": 0}, "positive"),
        ({"max_stiffness": "many"}, "quantity"),
        ({"max_stiffness": {"source": "x"}}, "no value"),
        ({"max_stiffness": {"value": 3, "units": "N/m"}}, "unknown key 'units'"),
        ({"max_stiffness": {"value": 3, "verified": "yes"}}, "true or false"),
    ],
)
def test_bad_content(content: dict[str, object], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        parse_device(content, "mine")


def test_bad_files(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="cannot be read"):
        load_device(tmp_path / "none.toml")
    (tmp_path / "bad.toml").write_text("a = = b")
    with pytest.raises(ParameterError, match="not valid TOML"):
        load_device(tmp_path / "bad.toml")

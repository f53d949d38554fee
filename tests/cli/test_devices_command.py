"""``asperity devices``: the catalogue and the details of one device."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from asperity.devices import FIELD_UNITS, device_names, load_device

Call = Callable[..., tuple[int, str, str]]


COMMAND = "devices"  # what the fixture "call" runs
WIDTH = 100


@pytest.mark.parametrize("width", [80, 100, 120])
def test_list_fits_the_terminal_and_starts_rows_with_the_id(call: Call, width: int) -> None:
    code, out, err = call(width=width)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert max(len(line) for line in lines) <= width
    assert "…" not in out
    ids = [line.split()[0] for line in lines if line.split() and line.split()[0] in device_names()]
    assert ids == device_names()


def row(out: str, name: str) -> list[str]:
    return next(line.split() for line in out.splitlines() if line.split()[:1] == [name])


def test_only_unverified_numbers_are_marked(call: Call) -> None:
    _code, out, _err = call(width=80)
    assert " ".join(row(out, "omega.3")) == "omega.3 12 N 5000 N/m 10 µm ? – 4 kHz ? –"
    assert " ".join(row(out, "inverse3")) == "inverse3 10 N 1000 N/m 10 µm 14 mN 4 kHz –"
    assert "? not verified" in out


@pytest.mark.parametrize("width", [80, 100])
@pytest.mark.parametrize("name", device_names())
def test_details_show_every_number_with_its_source(call: Call, name: str, width: int) -> None:
    code, out, err = call(name.upper(), width=width)
    assert (code, err) == (0, "")
    assert max(len(line) for line in out.splitlines()) <= width
    device = load_device(name)
    flat = " ".join(out.split())
    assert device.name in flat
    for field, first in device.data.items():
        assert field.replace("_", " ") in flat
        for datum in (first, *first.also):
            mark = datum.pedigree if datum.verified else "no"
            assert f"{datum.text} {mark} {datum.source.split()[0]}" in flat


def test_missing_data_is_listed(call: Call) -> None:
    _code, out, _err = call("touch")
    missing = out[out.index("Missing data") :]
    assert "update_rate [Hz]" in missing
    assert "damping [N*s/m]" in missing
    assert "friction" not in missing  # known, so not listed


def test_alternative_values_follow_the_value_in_use(call: Call) -> None:
    _code, out, _err = call("omega.3")
    lines = [line.split() for line in out.splitlines()]
    index = next(i for i, words in enumerate(lines) if words[:2] == ["max", "stiffness"])
    assert lines[index][2:5] == ["5000", "N/m", "read"]
    also = next(words for words in lines[index + 1 :] if words[:1] == ["also"])
    assert also[:4] == ["also", "14500", "N/m", "no"]


def test_user_defined_device_is_shown(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    path.write_text('name = "[bold]Bench[/bold]"\ndamping = "0.8 N*s/m"\nupdate_rate = "2 kHz"\n')
    code, out, _err = call(str(path))
    assert code == 0
    assert "[bold]Bench[/bold] (bench)" in out  # a user's text is no markup
    assert "0.8 N·s/m" in out
    assert "given by the user" in out


def test_json_has_all_data_and_is_the_only_output(call: Call) -> None:
    code, out, err = call("--json", "-")
    assert (code, err) == (0, "")
    content = json.loads(out)
    assert content["schema"] == 1
    assert [device["id"] for device in content["devices"]] == device_names()
    for device in content["devices"]:
        for field, datum in device["data"].items():
            assert datum["unit"] == FIELD_UNITS[field]
            keys = {"value", "unit", "source", "verified", "also"}
            if field == "max_stiffness":
                keys |= {"update_rate", "rate_source"}
            if field == "max_stiffness" and device["id"] == "pantograph":
                keys.add("positions")
                assert (datum["verified"], datum["positions"]) == ("measured", "stepped")
            assert set(datum) == keys
    code, out, _err = call("touch", "omni", "--json", "-")
    assert [device["id"] for device in json.loads(out)["devices"]] == ["touch", "omni"]


def test_json_is_written_to_a_file(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "devices.json"
    code, out, _err = call("falcon", "--json", str(path))
    assert code == 0
    assert "Novint Falcon" in out
    assert json.loads(path.read_text("utf-8"))["devices"][0]["data"]["max_force"]["value"] == 8.0
    assert [item.name for item in tmp_path.iterdir()] == ["devices.json"]


BAD_FILES = {
    "unknown.toml": ("max_stifness = 3", "did you mean 'max_stiffness'"),
    "dimension.toml": ('max_stiffness = "3 N"', "another dimension"),
    "contradiction.toml": ('[max_force]\nvalue = "12 N"\nunit = "mm"', "is of another dimension"),
    "factor.toml": ('[max_stiffness]\nvalue = "5 N/mm"\nunit = "N/m"', "has its unit twice"),
    "damping.toml": ("damping = 0", "must be positive"),
    "negative.toml": ("damping = '-1 N*s/m'", "must be positive"),
    "bare.toml": ("damping = 1", "damping needs a unit: write 1N*s/m"),
    "rate.toml": ("update_rate = 0", "must be positive"),
    "nan.toml": ("max_force = nan", "must be finite"),
    "inf.toml": ("max_force = inf", "must be finite"),
    "bool.toml": ("max_force = true", "quantity"),
    "date.toml": ("max_force = 2020-01-01", "quantity"),
    "empty.toml": ("max_force =", "not valid TOML"),
}


@pytest.mark.parametrize("name", list(BAD_FILES))
def test_invalid_device_files_give_a_one_line_error(call: Call, tmp_path: Path, name: str) -> None:
    content, message = BAD_FILES[name]
    (tmp_path / name).write_text(content)
    code, out, err = call(str(tmp_path / name), "--json", str(tmp_path / "out.json"))
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.strip().splitlines()) == 1
    assert "Traceback" not in err
    assert [item.name for item in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["omga.3"], "did you mean 'omega.3'"),
        (["touch", "nothing-like-it"], "known: 2diy"),
        (["none.toml"], "cannot be read"),
        (["touch", "--json", "no/such/folder/a.json"], "must lie in a folder that exists"),
        (["--no-such-option"], "--no-such-option"),
    ],
)
def test_invalid_input_has_exit_code_2(call: Call, arguments: list[str], message: str) -> None:
    code, out, err = call(*arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert "Traceback" not in err

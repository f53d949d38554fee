"""A user-defined device, a TOML file: every command accepts it and reports its data."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import asperity as asp

Call = Callable[..., tuple[int, str, str]]
Answer = Callable[..., Any]

DEVICE = """
id = "bench-rig"
name = "Two-motor bench"
max_force = "5 N"
force_resolution = "8 mN"
position_resolution = "15 um"
damping = "0.6 N*s/m"
update_rate = "4 kHz"
delay_samples = 1
apparent_mass = "60 g"

[max_stiffness]
value = 1.8
unit = "N/mm"
source = "smooth wall, raised until it buzzed"
verified = true
"""
LOOP = """
[texture]
kind = "sinusoid"
amplitude = "0.1 mm"
period = "2 mm"
[surface]
law = "C"
stiffness = "400 N/m"
[hand]
kind = "spring"
stiffness = "300 N/m"
[motion]
kind = "still"
point = "0mm; 0mm; -0.1mm"
[run]
duration = "0.02 s"
"""
SPEC = "sinusoid:amplitude=0.1mm,period=2mm"


@pytest.fixture
def device_path(tmp_path: Path) -> str:
    (tmp_path / "rig.toml").write_text(DEVICE, encoding="utf-8")
    return str(tmp_path / "rig.toml")


def stiffness_bounded_by_steps(q: float, one_sided: float) -> float:
    """Return where a buzz from the device's steps moves at most at the speed asked for.

    Passive is k (q⁺/2 + d q) <= σ₀/T, but for errors of force of k q |δ|/2 + |b|/2: the speed is
    their sum over m T, with m what is left of that margin. Steps of force alone already cause
    7 mm/s here, so twice that is asked for, above the usual 10 mm/s.
    """
    budget, step, force = 0.6 * 4000.0, 3.0**0.5 * 15e-6 / 2.0, 3.0**0.5 * 8e-3 / 2.0
    speed = 2.0 * force * 4000.0 / budget
    assert 0.010 < speed < 0.025
    return (speed * budget - force * 4000.0) / (
        step * q * 4000.0 + speed * (0.5 * one_sided + 1.0 * q)
    )


@pytest.mark.parametrize("command", ["compare", "analyze", "limits"])
def test_every_command_accepts_the_device_file(
    call: Call, read_json: Answer, device_path: str, command: str
) -> None:
    law = ["--laws" if command == "compare" else "--law", "C"]
    data = read_json(command, SPEC, *law, "--device", device_path)
    assert data["device"]["id"] == "bench-rig"
    code, page, _err = call(command, SPEC, *law, "--device", device_path, "--html", "-")
    assert (code, "Two-motor bench" in page) == (0, True)
    if command == "compare":
        (row,) = data["laws"]
        limit = row["stability_limit"]
        expected = stiffness_bounded_by_steps(row["q"]["value"], row["one_sided"]["value"])
        assert limit["stiffness"] == pytest.approx(expected, rel=1e-6)
        assert (limit["basis"], limit["proved_stiffness"]) == ("bounded", 0.0)


def test_devices_command_shows_its_sources(call: Call, device_path: str) -> None:
    code, out, err = call("devices", device_path)
    assert (code, err) == (0, "")
    assert "smooth wall, raised until it buzzed" in " ".join(out.split())
    assert "given by the user" in " ".join(out.split())


def test_simulation_uses_its_rate_delay_and_mass(
    read_json: Answer, device_path: str, tmp_path: Path
) -> None:
    (tmp_path / "loop.toml").write_text(LOOP, encoding="utf-8")
    scene = read_json("simulate", str(tmp_path / "loop.toml"), "--device", device_path)["scene"]
    assert scene["device"] == "bench-rig"
    assert (scene["servo"]["period"], scene["servo"]["delay"]) == (2.5e-4, 1)
    assert scene["plant"]["mass"] == [0.06, 0.06, 0.06]


def test_device_can_be_defined_in_a_scene(read_json: Answer, tmp_path: Path) -> None:
    section = DEVICE.replace("[max_stiffness]", "[device.max_stiffness]").replace(
        'id = "b', 'name = "b'
    )
    section = section.replace('name = "Two-motor bench"\n', "")
    (tmp_path / "loop.toml").write_text(f"{LOOP}[device]\n{section}", encoding="utf-8")
    data = read_json("compare", str(tmp_path / "loop.toml"), "--laws", "C")
    assert data["device"]["name"] == "bench-rig"
    assert (
        data["laws"][0]["stability_limit"]["stiffness"]
        < 1800.0 / data["laws"][0]["one_sided"]["lower"] * 1.01
    )


def test_compare_accepts_the_device_file(device_path: str) -> None:
    texture = asp.Sinusoid(amplitude=0.1e-3, period=2e-3)
    row = asp.compare(texture, device_path, laws="W").row("W")
    assert row.stability_limit.stiffness == pytest.approx(stiffness_bounded_by_steps(1.0, 1.0))
    assert row.stability_limit.stiffness < 0.6 * 4000.0 / 1.5  # the delay rule alone
    assert asp.load_device(device_path).value("force_resolution") == 8e-3

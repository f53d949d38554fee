"""``asperity calibrate``: options, errors and the device file that it writes."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.servo.drivers.test_drivers import EXAMPLE, compile_library

import asperity as asp
from asperity.cli.setup_commands import default_force
from asperity.core.errors import ParameterError
from asperity.devices import load_device, override_device

COMMAND = "calibrate"
Call = Callable[..., tuple[int, str, str]]


def test_simulated_device_is_measured_and_written(call: Call, tmp_path: Path) -> None:
    device_path, json_path = tmp_path / "mine.toml", tmp_path / "said.json"
    parameters = ["--set", "damping=0.5N*s/m", "--set", "delay_samples=1"]
    options = ["--device", "touch", *parameters, "-o", str(device_path), "--json", str(json_path)]
    code, out, err = call(*options)
    assert code == 0, err
    assert "axis  wall held" in out
    assert f"Written: {device_path}\n" in out
    assert "1000 Hz is simulated" in err
    device = load_device(device_path)
    assert (device.id, device.value("delay_samples")) == ("mine", 1.0)
    assert device.value("position_resolution") == pytest.approx(5.5e-5, rel=1e-3)
    measured = json.loads(json_path.read_text())
    assert len(measured["measured"]["axes"]) == 3
    assert measured["device"]["data"]["max_stiffness"]["value"] == device.max_stiffness
    simulated = {name for name, datum in device.data.items() if datum.pedigree == "simulated"}
    assert {"max_stiffness", "position_resolution", "delay_samples"} <= simulated
    assert 'verified = "simulated"' in device_path.read_text()
    assert "measured" not in {datum.pedigree for datum in device.data.values()}
    # The printed change is the one that a comparison finds, here for law H, which has q = 1.
    before, after = measured["unit_starts"]["H"]
    assert f"H {before:>15g} N/m {after:>7.3g} N/m {after / before:.2g} times".split() in [
        line.split() for line in out.splitlines()
    ]
    base = override_device(load_device("touch"), {"damping": "0.5 N*s/m", "delay_samples": 1})
    for compared, start in ((base, before), (device_path, after)):
        row = asp.compare(asp.Sinusoid(1e-4, 2e-3), compared, "H").rows[0]
        assert row.recommended_stiffness == pytest.approx(start, rel=2e-3)
    # A known damping makes it limit the buzz.
    assert after < before


def test_devices_that_cannot_be_measured_are_refused(call: Call, tmp_path: Path) -> None:
    library, device_path = compile_library(EXAMPLE, tmp_path), str(tmp_path / "mine.toml")
    for options, message in (
        (["--device", "touch", "-o", "mine.json"], "output must be a device file"),
        (["-o", device_path], "device is missing"),
        (["--device", "touch", "-o", device_path, "--force", "9N"], "force must be at most"),
        (["--device", "touch", "--driver", str(library), "-o", device_path], "--yes starts it"),
        (
            ["--device", "pantograph", "--driver", str(library), "-o", device_path, "--yes"],
            "max_force is unknown",
        ),
        (
            ["--device", "touch", "--driver", "forcedimension", "-o", device_path, "--yes"],
            "install the SDK",
        ),
    ):
        code, out, err = call(*options)
        assert (code, out) == (2, "")
        assert message in err
    assert not Path(device_path).exists()


def test_default_force_is_a_fraction_of_the_maximum_force() -> None:
    assert default_force(load_device("omega.3"), real=True) == 3.0
    assert default_force(load_device("touch"), real=True) == 0.88
    assert default_force(load_device("falcon"), real=True) == pytest.approx(8.0 / 3.0)
    with pytest.raises(ParameterError, match="max_force is unknown"):
        default_force(load_device("pantograph"), real=True)

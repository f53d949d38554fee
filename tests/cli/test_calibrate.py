"""``asperity calibrate``: what is asked, what is refused, what is written."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.servo.drivers.test_drivers import EXAMPLE, compile_library

from asperity.cli.device_commands import default_force
from asperity.core.errors import ParameterError
from asperity.devices import load_device

COMMAND = "calibrate"
Call = Callable[..., tuple[int, str, str]]


def test_a_simulated_device_is_measured_and_written(call: Call, tmp_path: Path) -> None:
    mine, said = tmp_path / "mine.toml", tmp_path / "said.json"
    known = ["--set", "damping=0.5N*s/m", "--set", "delay_samples=1"]
    options = ["--device", "touch", *known, "-o", str(mine), "--json", str(said)]
    code, out, err = call(*options)
    assert code == 0, err
    assert "axis  wall held" in out
    assert f"Written: {mine}\n" in out
    assert "1000 Hz is simulated" in err
    device = load_device(mine)
    assert (device.id, device.value("delay_samples")) == ("mine", 1.0)
    assert device.value("position_resolution") == pytest.approx(5.5e-5, rel=1e-3)
    measured = json.loads(said.read_text())
    assert len(measured["measured"]["axes"]) == 3
    assert measured["device"]["data"]["max_stiffness"]["value"] == device.max_stiffness


def test_what_cannot_be_measured_is_refused(call: Call, tmp_path: Path) -> None:
    library, mine = compile_library(EXAMPLE, tmp_path), str(tmp_path / "mine.toml")
    for options, words in (
        (["--device", "touch", "-o", "mine.json"], "output must be a device file"),
        (["-o", mine], "device is missing"),
        (["--device", "touch", "-o", mine, "--force", "9N"], "force must be at most"),
        (["--device", "touch", "--driver", str(library), "-o", mine], "--yes starts it"),
        (["--device", "pantograph", "--driver", str(library), "-o", mine, "--yes"],
         "max_force is unknown"),
        (["--device", "touch", "--driver", "forcedimension", "-o", mine, "--yes"],
         "install the SDK"),
    ):  # fmt: skip
        code, out, err = call(*options)
        assert (code, out) == (2, "")
        assert words in err
    assert not Path(mine).exists()


def test_the_usual_force_is_a_part_of_what_the_device_can() -> None:
    assert default_force(load_device("omega.3"), real=True) == 3.0
    assert default_force(load_device("touch"), real=True) == 0.88
    assert default_force(load_device("falcon"), real=True) == pytest.approx(8.0 / 3.0)
    with pytest.raises(ParameterError, match="max_force is unknown"):
        default_force(load_device("pantograph"), real=True)

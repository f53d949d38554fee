"""A driver of a user's own, in a file: by its name, and by the device file that names it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from asperity.core.errors import ParameterError
from asperity.devices import load_device
from asperity.recording.recording import open_recording
from asperity.servo.drivers import driver_registry as choice
from asperity.servo.drivers.driver import Frame
from asperity.servo.drivers.driver_registry import hardware_driver, register_driver
from asperity.servo.drivers.force_dimension import ForceDimensionDriver
from asperity.servo.drivers.haply import HaplyDriver
from asperity.servo.drivers.library import LibraryDriver
from asperity.servo.drivers.open_haptics import OpenHapticsDriver

Call = Callable[..., tuple[int, str, str]]

DRIVER = '''
"""A rig whose handle stands still, half a millimetre in the surface; its z points down."""

import sys
from dataclasses import dataclass
from typing import NamedTuple

from asperity.core.compiled import Kernels
from asperity.servo.drivers.driver import Driver, DriverKind, Frame

KERNELS = Kernels(provides=("device_read", "device_write"))
RIGHT, TOWARDS, DOWN = (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)


class Rig(NamedTuple):
    depth: float


def device_read(place, device):
    place[0] = 0.25
    place[1] = 0.0
    place[2] = device.depth
    return 0


def device_write(fx, fy, fz, inside, device):
    return 0


@dataclass(frozen=True)
class RigDriver(Driver):
    name = "rig"
    loss_notice = "Nothing moves."

    placed: Frame

    @property
    def frame(self):
        return self.placed

    def kernel_modules(self):
        return (sys.modules[__name__],)

    def placeholder_record(self):
        return Rig(0.0)

    def open(self):
        return Rig(0.5)


RIG = DriverKind(
    "rig", (RIGHT, TOWARDS, DOWN), 1e-3, lambda text, frame: RigDriver(frame), "rig"
)
'''
DEVICE = 'max_force = "3 N"\nmax_stiffness = "500 N/m"\nupdate_rate = "1 kHz"\ndriver = "rig"\n'
SERVO = '[servo]\nramp = "0 s"\nlateness = "60 s"\nmisses = 1000000\nsilence = "30 s"\n'


def test_a_driver_of_one_s_own_is_one_file(call: Call, tmp_path: Path) -> None:
    (tmp_path / "rig.py").write_text(DRIVER)
    (tmp_path / "rig.toml").write_text(DEVICE)
    scene = tmp_path / "scene.toml"
    scene.write_text(f'[texture]\nkind = "sinusoid"\namplitude = "0.1mm"\nperiod = "2mm"\n{SERVO}')
    said = ["--plugin", str(tmp_path / "rig.py"), "--device", str(tmp_path / "rig.toml"),
            "--law", "W", "--stiffness", "100 N/m", "--max-depth", "2mm"]  # fmt: skip
    path = str(tmp_path / "run.mcap")
    more = ["--duration", "0.05s", "--record", path, "--accept-risk"]
    code, out, err = call("run", str(scene), *said, "--driver", "real", *more)
    assert code == 0, err
    assert "If the loop dies: Nothing moves." in err
    assert "rig: done" in out
    recording = open_recording(path)
    assert [recording[axis][0] for axis in "xyz"] == [0.25e-3, 0.0, -0.5e-3]
    assert recording["applied z"].max() == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("device", "kind"),
    [
        ("omega.3", ForceDimensionDriver),
        ("falcon", ForceDimensionDriver),
        ("touch", OpenHapticsDriver),
        ("inverse3", HaplyDriver),
    ],
)
def test_the_entry_of_a_device_names_its_driver(device: str, kind: type) -> None:
    driver = hardware_driver("real", "lying", (0.0, 0.0, 0.0), load_device(device))
    assert isinstance(driver, kind)


def test_a_device_without_a_driver_asks_for_one() -> None:
    with pytest.raises(ParameterError, match=r"2diy names none: choose from haply:049D, "):
        hardware_driver("real", "lying", (0.0, 0.0, 0.0), load_device("2diy"))
    with pytest.raises(ParameterError, match="no device is given"):
        hardware_driver("real", "lying", (0.0, 0.0, 0.0))


def test_a_library_is_a_driver_by_its_path() -> None:
    for text in ("./Device.so", "own:./Device.so"):
        driver = hardware_driver(text, "lying", (0.0, 0.0, 0.0))
        assert isinstance(driver, LibraryDriver)
        assert (driver.path, driver.surface_frame) == ("./Device.so", Frame())


def test_a_name_is_given_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choice, "DRIVER_KINDS", dict(choice.DRIVER_KINDS))
    known = choice.DRIVER_KINDS["haply"]
    assert register_driver(known) is known
    with pytest.raises(ParameterError, match="is registered already, got 'own'"):
        register_driver(known.__class__("own", known.axes, 1.0, known.create, "own"))

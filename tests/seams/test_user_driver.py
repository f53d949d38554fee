"""A user-defined driver in a file, selected by its name or by a device file that names it."""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from tests.helpers.pages import page_example

from asperity.core.errors import ParameterError
from asperity.devices import load_device
from asperity.recording.recording import open_recording
from asperity.servo.driver import Frame
from asperity.servo.drivers import driver_registry
from asperity.servo.drivers.driver_registry import hardware_driver, register_driver
from asperity.servo.drivers.force_dimension import ForceDimensionDriver
from asperity.servo.drivers.haply import HaplyDriver
from asperity.servo.drivers.library import LibraryDriver
from asperity.servo.drivers.open_haptics import OpenHapticsDriver

Call = Callable[..., tuple[int, str, str]]

DRIVER = page_example("howto/extend.md", "A driver in Python")
DEVICE = 'max_force = "3 N"\nmax_stiffness = "500 N/m"\nupdate_rate = "1 kHz"\ndriver = "rig"\n'
SERVO = '[servo]\nramp = "0 s"\nlateness = "60 s"\nsilence = "30 s"\n'


def test_user_defined_driver_in_one_file(call: Call, tmp_path: Path) -> None:
    (tmp_path / "rig.py").write_text(DRIVER)
    (tmp_path / "rig.toml").write_text(DEVICE)
    scene = tmp_path / "scene.toml"
    scene.write_text(f'[texture]\nkind = "sinusoid"\namplitude = "0.1mm"\nperiod = "2mm"\n{SERVO}')
    arguments = [
        "--plugin",
        str(tmp_path / "rig.py"),
        "--device",
        str(tmp_path / "rig.toml"),
        "--law",
        "W",
        "--stiffness",
        "100 N/m",
        "--max-depth",
        "2mm",
    ]
    path = str(tmp_path / "run.mcap")
    outputs = ["--duration", "0.05s", "--record", path, "--accept-risk"]
    code, out, err = call("run", str(scene), *arguments, "--driver", "real", *outputs)
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
def test_catalogue_entry_selects_the_driver(device: str, kind: type) -> None:
    driver = hardware_driver("real", "lying", (0.0, 0.0, 0.0), load_device(device))
    assert isinstance(driver, kind)


def test_device_without_a_driver_gives_an_error_with_the_choices() -> None:
    with pytest.raises(ParameterError, match=r"2diy names none: choose from haply:049D, "):
        hardware_driver("real", "lying", (0.0, 0.0, 0.0), load_device("2diy"))
    with pytest.raises(ParameterError, match="no device is given"):
        hardware_driver("real", "lying", (0.0, 0.0, 0.0))


def test_path_of_a_library_selects_the_library_driver() -> None:
    for text in ("./Device.so", "own:./Device.so"):
        driver = hardware_driver(text, "lying", (0.0, 0.0, 0.0))
        assert isinstance(driver, LibraryDriver)
        assert (driver.path, driver.surface_frame) == ("./Device.so", Frame())


def test_registering_an_existing_name_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driver_registry, "DRIVER_KINDS", dict(driver_registry.DRIVER_KINDS))
    haply = driver_registry.DRIVER_KINDS["haply"]
    assert register_driver(haply) is haply
    with pytest.raises(ParameterError, match="is registered already, got 'own'"):
        register_driver(haply.__class__("own", haply.axes, 1.0, haply.create, "own"))


def serve_board(board: socket.socket, is_over: threading.Event) -> list[float]:
    """Reply to every force with a position 0.5 mm in the surface; return the forces along z."""
    forces = []
    board.settimeout(0.1)
    while not is_over.is_set():
        with contextlib.suppress(TimeoutError):
            packet, sender = board.recvfrom(64)
            forces.append(struct.unpack("<3f", packet)[2])
            board.sendto(struct.pack("<3f", 0.25, 0.0, -0.5), sender)
    return forces


def test_documented_driver_with_a_thread_renders_over_udp(call: Call, tmp_path: Path) -> None:
    """The example renders a wall on a board that replies over UDP; a silent board is an error.

    One after the other: both lock the same device.
    """
    for is_silent in (False, True):
        folder = tmp_path / str(is_silent)
        folder.mkdir()
        run_on_board(call, folder, is_silent)


def run_on_board(call: Call, tmp_path: Path, is_silent: bool) -> None:
    text = page_example("howto/extend.md", "A driver with a thread")
    long_timeouts = (
        "port: int = 9000\n    max_reading_age: float = 20.0\n    force_timeout: float = 20.0"
    )
    assert text.count("port: int = 9000") == 1
    text = text.replace("port: int = 9000", long_timeouts)  # a busy machine delays board and thread
    (tmp_path / "board.py").write_text(text)
    (tmp_path / "rig.toml").write_text(DEVICE)
    (tmp_path / "scene.toml").write_text(
        f'[texture]\nkind = "sinusoid"\namplitude = "0.1mm"\nperiod = "2mm"\n{SERVO}'
    )
    path, is_over = str(tmp_path / "run.mcap"), threading.Event()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as board, ThreadPoolExecutor() as pool:
        board.bind(("127.0.0.1", 0))
        if is_silent:
            is_over.set()
        pending_forces = pool.submit(serve_board, board, is_over)
        code, out, err = call(
            *("run", str(tmp_path / "scene.toml"), "--plugin", str(tmp_path / "board.py")),
            *("--device", str(tmp_path / "rig.toml"), "--law", "W", "--stiffness", "100 N/m"),
            *("--driver", f"board:{board.getsockname()[1]}", "--max-depth", "2mm"),
            *("--duration", "0.2s", "--record", path, "--accept-risk"),
        )
        is_over.set()
        forces = pending_forces.result()
    if is_silent:
        assert code == 2
        assert "cannot use the device: the board does not answer" in err
        return
    assert code == 0, err
    assert "on rig: done" in out
    recording = open_recording(path)
    np.testing.assert_allclose([recording[axis][-1] for axis in "xyz"], [0.25e-3, 0, -0.5e-3])
    assert max(forces) == pytest.approx(0.05)
    assert forces[-1] == 0.0  # released at the end

"""``asperity run``: refused input, printed results, and how a run ends."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench.speed.cases import HELD_HANDLE
from bench.stand_ins.fakes import compile_library
from tests.servo.drivers.test_drivers import EXAMPLE

import asperity as asp
from asperity.cli import loop_setup
from asperity.cli import servo_commands as run
from asperity.core.units import format_quantity
from asperity.devices import override_device
from asperity.recording.recording import open_recording
from asperity.recording.replay import replay
from asperity.report.pictures.loop_pictures import recording_figure
from asperity.scene import device_run
from asperity.scene.scene_file import load_scene
from asperity.scene.setup import make_setup
from asperity.servo.drivers import force_dimension, open_haptics
from asperity.simulation import Servo

COMMAND = "run"
Call = Callable[..., tuple[int, str, str]]

SCENE = f"""
[texture]
kind = "sinusoid"
amplitude = "0.1 mm"
period = "2 mm"
[surface]
law = "C"
stiffness = "100 N/m"
max_depth = "3 mm"
[device]
id = "touch"
update_rate = "1 kHz"
{HELD_HANDLE}
[servo]
ramp = "20 ms"
lateness = "60 s"
silence = "30 s"
"""


_LIMITS = 'ramp = "20 ms"\nlateness = "60 s"\n'


@pytest.fixture
def scene(tmp_path: Path) -> Callable[..., str]:
    def write(old: str = "", new: str = "") -> str:
        path = tmp_path / "scene.toml"
        path.write_text(SCENE.replace(old, new) if old else SCENE)
        return str(path)

    return write


@pytest.mark.parametrize(
    ("driver", "is_simulated"), [("simulated", True), ("replay:run.mcap", True), ("haply", False)]
)
def test_loop_adds_no_delay_and_steps_to_those_of_a_real_device(
    scene: Callable[..., str], monkeypatch: pytest.MonkeyPatch, driver: str, is_simulated: bool
) -> None:
    loaded = make_setup(load_scene(scene(), None))
    loaded = replace(loaded, servo=Servo(1e-3, 2, 50e-6, 5e-3))
    monkeypatch.setattr(loop_setup, "load_setup", lambda *_args, **_options: loaded)
    setup, servo = loop_setup.driver_setup("scene.toml", {}, driver)
    assert servo == loaded.servo
    # The loop delays no force: it counts the work of each a delay later.
    assert setup.servo == (loaded.servo if is_simulated else Servo(1e-3, 2))


def test_run_prints_its_result_and_statistics(
    call: Call, scene: Callable[..., str], tmp_path: Path
) -> None:
    path = tmp_path / "result.json"
    code, out, err = call(scene(), "--duration", "0.3s", "--json", str(path))
    # Standard error may note that the system does not allow priority.
    assert code == 0, err
    result = json.loads(path.read_text())
    assert (result["ended"], result["driver"]) == ("finished", "simulated")
    statistics = result["statistics"]
    assert statistics["samples"] + statistics["skipped"] >= 300
    assert sum(statistics["lateness_histogram"]) == statistics["samples"]
    assert "Law C, change of height, at 100 N/m" in out
    assert "Energy to the hand" in out
    assert "Start delay:   50 % within" in out
    assert "Period error:  50 % within" in out
    assert max(map(len, out.splitlines())) <= 80


def test_surface_without_a_scene_uses_the_recommended_stiffness(call: Call, tmp_path: Path) -> None:
    wave = "sinusoid:amplitude=0.1mm,period=2mm"
    path = tmp_path / "run.mcap"
    code, out, err = call(
        wave,
        "--device",
        "touch",
        "--law",
        "D",
        "--duration",
        "0.3s",
        "--set",
        "update_rate=500Hz",
        "--record",
        str(path),
    )
    assert code == 0, err
    device = override_device(asp.load_device("touch"), {"update_rate": "500 Hz"})
    row = asp.compare(wave, device, laws="D", clamp="backed").rows[0]
    stiffness = row.recommended_stiffness
    assert "as measured in encoder steps of 55 µm" in " ".join(out.split())
    text = " ".join(out.split())
    assert f"Law D at {format_quantity(stiffness, 'N/m')}, as compare recommends" in text
    assert "A simulated hand is pulled 160 µm deep" in text
    assert open_recording(path).rows > 100
    # A given stiffness is used as it is, and checked.
    code, _out, err = call(wave, "--device", "touch", "--law", "D", "--stiffness", "5000N/m")
    assert (code, "stiffness is refused: 5000 N/m is above the limit" in err) == (2, True)


def test_recorded_run_replays_bit_for_bit(
    call: Call, scene: Callable[..., str], tmp_path: Path
) -> None:
    path = tmp_path / "run.mcap"
    code, out, _err = call(scene(), "--duration", "0.5s", "--record", str(path))
    assert code == 0
    assert f"Recording: {path}\n" in out
    assert "record" in call(scene(), "--record", str(tmp_path))[2]
    recording = open_recording(path)
    assert recording.is_complete
    samples = recording["time"]
    if (np.diff(np.rint(samples / 1e-3)) == 1).all():  # else a busy machine skipped samples
        assert replay(recording).is_identical
    assert recording.rows == len(samples) >= 100
    assert np.abs(recording["applied z"]).max() > 0.01
    # Motion, force, energy, path and phases; a device does not measure the hand.
    lines_by_axes = [axes.get_lines() for axes in recording_figure(recording).axes]
    assert [len(lines) for lines in lines_by_axes[3:]] == [1, 2, 2]
    assert [line.get_label() for line in lines_by_axes[0]] == ["handle"]
    (total,) = [line for line in lines_by_axes[2] if line.get_label() == "sum, exact"]
    assert total.get_ydata()[-1] == 1e3 * recording["supplied"][-1]
    assert (lines_by_axes[4][0].get_ydata() == 0.0).all()  # the hand stays at its start
    assert np.ptp(recording["z"]) == 0.0
    code, out, err = call(scene(), "--driver", f"replay:{path}", "--law", "W")
    if code == 0:
        assert "3D Systems Touch, replay: done" in out
    else:  # a busy machine skipped samples
        assert "not sampled evenly" in err


def test_killed_program_leaves_a_readable_recording_and_no_process(
    scene: Callable[..., str], tmp_path: Path
) -> None:
    path = tmp_path / "run.mcap"
    scene_path = scene('silence = "30 s"', 'silence = "2 s"')
    program = [
        sys.executable,
        "-m",
        "asperity",
        "run",
        scene_path,
        "--duration",
        "3600s",
        "--record",
        str(path),
    ]
    with subprocess.Popen(program, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        assert wait_until(lambda: path.exists() and path.stat().st_size > 100_000)
        # The servo process is a child of the program.
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        process.kill()
    assert children
    assert wait_until(lambda: not any(Path(f"/proc/{child}").exists() for child in children))
    recording = open_recording(path)
    assert not recording.is_complete
    assert recording.rows > 200


def wait_until(condition: Callable[[], bool], timeout: float = 120.0) -> bool:
    """Wait for a condition; return whether it was met before the timeout."""
    end = time.monotonic() + timeout
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    return condition()


def test_scene_changed_during_a_run_takes_effect_in_the_next_run(
    call: Call, scene: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = scene()
    watch_loop = run.watch_loop

    def change_scene_and_watch(*arguments: Any) -> Any:
        Path(path).write_text(SCENE.replace("100 N/m", "50 N/m"))
        return watch_loop(*arguments)

    monkeypatch.setattr(run, "watch_loop", change_scene_and_watch)
    code, out, err = call(path, "--duration", "0.1s")
    assert (code, "at 100 N/m" in out) == (0, True)
    assert f"{path} was changed during the run" in err
    monkeypatch.undo()
    code, out, err = call(path, "--duration", "0.1s")
    assert (code, "at 50 N/m" in out, "changed" in err) == (0, True, False)


def test_motion_outside_the_plane_of_the_device_is_refused(
    call: Call, scene: Callable[..., str]
) -> None:
    path = scene('["0 mm", "0 mm", "-2 mm"]', '["0 mm", "1 mm", "-2 mm"]')
    code, _out, err = call(path, "--device", "pantograph", "--accept-risk")
    assert code == 2
    assert "a pantograph moves in the x-z plane" in err


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("nosuch", "driver is unknown: 'nosuch'"),
        ("real", "driver of the device is not known"),
        ("replay:missing.mcap", "missing.mcap"),
        ("./missing.so", "driver needs .*missing.so, which is not found"),
        ("forcedimension", "driver needs /missing/libdhd.so, which is not found"),
        ("forcedimension:first", "driver must have a number after the colon"),
        ("openhaptics", "driver needs /missing/libHD.so, which is not found"),
    ],
)
def test_unusable_driver_is_refused_before_the_laws_are_compared(
    call: Call, monkeypatch: pytest.MonkeyPatch, name: str, message: str, tmp_path: Path
) -> None:
    """A comparison takes a minute; an existing recording is left as it is."""
    monkeypatch.setattr(device_run, "recommend_law_and_stiffness", lambda *_args: 1 / 0)
    monkeypatch.setenv(force_dimension.LIBRARY, "/missing/libdhd.so")
    monkeypatch.setenv(open_haptics.LIBRARY, "/missing/libHD.so")
    recording = tmp_path / "run.mcap"
    recording.write_text("precious")
    arguments = ("--device", "pantograph" if name == "real" else "touch", "--driver", name)
    code, out, err = call("cloth", *arguments, "--record", str(recording), "--force")
    assert (code, out) == (2, "")
    assert re.search(message, err)
    assert recording.read_text() == "precious"


def test_stiffness_above_the_limit_is_refused(call: Call, scene: Callable[..., str]) -> None:
    path = scene('100 N/m"\nmax', '1500 N/m"\nmax')
    code, out, err = call(path, "--duration", "0.1s")
    assert (code, out) == (2, "")
    assert "stiffness is refused: 1500 N/m is above the limit of" in err
    assert "--accept-risk" in err
    code, out, _err = call(path, "--duration", "0.1s", "--accept-risk", "--json", "-")
    assert (code, json.loads(out)["ended"]) == (0, "finished")


def test_fault_gives_exit_code_3_and_what_is_known_of_the_run(
    call: Call, scene: Callable[..., str], tmp_path: Path
) -> None:
    path = scene('max_depth = "3 mm"', 'max_depth = "0.2 mm"\nclamp = "none"')
    record = tmp_path / "run.mcap"
    code, out, err = call(path, "--duration", "5s", "--record", str(record))
    assert (code, out) == (3, "")
    *_notes, late, delay, _period, recorded, last = err.splitlines()
    counts = re.match(r"asperity: Late: \d+ of (\d+) samples finished .*, \d+ skipped$", late)
    assert counts is not None
    assert int(counts[1]) == open_recording(record).rows > 0
    assert re.match("asperity: Start delay: .*, worst [0-9]", delay)
    assert recorded == f"asperity: Recording: {record} holds the samples until then"
    assert last.startswith("asperity: the probe is deeper than max_depth")
    assert "the force was made zero" in last


@pytest.mark.parametrize(
    ("line", "words"),
    [('ramp = "-1 s"', "ramp"), ('beyond_depth = "never"', "fault"), ('rampe = "1 s"', "ramp")],
)
def test_invalid_servo_limit_is_named_in_the_error(
    call: Call, scene: Callable[..., str], line: str, words: str
) -> None:
    code, _out, err = call(scene(_LIMITS, f"{line}\n"))
    assert code == 2
    assert words in err


@pytest.mark.parametrize("signal_number", [signal.SIGINT, signal.SIGTERM])
def test_interrupt_stops_the_run_with_a_result(
    scene: Callable[..., str], signal_number: int, tmp_path: Path
) -> None:
    out = tmp_path / "result.json"
    arguments = ["run", scene(), "--duration", "3600s", "--json", str(out)]
    program = [sys.executable, "-c", _REPORTING_PROGRAM, *arguments]
    with subprocess.Popen(
        program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if "watching" in line:
                break
        time.sleep(0.05)
        # A terminal sends the signal to the servo process, too.
        os.killpg(
            process.pid, signal_number
        ) if signal_number == signal.SIGINT else process.send_signal(signal_number)
        _output, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    assert json.loads(out.read_text())["ended"] == "stopped"


# A program that reports when it starts to poll the loop.
_REPORTING_PROGRAM = """
import asperity.cli.servo_commands as run
from asperity.__main__ import main
watch_loop = run.watch_loop
def watch_and_report(*arguments):
    import sys
    print("watching", file=sys.stderr, flush=True)
    return watch_loop(*arguments)
run.watch_loop = watch_and_report
if __name__ == "__main__":
    main()
"""


def test_user_defined_driver_is_selected_by_one_option(
    call: Call, scene: Callable[..., str], tmp_path: Path
) -> None:
    library = compile_library(EXAMPLE, tmp_path)
    out = call(scene(), "--driver", str(library), "--duration", "0.3s")
    assert out[0] == 0, out
    assert "3D Systems Touch: done" in out[1]
    assert "a hand near its switch" in out[2]
    # Without a simulated hand any surface is accepted.
    wave = "sinusoid:amplitude=0.1mm,period=2mm"
    options = ["--law", "C", "--stiffness", "100N/m", "--max-depth", "3mm", "--device", "touch"]
    code, _out, err = call(wave, *options, "--driver", "forcedimension")
    assert (code, "install the SDK of Force Dimension" in err) == (2, True)
    code, _out, err = call(
        wave, *options[:-1], "pantograph", "--accept-risk", "--driver", str(library)
    )
    assert (code, "max_force is not known" in err) == (2, True)

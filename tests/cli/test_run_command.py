"""``asperity run``: what is refused, what is said, how it ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench.fakes import compile_library
from tests.servo.drivers.test_drivers import EXAMPLE

import asperity as asp
from asperity.cli import servo_commands as run
from asperity.core.units import format_quantity
from asperity.recording.recording import open_recording
from asperity.recording.replay import replay
from asperity.report.pictures.loop_pictures import recording_figure

COMMAND = "run"
Call = Callable[..., tuple[int, str, str]]

SCENE = """
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
[hand]
kind = "spring"
stiffness = "300 N/m"
damping = "3 N*s/m"
mass = "50 g"
[motion]
kind = "still"
point = ["0 mm", "0 mm", "-2 mm"]
[servo]
ramp = "20 ms"
lateness = "60 s"
misses = 1000000
silence = "30 s"
"""


_LIMITS = 'ramp = "20 ms"\nlateness = "60 s"\nmisses = 1000000\n'


@pytest.fixture
def scene(tmp_path: Path) -> Callable[..., str]:
    def write(old: str = "", new: str = "") -> str:
        path = tmp_path / "scene.toml"
        path.write_text(SCENE.replace(old, new) if old else SCENE)
        return str(path)

    return write


def test_it_runs_and_says_what_it_did(call: Call, scene: Callable[..., str]) -> None:
    code, out, err = call(scene(), "--duration", "0.3s", "--json", "-")
    # Standard error may note that the system does not allow priority.
    assert code == 0, err
    result = json.loads(out)
    assert (result["ended"], result["driver"]) == ("finished", "simulated")
    counted = result["statistics"]
    assert counted["samples"] + counted["skipped"] >= 300
    assert sum(counted["lateness_histogram"]) == counted["samples"]
    code, out, _err = call(scene(), "--duration", "0.3s")
    assert code == 0
    assert "Law C, change of height, at 100 N/m" in out
    assert "Energy to the hand" in out
    assert "Start delay:   50 % within" in out
    assert "Period error:  50 % within" in out
    assert max(map(len, out.splitlines())) <= 80


def test_a_surface_alone_is_felt_as_a_comparison_recommends(call: Call, tmp_path: Path) -> None:
    wave = "sinusoid:amplitude=0.1mm,period=2mm"
    path = tmp_path / "run.mcap"
    code, out, err = call(wave, "--device", "touch", "--law", "D", "--duration", "0.3s",
                          "--set", "update_rate=500Hz", "--record", str(path))  # fmt: skip
    assert code == 0, err
    start = (
        asp.compare(wave, device="touch", laws="D", clamp="backed").rows[0].recommended_stiffness
    )
    words = " ".join(out.split())
    assert f"Law D at {format_quantity(start, 'N/m')}, as asperity compare recommends" in words
    assert "A simulated hand is pulled 160 µm deep" in words
    assert open_recording(path).rows > 100
    # What is given stays, and is judged.
    code, _out, err = call(wave, "--device", "touch", "--law", "D", "--stiffness", "5000N/m")
    assert (code, "stiffness is refused: 5000 N/m is above the limit" in err) == (2, True)


def test_a_recording_replays_bit_for_bit(
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
    if (np.diff(np.rint(samples / 1e-3)) == 1).all():  # else a busy machine left some out
        assert replay(recording).is_identical
    assert recording.rows == len(samples) >= 100
    assert np.abs(recording["applied z"]).max() > 0.01
    # Motion, force, energy, path and phases, without the hand: a device does not know it.
    drawn = [axes.get_lines() for axes in recording_figure(recording).axes]
    assert [len(lines) for lines in drawn[3:]] == [1, 2, 2]
    assert [line.get_label() for line in drawn[0]] == ["handle"]
    (total,) = [line for line in drawn[2] if line.get_label() == "sum, exact"]
    assert total.get_ydata()[-1] == 1e3 * recording["supplied"][-1]
    assert (drawn[4][0].get_ydata() == 0.0).all()  # the hand is still where it begins
    assert np.ptp(recording["z"]) == 0.0
    code, out, err = call(scene(), "--driver", f"replay:{path}", "--law", "W")
    if code == 0:
        assert "3D Systems Touch, replay: done" in out
    else:  # a busy machine left samples out
        assert "not sampled evenly" in err


def test_a_killed_program_leaves_a_recording_and_no_loop(
    scene: Callable[..., str], tmp_path: Path
) -> None:
    path = tmp_path / "run.mcap"
    limits = scene('silence = "30 s"', 'silence = "2 s"')
    program = [sys.executable, "-m", "asperity", "run", limits, "--duration", "3600s",
               "--record", str(path)]  # fmt: skip
    with subprocess.Popen(program, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
        assert until(lambda: path.exists() and path.stat().st_size > 100_000)
        # The loop's process is the child that runs this program, too.
        children = Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text().split()
        run.kill()
    assert children
    assert until(lambda: not any(Path(f"/proc/{child}").exists() for child in children))
    recording = open_recording(path)
    assert not recording.is_complete
    assert recording.rows > 200


def until(reached: Callable[[], bool], patience: float = 120.0) -> bool:
    """Wait for something; whether it came."""
    end = time.monotonic() + patience
    while not reached() and time.monotonic() < end:
        time.sleep(0.02)
    return reached()


def test_a_scene_that_is_changed_while_it_runs_counts_next_time(
    call: Call, scene: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = scene()
    watched = run.watch_loop

    def changing(*arguments: Any) -> Any:
        Path(path).write_text(SCENE.replace("100 N/m", "50 N/m"))
        return watched(*arguments)

    monkeypatch.setattr(run, "watch_loop", changing)
    code, out, err = call(path, "--duration", "0.1s")
    assert (code, "at 100 N/m" in out) == (0, True)
    assert f"{path} was changed during the run" in err
    monkeypatch.undo()
    code, out, err = call(path, "--duration", "0.1s")
    assert (code, "at 50 N/m" in out, "changed" in err) == (0, True, False)


def test_a_way_that_the_device_lacks_is_refused(call: Call, scene: Callable[..., str]) -> None:
    path = scene('["0 mm", "0 mm", "-2 mm"]', '["0 mm", "1 mm", "-2 mm"]')
    code, _out, err = call(path, "--device", "pantograph", "--accept-risk")
    assert code == 2
    assert "a pantograph moves in the x-z plane" in err


def test_a_stiffness_above_the_limit_is_refused(call: Call, scene: Callable[..., str]) -> None:
    path = scene('100 N/m"\nmax', '1500 N/m"\nmax')
    code, out, err = call(path, "--duration", "0.1s")
    assert (code, out) == (2, "")
    assert "stiffness is refused: 1500 N/m is above the limit of" in err
    assert "--accept-risk" in err
    assert call(path, "--duration", "0.1s", "--accept-risk")[0] == 0


def test_a_fault_is_one_line_and_exit_code_3(call: Call, scene: Callable[..., str]) -> None:
    path = scene('max_depth = "3 mm"', 'max_depth = "0.2 mm"\nclamp = "none"')
    code, out, err = call(path, "--duration", "5s")
    assert (code, out) == (3, "")
    last = err.splitlines()[-1]
    assert last.startswith("asperity: the probe is deeper than max_depth")
    assert "the force was made zero" in last


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('ramp = "-1 s"', "ramp"),
        ('beyond_depth = "never"', "fault"),
        ('rampe = "1 s"', "ramp"),
        ("misses = -1", "misses"),
    ],
)
def test_a_wrong_limit_is_named(
    call: Call, scene: Callable[..., str], line: str, said: str
) -> None:
    code, _out, err = call(scene(_LIMITS, f"{line}\n"))
    assert code == 2
    assert said in err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_lets_the_force_go(
    scene: Callable[..., str], number: int, tmp_path: Path
) -> None:
    out = tmp_path / "result.json"
    arguments = ["run", scene(), "--duration", "3600s", "--json", str(out)]
    program = [sys.executable, "-c", _WAITS, *arguments]
    with subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          start_new_session=True) as started:  # fmt: skip
        assert started.stderr is not None
        for line in started.stderr:
            if "watching" in line:
                break
        time.sleep(0.05)
        # As a terminal does: to the loop's process, too.
        os.killpg(started.pid, number) if number == signal.SIGINT else started.send_signal(number)
        _output, errors = started.communicate(timeout=120)
    assert started.returncode == 0, errors
    assert json.loads(out.read_text())["ended"] == "stopped"


# The program, which reports that it polls the loop.
_WAITS = """
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


def test_a_device_of_one_s_own_is_one_word(
    call: Call, scene: Callable[..., str], tmp_path: Path
) -> None:
    library = compile_library(EXAMPLE, tmp_path)
    out = call(scene(), "--driver", str(library), "--duration", "0.3s")
    assert out[0] == 0, out
    assert "3D Systems Touch: done" in out[1]
    assert "a hand near its switch" in out[2]
    # Nobody is simulated: any surface will do.
    wave = "sinusoid:amplitude=0.1mm,period=2mm"
    more = ["--law", "C", "--stiffness", "100N/m", "--max-depth", "3mm", "--device", "touch"]
    code, _out, err = call(wave, *more, "--driver", "forcedimension")
    assert (code, "install the SDK of Force Dimension" in err) == (2, True)
    code, _out, err = call(
        wave, *more[:-1], "pantograph", "--accept-risk", "--driver", str(library)
    )
    assert (code, "max_force is not known" in err) == (2, True)

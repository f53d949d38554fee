"""Ends of ``asperity run`` on a terminal: the last force is zero, and no process is left."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from pathlib import Path

import pytest
from bench.stress.servo_ends import DEVICES, End, Run, try_end

from asperity.core.errors import ParameterError
from asperity.devices import load_device
from asperity.servo.drivers.force_dimension import ForceDimensionDriver
from asperity.servo.drivers.library import LibraryDriver
from asperity.servo.drivers.simulated import ReplayDriver
from asperity.servo.loop_process import lock_device
from asperity.servo.safety import Safety, check_passivity_damping
from asperity.simulation import Servo

# Each starts a command and a loop; bench/stress/servo_ends.py tries all of them on all drivers.
ENDS = ["terminal closed", "TERM to the group", "Ctrl-Z (TSTP)", "KILL of the group", "USR1"]


def check(end: End) -> None:
    """Check what does not depend on how busy the machine is."""
    assert (end.is_zero, end.closed, end.left) == (True, True, 0), end


@pytest.mark.parametrize("event", ENDS)
def test_ordinary_end_releases_the_force(event: str) -> None:
    check(try_end("own", event, random.Random(0)))


def test_call_that_takes_long_ends_without_force() -> None:
    end = try_end("own", "call of 1 to 5 s", random.Random(0))
    check(end)
    assert end.code == 3


def test_killed_loop_is_reported_and_leaves_no_process() -> None:
    end = try_end("own", "KILL of the loop", random.Random(0))
    assert (end.is_zero, end.code, end.left) == (False, 3, 0)  # nobody can command any more


def test_second_run_on_a_device_is_refused_and_keeps_the_recording(tmp_path: Path) -> None:
    recording = tmp_path / "run.mcap"
    with DEVICES["own"]() as device:
        first = Run(device, tmp_path, settings='lateness = "60 s"\nsilence = "60 s"\n')
        second = subprocess.run(
            [*first.command, "--record", str(recording)],
            env=first.environment,
            capture_output=True,
            text=True,
            check=False,
        )
        first.parent.terminate()
        assert first.end() == []
    assert second.returncode == 2
    assert f"finds the device in use by process {first.parent.pid} (" in second.stderr
    assert not recording.exists()  # the device is opened before the file is created


def test_lock_distinguishes_devices(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    first, second = ForceDimensionDriver(), ForceDimensionDriver(1)
    with lock_device(first), lock_device(second), lock_device(LibraryDriver("a.so")):
        for driver in (first, ForceDimensionDriver(0), second, LibraryDriver("./a.so")):
            with pytest.raises(ParameterError, match="in use by process"), lock_device(driver):
                pass
    with lock_device(first):
        pass
    replay = ReplayDriver([])  # type: ignore[arg-type]  # it moves nothing, so nothing is locked
    with lock_device(replay), lock_device(replay):
        pass


def test_origin_has_either_sign() -> None:
    assert Safety(origin=(0.0, -10e-3, 20e-3)).origin == (0.0, -10e-3, 20e-3)


def test_passivity_damping_is_bounded_by_the_mass() -> None:
    touch = load_device("touch")  # 45 g
    check_passivity_damping(Safety(passivity_damping=45.0), touch, Servo(1e-3))
    for damping, delay in ((45.1, 0), (22.6, 1), (1000.0, 0)):
        with pytest.raises(
            ParameterError, match=r"passivity_damping must be at most m/\(\(1 \+ d\)"
        ):
            check_passivity_damping(Safety(passivity_damping=damping), touch, Servo(1e-3, delay))
    unknown = load_device("omega.3")
    check_passivity_damping(Safety(), unknown, Servo(1e-3))
    with pytest.raises(ParameterError, match=r"needs the mass of omega\.3.*apparent_mass"):
        check_passivity_damping(Safety(passivity_damping=1.0), unknown, Servo(1e-3))


_WATCHED_LOOP = """
import sys, time
from multiprocessing import get_context
from pathlib import Path

from asperity.servo import loop_process


class Memory:
    def request_stop(self, now):
        Path(sys.argv[1]).write_text(str(now))


def loop():
    loop_process.end_with_parent = lambda release: None  # the pipe, which closes later
    loop_process._leave_to_supervisor(Memory())
    time.sleep(0.3)
    print("watching" if not Path(sys.argv[1]).exists() else "stopped at once", flush=True)
    time.sleep(20.0)


if __name__ == "__main__":
    get_context("spawn").Process(target=loop).start()
    time.sleep(60.0)
"""


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="not run: needs /proc")
def test_loop_stops_when_the_program_loses_its_memory(tmp_path: Path) -> None:
    """A killed program closes its pipes last; until it is waited for, it has no memory."""
    script, stopped = tmp_path / "program.py", tmp_path / "stopped"
    script.write_text(_WATCHED_LOOP)
    command = [sys.executable, str(script), str(stopped)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        assert program.stdout.readline() == "watching\n"
        program.kill()
        deadline = time.monotonic() + 10.0
        while not stopped.exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        assert stopped.exists()
        assert stopped.read_text() == "True"

"""The loop in its own process: start, surface changes, stop, and zero force after any failure."""

from __future__ import annotations

import math
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.devices import load_device
from asperity.loop.shared_trace import COLUMNS
from asperity.servo import loop_process
from asperity.servo.drivers.simulated import simulated_driver
from asperity.servo.loop_memory import FAULT_SAMPLES, DeviceFault, EndReason
from asperity.servo.process import PrestartedProcess, ServoProcess
from asperity.servo.safety import Safety, excess_stiffness_reason
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary, Strokes
from asperity.surface import Surface
from asperity.textures import Sinusoid

SURFACE = Surface(Sinusoid(0.1e-3, 2e-3), "C", stiffness=300.0, max_depth=5e-3)
HAND = SpringHand(stiffness=300.0, damping=3.0, mass=0.05, force=(0.0, 0.0, -0.6))
SERVO = Servo(1e-3, max_force=3.0)
# Generous limits: lateness on a busy machine is not under test here.
PATIENT = Safety(ramp=0.02, lateness=60.0, silence=30.0)


def servo_process(
    safety: Safety = PATIENT,
    motion: Stationary | None = None,
    prestarted: PrestartedProcess | None = None,
) -> ServoProcess:
    still = motion or Stationary((0.0, 0.0, -1e-3))
    driver = simulated_driver(Cartesian(0.05, 1.0), HAND, SERVO, still, 1.0)
    return ServoProcess(SURFACE, driver, SERVO, safety, prestarted=prestarted)


@pytest.fixture
def loop() -> Iterator[ServoProcess]:
    with servo_process() as running:
        yield running


def wait_until(reached: Callable[[], bool], patience: float = 60.0) -> bool:
    """Wait for a condition and return whether it was met in time."""
    end = time.monotonic() + patience
    while not reached() and time.monotonic() < end:
        time.sleep(0.005)
    return reached()


def applied_force(loop: ServoProcess) -> np.ndarray:
    return loop.rows(loop.memory.row_count - 1)[0][-1, 7:10]


def test_loop_renders_changes_surface_and_stops_without_force(loop: ServoProcess) -> None:
    assert wait_until(lambda: loop.memory.row_count > 300 and applied_force(loop)[2] > 0.3)
    initial_z = loop.rows(loop.memory.row_count - 1)[0][-1, 3]
    change_row = loop.memory.row_count
    loop.change_surface(SURFACE.to_law("B").to_stiffness(150.0), accept_risk=True)
    # The force ramps to zero before the surface is replaced, then ramps up again.
    assert wait_until(lambda: bool((loop.rows(change_row)[0][:, 10] == 0.0).any()))
    assert wait_until(lambda: bool(loop.rows(loop.memory.row_count - 1)[0][-1, 10] == 1.0))
    rows, _first = loop.rows(change_row)
    jumps = np.abs(np.diff(rows[:, 7:10], axis=0)).max()
    assert jumps <= SERVO.max_force / 5e-3 * SERVO.period
    assert wait_until(lambda: loop.rows(loop.memory.row_count - 1)[0][-1, 3] < initial_z - 0.3e-3)
    loop.stop()
    assert (loop.poll(), loop.process.is_alive()) == (EndReason.STOPPED, False)
    assert (applied_force(loop) == 0.0).all()


def test_refused_stiffness_differs_from_the_limit_which_is_rounded_down() -> None:
    steep = Surface(Sinusoid(0.2e-3, 2e-3), "C", stiffness=279.8)
    reason = excess_stiffness_reason(steep, load_device("touch"))
    assert reason.startswith("279.8 N/m is above the limit of 279 N/m for law C")


def test_invalid_surface_change_does_not_disturb_the_loop(loop: ServoProcess) -> None:
    with pytest.raises(ParameterError):
        loop.change_surface(SURFACE.to_stiffness(-1.0))
    row_count = loop.memory.row_count
    assert wait_until(lambda: loop.memory.row_count > row_count)


def test_new_surface_is_checked_before_it_is_rendered(loop: ServoProcess) -> None:
    with pytest.raises(ParameterError, match="device is not known to the loop"):
        loop.change_surface(SURFACE)
    loop._device = load_device("touch")
    with pytest.raises(ParameterError, match="2000 N/m is above the limit"):
        loop.change_surface(SURFACE.to_stiffness(2000.0))
    row_count = loop.memory.row_count
    loop.change_surface(SURFACE.to_stiffness(50.0))
    assert wait_until(lambda: bool((loop.rows(row_count)[0][:, 10] == 0.0).any()))


def test_fault_carries_the_last_samples() -> None:
    shallow = SURFACE.to_depth(1.2e-3)
    descent = Strokes((0.0, 0.0, 4e-3), (0.0, 0.0, -3e-3), speed=0.05)
    driver = simulated_driver(Cartesian(0.05, 1.0), HAND, SERVO, descent, 1.0)
    with ServoProcess(shallow, driver, SERVO, PATIENT) as loop:
        with pytest.raises(DeviceFault, match="deeper than max_depth") as caught:
            wait_until(lambda: loop.poll() is not EndReason.RUNNING)
        with pytest.raises(DeviceFault):  # the fault is permanent
            loop.poll()
    fault = caught.value
    assert (fault.cause, fault.exit_code) == (EndReason.DEPTH, 3)
    assert fault.samples.shape == (FAULT_SAMPLES, len(COLUMNS))
    assert (fault.samples[-1, 7:10] == 0.0).all()
    assert (np.diff(fault.samples[:, 0]) > 0.0).all()
    assert fault.samples[-1, 3] < -1.2e-3 < fault.samples[0, 3] + 1e-3


@pytest.mark.parametrize("from_input", [False, True])
def test_script_without_a_main_guard_is_told(tmp_path: Path, from_input: bool) -> None:
    script = (
        "import asperity as asp\n"
        "asp.run('sinusoid:amplitude=20um,period=1mm', law='C', stiffness=50, duration=0.1)\n"
    )
    path = tmp_path / "script.py"
    path.write_text(script)
    command = [sys.executable, "-" if from_input else str(path)]
    done = subprocess.run(command, input=script, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert "DeviceFault: the process of the loop ended when it started: a script needs" in last
    assert "needs  if __name__ == '__main__':" in last
    assert "is a file" in last


def test_killed_loop_process_is_a_fault(loop: ServoProcess) -> None:
    assert wait_until(lambda: loop.memory.row_count > 20)
    os.kill(int(loop.process.pid or 0), signal.SIGKILL)
    with pytest.raises(DeviceFault, match="process of the loop ended") as caught:
        wait_until(lambda: loop.poll() is not EndReason.RUNNING)
    assert caught.value.cause is EndReason.DIED


def test_suspended_loop_process_goes_on(loop: ServoProcess) -> None:
    assert wait_until(lambda: loop.memory.row_count > 20)
    os.kill(int(loop.process.pid or 0), signal.SIGSTOP)
    row_count = loop.memory.row_count
    assert wait_until(lambda: loop.memory.row_count > row_count + 20)


def test_signals_do_not_end_the_process_of_a_loop(loop: ServoProcess) -> None:
    assert wait_until(lambda: loop.memory.row_count > 20)
    pid = int(loop.process.pid or 0)
    assert os.getsid(pid) == pid
    for number in signal.valid_signals() - {signal.SIGKILL, signal.SIGSTOP}:
        os.kill(pid, number)
        row_count = loop.memory.row_count
        assert wait_until(lambda before=row_count: loop.memory.row_count > before + 20), number
    loop.memory.request_stop(now=True)
    assert wait_until(lambda: loop.poll() is EndReason.STOPPED)


def test_limits_of_processor_time_release_the_force(loop: ServoProcess) -> None:
    """At the hard limit the system kills, and a device keeps the force that it was told last."""
    assert wait_until(lambda: loop.memory.row_count > 300 and applied_force(loop)[2] > 0.3)
    pid = int(loop.process.pid or 0)
    times = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    used = sum(map(int, times[11:13])) / os.sysconf("SC_CLK_TCK")
    limit = math.floor(used + 0.3) + 1  # at once, or after 0.3 s of processor time
    resource.prlimit(pid, resource.RLIMIT_CPU, (limit, limit))
    assert wait_until(lambda: loop.poll() is EndReason.STOPPED)
    assert (applied_force(loop) == 0.0).all()


def test_without_shared_memory_the_message_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """Containers may have a /dev/shm that cannot be written."""

    def refuse(*_: object) -> object:
        raise OSError(30, "Read-only file system", "/dev/shm/pym-1")

    monkeypatch.setattr("asperity.servo.loop_memory.SpawnContext.RawArray", refuse)
    with pytest.raises(ParameterError, match=r"two processes \(Read-only .*: /dev/shm/pym-1\)"):
        servo_process()


def test_unresponsive_loop_process_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loop_process, "MAX_CALL_TIME", 0.5)
    with servo_process(Safety(ramp=0.02, lateness=60.0, silence=2.0)) as loop:
        assert wait_until(lambda: loop.memory.row_count > 20)
        loop._heartbeat_stop.set()  # the supervising program would let it go on
        os.kill(int(loop.process.pid or 0), signal.SIGSTOP)  # like a hanging driver
        with pytest.raises(DeviceFault, match="does not answer") as caught:
            wait_until(lambda: loop.poll() is not EndReason.RUNNING)
    assert caught.value.cause is EndReason.UNRESPONSIVE
    assert not loop.process.is_alive()


def test_loop_releases_the_force_without_heartbeat() -> None:
    with servo_process(Safety(ramp=0.02, lateness=60.0, silence=2.0)) as loop:
        assert wait_until(lambda: loop.memory.row_count > 20)
        loop._heartbeat_stop.set()  # stop the heartbeat
        with pytest.raises(DeviceFault, match="no heartbeat"):
            wait_until(lambda: loop.poll() is not EndReason.RUNNING)
        assert (loop.fault().samples[-1, 3:4] < 0.0).all()


def test_device_with_moving_handle_needs_max_force() -> None:
    driver = simulated_driver(Cartesian(0.05), HAND, SERVO, Stationary((0.0, 0.0, 0.0)), 1.0)
    ServoProcess(SURFACE, driver, Servo(1e-3))  # nothing moves
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(driver), "has_moving_handle", True)
        with pytest.raises(ParameterError, match="max_force is not known"):
            ServoProcess(SURFACE, driver, Servo(1e-3, max_force=math.inf))


def test_prestarted_process_is_used_and_an_idle_one_ends() -> None:
    prestarted, idle = PrestartedProcess(), PrestartedProcess()
    pid = prestarted.process.pid
    with servo_process(prestarted=prestarted) as loop:
        assert int(loop.process.pid or 0) == pid
        assert wait_until(lambda: prestarted.memory.row_count > 10)
    assert not prestarted.process.is_alive()
    idle.connection.close()  # as when the parent process has died
    idle.process.join(60.0)
    assert idle.process.exitcode == 0
    idle.terminate()
    waiting = PrestartedProcess()
    waiting.terminate()
    assert not waiting.process.is_alive()


def test_hanging_prestarted_process_is_killed() -> None:
    idle = PrestartedProcess()
    os.kill(int(idle.process.pid or 0), signal.SIGSTOP)
    idle.terminate()
    assert idle.process.exitcode == -signal.SIGKILL

"""The loop in a process of its own: it starts, changes, stops, and lets go whatever dies."""

from __future__ import annotations

import math
import os
import signal
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.devices import load_device
from asperity.loop.shared_trace import COLUMNS
from asperity.servo.drivers.simulated import simulated_driver
from asperity.servo.fault import FAULT_SAMPLES, DeviceFault, EndReason
from asperity.servo.process import PrestartedProcess, ServoProcess
from asperity.servo.safety import Safety
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary
from asperity.surface import Surface
from asperity.textures import Sinusoid

SURFACE = Surface(Sinusoid(0.1e-3, 2e-3), "C", stiffness=300.0, max_depth=5e-3)
HAND = SpringHand(stiffness=300.0, damping=3.0, mass=0.05, force=(0.0, 0.0, -0.6))
SERVO = Servo(1e-3, max_force=3.0)
# A busy machine is late, and that is not what is tested here.
PATIENT = Safety(ramp=0.02, lateness=60.0, misses=10**6, silence=30.0)


def process(
    safety: Safety = PATIENT,
    motion: Stationary | None = None,
    spare: PrestartedProcess | None = None,
) -> ServoProcess:
    still = motion or Stationary((0.0, 0.0, -1e-3))
    driver = simulated_driver(Cartesian(0.05, 1.0), HAND, SERVO, still, 1.0)
    return ServoProcess(SURFACE, driver, SERVO, safety, prestarted=spare)


@pytest.fixture
def loop() -> Iterator[ServoProcess]:
    with process() as running:
        yield running


def until(reached: Callable[[], bool], patience: float = 60.0) -> bool:
    """Wait for something; whether it came."""
    end = time.monotonic() + patience
    while not reached() and time.monotonic() < end:
        time.sleep(0.005)
    return reached()


def applied(loop: ServoProcess) -> np.ndarray:
    return loop.rows(loop.memory.row_count - 1)[0][-1, 7:10]


def test_it_renders_changes_and_stops_without_force(loop: ServoProcess) -> None:
    assert until(lambda: loop.memory.row_count > 300 and applied(loop)[2] > 0.3)
    pressed = loop.rows(loop.memory.row_count - 1)[0][-1, 3]
    before = loop.memory.row_count
    loop.change_surface(SURFACE.to_law("B").to_stiffness(150.0), accept_risk=True)
    # The force goes before the surface is exchanged, and comes again.
    assert until(lambda: bool((loop.rows(before)[0][:, 10] == 0.0).any()))
    assert until(lambda: bool(loop.rows(loop.memory.row_count - 1)[0][-1, 10] == 1.0))
    rows, _first = loop.rows(before)
    jumps = np.abs(np.diff(rows[:, 7:10], axis=0)).max()
    assert jumps <= SERVO.max_force / 5e-3 * SERVO.period
    assert until(lambda: loop.rows(loop.memory.row_count - 1)[0][-1, 3] < pressed - 0.3e-3)
    loop.stop()
    assert (loop.poll(), loop.process.is_alive()) == (EndReason.STOPPED, False)
    assert (applied(loop) == 0.0).all()


def test_a_law_that_the_texture_cannot_serve_leaves_the_loop_alone(loop: ServoProcess) -> None:
    with pytest.raises(ParameterError):
        loop.change_surface(SURFACE.to_stiffness(-1.0))
    seen = loop.memory.row_count
    assert until(lambda: loop.memory.row_count > seen)


def test_the_next_surface_is_judged_before_it_is_rendered(loop: ServoProcess) -> None:
    with pytest.raises(ParameterError, match="device is not known to the loop"):
        loop.change_surface(SURFACE)
    loop._device = load_device("touch")
    with pytest.raises(ParameterError, match="2000 N/m is above the limit"):
        loop.change_surface(SURFACE.to_stiffness(2000.0))
    seen = loop.memory.row_count
    loop.change_surface(SURFACE.to_stiffness(50.0))
    assert until(lambda: bool((loop.rows(seen)[0][:, 10] == 0.0).any()))


def test_a_fault_carries_the_last_samples() -> None:
    shallow = SURFACE.to_depth(1.2e-3)
    driver = simulated_driver(Cartesian(0.05, 1.0), HAND, SERVO, Stationary((0.0, 0.0, -3e-3)), 1.0)
    with ServoProcess(shallow, driver, SERVO, PATIENT) as loop:
        with pytest.raises(DeviceFault, match="deeper than max_depth") as raised:
            until(lambda: loop.poll() is not EndReason.RUNNING)
        with pytest.raises(DeviceFault):  # it stays one
            loop.poll()
    fault = raised.value
    assert (fault.cause, fault.exit_code) == (EndReason.DEPTH, 3)
    assert fault.samples.shape == (FAULT_SAMPLES, len(COLUMNS))
    assert (fault.samples[-1, 7:10] == 0.0).all()
    assert fault.samples[-1, 3] < -1.2e-3 < fault.samples[0, 3] + 1e-3


def test_a_loop_that_dies_is_a_fault(loop: ServoProcess) -> None:
    assert until(lambda: loop.memory.row_count > 20)
    os.kill(int(loop.process.pid or 0), signal.SIGKILL)
    with pytest.raises(DeviceFault, match="process of the loop ended") as raised:
        until(lambda: loop.poll() is not EndReason.RUNNING)
    assert raised.value.cause is EndReason.DIED


def test_a_device_that_does_not_answer_is_a_fault() -> None:
    with process(Safety(ramp=0.02, lateness=60.0, misses=10**6, silence=2.0)) as loop:
        assert until(lambda: loop.memory.row_count > 20)
        os.kill(int(loop.process.pid or 0), signal.SIGSTOP)  # as a driver that hangs
        with pytest.raises(DeviceFault, match="does not answer") as raised:
            until(lambda: loop.poll() is not EndReason.RUNNING)
    assert raised.value.cause is EndReason.UNRESPONSIVE
    assert not loop.process.is_alive()


def test_a_loop_without_a_watcher_lets_go() -> None:
    with process(Safety(ramp=0.02, lateness=60.0, misses=10**6, silence=2.0)) as loop:
        assert until(lambda: loop.memory.row_count > 20)
        loop._heartbeat_stop.set()  # no heartbeat any more
        with pytest.raises(DeviceFault, match="no heartbeat"):
            until(lambda: loop.poll() is not EndReason.RUNNING)
        assert (loop.fault().samples[-1, 3:4] < 0.0).all()


def test_a_device_that_moves_needs_its_greatest_force() -> None:
    driver = simulated_driver(Cartesian(0.05), HAND, SERVO, Stationary((0.0, 0.0, 0.0)), 1.0)
    ServoProcess(SURFACE, driver, Servo(1e-3))  # nothing moves
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(driver), "has_moving_handle", True)
        with pytest.raises(ParameterError, match="max_force is not known"):
            ServoProcess(SURFACE, driver, Servo(1e-3, max_force=math.inf))


def test_a_process_that_stands_ready_is_used_and_one_without_a_job_ends() -> None:
    spare, idle = PrestartedProcess(), PrestartedProcess()
    pid = spare.process.pid
    with process(spare=spare) as loop:
        assert int(loop.process.pid or 0) == pid
        assert until(lambda: spare.memory.row_count > 10)
    assert not spare.process.is_alive()
    idle.connection.close()  # as when whoever made it has died
    idle.process.join(60.0)
    assert idle.process.exitcode == 0
    idle.terminate()
    waiting = PrestartedProcess()
    waiting.terminate()
    assert not waiting.process.is_alive()


def test_a_process_that_hangs_before_it_has_a_job_is_ended() -> None:
    spare = PrestartedProcess()
    os.kill(int(spare.process.pid or 0), signal.SIGSTOP)
    spare.terminate()
    assert spare.process.exitcode == -signal.SIGKILL

"""The loop of a device: what it costs besides law and device, and how it keeps time.

``python -m bench.speed.servo 5`` for 5 s per loop instead of 60.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from rich.console import Console

from asperity.core.platform.clocks import no_clock, system_clock
from asperity.core.platform.system import function_address
from asperity.servo.driver_loop import DriverLoop, build_program
from asperity.servo.drivers.library import LibraryDriver
from asperity.servo.drivers.simulated import simulated_driver
from asperity.servo.loop_memory import EndReason, LoopMemory, LoopStatistics
from asperity.servo.process import ServoProcess
from asperity.servo.safety import Safety
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary
from asperity.surface import Surface
from asperity.textures import Sinusoid
from bench.speed.c_programs import run_command
from bench.speed.timing import take_turns

HERE = Path(__file__).parent / "c"
SECONDS = 60.0
RATES = (1e3, 4e3, 10e3)  # [Hz]
SAMPLES = 200_000
TEXTURE = Sinusoid(0.1e-3, 2e-3)
# Nothing but lateness is to be counted, and a busy machine ends nothing.
PATIENT = Safety(lateness=60.0, silence=60.0, beyond_depth="warn")
_NOTHING = """
int asperity_open(void) { return 0; }
int asperity_read(double p[3]) { p[0] = p[1] = 0.0; p[2] = 1e-3; return 0; }
int asperity_write(const double f[3], int contact) { (void)f; (void)contact; return 0; }
int asperity_close(void) { return 0; }
int at_once(int clock, int how, const void *due, void *rest)
{ (void)clock; (void)how; (void)due; (void)rest; return 0; }
"""


def loop_overhead(console: Console, folder: Path) -> None:
    """Print what a sample costs besides device, law and waiting, with and without the clock."""
    source, path = folder / "nothing.c", folder / "nothing.so"
    source.write_text(_NOTHING)
    run_command("gcc", "-O2", "-shared", "-fPIC", source, "-o", path)
    driver = LibraryDriver(str(path))
    shown, record = build_program(Surface(TEXTURE, "W", stiffness=300.0), driver), driver.open()
    at_once = function_address(ctypes.CDLL(str(path)).at_once)
    clocks = no_clock(), system_clock()._replace(wait=at_once)

    def go(index: int) -> None:
        servo, board = Servo(1e-4, max_force=3.0), LoopMemory().block()
        DriverLoop(driver, servo, PATIENT, 1.0, board, clocks[index]).run(shown, record, SAMPLES)

    times = take_turns([lambda: go(0), lambda: go(1)], 9) / SAMPLES
    for name, cost in zip(("without clock", "with clock"), np.median(times, axis=0), strict=True):
        console.print(f"a sample of the loop, {name}: {1e9 * cost:.0f} ns (goal: 1000)")


def timekeeping(console: Console, folder: Path, seconds: float) -> None:
    """Print late samples at each rate, beside those of a loop in C that does nothing.

    Both run at the same time and on the same core, so that what else the machine does meets both.
    """
    bare = folder / "nanosleep"
    run_command("gcc", "-O2", HERE / "nanosleep.c", "-o", bare)
    with one_core():
        for rate in RATES:
            words = [str(bare), str(round(1e9 / rate)), str(seconds)]
            counted, said = _loop(rate, seconds, words)
            done = [int(word) for word in said.split()]
            ratio = counted.late / done[1] if done[1] else float(counted.late > 0)
            console.print(
                f"{rate / 1e3:.0f} kHz, {seconds:g} s: C {done[1]} of {done[0]} late, worst"
                f" {1e-3 * done[2]:.0f} µs; loop {counted.late} of {counted.samples}, worst"
                f" {1e6 * counted.max_lateness:.0f} µs; ratio {ratio:.2f} (goal: 1.1)"
            )


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this process, and those that it starts, on one core."""
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, cores)


def _loop(rate: float, seconds: float, beside: list[str]) -> tuple[LoopStatistics, str]:
    """Return what a loop counted, and what a program said that ran at the same time."""
    servo = Servo(1.0 / rate, max_force=3.0)
    hand = SpringHand(stiffness=300.0, damping=3.0, mass=0.05)
    driver = simulated_driver(Cartesian(0.05), hand, servo, Stationary((0.0, 0.0, -1e-3)), 1.0)
    surface = Surface(TEXTURE, "C", stiffness=300.0)
    with ServoProcess(surface, driver, servo, PATIENT, duration=seconds) as loop:
        with subprocess.Popen(beside, stdout=subprocess.PIPE, text=True) as other:
            while loop.poll() is EndReason.RUNNING:
                time.sleep(0.05)
            said = other.communicate()[0]
        return loop.statistics, said


def run(console: Console, seconds: float = SECONDS) -> None:
    """Print what the loop costs and how it keeps time."""
    if shutil.which("gcc") is None:
        console.print("not run: no gcc")
        return
    with tempfile.TemporaryDirectory() as folder:
        loop_overhead(console, Path(folder))
        timekeeping(console, Path(folder), seconds)


if __name__ == "__main__":
    run(Console(width=100, highlight=False), float(sys.argv[1]) if sys.argv[1:] else SECONDS)

"""Faults at random of every driver: is the force zero, the recording whole, the next start fine?

``python -m bench.stress.servo_faults [COUNT] [DRIVER ...]`` (1000 by default). Each fault is one
loop at 1 kHz against the clock, on a device that is simulated, replayed, or stands in for a
vendor's; then the recording is read, and the same driver starts again on a device that works. Then
processes of loops are killed.
"""

from __future__ import annotations

import os
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from asperity.core.errors import AsperityError
from asperity.core.platform.clocks import system_clock
from asperity.loop.shared_trace import COLUMNS
from asperity.recording.recording import Recording, open_recording
from asperity.servo.driver_loop import DriverLoop, build_program
from asperity.servo.loop_memory import EndReason, LoopMemory
from asperity.servo.process import LoopRecorder, ServoProcess
from asperity.servo.safety import Safety
from asperity.simulation import Servo
from asperity.surface import Surface
from asperity.textures import Sinusoid
from bench.stand_ins.servo_rigs import RIGS, DriverRig, Force

COUNT, KILLS = 1000, 5
SERVO = Servo(1e-3, max_force=3.0)
SURFACE = Surface(
    Sinusoid(0.2e-3, 1e-3, phase=0.4, direction=(2.0, 1.0)), "C", stiffness=900.0, max_depth=5e-3
)
SAMPLES = 100_000  # at most: a fault ends it long before
AT = 5, 25  # the sample of a fault, from and to
WATCHED = 0.03  # [s] without a sign of life that is a fault, where that is the fault
DEEP = "too deep"
UNWATCHED = "no watcher"
ANY = (DEEP, UNWATCHED)
"""Faults that any driver can have."""
_APPLIED = [index for index, (name, _unit) in enumerate(COLUMNS) if name.startswith("applied")]
_TOOK = [name for name, _unit in COLUMNS].index("took")


@dataclass
class FaultOutcome:
    """What faults of a driver did.

    Attributes:
        causes: how often each pair of fault and cause was seen.
        wrong: what must not be, in words.
        reaction_times: time from the sample of detection to its force of zero [s].
        release_times: from the end of the loop to a device that holds no force [s].
        under_force: how many came while a force was held.
    """

    causes: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    reaction_times: list[float] = field(default_factory=list)
    release_times: list[float] = field(default_factory=list)
    under_force: int = 0


def inject_faults(rig: DriverRig, count: int, seed: int = 0) -> FaultOutcome:
    """Return what so many faults of a driver did."""
    draw, said = random.Random(seed), FaultOutcome()
    with tempfile.TemporaryDirectory() as folder:
        for index in range(count):
            fault = draw.choice((*rig.faults, *ANY))
            at = draw.randint(*AT)
            try:
                _inject_fault(rig, fault, at, Path(folder) / "run.mcap", said)
            except AsperityError as error:
                said.wrong.append(f"{index}: {fault} at {at}: {error}")
    return said


def _inject_fault(rig: DriverRig, fault: str, at: int, path: Path, outcome: FaultOutcome) -> None:
    """Let a driver fail, look at what it did, and start it again."""
    surface = SURFACE.to_depth(0.2e-3) if fault == DEEP else SURFACE
    safety = Safety(ramp=0.005, lateness=0.1, silence=WATCHED if fault == UNWATCHED else 60.0)
    with rig.failing_driver("" if fault in ANY else fault, at) as driver:
        shared = LoopMemory()
        loop = DriverLoop(driver, SERVO, safety, 1.0, shared.block(), system_clock())
        shown = build_program(surface, driver)
        loop.compile(shown)
        record = driver.open()
        try:
            with LoopRecorder(path, shared, surface, SERVO, {}):
                cause, _code = loop.run(shown, record, SAMPLES)
                held, reached = _measure_release(rig, record, time.monotonic())
        finally:
            driver.close()
        closed = rig.held_force(record)
    outcome.causes[f"{fault}: {cause.name.lower()}"] += 1
    rows, _first = shared.rows(0)
    outcome.reaction_times.append(float(rows[-1, _TOOK]))
    outcome.under_force += bool(rows[:-1, _APPLIED].any())
    if fault not in rig.deaf:
        outcome.release_times.append(reached)
    wrong = {
        "no fault": not cause.is_fault,
        f"the device holds {held}": any(held or ()) and fault not in rig.deaf,
        f"the device holds {closed} when it is closed": any(closed or ()),
        "the recording is not the run": not _is_recording_complete(open_recording(path), rows),
        "the next start failed": not _can_restart(rig),
    }
    outcome.wrong += [f"{fault} at {at}: {words}" for words, is_so in wrong.items() if is_so]


def _measure_release(rig: DriverRig, record: Any, ended: float) -> tuple[Force | None, float]:
    """Return the force that the device holds, once it is zero or a second is over, and when."""
    while any((held := rig.held_force(record)) or ()) and time.monotonic() - ended < 1.0:
        time.sleep(1e-4)
    return held, time.monotonic() - ended


def _is_recording_complete(recording: Recording, rows: np.ndarray) -> bool:
    table = np.column_stack([recording[name] for name, _unit in COLUMNS])
    return recording.is_complete and np.array_equal(table, rows, equal_nan=True)


def _can_restart(rig: DriverRig) -> bool:
    safety = Safety(ramp=0.0, lateness=60.0, silence=60.0)
    with rig.failing_driver("", 0) as driver:
        loop = DriverLoop(driver, SERVO, safety, 1.0, LoopMemory().block(), system_clock())
        shown = build_program(SURFACE, driver)
        loop.compile(shown)
        record = driver.open()
        try:
            return loop.run(shown, record, 5)[0] is EndReason.FINISHED
        finally:
            driver.close()


def kill_processes(rig: DriverRig, count: int, seed: int = 0) -> tuple[Counter[str], list[str]]:
    """Return how loops ended whose processes were killed, and what must not be."""
    draw, ends, wrong = random.Random(seed), Counter[str](), list[str]()
    safety = Safety(ramp=0.005, lateness=60.0, silence=2.0)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        for index in range(count):
            with (
                rig.failing_driver("", 0) as driver,
                ServoProcess(SURFACE, driver, SERVO, safety) as loop,
            ):
                with LoopRecorder(path, loop, SURFACE, SERVO, {}) as recorder:
                    time.sleep(draw.uniform(0.02, 0.2))
                    os.kill(int(loop.process.pid or 0), draw.choice((9, 11, 15, 19)))
                    ends[_end(loop)] += 1
                rows = loop.memory.row_count - recorder.lost_rows
            if open_recording(path).rows != rows:
                wrong.append(f"{index}: the recording is not the run")
            if not _can_restart(rig):
                wrong.append(f"{index}: the next start failed")
    return ends, wrong


def _end(loop: ServoProcess) -> str:
    deadline = time.monotonic() + 10.0
    try:
        while time.monotonic() < deadline:
            loop.poll()
            time.sleep(0.005)
    except AsperityError as error:
        return str(getattr(error, "cause", error))
    return "nobody noticed"


def run(count: int, names: Sequence[str], console: Console) -> int:
    """Print what faults of drivers did; return how much was wrong."""
    total = 0
    for name, rig in RIGS.items():
        if names and name not in names:
            continue
        begun = time.monotonic()
        with rig() as made:
            said = inject_faults(made, count)
            seconds = time.monotonic() - begun
            ends, killed = kill_processes(made, KILLS)
        wrong = [*said.wrong, *killed]
        took, reached = 1e3 * np.array(said.reaction_times), 1e3 * np.array(said.release_times)
        console.print(
            f"{name}: {count} faults of {len(said.causes)} kinds in {seconds:.0f} s, "
            f"{said.under_force}"
            f" of them under force, and {KILLS} kills: {len(wrong)} wrong. The sample of the fault"
            f" took {np.median(took):.3f} ms (worst {took.max():.2f}; more than its period"
            f" {np.count_nonzero(took > 1.0)}). The device held no force"
            f" {np.median(reached):.2f} ms after the loop ended (worst {reached.max():.2f})"
        )
        console.print("  " + ", ".join(f"{kind} {n}" for kind, n in sorted(said.causes.items())))
        console.print("  killed: " + ", ".join(f"{end} {n}" for end, n in sorted(ends.items())))
        for words in wrong[:10]:
            console.print(f"  wrong: {words}")
        total += len(wrong)
    return total


if __name__ == "__main__":
    asked = sys.argv[1:]
    number = int(asked.pop(0)) if asked and asked[0].isdecimal() else COUNT
    sys.exit(bool(run(number, asked, Console(width=100, highlight=False))))

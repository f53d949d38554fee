"""Kill processes that record at 10 kHz at random moments, and look at what is on disk.

``python -m bench.stress.recording_kills [COUNT]`` (1000 by default): each writes rows in blocks of
10 ms, with the time of the clock in them, and is killed within three seconds; some have closed
their file by then. Every file opens, holds the rows from the first on without a gap, and ends less
than a second before the kill.
"""

from __future__ import annotations

import multiprocessing
import random
import sys
import tempfile
import time
from collections import Counter, deque
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.recording.recording import open_recording
from asperity.recording.writer import RecordingWriter

RATE, BLOCK = 10_000, 100
LONGEST = 3.0
"""[s] that a process lives."""
MOST_LOST = 1.0
_AT_ONCE = 16
# Its processes begin at once, with everything imported, and without threads of this one.
_CONTEXT = multiprocessing.get_context("forkserver")
_COLUMNS = (("time", "s"), ("clock", "s"), *((f"c{i}", "N") for i in range(28)))


class _RecordingProcess(NamedTuple):
    process: BaseProcess
    path: Path
    begun: Any
    kill_at: float
    closes_at: float


def run(count: int, console: Console, seed: int = 0) -> Counter[str]:
    """Print what so many kills did; return how often each fault was seen."""
    _CONTEXT.set_forkserver_preload(["asperity.recording.recording", "asperity.recording.writer"])
    draw, faults, lost = random.Random(seed), Counter[str](), [0.0]
    waiting: deque[_RecordingProcess] = deque()
    with tempfile.TemporaryDirectory() as folder:
        for index in range(count):
            waiting.append(_start(Path(folder) / f"{index}.mcap", draw))
            # Those that are due first are killed first.
            while len(waiting) >= min(_AT_ONCE, count) or (index == count - 1 and waiting):
                child = min(waiting, key=lambda one: one.kill_at)
                waiting.remove(child)
                fault, seconds = _end(child)
                faults[fault] += bool(fault)
                lost.append(seconds)
    faults = +faults
    lost_time = f"at most {1e3 * max(lost):.0f} ms lost"
    console.print(f"{count} kills: {dict(faults) or 'no fault'}; {lost_time}")
    return faults


def _start(path: Path, draw: random.Random) -> _RecordingProcess:
    now, begun = time.monotonic(), _CONTEXT.Value("d", 0.0)
    kill_at = now + draw.uniform(0.0, LONGEST)
    closes_at = now + draw.uniform(0.0, 2.0 * LONGEST)
    process = _CONTEXT.Process(target=_record, args=(path, begun, closes_at), daemon=True)
    process.start()
    return _RecordingProcess(process, path, begun, kill_at, closes_at)


def _record(path: Path, began: Any, closes_at: float) -> None:
    """Say when it begins, and record until the end comes."""
    began.value = begun = time.monotonic()
    writer = RecordingWriter(path, _COLUMNS, {"made_by": "bench.stress.recording_kills"})
    row = 0
    while time.monotonic() < closes_at:
        due = int((time.monotonic() - begun) * RATE) // BLOCK * BLOCK
        while row < due:
            writer.append(_rows(row))
            row += BLOCK
        time.sleep(BLOCK / RATE)
    writer.close()
    time.sleep(10.0 * LONGEST)


def _rows(first: int) -> FloatArray:
    table = np.empty((BLOCK, len(_COLUMNS)))
    table[:] = np.arange(first, first + BLOCK)[:, None]
    table[:, 0] /= RATE
    table[:, 1] = time.monotonic()
    return table


def _end(child: _RecordingProcess) -> tuple[str, float]:
    """Kill a process when it is due; return what is wrong then, and what was lost [s]."""
    time.sleep(max(child.kill_at - time.monotonic(), 0.0))
    killed = time.monotonic()
    child.process.kill()
    child.process.join()
    begun = child.begun.value or killed  # killed before it could begin: nothing to lose
    end = max(min(killed, child.closes_at), begun)
    if not child.path.exists():
        lost = end - begun
        return ("no file" if lost > MOST_LOST else ""), lost
    try:
        recording = open_recording(child.path)
        table = recording.table()
    except ParameterError as error:
        return str(error), 0.0
    finally:
        child.path.unlink()
    if (table[:, 2] != np.arange(len(table))).any():
        return "rows are missing", 0.0
    lost = end - (float(table[-1, 1]) if len(table) else begun)
    return ("more than a second lost" if lost > MOST_LOST else ""), lost


if __name__ == "__main__":
    number = next((int(word) for word in sys.argv[1:] if word.isdigit()), 1000)
    sys.exit(bool(run(number, Console(width=100, highlight=False))))

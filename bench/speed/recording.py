"""What a recording costs: of a core at 10 kHz, and per row of a trace."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.core.checks import FloatArray
from asperity.recording.writer import RecordingWriter
from asperity.simulation.trace import COLUMNS

GOAL_CORE = 0.05
GOAL_ROW = 1e-6
RATE = 10_000
ROUNDS = 21
_SECONDS = 4.0
_BLOCKS = (10, 100, 1000)


def run(console: Console) -> None:
    """Print the part of a core at 10 kHz, and what a row of a trace costs."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _at_10_khz(console, folder)
        _per_row(console, folder)


def _at_10_khz(console: Console, folder: Path) -> None:
    """Write seconds of a loop, block by block, and print the processor's time of it."""
    rows = _rows(int(RATE * _SECONDS))
    table = Table("rows of a block", "of a core", "goal", box=None, pad_edge=False)
    for block in _BLOCKS:
        shares = [_share(folder / "run.mcap", rows, block) for _ in range(ROUNDS)]
        share = float(np.median(shares))
        style = "red" if share > GOAL_CORE else ""
        table.add_row(str(block), f"{100 * share:.2f} %", f"{100 * GOAL_CORE:.0f} %", style=style)
    console.print(f"a loop at {RATE} Hz, {len(COLUMNS)} columns")
    console.print(table)


def _share(path: Path, rows: FloatArray, block: int) -> float:
    """Return the processor's time [s] of a second that is written, closing left out."""
    writer = RecordingWriter(path, COLUMNS)
    begin = time.process_time()
    for first in range(0, len(rows), block):
        writer.append(rows[first : first + block])
    writer.flush()
    spent = time.process_time() - begin
    writer.close()
    return spent / _SECONDS


def _per_row(console: Console, folder: Path) -> None:
    rows = _rows(16_384)  # as many as a simulation hands on at once
    recording = RecordingWriter(folder / "a.mcap", COLUMNS, None, None, "trace")
    times = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        recording.append(rows)
        times.append(time.perf_counter() - begin)
    recording.close()
    cost = float(np.median(times)) / len(rows)
    style = "red" if cost > GOAL_ROW else ""
    words = f"a row of a trace: {1e6 * cost:.2f} µs (goal {1e6 * GOAL_ROW:.0f})"
    console.print(words, style=style)


def _rows(count: int) -> FloatArray:
    table = np.random.default_rng(0).normal(size=(count, len(COLUMNS)))
    table[:, 0] = np.arange(count) / RATE
    return table

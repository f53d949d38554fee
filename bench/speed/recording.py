"""What a row of a recording costs, written a few at a time and as a simulation does."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console

from asperity.recording.writer import RecordingWriter
from asperity.simulation.trace import COLUMNS
from bench.speed.timing import number_table

ROWS = 40_000
ROUNDS = 21
# Rows written at once, with the goal for a row [s]: loops may take 5 % of a core at 10 kHz.
GOALS = {10: 5e-6, 100: 5e-6, 1000: 5e-6, 16_384: 1e-6}


def run(console: Console) -> None:
    """Print the processor's time of a row by how many are written at once."""
    table = number_table("rows at once", "µs a row", "goal", "")
    with tempfile.TemporaryDirectory() as folder:
        for block, goal in GOALS.items():
            path = Path(folder) / f"{block}.mcap"
            cost = float(np.median([_row_cost(path, block) for _ in range(ROUNDS)]))
            verdict = "met" if cost <= goal else "MISSED"
            table.add_row(str(block), f"{1e6 * cost:.2f}", f"{1e6 * goal:.0f}", verdict)
    console.print(f"a recording of {len(COLUMNS)} columns")
    console.print(table)


def _row_cost(path: Path, block: int) -> float:
    """Return the processor's time of a row [s], closing left out."""
    rows = np.random.default_rng(0).normal(size=(ROWS, len(COLUMNS)))
    writer = RecordingWriter(path, COLUMNS)
    begin = time.process_time()
    for first in range(0, ROWS, block):
        writer.append(rows[first : first + block])
    writer.flush()
    spent = time.process_time() - begin
    writer.close()
    return spent / ROWS

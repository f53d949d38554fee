"""Time of forces at many points, against C that is written for vector registers by hand."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from bench import cases, reference
from bench.timing import median_ratio, take_turns

LAWS = "ABCG"
GOAL = 1.2
POINTS = 16_384  # a multiple of eight
ROUNDS = 301
# gnu11: products and sums may be fused, which only helps C.
FLAGS = ("-std=gnu11", "-march=native", "-fno-math-errno")


def run(console: Console) -> None:
    """Print one row for each law on a sinusoid and on a map, and the verdict."""
    if shutil.which("gcc") is None:
        console.print("not run: comparison with C (no gcc)")
        return
    console.print(f"ns per point, medians of {ROUNDS} batches of {POINTS} points, run in turns")
    table = Table("texture", "law", "asperity ns", "C by hand ns", "asp./C", box=None)
    ratios = []
    with tempfile.TemporaryDirectory() as directory:
        library = reference.build(Path(directory), FLAGS, "batches.c")
        known = cases.textures()
        for kind in reference.KINDS:
            for law in LAWS:
                kernel = cases.kernel(known[kind], law, cases.probes(known[kind], POINTS))
                other = reference.reference(library, kernel)
                reference.check(kernel, other, ("run_force",))
                times = take_turns([kernel.run_force, other.run_force], ROUNDS)
                own, c = np.median(times, axis=0) / POINTS * 1e9
                ratios.append((median_ratio(times, 0, 1), f"law {law} on {kind}"))
                table.add_row(kind, law, f"{own:.1f}", f"{c:.1f}", f"{ratios[-1][0]:.2f}")
    console.print(table)
    over = [f"{where} {ratio:.2f}" for ratio, where in ratios if ratio > GOAL]
    answer = "met" if not over else f"MISSED by {len(over)} of {len(ratios)}: {', '.join(over)}"
    console.print(f"goal {GOAL} -> {answer}", style="bold")

"""Time of forces at many points, against C that is written for vector registers by hand."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from bench.speed import cases, reference
from bench.speed.timing import median_ratio, print_verdict, take_turns

LAWS = "ABCG"
GOAL = 1.2
POINTS = 16_384  # a multiple of eight
ROUNDS = 301
# C may fuse products and sums, as asperity does in batches.
PROCESSOR = os.environ.get("NUMBA_CPU_NAME", "native")  # x86-64-v3: both without AVX-512
FLAGS = ("-std=gnu11", f"-march={PROCESSOR}", "-fno-math-errno", "-ffp-contract=fast")


def run(console: Console) -> None:
    """Print one row for each law on a sinusoid and on a map, and the verdict."""
    if shutil.which("gcc") is None:
        console.print("not run: comparison with C (no gcc)")
        return
    console.print(f"ns per point on {PROCESSOR}, medians of {ROUNDS} batches of {POINTS} points")
    table = Table("texture", "law", "asperity ns", "C by hand ns", "asp./C", box=None)
    missed = []
    with tempfile.TemporaryDirectory() as folder:
        library = reference.build(Path(folder), FLAGS, "batches.c")
        known = cases.textures()
        for kind in reference.KINDS:
            for law in LAWS:
                kernel = cases.kernel(known[kind], law, cases.probes(known[kind], POINTS))
                other = reference.reference(library, kernel)
                reference.check_agreement(kernel, other, ("run_force",))
                times = take_turns([kernel.run_force, other.run_force], ROUNDS)
                ns = [f"{t:.1f}" for t in np.median(times, axis=0) / POINTS * 1e9]
                ratio = median_ratio(times, 0, 1)
                if ratio > GOAL:
                    missed.append(f"law {law} on {kind} {ratio:.2f}")
                table.add_row(kind, law, *ns, f"{ratio:.2f}")
    console.print(table)
    print_verdict(console, f"{GOAL}", missed)

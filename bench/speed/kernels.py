"""Time of a force, and of a force with its Jacobian, for each law and texture, against C."""

from __future__ import annotations

import ctypes
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from asperity.core.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.texture import Texture
from bench.speed import cases, reference
from bench.speed.timing import (
    Batch,
    affordable_count,
    median_ratio,
    number_table,
    print_verdict,
    take_turns,
)

GOAL = 1.3
PUBLIC_GOAL = 1.0  # [µs]
POINTS = 100_000
ROUNDS = 151  # against C; a batch takes milliseconds
ROUNDS_ALONE = 7
BATCH_SECONDS = 0.04  # slow kernels (nearest points) get fewer points

RUNS = {"force": "run_force", "force + Jacobian": "run_jacobian"}


@dataclass(frozen=True)
class Timing:
    """One kernel: nanoseconds per point, and the ratio asperity/C.

    Attributes:
        own: of asperity [ns].
        c: of C with ``gcc -O3`` [ns], if there is a counterpart.
        ratio: median ratio to ``gcc -O3``.
        ratio_native: median ratio to ``gcc -O3 -march=native``.
    """

    own: float
    c: float | None = None
    ratio: float | None = None
    ratio_native: float | None = None


Row = tuple[str, str, list[Timing]]


def run(console: Console) -> None:
    """Print the table of kernels, the verdict and the cost of the public call."""
    console.print(
        f"ns per point, medians; {POINTS} random probe points in the body (fewer for slow kernels)."
        "\nasperity/C: median ratio of batches run in turns; of record is plain gcc -O3 (SSE2,"
        "\nportable), native = gcc -O3 -march=native. Numba compiles for the machine it runs on."
    )
    with tempfile.TemporaryDirectory() as directory:
        libraries = _libraries(Path(directory), console)
        rows = _measure(libraries, console)
    console.print(_table(rows))
    _verdict(rows, console)
    _public_call(console)


def _libraries(directory: Path, console: Console) -> list[ctypes.CDLL]:
    if shutil.which("gcc") is None:
        console.print("not run: comparison with C (no gcc)")
        return []
    console.print(reference.compiler())
    return [reference.build(directory), reference.build(directory, ["-march=native"])]


def _measure(libraries: Sequence[ctypes.CDLL], console: Console) -> list[Row]:
    worst = 0.0
    rows: list[Row] = []
    known = cases.textures()
    work = [(kind, law) for kind in known for law in cases.LAWS]
    points = {kind: cases.probes(texture, POINTS) for kind, texture in known.items()}
    for kind, law in track(work, "kernels", console=console, transient=True):
        if libraries and kind in reference.KINDS and law in reference.LAWS:
            kernel = cases.kernel(known[kind], law, points[kind])
            others = [reference.reference(library, kernel) for library in libraries]
            worst = max([worst, *(reference.check_agreement(kernel, other) for other in others)])
            timings = [_against_c(kernel, others, name) for name in RUNS.values()]
        else:
            timings = [_time_alone(known[kind], law, points[kind], name) for name in RUNS.values()]
        rows.append((kind, law, timings))
    if libraries:
        console.print(f"C and asperity agree to {worst:.1e} (norm-wise, all compared kernels)")
    return rows


def _against_c(kernel: cases.Kernel, others: Sequence[reference.Reference], name: str) -> Timing:
    batches: list[Batch] = [getattr(side, name) for side in (kernel, *others)]
    times = take_turns(batches, ROUNDS)
    own, c, _native = (float(value) for value in np.median(times, axis=0) / POINTS * 1e9)
    return Timing(own, c, median_ratio(times, 0, 1), median_ratio(times, 0, 2))


def _time_alone(texture: Texture, law: str, points: FloatArray, name: str) -> Timing:
    few = cases.kernel(texture, law, points[:200])
    count = affordable_count(getattr(few, name), 200, BATCH_SECONDS, POINTS)
    kernel = cases.kernel(texture, law, points[:count])
    times = take_turns([getattr(kernel, name)], ROUNDS_ALONE)
    return Timing(float(np.median(times)) / count * 1e9)


def _table(rows: Sequence[Row]) -> Table:
    headings = []
    for what in RUNS:
        headings += [f"{what}\nasperity ns", "\nC ns", "asp./C\n-O3", "asp./C\nnative"]
    table = number_table("texture", "law", *headings, left=2)
    for kind, law, timings in rows:
        cells = [text for timing in timings for text in _cells(timing)]
        table.add_row(kind, law, *cells, end_section=law == cases.LAWS[-1])
    return table


def _cells(timing: Timing) -> list[str]:
    own = f"{timing.own:.1f}" if timing.own < 1000.0 else f"{timing.own:.0f}"
    if timing.c is None:
        return [own, "-", "-", "-"]
    return [own, f"{timing.c:.1f}", f"{timing.ratio:.2f}", f"{timing.ratio_native:.2f}"]


def _verdict(rows: Sequence[Row], console: Console) -> None:
    compared = [
        (timing.ratio, f"law {law} on {kind}, {what}")
        for kind, law, timings in rows
        for what, timing in zip(RUNS, timings, strict=True)
        if timing.ratio is not None
    ]
    if not compared:
        console.print("not run: verdict against C")
        return
    console.print("worst ratio {:.2f}: {}".format(*max(compared)))
    missed = [f"{where} {ratio:.2f}" for ratio, where in compared if ratio > GOAL]
    print_verdict(console, f"{GOAL}", missed)


def _public_call(console: Console) -> None:
    """Print what ``Surface.force`` costs beyond its kernel (array checks, allocation)."""
    texture = cases.textures()["sinusoid"]
    surface = Surface(texture, "C", stiffness=cases.STIFFNESS)
    parts, own = [], []
    for count, rounds in ((1, 5001), (POINTS, 31)):
        kernel = cases.kernel(texture, "C", cases.probes(texture, count))

        def public(points: FloatArray = kernel.points) -> FloatArray:
            return surface.force(points)

        kernel_time, public_time = np.median(take_turns([kernel.run_force, public], rounds), axis=0)
        own.append((public_time - kernel_time) * 1e6)
        parts.append(
            f"n = {count}: {public_time * 1e6:.1f} µs, its kernel {kernel_time * 1e6:.1f} µs"
        )
    console.print(f"surface.force(points), law C on a sinusoid: {'; '.join(parts)}")
    over = [f"{own[0]:.2f} µs"] if own[0] > PUBLIC_GOAL else []
    print_verdict(console, f"one point at most {PUBLIC_GOAL} µs beyond its kernel", over)

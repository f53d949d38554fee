"""Exported C: its speed against the kernel, its longest tick, its size on a microcontroller.

``python -m bench.export --ticks 10000000`` looks for the longest tick of that many, and
``python -m bench.export --points 1000000`` compares that many forces of every law and texture kind
with the kernel, bit by bit: hours, for the night.
"""

from __future__ import annotations

import argparse
import ctypes
import shutil
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.kernels import anchored_loops
from asperity.kernels.fuse import fuse_on_texture
from asperity.laws import LAWS
from asperity.surface import Surface
from asperity.textures import HeightMap
from bench import cases
from bench.c_programs import (
    STRICT,
    compiled,
    differing,
    forces,
    header,
    kernel_forces,
    library,
    probes,
    same_bits,
)
from bench.firmware import firmware, missing_tool
from bench.timing import median_ratio, seconds, take_turns

GOAL = 1.1
# A kernel that is faster takes several probes at once; no tick of a loop does [s].
TOGETHER = 5e-9
ROUNDS = 31
BATCH_SECONDS = 0.03
FLAGS = ("-O3", "-march=native")
SIDE = 1024
TICKS = 100_000
# Of the longest ticks so many are timed again: the shortest of all times is the tick's own.
AGAIN, TIMES = 200, 30

_CLOCK = """
#define _POSIX_C_SOURCE 199309L
#include <time.h>
#include "{name}.h"
void {name}_clocked(const double *at, double *took, int64_t n);
void {name}_clocked(const double *at, double *took, int64_t n)
{{
    double f[3];
    {name}_state state;
    {name}_reset(&state);
    for (int64_t i = 0; i < n; i++) {{
        struct timespec begin, end;
        clock_gettime(CLOCK_MONOTONIC, &begin);
        {name}_force(&state, at + 3 * i, f);
        clock_gettime(CLOCK_MONOTONIC, &end);
        took[i] = 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
        took[i] += (double)(end.tv_sec - begin.tv_sec);
    }}
}}
"""


def run(console: Console) -> None:
    """Print speed, longest ticks and what the sketch of a microcontroller takes."""
    if shutil.which("gcc") is None:
        console.print("not run: no gcc here")
        return
    with tempfile.TemporaryDirectory() as directory:
        _speed(console, Path(directory))
    _ticks(console, TICKS)
    _micro(console)


def _speed(console: Console, folder: Path) -> None:
    console.print(
        f"Time of exported C over that of the kernel, median of {ROUNDS} rounds in turns; gcc "
        f"{' '.join(FLAGS)}, as Numba compiles for the machine that it runs on; ns of the kernel. "
        f"Where that is below {1e9 * TOGETHER:.0f} ns it takes several probes at once: not counted."
    )
    table = Table(box=None, pad_edge=False)
    table.add_column("texture")
    for letter in LAWS:
        table.add_column(letter, justify="right")
    ratios = []
    for kind, texture in cases.textures().items():
        cells = []
        for letter in LAWS:
            ratio, own = _ratio(Surface(texture, letter, clamp="backed"), folder)
            if own > TOGETHER:
                ratios.append(ratio)
            cells.append(f"{ratio:.2f} {1e9 * own:.0f}")
        table.add_row(kind, *cells)
    console.print(table)
    verdict = "reached" if max(ratios) <= GOAL else "MISSED"
    middle = float(np.median(ratios))
    console.print(f"At most {GOAL} x: {verdict}; median {middle:.2f}, greatest {max(ratios):.2f}.")


def _ratio(surface: Surface, folder: Path) -> tuple[float, float]:
    """Return the ratio of times, and the kernel's for a probe [s]."""
    made = library(folder, "gcc", {"t": header(surface, "t", folder=folder)}, *FLAGS)
    at = cases.probes(surface.texture, 200)
    each = seconds(partial(kernel_forces, surface, at)) / len(at)
    each = min(each, seconds(partial(kernel_forces, surface, at)) / len(at))
    count = int(np.clip(BATCH_SECONDS / each, 40, 100_000))
    at = cases.probes(surface.texture, count)
    batches = [_kernel_batch(surface, at), partial(forces, made, "t", at)]
    times = take_turns(batches, ROUNDS)
    return median_ratio(times, 1, 0), float(np.median(times[:, 0])) / len(at)


def _kernel_batch(surface: Surface, at: Any) -> Any:
    """Return the kernel's own loop, bound: nothing is looked up while it is timed."""
    law, clamp = surface.law, surface.acting_clamp
    # The loop that carries a state, for every law, as the program does.
    loops = fuse_on_texture(law, surface.texture.sampler, clamp, (anchored_loops,))
    out = np.empty((len(at), 3))
    return partial(loops.trace_batch, at, out, surface.texture.arguments, surface.law_arguments)


def _ticks(console: Console, count: int) -> None:
    """Print the longest tick of laws with a search on a large map."""
    rng = np.random.default_rng(7)
    texture = HeightMap(2e-6 * rng.normal(size=(SIDE, SIDE)), 10e-6)
    console.print(f"Longest tick of {count:,} probes on a {SIDE} x {SIDE} map, gcc -O2:")
    for letter in "DH":
        surface = Surface(texture, letter)
        with tempfile.TemporaryDirectory() as directory:
            longest, mean, at = longest_tick(surface, Path(directory), count)
        where = ", ".join(f"{1e6 * part:.3f}" for part in at)
        words = f"{1e6 * longest:.0f} us at ({where}) um; mean {1e6 * mean:.1f} us"
        console.print(f"law {letter}: {words}")


def longest_tick(surface: Surface, folder: Path, count: int) -> tuple[float, float, Any]:
    """Return the longest time of a tick and the mean [s], and the probe of the longest [m]."""
    name = "t"
    (folder / f"{name}.h").write_text(header(surface, name, folder=folder), encoding="utf-8")

    source = folder / "clock.c"
    source.write_text(_CLOCK.format(name=name), encoding="utf-8")
    made = compiled(folder, "gcc", source, *STRICT, "-O2")
    slowest: list[tuple[float, Any]] = []
    total = 0.0
    for at in _batches(surface, count):
        took = _clocked(made, at)
        total += float(took.sum())
        worst = np.argsort(took)[-AGAIN:]
        again = np.min([_clocked(made, at[worst]) for _ in range(TIMES)], axis=0)
        slowest.append((float(again.max()), at[worst[again.argmax()]]))
    longest, where = max(slowest, key=lambda pair: pair[0])
    return longest, total / count, where


def _batches(surface: Surface, count: int) -> Iterator[Any]:
    for seed, start in enumerate(range(0, count, TICKS)):
        yield probes(surface.texture, surface.max_depth, min(TICKS, count - start), seed)


def _clocked(made: ctypes.CDLL, at: Any) -> Any:
    at, took = np.ascontiguousarray(at), np.empty(len(at))
    given = [array.ctypes.data_as(ctypes.c_void_p) for array in (at, took)]
    made.t_clocked(*given, ctypes.c_int64(len(at)))
    return took


def _micro(console: Console) -> None:
    lacking = missing_tool()
    if lacking is not None:
        console.print(f"Cortex-M4F: not run, no {lacking} here")
        return
    console.print("Cortex-M4F, single precision, gcc -Os: the sketch without the empty program")
    table = Table(box=None, pad_edge=False)
    for heading in ("law, texture", "flash [B]", "RAM [B]", "instructions in a tick"):
        table.add_column(heading, justify="right" if heading[0] != "l" else "left")
    for kind, texture in cases.textures().items():
        for letter in "CFD":
            with tempfile.TemporaryDirectory() as directory:
                one = firmware(Surface(texture, letter, clamp="backed"), Path(directory))
            table.add_row(
                f"{letter}, {kind}", str(one.flash), str(one.ram), f"{one.instructions:.0f}"
            )
    console.print(table)


def compare_bits(console: Console, count: int) -> int:
    """Compare forces of every law and texture kind; return how many differ."""
    wrong = 0
    for kind, texture in cases.textures().items():
        for letter in LAWS:
            surface = Surface(texture, letter, clamp="backed")
            with tempfile.TemporaryDirectory() as directory:
                folder = Path(directory)
                text = header(surface, "t", folder=folder)
                made = library(folder, "gcc", {"t": text}, "-O2")
                for at in _batches(surface, count):
                    equal = same_bits(forces(made, "t", at), kernel_forces(surface, at))
                    wrong += int((~equal).sum())
                    if not equal.all():
                        console.print(f"{kind}, {differing([letter], [equal])}")
        console.print(f"{kind}: {count:,} probes for each law, {wrong} differ")
    return wrong


def main() -> int:
    """Run one of the long parts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ticks", type=int, default=0)
    parser.add_argument("--points", type=int, default=0)
    asked = parser.parse_args()
    console = Console(width=100, highlight=False)
    if asked.ticks:
        _ticks(console, asked.ticks)
    return int(bool(asked.points and compare_bits(console, asked.points)))


if __name__ == "__main__":
    sys.exit(main())

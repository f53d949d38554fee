"""Exported C: its speed against the kernel, its longest tick, its size on a microcontroller.

``python -m bench.speed.export COUNT`` looks for the longest tick of that many.
"""

from __future__ import annotations

import ctypes
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console

from asperity.contacts.warm_start import EVALUATIONS
from asperity.laws import LAWS
from asperity.surface import Surface
from asperity.textures import HeightMap
from bench.speed import cases
from bench.speed.c_programs import (
    STRICT,
    as_exported,
    compile_library,
    header,
    library,
    probes,
    program_ticks,
    surface_ticks,
)
from bench.speed.firmware import build_firmware, missing_tool
from bench.speed.timing import (
    affordable_count,
    median_ratio,
    number_table,
    print_verdict,
    take_turns,
)

GOAL = 1.1
# A kernel that is faster takes several probes at once; no tick of a loop does [s].
MEAN_OVERHEAD = 5e-9
ROUNDS = 151
BATCH_SECONDS = 0.005
FLAGS = ("-O3", "-march=native")
SIDE = 1024
TICKS = 100_000
# Of the longest ticks so many are timed again: the shortest of all times is the tick's own.
AGAIN, TIMES = 200, 30

_CLOCK = """
#define _POSIX_C_SOURCE 199309L
#include <time.h>
#include "{name}.h"
void {name}_clocked(const double *at, double *took, double *looks, int64_t n);
void {name}_clocked(const double *at, double *took, double *looks, int64_t n)
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
        looks[i] = state.memory[{taken}];
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
        f"Where that is below {1e9 * MEAN_OVERHEAD:.0f} ns several are taken at once: not counted."
    )
    table = number_table("texture", *LAWS)
    ratios = []
    for kind, texture in cases.textures().items():
        cells = []
        for letter in LAWS:
            ratio, own = _ratio(as_exported(Surface(texture, letter, clamp="backed")), folder)
            if own > MEAN_OVERHEAD:
                ratios.append(ratio)
            cells.append(f"{ratio:.2f} {1e9 * own:.0f}")
        table.add_row(kind, *cells)
    console.print(table)
    console.print(f"median {np.median(ratios):.2f}, greatest {max(ratios):.2f}")
    missed = [f"{ratio:.2f}" for ratio in ratios if ratio > GOAL]
    print_verdict(console, f"at most {GOAL}", missed)


def _ratio(surface: Surface, folder: Path) -> tuple[float, float]:
    """Return the ratio of times, and the kernel's for a probe [s]."""
    made = library(folder, "gcc", {"t": header(surface, "t", folder=folder)}, *FLAGS)
    few = surface_ticks(surface, cases.probes(surface.texture, 40)).run
    count = affordable_count(few, 40, BATCH_SECONDS, 100_000)
    at = cases.probes(surface.texture, count)
    batches = [surface_ticks(surface, at).run, program_ticks(made, "t", at, gaps=False).run]
    times = take_turns(batches, ROUNDS)
    return median_ratio(times, 1, 0), float(np.median(times[:, 0])) / len(at)


def _ticks(console: Console, count: int) -> None:
    """Print the longest tick of laws with a search on a large map."""
    rng = np.random.default_rng(7)
    texture = HeightMap(2e-6 * rng.normal(size=(SIDE, SIDE)), 10e-6)
    console.print(f"Longest tick of {count:,} probes on a {SIDE} x {SIDE} map, gcc -O2:")
    for letter in "DE":
        surface = Surface(texture, letter)
        with tempfile.TemporaryDirectory() as directory:
            slow = longest_tick(surface, Path(directory), count)
        where = ", ".join(f"{1e6 * part:.3f}" for part in slow.at)
        words = f"{1e6 * slow.longest:.0f} us at ({where}) um; mean {1e6 * slow.mean:.1f} us"
        budget = (
            f"at most {slow.evaluations:.0f} of {surface.law.contact.max_evaluations:.0f} looks"
        )
        console.print(f"law {letter}: {words}; {budget}")


class LongestTick(NamedTuple):
    """The longest of many ticks [s], their mean [s], where it was [m], and the most looks."""

    longest: float
    mean: float
    at: Any
    evaluations: float


def longest_tick(surface: Surface, folder: Path, count: int) -> LongestTick:
    """Return the longest tick of many probes; each begins where the last one ended."""
    name = "t"
    (folder / f"{name}.h").write_text(header(surface, name, folder=folder), encoding="utf-8")
    source = folder / "clock.c"
    source.write_text(_CLOCK.format(name=name, taken=EVALUATIONS), encoding="utf-8")
    made = compile_library(folder, "gcc", source, *STRICT, "-O2")
    slowest: list[tuple[float, Any]] = []
    total = most = 0.0
    for at in _batches(surface, count):
        took, looks = _time_ticks(made, at)
        total, most = total + float(took.sum()), max(most, float(looks.max()))
        worst = np.argsort(took)[-AGAIN:]
        again = np.min([_time_ticks(made, at[worst])[0] for _ in range(TIMES)], axis=0)
        slowest.append((float(again.max()), at[worst[again.argmax()]]))
    longest, where = max(slowest, key=lambda pair: pair[0])
    return LongestTick(longest, total / count, where, most)


def _batches(surface: Surface, count: int) -> Iterator[Any]:
    for seed, start in enumerate(range(0, count, TICKS)):
        yield probes(surface.texture, surface.max_depth, min(TICKS, count - start), seed)


def _time_ticks(program: ctypes.CDLL, at: Any) -> tuple[Any, Any]:
    """Return the times [s] and the looks of ticks."""
    at, took, looks = np.ascontiguousarray(at), np.empty(len(at)), np.empty(len(at))
    given = [array.ctypes.data_as(ctypes.c_void_p) for array in (at, took, looks)]
    program.t_clocked(*given, ctypes.c_int64(len(at)))
    return took, looks


def _micro(console: Console) -> None:
    lacking = missing_tool()
    if lacking is not None:
        console.print(f"Cortex-M4F: not run, no {lacking} here")
        return
    console.print("Cortex-M4F, single precision, gcc -Os: the sketch without the empty program")
    table = number_table("law, texture", "flash [B]", "RAM [B]", "instructions in a tick")
    for kind, texture in cases.textures().items():
        for letter in "CFD":
            with tempfile.TemporaryDirectory() as directory:
                one = build_firmware(Surface(texture, letter, clamp="backed"), Path(directory))
            table.add_row(
                f"{letter}, {kind}", str(one.flash), str(one.ram), f"{one.instructions:.0f}"
            )
    console.print(table)


if __name__ == "__main__":
    _ticks(Console(width=100, highlight=False), int(sys.argv[1]))

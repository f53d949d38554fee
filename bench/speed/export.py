"""Exported C: its speed against the kernel, its longest tick, its size on a microcontroller.

``python -m bench.speed.export --ticks 10000000`` looks for the longest tick of that many, and
``python -m bench.speed.export --points 1000000`` compares that many ticks of every law and texture
kind with the kernel, bit by bit: minutes for each law with a search; ``--laws D`` takes one of
them. ``--first`` prints the first ticks of a process with a baked field.
"""

from __future__ import annotations

import argparse
import ctypes
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.contacts.warm_start import EVALUATIONS
from asperity.export.c99 import c99_files
from asperity.export.surface_functions import ExportRequest
from asperity.laws import LAWS
from asperity.rendering import bake
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap
from asperity.textures.fields.field_file import save_field
from bench.speed import cases
from bench.speed.c_programs import (
    STRICT,
    as_exported,
    compile_library,
    header,
    kernel_ticks,
    library,
    probes,
    program_ticks,
    run_command,
    same_bits,
    surface_ticks,
    ticks,
)
from bench.speed.firmware import build_firmware, missing_tool
from bench.speed.timing import median_ratio, seconds, take_turns

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
FIRST_TICKS, PROCESSES = 1000, 21

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


_FIRST = """
#define _POSIX_C_SOURCE 199309L
#define T_POSIX
#include <stdio.h>
#include <time.h>
#include "t.h"
int main(int count, char **words)
{{
    static double took[{ticks}];
    volatile double used;
    t_state state;
    t_reset(&state);
#if defined(T_LOADED)
    if (t_load("t.field") != T_LOADED) {{
        return 1;
    }}
#endif
    if (count > 1) {{
        t_prepare();
    }}
    for (int i = 0; i < {ticks}; i++) {{
        struct timespec begin, end;
        double f[3], at[3] = {{2.5e-5 * i, 1.7e-5 * i, {z:.17g}}};
        clock_gettime(CLOCK_MONOTONIC, &begin);
        t_force(&state, at, f);
        used = f[0] + f[1] + f[2];
        clock_gettime(CLOCK_MONOTONIC, &end);
        took[i] = 1e9 * (double)(end.tv_sec - begin.tv_sec) + (double)(end.tv_nsec - begin.tv_nsec);
    }}
    for (int i = 0; i < {ticks}; i++) {{
        printf("%.0f\\n", took[i]);
    }}
    return words == NULL && used != 0.0;
}}
"""


def run(console: Console) -> None:
    """Print speed, longest and first ticks and what the sketch of a microcontroller takes."""
    if shutil.which("gcc") is None:
        console.print("not run: no gcc here")
        return
    with tempfile.TemporaryDirectory() as directory:
        _speed(console, Path(directory))
    _ticks(console, TICKS)
    print_first_ticks(console)
    _micro(console)


def _speed(console: Console, folder: Path) -> None:
    console.print(
        f"Time of exported C over that of the kernel, median of {ROUNDS} rounds in turns; gcc "
        f"{' '.join(FLAGS)}, as Numba compiles for the machine that it runs on; ns of the kernel. "
        f"Where that is below {1e9 * MEAN_OVERHEAD:.0f} ns several are taken at once: not counted."
    )
    table = Table(box=None, pad_edge=False)
    table.add_column("texture")
    for letter in LAWS:
        table.add_column(letter, justify="right")
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
    verdict = "reached" if max(ratios) <= GOAL else "MISSED"
    middle = float(np.median(ratios))
    console.print(f"At most {GOAL} x: {verdict}; median {middle:.2f}, greatest {max(ratios):.2f}.")


def _ratio(surface: Surface, folder: Path) -> tuple[float, float]:
    """Return the ratio of times, and the kernel's for a probe [s]."""
    made = library(folder, "gcc", {"t": header(surface, "t", folder=folder)}, *FLAGS)
    few = surface_ticks(surface, cases.probes(surface.texture, 200)).run
    each = min(seconds(few), seconds(few)) / 200
    count = int(np.clip(BATCH_SECONDS / each, 40, 100_000))
    at = cases.probes(surface.texture, count)
    batches = [surface_ticks(surface, at).run, program_ticks(made, "t", at, gaps=False).run]
    times = take_turns(batches, ROUNDS)
    return median_ratio(times, 1, 0), float(np.median(times[:, 0])) / len(at)


def _ticks(console: Console, count: int) -> None:
    """Print the longest tick of laws with a search on a large map."""
    rng = np.random.default_rng(7)
    texture = HeightMap(2e-6 * rng.normal(size=(SIDE, SIDE)), 10e-6)
    console.print(f"LongestTick tick of {count:,} probes on a {SIDE} x {SIDE} map, gcc -O2:")
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


def print_first_ticks(console: Console) -> None:
    """Print the first ticks of fresh processes that render a baked field of some megabytes."""
    waves = Fourier([1e-4, 6e-5], [[2000.0, 0.0], [0.0, 3000.0]], [0.3, 1.1])
    surface = bake(Surface(waves, "H", 800.0, max_depth=3e-4), 15e-6, max_gain=None)
    head = f"First {FIRST_TICKS} ticks, median of {PROCESSES} processes, gcc -O2"
    size = sum(np.asarray(part).nbytes for part in surface.texture.arguments)
    console.print(f"{head}: a field of {size / 1e6:.1f} MB")
    table = Table(box=None, pad_edge=False)
    for heading in (
        "field",
        "prepared",
        "first [ns]",
        "median [ns]",
        "99 % [ns]",
        "longest [ns]",
        "sum [us]",
    ):
        table.add_column(heading, justify="left" if heading in {"field", "prepared"} else "right")
    for loads_field in (False, True):
        with tempfile.TemporaryDirectory() as directory:
            _write_first_ticks(surface, Path(directory), loads_field=loads_field)
            for words in ((), ("prepare",)):
                runs = [_run_first_ticks(Path(directory), words) for _ in range(PROCESSES)]
                took = np.median(runs, axis=0)
                numbers = (
                    took[0],
                    np.median(took),
                    np.quantile(took, 0.99),
                    took.max(),
                    1e-3 * took.sum(),
                )
                place = "loaded" if loads_field else "in the source"
                table.add_row(place, "yes" if words else "no", *(f"{n:.0f}" for n in numbers))
    console.print(table)


def _write_first_ticks(surface: Surface, folder: Path, *, loads_field: bool) -> None:
    request = ExportRequest(surface, "t", loads_field=loads_field)
    for name, text in c99_files(request, "t").items():
        (folder / name).write_text(text, encoding="utf-8")
    save_field(folder / "t.field", surface.texture)
    z = surface.texture.extremes[0] - 0.5 * surface.max_depth
    (folder / "first.c").write_text(_FIRST.format(ticks=FIRST_TICKS, z=z), encoding="utf-8")
    sources = ["first.c", *(path.name for path in folder.glob("t_data.c"))]
    run_command("gcc", *STRICT, "-O2", *sources, "-o", "first", "-lm", cwd=folder)


def _run_first_ticks(folder: Path, words: tuple[str, ...]) -> Any:
    """Return the times of the first ticks of a process [ns]."""
    return np.array([float(part) for part in run_command("./first", *words, cwd=folder).split()])


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
                one = build_firmware(Surface(texture, letter, clamp="backed"), Path(directory))
            table.add_row(
                f"{letter}, {kind}", str(one.flash), str(one.ram), f"{one.instructions:.0f}"
            )
    console.print(table)


def compare_bits(console: Console, count: int, laws: str) -> int:
    """Compare ticks of laws on every texture kind; return how many differ."""
    wrong = 0
    for kind, texture in cases.textures().items():
        for letter in laws:
            started = perf_counter()
            differ, short = _count_differences(
                as_exported(Surface(texture, letter, clamp="backed")), count
            )
            wrong += differ
            told = f"{count:,} ticks, {short:,} of them cut short; {differ} differ"
            console.print(f"{letter} on {kind}: {told} ({perf_counter() - started:.0f} s)")
    return wrong


def _count_differences(surface: Surface, count: int) -> tuple[int, int]:
    """Return how many ticks differ in a bit of force or gap, and how many have a gap."""
    differ = short = 0
    with tempfile.TemporaryDirectory() as directory:
        folder = Path(directory)
        made = library(folder, "gcc", {"t": header(surface, "t", folder=folder)}, "-O2")
        for at in _batches(surface, count):
            found = ticks(made, "t", at)
            differ += int((~same_bits(found, kernel_ticks(surface, at))).sum())
            short += int((found[:, 3] > 0.0).sum())
    return differ, short


def main() -> int:
    """Run one of the long parts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ticks", type=int, default=0)
    parser.add_argument("--points", type=int, default=0)
    parser.add_argument("--first", action="store_true", help="print the first ticks")
    parser.add_argument("--laws", default="".join(LAWS), help="of --points; default: all of them")
    asked = parser.parse_args()
    console = Console(width=100, highlight=False)
    if asked.first:
        print_first_ticks(console)
    if asked.ticks:
        _ticks(console, asked.ticks)
    return int(bool(asked.points and compare_bits(console, asked.points, asked.laws)))


if __name__ == "__main__":
    sys.exit(main())

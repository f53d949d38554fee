"""What a tick of an exported field takes whose coefficients are stored one by one or in bricks."""

from __future__ import annotations

import ctypes
import shutil
import tempfile
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from rich.console import Console

from asperity.export.c99 import c99_files
from asperity.export.surface_functions import ExportRequest
from asperity.rendering import bake
from asperity.surface import Surface
from asperity.textures.catalogue import as_texture
from asperity.textures.fields import bake as baking
from asperity.textures.fields.field_file import save_field
from bench.speed.c_programs import library, program_ticks
from bench.speed.fields import stroke
from bench.speed.timing import median_ratio, number_table, take_turns

# Surfaces with the resolutions of their fields [m].
SURFACES = {"knurl": 35.1e-6, "cloth": 17e-6, "wood": 34.3e-6}
BUILDS = (("gcc", "-O2"), ("gcc", "-O3", "-march=x86-64-v3"), ("clang", "-O2", "-march=x86-64-v3"))
PAGES = "-D_DEFAULT_SOURCE"  # without it the header does not know of huge pages
RATE, TICKS, TURNS = 1000.0, 100_000, 21
_OPEN = """
int t_open(const char *path);
int t_open(const char *path)
{
    return t_load(path);
}
"""


def stored_surface(name: str, limit: int) -> Surface:
    """Return a baked surface, in bricks if its nodes take more than a limit [bytes]."""
    with mock.patch.object(baking, "BRICK_BYTES", limit):
        return bake(Surface(as_texture(name), "H"), SURFACES[name], max_gain=None)


def loaded(surface: Surface, folder: Path, field: Path, *build: str) -> ctypes.CDLL:
    """Return a program of its own that has loaded a field."""
    header = c99_files(ExportRequest(surface, "t", loads_field=True), "t")["t.h"]
    program = library(folder, build[0], {"t": header + _OPEN}, *build[1:])
    if program.t_open(str(field).encode()) != 0:
        raise OSError(f"{field} is not loaded")
    return program


def run(console: Console) -> None:
    """Print the times of ticks along a stroke, and how many times as fast bricks are."""
    builds = [build for build in BUILDS if shutil.which(build[0])]
    headings = [" ".join(build) for build in builds]
    table = number_table("field", "MB", "in bricks\nMB", "one by one\nns", "huge pages", *headings)
    for name in SURFACES:
        with tempfile.TemporaryDirectory() as directory:
            folder = Path(directory)
            surfaces = [stored_surface(name, limit) for limit in (2**40, 0)]
            fields: list[Any] = [surface.texture for surface in surfaces]
            for k, field in enumerate(fields):
                save_field(folder / f"{k}.field", field)
            at = stroke(surfaces[0].texture, RATE, TICKS)
            uses = [(0, builds[0]), (0, (*builds[0], PAGES))]
            uses += [(1, (*build, PAGES)) for build in builds]
            programs = [loaded(surfaces[0], folder, folder / f"{k}.field", *b) for k, b in uses]
            batches = [program_ticks(program, "t", at, gaps=False).run for program in programs]
            times = take_turns(batches, TURNS)
            ratios = [f"{1.0 / median_ratio(times, k, 0):.2f} x" for k in range(1, len(programs))]
            sizes = [f"{field.bytes / 1e6:.1f}" for field in fields]
            table.add_row(name, *sizes, f"{1e9 * np.median(times[:, 0]) / TICKS:.0f}", *ratios)
    console.print(f"strokes of {TICKS} ticks at {RATE:g} Hz, {TURNS} turns; times as fast")
    console.print(table)

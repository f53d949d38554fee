"""Exported C, compiled and called, and where it is compared with the kernel."""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from asperity.contacts.warm_start import UNLIMITED, new_warm_start
from asperity.export.c99 import c99_files
from asperity.export.surface_functions import ExportRequest
from asperity.kernels import path_loop
from asperity.kernels.fuse import fuse_on_texture
from asperity.rendering import bake, is_searched
from asperity.surface import Surface
from asperity.textures import Texture

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic")


def run_command(*command: str | Path, cwd: Path | None = None) -> str:
    """Run a program that must succeed and return what it says.

    Raises:
        RuntimeError: with all that it said, if it does not.
    """
    done = subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, check=False, cwd=cwd
    )
    if done.returncode != 0:
        raise RuntimeError(f"{command}\n{done.stdout}{done.stderr}")
    return done.stdout


def as_exported(surface: Surface) -> Surface:
    """Return a surface with law H baked, on a coarse grid, where it would be searched."""
    if not is_searched(surface):
        return surface
    domain = surface.texture.domain
    extent = None
    if not (domain.periodic or surface.texture.is_mirrored):
        extent = tuple(float(side) for side in np.abs(domain.spans).max(axis=0))
    low, high = surface.texture.extremes
    coarse = 0.25 * (high - low + surface.max_depth)
    return bake(surface, coarse, press=1e-6, extent=extent, max_gain=None)


def header(
    surface: Surface,
    name: str = "texture",
    precision: str = "double",
    folder: Path | None = None,
    max_evaluations: float | None = None,
) -> str:
    """Return the header of a surface; large data are written beside it, into a folder."""
    first, *others = c99_files(
        ExportRequest(surface, name, precision, max_evaluations=max_evaluations), name
    ).items()
    for file, text in others:
        if folder is None:
            raise ValueError(f"{file} stands beside the header: name a folder for it")
        (folder / file).write_text(text, encoding="utf-8")
    return first[1]


_MANY = """
#include "{name}.h"
void {name}_many(const {real} *at, {real} *f, {real} *gap, int64_t n);
void {name}_many(const {real} *at, {real} *f, {real} *gap, int64_t n)
{{
    {name}_state state;
    {name}_reset(&state);
    for (int64_t i = 0; i < n; i++) {{
        {name}_force(&state, at + 3 * i, f + 3 * i);
        if (gap) {{
            gap[i] = {name}_gap(&state);
        }}
    }}
}}
"""


_ENERGY = """
void {name}_energies(const {real} *at, {real} *u, int64_t n);
void {name}_energies(const {real} *at, {real} *u, int64_t n)
{{
    for (int64_t i = 0; i < n; i++) {{
        u[i] = {name}_energy(at + 3 * i);
    }}
}}
"""


def library(
    folder: Path, compiler: str, headers: Mapping[str, str], *flags: str, single: bool = False
) -> ctypes.CDLL:
    """Return exported headers, by name, compiled into one library: ``NAME_many`` for each."""
    real = "float" if single else "double"
    for name, text in headers.items():
        (folder / f"{name}.h").write_text(text, encoding="utf-8")
    source = folder / "all.c"
    parts = [
        _MANY + (_ENERGY if f"{name}_energy(" in text else "") for name, text in headers.items()
    ]
    texts = [part.format(name=name, real=real) for part, name in zip(parts, headers, strict=True)]
    source.write_text("".join(texts), encoding="utf-8")
    return compile_library(folder, compiler, source, *STRICT, *flags)


def compile_library(folder: Path, compiler: str, source: Path, *flags: str) -> ctypes.CDLL:
    """Compile a source and the data files of its folder into a library."""
    library = folder / f"all_{len(list(folder.iterdir()))}.so"
    data = folder.glob("*_data.c")
    run_command(compiler, *flags, "-shared", "-fPIC", source, *data, "-o", library, "-lm")
    return ctypes.CDLL(str(library))


class Ticks(NamedTuple):
    """Ticks along a path, prepared so that only their execution is timed.

    Attributes:
        run: runs the ticks.
        forces: result [N], (n, 3).
        told: result, (n, 1) gaps [m], or (n, 2) with the evaluations of the surface.
    """

    run: Callable[[], object]
    forces: Any
    told: Any

    def result(self) -> Any:
        """Run the ticks and return forces and gaps, shape (n, 4)."""
        self.run()
        return np.column_stack([self.forces, self.told[:, 0]])


def program_ticks(program: ctypes.CDLL, name: str, points: Any, *, gaps: bool = True) -> Ticks:
    """Return ticks of a program along a path, in its precision; a gap is a call of its own."""
    arrays = points, np.empty_like(points), np.empty((len(points), 1), points.dtype)
    given = [array.ctypes.data_as(ctypes.c_void_p) for array in arrays[: 2 + gaps]]
    run = partial(
        getattr(program, f"{name}_many"), *given, *[None] * (not gaps), ctypes.c_int64(len(points))
    )
    return Ticks(run, *arrays[1:])


def ticks(program: ctypes.CDLL, name: str, points: Any) -> Any:
    """Return forces [N] and gaps [m] along a path, (n, 4)."""
    return program_ticks(program, name, points).result()


def surface_ticks(surface: Surface, points: Any, max_evaluations: float | None = None) -> Ticks:
    """Return ticks of the kernel of loops and simulations along a path.

    Nothing is remembered before. Batches have a sine of their own, ``kernels.batch_sine``.
    """
    law, out, told = surface.law, np.empty((len(points), 3)), np.empty((len(points), 2))
    friction = surface.contact_friction is not None
    clamp, sampler = surface.effective_clamp, surface.texture.sampler
    loops = fuse_on_texture(law, sampler, clamp, (path_loop,), has_friction=friction)
    budget = law.contact.max_evaluations if max_evaluations is None else max_evaluations
    arguments = surface.texture.arguments, surface.loop_arguments
    fresh = new_warm_start(min(budget, UNLIMITED))
    memory = fresh.copy()

    def run() -> None:
        memory[:] = fresh
        loops.path_batch(points, out, told, memory, *arguments)

    return Ticks(run, out, told)


def probes(texture: Texture, depth: float, count: int, seed: int) -> Any:
    """Return probe positions, a quarter each: anywhere, below crests, at borders, at the surface.

    Those at borders (of cells, copies and the patch) and below crests are off by as little as
    1e-12 of a period.
    """
    rng = np.random.default_rng(seed)
    n = count // 4
    domain, (low, high) = texture.domain, texture.extremes
    spans = domain.spans
    wide = domain.points(rng.uniform(-1.2, 2.2, (4 * n, len(spans))))
    if texture.is_profile:
        wide = wide + rng.normal(size=(4 * n, 1)) * 1e-3 * np.array([-spans[0][1], spans[0][0]])
    reach = float(np.hypot(*spans[0]))
    near = reach * 10.0 ** rng.uniform(-12, -2, (n, 2)) * rng.choice([-1.0, 1.0], (n, 2))
    crests = _move_uphill(texture, wide[n : 2 * n]) + near
    steps = rng.integers(-4, 9, (n, len(spans))) / rng.choice([1, 2, 6, 8], (n, 1))
    borders = domain.points(steps) + near
    xy = np.ascontiguousarray(np.vstack([wide[:n], crests, borders, wide[3 * n :]]))
    h = texture.height(xy)
    z = h - (depth + high - low) * rng.uniform(-0.1, 1.3, 4 * n)
    z[3 * n :] = h[3 * n :] - depth * 10.0 ** rng.uniform(-16, -1, n) * rng.choice([-1, 1], n)
    points = np.column_stack([xy, z])
    return np.ascontiguousarray(points[rng.permutation(4 * n)])


def _move_uphill(texture: Texture, xy: Any) -> Any:
    """Return points moved towards the nearest crests."""
    bend = max(texture.bounds[1], 1e-30)
    for _ in range(60):
        xy = np.ascontiguousarray(xy + texture.gradient(xy) / bend)
    return xy

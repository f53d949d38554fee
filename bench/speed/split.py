"""Cost of law H in its three forms, and a long search for a break of its Lipschitz constant.

``python -m bench.speed.split`` prints the costs, ``python -m bench.speed.split --pairs 1000000``
searches.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from asperity.analysis.energy.field_energy import split_state
from asperity.core.checks import FloatArray
from asperity.rendering import bake
from asperity.surface import Surface
from asperity.textures import HeightMap, Profile, Sinusoid, load_texture
from asperity.textures.fields.potential_field import PotentialField
from asperity.textures.texture import Texture
from bench.speed import cases
from bench.speed.timing import seconds, take_turns

GOALS = {"closed form": 1.5, "map": 100.0, "baked": 0.1}  # µs
ROUNDS = 15
BATCH_SECONDS = 0.05
PIXELS = 10
STIFFNESS = cases.STIFFNESS
DATA = Path(__file__).parents[3] / "shared" / "data" / "sample-land.x3p"
PAIRS_AT_ONCE = 20_000
TOLERANCE = 1e-10
RIDGES = 20  # one pair of so many straddles a jump of the nearest point


def run(console: Console) -> None:
    """Print the time of a force of law H, and how it compares with what was asked for."""
    table = Table(box=None, pad_edge=False)
    for heading in ("law H", "of", "µs per force", "goal", "with Jacobian", "split"):
        table.add_column(heading, justify="left" if heading in {"law H", "of"} else "right")
    for form, what, surface, points in _exact_cases():
        force, jacobian = _exact_times(surface, points)
        share = float(np.mean(split_state(surface, points[:2000]).atoms > 1))
        table.add_row(form, what, *_cells(form, force), f"{jacobian:.2f}", f"{share:.0%}")
    for what, time in _baked_times():
        table.add_row("baked", what, *_cells("baked", time), "-", "-")
    console.print("medians of batches over random probe points, one thread")
    console.print(table)


def _cells(form: str, time: float) -> tuple[str, str]:
    goal = GOALS[form]
    digits = 3 if time < 1.0 else 2
    return f"{time:.{digits}f}", f"{goal:g} {'met' if time <= goal else 'MISSED'}"


def _exact_cases() -> list[tuple[str, str, Surface, FloatArray]]:
    result = []
    for part, depth in ((0.05, 0.5), (0.4, 0.1), (0.4, 2.0), (3.0, 0.5)):
        texture = Sinusoid(part * 1e-3, 1e-3, phase=0.3, direction=(0.8, 0.6))
        what = f"sinusoid A/l = {part}, {depth:g} of its height deep"
        points = cases.probes(texture, 20_000, depth * texture.peak_to_valley)
        result.append(("closed form", what, _surface(texture), points))
    rng = np.random.default_rng(cases.SEED)
    rough = HeightMap(cases._rough((1024, 1024), rng), pitch=50e-6)
    named: dict[str, HeightMap] = {"band-limited noise": rough}
    if DATA.exists():
        measured = load_texture(DATA, magnify=20, s_cutoff=10e-6)
        assert isinstance(measured, HeightMap)
        named["measured land"] = measured
    for name, surface_map in named.items():
        ny, nx = surface_map.heights.shape
        points = cases.probes(surface_map, 20_000, PIXELS * surface_map.pitch[0])
        what = f"{name}, {nx} x {ny}, {PIXELS} pixels deep"
        result.append(("map", what, _surface(surface_map), points))
    return result


def _surface(texture: Texture) -> Surface:
    return Surface(texture, "H", STIFFNESS, max_depth=1e-3)


def _exact_times(surface: Surface, points: FloatArray) -> tuple[float, float]:
    """Return µs per force, and per force with Jacobian, of the compiled loops."""
    loops, arguments = surface._loops, (surface.texture.arguments, surface.law_arguments)
    force, jacobian = np.empty((len(points), 3)), np.empty((len(points), 3, 3))

    def forces(count: int) -> None:
        loops.force_batch(points[:count], force[:count], *arguments)

    def jacobians(count: int) -> None:
        loops.jacobian_batch(points[:count], force[:count], jacobian[:count], *arguments)

    times = []
    for batch in (forces, jacobians):
        batch(1)  # compiled, or loaded
        each = seconds(partial(batch, 200)) / 200
        count = int(np.clip(BATCH_SECONDS / each, 200, len(points)))
        runs = take_turns([partial(batch, count)], ROUNDS)
        times.append(float(np.median(runs)) / count * 1e6)
    return times[0], times[1]


def _baked_times() -> list[tuple[str, float]]:
    rng = np.random.default_rng(cases.SEED)
    textures: dict[str, Texture] = {
        "sinusoid A/l = 0.4": Sinusoid(0.4e-3, 1e-3, direction=(0.8, 0.6)),
        "map 64 x 64, periodic": HeightMap(cases._rough((64, 64), rng), pitch=50e-6, periodic=True),
    }
    result = []
    for name, texture in textures.items():
        surface = Surface(texture, "H", STIFFNESS, max_depth=0.3e-3)
        start = perf_counter()
        surface = bake(surface, 1e-5 if texture.is_profile else 3e-5)
        built, field = perf_counter() - start, surface.texture
        assert isinstance(field, PotentialField)
        xy = texture.domain.points(rng.uniform(size=(100_000, len(texture.domain.spans))))
        z = rng.uniform(field.grid.floor, texture.extremes[0], len(xy))
        points, out = np.column_stack([xy, z]), np.empty((len(xy), 3))
        loop, arguments = surface._loops.force_batch, (field.arguments, surface.law_arguments)
        runs = take_turns([partial(loop, points, out, *arguments)], ROUNDS)
        size = " x ".join(str(count) for count in field.grid.node_counts)
        what = f"{name}: {size} nodes, {field.bytes / 1e6:.1f} MB, built in {built:.1f} s, "
        what += f"q at most {field.gain.upper:.3f}"
        result.append((what, float(np.median(runs)) / len(xy) * 1e6))
    return result


# --- the search -----------------------------------------------------------------------------------


def search_textures() -> dict[str, Texture]:
    """Return the textures on which the Lipschitz constant is to hold."""
    t = np.arange(20) / 20
    shapes = {"triangle": np.abs(2 * t - 1), "square": np.where(t < 0.5, 1.0, 0.0), "sawtooth": t}
    result: dict[str, Texture] = {
        f"sinusoid {part:g}": Sinusoid(part * 1e-3, 1e-3, phase=0.3) for part in (0.05, 0.4, 3.0)
    }
    result |= {
        name: Profile(0.5e-3 * shape, 0.05e-3, periodic=True) for name, shape in shapes.items()
    }
    rng = np.random.default_rng(cases.SEED)
    result["noise"] = Profile(1e-4 * rng.normal(size=256), 1e-4, periodic=True)
    if DATA.exists():
        result["measured land"] = load_texture(DATA, magnify=20, s_cutoff=10e-6)
    return result


def _pairs(texture: Texture, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Return pairs of probes: random ones, and ones that straddle jumps of the nearest point."""
    rng = np.random.default_rng(seed)
    a = cases.probes(texture, count, 0.0)
    a[:, 2] -= min(texture.peak_to_valley, 2e-3) * 10 ** rng.uniform(-3, 0.3, count)
    a = a[rng.permutation(count)] + rng.normal(size=a.shape) * [1e-4, 1e-4, 0.0]
    b = a + rng.normal(size=a.shape) * 10 ** rng.uniform(-9, -4, (count, 1))
    low, high = a[::RIDGES].copy(), a[::RIDGES] + rng.normal(size=a[::RIDGES].shape) * 2e-4
    foot_low, foot_high = texture.nearest(low), texture.nearest(high)
    for _ in range(26):
        middle = 0.5 * (low + high)
        foot = texture.nearest(middle)
        to_low = np.linalg.norm(foot - foot_low, axis=1, keepdims=True)
        left = to_low < np.linalg.norm(foot - foot_high, axis=1, keepdims=True)
        low, foot_low = np.where(left, middle, low), np.where(left, foot, foot_low)
        high, foot_high = np.where(left, high, middle), np.where(left, foot_high, foot)
    a[::RIDGES], b[::RIDGES] = low, high
    return a, b


def _worst_ratios(surfaces: Sequence[Surface], count: int, seed: int) -> FloatArray:
    """Return for each surface the largest |Δf| - k max(1, c) |Δp| (1 + 1e-6) over k l, l = 1 mm.

    And the largest |Δf|/(k max(1, c) |Δp|) of pairs that are not too close, shape (2, n).
    """
    a, b = _pairs(surfaces[0].texture, count, seed)
    apart = np.linalg.norm(b - a, axis=1)
    result = np.empty((2, len(surfaces)))
    for index, surface in enumerate(surfaces):
        gain = STIFFNESS * max(1.0, surface.continuity)
        change = np.linalg.norm(surface.force(b) - surface.force(a), axis=1)
        result[0, index] = np.max(change - gain * apart * (1.0 + 1e-6)) / (STIFFNESS * 1e-3)
        far = apart > 1e-7
        result[1, index] = np.max(change[far] / (gain * apart[far]))
    return result


def _search_part(
    surfaces: Sequence[Surface], pairs: int, console: Console, title: str
) -> FloatArray:
    """Return what :func:`_worst_ratios` finds in so many pairs, searched in threads."""
    for surface in surfaces:
        surface.force(np.zeros((1, 3)))  # compiled before there are threads
    sizes = [min(PAIRS_AT_ONCE, pairs - first) for first in range(0, pairs, PAIRS_AT_ONCE)]
    with ThreadPoolExecutor(max_workers=os.cpu_count() or 1) as pool:
        found = pool.map(partial(_worst_ratios, surfaces), sizes, range(len(sizes)))
        watched = track(found, title, len(sizes), console=console, transient=True)
        return np.asarray(np.max(np.stack(list(watched)), axis=0))


def search(console: Console, pairs: int) -> bool:
    """Print the worst pairs of H, D and C on every texture; return whether H holds on all."""
    table = Table(box=None, pad_edge=False)
    for heading in ("texture", "c", "H: |Δf|/(kc|Δp|)", "H: excess", "D: excess", "C: excess"):
        table.add_column(heading, justify="left" if heading == "texture" else "right")
    sound = True
    for name, texture in search_textures().items():
        for c in (1.0, 4.0):
            surfaces = [Surface(texture, law, STIFFNESS, continuity=c) for law in "HDC"]
            excess, ratio = _search_part(surfaces, pairs, console, f"{name}, c = {c:g}")
            sound = sound and bool(excess[0] <= TOLERANCE)
            cells = [f"{ratio[0]:.7f}", *(f"{value:.1e}" for value in excess)]
            table.add_row(name, f"{c:g}", *cells)
    console.print(
        f"{pairs} pairs on each texture, one in {RIDGES} across a jump of the nearest point.\n"
        "Excess: the largest |Δf| - k max(1, c) |Δp| (1 + 1e-6), over k times 1 mm; that of H must "
        f"not exceed {TOLERANCE:g}."
    )
    console.print(table)
    console.print("H holds" if sound else "H is BROKEN", style="bold")
    return sound


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(prog="python -m bench.speed.split", description=__doc__)
    parser.add_argument("--pairs", type=int, default=0, help="search so many pairs per texture")
    options = parser.parse_args(arguments)
    console = Console(width=110, highlight=False)
    if options.pairs > 0:
        return 0 if search(console, options.pairs) else 1
    run(console)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

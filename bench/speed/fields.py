"""What a tick of a baked field costs along strokes, beside other laws."""

from __future__ import annotations

from functools import partial

import numpy as np
from rich.console import Console

from asperity.core.checks import FloatArray
from asperity.rendering import bake
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Texture
from asperity.textures.catalogue import as_texture
from asperity.textures.fields.field_grid import FieldGrid
from asperity.textures.fields.node_potentials import lattice_columns, split_columns
from asperity.textures.fields.potential_field import PotentialField
from bench.speed import cases, ticks
from bench.speed.c_programs import surface_ticks
from bench.speed.timing import number_table, print_verdict, take_turns

SPEED = 0.1
RATES = (4000.0, 1000.0)
TICKS, SEARCHED_TICKS = 1_000_000, 2_000
TURNS = 3
GOALS_NS = (60.0, 90.0)
NODE_COLUMNS = 400
PITCH = 50e-6
DEPTH = 0.15e-3


def surfaces() -> dict[str, tuple[Texture, float]]:
    """Return textures by name, each with the resolution [m] of its field."""
    rng = np.random.default_rng(cases.SEED)
    result: dict[str, tuple[Texture, float]] = {
        "map 1024 x 1024": (HeightMap(cases.rough_heights((1024, 1024), rng), PITCH), PITCH),
        "cloth": (as_texture("cloth"), 20e-6),
        "needles 512 x 512": (ticks.adversarial_textures()["needles"][0], PITCH),
    }
    for count in (8, 32):
        cells = rng.integers(-6, 7, (count, 2))
        waves = 2.0 * np.pi / 8e-3 * np.where(np.any(cells, axis=1, keepdims=True), cells, [1, 2])
        amplitudes = np.full(count, 1.6e-4 / np.sqrt(count))
        result[f"{count} waves"] = (Fourier(amplitudes, waves, rng.uniform(0, 6, count)), 40e-6)
    return result


def stroke(texture: Texture, rate: float, count: int) -> FloatArray:
    """Return ticks (n, 3) [m] of a stroke that is reflected at the borders of the texture."""
    domain = texture.domain
    sides = np.linalg.norm(domain.spans, axis=1)
    way = SPEED / rate * np.arange(count)[:, None] * np.array([np.cos(0.3), np.sin(0.3)])
    parts = np.abs((way / sides + 0.1) % 2.0 - 1.0)
    xy = domain.points(parts)
    return np.ascontiguousarray(np.column_stack([xy, texture.height(xy) - 0.5 * DEPTH]))


def stroke_times(surface: Surface, paths: list[FloatArray]) -> list[float]:
    """Return ns per tick along each path, the median of turns."""
    batches = [surface_ticks(surface, path).run for path in paths]
    times = np.median(take_turns(batches, TURNS), axis=0)
    return [float(time) / len(path) * 1e9 for time, path in zip(times, paths, strict=True)]


def print_nodes(console: Console) -> None:
    """Print what a node of a field takes by the proved search and from a lattice."""
    headings = ("surface", "nodes\ninside", "proved\nus", "lattice\nus", "equal to\n1e-6 spacings")
    table = number_table(*headings, "greatest difference\n[spacings]")
    for name, (texture, resolution) in surfaces().items():
        if isinstance(texture, Fourier):  # without a lattice
            continue
        grid = FieldGrid.fit(texture.domain, texture.extremes, DEPTH, 0.0, resolution)
        xy = texture.domain.points(np.random.default_rng(1).uniform(size=(NODE_COLUMNS, 2)))
        z = grid.height(np.arange(grid.levels, dtype=float))
        depths = np.empty((2, NODE_COLUMNS, grid.levels))
        searches = [split_columns(texture, 1.0), lattice_columns(texture, 1.0, grid)[0]]
        batches = [
            partial(search, xy, z, grid.margin, out)
            for search, out in zip(searches, depths, strict=True)
        ]
        times = np.median(take_turns(batches, TURNS), axis=0) / depths[0].size * 1e6
        inside = depths[0] > 0.0
        difference = np.abs(depths[1] - depths[0])[inside] / max(grid.spacing)
        equal = float((difference < 1e-6).mean())
        cells = (f"{times[0]:.1f}", f"{times[1]:.1f}", f"{equal:.3%}", f"{difference.max():.3f}")
        table.add_row(name, str(int(inside.sum())), *cells)
    console.print(table)


def run(console: Console) -> None:
    """Print a row for each surface, and whether the goals are met."""
    print_nodes(console)
    headings = ("surface", "MB", "baked H\n4 kHz ns", "1 kHz\nns")
    table = number_table(*headings, "C\nns", "G\nns", "D\nns", "H search\nns")
    missed: list[str] = []
    for name, (texture, resolution) in surfaces().items():
        exact = Surface(texture, "H", cases.STIFFNESS, max_depth=DEPTH)
        baked = bake(exact, resolution, press=1e-6, max_gain=None)  # no deeper than DEPTH
        field = baked.texture
        assert isinstance(field, PotentialField)
        times = stroke_times(baked, [stroke(texture, rate, TICKS) for rate in RATES])
        short = [stroke(texture, RATES[0], SEARCHED_TICKS)]
        others = [stroke_times(exact.to_law(law), short)[0] for law in "CGDH"]
        cells = [field.bytes / 1e6, *times, *others]
        table.add_row(name, *(f"{value:.0f}" for value in cells))
        if any(value > goal for value, goal in zip(times, GOALS_NS, strict=True)):
            missed.append(name)
    console.print(f"strokes of {SPEED:g} m/s of {TICKS} ticks; of others {SEARCHED_TICKS}")
    console.print(table)
    print_verdict(console, "60 and 90 ns", missed)

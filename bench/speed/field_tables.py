"""Tables of the documentation about baked fields.

- ``python -m bench.speed.field_tables depths [SURFACE ...]`` compares fields with exact law H at
  random places of one height, from light contact to ``max_depth`` below the highest point.
- ``python -m bench.speed.field_tables trade`` prints gain, difference and size of fields of several
  spacings, smoothed to several gains.
- ``python -m bench.speed.field_tables goals [SURFACE ...]`` bakes with the default goals and prints
  what is reached, and what it costs: the time of a tick along strokes of 0.1 m/s at 4 kHz, and the
  processor time of baking. A surface may be a file, magnified: ``land.x3p*20``. ``ball`` is a
  closed mesh of 81 920 triangles, 20 mm wide, with bumps of 0.2 mm.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.rendering import bake, rendered_surface
from asperity.surface import Surface
from asperity.textures import Texture, load_texture
from asperity.textures.catalogue import as_texture
from asperity.textures.fields.potential_field import PotentialField
from asperity.textures.meshes.bake_body import bake_body
from asperity.textures.meshes.mesh_body import MeshBody
from bench.speed.fields import stroke, stroke_times

SURFACES = ("cloth", "knurl", "wood")
DEPTHS = (0.1, 0.2, 0.3, 0.5, 0.8, 1.0)
PLACES = 3000
GOAL_SURFACES = ("cloth", "knurl", "tile", "wood", "sandpaper:grit=P120", "ball")
TICKS = 200_000
TRADE = (
    ("cloth", 40e-6),
    ("cloth", 20e-6),
    ("sandpaper:grit=P120", 20e-6),
    ("sandpaper:grit=P120", 10e-6),
)
GAINS = (None, 1.2, 1.15, 1.1)


def main(arguments: Sequence[str]) -> None:
    what, *names = arguments or ["depths"]
    if what == "trade":
        table = trade_table()
    elif what == "goals":
        table = goals_table(names or GOAL_SURFACES)
    else:
        table = depths_table(names or SURFACES)
    Console(width=100, highlight=False).print(table)


def goals_table(names: Sequence[str]) -> Table:
    """Return the table of what fields of the default goals reach and cost."""
    heads = "spacing", "size", "q", "share", "at depth", "onset", "tick", "baking"
    table = Table("surface", *heads, box=None)
    for name in names:
        start = time.process_time()
        surface = _bake_ball() if name == "ball" else rendered_surface(Surface(_load(name), "H"))
        spent, field = time.process_time() - start, surface.texture
        assert isinstance(field, PotentialField)
        accuracy, path = field.accuracy, stroke(field, 4000.0, TICKS)
        lengths = [field.resolution, accuracy.worst_depth, accuracy.onset]
        spacing, depth, onset = (f"{1e6 * length:.1f} µm" for length in lengths)
        share, size = f"{accuracy.share:.1%}", f"{field.bytes / 1e6:.1f} MB"
        tick = f"{stroke_times(surface, [path])[0]:.0f} ns"
        q, cost = f"{field.gain.upper:.3f}", f"{spent:.0f} s"
        table.add_row(name, spacing, size, q, share, depth, onset, tick, cost)
    return table


def _load(name: str) -> Texture:
    path, _, factor = name.partition("*")
    return load_texture(path, magnify=float(factor)) if factor else as_texture(name)


def _bake_ball() -> Surface:
    from trimesh.creation import icosphere

    mesh = icosphere(6)
    bumps = 1.0 + 0.01 * np.cos(25.0 * mesh.vertices).prod(axis=1)
    body = MeshBody.from_arrays(0.01 * mesh.vertices * bumps[:, None], mesh.faces)
    return Surface(bake_body(body), "H")


def trade_table() -> Table:
    """Return the table of gain, difference and size."""
    table = Table("surface", "spacing", "passes", "q", "share", "onset", "size", box=None)
    for name, resolution in TRADE:
        for gain in GAINS:
            field = bake(Surface(name, "H"), resolution, max_gain=gain).texture
            assert isinstance(field, PotentialField)
            share, onset = f"{field.accuracy.share:.1%}", f"{1e6 * field.accuracy.onset:.1f} µm"
            spacing, q = f"{1e6 * resolution:.0f} µm", f"{field.gain.upper:.3f}"
            size = f"{field.bytes / 1e6:.1f} MB"
            table.add_row(name, spacing, str(field.passes), q, share, onset, size)
    return table


def depths_table(names: Sequence[str]) -> Table:
    """Return the table of the difference by depth."""
    table = Table(
        "surface",
        "pressed",
        "texture",
        "difference RMS",
        "greatest",
        "share",
        box=None,
        caption="forces over the stiffness, at random places of one height",
    )
    for name in names:
        exact = Surface(name, "H", 1.0)
        for row in compare_depths(exact, rendered_surface(exact)):
            table.add_row(name, *row)
    return table


def compare_depths(exact: Surface, baked: Surface) -> list[list[str]]:
    """Return depth, texture's force, difference and share of each depth as text."""
    rows, rng = [], np.random.default_rng(0)
    domain, (_, top) = exact.texture.domain, exact.texture.extremes
    xy = domain.points(rng.uniform(size=(PLACES, len(domain.spans))))
    for depth in np.array(DEPTHS) * exact.max_depth:
        points = np.column_stack([xy, np.full(PLACES, top - depth)])
        force, difference = exact.force(points), baked.force(points) - exact.force(points)
        texture = np.sqrt(np.square(force - force.mean(axis=0)).sum(axis=1).mean())
        error = np.linalg.norm(difference, axis=1)
        rms = np.sqrt(np.square(error).mean())
        lengths = [f"{1e6 * length:.2f} µm" for length in (texture, rms, error.max())]
        rows.append([f"{1e6 * depth:.0f} µm", *lengths, f"{rms / texture:.1%}"])
    return rows


if __name__ == "__main__":
    main(sys.argv[1:])

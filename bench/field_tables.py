"""Tables of the documentation about baked fields.

``python -m bench.field_tables depths [SURFACE ...]`` compares fields with exact law H at random
places of one height, from light contact to ``max_depth`` below the highest point. The share that a
field states is one number: the difference between floor and surface, over the texture's force at
the least height. ``python -m bench.field_tables trade`` prints gain, difference and size of fields
of several spacings and numbers of smoothing passes.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.rendering import bake, rendered_surface
from asperity.surface import Surface
from asperity.textures.fields.potential_field import PotentialField

SURFACES = ("cloth", "knurl", "wood")
DEPTHS = (0.1, 0.2, 0.3, 0.5, 0.8, 1.0)
PLACES = 3000
TRADE = (
    ("cloth", 40e-6),
    ("cloth", 20e-6),
    ("sandpaper:grit=P120", 20e-6),
    ("sandpaper:grit=P120", 10e-6),
)
PASSES = (0, 1, 2, 4)
GAINS = (None, 1.35, 1.3, 1.25, 1.2, 1.17, 1.15, 1.13, 1.11, 1.09, 0.5)


def main(arguments: Sequence[str]) -> None:
    what, *names = arguments or ["depths"]
    table = trade_table() if what == "trade" else depths_table(names or SURFACES)
    Console(width=100, highlight=False).print(table)


def trade_table() -> Table:
    """Return the table of gain, difference and size."""
    table = Table("surface", "spacing", "passes", "q", "share", "size", box=None)
    for name, resolution in TRADE:
        found = {}
        for gain in GAINS:  # whatever number of passes each of them takes
            field = bake(Surface(name, "H"), resolution, max_gain=gain).texture
            assert isinstance(field, PotentialField)
            found[field.passes] = field
        for field in (found[passes] for passes in PASSES if passes in found):
            share, size = f"{field.accuracy.share:.1%}", f"{field.bytes / 1e6:.1f} MB"
            spacing, q = f"{1e6 * resolution:.0f} µm", f"{field.gain.upper:.3f}"
            table.add_row(name, spacing, str(field.passes), q, share, size)
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

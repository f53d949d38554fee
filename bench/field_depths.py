"""How far is a baked field from exact law H where a hand touches it lightly?

``python -m bench.field_depths [SURFACE ...]`` compares both at random places of one height, from
light contact to ``max_depth`` below the highest point. The share that a field states is one number:
the difference between floor and surface, over the texture's force at the least height.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.rendering import rendered_surface
from asperity.surface import Surface

SURFACES = ("cloth", "knurl", "wood")
DEPTHS = (0.1, 0.2, 0.3, 0.5, 0.8, 1.0)
PLACES = 3000


def main(names: Sequence[str]) -> None:
    table = Table(
        "surface", "pressed", "texture", "difference RMS", "greatest", "share", box=None,
        caption="forces over the stiffness, at random places of one height",
    )  # fmt: skip
    for name in names or SURFACES:
        exact = Surface(name, "H", 1.0)
        for row in compare_depths(exact, rendered_surface(exact)):
            table.add_row(name, *row)
    Console(width=100, highlight=False).print(table)


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

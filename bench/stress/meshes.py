"""Every mesh of a folder, as a closed body: refused with a reason, or baked and tested.

``python -m bench.stress.meshes FOLDER`` reads each file with and, if it is refused, without its
faults (``repair``), in millimetres, and bakes law H to its default depth in 4 MB. In the compiled
tick it then measures

- the work along closed triangles, over k l² (l: the longest edge), exactly between the knots of the
  field: half of them around sharp edges and corners of the mesh;
- secants of the force over their certified bound, from points near the mesh, half of them across
  sharp edges and corners.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.core.checks import FloatArray
from asperity.core.errors import AsperityError
from asperity.surface import Surface
from asperity.textures.fields.bake import BakeGoal
from asperity.textures.fields.potential_field import PotentialField
from asperity.textures.meshes.bake_body import bake_body
from asperity.textures.meshes.mesh_body import MESH_FORMATS, MeshBody, load_mesh
from bench.stress.field_loops import may_leave_twice, triangle_work

LOOPS, SECANTS = 20_000, 50_000
GOAL = BakeGoal(max_bytes=2**22)
SHARP = np.cos(np.radians(30.0))
GOAL_WORK = 1e-12
REASONS = (
    "overlaps itself",
    "open edges",
    "inside out",
    "no triangles",
    "max_bytes",
    "greatest depth",
    "no point inside",
    "damaged",
)


def load(path: Path) -> tuple[MeshBody, str]:
    """Return a body as it is, or repaired, and what was done to its faults."""
    try:
        body = load_mesh(path, "mm")
    except AsperityError as error:
        if "repair" not in str(error):
            raise
        body = load_mesh(path, "mm", repair=True)
    faults = [f"{fault.count} {fault.kind}" for fault in body.repaired or body.faults]
    return body, ("repaired: " if body.repaired else "") + "; ".join(faults)


def places(body: MeshBody, count: int, rng: np.random.Generator) -> FloatArray:
    """Return points on the mesh (n, 3), the first half on edges that are sharp or on their ends."""
    corners = body.triangles
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    chosen = rng.choice(len(corners), count - count // 2, p=areas / areas.sum())
    spread = np.einsum("nk,nkd->nd", rng.dirichlet(np.ones(3), len(chosen)), corners[chosen])
    edges = sharp_edges(corners, normals / np.maximum(areas, 1e-300)[:, None])
    if len(edges) == 0:
        return np.asarray(spread)
    ends = edges[rng.integers(len(edges), size=count // 2)]
    along = np.clip(rng.uniform(-0.5, 1.5, (len(ends), 1)), 0.0, 1.0)
    return np.vstack([ends[:, 0] + along * (ends[:, 1] - ends[:, 0]), spread])


def sharp_edges(corners: FloatArray, normals: FloatArray) -> FloatArray:
    """Return the edges (m, 2, 3) at which the normals of two triangles differ by 30 degrees."""
    ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 3)
    swap = (ends[:, 0] > ends[:, 1]) & (np.cumsum(ends[:, 0] != ends[:, 1], axis=1) == 1)
    ends = np.where(swap.any(axis=1)[:, None, None], ends[:, ::-1], ends)
    order = np.lexsort(ends.reshape(-1, 6).T)
    same = (ends[order[1:]] == ends[order[:-1]]).all(axis=(1, 2))
    first, second = (normals[part[same] // 3] for part in (order[:-1], order[1:]))
    sharp = np.einsum("nk,nk->n", first, second) < SHARP
    return np.asarray(ends[order[:-1][same][sharp]])


def worst_loop(surface: Surface, field: PotentialField, points: FloatArray, seed: int) -> float:
    """Return the greatest work over k l² along triangles of at most two nodes around points.

    Those that may leave the body twice between two knots are omitted: their work is not summed
    exactly.
    """
    rng, step = np.random.default_rng(seed), min(field.grid.spacing)
    size = step * 10.0 ** rng.uniform(-1.0, 0.0, (len(points), 1, 1))
    loops = points[:, None] + size * rng.uniform(-1.0, 1.0, (len(points), 3, 3))
    brushes = may_leave_twice(surface.trace, loops, field.arguments, surface.stiffness)
    work, scale = triangle_work(surface.trace, loops[~brushes], field.arguments, surface.stiffness)
    return float((np.abs(work.sum(axis=1)) / scale).max())


def worst_secant(surface: Surface, field: PotentialField, points: FloatArray, seed: int) -> float:
    """Return the greatest rate of force over its certified bound, between points around places."""
    rng, step = np.random.default_rng(seed), min(field.grid.spacing)
    reach = step * 10.0 ** rng.uniform(-2.0, 1.0, (len(points), 1))
    a, b = (points + reach * rng.normal(size=points.shape) for _end in range(2))
    change = np.linalg.norm(surface.force(b) - surface.force(a), axis=1)
    rates = change / (surface.stiffness * np.linalg.norm(b - a, axis=1))
    return float(rates.max()) / field.gain.upper


def row(path: Path) -> tuple[list[str], bool]:
    """Return the cells of a mesh, and whether it was baked."""
    try:
        body, faults = load(path)
        began = time.process_time()
        field = bake_body(body, goal=GOAL)
    except AsperityError as error:
        return [path.name, "", "", "", "", "", "", f"refused: {error}"], False
    seconds, rng = time.process_time() - began, np.random.default_rng(0)
    surface = Surface(field, "H", 1000.0, field.max_depth)
    work = worst_loop(surface, field, places(body, LOOPS, rng), 1)
    secant = worst_secant(surface, field, places(body, SECANTS, rng), 2)
    numbers = [f"{len(body.triangles):,}", f"{np.prod(field.grid.node_counts) / 1e3:,.0f}"]
    numbers += [f"{seconds:.1f}", f"{field.gain.upper:.3f}", f"{work:.1e}", f"{secant:.3f}"]
    if not (work <= GOAL_WORK and secant <= 1.0):
        faults = f"MISSED {faults}"
    return [path.name, *numbers, faults], True


def main(arguments: Sequence[str]) -> None:
    if len(arguments) != 1:
        raise SystemExit("usage: python -m bench.stress.meshes FOLDER")
    warnings.simplefilter("ignore")
    headings = "mesh", "triangles", "1000 nodes", "s", "q", "work", "secant/q", "faults or reason"
    table = Table(*headings, box=None)
    found: Counter[str] = Counter()
    for path in sorted(Path(arguments[0]).iterdir()):
        if path.suffix.lower().lstrip(".") not in MESH_FORMATS:
            continue
        cells, usable = row(path)
        table.add_row(*cells)
        print(*cells, sep="\t", flush=True)
        last = cells[-1]
        reason = next((words for words in REASONS if words in last), "another reason")
        found["baked" if usable else f"refused: {reason}"] += 1
        found["baked after a repair"] += usable and last.startswith("repaired")
        found["MISSED"] += last.startswith("MISSED")
    Console(width=140, highlight=False).print(table)
    print(*(f"{words}: {count}" for words, count in found.items()), sep="\n")


if __name__ == "__main__":
    main(sys.argv[1:])

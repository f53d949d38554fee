"""What a search of our own laws as black boxes finds.

``python -m bench.stress.certification [SECONDS [SURFACE [LAWS]]]`` compares the gain and the leak
that a search of so many seconds (10 by default) finds with the certified ones, on five surfaces, or
on one (such as knurl) for some laws (such as BG);
``python -m bench.stress.certification jumps [CELLS [SECONDS]]`` prints in how many of the connected
sets of jumps of law D, as a grid of so many cells along each axis (100 by default) shows them, a
search of so many seconds (10 by default) finds one, on all cores.
"""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from scipy import ndimage

from asperity import certify, characteristic_number, export_code, named_surface, worst_loop
from asperity.certification.certify import Certification
from asperity.core.checks import FloatArray
from asperity.core.processes import available_cores
from asperity.surface import Surface
from asperity.textures.texture import Texture
from bench.speed import c_programs, cases
from bench.speed.timing import number_table

LAWS = "ABCEFGH"
LEAKING = "ABEFG"
_PROGRAM = """import pathlib, pickle
surface = pickle.loads((pathlib.Path(__file__).parent / "surface.pickle").read_bytes())
surface.force([[0.0, 0.0, 1.0]])
force = surface.force
"""


def search_laws(seconds: float, surface_name: str | None = None, laws: str = LAWS) -> None:
    """Print the shares of the certified gain and leak that are found."""
    textures = {name: cases.textures()[name] for name in ("sinusoid", "fourier", "heightmap")}
    textures |= {name: named_surface(name) for name in ("cloth", "knurl")}
    table = number_table("surface", "law", "gain / certified", "leak / worst loop", "calls", left=2)
    if surface_name is not None:
        textures = {surface_name: textures[surface_name]}
    for name, texture in track(textures.items(), "searching"):
        for law in laws:
            surface = Surface(texture, law, stiffness=cases.STIFFNESS)
            found = _search(surface, seconds)
            gain = cases.STIFFNESS * characteristic_number(surface).upper
            leak = "–"
            if law in LEAKING:
                leak = f"{found.leak / worst_loop(surface).energy:.3f}"
            table.add_row(name, law, f"{found.gain / gain:.3f}", leak, f"{found.calls:.2g}")
    Console().print(table)


def _search(surface: Surface, seconds: float) -> Certification:
    """Return what is found of a law in its working region.

    A law with memory is compiled from C; one whose forces are searches runs on all cores.
    """
    renderer: Any = surface.force
    with TemporaryDirectory() as folder:
        if surface.law.stateful:
            export_code(surface, f"{folder}/texture.h", shared=True)
            renderer = f"{folder}/texture.so"
            c_programs.run_command(
                "cc", "-O2", "-shared", "-fPIC", f"{folder}/texture.c", "-lm", "-o", renderer
            )
        elif surface.law.contact.has_warm_start:
            Path(f"{folder}/surface.pickle").write_bytes(pickle.dumps(surface))
            renderer = f"{folder}/renderer.py"
            Path(renderer).write_text(_PROGRAM)
        return certify(
            renderer,
            region=_box(surface.texture, surface.max_depth),
            inside=_working_region(surface),
            seconds=seconds,
        )


def _box(texture: Texture, depth: float) -> FloatArray:
    """Return the box around a period or the extent, and a depth below the surface."""
    spans = texture.domain.spans
    middle = texture.domain.origin + 0.5 * spans.sum(axis=0)
    half = np.full(2, 0.5 * float(np.hypot(*spans.T).max()))
    random = np.random.default_rng(0)
    heights = texture.height(random.uniform(middle - half, middle + half, (2000, 2)))
    low = [*(middle - half), float(heights.min()) - depth]
    high = [*(middle + half), float(heights.max())]
    return np.column_stack([low, high])


def _working_region(surface: Surface) -> Callable[[FloatArray], NDArray[np.bool_]]:
    """Return whether points are no deeper than max_depth, the depth being that of the contact."""
    texture = surface.texture
    contact = surface.law.contact
    if contact.has_warm_start:
        return _region_by_search(surface)

    def contains(points: FloatArray) -> NDArray[np.bool_]:
        depth = contact.depth(texture, points)
        return np.asarray((depth > 0.0) & (depth <= surface.max_depth))

    return contains


def _region_by_search(surface: Surface) -> Callable[[FloatArray], NDArray[np.bool_]]:
    """Return the same where the depth is the distance of the closest point.

    It is at most the depth below the surface, which is looked at first, as it takes no search.
    """
    texture = surface.texture
    cores = available_cores()
    pool = ThreadPoolExecutor(cores)

    def depths(points: FloatArray) -> FloatArray:
        return surface.law.contact.depth(texture, points)

    def contains(points: FloatArray) -> NDArray[np.bool_]:
        vertical = texture.height(points[:, :2]) - points[:, 2]
        is_inside = (vertical > 0.0) & (vertical <= surface.max_depth)
        deep = np.flatnonzero(vertical > surface.max_depth)
        depth = np.concatenate([*pool.map(depths, np.array_split(points[deep], cores))])
        is_inside[deep] = depth <= surface.max_depth
        return np.asarray(is_inside)

    return contains


def search_jumps(cells: int, seconds: float = 10.0) -> None:
    """Print in how many connected sets of jumps of D, as a grid shows them, one was found.

    A pair of neighbours of the grid shows a jump where the closest point still jumps after twelve
    halvings of the distance between them. Cells of such pairs that touch are one set.
    """
    table = number_table("surface", "sets", "found", "jumps", "calls")
    textures = cases.textures()
    for name in ("sinusoid", "fourier", "heightmap"):
        texture = textures[name]
        surface = Surface(texture, "D", stiffness=cases.STIFFNESS)
        box = _box(texture, surface.max_depth)
        inside = _working_region(surface)
        labels, count = jump_sets(surface, box, inside, cells)
        found = _search(surface, seconds)
        places = np.array([jump.at for jump in found.jumps]).reshape(-1, 3)
        numbers = (count, len(found_sets(labels, box, places)), len(places))
        table.add_row(name, *map(str, numbers), f"{found.calls:.2g}")
    Console().print(table)


def found_sets(labels: NDArray[Any], box: FloatArray, places: FloatArray) -> set[int]:
    """Return the numbers of the sets of jumps in or beside whose cells places are [m]."""
    cells = len(labels)
    fractions = (places - box[:, 0]) / np.ptp(box, axis=1)
    indices = np.floor(cells * fractions).astype(int)
    found: set[int] = set()
    for offset in np.ndindex(3, 3, 3):  # a jump may be in the cell beside
        near = np.clip(indices + np.array(offset) - 1, 0, cells - 1)
        found.update(labels[tuple(near.T)].tolist())
    return found - {0}


def jump_sets(
    surface: Surface, box: FloatArray, inside: Callable[[FloatArray], NDArray[np.bool_]], cells: int
) -> tuple[NDArray[Any], int]:
    """Return the number of the set of jumps of each cell of a box, 0 for none, and how many."""
    low, size = box[:, 0], np.ptp(box, axis=1)
    nodes = np.stack(np.meshgrid(*[np.arange(cells)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    points = low + (nodes + 0.5) / cells * size
    is_inside = inside(points)
    forces = np.full(points.shape, np.nan)
    forces[is_inside] = surface.force(points[is_inside])
    marks = np.zeros((cells, cells, cells), dtype=bool)
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = size[axis] / cells
        index = np.arange(len(points)).reshape(marks.shape)
        first = np.take(index, range(cells - 1), axis).ravel()
        second = np.take(index, range(1, cells), axis).ravel()
        change = np.sqrt(np.square(forces[second] - forces[first]).sum(axis=1))
        # The distance to the closest point changes by at most the step: more is a jump or steep.
        first = first[change > 2.0 * cases.STIFFNESS * step[axis]]
        start = points[first]
        end = start + step
        for _ in range(12):
            middle = 0.5 * (start + end)
            left, force, right = [surface.force(p) for p in (start, middle, end)]
            is_right = (np.square(right - force) - np.square(force - left)).sum(axis=1) > 0.0
            start = np.where(is_right[:, None], middle, start)
            end = np.where(is_right[:, None], end, middle)
        size_now = np.sqrt(np.square(surface.force(end) - surface.force(start)).sum(axis=1))
        marks.reshape(-1)[first[size_now > 2.0 * cases.STIFFNESS * step[axis]]] = True
    labels, count = ndimage.label(marks, np.ones((3, 3, 3)))
    return labels, int(count)


if __name__ == "__main__":
    arguments = sys.argv[1:]
    if arguments[:1] == ["jumps"]:
        search_jumps(*[int(number) for number in arguments[1:] or ["100"]])
    else:
        search_laws(float(arguments[0]) if arguments else 10.0, *arguments[1:])

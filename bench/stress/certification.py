"""What a search of our own laws as black boxes finds, and what it claims of harmless renderers.

``python -m bench.stress.certification [SECONDS]`` compares the gain and the leak that a search of
so many seconds (10 by default) finds with the certified ones, on five surfaces;
``python -m bench.stress.certification controls [COUNT]`` searches so many conservative renderers
(200 by default), exact, in single precision, with steps of position and of force, for a second
each, and prints how many had a fault.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from scipy.interpolate import RectBivariateSpline

from asperity import certify, characteristic_number, named_surface, worst_loop
from asperity.core.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.texture import Texture
from bench.speed import cases
from bench.speed.timing import number_table

LAWS = "ABCEGH"
LEAKING = "ABEG"
STEPS = ("exact", "single", "encoder", "force steps", "both")
_BOX = ((-1e-3, 1e-3), (-1e-3, 1e-3), (-1e-3, 1e-4))
_CELLS = 24


def search_laws(seconds: float) -> None:
    """Print the shares of the certified gain and leak that are found."""
    textures = {name: cases.textures()[name] for name in ("sinusoid", "fourier", "heightmap")}
    textures |= {name: named_surface(name) for name in ("cloth", "knurl")}
    table = number_table("surface", "law", "gain / certified", "leak / worst loop", "calls", left=2)
    for name, texture in track(textures.items(), "searching"):
        for law in LAWS:
            surface = Surface(texture, law, stiffness=cases.STIFFNESS)
            found = certify(
                surface.force,
                region=_box(texture, surface.max_depth),
                inside=_working_region(surface),
                seconds=seconds,
            )
            gain = cases.STIFFNESS * characteristic_number(surface).upper
            leak = "–"
            if law in LEAKING:
                leak = f"{found.leak / worst_loop(surface).energy:.3f}"
            table.add_row(name, law, f"{found.gain / gain:.3f}", leak, f"{found.calls:.2g}")
    Console().print(table)


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
    contact = surface.law.contact.name

    def contains(points: FloatArray) -> NDArray[np.bool_]:
        depth = -points[:, 2]
        if contact != "nominal":
            depth = depth + surface.texture.height(points[:, :2])
        return np.asarray((depth > 0.0) & (depth <= surface.max_depth))

    return contains


def conservative_force(seed: int) -> Callable[[FloatArray], FloatArray]:
    """Return the force of a spring, a kinked wall or a random potential, with steps of a kind."""
    random = np.random.default_rng(seed)
    stiffness = 10.0 ** random.uniform(2.0, 3.5)
    side = np.linspace(-2e-3, 2e-3, _CELLS)
    amplitude = (seed % 3) * 1e-5
    spline = RectBivariateSpline(side, side, amplitude * random.normal(size=(_CELLS, _CELLS)))

    def exact(points: FloatArray) -> FloatArray:
        x, y, z = points.T
        depth = stiffness * np.maximum(spline.ev(x, y) - z, 0.0)
        slopes = [spline.ev(x, y, dx=1), spline.ev(x, y, dy=1), -np.ones_like(x)]
        return np.asarray(-np.stack(slopes, axis=1) * depth[:, None])

    position_step = 10.0 ** random.uniform(-6.0, -4.26)
    force_step = 10.0 ** random.uniform(-4.0, -2.0)
    kind = STEPS[seed % len(STEPS)]

    def force(points: FloatArray) -> FloatArray:
        if kind == "single":
            return exact(points.astype(np.float32).astype(float)).astype(np.float32).astype(float)
        if kind in ("encoder", "both"):
            points = position_step * np.round(points / position_step)
        forces = exact(points)
        if kind in ("force steps", "both"):
            forces = force_step * np.round(forces / force_step)
        return forces

    return force


def search_controls(count: int) -> None:
    """Print how many conservative renderers were said to have a fault."""
    faults: Counter[str] = Counter()
    for seed in track(range(count), "searching"):
        found = certify(conservative_force(seed), region=_BOX, seconds=1.0)
        name = STEPS[seed % len(STEPS)]
        faults[f"{name}: jumps"] += bool(found.jumps)
        faults[f"{name}: loop"] += found.worst_loop is not None
        faults[f"{name}: history"] += found.history.has_memory
    table = number_table(f"of {count} renderers", "with this fault")
    for name, number in sorted(faults.items()):
        table.add_row(name, str(number))
    Console().print(table)


if __name__ == "__main__":
    if sys.argv[1:2] == ["controls"]:
        search_controls(int(sys.argv[2]) if len(sys.argv) > 2 else 200)
    else:
        search_laws(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0)

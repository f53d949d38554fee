"""A large map: ``python -m bench.speed.large [side]``, 8192 by default.

Each part runs in a process of its own, whose seconds and peak memory are printed: preparing a map
of which a few per cent are missing, and what a texture of the result needs at first use.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from rich.console import Console
from rich.table import Table

SIDE = 8192
LIMIT = 4.0
"""Memory [GB] that a map of 8192 x 8192 has to do with."""

_WRITE = """
import sys
import numpy as np
side, path = int(sys.argv[1]), sys.argv[2]
rng = np.random.default_rng(1)
heights = np.lib.format.open_memmap(path, "w+", "f8", (side, side))
x = np.arange(side)
for first in range(0, side, 256):
    rows = np.arange(first, min(first + 256, side))[:, None]
    block = 2e-6 * np.sin(x / 37.0) * np.cos(rows / 23.0) + 1e-9 * x + 2e-10 * rows
    heights[rows[:, 0]] = block + 1e-7 * rng.standard_normal(block.shape)
# Holes of every size: single points, small patches, and one large.
for _ in range(side * side // 4000):
    i, j, a, b = rng.integers(0, side, 2).tolist() + rng.integers(1, 15, 2).tolist()
    heights[i : i + a, j : j + b] = np.nan
heights[side // 8 : side // 4, side // 3 : side // 2] = np.nan
"""

_PREPARE = """
from asperity.measured.measured_file import prepare_file
from asperity.measured.prepared import save_prepared
start = perf_counter()
prepared = prepare_file(path, pitch=1e-6, magnify=20.0, **json.loads(sys.argv[2]))
notes = f"{100 * prepared.filled.mean():.2g} % filled"
if "save" in sys.argv:
    save_prepared(path + ".npz", prepared, path)
"""

_LOAD = """
from asperity.textures import load_texture
start = perf_counter()
texture = load_texture(path + ".npz")
notes = "loaded"
"""

_REPORT = """
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
print(json.dumps([perf_counter() - start, peak, notes]))
"""

_HEAD = "import json, resource, sys\nfrom time import perf_counter\npath = sys.argv[1]\n"

PARTS: dict[str, tuple[str, dict[str, float | bool]]] = {
    "fill, level, filter, magnify, save": (_PREPARE, {}),
    "and outliers, degree 4, L-filter, periodic": (
        _PREPARE,
        {"outliers": 8.0, "form": 4, "l_cutoff": 1e-3, "periodic": True},
    ),
    "and a tip of radius 20 µm": (_PREPARE, {"tip_radius": 20e-6}),
    "load the prepared surface": (_LOAD, {}),
    "and its spline coefficients": (_LOAD + "texture.arguments\n", {}),
    "and its certified extremes": (_LOAD + "notes = str(texture.extremes)\n", {}),
    "and its bounds of slope and curvature": (_LOAD + "notes = str(texture.bounds)\n", {}),
}


def run(console: Console, side: int = SIDE) -> None:
    """Print a table of seconds and peak memory."""
    table = Table(title=f"{side} x {side} points, {side * side * 8 / 1e9:.2f} GB of heights")
    for heading in ("part", "seconds", "peak memory [GB]", f"below {LIMIT:g} GB", "notes"):
        table.add_column(heading)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "map.npy"
        subprocess.run([sys.executable, "-c", _WRITE, str(side), path], check=True)
        for name, (script, options) in PARTS.items():
            table.add_row(name, *_measure(script, path, options))
            console.print(f"{name}: done", style="dim")
    console.print(table)


def _measure(script: str, path: Path, options: dict[str, float | bool]) -> tuple[str, ...]:
    save = ["save"] if script is _PREPARE and not options else []
    done = subprocess.run(
        [sys.executable, "-c", _HEAD + script + _REPORT, str(path), json.dumps(options), *save],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ,
    )
    if done.returncode != 0:
        reason = done.stderr.strip().splitlines()
        return "-", "-", "no", reason[-1] if reason else f"signal {-done.returncode}"
    seconds, peak, notes = json.loads(done.stdout)
    return f"{seconds:.1f}", f"{peak / 1e9:.2f}", "yes" if peak < LIMIT * 1e9 else "no", notes


def main() -> None:
    """Run with the side of the map as the only argument."""
    side = int(sys.argv[1]) if len(sys.argv) > 1 else SIDE
    run(Console(width=120, highlight=False), side)


if __name__ == "__main__":
    main()

"""A loop of 1 kHz on the component for Unity under mono, its forces against those of the kernel.

``python -m bench.stress.unity_loop [SECONDS]``: 60 s of strokes over a map with law F, whose force
depends on what came before; prints what was allocated, the latest tick, and how many forces differ
in a bit.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from bench.stress.callers import expected_unity_forces, map_surface, missing_tool, unity_forces

RATE = 1000


def strokes(count: int) -> Any:
    """Return positions of strokes over the map, out of contact at first and between them [m]."""
    time = np.arange(count) / RATE
    across = 2e-3 * np.sin(2.0 * np.pi * 0.9 * time)
    along = 1e-3 * np.sin(2.0 * np.pi * 0.31 * time)
    height = -1e-4 + 3e-4 * np.cos(2.0 * np.pi * 0.7 * time)
    height[0] = 1e-2
    return np.column_stack([across, along, height])


def run_loop(seconds: float, folder: Path) -> tuple[int, str]:
    """Return how many forces differ from those of the kernel, and what the loop says."""
    surface = map_surface("F")
    found, said = unity_forces(surface, strokes(int(seconds * RATE)), folder, str(RATE))
    expected = expected_unity_forces(surface, folder)
    return int((found.view(np.int64) != expected.view(np.int64)).any(axis=1).sum()), said.strip()


def main(seconds: float = 60.0) -> int:
    """Run and print; return 1 if a force differs."""
    missing = missing_tool("Unity")
    if missing is not None:
        print(f"not run: no {missing} here")
        return 0
    with tempfile.TemporaryDirectory() as directory:
        differing, said = run_loop(seconds, Path(directory))
    print(f"{seconds:g} s at {RATE} Hz: {differing} forces differ; {said}")
    return int(differing > 0)


if __name__ == "__main__":
    sys.exit(main(*map(float, sys.argv[1:2])))

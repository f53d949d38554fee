"""A long search for a break of the Lipschitz constant of law H.

``python -m bench.stress.lipschitz [PAIRS]`` looks for two probes between which the force changes by
more than k max(1, c) times their distance, in so many pairs on each texture, 1 000 000 by default.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

from asperity.core.checks import FloatArray
from asperity.surface import Surface
from asperity.textures import Profile, Sinusoid, load_texture
from asperity.textures.texture import Texture
from bench.speed import cases
from bench.speed.timing import number_table

DATA = Path(__file__).parents[3] / "shared" / "data" / "sample-land.x3p"
PAIRS_AT_ONCE = 20_000
TOLERANCE = 1e-10
RIDGES = 20  # one pair of so many straddles a jump of the nearest point


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
        gain = cases.STIFFNESS * max(1.0, surface.continuity)
        change = np.linalg.norm(surface.force(b) - surface.force(a), axis=1)
        result[0, index] = np.max(change - gain * apart * (1.0 + 1e-6)) / (cases.STIFFNESS * 1e-3)
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
    headings = ("texture", "c", "H: |Δf|/(kc|Δp|)", "H: excess", "D: excess", "C: excess")
    table = number_table(*headings)
    sound = True
    for name, texture in search_textures().items():
        for c in (1.0, 4.0):
            surfaces = [Surface(texture, law, cases.STIFFNESS, continuity=c) for law in "HDC"]
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


if __name__ == "__main__":
    number = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    sys.exit(not search(Console(width=110, highlight=False), number))

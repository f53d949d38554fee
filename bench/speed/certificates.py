"""Certified numbers: never wrong, and how fast.

``python -m bench certificates`` times certified q of maps. ``python -m bench.speed.certificates
--random 10000`` tries random surfaces, laws and points.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.analysis.bounds.bound import NORM, Bound
from asperity.analysis.gain.characteristic import certify
from asperity.analysis.gain.medial_axis import SearchOptions
from asperity.core.checks import FloatArray
from asperity.surface import Surface
from asperity.textures import HeightMap
from bench.speed.timing import seconds
from bench.stress.random_surfaces import Trial, run_trial

MAP_LAWS = "ABCG"
SIDES = (256, 512, 1024)
MAP_SECONDS = 20.0


# --- maps -----------------------------------------------------------------------------------------


def rough_map(side: int) -> HeightMap:
    """Return band-limited noise [m] on a square grid, with a period so that it is cheap."""
    rng = np.random.default_rng(side)
    spectrum = np.fft.rfft2(rng.standard_normal((side, side), dtype=np.float32))
    wave = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side)[None, :])
    spectrum *= np.exp(-0.5 * (2.0 * math.pi * 6.0 * wave) ** 2)
    heights: FloatArray = np.fft.irfft2(spectrum, s=(side, side))
    return HeightMap(0.1e-3 / heights.std() * heights, 50e-6, periodic=True)


def _certify(surface: Surface) -> Bound:
    """Certify without the certificates that are kept on disk."""
    return certify(surface, NORM, SearchOptions())


def run(console: Console) -> None:
    """Print seconds to the certified q of maps."""
    table = Table(title="seconds to q of maps to 1e-3")
    for heading in ("nodes", *MAP_LAWS, "together", "ns per node"):
        table.add_column(heading)
    total = 0.0
    for side in SIDES:
        texture = rough_map(side)
        surfaces = [Surface(texture, letter, max_depth=0.2e-3) for letter in MAP_LAWS]
        for surface in surfaces:
            surface.jacobian(np.zeros((1, 3)))  # compiled
        times = [seconds(lambda s=surface: _certify(s)) for surface in surfaces]  # type: ignore[misc]  # mypy cannot see the default of a lambda
        total = sum(times)
        table.add_row(
            f"{side} x {side}",
            *[f"{t:.2f}" for t in times],
            f"{total:.2f}",
            f"{total / side**2 * 1e9:.0f}",
        )
    console.print(table)
    verdict = "reached" if total <= MAP_SECONDS else "missed"
    console.print(f"{SIDES[-1]} x {SIDES[-1]}: {total:.1f} s; goal {MAP_SECONDS:g} s: {verdict}")


# --- random surfaces ------------------------------------------------------------------------------


def random_trials(console: Console, count: int, first: int = 0) -> int:
    """Try random surfaces, laws and points; return how many went wrong."""
    counts: Counter[str] = Counter()
    worst = Trial(0, "", "", "", Bound(0.0, 0.0, "theorem"), 0, -1.0, 0.0)
    for seed in range(first, first + count):
        found = run_trial(seed)
        counts["trials"] += 1
        counts["points"] += found.points
        counts[found.bound.method] += 1
        counts["at the work limit"] += "work limit" in found.bound.note
        counts["wrong"] += not found.is_correct
        counts["idle"] += not found.is_tight
        if np.isfinite(found.excess):
            worst = max(worst, found, key=lambda t: t.excess)
        if not (found.is_correct and found.is_tight):
            console.print(found, style="bold")
    console.print(dict(counts))
    console.print(f"nearest to upper: {worst.excess:.1e} above it (rounding), seed {worst.seed}")
    return counts["wrong"] + counts["idle"]


def main(arguments: Sequence[str]) -> int:
    """Run with ``--random N [first seed]``, or nothing."""
    console = Console(width=110, highlight=False)
    if arguments[:1] == ["--random"]:
        return min(random_trials(console, *map(int, arguments[1:])), 1)
    run(console)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""Certified numbers of random surfaces, laws and points: is one wrong, or wider than promised?

``python -m bench.speed.certificates --random COUNT [SEED]``: so many trials from that seed on.
"""

from __future__ import annotations

import sys
from collections import Counter

import numpy as np
from rich.console import Console

from asperity.analysis.bounds.bound import Bound
from bench.stress.random_surfaces import Trial, run_trial


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


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:] if word != "--random"]
    sys.exit(min(random_trials(Console(width=110, highlight=False), *numbers), 1))

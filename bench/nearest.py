"""Cost of a globally nearest surface point, the contact of the god-object laws."""

from __future__ import annotations

import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.checks import FloatArray
from asperity.textures.texture import Texture
from bench import cases
from bench.timing import seconds, take_turns

ROUNDS = 7
BATCH_SECONDS = 0.1
LEAST, MOST = 100, 20_000
DEPTHS = {"shallow": 0.01, "deep": 1.0}  # vertical depth in peak-to-valley heights


def run(console: Console) -> None:
    """Print µs per query for each kind of texture, shallow and deep."""
    table = Table(box=None, pad_edge=False)
    table.add_column("texture")
    for name, share in DEPTHS.items():
        table.add_column(f"{name} ({share:.0%} of\npeak-to-valley) µs", justify="right")
        table.add_column("slowest\nquery µs", justify="right")
    for kind, texture in cases.textures().items():
        cells = []
        for share in DEPTHS.values():
            points = cases.probes(texture, MOST, share * texture.peak_to_valley)
            cells += [f"{value:.2f}" for value in (_typical(texture, points))]
        table.add_row(kind, *cells)
    console.print("nearest point, median of batches over random probe points; slowest of 300 alone")
    console.print(table)


def _typical(texture: Texture, points: FloatArray) -> tuple[float, float]:
    """Return µs per query in a batch, and of the slowest single query (median of its repeats)."""
    feet = np.empty((len(points), 2))
    loop, arguments = texture._loops.nearest_batch, texture.arguments
    loop(points[:1], feet[:1], arguments)  # compiled, or loaded
    each = seconds(lambda: loop(points[:LEAST], feet[:LEAST], arguments)) / LEAST
    count = int(np.clip(BATCH_SECONDS / each, LEAST, MOST))
    times = take_turns([lambda: loop(points[:count], feet[:count], arguments)], ROUNDS)
    return float(np.median(times)) / count * 1e6, _slowest(texture, points)


def _slowest(texture: Texture, points: FloatArray) -> float:
    """Return the time of the slowest of 300 queries [µs], its call overhead taken off."""
    loop, arguments = texture._loops.nearest_batch, texture.arguments
    feet = np.empty((1, 2))
    singles = [points[i : i + 1] for i in range(300)]
    calls = [lambda point=point: loop(point, feet, arguments) for point in singles]
    empty = points[:0]
    overhead = np.median(take_turns([lambda: loop(empty, feet, arguments)], 101))
    each = np.median(take_turns(calls, 3), axis=0)
    return float(each.max() - overhead) * 1e6

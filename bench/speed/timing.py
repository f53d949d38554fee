"""Clocks for a noisy machine: the contestants take turns, and medians are reported."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import perf_counter

import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.core.checks import FloatArray

Batch = Callable[[], object]


def seconds(batch: Batch) -> float:
    """Return the wall time of one call [s]."""
    start = perf_counter()
    batch()
    return perf_counter() - start


def take_turns(batches: Sequence[Batch], rounds: int) -> FloatArray:
    """Return the times [s] of batches run in turns, shape (rounds, number of batches).

    The order rotates from round to round, so that no batch always finds the caches as the same
    other one left them. One round before the first is not counted.
    """
    count = len(batches)
    times = np.empty((rounds + 1, count))
    for turn in range(rounds + 1):
        for step in range(count):
            index = (turn + step) % count
            times[turn, index] = seconds(batches[index])
    return times[1:]


def affordable_count(batch: Batch, count: int, span: float, most: int) -> int:
    """Return how many points take a time [s]: from the count of a batch up to so many."""
    batch()  # compiled, or loaded
    return int(np.clip(span * count / min(seconds(batch), seconds(batch)), count, most))


def median_ratio(times: FloatArray, index: int, reference: int) -> float:
    """Return the median over the rounds of the ratio of two batches of the same round."""
    return float(np.median(times[:, index] / times[:, reference]))


def print_verdict(console: Console, goal: str, missed: Sequence[str]) -> None:
    """Print whether a goal is met, and where it is not."""
    answer = f"MISSED: {'; '.join(missed)}" if missed else "met"
    console.print(f"goal: {goal} -> {answer}", style="bold")


def number_table(*headings: str, left: int = 1) -> Table:
    """Return an empty table of numbers, aligned right but for so many columns of names."""
    table = Table(box=None, pad_edge=False)
    for place, heading in enumerate(headings):
        table.add_column(heading, justify="left" if place < left else "right")
    return table

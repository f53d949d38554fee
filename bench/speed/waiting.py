"""What people wait for: processor and wall time of whole commands, first, again, and changed.

Every command is a process of its own; each surface, the onset and the paper begin with an empty
cache folder. Processor seconds are those of the process and of all that it starts. Repeated
commands take turns; a ratio is to the first comparison of the same surface, the median over the
rounds.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[2]
PROGRAM = (sys.executable, "-m", "asperity")
LIMIT = 900.0  # [s] per command
ROUNDS = 3

HELP = ("--help",)
DEMO = ("compare", "examples/demo.toml")
SINUSOID = ("compare", "sinusoid:amplitude=0.8mm,period=1mm")
MEASURED = ("compare", "../shared/data/sample-land.x3p", "--magnify", "20")
CHANGED = ("--device", "touch", "--stiffness", "700N/m")
ONSET = ("onset", "examples/press.toml")
CLOSER = (*ONSET, "--tolerance", "0.051")  # another question: no answer is kept
REPRODUCE = ("reproduce",)


@dataclass(frozen=True)
class Times:
    """What a command took.

    Attributes:
        processor: of it and of all that it started [s].
        wall: [s].
    """

    processor: float
    wall: float


class _NotRunError(Exception):
    """A command that cannot be measured; says why."""


def run(console: Console) -> None:
    """Print the table; what cannot be run is said below it."""
    table = Table("work", "processor [s]", "wall [s]", "of the first", "goal")
    with tempfile.TemporaryDirectory() as folder:
        caches = [Path(folder, name) for name in ("demo", "sinusoid", "measured", "onset", "paper")]
        for cache in caches:
            cache.mkdir(mode=0o700)
        demo, sinusoid, measured, onset, paper = caches
        missing = [
            *_time_single(table, HELP, "--help", "", demo),
            *_time_comparisons(table, DEMO, "the demo", demo),
            *_time_comparisons(table, SINUSOID, "a sinusoid", sinusoid),
            *_time_comparisons(table, MEASURED, "a measured surface", measured),
            *_time_single(table, ONSET, "onset examples/press.toml, first", "", onset),
            *_time_single(table, CLOSER, "  all compiled, another width", "processor 12", onset),
            *_time_single(table, CLOSER, "  the same again", "", onset),
            *_time_single(table, REPRODUCE, "reproduce, first", "wall 120", paper),
            *_time_single(table, REPRODUCE, "reproduce again", "processor 45", paper),
        ]
    console.print(table)
    for line in missing:
        console.print(line, soft_wrap=True)


def _time_comparisons(table: Table, words: tuple[str, ...], name: str, cache: Path) -> list[str]:
    """Add the rows of one surface: first, again, changed, with a report."""
    html = ("--html", str(cache.parent / "report.html"))
    try:
        first = _time_command(words, cache)
        _time_command((*words, *html), cache)
        found = np.array(
            [
                [_time_command((*words, *more), cache).processor for more in ((), CHANGED, html)]
                for _ in range(ROUNDS)
            ]
        )
    except _NotRunError as reason:
        return [f"{name}: not run: {reason}"]
    again, changed, report = np.median(found, axis=0)
    table.add_row(
        f"first compare of {name}", f"{first.processor:.1f}", f"{first.wall:.1f}", "1", "wall 15"
    )
    for said, value, goal in (
        ("the same again", again, "processor 1.5"),
        ("another device and stiffness", changed, "processor 2"),
        ("with --html, again", report, ""),
    ):
        table.add_row(f"  {said}", f"{value:.2f}", "", f"{value / first.processor:.3f}", goal)
    return []


def _time_single(
    table: Table, words: tuple[str, ...], name: str, goal: str, cache: Path
) -> Sequence[str]:
    try:
        taken = _time_command(words, cache)
    except _NotRunError as reason:
        return [f"{name}: not run: {reason}"]
    table.add_row(name, f"{taken.processor:.2f}", f"{taken.wall:.2f}", "", goal)
    return []


def _time_command(words: tuple[str, ...], cache: Path) -> Times:
    """Return what a command took.

    Raises:
        _NotRunError: if a file is missing, it fails, or takes too long.
    """
    if words[1:] and words[1].startswith("..") and not (ROOT / words[1]).exists():
        raise _NotRunError("the file is missing")
    before, start = os.times(), perf_counter()
    try:
        done = subprocess.run(
            [*PROGRAM, *words],
            cwd=ROOT,
            check=False,
            capture_output=True,
            text=True,
            timeout=LIMIT,
            env=os.environ | {"ASPERITY_CACHE_DIR": str(cache)},
        )
    except subprocess.TimeoutExpired:
        raise _NotRunError(f"took longer than {LIMIT:.0f} s") from None
    wall, after = perf_counter() - start, os.times()
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise _NotRunError(f"exit code {done.returncode}: {last}")
    used = after.children_user + after.children_system
    return Times(used - before.children_user - before.children_system, wall)

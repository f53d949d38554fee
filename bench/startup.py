"""Start-up of the command line: help, and a second comparison (the first fills the cache)."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
from rich.console import Console

from bench.timing import seconds

ROOT = Path(__file__).parent.parent
SCRIPT = Path(sys.executable).with_name("asperity")
LIMIT = 100.0  # [s] per run

SINUSOID = ("compare", "sinusoid:amplitude=0.8mm,period=1mm")
MEASURED = ("compare", "../shared/data/sample-land.x3p", "--magnify", "20")


class _NotRunError(Exception):
    """A command that cannot be measured; says why."""


def run(console: Console) -> None:
    """Print the times, or why there are none."""
    _report(console, ("--help",), repeats=5)
    _report(console, SINUSOID, repeats=1)
    if (ROOT / MEASURED[1]).exists():
        _report(console, MEASURED, repeats=1)
    else:
        console.print(f"asperity {' '.join(MEASURED)}: not run: the file is missing")


def _report(console: Console, arguments: tuple[str, ...], repeats: int) -> None:
    """Print the first run and the median of the runs after it."""
    name = f"asperity {' '.join(arguments)}"
    try:
        first = _run(arguments)
        later = float(np.median([_run(arguments) for _ in range(repeats)]))
    except _NotRunError as reason:
        console.print(f"{name}: not run: {reason}", soft_wrap=True)
        return
    count = "second" if repeats == 1 else f"median of {repeats} more"
    console.print(f"{name}: first {first:.2f} s, {count} {later:.2f} s", soft_wrap=True)


def _run(arguments: tuple[str, ...]) -> float:
    """Return the wall time of one run [s].

    Raises:
        _NotRunError: if there is no console script, it fails, or it takes too long.
    """
    if not SCRIPT.exists():
        raise _NotRunError(f"no {SCRIPT.name} beside {Path(sys.executable).name}")
    outcome: list[subprocess.CompletedProcess[str]] = []

    def command() -> None:
        outcome.append(
            subprocess.run(
                [str(SCRIPT), *arguments],
                cwd=ROOT,
                check=False,
                capture_output=True,
                text=True,
                timeout=LIMIT,
            )
        )

    try:
        taken = seconds(command)
    except subprocess.TimeoutExpired:
        raise _NotRunError(f"took longer than {LIMIT:.0f} s") from None
    if outcome[0].returncode != 0:
        last = (outcome[0].stderr.strip().splitlines() or ["no message"])[-1]
        raise _NotRunError(f"exit code {outcome[0].returncode}: {last}")
    return taken

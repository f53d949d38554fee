"""Loading from the cache: two fresh processes, of which only the first may compile."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from rich.console import Console

# Run in a process of its own. `misses` counts kernels that Numba did not find in its cache.
_SCRIPT = """
import json
from time import perf_counter
start = perf_counter()
import asperity as asp
texture = asp.Sinusoid(amplitude=0.4e-3, period=1.5e-3)
times, misses = [], 0
for law in "BCD":
    before = perf_counter()
    surface = asp.Surface(texture, law=law)
    surface.force([[0.1e-3, 0.0, -1e-3]])
    times.append(perf_counter() - before)
    misses += sum(surface._loops.force_batch.stats.cache_misses.values())
print(json.dumps({"laws": times, "total": perf_counter() - start, "misses": misses}))
"""


def run(console: Console) -> None:
    """Print both times, and whether the second process left the cache as it was."""
    with tempfile.TemporaryDirectory() as directory:
        cache = Path(directory)
        first = _run_process(cache)
        filled = _files(cache)
        second = _run_process(cache)
        touched = _changes(filled, _files(cache))
    console.print("imports + Surface(sinusoid, law).force of laws B, C, D in a fresh process")
    for name, answer in (("empty cache", first), ("filled cache", second)):
        laws = ", ".join(f"{value:.3f}" for value in answer["laws"])
        console.print(
            f"  {name:12}: {answer['total']:5.2f} s in all; laws {laws} s;"
            f" kernels compiled {answer['misses']}"
        )
    console.print(f"  the first process wrote {len(filled)} files")
    if not filled or touched or second["misses"]:
        console.print(f"  COMPILED AGAIN: {', '.join(touched) or 'no cache'}", style="bold")
    else:
        console.print("  no compile in the second: every file is the same")


def _run_process(cache: Path) -> dict[str, Any]:
    environment = os.environ | {"ASPERITY_CACHE_DIR": str(cache)}
    command = [sys.executable, "-c", _SCRIPT]
    answer = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
    result: dict[str, Any] = json.loads(answer.stdout)
    return result


def _files(directory: Path) -> dict[str, int]:
    """Return the inode of every file by its path: a file that is written again has another."""
    return {
        str(path.relative_to(directory)): path.stat().st_ino
        for path in directory.rglob("*")
        if path.is_file()
    }


def _changes(before: dict[str, int], after: dict[str, int]) -> list[str]:
    """Return the files that appeared, vanished or were written anew."""
    names = sorted(before.keys() | after.keys())
    return [name for name in names if before.get(name) != after.get(name)]

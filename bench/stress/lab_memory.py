"""The lab's memory while pages come, steer, look, change laws and go, for as long as is asked for.

``python -m bench.stress.lab_memory 60`` for an hour.
"""

from __future__ import annotations

import itertools
import math
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rich.console import Console
from tests.lab.client import STILL, frames, joined, say, taken
from tests.lab.started import Started

MINUTES = 20.0
WARM = 2.0
"""[min] in which all laws and kinds of the way have come once: they stay compiled."""
STAYS = 30.0
"""[s] of a page, until the next one comes."""
_LAWS = "WACBD"
_PAGE = 4096  # bytes of a page of memory


def run(console: Console, minutes: float = MINUTES) -> None:
    """Print the memory of server, loop and helpers at the beginning, on the way and at the end."""
    lab = Started()
    seen: list[tuple[float, dict[int, float]]] = []
    try:
        begun = time.monotonic()
        laws = itertools.cycle(_LAWS)
        while (now := (time.monotonic() - begun) / 60.0) < minutes:
            _use_page(lab, laws)
            if now > min(WARM, 0.5 * minutes):
                seen.append((now, _memory(lab.process.pid)))
                console.print(f"lab: {now:.1f} min: {_format_sizes(seen[-1][1])}")
    finally:
        lab.close()
    server = lab.process.pid
    times = np.array([when for when, _sizes in seen])
    sizes = np.array([sizes[server] for _when, sizes in seen])
    growth = 60.0 * np.polyfit(times, sizes, 1)[0]
    console.print(
        f"lab: the server grew by {growth:+.1f} MB per hour, of {sizes[0]:.0f} MB,"
        f" in {times[-1] - times[0]:.0f} min with {len(seen)} pages"
    )


def _use_page(lab: Started, laws: Iterator[str]) -> None:
    """Be a page for a while."""
    with joined(lab) as page:
        end, looked = time.monotonic() + STAYS, 0.0
        say(page, "change", changes={"law": next(laws), "stiffness": 300.0})
        while (now := time.monotonic()) < end:
            if frames(taken(page)):
                turn = 2.0 * math.pi * now
                place = [2e-3 * math.sin(turn), 1e-3 * math.cos(0.3 * turn), -3e-4]
                say(page, "steer", target=place, **STILL)
            if now > looked + 0.5:
                looked = now
                say(page, "relief", x=0.0, y=0.0, size=8e-3)
                say(page, "section", box=[-4e-3, 4e-3, -2e-3, 2e-3], y=1e-3 * math.cos(now))


def _memory(server: int) -> dict[int, float]:
    """Return the resident memory of a process and its children [MB]."""
    threads = Path(f"/proc/{server}/task").iterdir()
    children = [one for thread in threads for one in (thread / "children").read_text().split()]
    return {
        number: _PAGE * int(Path(f"/proc/{number}/statm").read_text().split()[1]) / 1e6
        for number in (server, *map(int, children))
    }


def _format_sizes(sizes: dict[int, float]) -> str:
    server, *others = sizes.values()
    return f"server {server:.1f} MB, its processes {', '.join(f'{one:.0f}' for one in others)} MB"


if __name__ == "__main__":
    run(Console(), float(sys.argv[1]) if sys.argv[1:] else MINUTES)

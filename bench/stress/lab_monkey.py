"""Random actions on the lab's page in a real browser: pointer, keys, wheel, fingers, controls.

``python -m bench.stress.lab_monkey 1000 7`` for 1000 actions of seed 7. Needs chromium.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console
from tests.lab.browser import BROWSER, Browser
from tests.lab.page.monkey import Monkey
from tests.lab.started import Started

ACTIONS, SEED = 1000, 7


def run(console: Console, actions: int = ACTIONS, seed: int = SEED) -> None:
    """Print what went wrong, in page and server, and the greatest force."""
    if BROWSER is None:
        console.print("lab: not run: no browser (chromium) here")
        return
    lab, begun = Started(), time.monotonic()
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as home,
        Browser(lab.address, Path(home)) as page,
    ):
        page.until("globalThis.lab?.frame && lab.hasPictures")
        monkey = Monkey(page, seed)
        for _ in range(actions):
            monkey.act()
        errors, beyond, most, frames = monkey.end()
        bound, starts = page.ask("[lab.status.max_force, lab.status.start_count]")
        for words in page.said:
            console.print(f"lab: the page: {words}")
    code, said = lab.end()
    done = ", ".join(f"{count} {name}" for name, count in sorted(monkey.done.items()))
    console.print(f"lab: {actions} random actions, seed {seed}: {done}")
    console.print(
        f"lab: {errors} errors in the page, exit code {code} of the server, which said"
        f" {said.strip() or 'nothing'!r}; force at most {most:.3g} N, {beyond} frames beyond the"
        f" device's ({bound:.3g} N now); {starts} loops, {frames:.0f} frames,"
        f" {time.monotonic() - begun:.0f} s"
    )


if __name__ == "__main__":
    run(Console(), *map(int, sys.argv[1:]))

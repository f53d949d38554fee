"""The lab: from pointer to picture, what the page costs the loop, and how long until it is there.

``python -m bench.lab 5`` for 5 s per part instead of 20. Needs chromium.
"""

from __future__ import annotations

import math
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from tests.lab.browser import BROWSER, Browser
from tests.lab.client import frames, head, heard, joined
from tests.lab.started import Started

from asperity.checks import FloatArray
from asperity.lab.site import page_files

SECONDS = 20.0
MAP = ("noise:rms=20um,size=10.24mm,pitch=10um", "--law", "H", "--set", "update_rate=10kHz")
"""Law H on a map of 1024 x 1024 heights at 10 kHz."""
_LIVE = "globalThis.lab?.frame && lab.news?.state == 'running'"


def run(console: Console, seconds: float = SECONDS) -> None:
    """Print latencies, late samples with and without a page, and times to the first picture."""
    size = sum(len(content) for _kind, content in page_files().values())
    console.print(f"lab: page of {size / 1e3:.0f} kB")
    if BROWSER is None:
        console.print("lab: not run: no browser (chromium) here")
        return
    first_picture()  # compiles what there is to compile
    console.print(f"lab: first picture {first_picture():.1f} s after the command, warm")
    with tempfile.TemporaryDirectory() as home:
        lab = Started(*MAP)
        try:
            _wait(lab)
            alone = _late(lab, seconds)
            with Browser(lab.address, Path(home)) as page:
                page.until(f"{_LIVE} && lab.ready")
                watched = _late(lab, seconds, page)
                waits = np.array(page.ask("lab.latencies"))
        finally:
            lab.close()
    middle, most = np.quantile(waits, [0.5, 0.99])
    console.print(f"lab: pointer to picture {middle:.0f} ms, 99 % {most:.0f} ms, of {len(waits)}")
    for words, (late, rows) in (("without a page", alone), ("with a page", watched)):
        console.print(f"lab: {words} {late:.0f} of {rows:.0f} samples late")


def first_picture() -> float:
    """Return the time from the command to a frame that is drawn [s]."""
    begun = time.perf_counter()
    lab = Started()
    try:
        with tempfile.TemporaryDirectory() as home, Browser(lab.address, Path(home)) as page:
            page.until(_LIVE)
            return time.perf_counter() - begun
    finally:
        lab.close()


def _wait(lab: Started) -> None:
    """Wait until the loop runs and what is computed beside it is ready."""
    with joined(lab) as line:
        heard(line, lambda said: isinstance(said, dict) and bool(said.get("limit")))


def _counts(lab: Started) -> FloatArray:
    """Return late samples and all, so far."""
    with joined(lab) as line:
        frame = heard(line, frames)
        return np.array([head(frame, "late"), head(frame, "first")])


def _late(lab: Started, seconds: float, page: Browser | None = None) -> FloatArray:
    """Return late samples and all of some seconds, in which the pointer of a page moves."""
    before, end = _counts(lab), time.monotonic() + seconds
    while time.monotonic() < end:
        if page is not None:
            turn = 2.0 * math.pi * time.monotonic()
            page.mouse("mouseMoved", 300 + 60 * math.cos(turn), 250 + 40 * math.sin(turn), 1)
        time.sleep(0.016)
    return np.subtract(_counts(lab), before)


if __name__ == "__main__":
    run(Console(), float(sys.argv[1]) if sys.argv[1:] else SECONDS)

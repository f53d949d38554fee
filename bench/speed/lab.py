"""The lab: from pointer to picture, what the page costs the loop, and how long until it is there.

``python -m bench.speed.lab 5`` for 5 s with a page instead of 40. Needs chromium.

Late samples are counted in turns: alone, with a page, and with a process that takes as much of the
processor as the browser did, and no more. Each difference has the chance that it would be as large
or larger if it meant nothing: that of the sums with their signs thrown at random.
"""

from __future__ import annotations

import itertools
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from tests.lab.browser import BROWSER, Browser
from tests.lab.client import frames, head, heard, joined
from tests.lab.started import Started

from asperity.core.checks import FloatArray
from asperity.lab.access import page_files

SECONDS = 40.0
"""With a page, and as much without."""
PAIRS = 8
BLANK = "about:blank"
MAP = ("noise:rms=20um,size=10.24mm,pitch=10um", "--law", "H", "--set", "update_rate=10kHz")
"""Law H on a map of 1024 x 1024 heights at 10 kHz."""
# Spins for a share of each picture of the screen.
_SPINS = """
import sys, time
while True:
    begun = time.perf_counter()
    while time.perf_counter() < begun + float(sys.argv[1]) / 60: pass
    time.sleep(max(0.0, begun + 1 / 60 - time.perf_counter()))
"""
_LIVE = "globalThis.lab?.frame && lab.status?.state == 'running'"


def run(console: Console, seconds: float = SECONDS) -> None:
    """Print times to the first picture, latencies, and late samples with and without a page."""
    size = sum(len(content) for name, (_kind, content) in page_files().items() if name)
    console.print(f"lab: page of {size / 1e3:.0f} kB")
    if BROWSER is None:
        console.print("lab: not run: no browser (chromium) here")
        return
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as home,
        Browser(BLANK, Path(home)) as page,
    ):
        first_picture(page)  # compiles what there is to compile
        warm = sorted(first_picture(page) for _ in range(3))
        console.print(
            f"lab: {warm[1]:.1f} s from the command to the first picture in an open browser, warm"
        )
        lab = Started(*MAP)
        try:
            _wait(lab)
            waits, shares = _pairs(lab, page, seconds)
        finally:
            page.call("Page.navigate", url=BLANK)
            lab.close()
    middle, most = np.quantile(waits, [0.5, 0.99])
    console.print(f"lab: pointer to picture {middle:.0f} ms, 99 % {most:.0f} ms, of {len(waits)}")
    alone, watched, spun = 1e6 * np.median(shares, axis=0)
    console.print(
        f"lab: of a million samples {alone:.0f} are late alone, {watched:.0f} with a page,"
        f" {spun:.0f} with a process that takes as much of the processor; medians of {len(shares)}"
    )
    for words, one, other in (("a page less alone", 1, 0), ("a page less that process", 1, 2)):
        differences = 1e6 * (shares[:, one] - shares[:, other])
        console.print(
            f"lab: {words}: {differences.mean():+.0f} of a million on average, by chance"
            f" {100 * chance_lag(differences):.0f} % of the time"
        )


def first_picture(page: Browser) -> float:
    """Return the time from the command to the loop's probe over the surface in the page [s]."""
    begun = time.perf_counter()
    lab = Started()
    try:
        page.call("Page.navigate", url=lab.address)
        page.until(f"{_LIVE} && lab.hasPictures")
        return time.perf_counter() - begun
    finally:
        page.call("Page.navigate", url=BLANK)
        lab.close()


def chance_lag(differences: FloatArray) -> float:
    """Return how often a sum is as large or larger if each difference could have either sign."""
    signs = np.array(list(itertools.product((1.0, -1.0), repeat=len(differences))))
    sums = signs @ differences
    return float(np.mean(sums >= differences.sum() * (1.0 - 1e-12)))


def _pairs(lab: Started, page: Browser, seconds: float) -> tuple[FloatArray, FloatArray]:
    """Return latencies [ms], and shares of late samples in turns (PAIRS, 3).

    Without a page, with it, and with a process that takes as much of the processor.
    """
    waits: list[float] = []
    shares = []
    for number in range(PAIRS):
        span = seconds / PAIRS
        page.call("Page.navigate", url=lab.address)
        page.until(f"{_LIVE} && lab.hasPictures")
        before, begun = _cpu_time(page.process), time.monotonic()
        watched = _late_share(lab, span, page)
        taken = (_cpu_time(page.process) - before) / (time.monotonic() - begun)
        waits += page.ask("lab.latencies")
        page.call("Page.navigate", url=BLANK)
        # Neither of the others always comes first.
        alone = _late_share(lab, span) if number % 2 else math.nan
        spun = _late_share_beside_load(lab, span, taken)
        shares.append((alone if number % 2 else _late_share(lab, span), watched, spun))
    return np.array(waits), np.array(shares)


def _cpu_time(process: int) -> float:
    """Return the time of the processor that a process and all below it have taken [s]."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    ticks = int(fields[11]) + int(fields[12])
    children = [(one / "children").read_text() for one in Path(f"/proc/{process}/task").iterdir()]
    below = sum(_cpu_time(int(child)) for text in children for child in text.split())
    return ticks / os.sysconf("SC_CLK_TCK") + below


def _late_share_beside_load(lab: Started, seconds: float, share: float) -> float:
    """Return the share of late samples beside processes that take a share of the processor."""
    each = share / 2.0
    spinning = [subprocess.Popen([sys.executable, "-c", _SPINS, f"{each:.4f}"]) for _ in range(2)]
    try:
        time.sleep(0.5)
        return _late_share(lab, seconds)
    finally:
        for one in spinning:
            one.kill()
            one.wait()


def _wait(lab: Started) -> None:
    """Wait until the loop runs and what is computed beside it is ready."""
    with joined(lab) as line:
        heard(line, lambda said: isinstance(said, dict) and bool(said.get("limit")))


def _counts(lab: Started) -> FloatArray:
    """Return late samples and all, so far."""
    with joined(lab) as line:
        frame = heard(line, frames)
        return np.array([head(frame, "late"), head(frame, "first")])


def _late_share(lab: Started, seconds: float, page: Browser | None = None) -> float:
    """Return the share of late samples of some seconds, in which the pointer of a page moves."""
    before, end = _counts(lab), time.monotonic() + seconds
    while time.monotonic() < end:
        if page is not None:
            turn = 2.0 * math.pi * time.monotonic()
            # Waiting for the answer would keep step with the page's pictures, as no hand does.
            page.post(
                "Input.dispatchMouseEvent",
                type="mouseMoved",
                button="left",
                buttons=1,
                x=300 + 60 * math.cos(turn),
                y=250 + 40 * math.sin(turn),
            )
        time.sleep(0.016)
    late, samples = np.subtract(_counts(lab), before)
    return float(late / samples)


if __name__ == "__main__":
    run(Console(), float(sys.argv[1]) if sys.argv[1:] else SECONDS)

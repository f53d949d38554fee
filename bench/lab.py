"""The lab: from pointer to picture, what the page costs the loop, and how long until it is there.

``python -m bench.lab 5`` for 5 s with a page instead of 40. Needs chromium.
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

SECONDS = 40.0
"""With a page, and as much without."""
PAIRS = 8
BLANK = "about:blank"
MAP = ("noise:rms=20um,size=10.24mm,pitch=10um", "--law", "H", "--set", "update_rate=10kHz")
"""Law H on a map of 1024 x 1024 heights at 10 kHz."""
_LIVE = "globalThis.lab?.frame && lab.news?.state == 'running'"


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
    alone, watched = 1e6 * np.median(shares, axis=0)
    console.print(
        f"lab: of a million samples {alone:.0f} are late without a page, {watched:.0f} with it;"
        f" median of differences {1e6 * np.median(np.diff(shares)):+.0f}, of {len(shares)} pairs"
    )


def first_picture(page: Browser) -> float:
    """Return the time from the command to the loop's probe over the surface in the page [s]."""
    begun = time.perf_counter()
    lab = Started()
    try:
        page.call("Page.navigate", url=lab.address)
        page.until(f"{_LIVE} && lab.ready")
        return time.perf_counter() - begun
    finally:
        page.call("Page.navigate", url=BLANK)
        lab.close()


def _pairs(lab: Started, page: Browser, seconds: float) -> tuple[FloatArray, FloatArray]:
    """Return latencies [ms], and shares of late samples without and with a page (pairs, 2)."""
    waits: list[float] = []
    shares = []
    for _ in range(PAIRS):
        alone = _late(lab, seconds / PAIRS)
        page.call("Page.navigate", url=lab.address)
        page.until(f"{_LIVE} && lab.ready")
        watched = _late(lab, seconds / PAIRS, page)
        waits += page.ask("lab.latencies")
        page.call("Page.navigate", url=BLANK)
        shares.append((alone, watched))
    return np.array(waits), np.array(shares)


def _wait(lab: Started) -> None:
    """Wait until the loop runs and what is computed beside it is ready."""
    with joined(lab) as line:
        heard(line, lambda said: isinstance(said, dict) and bool(said.get("limit")))


def _counts(lab: Started) -> FloatArray:
    """Return late samples and all, so far."""
    with joined(lab) as line:
        frame = heard(line, frames)
        return np.array([head(frame, "late"), head(frame, "first")])


def _late(lab: Started, seconds: float, page: Browser | None = None) -> float:
    """Return the share of late samples of some seconds, in which the pointer of a page moves."""
    before, end = _counts(lab), time.monotonic() + seconds
    while time.monotonic() < end:
        if page is not None:
            turn = 2.0 * math.pi * time.monotonic()
            # Waiting for the answer would keep step with the page's pictures, as no hand does.
            page.post(
                "Input.dispatchMouseEvent", type="mouseMoved", button="left", buttons=1,
                x=300 + 60 * math.cos(turn), y=250 + 40 * math.sin(turn),
            )  # fmt: skip
        time.sleep(0.016)
    late, samples = np.subtract(_counts(lab), before)
    return float(late / samples)


if __name__ == "__main__":
    run(Console(), float(sys.argv[1]) if sys.argv[1:] else SECONDS)

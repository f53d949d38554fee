"""The page counts the ticks that were late, left out or truncated."""

from __future__ import annotations

import os
import re
import signal
import time

from tests.lab.browser import Browser, needs_browser
from tests.lab.started import Started


@needs_browser
def test_a_suspended_loop_is_counted_as_late_ticks(page: Browser, lab: Started) -> None:
    page.until("lab.status.state === 'running'")
    before = page.ask("[lab.frame.late, lab.frame.skipped]")
    for _ in range(5):  # the lab resumes a suspended loop within some ten milliseconds
        for one in lab.children():
            os.kill(one, signal.SIGSTOP)
        time.sleep(0.1)
        for one in lab.children():
            os.kill(one, signal.SIGCONT)
    page.until(f"lab.frame.late > {before[0]} && lab.frame.skipped > {before[1]} + 5")
    assert page.ask("lab.frame.lateness") > 3e-3
    assert page.ask("lab.frame.truncated") == 0.0
    # What the frame has is what the page shows.
    page.until(
        "document.getElementById('trace-note').textContent.startsWith(`${lab.frame.late} late (`)"
    )
    note = page.ask("document.getElementById('trace-note').textContent")
    counts = r"(\d+) late \(([\d.]+) (m?)s\), (\d+) skipped, 0 truncated ticks"
    limits = r"(?:, \d+ at the force limit)?(?:, \d+ below the depth \(deepest [\d.]+ .?m\))?"
    rate = r"(; measured \d+ % of the update rate that the stiffness is for)?"
    shown = re.fullmatch(counts + limits + rate, note)
    assert shown is not None, note
    assert int(shown[1]) > before[0]
    assert float(shown[2]) * (1e-3 if shown[3] else 1.0) > 3e-3
    assert page.said == []


@needs_browser
def test_ticks_below_the_depth_are_counted(page: Browser) -> None:
    page.until("lab.status.state === 'running'")
    page.ask("lab.hand.setMotion({ motion: 'stroke', pressDepth: 4e-3, strokeAmplitude: 2e-3 })")
    page.until("lab.frame.tooDeep > 10 && lab.frame.deepest > 5e-4")
    page.until(
        r"/, \d+ below the depth \(deepest [\d.]+ (mm|µm)\)/.test("
        "document.getElementById('trace-note').textContent)"
    )
    assert page.said == []

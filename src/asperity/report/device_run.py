"""A loop on a device: the line while it runs, and what is said at its end."""

from __future__ import annotations

import math
from collections.abc import Callable

from rich.console import Console

from asperity.errors import printable
from asperity.report.run import energy
from asperity.report.terminal import say
from asperity.report.words.number_words import law_title
from asperity.scene.setup import Setup
from asperity.servo.fault import Cause
from asperity.servo.process import ServoProcess
from asperity.servo.statistics import Statistics
from asperity.units import engineering

_SHARES = (0.5, 0.99, 0.999)
_ENDS = {Cause.STOPPED: "stopped", Cause.FINISHED: "done"}


def state_line(loop: ServoProcess) -> str:
    """Return where the handle is, the force, the energy and what was late, in a line."""
    rows, _first = loop.rows(loop.shared.head - 1)
    if not len(rows):
        return "waiting for the first sample"
    time, x, y, z, _cx, _cy, _cz, fx, fy, fz, _share, given = rows[-1, :12]
    place = ", ".join(f"{1e3 * value:+8.3f}" for value in (x, y, z))
    force = math.sqrt(fx * fx + fy * fy + fz * fz)
    late = loop.statistics.late
    return f"{time:8.2f} s  ({place}) mm  {force:6.3f} N  {energy(given):>10}  late {late}"


def time_lines(statistics: Statistics) -> list[str]:
    """Return how a loop kept time, in lines.

    Example:
        >>> counts = [0] * 9 + [900] * 1 + [99, 1] + [0] * 29
        >>> for line in time_lines(
        ...     Statistics(1000, 1, 2, 2e-6, 0, 0, 0, tuple(counts), tuple(counts))
        ... ):
        ...     print(line)
        Late: 1 of 1000 samples done after the next was due, 2 left out
        Began late:  50 % within 512 ns, 99 % 1.02 µs, 99.9 % 1.02 µs, worst 2 µs
        Period off:  50 % within 512 ns, 99 % 1.02 µs, 99.9 % 1.02 µs
    """

    def within(of: Callable[[float], float]) -> str:
        first, *rest = (f"{100.0 * share:g} % {{}}{engineering(of(share), 's')}"
                        for share in _SHARES)  # fmt: skip
        return ", ".join([first.format("within "), *(one.format("") for one in rest)])

    return [
        f"Late: {statistics.late} of {statistics.samples} samples done after the next was due,"
        f" {statistics.skipped} left out",
        f"Began late:  {within(statistics.lateness)}, worst {engineering(statistics.worst, 's')}",
        f"Period off:  {within(statistics.jitter)}",
    ]


def print_device_run(
    setup: Setup, loop: ServoProcess, cause: Cause, path: str | None, console: Console
) -> None:  # fmt: skip
    """Print what a loop has done."""
    how = "" if loop.moving else f", {loop.driver}"
    statistics, rows = loop.statistics, loop.rows(loop.shared.head - 1)[0]
    surface = setup.surface
    law = f"Law {surface.law.letter}, {law_title(surface.law.name)},"
    say(console, f"{law} at {engineering(surface.stiffness, 'N/m')}"
                 f" on {setup.device.name}{how}: {_ENDS[cause]}")  # fmt: skip
    span = engineering(setup.servo.period * statistics.samples, "s", digits=3)
    say(console, f"{statistics.samples} samples in {span}, at"
                 f" {engineering(1.0 / setup.servo.period, 'Hz')}")  # fmt: skip
    for line in time_lines(statistics):
        say(console, line)
    for count, words in (
        (statistics.lengths, "The greatest force was a limit in {} samples: there it is no law"),
        (statistics.slews, "The slew was a limit in {} samples: there it is no law"),
        (statistics.deep, "{} samples were deeper than max_depth, for which nothing was analysed"),
    ):
        if count:
            say(console, words.format(count))
    if len(rows):
        say(console, f"Energy to the hand: {energy(float(rows[-1, 11]))}")
    for assumption in (*setup.assumptions, *loop.notes):
        say(console, f"- {assumption}")
    if path is not None:
        console.print(f"Recording: {printable(path)}", soft_wrap=True, markup=False)

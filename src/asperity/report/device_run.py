"""A loop on a device: the line while it runs, and what is said at its end."""

from __future__ import annotations

import math

from rich.console import Console

from asperity.errors import printable
from asperity.report.run import energy
from asperity.report.terminal import say
from asperity.report.words.number_words import law_title
from asperity.scene.setup import Setup
from asperity.servo.fault import Cause
from asperity.servo.process import ServoProcess
from asperity.units import engineering

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
    say(console, f"Late: {statistics.late} samples done after the next was due,"
                 f" {statistics.skipped} left out; 99 % began within"
                 f" {engineering(statistics.lateness(0.99), 's', digits=2)}, the worst"
                 f" {engineering(statistics.worst, 's', digits=2)} late")  # fmt: skip
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

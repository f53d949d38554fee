"""Run the parts of the benchmark that are named on the command line, or all of them."""

from __future__ import annotations

import contextlib
import os
import platform
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from rich.console import Console

from bench.speed import (
    batches,
    bricks,
    export,
    fields,
    kernels,
    nearest,
    recording,
    servo,
    ticks,
    waiting,
)
from bench.stress import calibration

PARTS: dict[str, Callable[[Console], None]] = {
    "kernels": kernels.run,
    "batches": batches.run,
    "nearest": nearest.run,
    "ticks": ticks.run,
    "fields": fields.run,
    "bricks": bricks.run,
    "recording": recording.run,
    "servo": servo.run,
    "calibration": calibration.run,
    "export": export.run,
    "waiting": waiting.run,
}


def processor_name() -> str:
    """Return the name of the processor, on which the ratios depend too."""
    with contextlib.suppress(OSError):
        names = re.findall(
            r"^model name\s*: (.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE
        )
        return names[0] if names else platform.machine()
    return platform.processor()


def main(arguments: Sequence[str]) -> int:
    unknown = [name for name in arguments if name not in PARTS]
    if unknown:
        print(f"unknown part {unknown[0]!r}; choose from {', '.join(PARTS)}", file=sys.stderr)
        return 2
    console = Console(width=100, highlight=False)
    console.print(f"{processor_name()}, {os.cpu_count()} processors")
    for name in arguments or PARTS:
        console.rule(name)
        PARTS[name](console)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""What people wait for: processor and wall time of whole commands, first, again, and changed.

Every command is a process of its own; waits with the same folder share a cache, which is empty at
the first of them. Processor seconds are those of the process and of all that it starts. Of what is
repeated, which is indented, the median of some rounds counts.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import urllib.request
from pathlib import Path
from time import perf_counter

import numpy as np
from rich.console import Console
from tests.lab.started import Started

from bench.speed.timing import number_table

ROOT = Path(__file__).parents[2]
LIMIT = 900.0  # [s] per command
ROUNDS = 3

DEMO = "compare examples/demo.toml"
SINUSOID = "compare sinusoid:amplitude=0.8mm,period=1mm"
LAND = "../shared/data/sample-land.x3p --magnify 20"
MEASURED = f"compare {LAND}"
CHANGED = "--device touch --stiffness 700N/m"
HTML = "--html {folder}/report.html --force"
ONSET = "onset examples/press.toml"
RUN = "run sinusoid:amplitude=0.1mm,period=2mm --law C --stiffness 300N/m --duration 0.1s"
BAKED = "-o {folder}/baked.field --force"
LAB = "lab --no-browser"

WAITS = [
    ("--help", "--help", "demo", ""),
    ("first compare of the demo", DEMO, "demo", "wall 20"),
    ("  the same again", DEMO, "demo", "processor 1.5"),
    ("first compare of a sinusoid", SINUSOID, "sinusoid", "wall 6"),
    ("  the same again", SINUSOID, "sinusoid", "processor 0.5"),
    ("  another device and stiffness", f"{SINUSOID} {CHANGED}", "sinusoid", "processor 0.6"),
    ("first compare of a measured surface", MEASURED, "measured", "wall 25"),
    ("  the same again", MEASURED, "measured", "processor 1.2"),
    ("  another device and stiffness", f"{MEASURED} {CHANGED}", "measured", "processor 1.4"),
    ("first with a report", f"{MEASURED} {HTML}", "measured", ""),
    ("  the same again", MEASURED, "measured", "processor 1.2"),
    (
        "  export of its field, 6 million numbers",
        f"export {LAND} --law H -o {{folder}}/texture.h --force",
        "measured",
        "wall 3",
    ),
    *((f"bake {name}", f"bake {name} {BAKED}", "bake", "wall 6") for name in ("cloth", "knurl")),
    *((f"bake {name}", f"bake {name} {BAKED}", "bake", "wall 6") for name in ("tile", "wood")),
    ("bake sandpaper", f"bake sandpaper {BAKED}", "bake", "wall 15"),
    ("bake a measured surface", f"bake {LAND} {BAKED}", "bake", "wall 15"),
    ("first run of 0.1 s", f"{RUN} --device touch", "run", ""),
    ("  the same again", f"{RUN} --device touch", "run", "wall 3"),
    ("first page of the lab", LAB, "lab", "wall 5"),
    ("  the same again", LAB, "lab", ""),
    (f"{ONSET}, first", ONSET, "onset", ""),
    # Another question, of which no answer is in the cache.
    ("another width, all compiled", f"{ONSET} --tolerance 0.051", "onset", "processor 12"),
    ("reproduce, first", "reproduce", "paper", "wall 120"),
    ("  the same again", "reproduce", "paper", "processor 45"),
]
"""What is waited for, its command, the folder of its cache, and the goal [s]."""


def run(console: Console) -> None:
    """Print the table; what cannot be run is said in it."""
    table = number_table("work", "processor [s]", "wall [s]", "goal")
    with tempfile.TemporaryDirectory() as folder:
        for name, command, cache, goal in WAITS:
            rounds = ROUNDS if name.startswith(" ") else 1
            words = command.format(folder=folder).split()
            try:
                times = [_time_command(words, Path(folder, cache)) for _ in range(rounds)]
            except (OSError, AssertionError, subprocess.SubprocessError) as reason:
                table.add_row(name, "not run", str(reason).splitlines()[0], goal)
                continue
            table.add_row(name, *[f"{value:.2f}" for value in np.median(times, axis=0)], goal)
    console.print(table)


def _time_command(words: list[str], cache: Path) -> tuple[float, float]:
    """Return what a command took: of the processor, and until it ended or showed its page [s]."""
    cache.mkdir(mode=0o700, exist_ok=True)
    environment = os.environ | {"ASPERITY_CACHE_DIR": str(cache)}
    command = [sys.executable, "-m", "asperity", *words]
    before = os.times()
    start = perf_counter()
    if words[0] == "lab":
        wall = _time_page(command, environment)
    else:
        subprocess.run(
            command, cwd=ROOT, check=True, capture_output=True, timeout=LIMIT, env=environment
        )
        wall = perf_counter() - start
    after = os.times()
    used = after.children_user + after.children_system
    return used - before.children_user - before.children_system, wall


def _time_page(command: list[str], environment: dict[str, str]) -> float:
    start = perf_counter()
    lab = Started(command=command, environment=environment)
    try:
        with urllib.request.urlopen(lab.address, timeout=60) as page:
            page.read()
        return perf_counter() - start
    finally:
        lab.close()

"""Remedies that `asperity compare` prints, typed as they are printed.

``python -m bench.stress.remedies [--count 200] [--data FOLDER]`` draws pairs of a surface
(sinusoids, gratings, library surfaces, and the measured files of a folder) and a device, reads the
remedies in the printed answer, gives each as an option of the command, and checks what it promises:
the texture is felt, contact is kept, the surface fits into the workspace, or most of the force is
texture.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from click.testing import CliRunner
from rich.console import Console
from rich.progress import track

from asperity.cli.main import cli
from asperity.devices import device_names, load_device

SEED = 20261125
LIBRARY = ("sandpaper:", "sandpaper:grit=P60", "knurl", "brushed-metal", "wood", "tile")
FILES = (".x3p", ".csv")
Answer = dict[str, Any]


def random_surface(rng: np.random.Generator, files: list[Path]) -> tuple[str, float]:
    """Return a surface as it is typed, and its magnification; 0 for one without the option."""

    def log_uniform(low: float, high: float) -> float:
        return float(math.exp(rng.uniform(math.log(low), math.log(high))))

    kind = rng.random()
    period = log_uniform(0.1, 8.0)
    if kind < 0.5:
        height = log_uniform(1e-5, 0.4) * period
        return f"sinusoid:amplitude={height:.3g}mm,period={period:.3g}mm", 0.0
    if kind < 0.6:
        return f"grating:height={log_uniform(0.001, 0.2) * period:.3g}mm,period={period:.3g}mm", 0.0
    if kind < 0.8 or not files:
        return str(rng.choice(LIBRARY)), 0.0
    return str(files[rng.integers(len(files))]), float(rng.choice([1.0, 5.0, 20.0]))


def compare(surface: str, device: str, options: dict[str, str]) -> Answer:
    """Return the answer of the command as data."""
    arguments = ["compare", surface, "--device", device, "--laws", "CH", "--rendering", "search"]
    arguments += [part for option in options.items() for part in option]
    result = CliRunner().invoke(cli, [*arguments, "--json", "-"])
    if result.exit_code:
        raise RuntimeError(f"{' '.join(arguments)}: {result.output}{result.exception}")
    answer: Answer = json.loads(result.stdout)
    return answer


def row_of(answer: Answer) -> Answer:
    """Return the row of the recommended law, else of the one that comes nearest."""
    letter = answer["recommended"] or answer["nearest"]
    return next(row for row in answer["laws"] if row["law"] == letter)


def is_felt(answer: Answer) -> bool:
    """Return whether the answer recommends a law that is felt."""
    return bool(answer["recommended"]) and row_of(answer)["perceptibility"]["tier"] == "felt"


def keeps_contact(answer: Answer) -> bool:
    """Return whether the law that is recommended keeps contact."""
    return "it loses contact" not in answer["recommendation"]


def fits(answer: Answer) -> bool:
    """Return whether the surface fits into the workspace."""
    return "only a part can be touched" not in answer["recommendation"]


REMEDIES: tuple[tuple[str, str, str, Callable[[Answer], bool]], ...] = (
    (r"magnify it ([\d.e+]+) times more", "--magnify", "{}", is_felt),
    (r"scan at ([\d.e+-]+ m*/s)", "--speed", "{}", is_felt),
    (r"less than ([\d.]+ \S+) of apparent mass", "--set", "apparent_mass={}", is_felt),
    (r"force steps below ([\d.]+ \S+?)[,.]", "--set", "force_resolution={}", is_felt),
    (r"position steps below ([\d.]+ \S+?)[,.]", "--set", "position_resolution={}", is_felt),
    (r"pressed to ([\d.]+ \S+) it keeps contact", "--max-depth", "{}", keeps_contact),
    (r"all of it magnified ([\d.e-]+) times more", "--magnify", "{}", fits),
)


def typed_remedies(
    surface: str, device: str, magnify: float, answer: Answer
) -> Iterator[tuple[str, str, bool]]:
    """Yield each remedy of an answer: its option, its value, and whether it does what it says."""
    given = {"--magnify": f"{magnify:g}"} if magnify else {}
    for pattern, option, value, promise in REMEDIES:
        for number in re.findall(pattern, answer["recommendation"]):
            in_all = f"{(magnify or 1.0) * float(number):.10g}" if option == "--magnify" else number
            text = value.format(in_all)
            yield option, text, promise(compare(surface, device, {**given, option: text}))


def main(arguments: list[str]) -> int:
    """Print how many remedies do what they say, by option, and those that do not."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--data", type=Path, help="folder of measured files")
    options = parser.parse_args(arguments)
    console, rng = Console(width=100, highlight=False), np.random.default_rng(options.seed)
    files = [
        file
        for file in sorted(options.data.iterdir() if options.data else ())
        if file.suffix in FILES
    ]
    devices = [one for one in device_names() if load_device(one).wall_test is not None]
    right: Counter[str] = Counter()
    wrong: Counter[str] = Counter()
    for _ in track(range(options.count), "pairs", console=console):
        surface, magnify = random_surface(rng, files)
        device = str(rng.choice(devices))
        given = {"--magnify": f"{magnify:g}"} if magnify else {}
        answer = compare(surface, device, given)
        for option, value, holds in typed_remedies(surface, device, magnify, answer):
            name = f"{option} {value.partition('=')[0]}" if option == "--set" else option
            (right if holds else wrong)[name] += 1
            if not holds:
                console.print(f"MISS {surface} {given} on {device}: {option} {value}")
    for name in sorted(right | wrong):
        console.print(f"{name}: {right[name]} of {right[name] + wrong[name]}")
    total = sum(right.values())
    console.print(
        f"{options.count} pairs: {total} of {total + sum(wrong.values())} remedies do what they say"
    )
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

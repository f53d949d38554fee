"""Does what the comparison recommends cycle at the stiffness to begin with? Over the catalogue.

``python -m bench.stress.headlines``: for every device whose K₀ is known, every surface of the table
and delays of 0 and 2 samples, the recommended law is simulated at its start, in loops in which the
smooth wall of K₀ is just passive by the delay rule: damping K₀ (1/2 + d) T along every axis, the
device's mass (0.1 kg where it is not known), its steps, a hand that holds and one that holds
loosely. Misses are shown, apart from those where the smooth wall cycles too, at K₀ or at the start:
there the steps of the positions do it, and K₀ would not have held. Takes some minutes: run it by
night. ``python -m bench.stress.headlines 4`` asks at four times the start: there loops must cycle,
or the run shows nothing.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from itertools import product

import numpy as np
from rich.console import Console
from rich.progress import track

from asperity.analysis.results.compare import Comparison, compare
from asperity.devices import Device, device_names, load_device
from asperity.scene import load_scene
from asperity.scene.scene_defaults import make_servo
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary
from asperity.simulation.lanes import BatchSimulation
from asperity.simulation.onset import run_starts, start_offsets
from asperity.surface import Surface
from bench.stress.margins import HANDS, press_with

SURFACES = (
    "sinusoid:amplitude=20um,period=1mm",
    "sinusoid:amplitude=50um,period=0.3mm",
    "sinusoid:amplitude=0.1mm,period=2mm",
    "sinusoid:amplitude=0.4mm,period=1.5mm",
    "sinusoid:amplitude=0.8mm,period=1mm",
    "sinusoid:amplitude=1mm,period=8mm",
    "knurl",
    "sandpaper:grit=P60",
)
LAWS = "WABCDEFGH"
DELAYS = (0, 2)
STARTS = 6
DURATION = 1.0  # [s], of the first run; a light hand and little damping take that long to calm down
MASS = 0.1  # [kg] where none is known
PRESS = 0.25  # of stiffness times max_depth


@dataclass(frozen=True)
class HeadlineLoop:
    """One loop, with what became of it."""

    device: str
    surface: str
    delay: int
    hand: str
    law: str
    stiffness: float
    cycles: int
    wall_cycles: bool


def simulate_loops(
    device: Device, spec: str, comparison: Comparison, stiffness_factor: float = 1.0
) -> list[HeadlineLoop]:
    """Return what becomes of the recommended law on a device, at so many times its start."""
    row, test = comparison.recommended_row, device.wall_test
    if row is None or test is None:
        return []
    surface = row.surface.to_stiffness(stiffness_factor * row.recommended_stiffness)
    result = []
    for delay, (name, hand) in product(DELAYS, HANDS.items()):
        servo, _said = make_servo(device, uses_delay=False)
        servo = Servo(
            servo.period, delay, servo.position_resolution, servo.force_resolution, servo.max_force
        )
        damping = test.value * (0.5 + delay) * servo.period
        plant = Cartesian(device.value("apparent_mass") or MASS, damping)
        held = press_with(hand, PRESS * surface.stiffness * surface.max_depth)
        count = _cycles(surface, plant, held, servo)
        wall = surface.to_law("W")
        walls = [wall.to_stiffness(k) for k in (surface.stiffness, test.value)] if count else []
        too = any(_cycles(one, plant, held, servo) for one in walls)
        result.append(
            HeadlineLoop(
                device.id, spec, delay, name, row.law.letter, surface.stiffness, count, too
            )
        )
    return result


def _cycles(surface: Surface, plant: Cartesian, hand: SpringHand, servo: Servo) -> int:
    """Return how many starts end in a limit cycle."""
    begin = np.array([0.0, 0.0, surface.texture.extremes[1] + 0.2 * surface.max_depth])
    still, shifts = Stationary((0.0, 0.0, 0.0)), start_offsets(surface, STARTS)
    loop = BatchSimulation(surface, plant, hand, servo, still, begin)
    runs = run_starts(loop, surface.stiffness, servo, shifts, DURATION)
    return sum(bool(run.verdict) for run in runs)


def main(stiffness_factor: float = 1.0) -> int:
    """Print how many loops cycle, and which; return whether it is not as it must be."""
    console = Console(width=100, highlight=False)
    known = [device for device in map(load_device, device_names()) if device.wall_test is not None]
    done: list[HeadlineLoop] = []
    for device, spec in track(list(product(known, SURFACES)), "devices", console=console):
        done += simulate_loops(
            device, spec, compare(load_scene(spec).texture, device, LAWS), stiffness_factor
        )
    cycling = [loop for loop in done if loop.cycles]
    missed = [loop for loop in cycling if not loop.wall_cycles]
    for loop in missed:
        console.print(
            f"MISS {loop.device}, {loop.surface}: law {loop.law} at {loop.stiffness:g} N/m cycles "
            f"from {loop.cycles} of {STARTS} starts; delay {loop.delay}, {loop.hand}"
        )
    console.print(
        f"{len(known)} devices x {len(SURFACES)} surfaces: "
        f"{len(done)} loops at {stiffness_factor:g} x the "
        f"recommended start, {len(cycling)} of them cycle, {len(cycling) - len(missed)} of these "
        f"with the smooth wall: {len(missed)} misses"
    )
    return int(bool(missed) if stiffness_factor <= 1.0 else not cycling)


if __name__ == "__main__":
    sys.exit(main(*map(float, sys.argv[1:])))

"""Motion of random loops with steps of position and force, against the bound of MATH section 7.

``python -m bench.stress.steps`` draws random admissible loops (``bench/stress/margins.py``) on
devices with known damping and delay, gives each random steps of encoder and force, and simulates it
at the stiffness that `asperity compare` recommends there. The RMS speed of a motion that lasts must
not exceed the bound of the buzz. Laws with curl and jumps have no such bound, nor has any law whose
number q is infinite; they are not drawn.

Chatter of steps below the bound belongs to the encoder: the share of loops in which a hand feels it
is printed per step of position, for the smooth wall W as for textures.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass

import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.analysis import characteristic_number, one_sided_number
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.passivity.recommended_stiffness import recommend_stiffness
from asperity.analysis.passivity.verdict import passivity
from asperity.devices import Device, parse_device
from asperity.scene.sweeps import map_threads
from bench.stress.margins import RandomLoop, admissible_loops, has_start, lasting_motion

LAWS = "WCDH"
LOOPS = 2000
SEED = 20261125
POSITION_STEPS = (1e-6, 5e-6, 15e-6, 55e-6)
FORCE_STEPS = (1e-9, 1e-3, 10e-3)


@dataclass(frozen=True)
class StepMotion:
    """A random loop with steps.

    Attributes:
        loop: number of the loop.
        position_step: step of position [m].
        stiffness: the recommended one [N/m].
        bound: of the RMS speed of a motion that repeats itself [m/s].
        speed: RMS speed of the motion that lasts and is felt [m/s]; 0 if there is none.
    """

    loop: int
    position_step: float
    stiffness: float
    bound: float
    speed: float


def device_of(loop: RandomLoop, steps: tuple[float, float]) -> Device:
    """Return the device of a random loop, with everything known."""
    return parse_device(
        {
            "damping": float(np.linalg.eigvalsh(loop.damping)[0]),
            "delay_samples": loop.delay,
            "update_rate": 1.0 / loop.period,
            "position_resolution": steps[0],
            "force_resolution": steps[1],
        },
        "random",
    )


def move(loop: RandomLoop, law: str) -> StepMotion | None:
    """Return the motion of a loop at its start; ``None`` if it has no bound of the buzz."""
    rng = np.random.default_rng([SEED, loop.number])
    steps = float(rng.choice(POSITION_STEPS)), float(rng.choice(FORCE_STEPS))
    surface, device = loop.surface(law), device_of(loop, steps)
    numbers = characteristic_number(surface), one_sided_number(surface)
    start = recommend_stiffness(surface, device, *numbers).stiffness
    if not start:
        return None
    there = surface.to_stiffness(start)
    buzz = passivity(there, device, *numbers, worst_loop(there)).buzz
    if buzz is None:
        return None
    motion = lasting_motion(loop, law, start, steps)
    speed = 0.0 if motion is None else motion.norm
    return StepMotion(loop.number, steps[0], start, buzz.speed, speed)


def measure(law: str, count: int) -> list[StepMotion]:
    """Return random loops of a law that have a bound."""
    loops, found = admissible_loops(law, SEED, has_start), list[StepMotion]()
    while len(found) < count:
        drawn = [next(loops)[0] for _ in range(min(count - len(found), 200))]
        found += filter(None, map_threads(lambda loop: move(loop, law), [(one,) for one in drawn]))
    return found


def main(arguments: list[str]) -> int:
    """Print, per law, the greatest share of the bound and the share that is felt."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--laws", default=LAWS)
    parser.add_argument("--loops", type=int, default=LOOPS)
    options = parser.parse_args(arguments)
    console = Console(width=100, highlight=False)
    felt = [f"felt at {1e6 * step:g} µm" for step in POSITION_STEPS]
    shown, above = Table("law", "loops", "above", "most/bound", "bound up to", "felt", *felt), 0
    for law in options.laws:
        motions = measure(law, options.loops)
        shares = [one.speed / one.bound for one in motions if one.bound]
        above += (wrong := sum(share > 1.0 for share in shares))
        at = [
            [one.speed > 0.0 for one in motions if one.position_step == step]
            for step in POSITION_STEPS
        ]
        shown.add_row(
            law,
            str(len(motions)),
            str(wrong),
            f"{max(shares):.2f}",
            f"{1e3 * max(one.bound for one in motions):.3g} mm/s",
            f"{np.mean([one.speed > 0.0 for one in motions]):.1%}",
            *(f"{np.mean(one):.0%}" for one in at),
        )
    console.print(shown)
    return int(above > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""How far below K₀/q a law begins to cycle: the factor below which a stiffness is suggested.

``python -m bench.margins`` simulates the onset of limit cycles of every law beside that of the
smooth wall in the same loop, and writes what it finds to
``src/asperity/analysis/passivity/margins.toml``, which the program reads. A wall that held tells
nothing of sideways damping, of the mass that the texture shakes, nor of how the hand holds on: the
least ratio over these loops is what K₀/q has to be multiplied by to have held in all of them.
Where it is known how much less the lightest direction is damped than the wall's normal, K₀ is
taken along that direction, and what is left of the ratio is nearer to 1.
"""

from __future__ import annotations

import argparse
import math
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from asperity.analysis import characteristic_number
from asperity.devices.five_bar import handle_damping
from asperity.paper.cases import PASSIVITY
from asperity.paper.experiments.experiment_setups import band_setup
from asperity.scene.setup import Setup
from asperity.scene.sweeps import map_threads, sweep_onsets
from asperity.simulation import Cartesian, Pantograph, Plant, SpringHand
from asperity.surface import Surface
from asperity.textures import Sinusoid

TARGET = Path(__file__).parents[1] / "src/asperity/analysis/passivity/margins.toml"
LAWS = "WABCDEFGH"
DELAYS = (0, 1, 2, 6)
STARTS = 8
TOLERANCE = 0.02
LOWEST = 50.0  # [N/m], of the smooth wall
SURFACES = {
    "0.8 mm on 1 mm": PASSIVITY.surface("W").texture,
    "0.2 mm on 1.5 mm": Sinusoid(0.2e-3, 1.5e-3),
    "10 µm on 1 mm": Sinusoid(10e-6, 1e-3),  # D's q is finite here
}
PRESSES = (0.25, 0.02, 0.002)  # of K₀/q times max_depth
BRAKES = PASSIVITY.joint_damping
PLANTS: dict[str, Plant] = {
    "pantograph at (37.5, 100) mm": Pantograph(joint_damping=BRAKES, centre=(0.0375, 0.1)),
    "pantograph at (-12.5, 100) mm": Pantograph(joint_damping=BRAKES),
    "50 g and 1.5 N s/m along every axis": Cartesian(0.05, 1.5),
}
HANDS = {
    "held": SpringHand((200.0, 200.0, 0.0), 1.0, 0.03),
    "held loosely": SpringHand((20.0, 20.0, 0.0), 0.02),
}
LOOPS: dict[str, tuple[Plant, SpringHand]] = {
    f"{place}, {grip}": (plant, hand)
    for place, plant in PLANTS.items()
    for grip, hand in HANDS.items()
}


Case = tuple[float, float, str, str, int]


@dataclass(frozen=True)
class MarginResult:
    """The least ratio of a law: where it held, over K₀/q.

    Attributes:
        ratio: with K₀ along the wall's normal.
        lightest_ratio: the least with K₀ along the lightest direction.
        loop: of the least ratio, as the next two.
        surface: its texture.
        delay: in samples.
        below: in how many cases the law cycled below K₀/q.
        count: of the cases.
    """

    ratio: float
    lightest_ratio: float
    loop: str
    surface: str
    delay: int
    below: int
    count: int


def make_case(loop: str, surface: str) -> Setup:
    """Return a loop of the table, with the smooth wall."""
    plant, hand = LOOPS[loop]
    texture = SURFACES[surface]
    wall = Surface(texture, "W", 1000.0, PASSIVITY.depth)
    start = (0.0, 0.0, texture.peak_to_valley)
    return replace(
        band_setup("W"), surface=wall, plant=plant, hand=press_with(hand, 2.0), start=start,
        duration=0.25,
    )  # fmt: skip


def press_with(hand: SpringHand, force: float) -> SpringHand:
    """Return the hand with a force [N] into the surface."""
    return SpringHand(hand.stiffness, hand.damping, hand.mass, (0.0, 0.0, -force))


def measure(laws: str, console: Console) -> dict[str, MarginResult]:
    """Return the least ratio of each law over all loops, surfaces and delays."""
    cases = [(loop, surface, delay) for loop in LOOPS for surface in SURFACES for delay in DELAYS]
    found: dict[str, list[Case]] = {law: [] for law in laws}
    for loop, surface, delay in track(cases, "loops", console=console):
        case = make_case(loop, surface)
        wall = wall_onset(case, delay)

        def ratio(law: str, case: Setup = case, delay: int = delay, wall: float = wall) -> float:
            return ratio_to_wall(case.with_law(law), delay, wall)

        some = [law for law in laws if math.isfinite(_number(case.with_law(law)))]
        for law, share in zip(some, map_threads(ratio, [(law,) for law in some]), strict=True):
            found[law].append((share, share / lightest_direction_ratio(loop), loop, surface, delay))
            console.print(f"{loop}; {surface}; d = {delay}; {law}: {share:.3f}")
    return {law: _worst_case(ratios) for law, ratios in found.items()}


def wall_onset(case: Setup, delay: int) -> float:
    """Return the greatest stiffness at which the smooth wall held in a loop [N/m]."""
    (smooth,) = sweep_onsets(
        case, "W", (delay,), n_phases=STARTS, tolerance=TOLERANCE, min_stiffness=LOWEST
    )
    return smooth.onset.quiet


def _number(case: Setup) -> float:
    """Return q, infinite for D where ridges are in reach: it has no K₀/q then."""
    return characteristic_number(case.surface).upper


def ratio_to_wall(case: Setup, delay: int, wall: float) -> float:
    """Return where a law held over K₀/q, with K₀ where the smooth wall of the same loop held.

    The hand presses with as much of what the surface gives at full depth as of K₀/q the search
    begins with: then the handle stays where q holds, the whole search long. What cycles from the
    beginning is tried again from far below, pressed as much less.
    """
    surface = case.surface
    allowed = wall / _number(case)
    assert isinstance(case.hand, SpringHand)
    for share in PRESSES:
        hand = press_with(case.hand, share * allowed * surface.max_depth)
        (found,) = sweep_onsets(
            replace(case, hand=hand), surface.law.letter, (delay,), n_phases=STARTS,
            tolerance=TOLERANCE, min_stiffness=share * allowed,
        )  # fmt: skip
        if found.onset.quiet:
            break
    return found.onset.quiet / allowed


def lightest_direction_ratio(loop: str) -> float:
    """Return the damping of the lightest direction as a share of that along the wall's normal."""
    plant = LOOPS[loop][0]
    if isinstance(plant, Cartesian):
        return float(np.linalg.eigvalsh(plant.damping)[0] / plant.damping[2, 2])
    assert isinstance(plant, Pantograph)
    damping = handle_damping(plant.linkage, plant.joint_damping, np.array(plant.centre))
    return float(np.linalg.eigvalsh(damping)[0] / damping[1, 1])


def _worst_case(cases: list[Case]) -> MarginResult:
    ratio, _, loop, surface, delay = min(cases)
    below = sum(one[0] < 1.0 for one in cases)
    return MarginResult(
        ratio, min(one[1] for one in cases), loop, surface, delay, below, len(cases)
    )


def table(found: dict[str, MarginResult]) -> Table:
    """Return what was found, one row per law."""
    shown = Table("law", "least", "along lightest", "loop", "surface", "d", "below 1", "of")
    for law, one in found.items():
        shown.add_row(
            law,
            f"{one.ratio:.3f}",
            f"{one.lightest_ratio:.3f}",
            one.loop,
            one.surface,
            str(one.delay),
            str(one.below),
            str(one.count),
        )
    return shown


def write_margins(found: dict[str, MarginResult], path: Path = TARGET) -> None:
    """Write the factors, rounded down, at most 1, with where each was found."""
    lines = [
        "# Written by `python -m bench.margins`: how far below K₀/q a law began to cycle in",
        "# simulation, beside the smooth wall of the same loop. factor: the least ratio, rounded",
        "# down, at most 1; along_lightest: the same with K₀ along the lightest direction; below:",
        "# in how many of the cases the law cycled below K₀/q. The case is that of the factor.",
    ]
    for law, one in found.items():
        lines += [
            "", f"[{law}]", f"factor = {round_down_factor(one.ratio):.2f}",
            f"along_lightest = {round_down_factor(one.lightest_ratio):.2f}", f'loop = "{one.loop}"',
            f'surface = "{one.surface}"', f"delay = {one.delay}", f"below = {one.below}",
            f"cases = {one.count}",
        ]  # fmt: skip
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def round_down_factor(ratio: float) -> float:
    """Return a ratio as it is used: rounded down to hundredths, at most 1."""
    return math.floor(100.0 * min(ratio, 1.0)) / 100.0


def main(arguments: list[str]) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--laws", default=LAWS[1:], help="laws; only all of them are written")
    laws = parser.parse_args(arguments).laws
    console = Console(width=120, highlight=False)
    found = measure(laws, console)
    console.print(table(found))
    if laws == LAWS[1:]:
        write_margins(found)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

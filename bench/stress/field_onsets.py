"""Do loops with a baked field start to cycle where those with exact law H do?

``python -m bench.stress.field_onsets`` finds the onset of limit cycles of both by simulation, on
five surfaces and four delays of the paper's pantograph, and prints their ratio; goal: within 5 %.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.progress import track
from rich.table import Table

from asperity.core.arguments import FIELD, SEARCH
from asperity.rendering import bake
from asperity.scene import load_scene
from asperity.scene.setup import Setup, make_setup
from asperity.scene.sweeps import sweep_onsets
from asperity.surface import Surface
from asperity.textures.catalogue import as_texture

SCENE = Path(__file__).parents[2] / "examples" / "press.toml"
SURFACES = (
    "cloth",
    "knurl",
    "brushed-metal",
    "sinusoid:amplitude=0.2mm,period=1mm",
    "sinusoid:amplitude=0.4mm,period=2mm",
)
DELAYS = (1, 2, 4, 6)
MAX_DEPTH = 0.3e-3
TOLERANCE = 0.01
STARTS = 3
GOAL = 0.05


def main() -> None:
    console = Console(width=100, highlight=False)
    table = Table("surface", "delay [samples]", "exact [N/m]", "baked [N/m]", "ratio", box=None)
    worst = 0.0
    for name in track(SURFACES, console=Console(stderr=True)):
        exact, baked = (_onsets(setup) for setup in _setups(name))
        for delay, one, other in zip(DELAYS, exact, baked, strict=True):
            ratio = other / one
            worst = max(worst, abs(ratio - 1.0))
            row = (name, str(delay), f"{one:.0f}", f"{other:.0f}", f"{ratio:.3f}")
            table.add_row(*row)
            console.print(*row)  # a whole run takes hours on a busy machine
    console.print(table)
    console.print(f"largest difference {worst:.1%}, goal {GOAL:.0%}: ", end="")
    console.print("met" if worst <= GOAL else "MISSED")


def _setups(name: str) -> tuple[Setup, Setup]:
    """Return the loop with exact law H, and with its baked field."""
    setup = make_setup(load_scene(str(SCENE)), surface={"law": "H", "stiffness": 2000.0})
    surface = Surface(as_texture(name), "H", 2000.0, max_depth=MAX_DEPTH)
    exact = replace(setup, surface=surface, rendering=SEARCH)
    return exact, replace(setup, surface=bake(surface), rendering=FIELD)


def _onsets(setup: Setup) -> list[float]:
    found = sweep_onsets(setup, "H", DELAYS, n_phases=STARTS, tolerance=TOLERANCE).onsets
    return [prediction.onset.cycling for prediction in found]


if __name__ == "__main__":
    main()

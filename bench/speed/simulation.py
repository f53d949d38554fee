"""How much faster than real time the simulation runs, with its energy ledger and a trace."""

from __future__ import annotations

import math

import numpy as np
from rich.console import Console

from asperity.laws import LAWS
from asperity.simulation import Cartesian, Pantograph, Servo, SpringHand, Strokes, simulate
from asperity.simulation.plants import Plant
from asperity.surface import Surface
from asperity.textures import Sinusoid
from bench.speed.timing import number_table, seconds

GOAL = 100.0
DURATION = 5.0
_SERVO = Servo(
    1e-4,
    delay=1,
    position_resolution=15e-6,
    force_resolution=1e-3,
    max_force=8.0,
    virtual_damping=0.1,
    velocity_share=0.2,
)
_HAND = SpringHand(stiffness=300.0, damping=3.0, mass=0.05, force=(0.0, 0.0, -1.0))
_TEXTURE = Sinusoid(amplitude=0.8e-3, period=2e-3)
_STROKES = Strokes((-0.01, 0.0, 0.0), (0.01, 0.0, 0.0), speed=0.1, count=10_000)
_PLANTS: dict[str, Plant] = {"Cartesian": Cartesian(0.02, 1.0), "Pantograph": Pantograph()}


def run(console: Console) -> None:
    """Print how much faster than real time each law runs at 10 kHz, trace in memory."""
    table = number_table("law", *(f"{name}\nx real time" for name in _PLANTS))
    worst = math.inf
    for law in LAWS:
        factors = [_factor(law, plant) for plant in _PLANTS.values()]
        worst = min(worst, *factors)
        table.add_row(law, *[f"{factor:.0f}" for factor in factors])
    console.print(table)
    answer = "met" if worst >= GOAL else "MISSED"
    console.print(f"worst {worst:.0f} x (goal {GOAL:.0f}) -> {answer}", style="bold")


def _factor(law: str, plant: Plant) -> float:
    surface = Surface(_TEXTURE, law, 1000.0)

    def once(span: float = DURATION) -> None:
        simulate(surface, plant, _HAND, _SERVO, _STROKES, span)

    once(0.1)
    return DURATION / float(np.median([seconds(once) for _ in range(5)]))

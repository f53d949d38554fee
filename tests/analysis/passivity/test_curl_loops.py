"""Loops in which law G cycles far below K₀/q, although a wall of K₀ rests in them."""

from __future__ import annotations

import numpy as np
import pytest

import asperity as asp
from asperity.devices import parse_device
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary, simulate
from asperity.simulation.lanes import BatchSimulation
from asperity.simulation.onset import run_starts, start_offsets
from asperity.simulation.trace import TailStatistics
from asperity.surface import Surface

TEXTURE = asp.Sinusoid(0.3e-3, 2.3e-3)
PLANT, SERVO = Cartesian(0.05, 0.625), Servo(2.5e-4)
HAND = SpringHand((200.0, 200.0, 200.0), 1.0, 0.0, (0.0, 0.0, -0.62))
DEPTH = 0.6e-3


def cycling_starts(law: str, stiffness: float, height: float) -> list[np.ndarray]:
    """Return the starts along a period, at a height [m], from which a loop ends in a cycle."""
    surface, start = Surface(TEXTURE, law, max_depth=DEPTH), np.array([0.0, 0.0, height])
    batch = BatchSimulation(surface, PLANT, HAND, SERVO, Stationary(tuple(start)), start)
    shifts = start_offsets(surface, 8)
    runs = run_starts(batch, stiffness, SERVO, shifts, 1.0)
    return [start + shift for shift, run in zip(shifts, runs, strict=True) if run.verdict]


def tail_of(law: str, stiffness: float, start: np.ndarray) -> TailStatistics:
    surface = Surface(TEXTURE, law, stiffness, DEPTH)
    run = simulate(surface, PLANT, HAND, SERVO, Stationary(tuple(start)), 4.0, start=start)
    assert run.tail is not None
    return run.tail


@pytest.mark.parametrize(
    ("stiffness", "height", "speed", "frequency"),
    [
        (520.0, 1e-3, 13.2e-3, 16.0),  # a rule of 15 mm/s called it rest: 0.4 mm peak to peak
        (1040.0, 0.0, 59.1e-3, 23.9),
        (1040.0, 0.3e-3, 51.1e-3, 23.5),
        (1040.0, 1e-3, 18.9e-3, 22.3),
        (1460.0, 0.0, 31.5e-3, 26.7),
        (1460.0, 0.3e-3, 11.4e-3, 26.2),
    ],
)
def test_law_g_cycles_where_a_wall_of_5000_rests(
    stiffness: float, height: float, speed: float, frequency: float
) -> None:
    """A grip of 200 N/m and 1 N·s/m on every axis above the crest, pressed with 0.62 N."""
    starts = cycling_starts("G", stiffness, height)
    assert len(starts) == 2
    tail = tail_of("G", stiffness, starts[0])
    assert tail.velocity_spread == pytest.approx(speed, rel=0.02)
    assert tail.velocity_spread / tail.position_spread == pytest.approx(
        2.0 * np.pi * frequency, rel=0.02
    )
    assert not cycling_starts("W", 5000.0, height)
    assert not cycling_starts("H", stiffness, height)


@pytest.mark.parametrize("more", [{}, {"damping": "0.625 N*s/m", "delay_samples": 0}])
def test_nothing_calls_these_loops_quiet(more: dict[str, object]) -> None:
    data = {"max_stiffness": "5 kN/m", "update_rate": "4 kHz", "apparent_mass": "50 g", **more}
    result = asp.compare(TEXTURE, device=parse_device(data, "omega"), laws="G")
    text = f"{result.row('G').verdict} {result.recommendation} {' '.join(result.assumptions)}"
    for words in ("quiet", "no buzz", "buzz expected", "any delay", "stable in all", "plausible"):
        assert words not in text.lower()
    assert "delivers energy below v* = " in text
    assert "simulated loops cycle, at up to" in text

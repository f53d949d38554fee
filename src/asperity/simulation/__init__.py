"""Simulation of texture, device and hand in a closed loop, with an exact energy ledger."""

from asperity.simulation.discretization import Resonance
from asperity.simulation.hands import (
    BandHand,
    Hand,
    Motion,
    PrescribedHand,
    SpringHand,
    Stationary,
    Strokes,
    Waypoints,
)
from asperity.simulation.onset import Onset, find_onset
from asperity.simulation.pantograph import LinkMasses, Pantograph
from asperity.simulation.plants import Cartesian, Plant
from asperity.simulation.scan import Stroke, scan_strokes
from asperity.simulation.servo import Servo
from asperity.simulation.simulate import simulate, simulate_many
from asperity.simulation.trace import Ledger, Run

__all__ = [
    "BandHand",
    "Cartesian",
    "Hand",
    "Ledger",
    "LinkMasses",
    "Motion",
    "Onset",
    "Pantograph",
    "Plant",
    "PrescribedHand",
    "Resonance",
    "Run",
    "Servo",
    "SpringHand",
    "Stationary",
    "Stroke",
    "Strokes",
    "Waypoints",
    "find_onset",
    "scan_strokes",
    "simulate",
    "simulate_many",
]

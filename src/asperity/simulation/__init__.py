"""Texture, device and hand in one loop, with the energy accounted for exactly."""

from asperity.simulation.hands import BandHand, Hand, MovedHand, SpringHand
from asperity.simulation.motions import Motion, Path, Still, Strokes
from asperity.simulation.onset import Onset, find_onset
from asperity.simulation.plants import Cartesian, LinkMasses, Pantograph, Plant, Resonance
from asperity.simulation.run import Ledger, Run
from asperity.simulation.scan import Stroke, scan_strokes
from asperity.simulation.servo import Servo
from asperity.simulation.simulate import simulate, simulate_many

__all__ = [
    "BandHand",
    "Cartesian",
    "Hand",
    "Ledger",
    "LinkMasses",
    "Motion",
    "MovedHand",
    "Onset",
    "Pantograph",
    "Path",
    "Plant",
    "Resonance",
    "Run",
    "Servo",
    "SpringHand",
    "Still",
    "Stroke",
    "Strokes",
    "find_onset",
    "scan_strokes",
    "simulate",
    "simulate_many",
]

"""Section V.B: the energy of a stroke by the exact ledger and by the paper's sum."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from asperity.core.checks import FloatArray
from asperity.core.files import Serializable
from asperity.paper.experiments.experiment_setups import (
    ALL_LAWS,
    GUESSED_HANDS,
    HANDS,
    SPEEDS,
    TRACE_STRIDE,
    stroke_setup,
)
from asperity.scene.sweeps import map_threads
from asperity.simulation import Strokes
from asperity.simulation.scan import Stroke, scan_strokes

FIGURE_6_LAWS = "AGDFH"  # figure 6, and law H


@dataclass(frozen=True)
class HandStroke:
    """Energy per stroke with one hand at one speed.

    Attributes:
        hand: name of the hand.
        stroke: its energies.
    """

    hand: str
    stroke: Stroke

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {"hand": self.hand} | self.stroke.to_dict()


@dataclass(frozen=True)
class EnergyTrace:
    """A panel of figure 6: energy supplied to the hand over one stroke.

    Attributes:
        law: letter.
        time: [s], shape (n,).
        exact: work of the held force along the true motion, x and z [J], shape (n, 2).
        paper: the paper's sum of force times step of the same sample, x and z [J], shape (n, 2).
    """

    law: str
    time: FloatArray
    exact: FloatArray
    paper: FloatArray


@dataclass(frozen=True)
class ScanningExperiment(Serializable):
    """Section V.B.

    Attributes:
        strokes: energies by law, hand and speed.
        traces: the first stroke of the first hand at 0.1 m/s.
        guessed: assumptions that the paper does not state.
    """

    serialized_attributes = "strokes guessed"

    strokes: tuple[HandStroke, ...]
    traces: tuple[EnergyTrace, ...]
    guessed: tuple[str, ...] = GUESSED_HANDS

    def strokes_of(self, law: str) -> tuple[Stroke, ...]:
        """Return the strokes of a law for all hands and speeds."""
        return tuple(one.stroke for one in self.strokes if one.stroke.law == law)


@lru_cache(maxsize=128)
def _simulate_stroke(law: str, hand: str, speed: float) -> HandStroke:
    setup = stroke_setup(law, hand, speed)
    assert isinstance(setup.motion, Strokes)
    depth = -setup.motion.start[2]
    loop = setup.surface, setup.plant, setup.hand, setup.servo, setup.motion
    (stroke,) = scan_strokes(*loop, speeds=[speed], depths=[depth])
    return HandStroke(hand, stroke)


@lru_cache(maxsize=16)
def energy_trace(law: str) -> EnergyTrace:
    """Return the energies of the first stroke, of about a second, as in figure 6."""
    setup = stroke_setup(law)
    assert isinstance(setup.motion, Strokes)
    run = setup.simulate()
    traced = slice(0, round(setup.motion.period / run.period), TRACE_STRIDE)
    exact, paper = (run.energies[name][traced][:, [0, 2]] for name in ("supplied", "same_sample"))
    return EnergyTrace(law, run.time[traced], exact, paper)


def scanning_experiment(laws: str = ALL_LAWS) -> ScanningExperiment:
    """Simulate section V.B for every hand and speed."""
    jobs = [(law, hand, speed) for law in laws for hand in HANDS for speed in SPEEDS]
    traces = map_threads(energy_trace, [(law,) for law in FIGURE_6_LAWS if law in laws])
    return ScanningExperiment(map_threads(_simulate_stroke, jobs), traces)

"""Section V.B: the energy of a stroke, by the exact ledger and by the paper's own sum."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from asperity.checks import FloatArray
from asperity.files import Record
from asperity.paper.experiments.settings import HANDS, HANDS_GUESSED, LETTERS, SPEEDS, stroke_setup
from asperity.scene.sweeps import side_by_side
from asperity.simulation import Strokes
from asperity.simulation.scan import Stroke, scan_strokes

SHOWN = "AGDFH"  # figure 6, and law H
_EVERY = 10


@dataclass(frozen=True)
class HandStroke:
    """Energy per stroke with one hand at one speed.

    Attributes:
        hand: its name.
        stroke: the energies.
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
        exact: work of the held force on the true motion, x and z [J], shape (n, 2).
        paper: the paper's sum, force and step of the same sample, x and z [J], shape (n, 2).
    """

    law: str
    time: FloatArray
    exact: FloatArray
    paper: FloatArray


@dataclass(frozen=True)
class ScanningExperiment(Record):
    """Section V.B.

    Attributes:
        strokes: by law, hand and speed.
        traces: the first stroke of the first hand at 0.1 m/s.
        guessed: what the paper does not state.
    """

    written = "strokes guessed"

    strokes: tuple[HandStroke, ...]
    traces: tuple[EnergyTrace, ...]
    guessed: tuple[str, ...] = HANDS_GUESSED

    def of(self, law: str) -> tuple[Stroke, ...]:
        """Return a law's strokes, all hands and speeds."""
        return tuple(one.stroke for one in self.strokes if one.stroke.law == law)


@lru_cache(maxsize=128)
def _stroke(law: str, hand: str, speed: float) -> HandStroke:
    setup = stroke_setup(law, hand, speed)
    assert isinstance(setup.motion, Strokes)
    depth = -setup.motion.start[2]
    (found,) = scan_strokes(
        setup.surface, setup.plant, setup.hand, setup.servo, setup.motion, speeds=[speed],
        depths=[depth],
    )  # fmt: skip
    return HandStroke(hand, found)


@lru_cache(maxsize=16)
def energy_trace(law: str) -> EnergyTrace:
    """Return the energies of the first stroke of about a second, as in figure 6."""
    setup = stroke_setup(law)
    assert isinstance(setup.motion, Strokes)
    run = setup.simulate()
    shown = slice(0, round(setup.motion.period / run.period), _EVERY)
    energies, axes = run.energies, [0, 2]
    return EnergyTrace(
        law, run.time[shown], energies["supplied"][shown][:, axes],
        energies["same_sample"][shown][:, axes],
    )  # fmt: skip


def scanning_experiment(laws: str = LETTERS) -> ScanningExperiment:
    """Return section V.B for every hand and speed."""
    jobs = [(law, hand, speed) for law in laws for hand in HANDS for speed in SPEEDS]
    traces = side_by_side(energy_trace, [(law,) for law in SHOWN if law in laws])
    return ScanningExperiment(side_by_side(_stroke, jobs), traces)

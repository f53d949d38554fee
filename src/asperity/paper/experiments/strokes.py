"""Strokes of section V: their energy (V.B), and a bump of 20 mm and back (V.C)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.files import Serializable
from asperity.paper.experiments import experiment_setups as setups
from asperity.scene.sweeps import map_threads
from asperity.simulation import Strokes
from asperity.simulation.scan import Stroke, scan_strokes

BUMP_LAWS = "ABDEH"
_WINDOW = 200  # samples, 20 ms


@dataclass(frozen=True)
class BumpRun(Serializable):
    """One stroke over the bump and back.

    Attributes:
        law: letter.
        entry: name of the hand and its path.
        energy: energy supplied along x and z [J].
        lost: number of times contact was lost.
        jump: greatest energy supplied within 20 ms [J].
        top: greatest height of the handle [m].
        closure: residual of the energy balance over the energy exchanged [1].
        time: [s], shape (n,).
        x: position of the handle [m], shape (n,).
        z: position of the handle [m], shape (n,).
        supplied: energy supplied so far, all axes [J], shape (n,).
        stopped: reason for which the run ended early; empty if it did not.
    """

    serialized_attributes = "law entry energy lost jump top closure stopped"

    law: str
    entry: str
    energy: tuple[float, float]
    lost: int
    jump: float
    top: float
    closure: float
    time: FloatArray
    x: FloatArray
    z: FloatArray
    supplied: FloatArray
    stopped: str

    @property
    def total(self) -> float:
        """Energy supplied [J]."""
        return float(sum(self.energy))


@dataclass(frozen=True)
class BumpExperiment(Serializable):
    """Section V.C.

    Attributes:
        bumps: by entry and law.
        guessed: assumptions that the paper does not state.
    """

    bumps: tuple[BumpRun, ...]
    guessed: tuple[str, ...] = setups.GUESSED_BUMP


@lru_cache(maxsize=16)
def simulate_bump(law: str, entry: str) -> BumpRun:
    """Simulate a hand that moves over the bump and back."""
    run = setups.bump_setup(law, entry).simulate()
    contact = np.any(run.applied != 0.0, axis=1)
    summed = run.energies["supplied"].sum(axis=1)
    window = min(_WINDOW, len(summed) - 1)
    x, _y, z = run.ledger.supplied
    traced = slice(None, None, setups.TRACE_STRIDE)
    return BumpRun(
        law=law,
        entry=entry,
        energy=(x, z),
        lost=int(np.count_nonzero(contact[:-1] & ~contact[1:])),
        jump=float((summed[window:] - summed[:-window]).max()),
        top=float(run.position[:, 2].max()),
        closure=abs(run.ledger.closure) / max(run.ledger.exchanged, 1e-300),
        time=run.time[traced],
        x=run.position[traced, 0],
        z=run.position[traced, 2],
        supplied=summed[traced],
        stopped=run.stop_message,
    )


def bump_experiment(laws: str = BUMP_LAWS) -> BumpExperiment:
    """Simulate section V.C for both entries."""
    jobs = [(law, entry) for entry in setups.ENTRIES for law in laws]
    return BumpExperiment(map_threads(simulate_bump, jobs))


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
    guessed: tuple[str, ...] = setups.GUESSED_HANDS

    def strokes_of(self, law: str) -> tuple[Stroke, ...]:
        """Return the strokes of a law for all hands and speeds."""
        return tuple(one.stroke for one in self.strokes if one.stroke.law == law)


@lru_cache(maxsize=128)
def _simulate_stroke(law: str, hand: str, speed: float) -> HandStroke:
    setup = setups.stroke_setup(law, hand, speed)
    assert isinstance(setup.motion, Strokes)
    depth = -setup.motion.start[2]
    loop = setup.surface, setup.plant, setup.hand, setup.servo, setup.motion
    (stroke,) = scan_strokes(*loop, speeds=[speed], depths=[depth])
    return HandStroke(hand, stroke)


@lru_cache(maxsize=16)
def energy_trace(law: str) -> EnergyTrace:
    """Return the energies of the first stroke, of about a second, as in figure 6."""
    setup = setups.stroke_setup(law)
    assert isinstance(setup.motion, Strokes)
    run = setup.simulate()
    traced = slice(0, round(setup.motion.period / run.period), setups.TRACE_STRIDE)
    exact, paper = (run.energies[name][traced][:, [0, 2]] for name in ("supplied", "same_sample"))
    return EnergyTrace(law, run.time[traced], exact, paper)


def scanning_experiment(laws: str = setups.ALL_LAWS) -> ScanningExperiment:
    """Simulate section V.B for every hand and speed."""
    jobs = [(law, hand, speed) for law in laws for hand in setups.HANDS for speed in setups.SPEEDS]
    traces = map_threads(energy_trace, [(law,) for law in FIGURE_6_LAWS if law in laws])
    return ScanningExperiment(map_threads(_simulate_stroke, jobs), traces)

"""The simulated experiments: strokes (V.B), a bump of 20 mm and back (V.C), and all together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.files import OMITTED, Serializable, to_plain_data
from asperity.paper.cases import MENDED
from asperity.paper.cycle_experiments import (
    ALL_LAWS,
    ENTRIES,
    GUESSED_BUMP,
    GUESSED_HANDS,
    HANDS,
    SPEEDS,
    TRACE_STRIDE,
    DeviceExperiment,
    PassivityExperiment,
    bump_setup,
    device_experiment,
    passivity_experiment,
    stroke_setup,
)
from asperity.scene.sweeps import map_threads
from asperity.simulation import Strokes
from asperity.simulation.scan import Stroke, scan_strokes
from asperity.textures.texture import Texture

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
        stopped: reason for which the run ended early; empty if it did not.
        time: [s], shape (n,).
        x: position of the handle [m], shape (n,).
        z: position of the handle [m], shape (n,).
        supplied: energy supplied so far, all axes [J], shape (n,).
    """

    law: str
    entry: str
    energy: tuple[float, float]
    lost: int
    jump: float
    top: float
    closure: float
    stopped: str
    time: FloatArray = field(metadata=OMITTED)
    x: FloatArray = field(metadata=OMITTED)
    z: FloatArray = field(metadata=OMITTED)
    supplied: FloatArray = field(metadata=OMITTED)

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
    guessed: tuple[str, ...] = GUESSED_BUMP


@lru_cache(maxsize=16)
def simulate_bump(law: str, entry: str) -> BumpRun:
    """Simulate a hand that moves over the bump and back."""
    run = bump_setup(law, entry).simulate()
    contact = np.any(run.applied != 0.0, axis=1)
    summed = run.energies["supplied"].sum(axis=1)
    window = min(_WINDOW, len(summed) - 1)
    x, _y, z = run.ledger.supplied
    traced = slice(None, None, TRACE_STRIDE)
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
    jobs = [(law, entry) for entry in ENTRIES for law in laws]
    return BumpExperiment(map_threads(simulate_bump, jobs))


FIGURE_6_LAWS = (*"AGDFH", MENDED)  # figure 6, law H, and law F mended


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
        law: letter, or ``MENDED``.
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

    strokes: tuple[HandStroke, ...]
    traces: tuple[EnergyTrace, ...] = field(metadata=OMITTED)
    guessed: tuple[str, ...] = GUESSED_HANDS

    def strokes_of(self, law: str) -> tuple[Stroke, ...]:
        """Return the strokes of a law for all hands and speeds."""
        return tuple([done.stroke for done in self.strokes if done.stroke.law == law])


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
    exact = run.energies["supplied"][traced][:, [0, 2]]
    paper = run.energies["same_sample"][traced][:, [0, 2]]
    return EnergyTrace(law, run.time[traced], exact, paper)


def scanning_experiment(laws: str = ALL_LAWS) -> ScanningExperiment:
    """Simulate section V.B for every hand and speed."""
    jobs = [(law, hand, speed) for law in laws for hand in HANDS for speed in SPEEDS]
    traces = map_threads(energy_trace, [(law,) for law in FIGURE_6_LAWS if law[0] in laws])
    return ScanningExperiment(map_threads(_simulate_stroke, jobs), traces)


STEPS = (
    "experiment V.A: limit cycles",
    "experiment V.B: energy per stroke",
    "experiment V.C: the bump",
    "further devices and surfaces",
)


@dataclass(frozen=True)
class Experiments:
    """Results of the simulated experiments.

    Attributes:
        passivity: section V.A, with the onsets of all laws.
        scanning: section V.B.
        bump: section V.C.
        devices: further devices and surfaces.
    """

    passivity: PassivityExperiment
    scanning: ScanningExperiment
    bump: BumpExperiment
    devices: DeviceExperiment

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {
            "V.A": to_plain_data(self.passivity),
            "V.B": to_plain_data(self.scanning),
            "V.C": to_plain_data(self.bump),
            "beyond": to_plain_data(self.devices),
        }


def run_experiments(
    measured_texture: Texture | None = None, progress: Callable[[str], None] | None = None
) -> Experiments:
    """Run all experiments; this takes one to three minutes on two cores.

    Args:
        measured_texture: a surface for the last one; by default a synthetic one.
        progress: called with the name of each step when it starts.
    """
    report = progress or (lambda _step: None)
    report(STEPS[0])
    passivity = passivity_experiment()
    report(STEPS[1])
    scanning = scanning_experiment()
    report(STEPS[2])
    bump = bump_experiment()
    report(STEPS[3])
    return Experiments(passivity, scanning, bump, device_experiment(measured_texture))

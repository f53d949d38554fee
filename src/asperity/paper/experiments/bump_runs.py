"""Section V.C: a stroke over a bump of 20 mm and back."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.files import Serializable
from asperity.paper.experiments.experiment_setups import (
    ENTRIES,
    GUESSED_BUMP,
    TRACE_STRIDE,
    bump_setup,
)
from asperity.scene.sweeps import map_threads

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
    guessed: tuple[str, ...] = GUESSED_BUMP

    def runs_of(self, law: str) -> tuple[BumpRun, ...]:
        """Return the runs of a law for all entries."""
        return tuple(one for one in self.bumps if one.law == law)


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

"""Section V.C: over a bump of 20 mm, where what a law does to the hand can be seen."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from asperity.checks import FloatArray
from asperity.files import Record
from asperity.paper.experiments.settings import BUMP_GUESSED, ENTRIES, bump_setup
from asperity.scene.sweeps import side_by_side

LAWS = "ABDEH"
_WINDOW = 200  # samples, 20 ms
_EVERY = 10


@dataclass(frozen=True)
class Bump(Record):
    """Once over the bump and back.

    Attributes:
        law: letter.
        entry: name of the hand and its way.
        energy: supplied along x and z [J].
        lost: how often contact ended.
        jump: greatest energy supplied within 20 ms [J].
        top: greatest height that the handle got to [m].
        closure: energy that does not add up, over what was exchanged [1].
        time: [s], shape (n,).
        x: of the handle [m], shape (n,).
        z: of the handle [m], shape (n,).
        supplied: energy up to then, all axes [J], shape (n,).
        stopped: why the run ended early; empty if it did not.
    """

    written = "law entry energy lost jump top closure stopped"

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
class BumpExperiment(Record):
    """Section V.C.

    Attributes:
        bumps: by entry and law.
        guessed: what the paper does not state.
    """

    bumps: tuple[Bump, ...]
    guessed: tuple[str, ...] = BUMP_GUESSED

    def of(self, law: str) -> tuple[Bump, ...]:
        """Return a law's runs, all entries."""
        return tuple(one for one in self.bumps if one.law == law)


@lru_cache(maxsize=16)
def over_bump(law: str, entry: str) -> Bump:
    """Return what happens to a hand that goes over the bump and back."""
    run = bump_setup(law, entry).simulate()
    contact = np.any(run.applied != 0.0, axis=1)
    summed = run.energies["supplied"].sum(axis=1)
    window = min(_WINDOW, len(summed) - 1)
    x, _y, z = run.ledger.supplied
    shown = slice(None, None, _EVERY)
    return Bump(
        law=law,
        entry=entry,
        energy=(x, z),
        lost=int(np.count_nonzero(contact[:-1] & ~contact[1:])),
        jump=float((summed[window:] - summed[:-window]).max()),
        top=float(run.position[:, 2].max()),
        closure=abs(run.ledger.closure) / max(run.ledger.exchanged, 1e-300),
        time=run.time[shown],
        x=run.position[shown, 0],
        z=run.position[shown, 2],
        supplied=summed[shown],
        stopped=run.stopped,
    )


def bump_experiment(laws: str = LAWS) -> BumpExperiment:
    """Return section V.C for both entries."""
    jobs = [(law, entry) for entry in ENTRIES for law in laws]
    return BumpExperiment(side_by_side(over_bump, jobs))

"""One run that goes on: to one time after another, nothing computed twice."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from asperity.checks import positive
from asperity.simulation.hands import Hand
from asperity.simulation.motions import Motion
from asperity.simulation.plants import Plant
from asperity.simulation.run import Stop, WatchedRun
from asperity.simulation.servo import Servo
from asperity.simulation.simulate import (
    CHUNK,
    anchor_points,
    check_parts,
    left_at,
    loop_of,
    whole_samples,
)
from asperity.simulation.trace import WATCHED
from asperity.surface import Surface


class Continued:
    """A run that is asked for one duration after another, each at least as long as the last.

    What it returns is bit for bit what :func:`~asperity.simulation.simulate` does, with fewer
    columns of the trace; a longer duration only costs what is new of it.

    Args:
        surface: as for :func:`~asperity.simulation.simulate`, like all that follows.
        plant: likewise.
        hand: likewise.
        servo: likewise.
        motion: likewise.
        start: likewise.
        velocity: likewise.

    Raises:
        ParameterError: for parts that do not fit together.
    """

    def __init__(
        self,
        surface: Surface,
        plant: Plant,
        hand: Hand,
        servo: Servo,
        motion: Motion,
        start: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
    ) -> None:
        check_parts(surface, plant, hand, servo, motion)
        self._parts = surface, plant, servo, motion
        self._loop = loop_of(surface, plant, hand, servo, motion, start, velocity)
        self._table = np.empty((0, len(WATCHED)))
        self._rows, self._stop = 0, Stop.NOTHING

    def __call__(self, duration: float) -> WatchedRun:
        """Return the run up to a time after its beginning [s].

        Raises:
            ParameterError: for a duration that cannot be used, or a motion that is not finite.
        """
        surface, plant, servo, motion = self._parts
        samples = whole_samples(positive("duration", duration, "s"), servo.period)
        table = np.empty((max(samples, self._rows), len(WATCHED)))
        table[: self._rows] = self._table[: self._rows]
        self._table = table
        while self._loop.samples < samples and not self._stop:
            first = self._loop.samples
            last = min(first + CHUNK, samples)
            anchor = anchor_points(motion, servo.period, plant, first, last)
            self._stop = self._loop.run(anchor, table[self._rows :])
            self._rows += self._loop.rows
        short, gap = self._loop.uncertain
        return WatchedRun(
            table[: self._rows], self._loop.state.copy(), self._loop.samples, float(servo.period),
            self._loop.ledger(), surface, self._stop,
            left_at(self._stop, self._loop.state, plant), notes=plant.notes, short=short, gap=gap,
        )  # fmt: skip

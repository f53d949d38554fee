"""Runs of one loop from several starts, side by side, that go on: nothing is computed twice."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from asperity.checks import positive
from asperity.errors import ParameterError
from asperity.simulation.hands import Hand
from asperity.simulation.kernels.body_functions import LANES
from asperity.simulation.loop import run_together
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


class Together:
    """Runs that are asked for one duration after another, each at least as long as the last.

    Each is bit for bit what :func:`~asperity.simulation.simulate` returns, with fewer columns of
    the trace; a longer duration only costs what is new of it. There are at most ``LANES`` of them,
    which on a pantograph take hardly more time than one.

    Args:
        surface: as for :func:`~asperity.simulation.simulate`, like plant, hand and servo.
        plant: likewise.
        hand: likewise.
        servo: likewise.
        motions: of the hand's anchor, one a run.
        starts: of the handle [m], one a run; ``None`` where the motion begins.
        velocity: of the handle at the start [m/s], shape (3,), of all runs; default: none.

    Raises:
        ParameterError: for parts that do not fit together, or more than ``LANES`` motions.
    """

    def __init__(
        self,
        surface: Surface,
        plant: Plant,
        hand: Hand,
        servo: Servo,
        motions: Sequence[Motion],
        starts: Sequence[ArrayLike | None],
        velocity: ArrayLike | None = None,
    ) -> None:
        if len(motions) > LANES:
            raise ParameterError("motions", f"must be at most {LANES}", len(motions))
        for motion in motions:
            check_parts(surface, plant, hand, servo, motion)
        self._parts = surface, plant, servo
        self._motions = motions
        self._loops = [
            loop_of(surface, plant, hand, servo, motion, start, velocity)
            for motion, start in zip(motions, starts, strict=True)
        ]
        self._table = np.empty((len(motions), 0, len(WATCHED)))
        self._rows = [0 for _ in motions]
        self._stops = [Stop.NOTHING for _ in motions]

    def __call__(self, duration: float, which: Sequence[int] | None = None) -> list[WatchedRun]:
        """Return runs up to a time after their beginning [s].

        Args:
            duration: up to when.
            which: numbers of the runs; default: all.

        Raises:
            ParameterError: for a duration that cannot be used, or a motion that is not finite.
        """
        samples = whole_samples(positive("duration", duration, "s"), self._parts[2].period)
        asked = range(len(self._loops)) if which is None else which
        if samples > self._table.shape[1]:
            table = np.empty((len(self._loops), samples, len(WATCHED)))
            for run, rows in enumerate(self._rows):
                table[run, :rows] = self._table[run, :rows]
            self._table = table
        while behind := [run for run in asked if self._goes(run, samples)]:
            first = min(self._loops[run].samples for run in behind)
            self._go([run for run in behind if self._loops[run].samples == first], first, samples)
        return [self._run(run) for run in asked]

    def _goes(self, run: int, samples: int) -> bool:
        return not self._stops[run] and self._loops[run].samples < samples

    def _go(self, runs: Sequence[int], first: int, samples: int) -> None:
        """Run those that have come as far as a sample, up to another one at most."""
        _surface, plant, servo = self._parts
        last = min(first + CHUNK, samples)
        anchors = np.zeros((len(self._loops), last - first + 1, 3))
        for run in runs:
            anchors[run] = anchor_points(self._motions[run], servo.period, plant, first, last)
        going = [run in runs for run in range(len(self._loops))]
        stops = run_together(self._loops, going, anchors, self._table)
        for run in runs:
            self._stops[run] = stops[run]
            self._rows[run] += self._loops[run].rows

    def _run(self, run: int) -> WatchedRun:
        surface, plant, servo = self._parts
        loop, stop = self._loops[run], self._stops[run]
        short, gap = loop.uncertain
        return WatchedRun(
            self._table[run, : self._rows[run]], loop.state.copy(), loop.samples,
            float(servo.period), loop.ledger(), surface, stop, left_at(stop, loop.state, plant),
            notes=plant.notes, short=short, gap=gap,
        )  # fmt: skip

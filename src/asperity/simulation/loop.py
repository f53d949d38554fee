"""The closed loop: a law rendered by a sampled servo on a body that a hand moves."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from types import ModuleType

import numpy as np

from asperity.checks import FloatArray
from asperity.contacts.memory import SHORT, WORST, new_memory
from asperity.errors import ParameterError
from asperity.kernels.probe import ClampName
from asperity.kernels.tick import ServoState
from asperity.laws import Law
from asperity.simulation.kernels import one_by_one, servo_loop, side_by_side
from asperity.simulation.kernels.body_functions import SAMPLES, STOP
from asperity.simulation.kernels.booking import SUMS
from asperity.simulation.kernels.servo_loop import LoopState
from asperity.simulation.run import Ledger, Stop
from asperity.simulation.sampled_plant import SampledPlant
from asperity.simulation.servo import Servo
from asperity.simulation.trace import COLUMNS
from asperity.surface import Surface

# Why the compiled loop stops, by its answer.
STOPS = tuple(Stop)
# Forces that may wait: a second at a megahertz.
MOST_DELAY = 1_000_000


@lru_cache(maxsize=256)
def _fused(
    law: Law, sampler: tuple[ModuleType, ...], clamp: ClampName, body: tuple[ModuleType, ...]
) -> ModuleType:
    from asperity.kernels import tick
    from asperity.kernels.fuse import fuse_on_texture

    return fuse_on_texture(law, sampler, clamp, (servo_loop,), (tick, *body))


@lru_cache(maxsize=256)
def _fused_lanes(
    law: Law, sampler: tuple[ModuleType, ...], clamp: ClampName, body: tuple[ModuleType, ...]
) -> ModuleType:
    from asperity.kernels import tick
    from asperity.kernels.fuse import fuse_on_texture

    further = (tick, servo_loop, *body, one_by_one)
    return fuse_on_texture(law, sampler, clamp, (side_by_side,), further)


class Simulation:
    """A surface on a body with a servo; runs sample after sample from where it stopped.

    Args:
        surface: the surface; its stiffness is what is rendered.
        plant: the device and the hand that holds it.
        servo: the servo.
        start: position [m], shape (3,).
        velocity: [m/s], shape (3,).
        looks: evaluations of the surface that a tick may take in its search for nearest points;
            default: as many as the law's contact says. More of them take longer, and leave fewer
            ticks whose answer is not certain.

    Attributes:
        memory: what that search remembers, see :mod:`asperity.contacts.memory`.

    Raises:
        ParameterError: for a delay of more than ``MOST_DELAY`` samples.
    """

    def __init__(
        self,
        surface: Surface,
        plant: SampledPlant,
        servo: Servo,
        start: FloatArray,
        velocity: FloatArray | None = None,
        looks: float | None = None,
    ) -> None:
        if servo.delay > MOST_DELAY:
            raise ParameterError("delay", f"must be at most {MOST_DELAY} samples", servo.delay)
        self._plant, self._servo = plant, servo
        self.state = plant.state(start, np.zeros(3) if velocity is None else velocity)
        self.queue = np.zeros((servo.delay + 1, 3))
        self.memory = new_memory(surface.law.contact.looks if looks is None else looks)
        self._loop, self._ledger = LoopState(), np.zeros(SUMS)
        self._before = 0.0
        self._code = surface.law, surface.texture.sampler, surface.acting_clamp, plant.modules
        self._arguments = surface.texture.arguments, surface.law_arguments

    @property
    def samples(self) -> int:
        """Samples done."""
        return self._loop.samples

    @property
    def _loops(self) -> ModuleType:
        return _fused(*self._code)

    def stored(self, anchor: FloatArray) -> float:
        """Return the stored energy [J] with the hand's anchor at a place [m]."""
        return float(self._loops.stored_batch(self.state, anchor, self._plant.record))

    def run(self, anchor: FloatArray, trace: FloatArray | None = None, every: int = 1) -> Stop:
        """Run one sample for each row of the anchor's motion but the last.

        Args:
            anchor: positions of the hand's anchor at the samples [m], shape (k + 1, 3), contiguous;
                it moves at constant velocity in between. The first row is where it is now.
            trace: rows to write, shape (at least k/every + 1, columns); none for no trace.
            every: samples per row.

        Returns:
            What stopped it before the end.

        Raises:
            ParameterError: for a trace whose rows are of another length.
        """
        if self.samples == 0:
            self._before = self.stored(anchor[0])
        table = np.empty((0, len(COLUMNS))) if trace is None else trace
        if table.ndim != 2 or table.shape[1] != len(COLUMNS):
            words = f"must have rows of {len(COLUMNS)} numbers, got shape {table.shape}"
            raise ParameterError("trace", words)
        first = self.samples
        stop, self.rows, self._loop = self._loops.servo_batch(
            self.state, self.queue, self._loop, self._ledger, anchor, self._plant.record,
            self._servo.settings, self.memory, *self._arguments, table, every,
        )  # fmt: skip
        self._anchor = anchor[self.samples - first].copy()
        return STOPS[int(stop)]

    @property
    def sums(self) -> FloatArray:
        """Sums of the ledger since the beginning, see ``kernels/booking.py``."""
        return self._ledger

    @property
    def uncertain(self) -> tuple[int, float]:
        """Ticks in which the search used up its looks, and the greatest gap that it left [m]."""
        return int(self.memory[SHORT]), float(self.memory[WORST])

    def ledger(self) -> Ledger:
        """Return the energies since the beginning."""
        return Ledger.of(self._ledger, self._before, self.stored(self._anchor))


def run_together(
    loops: Sequence[Simulation], going: Sequence[bool], anchors: FloatArray, tables: FloatArray
) -> list[Stop]:
    """Run several loops over the same samples, each as :meth:`Simulation.run` does, bit for bit.

    Args:
        loops: at most ``LANES``, of the same surface, body and servo.
        going: which of them run; they have come equally far.
        anchors: positions of the hands' anchors at the samples [m], shape (n, k + 1, 3).
        tables: traces with the columns of ``WATCHED``, shape (n, samples, 9); the rows of these
            samples are written.

    Returns:
        What stopped each before the end.
    """
    names = ("state", "queue", "memory", "_ledger")
    state, queue, memory, ledger = (
        np.array([getattr(loop, name) for loop in loops]) for name in names
    )
    carried = np.array([loop._loop.servo for loop in loops], dtype=np.float64)
    told = np.array(
        [[0 if go else -1, loop.samples] for loop, go in zip(loops, going, strict=True)]
    )
    run = [i for i, go in enumerate(going) if go]
    first = loops[run[0]]
    done = first.samples
    for i in run:
        if done == 0:
            loops[i]._before = loops[i].stored(anchors[i, 0])
    _fused_lanes(*first._code).servo_lanes(
        state, queue, carried, done, ledger, anchors, first._plant.record,
        first._servo.settings, memory, *first._arguments, tables, told,
    )  # fmt: skip
    stops = [STOPS[max(int(stop), 0)] for stop in told[:, STOP]]
    for i in run:
        loop = loops[i]
        for name, rows in zip(names, (state, queue, memory, ledger), strict=True):
            getattr(loop, name)[:] = rows[i]
        samples = int(told[i, SAMPLES])
        loop.rows = samples - done + (stops[i] is Stop.LEFT)
        loop._anchor = anchors[i, samples - done].copy()
        numbers = dict(zip(ServoState._fields, map(float, carried[i]), strict=True))
        held = numbers.pop("held") > 0.0
        loop._loop = LoopState(ServoState(**numbers, held=held), samples % len(loop.queue), samples)
    return stops

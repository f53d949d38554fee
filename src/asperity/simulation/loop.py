"""The closed loop: a law rendered by a sampled servo on a body that a hand moves."""

from __future__ import annotations

from functools import lru_cache
from types import ModuleType

import numpy as np

from asperity.checks import FloatArray
from asperity.contacts.memory import SHORT, WORST, new_memory
from asperity.errors import ParameterError
from asperity.kernels.probe import ClampName
from asperity.laws import Law
from asperity.simulation.kernels import servo_loop
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


def checked_delay(delay: int) -> int:
    """Return a delay [samples].

    Raises:
        ParameterError: for one of more than ``MOST_DELAY``.
    """
    if delay > MOST_DELAY:
        raise ParameterError("delay", f"must be at most {MOST_DELAY} samples", delay)
    return delay


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
        self._plant, self._servo = plant, servo
        self.state = plant.state(start, np.zeros(3) if velocity is None else velocity)
        self.queue = np.zeros((checked_delay(servo.delay) + 1, 3))
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

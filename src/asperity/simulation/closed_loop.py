"""The closed loop: a law rendered by a sampled servo on a body that a hand moves."""

from __future__ import annotations

from types import ModuleType

import numpy as np

from asperity.contacts.warm_start import MAX_ERROR_BOUND, TRUNCATED_TICKS, new_warm_start
from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.loop import no_guards, servo_loop
from asperity.loop.interface import LoopState
from asperity.loop.loop_program import fuse_loop
from asperity.simulation.kernels import energy_trace, simulated_device
from asperity.simulation.kernels.body_interface import LEFT_WORKSPACE
from asperity.simulation.kernels.energy_ledger import LEDGER_SIZE
from asperity.simulation.kernels.energy_trace import TraceRows
from asperity.simulation.kernels.simulated_device import SimulatedDevice
from asperity.simulation.plants import SampledPlant
from asperity.simulation.servo import Servo
from asperity.simulation.trace import COLUMNS, Ledger, StopReason
from asperity.surface import Surface

# Why the compiled loop stops, by its error code.
STOP_REASONS = tuple(StopReason)
# Largest delay [samples]: a second at a megahertz.
MAX_DELAY = 1_000_000


def check_delay(delay: int) -> int:
    """Return a delay [samples].

    Raises:
        ParameterError: for a delay of more than ``MAX_DELAY``.
    """
    if delay > MAX_DELAY:
        raise ParameterError("delay", f"must be at most {MAX_DELAY} samples", delay)
    return delay


class Simulation:
    """A surface on a body with a servo, run chunk by chunk.

    Args:
        surface: the surface, rendered at its stiffness.
        plant: the device and the hand that holds it.
        servo: the servo.
        start: position [m], shape (3,).
        velocity: [m/s], shape (3,); default: at rest.
        max_evaluations: evaluation budget of a tick in its search for closest points; default: that
            of the law's contact. A larger budget takes longer, and truncates fewer searches.

    Attributes:
        memory: warm start of that search, see :mod:`asperity.contacts.warm_start`.
        samples: samples done.

    Raises:
        ParameterError: for a delay of more than ``MAX_DELAY`` samples.
    """

    def __init__(
        self, surface: Surface, plant: SampledPlant, servo: Servo, start: FloatArray,
        velocity: FloatArray | None = None, max_evaluations: float | None = None,
    ) -> None:  # fmt: skip
        self._plant, self._servo, self._surface = plant, servo, surface
        self.state = plant.initial_state(start, np.zeros(3) if velocity is None else velocity)
        self.queue = np.zeros((check_delay(servo.delay) + 1, 3))
        budget = surface.law.contact.max_evaluations
        self.memory = new_warm_start(budget if max_evaluations is None else max_evaluations)
        self.samples, self._counters = 0, np.zeros(3, np.int64)
        self._loop_state, self._ledger = LoopState(), np.zeros(LEDGER_SIZE)
        self._energy_at_start = 0.0

    @property
    def _kernels(self) -> ModuleType:
        surface = self._surface
        return fuse_loop(
            surface.law, surface.texture.sampler, surface.effective_clamp,
            servo_loop, energy_trace, no_guards, simulated_device, *self._plant.modules,
        )  # fmt: skip

    def stored_energy(self, anchor: FloatArray) -> float:
        """Return the stored energy [J] with the hand's anchor at a position [m]."""
        return float(self._kernels.stored_energy_at(self.state, anchor, self._plant.record))

    def run(
        self, anchor: FloatArray, trace: FloatArray | None = None, every: int = 1
    ) -> StopReason:
        """Run one sample for each row of the anchor's motion but the last.

        Args:
            anchor: positions of the hand's anchor at the samples [m], shape (k + 1, 3), contiguous;
                it moves at constant velocity in between. The first row is its current position.
            trace: rows to write, shape (at least k/every + 1, columns); none for no trace.
            every: samples per row.

        Returns:
            Why the run stopped before the end.

        Raises:
            ParameterError: for a trace whose rows have another length.
        """
        if self.samples == 0:
            self._energy_at_start = self.stored_energy(anchor[0])
        table = np.empty((0, len(COLUMNS))) if trace is None else trace
        if table.ndim != 2 or table.shape[1] != len(COLUMNS):
            words = f"must have rows of {len(COLUMNS)} numbers, got shape {table.shape}"
            raise ParameterError("trace", words)
        first, surface = self.samples, self._surface
        self._counters[2] = first
        device = SimulatedDevice(
            self.state, self.queue, self._counters, anchor, self._ledger, 1.0 / self._servo.period,
            self._plant.record,
        )  # fmt: skip
        rows = TraceRows(table, np.array([0, -first % every]), every)
        _cause, stop, self._loop_state = self._kernels.servo_loop(
            self._loop_state, first + len(anchor) - 1, self._servo.settings, (), (), device, rows,
            self.memory, surface.texture.arguments, surface.law_arguments,
        )  # fmt: skip
        self.rows_written = int(rows.counters[0])
        # The sample in which a body leaves its workspace is not done.
        self.samples = self._loop_state.timing.sample - (stop == LEFT_WORKSPACE)
        self._anchor = anchor[self.samples - first].copy()
        return STOP_REASONS[int(stop)]

    @property
    def ledger_sums(self) -> FloatArray:
        """Sums of the ledger since the start, see ``kernels/energy_ledger.py``."""
        return self._ledger

    @property
    def search_truncation(self) -> tuple[int, float]:
        """Number of truncated searches, and their largest error bound [m]."""
        return int(self.memory[TRUNCATED_TICKS]), float(self.memory[MAX_ERROR_BOUND])

    def ledger(self) -> Ledger:
        """Return the energies since the start."""
        end = self.stored_energy(self._anchor)
        return Ledger.from_sums(self._ledger, self._energy_at_start, end)

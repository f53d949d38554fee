"""What a loop and its supervisor share: rows, counts, heartbeat, and why the loop ended."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from multiprocessing.context import SpawnContext
from typing import Any, ClassVar

import numpy as np

from asperity.contacts.warm_start import WARM_START_SIZE
from asperity.core.checks import FloatArray
from asperity.core.errors import AsperityError, ParameterError
from asperity.core.files import Serializable
from asperity.loop.interface import STOP_NOW, STOP_RAMPED
from asperity.loop.shared_trace import (
    COLUMNS,
    CONTROL_SIZE,
    FORCE_LIMIT_COUNT,
    HEARTBEAT_WORD,
    LAST_START_TIME,
    LATENESS_HISTOGRAM,
    PERIOD_HISTOGRAM,
    ROW_COUNT,
    STATUS_SIZE,
    STOP_WORD,
    SharedBlock,
)

BUFFER_ROWS = 40_000
"""Rows that the memory holds: 4 s of the fastest loop."""


def _allocate(kind: type[ctypes.c_int64 | ctypes.c_double], size: int) -> Any:
    return SpawnContext().RawArray(kind, size)


class LoopMemory:
    """Rows of a loop, for one writer and any number of readers, without locks.

    The loop writes a row and then increments their count. A reader copies the counted rows, reads
    the count again, and discards the rows that were overwritten meanwhile.
    """

    def __init__(self) -> None:
        try:
            self._control = _allocate(ctypes.c_int64, CONTROL_SIZE)
            self._status = _allocate(ctypes.c_int64, STATUS_SIZE)
            self._table = _allocate(ctypes.c_double, BUFFER_ROWS * len(COLUMNS))
            self._search = _allocate(ctypes.c_double, WARM_START_SIZE)
        except OSError as error:
            reason = f"{error.strerror}: {error.filename}"
            raise ParameterError(
                "driver", f"needs memory shared by two processes ({reason})"
            ) from None

    def block(self) -> SharedBlock:
        """Return the memory as the compiled loop of a device without delay takes it."""
        return SharedBlock(
            np.frombuffer(self._control, np.int64),
            np.frombuffer(self._status, np.int64),
            np.frombuffer(self._table, np.float64).reshape(-1, len(COLUMNS)),
            np.zeros(1, np.int64),
            np.zeros((1, 3)),
        )

    @property
    def search_state(self) -> FloatArray:
        """State of the loop's search, with its truncated ticks since the start."""
        return np.frombuffer(self._search, np.float64)

    @property
    def row_count(self) -> int:
        """Number of rows written since the start."""
        return int(self._status[ROW_COUNT])

    @property
    def status(self) -> list[int]:
        """Counts and histograms of the loop, see :mod:`asperity.loop.shared_trace`."""
        return list(self._status)

    def send_heartbeat(self) -> None:
        """Send a heartbeat."""
        self._control[HEARTBEAT_WORD] += 1

    def request_stop(self, *, now: bool = False) -> None:
        """Request the loop to release the force, by a ramp or now, and to end."""
        wanted = STOP_NOW if now else STOP_RAMPED
        self._control[STOP_WORD] = max(wanted, self._control[STOP_WORD])

    def rows(self, first_row: int) -> tuple[FloatArray, int]:
        """Return the available rows from a number on, and the number of the first."""
        table = self.block().rows
        count = self.row_count
        first_row = max(0, first_row, count - len(table))
        rows = table[np.arange(first_row, count) % len(table)]
        # The row after the newest may be half written: it counts as overwritten.
        lost = max(0, self.row_count + 1 - len(table) - first_row)
        return rows[lost:], first_row + min(lost, len(rows))


@dataclass(frozen=True)
class LoopStatistics(Serializable):
    """Counts of a loop.

    Attributes:
        samples: number of samples.
        late: samples that ended when the next one was due already.
        skipped: samples that were left out because of it.
        max_lateness: largest start delay of a sample [s].
        force_limited: samples whose force was limited.
        slew_limited: samples whose change of force was limited.
        too_deep: samples deeper than ``max_depth``.
        deepest: greatest depth of these [m]; 0 for none.
        lateness_histogram: number of samples that started less than 2ⁿ ns late, but not less than
            2ⁿ⁻¹, by n.
        period_histogram: the same for the difference between two starts and the period.
    """

    samples: int
    late: int
    skipped: int
    max_lateness: float
    force_limited: int
    slew_limited: int
    too_deep: int
    deepest: float
    lateness_histogram: tuple[int, ...]
    period_histogram: tuple[int, ...]

    @classmethod
    def from_status(cls, status: Sequence[int]) -> LoopStatistics:
        """Return the statistics of the words of a loop, see :mod:`asperity.loop.shared_trace`."""
        rows, late, skipped, lateness = status[:FORCE_LIMIT_COUNT]
        forces, slews, deep, deepest = status[FORCE_LIMIT_COUNT:LAST_START_TIME]
        first = LATENESS_HISTOGRAM
        second = PERIOD_HISTOGRAM
        histograms = tuple(status[first:second]), tuple(status[second:STATUS_SIZE])
        limits = forces, slews, deep, 1e-12 * deepest
        return cls(rows, late, skipped, 1e-9 * lateness, *limits, *histograms)

    def measured_rate(self, period: float) -> float:
        """Return the mean update rate [Hz] of a loop with a period [s], whose skipped ticks lack.

        Example:
            >>> LoopStatistics(900, 100, 100, 2e-3, 0, 0, 0, 0.0, (), ()).measured_rate(1e-3)
            900.0
        """
        ticks = self.samples + self.skipped
        return self.samples / (ticks * period) if ticks else 0.0

    def lateness_quantile(self, fraction: float) -> float:
        """Return an upper bound of the lateness of a share of the samples [s], to a factor of 2.

        Example:
            >>> words = [3, 0, 0, 900, 0, 0, 0, 0, 0] + [0] * 9 + [2, 1] + [0] * 69
            >>> LoopStatistics.from_status(words).lateness_quantile(0.5)
            5.12e-07
        """
        return min(_quantile(self.lateness_histogram, fraction), max(self.max_lateness, 1e-9))

    def jitter_quantile(self, fraction: float) -> float:
        """Return the same for the deviation of the period from T [s]."""
        return _quantile(self.period_histogram, fraction)


def _quantile(histogram: tuple[int, ...], fraction: float) -> float:
    """Return the upper end of the bin that completes a share of the counts [s]; 0 for none."""
    target = fraction * sum(histogram)
    total = 0
    for exponent, count in enumerate(histogram):
        total += count
        if count and total >= target:
            return 2.0**exponent * 1e-9
    return 0.0


FAULT_SAMPLES = 50
"""Samples that a fault carries."""


class EndReason(Enum):
    """Why a loop ended: the end causes of the compiled loop, and two of the supervisor.

    The first four are not faults.
    """

    RUNNING = 0
    STOPPED = 1
    SWAP = 2
    FINISHED = 3
    NOT_FINITE = 4
    """A position or a force is not a finite number."""
    DEVICE = 5
    """The driver reported an error."""
    WORKSPACE = 6
    """The handle was read outside its workspace."""
    DEPTH = 7
    """The probe is deeper than the analysed depth."""
    LATE_SAMPLE = 8
    """The loop was late for longer than the limit."""
    NO_HEARTBEAT = 9
    """The supervising process sent no heartbeat."""
    UNRESPONSIVE = 10
    """The loop made no progress: the device does not answer."""
    DIED = 11
    """The process of the loop ended."""

    @property
    def is_fault(self) -> bool:
        """Whether the reason is a fault."""
        return self.value > EndReason.FINISHED.value


FAULT_DESCRIPTIONS = {
    EndReason.NOT_FINITE: "a position or a force is not a number",
    EndReason.WORKSPACE: "the handle was read outside its workspace",
    EndReason.DEPTH: "the probe is deeper than max_depth, for which the surface was analysed",
    EndReason.LATE_SAMPLE: "the loop was late for too long",
    EndReason.NO_HEARTBEAT: "the supervising program sent no heartbeat",
    EndReason.UNRESPONSIVE: "the device does not answer",
    EndReason.DIED: "the process of the loop ended",
}
"""Faults in words; errors of a driver are described by the driver."""


class DeviceFault(AsperityError):  # noqa: N818 - the field's word for it
    """A fault that ended the loop; the force was made zero.

    Attributes:
        cause: end reason.
        samples: the last rows of the loop, at most ``FAULT_SAMPLES``; see
            :data:`asperity.loop.shared_trace.COLUMNS`.
    """

    exit_code: ClassVar[int] = 3

    def __init__(self, cause: EndReason, message: str, samples: FloatArray | None = None) -> None:
        self.cause = cause
        self.samples = np.empty((0, 0)) if samples is None else samples
        super().__init__(message)

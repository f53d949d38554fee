"""Results of a simulation: trace, final state, energy ledger and statistics of the tail."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.display import Plottable
from asperity.core.errors import ParameterError
from asperity.core.files import attributes_to_dict, to_plain_data
from asperity.recording.recorded_field import LimitCounts
from asperity.recording.row_encoding import NamedColumns
from asperity.recording.writer import RecordingWriter
from asperity.simulation.servo import Servo
from asperity.surface import Surface

COLUMNS = (
    ("time", "s"),
    ("x", "m"),
    ("y", "m"),
    ("z", "m"),
    ("vx", "m/s"),
    ("vy", "m/s"),
    ("vz", "m/s"),
    ("commanded x", "N"),
    ("commanded y", "N"),
    ("commanded z", "N"),
    ("applied x", "N"),
    ("applied y", "N"),
    ("applied z", "N"),
    ("anchor x", "m"),
    ("anchor y", "m"),
    ("anchor z", "m"),
    ("supplied x", "J"),
    ("supplied y", "J"),
    ("supplied z", "J"),
    ("same sample x", "J"),
    ("same sample y", "J"),
    ("same sample z", "J"),
    ("lost", "J"),
    ("hand", "J"),
    ("friction", "J"),
    ("sampling", "J"),
    ("stored", "J"),
    ("law anchor x", "m"),
    ("law anchor y", "m"),
    ("law held", "1"),
    ("law anchor z", "m"),
)


class DecimatedTrace:
    """A trace in memory: all rows, or every n-th so that a number of rows is not exceeded.

    Args:
        rows: number of rows to come.
        max_rows: largest number of rows to store; ``None`` for all.

    Raises:
        ParameterError: for more rows than fit into memory.
    """

    def __init__(self, rows: int, max_rows: int | None) -> None:
        self._step = 1
        if max_rows is not None:
            self._step = max(1, math.ceil(rows / max(max_rows, 1)))
        try:
            self._table = np.empty((math.ceil(rows / self._step), len(COLUMNS)))
        except (MemoryError, ValueError):  # more than the address space
            raise ParameterError(
                "trace", f"needs memory for {rows} rows: give a path, or a larger 'every'"
            ) from None
        self._rows_seen = 0
        self._row_count = 0

    def append(self, rows: FloatArray) -> None:
        """Store every n-th row."""
        if len(self._table):
            chosen = rows[-self._rows_seen % self._step :: self._step]
            self._table[self._row_count : self._row_count + len(chosen)] = chosen
            self._row_count += len(chosen)
        self._rows_seen += len(rows)

    @property
    def table(self) -> FloatArray:
        """The stored rows."""
        return self._table[: self._row_count]

    def close(self) -> None:
        """Do nothing: there is no file."""


TraceWriter = DecimatedTrace | RecordingWriter
"""What takes the rows of a run, chunk by chunk."""
_MIN_ROWS = 4
_NAMES = [name for name, _unit in COLUMNS]
_POSITION = slice(_NAMES.index("x"), _NAMES.index("z") + 1)
_VELOCITY = slice(_NAMES.index("vx"), _NAMES.index("vz") + 1)
_COMMANDED = slice(_NAMES.index("commanded x"), _NAMES.index("commanded z") + 1)
_SUPPLIED = slice(_NAMES.index("supplied x"), _NAMES.index("supplied z") + 1)
_ANCHOR = [_NAMES.index(f"law anchor {axis}") for axis in "xyz"]
_LOST = _NAMES.index("lost")
_FRICTION = _NAMES.index("friction")
_TAIL_NUMBERS = 9  # position, velocity, and three energies


MAX_ROWS = 20_000


class StopReason(StrEnum):
    """Why a run stops early."""

    NONE = ""
    DIVERGED = "diverged"
    """The state exceeds 1e6 in SI units."""
    LEFT_WORKSPACE = "left the workspace"


@dataclass(frozen=True)
class SegmentStatistics:
    """Statistics of a part of a run.

    Attributes:
        samples: samples done.
        stop: why the run stopped.
        velocity_spread: standard deviations of the velocity before each sample of the part, summed
            over the axes [m/s].
        mean_energies: energy that the texture has supplied since the start, and that damping and
            dry friction have taken, on average of those samples [J].
        net_spread: standard deviation of their difference [J].
        position_spread: standard deviations of the position, as those of the velocity [m].
    """

    samples: int
    stop: StopReason
    velocity_spread: float
    mean_energies: tuple[float, float]
    net_spread: float = 0.0
    position_spread: float = 0.0


def ends_of_quarters(rows: int) -> tuple[int, int, int]:
    """Return the ends of the second to the last quarter, as NumPy splits: the first are longer."""
    quarter = rows // 4
    return rows - 2 * quarter - (rows % 4 == 3), rows - quarter, rows


class TailStatistics:
    """Statistics of the last quarters of a run.

    Args:
        rows: number of rows that the trace will have.
    """

    def __init__(self, rows: int) -> None:
        self._ends = ends_of_quarters(rows)
        self._rows_seen = 0
        self._moments = _Moments(), _Moments()

    @property
    def is_complete(self) -> bool:
        """Whether all rows have been seen, and are enough for a verdict."""
        return self._rows_seen == self._ends[-1] >= _MIN_ROWS

    @property
    def last_quarters(self) -> tuple[SegmentStatistics, SegmentStatistics]:
        """Statistics of the last quarter but one, and of the last."""
        before, last = self._moments
        return before.statistics(self._ends[1]), last.statistics(self._ends[2])

    @property
    def velocity_spread(self) -> float:
        """Standard deviations of the velocity in the last quarter, summed over the axes [m/s]."""
        return self.last_quarters[1].velocity_spread

    @property
    def position_spread(self) -> float:
        """Standard deviations of the position in the last quarter, summed over the axes [m]."""
        return self.last_quarters[1].position_spread

    def update(self, rows: FloatArray) -> None:
        """Update the statistics with the next rows of the trace, shape (n, columns)."""
        ends = [max(end - self._rows_seen, 0) for end in self._ends]
        self._rows_seen = self._rows_seen + len(rows)
        for moments, (start, end) in zip(self._moments, pairwise(ends), strict=True):
            moments.update(rows[start:end])


class _Moments:
    """Means and squares of position, velocity and energies over some rows of a trace."""

    def __init__(self) -> None:
        self._count = 0
        self._means = np.zeros(_TAIL_NUMBERS)
        self._squares = np.zeros(_TAIL_NUMBERS)

    def update(self, rows: FloatArray) -> None:
        if not len(rows):
            return
        supplied = rows[:, _SUPPLIED].sum(axis=1)
        taken = rows[:, _LOST] - rows[:, _FRICTION]
        moved = *rows[:, _POSITION].T, *rows[:, _VELOCITY].T
        total = self._count + len(rows)
        # Mean and squares of two parts are merged without a difference of large numbers.
        for i, values in enumerate((*moved, supplied, taken, supplied - taken)):
            mean = values.mean()
            change = mean - self._means[i]
            self._squares[i] += ((values - mean) ** 2).sum()
            self._squares[i] += change**2 * (self._count * len(rows) / total)
            self._means[i] += change * (len(rows) / total)
        self._count = total

    def statistics(self, samples: int) -> SegmentStatistics:
        spreads = np.sqrt(self._squares / self._count)
        return SegmentStatistics(
            samples,
            StopReason.NONE,
            float(spreads[3:6].sum()),
            (float(self._means[6]), float(self._means[7])),
            float(spreads[8]),
            float(spreads[:3].sum()),
        )


class RunCounts:
    """Counts of samples at the force limit and below ``max_depth``, and energies of friction.

    Args:
        surface: the surface.
        servo: largest force, and its steps.

    Attributes:
        limits: samples at the force limit, and below ``max_depth``.
        slipped: energy that the slip of the friction's anchor took, Σ κ d·Δa [J].
        deflected: energy κ|d|²/2 stored in the deflection of the anchor [J].
    """

    def __init__(self, surface: Surface, servo: Servo) -> None:
        self._surface = surface
        depth = surface.max_depth
        self.limits = LimitCounts(servo.max_force, servo.force_resolution, depth)
        self._safe_height = surface.law.contact.extremes(surface.texture)[1] - surface.max_depth
        self.slipped = 0.0
        self.deflected = 0.0
        self._anchor = np.empty((0, 3))

    @property
    def totals(self) -> tuple[int, int, float, float, float]:
        """Counts and the greatest depth [m] of the limits, then the energies."""
        limits = self.limits
        return limits.force_limited, limits.too_deep, limits.deepest, self.slipped, self.deflected

    def update(self, rows: FloatArray) -> None:
        """Count the next rows of the trace, shape (n, columns)."""
        friction = self._surface.contact_friction
        if friction is not None and len(rows):
            anchors = rows[:, _ANCHOR]
            deflection = (rows[:, _POSITION] - anchors)[:, : friction.axes]
            steps = np.diff(anchors, axis=0, prepend=self._anchor)[-len(rows) :, : friction.axes]
            stiffness = friction.presliding_stiffness
            self.slipped += stiffness * float((deflection[-len(steps) :] * steps).sum())
            self.deflected = 0.5 * stiffness * float(np.square(deflection[-1]).sum())
            self._anchor = anchors[-1:].copy()
        low = rows[rows[:, _POSITION.stop - 1] < self._safe_height, _POSITION]
        low = low[np.isfinite(low).all(axis=1)]
        depths = np.empty(0)
        if len(low):
            depths = self._surface.law.contact.depth(self._surface.texture, low)
        self.limits.count(rows[:, _COMMANDED], depths)


@dataclass(frozen=True)
class Ledger:
    """Energies of a run [J].

    Attributes:
        supplied: work of the held force on the true motion, Σ f_k · (p_{k+1} - p_k), per axis;
            > 0: the hand gains energy.
        same_sample: the paper's sum, Σ f_k · (p_k - p_{k-1}) with the measured position and the
            force commanded at the same sample, per axis; it inverts the sign of the sampling leak.
        dissipated: loss in the damping of device and hand.
        hand: work of the hand's anchor on the body.
        friction: work of dry friction, mostly negative.
        sampling: energy that holding the force from sample to sample adds to the work of the field
            by the trapezoidal rule, ½ Σ (f_k - f_{k+1}) · (p_{k+1} - p_k), with measured positions;
            for f = -K p it is ½ K Σ|Δp|².
        exchanged: sum of the absolute values of all exchanges, the scale of the closure error.
        stored_before: stored at the start, kinetic and in springs.
        stored_after: stored at the end.
    """

    supplied: tuple[float, float, float]
    same_sample: tuple[float, float, float]
    dissipated: float
    hand: float
    friction: float
    sampling: float
    exchanged: float
    stored_before: float
    stored_after: float

    @classmethod
    def from_sums(cls, sums: FloatArray, stored_before: float, stored_after: float) -> Ledger:
        """Return the ledger of the sums of a run; see :mod:`asperity.loop.simulated_device`."""
        x, y, z, px, py, pz, *others = map(float, sums)
        return cls((x, y, z), (px, py, pz), *(*others, stored_before, stored_after))

    @property
    def total(self) -> float:
        """Work of the texture on the hand, all axes [J]."""
        return float(sum(self.supplied))

    @property
    def closure(self) -> float:
        """Closure error [J]: stored - (supplied + hand + friction - lost)."""
        change = self.stored_after - self.stored_before
        return change - (self.total + self.hand + self.friction - self.dissipated)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data [J], with the sums over the axes; None for an overflow."""
        data = {
            "supplied": self.supplied,
            "supplied_sum": self.total,
            "same_sample": self.same_sample,
            "same_sample_sum": sum(self.same_sample),
            "sampling": self.sampling,
            "lost": self.dissipated,
            "hand": self.hand,
            "friction": self.friction,
            "stored_before": self.stored_before,
            "stored_after": self.stored_after,
            "closure": self.closure,
            "exchanged": self.exchanged,
        }
        return dict(to_plain_data(data, infinity=None))


@dataclass(frozen=True, eq=False)
class Run(NamedColumns, Plottable):
    """The result of a simulation.

    Attributes:
        table: the trace, one row per traced sample with the columns of
            :data:`~asperity.simulation.trace.COLUMNS`; no rows if it is in a file or was not
            requested.
        state: final state of the body: position [m], velocity [m/s], then those of the mass that
            carries the hand, if it is a second one.
        samples: number of samples done.
        period: T [s].
        ledger: energies of the whole run.
        surface: the surface.
        stop: why the run stopped early; trace and ledger then end there (when the handle left the
            workspace, with the sample that the body could not follow).
        stop_location: where the handle left the workspace, in words.
        path: path of the trace file, or empty.
        tail: statistics of the last quarter, from every sample; ``None`` without a trace.
        notes: sentences on parameters of the plant that are guesses.
        truncated_ticks: ticks whose search for closest points reached the evaluation budget.
        search_error: largest error bound of a truncated search [m]: on the nearest contact no
            surface point was closer than the one found by more than this; on the split contact the
            force was accurate to stiffness times this.
        force_limited: samples whose force was limited to that of the device.
        too_deep: samples below ``max_depth``, for which the surface was analysed.
        deepest: greatest depth of these [m]; 0 for none.
        slipped: energy that the slip of the friction's anchor took [J].
        deflected: energy stored in the deflection of that anchor at the end [J].
    """

    table: FloatArray
    state: FloatArray
    samples: int
    period: float
    ledger: Ledger
    surface: Surface
    stop: StopReason = StopReason.NONE
    stop_location: str = ""
    path: str = ""
    tail: TailStatistics | None = None
    notes: tuple[str, ...] = ()
    truncated_ticks: int = 0
    search_error: float = 0.0
    force_limited: int = 0
    too_deep: int = 0
    deepest: float = 0.0
    slipped: float = 0.0
    deflected: float = 0.0
    columns = COLUMNS

    def __repr__(self) -> str:
        law = self.surface.law.letter
        stopped = f", {self.stop_message}" if self.stop else ""
        work = f"{self.ledger.total:+.4g} J to the hand"
        return f"<Run of law {law}, {self.duration:g} s, {work}{stopped}>"

    @property
    def stop_message(self) -> str:
        """Why the run stopped early, in words; empty if it did not."""
        if not self.stop_location:
            return str(self.stop)
        return f"{self.stop}: {self.stop_location}"

    @property
    def duration(self) -> float:
        """Simulated time [s]."""
        return self.samples * self.period

    @property
    def is_energy_balanced(self) -> bool:
        """Whether the ledger closes, to 1e-9 of all energy exchanged.

        If not, the body is too stiff for its period, and the energies of the run are not valid.
        """
        ledger = self.ledger
        # If nothing moves, only rounding errors of the stored energy are left.
        bits = 1e-15 * max(ledger.stored_before, ledger.stored_after)
        return abs(ledger.closure) <= 1e-9 * ledger.exchanged + bits

    def to_dict(self) -> dict[str, Any]:
        """Return plain data without the trace, SI units; None for an overflow."""
        names = "duration samples period stop_message state ledger truncated_ticks search_error"
        names += " force_limited too_deep deepest slipped deflected"
        data = attributes_to_dict(self, *names.split(), infinity=None)
        return data | {"trace": self.path or None, "notes": list(self.notes)}

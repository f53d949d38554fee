"""Results of a simulation: trace, final state and energy ledger."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.display import Plottable
from asperity.core.files import attributes_to_dict, to_plain_data
from asperity.recording.named_columns import NamedColumns
from asperity.recording.recording import open_recording
from asperity.simulation.trace import COLUMNS, TailStatistics, is_text_path
from asperity.surface import Surface

MAX_ROWS = 20_000


class StopReason(StrEnum):
    """Why a run stops early."""

    NONE = ""
    DIVERGED = "diverged"
    """The state exceeds 1e6 in SI units."""
    LEFT_WORKSPACE = "left the workspace"


@dataclass(frozen=True)
class Ledger:
    """Energies of a run [J].

    Attributes:
        supplied: work of the held force on the true motion, Σ f_k · (p_{k+1} - p_k), per axis;
            > 0 feeds the hand.
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
        """Return the ledger of the sums of a run; see ``kernels/energy_ledger.py``."""
        x, y, z, px, py, pz, lost, hand, friction, sampling, exchanged = map(float, sums)
        work, same = (x, y, z), (px, py, pz)
        return cls(
            work, same, lost, hand, friction, sampling, exchanged, stored_before, stored_after
        )

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
            "supplied": self.supplied, "supplied_sum": self.total,
            "same_sample": self.same_sample, "same_sample_sum": sum(self.same_sample),
            "sampling": self.sampling, "lost": self.dissipated, "hand": self.hand,
            "friction": self.friction, "stored_before": self.stored_before,
            "stored_after": self.stored_after, "closure": self.closure,
            "exchanged": self.exchanged,
        }  # fmt: skip
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
        tail: statistics of the last quarter, from all traced rows; ``None`` if none were traced.
        notes: sentences on parameters of the plant that are guesses.
        truncated_ticks: ticks whose search for closest points reached the evaluation budget.
        search_error: largest error bound of a truncated search [m]: on the nearest contact no
            surface point was closer than the one found by more than this; on the split contact the
            force was accurate to stiffness times this.
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
    columns = COLUMNS

    def __repr__(self) -> str:
        law, stopped = self.surface.law.letter, f", {self.stop_message}" if self.stop else ""
        work = f"{self.ledger.total:+.4g} J to the hand"
        return f"<Run of law {law}, {self.duration:g} s, {work}{stopped}>"

    @property
    def stop_message(self) -> str:
        """Why the run stopped early, in words; empty if it did not."""
        return f"{self.stop}: {self.stop_location}" if self.stop_location else str(self.stop)

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
        own = attributes_to_dict(self, *names.split(), infinity=None)
        return own | {"trace": self.path or None, "notes": list(self.notes)}


def load_trace(run: Run, max_rows: int = MAX_ROWS) -> Run:
    """Return a run with the trace of its file, decimated evenly.

    Args:
        run: a run whose trace is in ``run.path``.
        max_rows: largest number of rows.

    Raises:
        OSError: if the file is gone.
        ParameterError: likewise, for a recording.
    """
    if not is_text_path(Path(run.path)):
        return replace(run, table=open_recording(run.path).table(max_rows))
    with open(run.path, encoding="utf-8") as file:
        rows = sum(1 for _line in file) - 1
        file.seek(0)
        step = max(1, -(-rows // max_rows))
        table = np.loadtxt(islice(file, 1, None, step), delimiter=",", ndmin=2)
    return replace(run, table=table)

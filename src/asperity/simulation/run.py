"""What a simulation gave: where the handle went, and where every joule went."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.display import Plotted
from asperity.files import plain, record
from asperity.recording.recording import open_recording
from asperity.recording.traced import Parts
from asperity.simulation.ending import Ending, fed
from asperity.simulation.trace import COLUMNS, is_text
from asperity.surface import Surface

MOST_ROWS = 20_000


class Stop(StrEnum):
    """What ends a run before its time."""

    NOTHING = ""
    DIVERGED = "diverged"
    """The state left all bounds, 1e6 in SI units."""
    LEFT = "left the workspace"


@dataclass(frozen=True)
class Ledger:
    """Energies of a run [J].

    Attributes:
        supplied: work of the held force on the true motion, Σ f_k · (p_{k+1} - p_k), per axis;
            > 0 feeds the hand.
        same_sample: the paper's sum, Σ f_k · (p_k - p_{k-1}) with the measured position and the
            force commanded at the same sample, per axis: it turns the sampling leak around.
        lost: in the damping of device and hand.
        hand: work of the hand's anchor on the body.
        friction: work of dry friction, mostly negative.
        sampling: what holding the force from sample to sample adds to the work of the field by
            the trapezoidal rule, ½ Σ (f_k - f_{k+1}) · (p_{k+1} - p_k), with measured positions;
            for f = -K p it is ½ K Σ|Δp|².
        exchanged: the sum of all exchanges without their signs, the scale of the closure error.
        before: stored at the beginning, kinetic and in springs.
        after: stored at the end.
    """

    supplied: tuple[float, float, float]
    same_sample: tuple[float, float, float]
    lost: float
    hand: float
    friction: float
    sampling: float
    exchanged: float
    before: float
    after: float

    @classmethod
    def of(cls, sums: FloatArray, before: float, after: float) -> Ledger:
        """Return the ledger of the sums of a run; see ``kernels/booking.py``."""
        x, y, z, px, py, pz, lost, hand, friction, sampling, exchanged = map(float, sums)
        return cls(
            (x, y, z), (px, py, pz), lost, hand, friction, sampling, exchanged, before, after
        )

    @property
    def total(self) -> float:
        """The texture's work on the hand, all axes [J]."""
        return float(sum(self.supplied))

    @property
    def closure(self) -> float:
        """Energy that does not add up [J]: stored - (supplied + hand + friction - lost)."""
        change = self.after - self.before
        return change - (self.total + self.hand + self.friction - self.lost)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data [J], the sums over the axes as well; None for what overflowed."""
        data = {
            "supplied": self.supplied,
            "supplied_sum": self.total,
            "same_sample": self.same_sample,
            "same_sample_sum": sum(self.same_sample),
            "sampling": self.sampling,
            "lost": self.lost,
            "hand": self.hand,
            "friction": self.friction,
            "stored_before": self.before,
            "stored_after": self.after,
            "closure": self.closure,
            "exchanged": self.exchanged,
        }
        return dict(plain(data, infinity=None))


@dataclass(frozen=True, eq=False)
class Run(Parts, Plotted):
    """What a simulation gave.

    Attributes:
        table: the trace, one row for each traced sample with the columns of
            :data:`~asperity.simulation.trace.COLUMNS`; no rows if it went to a file or
            nowhere.
        state: of the body at the end: position [m], velocity [m/s], then the same of the part that
            carries the hand, if it is another one.
        samples: that were done.
        period: T [s].
        ledger: the energies of the whole run.
        surface: what was explored.
        stop: what ended it early; then trace and ledger end there (where it left the workspace,
            with the sample that the body could not follow).
        place: where it left the workspace, in words.
        path: of the trace file, or empty.
        ending: what the last quarter shows, from all rows that were traced, kept or not; ``None``
            if none were.
        notes: what about the plant is guessed.
        short: ticks in which the search for nearest points used up its looks, and took the best
            point that it had found.
        gap: the most that the search left open in one of them [m]: on the nearest contact, no
            surface point was nearer than the one taken by more than this; on the split one, the
            force was right to stiffness times this.
    """

    table: FloatArray
    state: FloatArray
    samples: int
    period: float
    ledger: Ledger
    surface: Surface
    stop: Stop = Stop.NOTHING
    place: str = ""
    path: str = ""
    ending: Ending | None = None
    notes: tuple[str, ...] = ()
    short: int = 0
    gap: float = 0.0
    columns = COLUMNS

    def __repr__(self) -> str:
        law, stopped = self.surface.law.letter, f", {self.stopped}" if self.stop else ""
        work = f"{self.ledger.total:+.4g} J to the hand"
        return f"<Run of law {law}, {self.duration:g} s, {work}{stopped}>"

    @property
    def stopped(self) -> str:
        """What ended it early, in words; empty if nothing did."""
        return f"{self.stop}: {self.place}" if self.place else str(self.stop)

    @property
    def duration(self) -> float:
        """Simulated time [s]."""
        return self.samples * self.period

    @property
    def fed(self) -> bool:
        """Whether, in the last quarter, the texture supplies a fifth of what is taken, or more."""
        return fed(self.table[-max(len(self.time) // 4, 2)], self.table[-1])

    @property
    def closes(self) -> bool:
        """Whether the ledger adds up, to 1e-9 of all that was exchanged.

        If not, the body is too stiff for its period, and no energy of the run is to be believed.
        """
        ledger = self.ledger
        # Where nothing moves, the last bits of what is stored are all there is.
        bits = 1e-15 * max(ledger.before, ledger.after)
        return abs(ledger.closure) <= 1e-9 * ledger.exchanged + bits

    def to_dict(self) -> dict[str, Any]:
        """Return plain data without the trace, SI units; None for what overflowed."""
        names = ("duration", "samples", "period", "stopped", "state", "ledger", "short", "gap")
        own = record(self, *names, infinity=None)
        return own | {"trace": self.path or None, "notes": list(self.notes)}


def reread(run: Run, most: int = MOST_ROWS) -> Run:
    """Return a run with the trace that it wrote to a file, thinned out evenly.

    Args:
        run: whose trace is in ``run.path``.
        most: rows that are read at most.

    Raises:
        OSError: if the file is gone.
        ParameterError: likewise, of a recording.
    """
    if not is_text(Path(run.path)):
        return replace(run, table=open_recording(run.path).table(most))
    with open(run.path, encoding="utf-8") as file:
        rows = sum(1 for _line in file) - 1
        file.seek(0)
        step = max(1, -(-rows // most))
        kept = islice(file, 1, None, step)
        table = np.loadtxt(kept, delimiter=",", ndmin=2)
    return replace(run, table=table)

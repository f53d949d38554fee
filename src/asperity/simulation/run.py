"""What a simulation gave."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from asperity.checks import FloatArray
from asperity.files import record
from asperity.simulation.ledger import Ledger
from asperity.simulation.trace import COLUMNS


class Stop(StrEnum):
    """What ends a run before its time."""

    NOTHING = ""
    DIVERGED = "diverged"
    """The state left all bounds, 1e6 in SI units."""
    LEFT = "left the workspace"


@dataclass(frozen=True, eq=False)
class Run:
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
        stop: what ended it early; then trace and ledger end there (where it left the workspace,
            with the sample that the body could not follow).
        place: where it left the workspace, in words.
        path: of the trace file, or empty.
        notes: what about the plant is guessed.
    """

    table: FloatArray
    state: FloatArray
    samples: int
    period: float
    ledger: Ledger
    stop: Stop = Stop.NOTHING
    place: str = ""
    path: str = ""
    notes: tuple[str, ...] = ()

    @property
    def stopped(self) -> str:
        """What ended it early, in words; empty if nothing did."""
        return f"{self.stop}: {self.place}" if self.place else str(self.stop)

    @property
    def duration(self) -> float:
        """Simulated time [s]."""
        return self.samples * self.period

    @property
    def closes(self) -> bool:
        """Whether the ledger adds up, to 1e-9 of all that was exchanged.

        If not, the body is too stiff for its period, and no energy of the run is to be believed.
        """
        ledger = self.ledger
        # Where nothing moves, the last bits of what is stored are all there is.
        bits = 1e-15 * max(ledger.before, ledger.after)
        return abs(ledger.closure) <= 1e-9 * ledger.exchanged + bits

    @property
    def time(self) -> FloatArray:
        """Of the traced samples [s], shape (k,)."""
        return self.table[:, 0]

    @property
    def position(self) -> FloatArray:
        """True position of the handle at the samples [m], shape (k, 3)."""
        return self.table[:, 1:4]

    @property
    def velocity(self) -> FloatArray:
        """True velocity of the handle at the samples [m/s], shape (k, 3)."""
        return self.table[:, 4:7]

    @property
    def commanded(self) -> FloatArray:
        """Force that the law asked for at the sample, rounded and limited [N], shape (k, 3)."""
        return self.table[:, 7:10]

    @property
    def applied(self) -> FloatArray:
        """Force that is held from the sample on, after the delay [N], shape (k, 3)."""
        return self.table[:, 10:13]

    @property
    def anchor(self) -> FloatArray:
        """Of the hand at the samples [m], shape (k, 3)."""
        return self.table[:, 13:16]

    @property
    def energies(self) -> dict[str, FloatArray]:
        """Sums of the ledger up to the samples [J].

        ``supplied`` and ``same_sample`` have shape (k, 3), one column per axis; ``lost``, ``hand``,
        ``friction``, ``sampling`` and ``stored`` have shape (k,).
        """
        single = {name: self.table[:, i] for i, (name, _unit) in enumerate(COLUMNS) if i >= 22}
        return {"supplied": self.table[:, 16:19], "same_sample": self.table[:, 19:22], **single}

    def to_dict(self) -> dict[str, Any]:
        """Return plain data without the trace, SI units; None for what overflowed."""
        names = ("duration", "samples", "period", "stopped", "state", "ledger")
        own = record(self, *names, infinity=None)
        return own | {"trace": self.path or None, "notes": list(self.notes)}

"""Where the energy went: every joule of a run, and what does not add up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from asperity.checks import FloatArray
from asperity.files import plain


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
        values = [float(value) for value in sums]
        x, y, z, px, py, pz, lost, hand, friction, sampling, exchanged = values
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

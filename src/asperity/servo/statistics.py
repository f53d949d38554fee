"""How a loop kept time, and what its guards did."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from asperity.files import Record
from asperity.servo.kernels.published import (
    BINS,
    DEEP,
    HEAD,
    LATE,
    LATENESS,
    LENGTHS,
    PERIODS,
    SKIPPED,
    SLEWS,
    WORST_LATE,
)


@dataclass(frozen=True)
class Statistics(Record):
    """What a loop counted.

    Attributes:
        samples: that were done.
        late: of them, done only when the next one was due.
        skipped: that were left out because of it.
        worst: longest lateness of a beginning [s].
        lengths: samples in which the greatest force was a limit.
        slews: samples in which the slew was.
        deep: samples deeper than what was analysed.
        histogram: how many samples began less than 2ⁿ ns late, but not less than 2ⁿ⁻¹, by n.
        periods: in the same way, by how much the time from one beginning to the next differed from
            the period.
    """

    samples: int
    late: int
    skipped: int
    worst: float
    lengths: int
    slews: int
    deep: int
    histogram: tuple[int, ...]
    periods: tuple[int, ...]

    @classmethod
    def of(cls, status: Sequence[int]) -> Statistics:
        """Return what the words of a loop say; see ``kernels.published``."""
        return cls(
            status[HEAD], status[LATE], status[SKIPPED], 1e-9 * status[WORST_LATE],
            status[LENGTHS], status[SLEWS], status[DEEP],
            tuple(status[LATENESS : LATENESS + BINS]), tuple(status[PERIODS : PERIODS + BINS]),
        )  # fmt: skip

    def lateness(self, share: float) -> float:
        """Return a lateness [s] that a share of the samples keeps, from above, to a factor of 2.

        Example:
            >>> words = [3, 0, 0, 900, 0, 0, 0, 0] + [0] * 9 + [2, 1] + [0] * 69
            >>> Statistics.of(words).lateness(0.5)
            5.12e-07
        """
        return min(_kept(self.histogram, share), max(self.worst, 1e-9))

    def jitter(self, share: float) -> float:
        """Return by how much a share of the periods differ from T at most [s], likewise."""
        return _kept(self.periods, share)


def _kept(histogram: tuple[int, ...], share: float) -> float:
    """Return the upper end of the bin up to which a share is counted [s]; 0 for none."""
    wanted, seen = share * sum(histogram), 0
    for exponent, count in enumerate(histogram):
        seen += count
        if count and seen >= wanted:
            return 2.0**exponent * 1e-9
    return 0.0

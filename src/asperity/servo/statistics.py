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
    """

    samples: int
    late: int
    skipped: int
    worst: float
    lengths: int
    slews: int
    deep: int
    histogram: tuple[int, ...]

    @classmethod
    def of(cls, status: Sequence[int]) -> Statistics:
        """Return what the words of a loop say; see ``kernels.published``."""
        bins = tuple(status[LATENESS : LATENESS + BINS])
        return cls(
            status[HEAD], status[LATE], status[SKIPPED], 1e-9 * status[WORST_LATE],
            status[LENGTHS], status[SLEWS], status[DEEP], bins,
        )  # fmt: skip

    def lateness(self, share: float) -> float:
        """Return a lateness [s] that a share of the samples keeps, from above, to a factor of 2.

        Example:
            >>> words = [3, 0, 0, 900, 0, 0, 0, 0] + [0] * 9 + [2, 1] + [0] * 29
            >>> Statistics.of(words).lateness(0.5)
            5.12e-07
        """
        wanted, seen = share * sum(self.histogram), 0
        for exponent, count in enumerate(self.histogram):
            seen += count
            if seen >= wanted:
                return min(2.0**exponent * 1e-9, max(self.worst, 1e-9))
        return self.worst

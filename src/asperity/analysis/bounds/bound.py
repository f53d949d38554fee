"""A number with its pedigree."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from asperity.display import Displayed
from asperity.files import Record

Method = Literal["theorem", "closed form", "certified", "sampled"]


@dataclass(frozen=True)
class Bound(Record, Displayed):
    """A supremum, with what is known of it.

    Attributes:
        lower: a value that is attained at ``at``.
        upper: a proved upper bound; infinity if none is.
        method: ``"theorem"``, ``"closed form"``, ``"certified"`` or ``"sampled"``.
        at: the probe position [m] that attains ``lower``, or approaches it from inside; for an
            infinite number the point where it first becomes so; ``None`` if there is none.
        note: one sentence on how the number came about.
        deflection: the state of a law with an anchor at ``at``: its deflection [m], shape (2,);
            ``None`` for a law without state.
        sliding: whether that anchor is dragged.

    Example:
        >>> Bound(2.0, math.inf, "sampled", (0.0, 0.0, -1e-3)).value
        2.0
    """

    written = "value lower upper method at note deflection sliding"

    lower: float
    upper: float
    method: Method
    at: tuple[float, float, float] | None = None
    note: str = ""
    deflection: tuple[float, float] | None = None
    sliding: bool = False

    @property
    def value(self) -> float:
        """``upper`` where one is proved, else ``lower``."""
        return self.upper if math.isfinite(self.upper) else self.lower

    @property
    def gap(self) -> float:
        """Relative gap (upper - lower)/lower; zero where both are infinite."""
        if math.isinf(self.lower):
            return 0.0
        return (self.upper - self.lower) / self.lower if self.lower > 0.0 else math.inf

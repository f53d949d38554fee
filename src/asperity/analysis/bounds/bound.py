"""A number with proved bounds, and the method that gave it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from asperity.core.display import Displayable
from asperity.core.files import Serializable

Method = Literal["theorem", "closed form", "certified", "sampled"]


@dataclass(frozen=True)
class Bound(Serializable, Displayable):
    """A supremum between bounds.

    Attributes:
        lower: a value that is attained at ``at``.
        upper: a proved upper bound; infinity without proof.
        method: ``"theorem"``, ``"closed form"``, ``"certified"`` or ``"sampled"``.
        at: the probe position [m] that attains ``lower``, or approaches it from inside; for an
            infinite number the point where it first diverges; ``None`` if there is none.
        note: derivation of the number, in one sentence.
        deflection: deflection [m], shape (2,), of the anchor at ``at``; ``None`` for a law without
            state.
        sliding: whether that anchor slides.

    Example:
        >>> Bound(2.0, math.inf, "sampled", (0.0, 0.0, -1e-3)).value
        2.0
    """

    serialized_attributes = "value lower upper method at note deflection sliding"

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

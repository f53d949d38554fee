"""Numbers in the plain notation of files."""

from __future__ import annotations

import math
import re

from asperity.errors import SurfaceFileError

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def parse_number(text: str, what: str) -> float:
    """Return a finite number; Python's float alone would also accept 1_000 and nan.

    Args:
        text: the number.
        what: what it is, for the message.

    Raises:
        SurfaceFileError: not a finite number.

    Example:
        >>> parse_number("-2.5e-3", "offset")
        -0.0025
    """
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise SurfaceFileError(f"{what} is {text[:40]!r}; a finite number is expected")
    return value

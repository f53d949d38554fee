"""Lengths and counts in words, and the check of lengths, for the steps of a preparation."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from asperity.errors import ParameterError


def length_text(value: float) -> str:
    """Return a length with a readable unit.

    Example:
        >>> length_text(1.03e-5), length_text(-2e-9)
        ('10.3 µm', '-2 nm')
    """
    for unit, factor in (("m", 1.0), ("mm", 1e-3), ("µm", 1e-6)):
        if abs(value) >= factor:
            return f"{value / factor:.4g} {unit}"
    return f"{value / 1e-9:.4g} nm"


def lengths_text(values: Sequence[float]) -> str:
    """Return lengths along x and y, once where they agree.

    Example:
        >>> lengths_text((1e-6, 1e-6)), lengths_text((1e-6, 2e-6))
        ('1 µm', '1 µm x 2 µm')
    """
    texts = [length_text(value) for value in values]
    return texts[0] if len(set(texts)) == 1 else " x ".join(texts)


def by_text(values: Sequence[int]) -> str:
    """Return counts along the axes: "30 x 40"."""
    return " x ".join(str(value) for value in values)


def positive_number(name: str, value: object, unit: str = "m") -> float:
    """Return a positive finite number.

    Raises:
        ParameterError: if it is none.
    """
    if isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool):
        number = float(value)
        if math.isfinite(number) and number > 0.0:
            return number
    raise ParameterError(name, f"must be positive and finite{f' [{unit}]' if unit else ''}", value)

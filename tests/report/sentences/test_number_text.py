"""Formatting of numbers, bounds and intervals as text."""

from __future__ import annotations

import math
import random

from asperity.analysis.bounds.bound import Bound
from asperity.report.sentences.texts import (
    interval_text,
    lower_bound_text,
    range_text,
    upper_bound_text,
)


def test_bounds_are_rounded_outwards() -> None:
    rng = random.Random(5)
    for _ in range(2000):
        value = 10.0 ** rng.uniform(-4.0, 6.0)
        low, high = float(lower_bound_text(value)), float(upper_bound_text(value))
        assert low <= value <= high
        assert high - low <= 1.1e-5 * value
    assert lower_bound_text(2.0 - 1e-15) == upper_bound_text(2.0 + 1e-15) == "2"
    assert lower_bound_text(2.0 - 1e-9) == "1.99999"
    assert upper_bound_text(2.0 + 1e-9) == "2.00001"
    assert (lower_bound_text(1000.0), upper_bound_text(120000.0), lower_bound_text(0.0)) == (
        "1000",
        "120000",
        "0",
    )


def test_intervals_as_words() -> None:
    assert interval_text(Bound(math.inf, math.inf, "closed form")) == "∞"
    assert interval_text(Bound(1.0, 2.0, "certified")) == "1 to 2"
    assert range_text(0.0, math.inf, "J") == "0 J"
    assert range_text(2e-6, math.inf, "J") == "at least 2 µJ"
    assert range_text(0.0, 3e-9, "J") == "0 to 3 nJ"

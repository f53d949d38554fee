"""What the benchmark of the lab says of differences, and of processors."""

from __future__ import annotations

import os
import time

import numpy as np
import pytest
from bench.speed.lab import _cpu_time, chance_lag


def test_a_difference_is_told_from_chance() -> None:
    assert chance_lag(np.array([1.0, 2.0, 3.0])) == 0.125
    assert chance_lag(np.array([3.0, -1.0])) == 0.5
    # A cost that is there in each of eight pairs is found; one that comes and goes is not.
    assert chance_lag(np.full(8, 100.0)) == 1.0 / 256.0
    assert chance_lag(np.array([5.0, -5.0, 4.0, -4.0, 3.0, -3.0])) > 0.5


def test_time_of_the_processor_is_counted() -> None:
    before, begun = _cpu_time(os.getpid()), time.process_time()
    while time.process_time() < begun + 0.2:
        pass
    assert _cpu_time(os.getpid()) - before == pytest.approx(0.2, abs=0.05)

"""What the benchmark of the lab says of differences, and of processors."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from bench.speed.lab import _cpu_time, chance_lag


def test_a_difference_is_told_from_chance() -> None:
    assert chance_lag(np.array([1.0, 2.0, 3.0])) == 0.125
    assert chance_lag(np.array([3.0, -1.0])) == 0.5
    # A cost that is there in each of eight pairs is found; one that comes and goes is not.
    assert chance_lag(np.full(8, 100.0)) == 1.0 / 256.0
    assert chance_lag(np.array([5.0, -5.0, 4.0, -4.0, 3.0, -3.0])) > 0.5


_BUSY = """import time
while time.process_time() < 0.4:
    pass
print("done", flush=True)
input()"""


def test_time_of_the_processor_is_counted() -> None:
    """Of a process of its own: below this one a browser may run."""
    command = [sys.executable, "-c", _BUSY]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"done\n"
        assert _cpu_time(process.pid) == pytest.approx(0.4, abs=0.05)
        process.kill()

"""A run for tests, added with runpy: cheap, counted, and it fails when told to.

Environment: SWEEP_LOG, a file to which each computed case appends the number of its texture's
period; SWEEP_PAUSE, the time of a case [s].
"""

from __future__ import annotations

import os
import random
import signal
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core.display import Tabular
from asperity.core.errors import ParameterError
from asperity.sweeps.case_runs import RUN_KINDS, RunKind


class CountedResult(Tabular):
    """One row: the period, its square, and random numbers of the process."""

    def __init__(self, period: float, seed: int) -> None:
        self.period, self.seed = period, seed

    def table_rows(self):
        return [
            {
                "square [m^2]": self.period**2,
                "random": random.Random(self.seed).random(),
                "numpy": float(np.random.random()),  # noqa: NPY002 - its seeding is tested
                "reach [m]": float("inf"),
                "unknown": None,
                "words": 'a "quoted", line',
            }
        ]


def count(scene: Any, _laws: object, options: Mapping[str, Any], seed: int) -> CountedResult:
    period = scene.texture.period
    time.sleep(float(os.environ.get("SWEEP_PAUSE", "0")))
    if period == options.get("failing"):
        raise ParameterError("period", "fails here", period)
    if period == options.get("crashing"):
        os.kill(os.getpid(), signal.SIGKILL)
    if log := os.environ.get("SWEEP_LOG"):
        with Path(log).open("a") as stream:
            stream.write(f"{period!r}\n")
    return CountedResult(period, seed)


def options(failing: float | None = None, crashing: float | None = None) -> None: ...


COUNTING = RunKind("counting", options, count, (), ("square [m^2]",), takes_laws=False)
RUN_KINDS.setdefault(COUNTING.name, COUNTING)

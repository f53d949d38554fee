"""Fixtures of the tests of sweeps: a cheap run that is known in all processes."""

from __future__ import annotations

import pickle
import runpy
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from asperity.sweeps.case_runs import RUN_KINDS
from asperity.sweeps.sweep_plan import SweepPlan, make_plan

COUNTING = Path(__file__).with_name("counting_run.py")
SCENE = "sinusoid:amplitude=0.1mm"


@pytest.fixture
def counting_plan() -> Iterator[Callable[..., SweepPlan]]:
    """``counting_plan(vary, **options)``: a plan of the run of ``counting_run.py``."""
    runpy.run_path(str(COUNTING))
    prepare = pickle.dumps(partial(runpy.run_path, str(COUNTING)))

    def make(vary: str, design: str = "", **options: Any) -> SweepPlan:
        varied = dict(part.split("=") for part in vary.split())
        return make_plan(SCENE, varied, "counting", design=design, options=options, prepare=prepare)

    yield make
    del RUN_KINDS["counting"]

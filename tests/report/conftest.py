"""Fixtures shared by the tests of reports."""

from __future__ import annotations

import pytest

from asperity.paper.experiments.cycle_counts import passivity_experiment
from asperity.paper.experiments.device_onsets import DeviceExperiment, device_onset
from asperity.paper.experiments.experiment_suite import Experiments
from asperity.paper.experiments.strokes import bump_experiment, scanning_experiment
from asperity.surface import Surface
from asperity.textures import Sinusoid


@pytest.fixture(scope="session")
def experiments() -> Experiments:
    """Return all experiments of the paper in reduced size."""
    surface = Surface(Sinusoid(0.1e-3, 1e-3), "A", max_depth=1e-3)
    return Experiments(
        passivity_experiment("WH", (0,), starts=2),
        scanning_experiment("A"),
        bump_experiment("AD"),
        DeviceExperiment((device_onset("touch", "sinusoid", surface),), ("falcon",)),
    )

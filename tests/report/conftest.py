"""What several tests of reports look at."""

from __future__ import annotations

import pytest

from asperity.paper.experiments.beyond import BeyondExperiment, device_onset
from asperity.paper.experiments.bump import bump_experiment
from asperity.paper.experiments.passivity import passivity_experiment
from asperity.paper.experiments.run import Experiments
from asperity.paper.experiments.scanning import scanning_experiment
from asperity.surface import Surface
from asperity.textures import Sinusoid


@pytest.fixture(scope="session")
def found() -> Experiments:
    """Every experiment, smaller than the paper's."""
    surface = Surface(Sinusoid(0.1e-3, 1e-3), "A", max_depth=1e-3)
    return Experiments(
        passivity_experiment("WH", (0,), starts=2),
        scanning_experiment("A"),
        bump_experiment("AD"),
        BeyondExperiment((device_onset("touch", "sinusoid", surface),), ("falcon",)),
    )

"""Bodies of several runs over one sample, one after the other: of those that know no better."""

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels
from asperity.simulation.kernels.body_interface import RUNNING, STOP, SampleInput, advance_body

KERNELS = Kernels(provides=("advance_lanes", "lane_input"))


def lane_input(inputs: FloatArray, lane: int) -> SampleInput:
    """Return the row of a run as a record."""
    return SampleInput(
        inputs[lane, 0], inputs[lane, 1], inputs[lane, 2],
        inputs[lane, 3], inputs[lane, 4], inputs[lane, 5],
        inputs[lane, 6], inputs[lane, 7], inputs[lane, 8],
        inputs[lane, 9] > 0.0,
    )  # fmt: skip


def advance_lanes(
    x: FloatArray,
    ledger: FloatArray,
    inputs: FloatArray,
    progress: NDArray[np.int64],
    plant: object,
) -> None:
    """Move the bodies over one sample; see ``body_functions``."""
    for run in range(x.shape[0]):
        if progress[run, STOP] == RUNNING:
            progress[run, STOP] = advance_body(x[run], ledger[run], lane_input(inputs, run), plant)

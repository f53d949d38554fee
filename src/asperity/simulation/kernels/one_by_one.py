"""Bodies of several runs over one sample, one after the other: of those that know no better."""

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.simulation.kernels.body_functions import RAN, STOP, Held, advance_body

KERNELS = Kernels(provides=("advance_lanes", "held_of"), requires=("advance_body",))


def held_of(held: FloatArray, run: int) -> Held:
    """Return the row of a run as a record."""
    return Held(
        held[run, 0], held[run, 1], held[run, 2],
        held[run, 3], held[run, 4], held[run, 5],
        held[run, 6], held[run, 7], held[run, 8],
        held[run, 9] > 0.0,
    )  # fmt: skip


def advance_lanes(
    x: FloatArray, ledger: FloatArray, held: FloatArray, told: NDArray[np.int64], plant: object
) -> None:
    """Move the bodies over one sample; see ``body_functions``."""
    for run in range(x.shape[0]):
        if told[run, STOP] == RAN:
            told[run, STOP] = advance_body(x[run], ledger[run], held_of(held, run), plant)

"""Pantographs of several runs over one sample, as many at a time as the processor has lanes.

A sample is mostly one step of :func:`bar_step`, without a branch: all bodies take it at once. What
has to be looked at more closely (several steps, which dry friction always asks for; a band that
turns slack; the end of the workspace) is moved again, alone, from where it was.
"""

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.compiled import Kernels, local_array
from asperity.simulation.kernels.body_functions import LANES, RAN, STOP, advance_body
from asperity.simulation.kernels.booking import book_energies
from asperity.simulation.kernels.five_bar import (
    PantographPlant,
    Pull,
    bar_kink,
    bar_parts,
    bar_reached,
    bar_step,
)
from asperity.simulation.kernels.one_by_one import held_of

KERNELS = Kernels(
    provides=("advance_lanes",),
    requires=(
        "advance_body", "bar_kink", "bar_parts", "bar_reached", "bar_step", "book_energies",
        "held_of",
    ),
    shared=("advance_lanes",),
)  # fmt: skip


def step_lanes(x: FloatArray, held: FloatArray, moved: FloatArray, plant: PantographPlant) -> None:
    """Write what :func:`bar_step` returns for each run over a whole sample, a column a run.

    And the place where it ends, and 1 where that is all there is to it, 0 where not.
    """
    given = local_array((11, LANES))
    bar, hand, _friction, rate, fewest, period, share, _inside_only, least = plant
    joint = bar.joint_damping
    for lane in range(LANES):
        # A lane without a run does the last one again.
        run = min(lane, x.shape[0] - 1)
        given[0, lane] = x[run, 0]
        given[1, lane] = x[run, 2]
        given[2, lane] = x[run, 3]
        given[3, lane] = x[run, 5]
        given[4, lane] = held[run, 0]
        given[5, lane] = held[run, 2]
        given[6, lane] = held[run, 3]
        given[7, lane] = held[run, 5]
        given[8, lane] = held[run, 6]
        given[9, lane] = held[run, 8]
        given[10, lane] = joint if held[run, 9] > 0.0 or not plant.inside_only else 0.0
    for lane in range(LANES):
        pull = Pull(
            given[4, lane], given[5, lane], given[6, lane], given[7, lane], given[8, lane],
            given[9, lane], given[10, lane],
        )  # fmt: skip
        x0, z0, vx, vz = given[0, lane], given[1, lane], given[2, lane], given[3, lane]
        dx, dz, dvx, dvz, lost, work = bar_step(x0, z0, vx, vz, pull, period, bar, hand)
        px = x0 + dx
        pz = z0 + dz
        parts = max(fewest, bar_parts(vx, vz, rate, period / share, bar))
        plain = parts == 1 and bar_reached(px, pz, least, bar)
        plain = plain and not bar_kink(px, pz, dx, dz, 0.0, period, pull, hand)
        moved[0, lane] = dx
        moved[1, lane] = dz
        moved[2, lane] = dvx
        moved[3, lane] = dvz
        moved[4, lane] = lost
        moved[5, lane] = work
        moved[6, lane] = px
        moved[7, lane] = pz
        moved[8, lane] = 1.0 if plain else 0.0


def advance_lanes(
    x: FloatArray,
    ledger: FloatArray,
    held: FloatArray,
    told: NDArray[np.int64],
    plant: PantographPlant,
) -> None:
    """Move the handles over one sample; see ``body_functions``."""
    moved = local_array((9, LANES))
    step_lanes(x, held, moved, plant)
    for run in range(x.shape[0]):
        if told[run, STOP] != RAN:
            continue
        one = held_of(held, run)
        if moved[8, run] > 0.0:
            x[run, 0] = moved[6, run]
            x[run, 2] = moved[7, run]
            x[run, 3] += moved[2, run]
            x[run, 5] += moved[3, run]
            wx = one.fx * moved[0, run]
            wz = one.fz * moved[1, run]
            book_energies(ledger[run], wx, 0.0, wz, moved[4, run], moved[5, run], 0.0)
        else:
            told[run, STOP] = advance_body(x[run], ledger[run], one, plant)

"""Pantographs of several runs over one sample, as many at a time as the processor has lanes.

A sample is mostly one step of :func:`linkage_step`, without a branch: all bodies take it at once.
What needs more care (several steps, as with dry friction; a band that goes slack; the end of the
workspace) is computed again for that body alone, from where it was.
"""

from asperity.core.compiled import FloatArray, IntArray, Kernels, local_array
from asperity.simulation.kernels.batch_loop import lane_input
from asperity.simulation.kernels.body_interface import LANES, RUNNING, STOP, advance_body
from asperity.simulation.kernels.energy_ledger import add_energies
from asperity.simulation.kernels.pantograph_dynamics import (
    PantographRecord,
    StepInput,
    linkage_band_changes_state,
    linkage_reaches,
    linkage_step,
    linkage_step_count,
)

KERNELS = Kernels(provides=("advance_lanes",), shared=("advance_lanes",))


def pantograph_step_lanes(
    x: FloatArray, inputs: FloatArray, steps: FloatArray, plant: PantographRecord
) -> None:
    """Write one step of :func:`linkage_step` over a whole sample, in a column for each run.

    Rows: the results of that function, the position at the end, and 1 if one step is enough, or 0.
    """
    given = local_array((11, LANES))
    bar, hand, _friction, rate, fewest, period, share, _inside_only, least = plant
    joint = bar.joint_damping
    for lane in range(LANES):
        # A lane without a run repeats the last run.
        run = min(lane, x.shape[0] - 1)
        given[0, lane] = x[run, 0]
        given[1, lane] = x[run, 2]
        given[2, lane] = x[run, 3]
        given[3, lane] = x[run, 5]
        given[4, lane] = inputs[run, 0]
        given[5, lane] = inputs[run, 2]
        given[6, lane] = inputs[run, 3]
        given[7, lane] = inputs[run, 5]
        given[8, lane] = inputs[run, 6]
        given[9, lane] = inputs[run, 8]
        given[10, lane] = joint if inputs[run, 9] > 0.0 or not plant.inside_only else 0.0
    for lane in range(LANES):
        pull = StepInput(
            given[4, lane], given[5, lane], given[6, lane], given[7, lane], given[8, lane],
            given[9, lane], given[10, lane],
        )  # fmt: skip
        x0, z0, vx, vz = given[0, lane], given[1, lane], given[2, lane], given[3, lane]
        dx, dz, dvx, dvz, lost, work = linkage_step(x0, z0, vx, vz, pull, period, plant)
        px = x0 + dx
        pz = z0 + dz
        parts = max(fewest, linkage_step_count(vx, vz, rate, period / share, bar))
        plain = parts == 1 and linkage_reaches(px, pz, least, bar)
        plain = plain and not linkage_band_changes_state(px, pz, dx, dz, period, pull, hand)
        steps[0, lane] = dx
        steps[1, lane] = dz
        steps[2, lane] = dvx
        steps[3, lane] = dvz
        steps[4, lane] = lost
        steps[5, lane] = work
        steps[6, lane] = px
        steps[7, lane] = pz
        steps[8, lane] = 1.0 if plain else 0.0


def advance_lanes(
    x: FloatArray, ledger: FloatArray, inputs: FloatArray, progress: IntArray,
    plant: PantographRecord,
) -> None:  # fmt: skip
    """Move the handles over one sample; see ``batch_loop``."""
    moved = local_array((9, LANES))
    pantograph_step_lanes(x, inputs, moved, plant)
    for run in range(x.shape[0]):
        if progress[run, STOP] != RUNNING:
            continue
        one = lane_input(inputs, run)
        if moved[8, run] > 0.0:
            x[run, 0] = moved[6, run]
            x[run, 2] = moved[7, run]
            x[run, 3] += moved[2, run]
            x[run, 5] += moved[3, run]
            wx = one.fx * moved[0, run]
            wz = one.fz * moved[1, run]
            add_energies(ledger[run], wx, 0.0, wz, moved[4, run], moved[5, run], 0.0)
        else:
            progress[run, STOP] = advance_body(x[run], ledger[run], one, plant)

"""The loop along a path, tick after tick: what a law and its contact remember is carried on."""

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.contacts.memory import GAP, TAKEN
from asperity.kernels.law_functions import probe_tick
from asperity.kernels.storing import store_force

KERNELS = Kernels(requires=("probe_tick", "store_force"), loops=("path_batch",))


def path_batch(
    points: FloatArray, out: FloatArray, told: FloatArray, memory: FloatArray, texture: object,
    law: object,
) -> None:  # fmt: skip
    """Write the forces (n, 3) [N] along a path (n, 3) [m], the anchor released at the start.

    Args:
        points: of the path.
        out: result.
        told: result, gap [m] and looks of each tick (n, 2).
        memory: of the contact; changed.
        texture: record of the texture.
        law: parameters of the law.
    """
    ax = ay = 0.0
    held = False
    for i in range(points.shape[0]):
        memory[GAP] = 0.0
        memory[TAKEN] = 0.0
        fx, fy, fz, ax, ay, held = probe_tick(
            points[i, 0], points[i, 1], points[i, 2], ax, ay, held, memory, texture, law
        )
        store_force(out, i, (fx, fy, fz))
        told[i, 0] = memory[GAP]
        told[i, 1] = memory[TAKEN]

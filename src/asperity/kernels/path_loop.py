"""The loop along a path, which carries the state of the law and the warm start of its contact."""

from asperity.contacts.warm_start import ERROR_BOUND, EVALUATIONS
from asperity.core.compiled import FloatArray, Kernels
from asperity.kernels.loop_functions import store_force
from asperity.kernels.probe_functions import probe_tick

KERNELS = Kernels(loops=("path_batch",))


def path_batch(
    points: FloatArray,
    out: FloatArray,
    diagnostics: FloatArray,
    warm_start: FloatArray,
    texture: object,
    law: object,
) -> None:
    """Write the forces (n, 3) [N] along a path (n, 3) [m], the anchor released at the start.

    Args:
        points: of the path.
        out: result.
        diagnostics: result, error bound [m] and evaluations of each tick (n, 2).
        warm_start: of the contact; updated.
        texture: record of the texture.
        law: parameters of the law.
    """
    ax = ay = az = 0.0
    held = False
    for i in range(points.shape[0]):
        warm_start[ERROR_BOUND] = 0.0
        warm_start[EVALUATIONS] = 0.0
        fx, fy, fz, ax, ay, az, held = probe_tick(
            points[i, 0], points[i, 1], points[i, 2], ax, ay, az, held, warm_start, texture, law
        )
        store_force(out, i, (fx, fy, fz))
        diagnostics[i, 0] = warm_start[ERROR_BOUND]
        diagnostics[i, 1] = warm_start[EVALUATIONS]

"""Warm-started search for the closest surface point: it starts where the last one ended.

The start is the only state. Close to the closest point it saves the descent, and the search then
evaluates only what can be closer than the local minimum downhill from the start.

The functions at the end are for a texture kind whose search has no evaluation budget.
"""

from asperity.contacts.sampler_interface import closest_point, sample_height
from asperity.contacts.warm_start import (
    BUDGET,
    ERROR_BOUND,
    EVALUATIONS,
    FIRST_POINT,
    MAX_ERROR_BOUND,
    POINT_COUNT,
    TRUNCATED_TICKS,
)
from asperity.core.compiled import EVERY_FUNCTION, FloatArray, Kernels

KERNELS = Kernels(provides=EVERY_FUNCTION)


def record_error_bound(warm_start: FloatArray, error_bound: float, evaluations: float) -> None:
    """Record the evaluations of a tick and the error bound of its answer [m]."""
    warm_start[EVALUATIONS] = evaluations
    warm_start[ERROR_BOUND] = error_bound
    if error_bound > 0.0:
        warm_start[TRUNCATED_TICKS] += 1.0
        warm_start[MAX_ERROR_BOUND] = max(warm_start[MAX_ERROR_BOUND], error_bound)


def closest_point_warm(
    x: float, y: float, z: float, warm_start: FloatArray, texture: object
) -> tuple[float, float, float, float, float]:
    """Return X, Y, h, h_x, h_y of the closest point; the error bound goes to ``warm_start``."""
    start_x = x
    start_y = y
    if warm_start[POINT_COUNT] > 0.0:
        dx = warm_start[FIRST_POINT] - x
        dy = warm_start[FIRST_POINT + 1] - y
        dz = warm_start[FIRST_POINT + 2] - z
        straight = sample_height(x, y, texture) - z
        if dx * dx + dy * dy + dz * dz < straight * straight:
            start_x = warm_start[FIRST_POINT]
            start_y = warm_start[FIRST_POINT + 1]
    fx, fy, h, hx, hy, error_bound, evaluations = closest_point_within_budget(
        x, y, z, start_x, start_y, warm_start[BUDGET], texture
    )
    warm_start[POINT_COUNT] = 1.0
    warm_start[FIRST_POINT] = fx
    warm_start[FIRST_POINT + 1] = fy
    warm_start[FIRST_POINT + 2] = h
    record_error_bound(warm_start, error_bound, evaluations)
    return fx, fy, h, hx, hy


def closest_point_within_budget(
    x: float, y: float, z: float, start_x: float, start_y: float, budget: float, texture: object
) -> tuple[float, float, float, float, float, float, float]:
    """Return the exact closest point; see ``sampler_interface``."""
    fx, fy, h, hx, hy = closest_point(x, y, z, texture)
    return fx, fy, h, hx, hy, 0.0, 1.0


def evaluation_cost(texture: object) -> float:
    """Return 1; a texture kind that takes longer provides its own cost."""
    return 1.0

"""The closest surface point, exactly or within an evaluation budget, with an error bound.

Three quarters of a budget are for the closest point itself. If they do not suffice, the rest is for
passes over everything that can be closer; each pass prunes what is closer than the best point by
less than a fraction of its distance. The first fraction is a quarter, so that the pass ends after
few evaluations; each further pass prunes a quarter of what the one before did. The last completed
pass bounds the error. The work grows with the accuracy, as in a best-first search, but no queue is
needed.
"""

import math

import numpy as np

from asperity.contacts.closest.plane_search import descend, descend_within_budget
from asperity.contacts.sampler_interface import ROUNDING_SLACK, ClosestPoint, search_plane
from asperity.core.compiled import EPS, EVERY_FUNCTION, Kernels

KERNELS = Kernels(provides=EVERY_FUNCTION, shared=("closest_point", "closest_point_within_budget"))


def closest_point(x: float, y: float, z: float, texture: object) -> ClosestPoint:
    """Return X, Y of the globally closest surface point, and h, h_x, h_y there.

    Descend from the probe, then search everything that may be closer.
    """
    best = descend(x, y, z, x, y, texture)
    best, _budget = search_plane(x, y, z, best, 1.0 - ROUNDING_SLACK * EPS, np.inf, texture)
    return best[0], best[1], best[3], best[4], best[5]


def closest_point_within_budget(
    x: float, y: float, z: float, start_x: float, start_y: float, budget: float, texture: object
) -> tuple[float, float, float, float, float, float, float]:
    """Return the closest point found within a budget; see ``sampler_interface``."""
    best, left = descend_within_budget(x, y, z, start_x, start_y, 0.75 * budget, texture)
    best, left = search_plane(x, y, z, best, 1.0 - ROUNDING_SLACK * EPS, left, texture)
    share = 0.0 if left > 0.0 else 1.0
    left += 0.25 * budget
    # At most as many passes as there are digits; none after a complete search.
    while left > 0.0 and share > 4.0 * EPS:
        factor = 1.0 - 0.25 * share
        best, left = search_plane(x, y, z, best, factor * factor, left, texture)
        if left > 0.0:
            share *= 0.25
    gap = share * math.sqrt(best[2])
    return best[0], best[1], best[3], best[4], best[5], gap, budget - left

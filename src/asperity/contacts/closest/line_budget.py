"""Search for the closest point of a profile within a budget; see ``plane_budget``."""

import math

from asperity.contacts.closest.line_search import descend_within_budget
from asperity.contacts.sampler_interface import ROUNDING_SLACK, search_line
from asperity.contacts.sampler_interface import LinePoint as Point
from asperity.core.compiled import EPS, Kernels

KERNELS = Kernels(
    provides=("search_line_within_budget",), not_inlined=("search_line_within_budget",)
)


def search_line_within_budget(
    x: float, z: float, start: float, budget: float, texture: object
) -> tuple[Point, float, float]:
    """Return the closest point found, its error bound [m] and the evaluations used."""
    best, left = descend_within_budget(x, z, start, 0.5 * budget, texture)
    best, left = search_line(x, z, best, 1.0 - ROUNDING_SLACK * EPS, left, texture)
    share = 0.0 if left > 0.0 else 1.0
    left += 0.5 * budget
    # At most as many passes as there are digits; none after a complete search.
    while left > 0.0 and share > 4.0 * EPS:
        factor = 1.0 - 0.25 * share
        best, left = search_line(x, z, best, factor * factor, left, texture)
        if left > 0.0:
            share *= 0.25
    return best, share * math.sqrt(best[1]), budget - left

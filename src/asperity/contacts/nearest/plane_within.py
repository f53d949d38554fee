"""The nearest surface point as far as a number of looks finds it, with what was not found.

Half of the looks are for the nearest point itself. If they do not do, the others are for passes
over everything that can be nearer, and each drops what is nearer than the best by less than a
share of its distance: the first, of a quarter, ends after few looks; the next ones drop a quarter
of what the one before dropped. The last pass that comes to its end bounds what was not found. So
the work grows with what is asked, as in a search of the most promising box first, but nothing needs
to be kept.
"""

import math

from asperity.compiled import EPS, Kernels
from asperity.contacts.nearest.plane_search import go_down
from asperity.contacts.sampler import SLACK, search_plane

KERNELS = Kernels(
    provides=("foot_within",), requires=("go_down", "search_plane"), called=("foot_within",)
)


def foot_within(
    x: float, y: float, z: float, start_x: float, start_y: float, budget: float, texture: object
) -> tuple[float, float, float, float, float, float, float]:
    """Return the foot as far as a budget of looks finds it; see ``contacts.sampler``."""
    best, left = go_down(x, y, z, start_x, start_y, 0.5 * budget, texture)
    best, left = search_plane(x, y, z, best, 1.0 - SLACK * EPS, left, texture)
    share = 0.0 if left > 0.0 else 1.0
    left += 0.5 * budget
    # At most as many passes as there are digits; without an unfinished search, none.
    while left > 0.0 and share > 4.0 * EPS:
        keep = 1.0 - 0.25 * share
        best, left = search_plane(x, y, z, best, keep * keep, left, texture)
        if left > 0.0:
            share *= 0.25
    gap = share * math.sqrt(best[2])
    return best[0], best[1], best[3], best[4], best[5], gap, budget - left

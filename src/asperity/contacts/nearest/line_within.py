"""The nearest point of a profile as far as a number of looks finds it: see ``plane_within``."""

import math

from asperity.compiled import EPS, Kernels
from asperity.contacts.nearest.line_search import go_down
from asperity.contacts.sampler import SLACK, search_line
from asperity.contacts.sampler import LinePoint as Point

KERNELS = Kernels(
    provides=("line_within",), requires=("go_down", "search_line"), called=("line_within",)
)


def line_within(
    x: float, z: float, start: float, budget: float, texture: object
) -> tuple[Point, float, float]:
    """Return the foot as far as a budget of looks finds it, the gap [m], and the looks taken."""
    best, left = go_down(x, z, start, 0.5 * budget, texture)
    best, left = search_line(x, z, best, 1.0 - SLACK * EPS, left, texture)
    share = 0.0 if left > 0.0 else 1.0
    left += 0.5 * budget
    # At most as many passes as there are digits; without an unfinished search, none.
    while left > 0.0 and share > 4.0 * EPS:
        keep = 1.0 - 0.25 * share
        best, left = search_line(x, z, best, keep * keep, left, texture)
        if left > 0.0:
            share *= 0.25
    return best, share * math.sqrt(best[1]), budget - left

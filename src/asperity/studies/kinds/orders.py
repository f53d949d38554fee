"""Balanced orders of conditions, and the pairs of conditions."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from asperity.studies.design import StudyDesign


def balanced_order(count: int, participant: int) -> list[int]:
    """Return the order of the conditions for a participant.

    The Williams design: participant i has the row (s₀ + i, s₁ + i, …) modulo n, with
    s = 0, n−1, 1, n−2, …. With n even, n participants have each condition once in each place and
    each ordered pair of neighbours once; with n odd, 2n participants do so twice, every second
    n of them in the reverse order.

    Args:
        count: number of conditions n, at least 1.
        participant: number of the participant, from 0.

    References:
        E. J. Williams: Experimental designs balanced for the estimation of residual effects of
        treatments. Australian Journal of Scientific Research A 2 (1949) 149–168.

    Example:
        >>> [balanced_order(4, participant) for participant in range(4)]
        [[0, 3, 1, 2], [1, 0, 2, 3], [2, 1, 3, 0], [3, 2, 0, 1]]
    """
    first = [place // 2 if place % 2 == 0 else count - (place + 1) // 2 for place in range(count)]
    order = [(one + participant) % count for one in first]
    is_reversed = count % 2 == 1 and participant // count % 2 == 1
    return order[::-1] if is_reversed else order


def repeated_order(count: int, repeats: int, participant: int) -> Iterator[tuple[int, int]]:
    """Yield repeat and condition: each repeat has all, in the next row of the balanced square."""
    for repeat in range(repeats):
        for one in balanced_order(count, participant * repeats + repeat):
            yield repeat, one


def list_pairs(design: StudyDesign) -> list[tuple[dict[str, object], dict[str, object]]]:
    """Return all pairs of conditions.

    Raises:
        ParameterError: for fewer than two conditions.
    """
    design.check_conditions(2)
    return list(itertools.combinations(design.conditions, 2))

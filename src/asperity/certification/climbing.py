"""Random climbs: steps that grow with success and shrink without, many at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from asperity.core.checks import FloatArray

STEPS = 60
_SELECTION = 16


def climb(
    start: FloatArray,
    evaluate: Callable[[FloatArray], FloatArray],
    is_over: Callable[[], bool],
    random: np.random.Generator,
    *,
    spread: float,
    selects: bool = False,
) -> tuple[FloatArray, FloatArray]:
    """Return improved points of the unit cube and their values, the best first.

    Args:
        start: shape (n, k, 3), each number in [0, 1].
        evaluate: values of such points, shape (n,).
        is_over: whether to end.
        random: source of the steps.
        spread: standard deviation of the first steps.
        selects: whether the better half replaces the other every 16 steps.
    """
    points = start
    values = evaluate(points)
    count = len(points)
    spreads = np.full(count, spread)
    for step in range(1, STEPS + 1):
        if is_over():
            break
        moves = random.normal(size=points.shape)
        # A third of the steps move all k points alike, the others about half of them.
        is_shift = random.uniform(size=(count, 1, 1)) < 1 / 3
        is_moved = random.uniform(size=(count, points.shape[1], 1)) < 0.5
        moves = np.where(is_shift, moves[:, :1], np.where(is_moved, moves, 0.0))
        tried = 1.0 - np.abs(1.0 - np.abs(points + spreads[:, None, None] * moves) % 2.0)
        tried_values = evaluate(tried)
        is_better = tried_values > values
        points = np.where(is_better[:, None, None], tried, points)
        values = np.where(is_better, tried_values, values)
        spreads = np.where(is_better, 1.8 * spreads, 0.88 * spreads)
        spreads = np.where(spreads < 1e-6, spread, spreads)
        if selects and step % _SELECTION == 0:
            order = np.argsort(-values)
            worse = order[count // 2 :]
            better = order[: len(worse)]
            points[worse] = points[better]
            values[worse] = values[better]
            spreads[worse] = spread
    order = np.argsort(-values)
    return points[order], values[order]

"""Random climbs: steps that grow with success and shrink without, many at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from asperity.core.checks import FloatArray

_GROWTH = 1.8
_SHRINKAGE = 0.88
_LEAST_SPREAD = 1e-6
_REPEATED = 1.5


def climb(
    start: FloatArray,
    evaluate: Callable[[FloatArray], FloatArray],
    limit: Callable[[FloatArray, FloatArray], FloatArray],
    is_over: Callable[[], bool],
    random: np.random.Generator,
    spread: FloatArray,
    count: int,
) -> tuple[FloatArray, FloatArray]:
    """Return improved places and their values, the best first.

    A step that improves is repeated, longer; the others are random: of all points of a place or of
    a run of them, alike or each for itself, or along one axis, so that steps along a border exist.

    Args:
        start: places of k points each [m], shape (n, k, 3).
        evaluate: values of places, shape (n,).
        limit: ends of steps within the region, from their beginnings and their ends.
        is_over: whether to end.
        random: source of the steps.
        spread: standard deviation of the first steps along each axis [m], shape (3,).
        count: number of steps, at most.
    """
    places = start
    values = evaluate(places)
    scales = np.ones(len(places))
    steps = np.zeros_like(places)
    for _ in range(count):
        if is_over():
            break
        is_repeated = (steps != 0.0).any(axis=(1, 2))
        moves = scales[:, None, None] * spread * _random_moves(places.shape, random)
        moves = np.where(is_repeated[:, None, None], _REPEATED * steps, moves)
        tried = limit(places, places + moves)
        tried_values = evaluate(tried)
        is_better = tried_values > values
        steps = np.where(is_better[:, None, None], tried - places, 0.0)
        places = np.where(is_better[:, None, None], tried, places)
        values = np.where(is_better, tried_values, values)
        factors = np.where(is_better, _GROWTH, _SHRINKAGE)
        scales = np.where(is_repeated, scales, factors * scales)
        scales = np.where(scales < _LEAST_SPREAD, 1.0, scales)
    order = np.argsort(-values)
    return places[order], values[order]


def _random_moves(shape: tuple[int, ...], random: np.random.Generator) -> FloatArray:
    """Return moves of standard deviation 1: of all points alike, or of a run of them, (n, k, 3)."""
    number, points, _axes = shape
    moves = random.normal(size=shape)
    if points > 1:
        is_shift = random.uniform(size=(number, 1)) < 1 / 3
        is_alike = is_shift | (random.uniform(size=(number, 1)) < 0.5)
        length = np.rint(points ** random.uniform(size=(number, 1)))
        after = (np.arange(points) - random.integers(points, size=(number, 1))) % points
        is_moved = is_shift | (after < length)
        moves = np.where(is_alike[:, :, None], moves[:, :1], moves) * is_moved[:, :, None]
    is_along_axis = random.uniform(size=(number, 1, 1)) < 0.3
    axis = random.integers(3, size=(number, 1, 1))
    return np.where(is_along_axis & (axis != np.arange(3)), 0.0, moves)

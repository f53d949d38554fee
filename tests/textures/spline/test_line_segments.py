"""Segments of a line over a spline, separated at its nodes."""

from __future__ import annotations

import numpy as np
import pytest

from asperity.textures import HeightMap
from asperity.textures.domain import ScanLine
from asperity.textures.spline.spline_bounds import spline_segments

MAP = HeightMap(
    1e-5 * np.random.default_rng(2).standard_normal((9, 11)), (2e-4, 3e-4), origin=(1e-3, -2e-3)
)


def line(first: tuple[float, float], direction: tuple[float, float], length: float) -> ScanLine:
    """Return a line from a node, given by its numbers along x and y."""
    start = np.array([1e-3, -2e-3]) + np.array(first) * [2e-4, 3e-4]
    return ScanLine(start, np.array(direction), length, periodic=False)


@pytest.mark.parametrize(
    ("first", "direction", "axis", "nodes"),
    [
        ((2, 4.3), (1.0, 0.0), 0, [2, 3, 4, 5]),
        ((7, 4.3), (-1.0, 0.0), 0, [7, 6, 5]),
        ((3.6, 1), (0.0, 1.0), 1, [1, 2, 3, 4, 5, 6]),
        ((3.6, 6), (0.0, -1.0), 1, [6, 5, 4]),
    ],
)
@pytest.mark.parametrize("min_count", [1, 20])
def test_segments_between_inner_nodes_are_in_the_order_of_the_line(
    first: tuple[float, float],
    direction: tuple[float, float],
    axis: int,
    nodes: list[int],
    min_count: int,
) -> None:
    pitch = (2e-4, 3e-4)[axis]
    length = pitch * (len(nodes) - 1)
    segments = spline_segments(MAP.cells(), line(first, direction, length), min_count)
    assert segments is not None
    parts = len(segments.centres) // (len(nodes) - 1)
    assert parts == max(1, -(-min_count // (len(nodes) - 1)))
    edges = np.linspace(nodes[0], nodes[-1], parts * (len(nodes) - 1) + 1)
    np.testing.assert_allclose(segments.centres[:, axis], 0.5 * (edges[1:] + edges[:-1]))
    np.testing.assert_allclose(segments.centres[:, 1 - axis], first[1 - axis])
    assert segments.half[axis] == pytest.approx(0.5 / parts)
    assert segments.length == pytest.approx(pitch / parts)


@pytest.mark.parametrize(
    ("first", "direction", "length"),
    [
        ((2.3, 4), (1.0, 0.0), 4e-4),
        ((2, 4), (1.0, 0.0), 5e-4),
        ((-1, 4), (1.0, 0.0), 4e-4),
        ((2, 4), (0.6, 0.8), 5e-4),
    ],
)
def test_line_that_does_not_follow_an_axis_between_nodes_has_none(
    first: tuple[float, float], direction: tuple[float, float], length: float
) -> None:
    assert spline_segments(MAP.cells(), line(first, direction, length), 4) is None

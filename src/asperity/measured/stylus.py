"""Dilation by a ball, the morphological filter of ISO 16610-41: the path of a stylus tip."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
from asperity.measured.lengths import Pitch, Shape, format_length

Offsets = NDArray[np.intp]
_TILE = 256
_MAX_COMPARISONS = 5e10  # about a minute at 1 to 3 ns each
_CHECK_EVERY = 32


def dilate(heights: FloatArray, pitch: Pitch, radius: float) -> FloatArray:
    """Return the path of the lowest point of a ball that slides over the surface.

    d(x) = max over |u| < R of h(x + u) + √(R² - |u|²) - R, over the nodes: the locus of the ball's
    centre, lowered by its radius, as recorded by a stylus instrument and felt with a probe of that
    radius. The radius of a crest grows by R; a groove that the ball cannot enter becomes a crease.
    The surface is mirrored at its border nodes.

    Offsets at which the ball has risen by more than the height range of the neighbourhood cannot
    attain the maximum and are omitted: the work depends on √(2 R · range) rather than on R.

    Args:
        heights: [m], shape (ny, nx) or (n,), finite.
        pitch: (px, py) or (px,) [m].
        radius: R [m].

    Returns:
        The dilated heights [m], same shape; nowhere below the surface.

    Raises:
        ParameterError: the radius is not positive, or needs too much work.

    Reference:
        ISO 16610-41, dilation by a disk; for a map the same with a ball.

    Example:
        >>> spike = np.array([0.0, 0, 0, 0, 1, 0, 0, 0, 0])
        >>> dilate(spike, (1.0,), 2.0).round(3)
        array([0.   , 0.   , 0.   , 0.732, 1.   , 0.732, 0.   , 0.   , 0.   ])
    """
    check_positive("tip_radius", radius, "m")
    span = float(heights.max()) - float(heights.min())
    offsets, drops = _ball_offsets(heights.shape, pitch, radius, span)
    if len(drops) * heights.size > _MAX_COMPARISONS:
        raise ParameterError(
            "tip_radius",
            f"needs {len(drops)} comparisons at each of {heights.size} points, too many to wait"
            " for; crop the map or take every second point",
            radius,
        )
    return _dilate_tiles(heights, offsets, drops) if len(drops) else np.array(heights)


def check_tip_radius(shape: Shape, pitch: Pitch, radius: float) -> None:
    """Refuse a tip that is larger than the surface.

    Raises:
        ParameterError: the radius is not positive, or exceeds the shorter side.
    """
    check_positive("tip_radius", radius, "m")
    extent = min((n - 1) * p for n, p in zip(shape[::-1], pitch, strict=True))
    if radius > extent * (1 + 5e-7):
        raise ParameterError(
            "tip_radius",
            f"must be at most the surface's shorter side, {format_length(extent)} [m]",
            radius,
        )


def apply_tip(heights: FloatArray, pitch: Pitch, radius: float) -> tuple[FloatArray, str]:
    """Return the heights felt with a tip of that radius, and a sentence about the change.

    Raises:
        ParameterError: :func:`check_tip_radius` refuses the radius, or it needs too much work.
    """
    check_tip_radius(heights.shape, pitch, radius)
    felt = dilate(heights, pitch, radius)
    change = felt - heights
    raised = float((change > 0).mean())
    body = "disk" if heights.ndim == 1 else "ball"
    sentence = (
        f"felt with a tip of radius {format_length(radius)}: dilation by a {body} (as in ISO"
        f" 16610-41) lowered by the radius, heights raised at {raised:.3g} of the points, by"
        f" {format_length(float(np.sqrt(np.mean(change**2))))} RMS and at most"
        f" {format_length(float(change.max()))}"
    )
    return felt, sentence


def _ball_offsets(
    shape: Shape, pitch: Pitch, radius: float, span: float
) -> tuple[Offsets, FloatArray]:
    """Return offsets in samples, (m, axes), y first, and the ball's drops [m] there, sorted."""
    # Where the ball has risen by more than the height range, the point below its centre is higher.
    reach = math.sqrt(max(span * (2.0 * radius - span), 0.0)) if span < radius else radius
    limits = [math.floor(reach / p * (1 + 1e-12)) for p in pitch[::-1]]
    counts = np.minimum(limits, np.array(shape) - 1)
    grids = np.meshgrid(*(np.arange(-count, count + 1) for count in counts), indexing="ij")
    offsets = np.stack([grid.ravel() for grid in grids], axis=1)
    squares = ((offsets * np.array(pitch[::-1])) ** 2).sum(axis=1)
    used = (squares > 0.0) & (squares <= reach**2 * (1 + 1e-12))
    offsets, squares = offsets[used], squares[used]
    # R - √(R² - u²), without cancellation for large balls.
    drops = squares / (radius + np.sqrt(np.maximum(radius**2 - squares, 0.0)))
    order = np.argsort(drops, kind="stable")
    return offsets[order], drops[order]


def _dilate_tiles(heights: FloatArray, offsets: Offsets, drops: FloatArray) -> FloatArray:
    """Dilate tile by tile, which fit into the cache, up to the reach that each tile needs."""
    result, shape = np.array(heights), heights.shape
    reach = tuple(int(r) for r in np.abs(offsets).max(axis=0))
    starts = np.indices([math.ceil(n / _TILE) for n in shape]).reshape(len(shape), -1).T * _TILE
    for start in starts:
        stop = np.minimum(start + _TILE, shape)
        rows = [
            _mirrored_indices(a - r, b + r, n)
            for a, b, r, n in zip(start, stop, reach, shape, strict=True)
        ]
        around = heights[np.ix_(*rows)]
        tile = result[tuple(slice(a, b) for a, b in zip(start, stop, strict=True))]
        _dilate_tile(around, tile, offsets + np.array(reach), drops)
    return result


def _dilate_tile(
    neighbourhood: FloatArray, tile: FloatArray, corners: Offsets, drops: FloatArray
) -> None:
    highest = float(neighbourhood.max())
    work = np.empty_like(tile)
    for k, (corner, drop) in enumerate(zip(corners, drops, strict=True)):
        if k % _CHECK_EVERY == 0 and highest - drop <= float(tile.min()):
            return
        window = tuple(slice(c, c + n) for c, n in zip(corner, tile.shape, strict=True))
        np.subtract(neighbourhood[window], drop, out=work)
        np.maximum(tile, work, out=tile)


def _mirrored_indices(first: int, stop: int, count: int) -> Offsets:
    """Return the indices from first to stop of a line mirrored at its ends."""
    period = 2 * (count - 1)
    index = np.arange(first, stop) % period
    return np.minimum(index, period - index)

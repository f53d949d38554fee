"""What a ball of a given radius feels: the morphological filters of ISO 16610-41."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.measured.length_words import length_text, positive_number

_TILE = 256
# Comparisons that are worth waiting for: about a minute at 1 to 3 ns each.
_MOST_COMPARISONS = 5e10
_CHECK_EVERY = 32


def dilate(heights: FloatArray, pitch: tuple[float, ...], radius: float) -> FloatArray:
    """Return the path of the lowest point of a ball that is dragged over the surface.

    d(x) = max over |u| < R of h(x + u) + √(R² - |u|²) - R, over the nodes: the locus of the
    ball's centre, lowered by its radius, which is what a stylus instrument records and what the
    centre of a probe of that radius feels. A crest gets rounder by R, a groove that the ball
    cannot enter becomes a crease. The surface is mirrored at its border nodes.

    Offsets whose ball height lies deeper than the height range of the neighbourhood cannot win
    and are left out, so that the work depends on √(2 R · range) rather than on R.

    Args:
        heights: [m], shape (ny, nx) or (n,), finite.
        pitch: (px, py) or (px,) [m].
        radius: R [m].

    Returns:
        The dilated heights [m], same shape; nowhere below the surface.

    Raises:
        ParameterError: for a radius that is not positive, or that needs too much work.

    Reference:
        ISO 16610-41, dilation by a disk; for a map the same with a ball.

    Example:
        >>> spike = np.array([0.0, 0, 0, 0, 1, 0, 0, 0, 0])
        >>> dilate(spike, (1.0,), 2.0).round(3)
        array([0.   , 0.   , 0.   , 0.732, 1.   , 0.732, 0.   , 0.   , 0.   ])
    """
    positive_number("tip_radius", radius)
    span = float(heights.max()) - float(heights.min())
    offsets, drops = _ball(heights.shape, pitch, radius, span)
    if len(drops) * heights.size > _MOST_COMPARISONS:
        raise ParameterError(
            "tip_radius",
            f"needs {len(drops)} comparisons at each of {heights.size} points, too many to wait"
            " for; crop the map or take every second point",
            radius,
        )
    result = np.array(heights)
    if len(drops):
        _dilate_tiles(heights, result, offsets, drops)
    return result


def check_radius(shape: tuple[int, ...], pitch: tuple[float, ...], radius: float) -> None:
    """Refuse a tip that is no ball, or larger than the surface.

    Raises:
        ParameterError: for a radius that is not positive, or beyond the shorter side.
    """
    positive_number("tip_radius", radius)
    extent = min((n - 1) * p for n, p in zip(shape[::-1], pitch, strict=True))
    if radius > extent * (1 + 5e-7):
        raise ParameterError(
            "tip_radius",
            f"must be at most the surface's shorter side, {length_text(extent)} [m]",
            radius,
        )


def apply_tip(
    heights: FloatArray, pitch: tuple[float, ...], radius: float
) -> tuple[FloatArray, str]:
    """Return what a tip of that radius feels, and a sentence that says so.

    Raises:
        ParameterError: for a radius that :func:`check_radius` refuses, or that needs too much
            work.
    """
    check_radius(heights.shape, pitch, radius)
    felt = dilate(heights, pitch, radius)
    change = felt - heights
    raised = float((change > 0).mean())
    body = "disk" if heights.ndim == 1 else "ball"
    sentence = (
        f"felt with a tip of radius {length_text(radius)}: dilation by a {body} (as in ISO"
        f" 16610-41) lowered by the radius, heights raised at {raised:.3g} of the points, by"
        f" {length_text(float(np.sqrt(np.mean(change**2))))} RMS and at most"
        f" {length_text(float(change.max()))}"
    )
    return felt, sentence


def _ball(
    shape: tuple[int, ...], pitch: tuple[float, ...], radius: float, span: float
) -> tuple[NDArray[np.intp], FloatArray]:
    """Return offsets in samples, (m, axes), y first, and the ball's drops [m] there, sorted."""
    # Where the ball has risen by more than the range of heights, the point below it wins.
    reach = math.sqrt(max(span * (2.0 * radius - span), 0.0)) if span < radius else radius
    counts = [
        min(math.floor(reach / p * (1 + 1e-12)), n - 1)
        for n, p in zip(shape, pitch[::-1], strict=True)
    ]
    grids = np.meshgrid(*(np.arange(-count, count + 1) for count in counts), indexing="ij")
    offsets = np.stack([grid.ravel() for grid in grids], axis=1)
    squares = ((offsets * np.array(pitch[::-1])) ** 2).sum(axis=1)
    kept = (squares > 0.0) & (squares <= reach**2 * (1 + 1e-12))
    offsets, squares = offsets[kept], squares[kept]
    # R - √(R² - u²), without cancellation for large balls.
    drops = squares / (radius + np.sqrt(np.maximum(radius**2 - squares, 0.0)))
    order = np.argsort(drops, kind="stable")
    return offsets[order], drops[order]


def _dilate_tiles(
    heights: FloatArray, result: FloatArray, offsets: NDArray[np.intp], drops: FloatArray
) -> None:
    """Compare in tiles that stay in the cache, each as far as its own heights ask for."""
    shape = heights.shape
    reach = tuple(int(r) for r in np.abs(offsets).max(axis=0))
    starts = np.indices([math.ceil(n / _TILE) for n in shape]).reshape(len(shape), -1).T * _TILE
    for start in starts:
        stop = np.minimum(start + _TILE, shape)
        rows = [
            _mirrored(a - r, b + r, n) for a, b, r, n in zip(start, stop, reach, shape, strict=True)
        ]
        around = heights[np.ix_(*rows)]
        tile = result[tuple(slice(a, b) for a, b in zip(start, stop, strict=True))]
        _dilate_tile(around, tile, offsets + np.array(reach), drops)


def _dilate_tile(
    around: FloatArray, tile: FloatArray, corners: NDArray[np.intp], drops: FloatArray
) -> None:
    highest = float(around.max())
    work = np.empty_like(tile)
    for k, (corner, drop) in enumerate(zip(corners, drops, strict=True)):
        if k % _CHECK_EVERY == 0 and highest - drop <= float(tile.min()):
            return
        window = tuple(slice(c, c + n) for c, n in zip(corner, tile.shape, strict=True))
        np.subtract(around[window], drop, out=work)
        np.maximum(tile, work, out=tile)


def _mirrored(first: int, stop: int, count: int) -> NDArray[np.intp]:
    """Return the indices from first to stop of a line that is mirrored at its ends."""
    period = 2 * (count - 1)
    index = np.arange(first, stop) % period
    return np.minimum(index, period - index)

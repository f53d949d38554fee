"""The lattice of a spline from which its closest points are found; see ``lattice_search``."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.processes import run_in_threads
from asperity.textures.spline import lattice_search
from asperity.textures.spline.bspline_kernels import SplineArguments
from asperity.textures.spline.lattice_search import LatticeArguments
from asperity.textures.texture import Texture

# Least number of places beyond the borders of the texture.
_LEAST_PADDING = 5
# Nodes of the lattice per node of the spline, at least, and the most from one place to the next.
_NODES_PER_PITCH = 2.0
_MAX_STRIDE = 4


def build_lattice(
    spline: Texture, pitches: Sequence[float], spacing: Sequence[float], z: FloatArray
) -> LatticeArguments:
    """Return the record of a spline with a lattice.

    Args:
        spline: the texture.
        pitches: distance of its nodes along each axis [m].
        spacing: greatest distance of the places along each axis [m].
        z: of the levels, rising [m].
    """
    low, top = spline.extremes
    lengths = np.hypot(*spline.domain.spans.T)
    counts = np.ceil(lengths / spacing)
    nodes = _NODES_PER_PITCH * lengths / (counts * pitches)
    stride = min(math.ceil(float(nodes.max())), _MAX_STRIDE)
    sides = lengths / (stride * counts)
    # A point farther away than one above the lowest level is not the closest; nor is one much
    # farther away than the deepest place, where the texture repeats.
    reach = min(math.sqrt((top - low) * (top + low - 2.0 * z[0])), lengths.max() / len(lengths))
    reach = max(reach, top - low)
    x, *others = [
        _axis_nodes(start, side, int(count), stride, reach)
        for start, side, count in zip(spline.domain.origin, sides, counts, strict=False)
    ]
    y = others[0] if others else spline.domain.origin[1:]
    points = np.stack(np.meshgrid(x, y), axis=-1)
    heights = spline.height(points.reshape(-1, 2)).reshape(points.shape[:2])
    rows = (len(y) - 1) // stride + 1
    columns = (len(x) - 1) // stride + 1
    numbers = dict(zip(SplineArguments._fields, spline.arguments, strict=True))
    lattice = LatticeArguments(
        **numbers,
        heights=heights,
        nearest=np.empty((len(z), rows, columns), np.int32),
        first_x=float(x[0]),
        first_y=float(y[0]),
        z=z,
        stride=stride,
        side_x=float(sides[0]),
        side_y=float(sides[-1]),
    )
    _fill_levels(lattice)
    return lattice


def _axis_nodes(start: float, side: float, count: int, stride: int, reach: float) -> FloatArray:
    """Return the nodes along an axis [m]: those of the texture and as many places as it reaches."""
    padding = math.ceil(reach / (stride * side)) + _LEAST_PADDING
    nodes = np.arange(-padding * stride, (count + padding) * stride + 1)
    return np.asarray(start + side * nodes)


def _fill_levels(lattice: LatticeArguments) -> None:
    """Write the nearest nodes of each level, in threads."""
    from asperity.kernels.fuse import fuse_module

    loops = fuse_module(lattice_search)
    rows, columns = lattice.heights.shape
    longer = max(rows, columns)

    def fill(level: int) -> None:
        loops.nearest_nodes(
            lattice.heights,
            lattice.z[level],
            lattice.stride,
            lattice.side_x,
            lattice.side_y,
            np.empty((rows + 1, longer)),
            np.empty((rows, lattice.nearest.shape[2]), np.int32),
            np.empty(longer, np.int32),
            np.empty(longer + 1),
            lattice.nearest[level],
        )

    run_in_threads(fill, range(len(lattice.nearest)), None)

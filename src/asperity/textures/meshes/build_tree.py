"""The bounding-box tree of a mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.textures.meshes.triangle_tree import LEAF_SIZE, TriangleTree


def build_tree(triangles: FloatArray) -> TriangleTree:
    """Return the tree of triangles (n, 3, 3) [m].

    Each node is halved at the median along the longest side of the box of its triangles' centres.
    The last leaf is filled with triangles of no extent.
    """
    leaves = 1
    while leaves * LEAF_SIZE < len(triangles):
        leaves *= 2
    order = _median_order(triangles, leaves)
    ordered = triangles[np.minimum(order, len(triangles) - 1)]
    ordered[order >= len(triangles)] = triangles[-1, 0]
    boxes = np.empty((2 * leaves - 1, 6), np.float32)
    _write_boxes(ordered.reshape(leaves, 3 * LEAF_SIZE, 3), boxes)
    return TriangleTree(ordered.reshape(-1, 9), boxes, leaves)


def _median_order(triangles: FloatArray, leaves: int) -> NDArray[np.int32]:
    """Return the indices of the triangles in the order of the leaves."""
    order = np.arange(leaves * LEAF_SIZE, dtype=np.int32)[None]
    centres = np.empty((order.size, 3), np.float32)
    centres[: len(triangles)] = triangles.mean(axis=1)
    centres[len(triangles) :] = triangles[-1, 0]
    while len(order) < leaves:
        places = centres[order]
        axis = np.ptp(places, axis=1).argmax(axis=1)
        keys = np.take_along_axis(places, axis[:, None, None], axis=2)[..., 0]
        del places
        half = order.shape[1] // 2
        parts = np.argpartition(keys, half, axis=1).astype(np.int32)
        order = np.take_along_axis(order, parts, axis=1).reshape(-1, half)
    return order.ravel()


def _write_boxes(corners: FloatArray, boxes: NDArray[np.float32]) -> None:
    """Write the boxes of all nodes, rounded outwards, from the corners (leaves, m, 3)."""
    leaves = len(corners)
    last = boxes[leaves - 1 :]
    lower = corners.min(axis=1).astype(np.float32)
    upper = corners.max(axis=1).astype(np.float32)
    last[:, :3] = np.nextafter(lower, np.float32(-np.inf))
    last[:, 3:] = np.nextafter(upper, np.float32(np.inf))
    while leaves > 1:
        children = boxes[leaves - 1 : 2 * leaves - 1].reshape(-1, 2, 6)
        leaves //= 2
        parents = boxes[leaves - 1 : 2 * leaves - 1]
        parents[:, :3] = children[:, :, :3].min(axis=1)
        parents[:, 3:] = children[:, :, 3:].max(axis=1)

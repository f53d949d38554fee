"""Work of baked fields along closed paths, in the compiled tick."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.fields.field_record import KNOT, FieldArguments
from asperity.textures.fields.potential_field import PotentialField

K = 1000.0
DEPTH = 0.15e-3
MAX_CROSSINGS = 4
# Exact to degree 11, that of the force along a segment between knots.
GAUSS, WEIGHTS = np.polynomial.legendre.leggauss(6)
BISECTIONS, SAMPLES = 50, 40

Force = Callable[[FloatArray], FloatArray]


def knot_shares(start: FloatArray, end: FloatArray, field: FieldArguments) -> FloatArray:
    """Return the shares of edges (n, 3) at which they cross knots, (n, 3, crossings)."""
    rates = np.array([[field.m00, field.m10], [field.m01, field.m11]])
    a, b = ((points[:, :2] - [field.x0, field.y0]) @ rates for points in (start, end))
    knots = np.floor(np.minimum(a, b) + 0.5)[..., None] + 0.5 + np.arange(MAX_CROSSINGS)
    levels = field.z0 + (np.arange(field.levels + MAX_CROSSINGS) - 0.5) / field.iz
    levels[: len(field.stretched_cells)] = field.stretched_cells[:, KNOT]
    first = np.searchsorted(levels, np.minimum(start[:, 2], end[:, 2]), "right")
    upward = levels[first[:, None] + np.arange(MAX_CROSSINGS)]
    knots = np.concatenate([knots, upward[:, None]], axis=1)
    a, b = np.column_stack([a, start[:, 2]]), np.column_stack([b, end[:, 2]])
    assert (np.maximum(a, b) < knots[..., -1]).all()  # no more crossings than are looked for
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = (knots - a[..., None]) / (b - a)[..., None]
    return np.asarray(np.nan_to_num(shares, posinf=1.0, neginf=0.0))


def edge_work(
    force: Force, start: FloatArray, end: FloatArray, field: FieldArguments
) -> FloatArray:
    """Return the work along edges (n, 3), each split where it crosses knots or the surface."""
    shares = knot_shares(start, end, field)
    shares = np.sort(np.clip(shares.reshape(len(start), -1), 0.0, 1.0), axis=1)
    shares = np.pad(shares, [(0, 0), (1, 1)], constant_values=(0.0, 1.0))
    shares = np.sort(np.hstack([shares, surface_crossings(force, start, end, shares)]), axis=1)
    lengths = np.diff(shares, axis=1)
    at = shares[:, :-1, None] + 0.5 * (1.0 + GAUSS) * lengths[..., None]
    points = start[:, None, None] + at[..., None] * (end - start)[:, None, None]
    along = np.einsum(
        "...d,...d->...",
        force(points.reshape(-1, 3)).reshape(points.shape),
        np.broadcast_to((end - start)[:, None, None], points.shape),
    )
    return np.asarray(0.5 * np.einsum("nsg,ns,g->n", along, lengths, WEIGHTS))


def surface_crossings(
    force: Force, start: FloatArray, end: FloatArray, shares: FloatArray
) -> FloatArray:
    """Return the shares (n, segments) of edges at which a force begins or ends, else 0."""
    points = start[:, None] + shares[..., None] * (end - start)[:, None]
    pressed = np.any(force(points.reshape(-1, 3)), axis=1).reshape(shares.shape)
    row, segment = np.nonzero(np.diff(pressed, axis=1))
    low, high, first = shares[row, segment], shares[row, segment + 1], pressed[row, segment]
    for _ in range(BISECTIONS if len(row) > 0 else 0):
        middle = 0.5 * (low + high)
        same = force(start[row] + middle[:, None] * (end - start)[row]).any(axis=1) == first
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    crossings = np.zeros((len(start), shares.shape[1] - 1))
    crossings[row, segment] = low
    return crossings


def random_triangles(surface: Surface, count: int, seed: int) -> FloatArray:
    """Return closed paths (n, 3, 3) of up to three nodes a side, most of them near the surface."""
    texture, rng = surface.texture, np.random.default_rng(seed)
    assert isinstance(texture, PotentialField)
    centre = rng.uniform(-4e-3, 8e-3, (count, 1, 3))
    low, top = texture.grid.floor + 6e-5, texture.extremes[1] + 2e-5
    centre[..., 2] = top - (top - low) * rng.uniform(size=(count, 1)) ** 2
    return np.asarray(centre + rng.uniform(-5e-5, 5e-5, (count, 3, 3)))


def triangle_work(
    force: Force, loops: FloatArray, field: FieldArguments
) -> tuple[FloatArray, FloatArray]:
    """Return the work of each edge of triangles (n, 3, 3), and k l² of each triangle [J]."""
    ends = np.roll(loops, -1, axis=1)
    scale = K * np.square(np.linalg.norm(ends - loops, axis=-1).max(axis=1))
    work = edge_work(force, loops.reshape(-1, 3), ends.reshape(-1, 3), field)
    return work.reshape(-1, 3), scale


def may_leave_twice(force: Force, loops: FloatArray, field: FieldArguments) -> NDArray[np.bool_]:
    """Return which triangles (n, 3, 3) may leave the surface twice between two knots.

    Their work is not summed exactly. Others are at least a tenth of a spacing deep at closely
    spaced samples, or outside.
    """
    share = np.arange(SAMPLES)[:, None] / SAMPLES
    points = loops[:, :, None] + share * (np.roll(loops, -1, axis=1) - loops)[:, :, None]
    size = np.linalg.norm(force(points.reshape(-1, 3)), axis=1).reshape(len(loops), -1) / K
    return np.asarray(((size > 0.0) & (size < 0.1 / field.iz)).any(axis=1))


def ellipse(surface: Surface, vertices: int) -> FloatArray:
    """Return the ellipse of 87 x 81 µm at (1.223, 1.288) mm on which a search once gained."""
    angle = 2.0 * np.pi * np.arange(vertices) / vertices
    depth = np.full(vertices, surface.texture.extremes[1] - 0.14e-3)
    return np.column_stack(
        [1.223e-3 + 43.5e-6 * np.cos(angle), 1.288e-3 + 40.5e-6 * np.sin(angle), depth]
    )

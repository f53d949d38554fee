"""Work of baked fields along closed paths, integrated exactly between the knots of the spline."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

import asperity as asp
from asperity.analysis import loop_work
from asperity.contacts.warm_start import new_warm_start
from asperity.core.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.fields.field_sampler import FieldArguments
from asperity.textures.fields.potential_field import PotentialField

K = 1000.0
DEPTH = 0.15e-3
MAX_CROSSINGS = 4
# Exact to degree 7: along a segment between knots the force is a polynomial of degree 5.
GAUSS, WEIGHTS = np.polynomial.legendre.leggauss(4)


@cache
def cloth(max_gain: float | None) -> Surface:
    """Return baked cloth, which repeats after 3.36 mm."""
    return asp.bake(Surface("cloth", "H", K, max_depth=DEPTH), 40e-6, max_gain=max_gain)


def node_coordinates(points: FloatArray, field: FieldArguments) -> FloatArray:
    rates = np.diag([0.0, 0.0, field.iz])
    rates[:2, :2] = [[field.m00, field.m01], [field.m10, field.m11]]
    return np.asarray((points - [field.x0, field.y0, field.z0]) @ rates.T)


def edge_work(
    force: Callable[[FloatArray], FloatArray],
    start: FloatArray,
    end: FloatArray,
    field: FieldArguments,
) -> FloatArray:
    """Return the work along edges (n, 3), each split at the knots that it crosses."""
    a, b = node_coordinates(start, field), node_coordinates(end, field)
    knots = np.floor(np.minimum(a, b) + 0.5)[..., None] + 0.5 + np.arange(MAX_CROSSINGS)
    assert (np.maximum(a, b) < knots[..., -1]).all()  # no more crossings than are looked for
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = np.nan_to_num((knots - a[..., None]) / (b - a)[..., None], posinf=1.0, neginf=0.0)
    shares = np.sort(np.clip(shares.reshape(len(a), -1), 0.0, 1.0), axis=1)
    shares = np.pad(shares, [(0, 0), (1, 1)], constant_values=(0.0, 1.0))
    lengths = np.diff(shares, axis=1)
    at = shares[:, :-1, None] + 0.5 * (1.0 + GAUSS) * lengths[..., None]
    points = start[:, None, None] + at[..., None] * (end - start)[:, None, None]
    along = np.einsum(
        "...d,...d->...",
        force(points.reshape(-1, 3)).reshape(points.shape),
        np.broadcast_to((end - start)[:, None, None], points.shape),
    )
    return np.asarray(0.5 * np.einsum("nsg,ns,g->n", along, lengths, WEIGHTS))


def random_triangles(surface: Surface, count: int, seed: int) -> FloatArray:
    """Return closed paths (n, 3, 3) of up to three nodes a side, in and around the body."""
    texture, rng = surface.texture, np.random.default_rng(seed)
    assert isinstance(texture, PotentialField)
    centre = rng.uniform(-4e-3, 8e-3, (count, 1, 3))
    low, top = texture.grid.floor + 1e-4, texture.extremes[1] + 2e-5
    centre[..., 2] = rng.uniform(low, top, (count, 1))
    return np.asarray(centre + rng.uniform(-5e-5, 5e-5, (count, 3, 3)))


@pytest.mark.parametrize(("max_gain", "count"), [(None, 100_000), (1.15, 5_000)])
def test_random_loops_in_compiled_ticks_gain_nothing(max_gain: float | None, count: int) -> None:
    """|work| <= 1e-12 k l², l the longest edge; the same sum for law A does not vanish."""
    surface = cloth(max_gain)
    field = surface.texture.arguments
    worst, of_a, largest = 0.0, 0.0, 0.0
    for part in range(count // 2500):
        loops = random_triangles(surface, 2500, part)
        edges = np.linalg.norm(np.roll(loops, -1, axis=1) - loops, axis=-1)
        scale = K * edges.max(axis=1) ** 2
        start, end = loops.reshape(-1, 3), np.roll(loops, -1, axis=1).reshape(-1, 3)
        parts = edge_work(surface.trace, start, end, field).reshape(-1, 3)
        worst = max(worst, float((np.abs(parts.sum(axis=1)) / scale).max()))
        largest = max(largest, float((np.abs(parts) / scale[:, None]).max()))
        if part == 0:
            control = Surface("cloth", "A", K, max_depth=DEPTH)
            parts = edge_work(control.force, start, end, field).reshape(-1, 3)
            of_a = float((np.abs(parts.sum(axis=1)) / scale).max())
    assert worst <= 1e-12
    assert largest > 1.0  # of each edge alone
    assert of_a > 0.1


def ellipse(surface: Surface, vertices: int) -> FloatArray:
    """Return the ellipse of 87 x 81 µm at (1.223, 1.288) mm on which a search once gained."""
    angle = 2.0 * np.pi * np.arange(vertices) / vertices
    depth = np.full(vertices, surface.texture.extremes[1] - 0.14e-3)
    return np.column_stack(
        [1.223e-3 + 43.5e-6 * np.cos(angle), 1.288e-3 + 40.5e-6 * np.sin(angle), depth]
    )


@pytest.mark.parametrize("turns", [1, 5])
def test_ellipse_on_cloth_gains_nothing(turns: int) -> None:
    """Each turn repeats the forces of the first; laws B and G do work on the same ellipse."""
    surface = cloth(None)
    path = ellipse(surface, 1334)
    end = np.roll(path, -1, axis=0)
    work = edge_work(surface.force, path, end, surface.texture.arguments)
    scale = K * 87e-6**2
    assert np.abs(work).sum() > 0.1 * scale
    assert abs(work.sum()) <= 1e-12 * scale
    traced = surface.trace(np.tile(path, (turns, 1))).reshape(turns, -1, 3)
    assert np.array_equal(traced, np.broadcast_to(surface.force(path), traced.shape))
    for law in "BG":
        control = Surface("cloth", law, K, max_depth=DEPTH)
        assert abs(loop_work(control, path[::8])) > 1e-3 * scale


def test_held_forces_of_a_truncated_search_do_work_on_the_ellipse() -> None:
    """Ticks that hold their force: those of the field do the work of holding alone."""
    path = ellipse(cloth(None), 1334)
    moves = np.roll(path, -1, axis=0) - path
    exact = Surface("cloth", "H", K, max_depth=DEPTH)
    truncated = exact.trace(path, new_warm_start(50))
    field, searched = (
        float((force * moves).sum()) for force in (cloth(None).force(path), truncated)
    )
    assert abs(field) < 3e-8
    assert abs(searched) > 1e-7

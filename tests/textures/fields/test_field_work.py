"""Work of baked fields along closed paths, integrated exactly between the knots of the spline."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from bench.stress.field_loops import (
    DEPTH,
    K,
    edge_work,
    ellipse,
    may_leave_twice,
    random_triangles,
    triangle_work,
)

import asperity as asp
from asperity.analysis import loop_work
from asperity.contacts.warm_start import new_warm_start
from asperity.core.checks import FloatArray
from asperity.surface import Surface


@cache
def cloth(max_gain: float | None) -> Surface:
    """Return cloth, which repeats after 3.36 mm, baked with cells that grow to 1 mm below it."""
    surface = Surface("cloth", "H", K, max_depth=DEPTH)
    baked = asp.bake(surface, 40e-6, press=1.0, max_gain=max_gain)
    assert len(baked.texture.arguments.stretched_cells) > 5
    return baked


@pytest.mark.parametrize(("max_gain", "count"), [(None, 10_000), (1.15, 5_000)])
def test_random_loops_in_compiled_ticks_gain_nothing(max_gain: float | None, count: int) -> None:
    """|work| <= 1e-12 k l², l the longest edge; the same sum for law A does not vanish."""
    surface = cloth(max_gain)
    field = surface.texture.arguments
    worst, of_a, largest, brushing = 0.0, 0.0, 0.0, list[FloatArray]()
    for part in range(count // 2500):
        loops = random_triangles(surface, 2500, part)
        parts, scale = triangle_work(surface.trace, loops, field)
        total = np.abs(parts.sum(axis=1)) / scale
        rough = may_leave_twice(surface.trace, loops, field)
        assert rough.mean() < 0.3
        worst = max(worst, float(total[~rough].max()))
        brushing.append(total[rough])
        largest = max(largest, float((np.abs(parts) / scale[:, None]).max()))
        if part == 0:
            control = Surface("cloth", "A", K, max_depth=DEPTH)
            parts, _scale = triangle_work(control.force, loops, field)
            of_a = float((np.abs(parts.sum(axis=1)) / scale).max())
    assert worst <= 1e-12
    # Where a path leaves the surface twice between two knots, the sum is not exact.
    rest = np.concatenate(brushing)
    assert np.mean(rest <= 1e-12) > 0.99
    assert rest.max() < 1e-3
    assert largest > 1.0  # of each edge alone
    assert of_a > 0.1


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

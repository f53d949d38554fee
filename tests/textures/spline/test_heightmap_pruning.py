"""Pruned cells hold no closer point, and hardly more cells could be pruned."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from tests.textures.spline.test_heightmap_windows import (
    CENTRE,
    PITCH,
    cubic,
    linked_sampler,
    minimum,
    probes,
    record_of,
    rough,
    squares,
)

from asperity.core.checks import FloatArray
from asperity.textures.spline import heightmap_pruning as pruning
from asperity.textures.spline import heightmap_sampler as heightmap
from asperity.textures.spline import heightmap_search as search
from asperity.textures.spline.bspline_kernels import bspline_weights
from asperity.textures.spline.heightmap_sampler import HeightMapArguments

__all__ = ["linked_sampler"]  # an autouse fixture


def basis(s: float) -> list[float]:
    return [math.comb(3, m) * s**m * (1.0 - s) ** (3 - m) for m in range(4)]


def test_bernstein_coefficients_of_the_spline_the_square_and_the_parts() -> None:
    rng = np.random.default_rng(55)
    c, t = rng.normal(size=4), 0.37
    parts = pruning.subdivide_cubic(t, *c)
    for s in np.linspace(0.0, 1.0, 6):
        spline = float(np.dot(bspline_weights(s), c))
        assert np.dot(basis(s), pruning.cubic_bernstein(*c)) / 6.0 == pytest.approx(
            spline, abs=1e-14
        )
        assert np.dot(basis(s), pruning.square_bernstein(t)) == pytest.approx(
            (s - t) ** 2, abs=1e-14
        )
        for part, place in ((parts[:4], t * s), (parts[3:], t + (1.0 - t) * s)):
            whole = np.dot(basis(place), c)
            assert np.dot(basis(s), part) == pytest.approx(whole, abs=1e-14)


def least(probe: FloatArray, i: int, j: int, texture: HeightMapArguments) -> float:
    """Return the least coefficient in a cell, evaluated in the middle of eight cells."""
    x, y, z = map(float, probe)
    first = min(max(j - 4, 0), heightmap.cell_counts(texture.c)[0] - 8)
    row = np.empty(8)
    pruning.min_coefficients_in_row(x, y, z, i, first, 8, row, texture)
    return float(row[j - first])


def test_pruned_cells_hold_no_closer_point() -> None:
    """Many pruned cells are left open by the spline coefficients."""
    rng = np.random.default_rng(54)
    pruned, more, lost = 0, 0, 0
    for seed in range(3):
        texture = rough(seed, 90e-6)
        for probe in probes(texture, rng, 20):
            phi = squares(texture, probe)
            enough = float(phi.min()) * rng.uniform(0.9, 1.3)
            for i, j in np.argwhere(phi < 1.5 * enough).tolist():
                bound = least(probe, i, j, texture.arguments)
                if bound >= enough:
                    assert phi[i, j] >= enough
                    pruned += 1
                    cell = (j, j, i, i)
                    g = float(texture.height(probe[None, :2])[0] - probe[2])
                    ball = (*map(float, probe), enough)
                    left = pruning.shrink_to_cells(ball, g, cell, texture.arguments)
                    more += not pruning.is_empty(left)
                lost += bound >= 0.97 * enough and phi[i, j] < enough
    assert pruned > 500
    assert more > 100
    assert lost > 10


@pytest.mark.parametrize(("i", "j"), [(9, 10), (9, 13), (14, 10), (7, 6)])
def test_the_bound_of_a_cell_of_a_flat_map_is_its_distance(i: int, j: int) -> None:
    x, y, g = 10.5, 9.5, 3.0
    phi = g**2 + max(abs(j + 0.5 - x) - 0.5, 0.0) ** 2 + max(abs(i + 0.5 - y) - 0.5, 0.0) ** 2
    found = least(np.array([x, y, 0.7 - g]), i, j, record_of(np.full((23, 23), 0.7)))
    if i == 9:
        assert (
            phi - 1.0 / 6.0 - 1e-12 <= found < phi
        )  # along y the probe is in the middle of the cell
    else:
        assert found == pytest.approx(phi - (1.0 / 12.0 if j == 10 else 0.0), abs=1e-12)


# --- about a minimum ------------------------------------------------------------------------------


def test_cells_pruned_by_a_minimum_hold_no_closer_point() -> None:
    """Otherwise open cells are pruned; the negative control subtracts no square."""
    rng = np.random.default_rng(56)
    claims, opened, wrong = 0, 0, 0
    for seed in range(4):
        texture = rough(seed, 90e-6)
        given = texture.arguments
        nx, ny = heightmap.cell_counts(given.c)
        for probe in probes(texture, rng, 40):
            closest = minimum(probe, probe[:2] + rng.normal(0.0, 2e-4, 2), given)
            basin = pruning.certified_minimum_at(float(probe[2]), closest, given)
            ball = (*map(float, probe), closest[2] * (1.0 - 1e-13))
            # Twice the mixed derivative is subtracted, and no square with it.
            blind = (*basin[:3], 0.0, 2.0 * basin[4], 0.0)
            phi = squares(texture, probe)
            for i in range(max(int(basin[1]) - 2, 0), min(int(basin[1]) + 3, ny)):
                for j in range(max(int(basin[0]) - 2, 0), min(int(basin[0]) + 3, nx)):
                    closer = phi[i, j] < ball[3]
                    if pruning.can_prune_cell(ball, basin, i, j, given):
                        assert not closer
                        claims += 1
                        opened += least(probe, i, j, given) < ball[3]
                    wrong += closer and pruning.can_prune_cell(ball, blind, i, j, given)
    assert claims > 1000
    assert opened > 200
    assert wrong > 3


def test_the_subtracted_form_is_a_square() -> None:
    """It holds the whole mixed derivative, and equal shares of the other two."""
    given = rough(6, 90e-6).arguments
    px, py = 1.0 / given.ix, 1.0 / given.iy
    x, y, g = 1.7e-3, -1.1e-3, 0.03e-3
    h, _hx, _hy, hxx, hxy, hyy = heightmap.sample_hessian(x, y, given)

    def close(value: float) -> object:
        return pytest.approx(value, rel=1e-9, abs=0.0)

    for z, signed in ((h - g, g), (h + g, -g)):
        u, v, gap, e, b, f = pruning.certified_minimum_at(z, (x, y, g * g, h, 0.0, 0.0), given)
        assert u == close((x - given.x0) / px)
        assert v == close((y - given.y0) / py)
        assert gap == close(signed)
        assert b == close(2.0 * signed * hxy * px * py)
        assert e * f == close(0.25 * b * b)
        alike = (1.0 + signed * hxx) / (1.0 + signed * hyy)
        assert e / px**2 == close(f / py**2 * alike)


def test_pruning_is_decided_by_the_coefficients_of_the_parts() -> None:
    """Of each part of the cell, from 16 of its values, for any subtracted form."""
    rng = np.random.default_rng(57)
    texture = rough(7, 90e-6)
    given = texture.arguments
    pitch = np.array(PITCH)
    fit = np.linalg.inv([basis(s) for s in np.linspace(0.0, 1.0, 4)])
    for _ in range(40):
        i, j = map(int, rng.integers(0, (24, 37)))
        at = np.array([j, i]) + rng.uniform(-0.5, 1.5, 2)
        probe = np.append(texture.origin + (at + rng.normal(0.0, 3.0, 2)) * pitch, -0.3e-3)
        gap, (e, b, f) = 0.3e-3 * rng.uniform(0.8, 1.2), 1e-9 * rng.normal(size=3)
        cuts = [(0.0, cut, 1.0) for cut in np.clip(at - (j, i), 0.0, 1.0)]
        least = np.inf
        for west, east in itertools.pairwise(cuts[0]):
            for south, north in itertools.pairwise(cuts[1]):
                xs, ys = j + np.linspace(west, east, 4), i + np.linspace(south, north, 4)
                cell = np.stack(np.meshgrid(xs, ys), axis=-1)
                xy = texture.origin + cell * pitch
                h = texture.height(xy.reshape(-1, 2)).reshape(4, 4) - probe[2]
                du, dv = np.moveaxis(cell - at, -1, 0)
                psi = ((xy - probe[:2]) ** 2).sum(axis=-1) + 2.0 * gap * h - gap**2
                parts = fit @ (psi - e * du**2 - b * du * dv - f * dv**2) @ fit.T
                least = min(least, parts.min())
        for threshold, pruned in ((least - 1e-13, True), (least + 1e-13, False)):
            ball = (*map(float, probe), threshold)
            assert pruning.can_prune_cell(ball, (*at, gap, e, b, f), i, j, given) == pruned


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("share", [0.98, 1.02])
def test_a_minimum_is_distinguished_from_a_saddle(sign: float, share: float) -> None:
    """With h = c s t, ψ increases along both axes, but between them only if g c is below 1."""
    g = 5.0
    u, v = np.arange(-1, 22) - CENTRE[0], np.arange(-1, 22) - CENTRE[1]
    given = record_of(sign * share / g * np.outer(v, u))
    best = (*CENTRE, g * g, 0.0, 0.0, 0.0)
    basin = pruning.certified_minimum_at(-g, best, given)
    ball = (*CENTRE, -g, g * g * (1.0 - 1e-13))
    assert pruning.can_prune_cell(ball, basin, 9, 10, given) == (share < 1.0)
    # The negative control subtracts less than a square.
    less = (*basin[:3], 0.9 * basin[3], basin[4], 0.9 * basin[5])
    assert pruning.can_prune_cell(ball, less, 9, 10, given)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("cells_off", [-2, -1, 0, 1, 2])
def test_the_increase_ends_where_third_derivatives_end_it(
    turned: bool, sign: float, cells_off: int
) -> None:
    """ψ = (1 - g b) t² - g c t³/3 is 0 again at 3 (1 - g b)/g c: here, at the end of a cell."""
    g, b = 5.0, 0.08
    first = (10, 9)[turned] + cells_off - CENTRE[turned]
    end = first + 1.0 if cells_off >= 0 else first
    for share, pruned in ((1.01, True), (0.99, False)):
        c = 3.0 * (1.0 - g * b) / (g * share * end)
        given = cubic(turned, -sign * b, -sign * c)
        best = (*CENTRE, g * g, 0.0, 0.0, 0.0)
        basin = pruning.certified_minimum_at(-sign * g, best, given)
        i, j = (9 + cells_off, 10) if turned else (9, 10 + cells_off)
        ball = (*CENTRE, -sign * g, g * g * (1.0 - 1e-13))
        assert pruning.can_prune_cell(ball, basin, i, j, given) == pruned


# --- how they are called --------------------------------------------------------------------------

FACTOR = 1.0 - 1e-13
FOUND = (0.0, 0.0, 2.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("wide", [3, 7, 8, 9, 64, 70])
def test_rows_are_whole_registers_within_the_map(
    wide: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All open cells of the window are searched, and no others."""
    given = record_of(np.zeros((8, wide + 3)))
    rows: list[int] = []
    opened: list[tuple[int, int]] = []

    def min_coefficients_in_row(*arguments: Any) -> None:
        i, first, count, row = arguments[3:7]
        assert 0 <= first <= first + count <= wide
        assert count % 8 == 0 or count == wide
        rows.append(i)
        row[:] = np.nan
        row[:count] = np.where(np.arange(first, first + count) % 3 == 0, 1.0, 3.0)

    def search_cell(*arguments: Any) -> Any:
        opened.append(arguments[1:3])
        return arguments[3:7]

    monkeypatch.setattr(search, "min_coefficients_in_row", min_coefficients_in_row)
    monkeypatch.setattr(search, "search_cell", search_cell)
    monkeypatch.setattr(search, "certified_minimum_at", lambda *_arguments: (0.0,) * 6)
    monkeypatch.setattr(search, "local_array", np.empty)
    for west, east in ((0, 0), (0, min(wide, 64) - 1), (wide - 3, wide - 1), (wide // 2, wide - 1)):
        rows, opened = [], []
        window_ = (west, east, 1, 3)
        search.search_rows((0.0, 0.0, -1.0, FACTOR), FOUND, window_, 1e3, given)
        assert rows == [1, 2, 3]
        assert opened == [(i, j) for i in rows for j in range(west, east + 1) if j % 3 == 0]


@pytest.mark.parametrize("closer", [True, False])
def test_a_cell_is_pruned_against_the_best_point_so_far(
    closer: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The current best point counts, also one that was just found."""
    thresholds: list[float] = []

    def can_prune_cell(ball: tuple[float, ...], *_rest: Any) -> bool:
        thresholds.append(ball[3])
        return len(thresholds) == 3

    found = (*FOUND[:2], 1.5 if closer else 2.5, *FOUND[3:])
    monkeypatch.setattr(search, "can_prune_cell", can_prune_cell)
    monkeypatch.setattr(search, "descend_within_budget", lambda *_arguments: (found, 50.0))
    monkeypatch.setattr(
        search, "certified_minimum_at", lambda *_arguments: (5.5, 5.5, 0.0, 0.0, 0.0, 0.0)
    )
    beyond = (7.9, 5.5, 0.0, 0.0, 0.0, 0.0)  # close enough to prune, too far to be the reason
    given = record_of(np.zeros((23, 23)))
    best, near, last, left = search.search_cell(
        (0.0, 0.0, -1.0, FACTOR), 5, 5, FOUND, beyond, beyond, 60.0, given
    )
    assert thresholds == [2.0 * FACTOR, 2.0 * FACTOR, (1.5 if closer else 2.0) * FACTOR]
    assert best == (found if closer else FOUND)
    assert (near[0], last[0], left) == (5.5 if closer else 7.9, 5.5, 50.0 - search.SUBDIVISION_COST)

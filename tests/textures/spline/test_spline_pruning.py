"""Pruning of cells: pruned cells contain no closer point, and the bounds are tight."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from tests.textures.spline.test_spline_search import (
    CENTRE,
    PITCH,
    cubic_map,
    find_minimum,
    is_empty,
    linked_sampler,
    min_squared_distances,
    random_probes,
    record_of,
    rough_map,
    shrink_to_cells,
)

from asperity.contacts import closest_search
from asperity.core.checks import FloatArray
from asperity.textures.spline import heightmap_sampler as heightmap
from asperity.textures.spline import spline_pruning as pruning
from asperity.textures.spline import spline_search as search
from asperity.textures.spline.bspline_kernels import SplineArguments, bspline_weights, cell_counts

__all__ = ["linked_sampler"]  # an autouse fixture


def bernstein_basis(s: float) -> list[float]:
    return [math.comb(3, m) * s**m * (1.0 - s) ** (3 - m) for m in range(4)]


def test_bernstein_coefficients_of_spline_square_and_parts() -> None:
    rng = np.random.default_rng(55)
    c, t = rng.normal(size=4), 0.37
    parts = pruning.subdivide_cubic(t, *c)
    for s in np.linspace(0.0, 1.0, 6):
        spline = float(np.dot(bspline_weights(s), c))
        assert np.dot(bernstein_basis(s), pruning.cubic_bernstein(*c)) / 6.0 == pytest.approx(
            spline, abs=1e-14
        )
        assert np.dot(bernstein_basis(s), pruning.square_bernstein(t)) == pytest.approx(
            (s - t) ** 2, abs=1e-14
        )
        for part, place in ((parts[:4], t * s), (parts[3:], t + (1.0 - t) * s)):
            whole = np.dot(bernstein_basis(place), c)
            assert np.dot(bernstein_basis(s), part) == pytest.approx(whole, abs=1e-14)


def min_coefficient(probe: FloatArray, i: int, j: int, texture: SplineArguments) -> float:
    """Return the smallest coefficient in a cell, evaluated among eight cells of a row."""
    x, y, z = map(float, probe)
    first = min(max(j - 4, 0), cell_counts(texture)[0] - 8)
    row = np.empty(8)
    u, v = (x - texture.x0) * texture.ix, (y - texture.y0) * texture.iy
    pruning.min_coefficients_in_row(u, v, z, i, first, 8, row, texture)
    return float(row[j - first])


Certified = tuple[float, float, float, float, float, float]


def certified_minimum_at(z: float, point: tuple[float, ...], record: SplineArguments) -> Certified:
    """Return a minimum of φ in cells, g, and e, 2 b, f of its square."""
    probe, frame = (point[0], point[1], z), search.search_frame(0.0, 0.0, record)
    minimum = closest_search.minimum_at(probe, frame, point, record)
    return (*minimum[:3], *pruning.square_at(minimum, record))


def can_prune_cell(
    ball: tuple[float, ...], certified: Certified, i: int, j: int, record: SplineArguments
) -> bool:
    """Return whether ψ - q has no coefficient below the ball's r² in cell (i, j)."""
    u, v, gap, *square = certified
    probe_u, probe_v = (ball[0] - record.x0) * record.ix, (ball[1] - record.y0) * record.iy
    probe = (probe_u - j, probe_v - i, ball[2])
    arguments = (i, j, probe, u - j, v - i, gap, tuple(square), record)
    return pruning.min_coefficient_near(*arguments) >= ball[3]


def test_cells_pruned_by_coefficients_contain_no_closer_point() -> None:
    """Many of the pruned cells could not be pruned by the spline coefficients."""
    rng = np.random.default_rng(54)
    pruned, open_by_spline, lost = 0, 0, 0
    for seed in range(3):
        texture = rough_map(seed, 90e-6)
        for probe in random_probes(texture, rng, 20):
            phi = min_squared_distances(texture, probe)
            threshold = float(phi.min()) * rng.uniform(0.9, 1.3)
            for i, j in np.argwhere(phi < 1.5 * threshold).tolist():
                bound = min_coefficient(probe, i, j, texture.arguments)
                if bound >= threshold:
                    assert phi[i, j] >= threshold
                    pruned += 1
                    cell = (j, j, i, i)
                    g = float(texture.height(probe[None, :2])[0] - probe[2])
                    ball = (*map(float, probe), threshold)
                    left = shrink_to_cells(ball, g, cell, texture.arguments)
                    open_by_spline += not is_empty(left)
                lost += bound >= 0.97 * threshold and phi[i, j] < threshold
    assert pruned > 500
    assert open_by_spline > 100
    assert lost > 10


@pytest.mark.parametrize(("i", "j"), [(9, 10), (9, 13), (14, 10), (7, 6)])
def test_bound_of_a_cell_of_a_flat_map_is_its_squared_distance(i: int, j: int) -> None:
    x, y, g = 10.5, 9.5, 3.0
    phi = g**2 + max(abs(j + 0.5 - x) - 0.5, 0.0) ** 2 + max(abs(i + 0.5 - y) - 0.5, 0.0) ** 2
    bound = min_coefficient(np.array([x, y, 0.7 - g]), i, j, record_of(np.full((23, 23), 0.7)))
    if i == 9:
        assert (
            phi - 1.0 / 6.0 - 1e-12 <= bound < phi
        )  # along y the probe is in the middle of the cell
    else:
        assert bound == pytest.approx(phi - (1.0 / 12.0 if j == 10 else 0.0), abs=1e-12)


# --- about a minimum ------------------------------------------------------------------------------


def test_cells_pruned_by_a_minimum_contain_no_closer_point() -> None:
    """Cells left open by the coefficients are pruned; the negative control subtracts no square."""
    rng = np.random.default_rng(56)
    claims, opened, wrong = 0, 0, 0
    for seed in range(4):
        texture = rough_map(seed, 90e-6)
        record = texture.arguments
        nx, ny = cell_counts(record)
        for probe in random_probes(texture, rng, 40):
            closest = find_minimum(probe, probe[:2] + rng.normal(0.0, 2e-4, 2), record)
            certified = certified_minimum_at(float(probe[2]), closest, record)
            ball = (*map(float, probe), closest[2] * (1.0 - 1e-13))
            # Negative control: subtracts twice the mixed derivative and no squares.
            weakened = (*certified[:3], 0.0, 2.0 * certified[4], 0.0)
            phi = min_squared_distances(texture, probe)
            for i in range(max(int(certified[1]) - 2, 0), min(int(certified[1]) + 3, ny)):
                for j in range(max(int(certified[0]) - 2, 0), min(int(certified[0]) + 3, nx)):
                    closer = phi[i, j] < ball[3]
                    if can_prune_cell(ball, certified, i, j, record):
                        assert not closer
                        claims += 1
                        opened += min_coefficient(probe, i, j, record) < ball[3]
                    wrong += closer and can_prune_cell(ball, weakened, i, j, record)
    assert claims > 1000
    assert opened > 200
    assert wrong > 3


def test_subtracted_quadratic_form_is_a_square() -> None:
    """It contains the whole mixed derivative and equal shares of the other two."""
    record = rough_map(6, 90e-6).arguments
    px, py = 1.0 / record.ix, 1.0 / record.iy
    x, y, g = 1.7e-3, -1.1e-3, 0.03e-3
    h, _hx, _hy, hxx, hxy, hyy = heightmap.sample_hessian(x, y, record)

    def approximately(value: float) -> object:
        return pytest.approx(value, rel=1e-9, abs=0.0)

    for z, signed in ((h - g, g), (h + g, -g)):
        u, v, gap, e, b, f = certified_minimum_at(z, (x, y, g * g, h, 0.0, 0.0), record)
        assert u == approximately((x - record.x0) / px)
        assert v == approximately((y - record.y0) / py)
        assert gap == approximately(signed)
        assert b == approximately(2.0 * signed * hxy * px * py)
        assert e * f == approximately(0.25 * b * b)
        ratio = (1.0 + signed * hxx) / (1.0 + signed * hyy)
        assert e / px**2 == approximately(f / py**2 * ratio)


def test_pruning_compares_the_coefficients_of_the_parts() -> None:
    """The coefficients of each part are fitted to 16 values, for arbitrary subtracted forms."""
    rng = np.random.default_rng(57)
    texture = rough_map(7, 90e-6)
    record = texture.arguments
    pitch = np.array(PITCH)
    fit = np.linalg.inv([bernstein_basis(s) for s in np.linspace(0.0, 1.0, 4)])
    for _ in range(40):
        i, j = map(int, rng.integers(0, (24, 37)))
        at = np.array([j, i]) + rng.uniform(-0.5, 1.5, 2)
        probe = np.append(texture.origin + (at + rng.normal(0.0, 3.0, 2)) * pitch, -0.3e-3)
        gap, (e, b, f) = 0.3e-3 * rng.uniform(0.8, 1.2), 1e-9 * rng.normal(size=3)
        cuts = [(0.0, cut, 1.0) for cut in np.clip(at - (j, i), 0.0, 1.0)]
        min_coefficient = np.inf
        for west, east in itertools.pairwise(cuts[0]):
            for south, north in itertools.pairwise(cuts[1]):
                xs, ys = j + np.linspace(west, east, 4), i + np.linspace(south, north, 4)
                cell = np.stack(np.meshgrid(xs, ys), axis=-1)
                xy = texture.origin + cell * pitch
                h = texture.height(xy.reshape(-1, 2)).reshape(4, 4) - probe[2]
                du, dv = np.moveaxis(cell - at, -1, 0)
                psi = ((xy - probe[:2]) ** 2).sum(axis=-1) + 2.0 * gap * h - gap**2
                parts = fit @ (psi - e * du**2 - b * du * dv - f * dv**2) @ fit.T
                min_coefficient = min(min_coefficient, parts.min())
        for threshold, pruned in (
            (min_coefficient - 1e-13, True),
            (min_coefficient + 1e-13, False),
        ):
            ball = (*map(float, probe), threshold)
            assert can_prune_cell(ball, (*at, gap, e, b, f), i, j, record) == pruned


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("share", [0.98, 1.02])
def test_minimum_is_distinguished_from_a_saddle(sign: float, share: float) -> None:
    """With h = c s t, ψ increases along both axes, but along diagonals only if g c < 1."""
    g = 5.0
    u, v = np.arange(-1, 22) - CENTRE[0], np.arange(-1, 22) - CENTRE[1]
    record = record_of(sign * share / g * np.outer(v, u))
    best = (*CENTRE, g * g, 0.0, 0.0, 0.0)
    certified = certified_minimum_at(-g, best, record)
    ball = (*CENTRE, -g, g * g * (1.0 - 1e-13))
    assert can_prune_cell(ball, certified, 9, 10, record) == (share < 1.0)
    # The negative control subtracts less than a square.
    less = (*certified[:3], 0.9 * certified[3], certified[4], 0.9 * certified[5])
    assert can_prune_cell(ball, less, 9, 10, record)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("cells_off", [-2, -1, 0, 1, 2])
def test_pruning_accounts_for_third_derivatives(turned: bool, sign: float, cells_off: int) -> None:
    """ψ = (1 - g b) t² - g c t³/3 is 0 at t = 3 (1 - g b)/g c, here the end of a cell."""
    g, b = 5.0, 0.08
    first = (10, 9)[turned] + cells_off - CENTRE[turned]
    end = first + 1.0 if cells_off >= 0 else first
    for share, pruned in ((1.01, True), (0.99, False)):
        c = 3.0 * (1.0 - g * b) / (g * share * end)
        record = cubic_map(turned, -sign * b, -sign * c)
        best = (*CENTRE, g * g, 0.0, 0.0, 0.0)
        certified = certified_minimum_at(-sign * g, best, record)
        i, j = (9 + cells_off, 10) if turned else (9, 10 + cells_off)
        ball = (*CENTRE, -sign * g, g * g * (1.0 - 1e-13))
        assert can_prune_cell(ball, certified, i, j, record) == pruned


def test_cell_of_a_mirrored_copy_is_pruned_as_its_original() -> None:
    """A probe and a minimum beyond the border of a finite map are mirrored with the cell."""
    rng = np.random.default_rng(58)
    record = rough_map(8, 90e-6).arguments
    nx, _ny = cell_counts(record)
    pruned = []
    for _ in range(200):
        i, j = int(rng.integers(0, 3)), int(rng.integers(nx - 3, nx))
        u, v = np.array([j, i]) + rng.uniform(-0.5, 1.5, 2)
        at = (record.x0 + u / record.ix, record.y0 + v / record.iy)
        h, *_slope, hxx, hxy, hyy = heightmap.sample_hessian(*at, record)
        probe_u, probe_v = u + rng.normal(), v + rng.normal()
        gap = 0.2e-3 * rng.uniform(0.5, 1.5)
        r = gap * rng.uniform(0.7, 1.0)
        answers = []
        for mirrored in (False, True):
            sign, end_u = (-1.0, 2.0 * nx) if mirrored else (1.0, 0.0)
            x = record.x0 + (end_u + sign * probe_u) / record.ix
            y = record.y0 + sign * probe_v / record.iy
            west = end_u - j - 1.0 if mirrored else float(j)
            south = -i - 1.0 if mirrored else float(i)
            minimum = (end_u + sign * u, sign * v, gap, 1.0, hxx, hxy, hyy)
            box = (west, west + 1.0, south, south + 1.0)
            answers.append(pruning.can_prune_near((x, y, h - gap, r * r), minimum, box, record))
        assert answers[0] == answers[1]
        pruned.append(answers[0])
    assert 0.1 < np.mean(pruned) < 0.9


# --- division into cells --------------------------------------------------------------------------

LIMIT = 2.0 * (1.0 - 1e-13)
MINIMUM = (0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0)


def divide(box: tuple[float, ...], record: SplineArguments, left: float) -> tuple[Any, float]:
    """Return the boxes that a box is divided into, with their bounds, and what is left."""
    stack = np.empty((256, 5))
    ball, frame = (0.0, 0.0, -1.0, LIMIT), search.search_frame(0.0, 0.0, record)
    count, left = search.divide_box(ball, frame, MINIMUM, box, stack, 0, left, record)
    return stack[:count], left


@pytest.fixture
def interpreted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "local_array", np.empty)
    monkeypatch.setattr(closest_search, "box_middle", search.box_middle)
    monkeypatch.setattr(closest_search, "search_frame", search.search_frame)


@pytest.mark.parametrize("wide", [3, 7, 8, 9, 32, 70])
@pytest.mark.usefixtures("interpreted")
def test_division_visits_all_open_cells_in_full_registers(
    wide: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Exactly the open cells of the box are left, with their bounds."""
    record = record_of(np.zeros((8, wide + 3)))
    rows: list[int] = []

    def min_coefficients_in_row(*arguments: Any) -> None:
        i, first, count, row = arguments[3:7]
        assert 0 <= first <= first + count <= wide
        assert count % 8 == 0 or count == wide
        rows.append(i)
        row[:] = np.nan
        row[:count] = np.where(np.arange(first, first + count) % 3 == 0, 1.0, 3.0)

    monkeypatch.setattr(search, "min_coefficients_in_row", min_coefficients_in_row)
    for west, east in ((0, 0), (0, min(wide, 32) - 1), (wide - 3, wide - 1), (wide // 2, wide - 1)):
        if east - west >= 32:
            continue
        rows = []
        parts, left = divide((float(west), east + 1.0, 1.0, 4.0), record, 1e3)
        assert rows == [1, 2, 3]
        opened = [(i, j) for i in rows for j in range(west, east + 1) if j % 3 == 0]
        assert parts.tolist() == [[j, j + 1.0, i, i + 1.0, 1.0] for i, j in opened]
        assert 0.0 < left < 1e3
    # Without evaluations left the rest is not visited, which counts as truncated.
    rows = []
    assert divide((0.0, 3.0, 1.0, 4.0), record, 1.0)[1] == 0.0
    assert len(rows) < 3


@pytest.mark.parametrize("box", [(0, 40, 0, 40), (3, 49, 5, 21), (-7, 72, 8, 9), (-60, 85, 1, 80)])
@pytest.mark.usefixtures("interpreted")
def test_parts_of_a_large_box_cover_it_once(box: tuple[int, ...]) -> None:
    """They end at the borders of copies, and the part nearest to the minimum is on top."""
    record = record_of(np.zeros((83, 83)))
    parts, left = divide(tuple(map(float, box)), record, 1e3)
    west, east, south, north = box
    covered = np.zeros((north - south, east - west), int)
    for part in parts[:, :4].astype(int):
        covered[part[2] - south : part[3] - south, part[0] - west : part[1] - west] += 1
    assert (covered == 1).all()
    assert left == 1e3
    assert (parts[:, 4] == 0.0).all()
    distance = np.maximum(parts[:, 0], -parts[:, 1]).clip(0.0) + parts[:, 2].clip(0.0)
    assert distance[-1] == distance.min()
    if west < 0 < east:
        assert set(parts[:, :2].ravel().tolist()) == {west, 0.0, east}


@pytest.mark.parametrize("closer", [True, False])
def test_cell_is_excluded_against_the_current_best_point(
    closer: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The threshold follows the best point, including one found in the same cell."""
    thresholds: list[float] = []
    factor, best = 1.0 - 1e-13, (0.0, 0.0, 2.0, 0.0, 0.0, 0.0)

    def excludes_box(ball: tuple[float, ...], *_rest: Any) -> bool:
        thresholds.append(ball[3])
        return len(thresholds) == 3

    candidate = (*best[:2], 1.5 if closer else 2.5, *best[3:])
    found = (5.5, 5.5, 1.0, 1.0, 0.0, 0.0, 0.0)
    monkeypatch.setattr(closest_search, "excludes_box", excludes_box)
    monkeypatch.setattr(closest_search, "enclose_box", search.enclose_box)
    monkeypatch.setattr(closest_search, "distance_to_box", lambda *_arguments: 0.0)
    monkeypatch.setattr(
        closest_search, "descend_within_budget", lambda *_arguments: (candidate, 50.0)
    )
    monkeypatch.setattr(closest_search, "minimum_at", lambda *_arguments: found)
    near, last = (7.9, 5.5, *found[2:]), (3.0, 5.5, *found[2:])
    record = record_of(np.zeros((23, 23)))
    probe, box = (0.0, 0.0, -1.0), (5.0, 6.0, 5.0, 6.0)
    frame = search.search_frame(0.0, 0.0, record)
    result = closest_search.examine_box(probe, factor, frame, box, best, near, last, 60.0, record)
    assert thresholds == [2.0 * factor, 2.0 * factor, (1.5 if closer else 2.0) * factor]
    expected = (candidate, found, found) if closer else (best, near, found)
    assert result == (*expected, False, 50.0)

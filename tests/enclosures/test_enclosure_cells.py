"""Cells of textures: their models contain the derivatives, and together they cover the domain."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import mpmath
import numpy as np
import pytest
from tests.helpers.exact_heights import exact_height

from asperity.analysis.bounds.branch_and_bound import _subdivide, _subdivision_count
from asperity.enclosures.cells import (
    DERIVATIVE_NAMES,
    DERIVATIVE_ORDERS,
    Cells,
    ProductCells,
    anchor_enclosures,
    cells_with_deflection,
    low_discrepancy_points,
)
from asperity.enclosures.taylor import TaylorModel
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid, Texture
from asperity.textures.plane_waves import nearest_phases

RNG = np.random.default_rng(20260611)
ROUGH = RNG.normal(size=(7, 9))
SKEW = np.array([[2100.0, 300.0], [-500.0, 1700.0]])


def flat_sum(count: int) -> Fourier:
    return Fourier(np.zeros(count), RNG.normal(size=(count, 2)) * 1e3)


def periodic_sum_of_500_waves() -> Fourier:
    """Return a periodic sum of 500 waves."""
    rng = np.random.default_rng(5)
    multiples = rng.integers(-6, 7, (500, 2))
    multiples[~multiples.any(axis=1)] = 1
    return Fourier(1e-6 * rng.normal(size=500), multiples @ SKEW, rng.uniform(0, 7, 500))


class ByBounds(Fourier):
    """A sum without its waves: as for a user-defined kind, cells follow from the bounds alone."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        _known = self.domain, self.extremes, self.bounds  # computed from the waves
        vars(self)["waves"] = None


class ByThirdBounds(ByBounds):
    @property
    def third_derivative_bound(self) -> float:
        return float(np.abs(self.amplitudes) @ np.hypot(*self.wavevectors.T) ** 3)


SUM = ([4e-4, 3e-4, 1e-4], np.vstack([SKEW, SKEW[0] - 2 * SKEW[1]]), [0.4, 1, 2])

Build = tuple[Callable[[], Texture], tuple[float, float] | None]
TEXTURES: dict[str, Build] = {
    "sinusoid": (lambda: Sinusoid(0.4e-3, 1.5e-3, 0.7, (2.0, 1.0)), None),
    "sinusoid, extent": (lambda: Sinusoid(0.4e-3, 1.5e-3, 0.7, (2.0, 1.0)), (0.3e-3, 1e-3)),
    "sinusoid, many turns": (lambda: Sinusoid(0.4e-3, 1.5e-3, 1e7, (2.0, 1.0)), None),
    "tiny sinusoid": (lambda: Sinusoid(1e-9, 1e3), None),
    "periodic profile sum": (lambda: Fourier([2e-4, 1e-4], [1200.0, 2800.0], [0.2, 0.9]), None),
    "periodic sum": (
        lambda: Fourier([4e-4, 3e-4, 1e-4], np.vstack([SKEW, SKEW[0] - 2 * SKEW[1]]), [0.4, 1, 2]),
        None,
    ),
    "quasi-periodic profile": (lambda: Fourier([2e-4, 1e-4], [1e3, 1e3 * math.sqrt(2)]), None),
    "three phases": (
        lambda: Fourier([4e-4, 3e-4, 1e-4], [*SKEW.tolist(), [1234.5, 987.6]], [0.4, -900.0, 2]),
        None,
    ),
    "five phases, extent": (
        lambda: Fourier(1e-4 * RNG.normal(size=5), 2e3 * RNG.normal(size=(5, 2))),
        (5e-3, 2e-3),
    ),
    "bounds": (lambda: ByBounds(*SUM), None),
    "third bounds": (lambda: ByThirdBounds(*SUM), None),
    "third bounds, extent": (lambda: ByThirdBounds(*SUM), (3e-3, 2e-3)),
    "bounds of a profile": (lambda: ByThirdBounds([2e-4, 1e-4], [1200.0, 2800.0]), None),
    "500 waves": (periodic_sum_of_500_waves, None),
    "no height": (lambda: flat_sum(2), None),
    "map": (lambda: HeightMap(1e-4 * ROUGH, (3e-4, 7e-4), origin=(-1.3e-3, 0.7e-3)), None),
    "periodic map": (
        lambda: HeightMap(1e-3 * ROUGH, (3e-4, 7e-4), periodic=True, origin=(1.0, -2.0)),
        None,
    ),
    "map on a mountain": (lambda: HeightMap(1e-4 * ROUGH + 2e3, (3e-4, 7e-4)), None),
    "flat map": (lambda: HeightMap(np.full((5, 5), 0.3), 1e-4), None),
    "profile": (lambda: Profile(1e-4 * ROUGH[0], 3e-4, origin=-0.7e-3), None),
    "periodic profile": (lambda: Profile(1e2 * ROUGH[1], 3.0, periodic=True, origin=0.4), None),
}


def make_cells(name: str, margin: float = 0.0) -> tuple[Texture, Any]:
    build, extent = TEXTURES[name]
    texture = build()
    cells = texture.cells(extent, margin)
    assert cells is not None
    return texture, cells


def random_cells(of: Cells, level: int, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return random cells: initial cells that are halved ``level`` times."""
    rng = np.random.default_rng(seed)
    chunks, half = of.initial_cells()
    centres = np.concatenate(list(chunks))
    centres = centres[rng.integers(0, len(centres), count)]
    finer = half / 2.0**level
    steps = rng.integers(0, 2**level, centres.shape)
    return centres - half + finer * (2.0 * steps + 1.0), finer


def exact_derivatives(
    texture: Texture, margin: float, extent: Any, coordinates: np.ndarray
) -> list[Any]:
    """Return the six derivatives at coordinates with 40 digits."""
    c = [mpmath.mpf(float(value)) for value in coordinates]
    if isinstance(texture, ByBounds):
        spans = texture.domain.spans if extent is None else np.diag(extent)
        rows = [[mpmath.mpf(float(value)) for value in row] for row in spans]
        where = [sum(u * row[i] for u, row in zip(c, rows, strict=True)) for i in (0, 1)]
    elif isinstance(texture, (Sinusoid, Fourier)) and extent is None:
        return _exact_derivatives_on_torus(texture, c)
    elif isinstance(texture, HeightMap):
        where = [
            mpmath.mpf(float(o)) + u * mpmath.mpf(p)
            for o, u, p in zip(texture.origin, c, texture.pitch, strict=True)
        ]
    elif isinstance(texture, Profile):
        where = [mpmath.mpf(texture.origin) + c[0] * mpmath.mpf(texture.pitch), mpmath.mpf(0)]
    else:
        where = [value - mpmath.mpf(margin) for value in c]
    h = exact_height(texture)
    return [h(*where, *DERIVATIVE_ORDERS[name]) for name in DERIVATIVE_NAMES]


def _exact_derivatives_on_torus(texture: Sinusoid | Fourier, c: list[Any]) -> list[Any]:
    if isinstance(texture, Sinusoid):
        a, kx, ky, phase = texture.arguments
        waves = [(a, kx, ky, phase, [1])]
    else:
        _basis, multiples = texture.waves.lattice
        rows = zip(texture.amplitudes, texture.wavevectors, texture.phases, multiples, strict=True)
        waves = [(a, *k, phase, n.tolist()) for a, k, phase, n in rows]
    totals = [mpmath.mpf(0)] * 6
    for a, kx, ky, phase, n in waves:
        angle = sum(m * u for m, u in zip(n, c, strict=True)) + mpmath.mpf(float(phase))
        for i, name in enumerate(DERIVATIVE_NAMES):
            m, k = DERIVATIVE_ORDERS[name]
            wave = mpmath.sin(angle + (m + k) * mpmath.pi / 2)
            totals[i] += mpmath.mpf(a) * mpmath.mpf(kx) ** m * mpmath.mpf(ky) ** k * wave
    return totals


def distance_outside(model: Any, cell: int, xi: np.ndarray, value: Any) -> float:
    """Return the distance of a value from a model relative to its error; at most 1 if enclosed."""
    if not isinstance(model, TaylorModel):
        return 0.0 if abs(value - model) <= 1e-300 else math.inf
    linear = mpmath.mpf(model.c[cell])
    for g, x in zip(model.g[:, cell], xi, strict=True):
        linear += mpmath.mpf(g) * mpmath.mpf(x)
    distance = abs(value - linear)
    return (
        float(distance / model.e[cell])
        if model.e[cell] > 0.0
        else (0.0 if distance == 0 else math.inf)
    )


@pytest.mark.parametrize("name", TEXTURES)
@pytest.mark.parametrize("level", [0, 3, 14])
def test_models_contain_the_exact_derivatives(name: str, level: int) -> None:
    """The 40-digit derivatives are within the error, rounding included, which is not too wide."""
    texture, cells = make_cells(name)
    extent = TEXTURES[name][1]
    centres, half = random_cells(cells, level, 4 if name == "500 waves" else 12, seed=level)
    models = cells.enclosures(centres, half, DERIVATIVE_NAMES)
    rng, worst = np.random.default_rng(level), 0.0
    with mpmath.workdps(40):
        for cell, centre in enumerate(centres):
            xi = rng.choice([-1.0, -0.5, 0.25, 1.0], len(half))
            exact = exact_derivatives(texture, 0.0, extent, centre + half * xi)
            for i, value in enumerate(exact):
                worst = max(worst, distance_outside(models[DERIVATIVE_NAMES[i]], cell, xi, value))
    assert worst <= 1.0
    if name not in {"no height"}:
        assert worst > 1e-4  # the error is not too wide: bounds 10 000 times as wide would not pass


@pytest.mark.parametrize("name", [n for n in TEXTURES if "flat" not in n and "no h" not in n])
def test_models_without_their_error_do_not_contain_the_derivatives(name: str) -> None:
    _texture, cells = make_cells(name)
    centres, half = random_cells(cells, 0, 50, seed=1)
    models = cells.enclosures(centres, half, DERIVATIVE_NAMES)
    xi = np.random.default_rng(1).choice([-1.0, 1.0], centres.shape)
    exact = cells.derivatives(centres + half * xi)
    failed = 0
    for i, derivative in enumerate(DERIVATIVE_NAMES):
        model = models[derivative]
        if isinstance(model, TaylorModel):
            bare = replace(model, e=1e-10 * model.e)
            linear = bare.c + (bare.g * xi.T).sum(axis=0)
            failed += int((np.abs(exact[:, i] - linear) > bare.e).sum())
    assert failed > 50


@pytest.mark.parametrize("name", TEXTURES)
def test_derivatives_of_cells_equal_those_of_the_texture(name: str) -> None:
    texture, cells = make_cells(name)
    coordinates = cells.sample_coordinates(64)[: 8 if name == "three phases" else 64]
    of_cells, of_texture = (
        cells.derivatives(coordinates),
        texture.derivatives(cells.to_plane(coordinates)),
    )
    slope, curvature = texture.bounds
    height = max(abs(v) for v in texture.extremes)
    scale = np.array([height, *[slope] * 2, *[curvature] * 3]) + 1e-300
    # A plane has two coordinates, so that three phases are met only approximately.
    tolerance = 0.02 if cells.dimensions > len(texture.domain.spans) else 3e-8
    tolerance = 1e-12 if "turns" not in name and tolerance < 1e-3 else tolerance
    assert (np.abs(of_cells - of_texture) <= tolerance * scale).all()


@pytest.mark.parametrize("name", [n for n in TEXTURES if "extent" not in n])
def test_every_point_of_the_plane_has_coordinates(name: str) -> None:
    """The derivatives at a random point equal those at its coordinates in the cells."""
    texture, cells = make_cells(name)
    xy = texture.domain.points(np.random.default_rng(2).random((20, len(texture.domain.spans))))
    if isinstance(texture, ByBounds):
        coordinates = xy @ np.linalg.pinv(texture.domain.spans)
    elif isinstance(texture, (Sinusoid, Fourier)):
        coordinates = xy @ cells._basis.T
    else:
        coordinates = cells.coordinates(xy)
    slope, curvature = texture.bounds
    height = max(abs(v) for v in texture.extremes)
    scale = np.array([height, *[slope] * 2, *[curvature] * 3]) + 1e-300
    tolerance = 1e-7 if "turns" in name else 1e-11
    error = np.abs(cells.derivatives(coordinates) - texture.derivatives(xy))
    assert (error <= tolerance * scale).all()


@pytest.mark.parametrize("name", TEXTURES)
def test_initial_cells_cover_the_domain(name: str) -> None:
    """They do not overlap, except for the last blocks of a map."""
    _texture, cells = make_cells(name)
    chunks, half = cells.initial_cells()
    centres = np.concatenate(list(chunks))
    low, high = (centres - half).min(axis=0), (centres + half).max(axis=0)
    np.testing.assert_allclose(low, 0.0, atol=1e-12 * high.max())
    least = 1.0 if "map" in name else 2.0 * half
    fine = np.zeros(np.round(high / least).astype(int), dtype=int)
    corners = np.round((centres - half) / least).astype(int)
    span = round(float(2.0 * half[0] / np.atleast_1d(least)[0]))
    for steps in np.ndindex(*[span] * len(half)):
        np.add.at(fine, tuple((corners + steps).T), 1)
    assert fine.min() == 1
    assert "map" in name or fine.max() == 1
    np.testing.assert_allclose(corners * least, centres - half, rtol=1e-12, atol=1e-15)
    samples = cells.sample_coordinates(100)
    assert (samples >= low - 1e-12).all()
    assert (samples <= high * (1.0 + 1e-12)).all()
    assert cells.clip_to_region(samples).shape == samples.shape


@pytest.mark.parametrize("dimensions", [1, 2, 3, 4])
@pytest.mark.parametrize("count", [0, 1, 3, 200])
def test_subdivided_cells_cover_their_parents(dimensions: int, count: int) -> None:
    rng = np.random.default_rng(count)
    half = rng.uniform(0.5, 2.0, dimensions)
    centres = rng.normal(size=(count, dimensions)) * 10
    parts = _subdivision_count(count, dimensions)
    assert parts >= 2
    children = list(_subdivide(centres, half / parts, parts, chunk=64))
    all_children = np.concatenate(children) if children else np.zeros((0, dimensions))
    assert len(all_children) == count * parts**dimensions
    points = centres[:, None] + half * rng.uniform(-1, 1, (count, 50, dimensions))
    by_parent = all_children.reshape(count, parts**dimensions, dimensions)
    contains = np.abs(points[:, :, None] - by_parent[:, None]) <= half / parts * (1 + 1e-12)
    assert contains.all(axis=-1).any(axis=-1).all()
    assert all(len(part) <= max(64, parts**dimensions) for part in children)


@pytest.mark.parametrize("name", ["three phases", "periodic map", "profile", "sinusoid, extent"])
def test_error_of_the_height_has_order_two(name: str) -> None:
    """Only h is checked: second derivatives of a spline are linear in a cell, and exact."""
    _texture, cells = make_cells(name)
    errors = []
    levels = np.arange(2, 9)
    for level in levels:
        centres, half = random_cells(cells, int(level), 200, seed=5)
        model = cells.enclosures(centres, half, ["h"])["h"]
        assert isinstance(model, TaylorModel)
        errors.append(model.e.mean())
    order = -np.polyfit(levels, np.log2(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.1)


def test_blocks_of_a_tilted_plane_are_exact() -> None:
    """A linear height equals the linear part of its model, and so do its slopes."""
    y, x = np.mgrid[0:16.0, 0:16.0]
    cells = HeightMap(1e-4 * x - 3e-4 * y, (3e-4, 7e-4)).cells()
    centres, half = np.array([[8.0, 8.0]]), np.array([2.0, 2.0])
    models = cells.enclosures(centres, half, ["h", "hx", "hy"])
    # The mirrored border has a small effect in the middle.
    expected = {"h": (-16e-4, 2e-4, -6e-4), "hx": (1 / 3, 0.0, 0.0), "hy": (-3 / 7, 0.0, 0.0)}
    for name, (c, gx, gy) in expected.items():
        model = models[name]
        assert isinstance(model, TaylorModel)
        tolerance = 2e-2 * abs(c)
        assert model.c[0] == pytest.approx(c, abs=tolerance)
        assert model.g[:, 0] == pytest.approx([gx, gy], abs=tolerance)
        assert model.e[0] < tolerance
        assert name != "h" or model.e[0] < 2e-3 * abs(c)


def test_bounds_of_blocks_of_ridges_are_attained() -> None:
    """Second derivatives along a ridged map are linear between nodes, so the hull is attained."""
    texture = HeightMap(1e-4 * np.tile(ROUGH[0], (9, 1)), 3e-4)
    cells = texture.cells()
    chunks, half = cells.initial_cells()
    centres = np.concatenate(list(chunks))
    assert half.tolist() == [2.0, 2.0]
    model = cells.enclosures(centres, half, ["hxx"])["hxx"]
    assert isinstance(model, TaylorModel)
    ratio = np.zeros(len(centres))
    for xi in np.linspace(-1.0, 1.0, 5):
        exact = cells.derivatives(centres + half * [xi, 0.3])[:, 3]
        ratio = np.maximum(ratio, np.abs(exact - model.c - model.g[0] * xi) / model.e)
    assert ratio.max() <= 1.0
    # Coefficients beyond the block keep the bound from being attained exactly.
    assert ratio.min() > 0.99


def test_margin_widens_the_extent_on_every_side() -> None:
    texture, cells = make_cells("five phases, extent", margin=1e-3)
    corners = cells.to_plane(np.array([[0.0, 0.0], cells.clip_to_region(np.full((1, 2), 1e9))[0]]))
    np.testing.assert_allclose(corners, [[-1e-3, -1e-3], [6e-3, 3e-3]], rtol=1e-12)
    coordinates = cells.sample_coordinates(60)
    xy = cells.to_plane(coordinates)
    scale = np.array([1e-3, 1.0, 1.0, 1e4, 1e4, 1e4])
    assert (np.abs(cells.derivatives(coordinates) - texture.derivatives(xy)) < 1e-12 * scale).all()


def test_more_than_four_phases_need_an_extent() -> None:
    waves = np.random.default_rng(1).normal(size=(5, 2))
    five, four = Fourier(np.ones(5), waves), Fourier(np.ones(4), waves[:4])
    assert five.cells() is None
    assert five.cells((1.0, 2.0)) is not None
    torus = four.cells()
    assert torus is not None
    assert torus.dimensions == 4


# --- nearly periodic waves ------------------------------------------------------------------------


def nearly_periodic() -> Fourier:
    """Return two waves whose frequency ratio is 2 (1 + 5e-10), which is not periodic."""
    return Fourier([1e-4, 1e-4], [[1000.0, 0.0], [2000.0 * (1 + 5e-10), 0.0]])


def test_nearly_periodic_waves_have_one_phase_each() -> None:
    """A common period would give an error far above rounding."""
    texture = nearly_periodic()
    cells = texture.cells()
    assert cells.dimensions == 2
    xy = np.random.default_rng(5).uniform(-0.01, 0.01, (50, 2))
    exact = texture.derivatives(xy)
    models = cells.enclosures(xy @ cells._basis.T, np.full(2, 1e-9), DERIVATIVE_NAMES)
    for i, name in enumerate(DERIVATIVE_NAMES):
        model = models[name]
        if isinstance(model, TaylorModel):
            assert np.all(np.abs(exact[:, i] - model.c) <= model.e)


def test_rounding_error_of_cancelling_phases_follows_their_size() -> None:
    """The sum of 7·1000 - 7·1000 turns and a phase is small, but not its rounding error."""
    waves = np.array([[1.0, 0.0], [0.0, 1.0], [997.0, -991.0]])
    cells = Fourier([1.0, 1.0, 1.0], waves).cells()
    centres = np.array([[6.0, 6.0]])
    model = cells.enclosures(centres, np.zeros(2), ["h"])["h"]
    assert isinstance(model, TaylorModel)
    assert model.e[0] > 6e3 * np.finfo(float).eps


# --- phases, spread, products ---------------------------------------------------------------------


def test_nearest_phases_approximate_the_given_phases() -> None:
    basis = np.array([*SKEW, [1234.5, 987.6]])
    phases = np.array([1.0, 5.0, 3.0])
    nearest = basis @ nearest_phases(basis, phases)
    error = np.abs((nearest - phases + math.pi) % (2.0 * math.pi) - math.pi)
    assert error[:2].max() < 1e-9
    assert error[2] < 1e-3
    parallel = np.array([[1e3, 0.0], [1e3 * math.sqrt(2), 0.0]])
    nearest = parallel @ nearest_phases(parallel, np.array([1.0, 5.0]))
    error = np.abs((nearest - [1.0, 5.0] + math.pi) % (2.0 * math.pi) - math.pi)
    assert error.max() < 1e-3


@pytest.mark.parametrize("dimensions", [1, 2, 3])
def test_low_discrepancy_points_fill_every_box(dimensions: int) -> None:
    points = low_discrepancy_points(8**dimensions * 8, dimensions)
    boxes = np.unique(np.floor(points * 4.0), axis=0)
    assert len(boxes) == 4**dimensions
    assert points.min() >= 0.0
    assert points.max() < 1.0


def test_deflection_and_depth_coordinates_are_enclosed() -> None:
    texture, flat = make_cells("sinusoid")
    cells = cells_with_deflection(flat, 2e-3, 5e-4)
    assert isinstance(cells, ProductCells)
    assert cells.dimensions == 4
    rng = np.random.default_rng(1)
    centres, half = random_cells(cells, 3, 40, seed=9)
    models = cells.enclosures(centres, half, DERIVATIVE_NAMES)
    xi = rng.uniform(-1, 1, centres.shape)
    coordinates = centres + half * xi
    extra = cells.extra_coordinates(coordinates)
    u = np.stack([np.cos(extra["deflection_angle"]), np.sin(extra["deflection_angle"])])
    assert extra["deflection_length"].max() <= 2e-3
    for sliding in (False, True):
        d = (2e-3 if sliding else extra["deflection_length"]) * u
        s = np.array([1 - u[0] ** 2, -u[0] * u[1], 1 - u[1] ** 2]) if sliding else [1.0, 0.0, 1.0]
        exact = {"dx": d[0], "dy": d[1], "sxx": s[0], "sxy": s[1], "syy": s[2]}
        exact |= {"depth": extra["depth"], "h": texture.height(cells.to_plane(coordinates))}
        state = {**models, **anchor_enclosures(models, 2e-3, sliding=sliding)}
        for name, value in exact.items():
            model = state[name]
            if not isinstance(model, TaylorModel):
                assert model == value
                continue
            linear = model.c + (model.g * xi.T).sum(axis=0)
            assert (np.abs(value - linear) <= model.e + 1e-16).all(), name
            assert (np.abs(value - model.c) > model.e).any(), name
    clipped = cells.clip_to_region(np.full((1, 4), 99.0))
    np.testing.assert_allclose(clipped[0, 1:], [2e-3, 2 * math.pi, 5e-4])

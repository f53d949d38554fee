"""The bounds of heights and derivatives over boxes, used by the closest-point search."""

from __future__ import annotations

import numpy as np
import pytest

from asperity.textures import HeightMap, Profile
from asperity.textures.spline import pyramid

RNG = np.random.default_rng(31)
ROUGH = RNG.normal(size=(11, 8))
Boxes = list[tuple[np.ndarray, slice, slice]]


def boxes_of_map(texture: HeightMap) -> Boxes:
    """Return the five bounds of every box with the rows and columns of its cells."""
    values, levels = texture.arguments.boxes, texture.arguments.levels
    boxes = []
    for level, (start, rows, columns) in enumerate(levels):
        side = 2 << level
        for n in range(rows * columns):
            i, j = side * (n // columns), side * (n % columns)
            boxes.append((values[start + n], slice(i, i + side), slice(j, j + side)))
    return boxes


def sampled_cells(texture: HeightMap, per_side: int) -> dict[str, np.ndarray]:
    """Return sampled extremes of height, ‖Hess h‖ and ‖D³h‖ in every cell."""
    px, py = texture.pitch
    ny, nx = (size - 3 for size in texture.coefficients.shape)
    ticks = np.linspace(1e-9, 1.0 - 1e-9, per_side)
    x = px * (np.arange(nx)[:, None] + ticks).ravel()
    y = py * (np.arange(ny)[:, None] + ticks).ravel()
    xy = texture.origin + np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
    step = 1e-4 * min(px, py)

    def cells(values: np.ndarray) -> np.ndarray:
        return values.reshape(ny, per_side, nx, per_side).transpose(0, 2, 1, 3).reshape(ny, nx, -1)

    third = []
    for axis in np.eye(2):
        # Towards the middle of the cell, since third derivatives jump at its border.
        middle = np.floor((xy - texture.origin) / (px, py)) + 0.5
        side = np.sign(middle - (xy - texture.origin) / (px, py)) @ axis
        ahead = texture.hessian(xy + step * side[:, None] * axis)
        third.append((ahead - texture.hessian(xy)) * (side / step)[:, None, None])
    tensor = np.stack(third, axis=-1)
    # The norm of a symmetric tensor is attained along one direction.
    angles = np.linspace(0.0, np.pi, 25)
    units = np.column_stack([np.cos(angles), np.sin(angles)])
    third_norm = np.abs(np.einsum("nijk,ai,aj,ak->na", tensor, units, units, units)).max(axis=1)
    eigenvalues = np.linalg.eigvalsh(texture.hessian(xy))
    second_bound = np.abs(eigenvalues).max(axis=1)
    height = cells(texture.height(xy))
    return {
        "low": height.min(axis=2),
        "high": height.max(axis=2),
        "second": cells(second_bound).max(axis=2),
        "third": cells(third_norm).max(axis=2),
        "crest": cells(-eigenvalues[:, 0]).max(axis=2),
    }


MAPS = {
    "finite": HeightMap(1e-4 * ROUGH, (2e-4, 3e-4), origin=(1e-3, -2e-3)),
    "periodic": HeightMap(1e-4 * ROUGH, (3e-4, 2e-4), periodic=True),
    "steep": HeightMap(2e-3 * ROUGH[:7, :5], 2e-4),
    "flat": HeightMap(np.full((5, 5), 3e-4), 1e-4),
}


@pytest.mark.parametrize("name", MAPS)
def test_samples_of_a_map_are_within_box_bounds(name: str):
    texture = MAPS[name]
    cells = sampled_cells(texture, 9)
    px = texture.pitch[0]
    size = np.abs(texture.heights).max()
    for (low, high, second_bound, third_bound, crest_bound), rows, columns in boxes_of_map(texture):
        assert low <= cells["low"][rows, columns].min()
        assert high >= cells["high"][rows, columns].max()
        assert second_bound >= cells["second"][rows, columns].max() * px - 1e-12 * size / px
        assert (
            third_bound
            >= cells["third"][rows, columns].max() * px**2 * (1 - 1e-6) - 1e-7 * size / px
        )
        assert (
            second_bound
            >= crest_bound
            >= max(cells["crest"][rows, columns].max() * px - 1e-12 * size / px, 0.0)
        )


@pytest.mark.parametrize("name", ["finite", "periodic", "steep"])
def test_box_bounds_of_a_map_are_tight(name: str):
    """The median ratio of sampled value and bound is limited; loose bounds cost evaluations."""
    texture = MAPS[name]
    cells, px = sampled_cells(texture, 9), texture.pitch[0]
    ratios: list[list[float]] = []
    for (low, high, second_bound, third_bound, _crest), rows, columns in boxes_of_map(texture)[:12]:
        inner = np.ptp([cells["low"][rows, columns].min(), cells["high"][rows, columns].max()])
        ratios.append(
            [
                inner / (high - low),
                cells["second"][rows, columns].max() * px / second_bound,
                cells["third"][rows, columns].max() * px**2 / third_bound,
            ]
        )
    assert (np.median(ratios, axis=0) > [0.7, 0.4, 0.3]).all()


def finest_boxes(texture: HeightMap) -> np.ndarray:
    """Return the bounds of the finest boxes, shape (rows, columns, 5)."""
    values, levels = texture.arguments.boxes, texture.arguments.levels
    _start, rows, columns = levels[0]
    return np.asarray(values[: rows * columns].reshape(rows, columns, 5), dtype=np.float64)


def is_tight_upper_bound(bound: np.ndarray, exact: np.ndarray | float, scale: float) -> bool:
    """Return whether upper bounds are exact up to rounding, 3e-6 of a scale."""
    return bool(((bound >= exact) & (bound <= exact + 3e-6 * scale)).all())


def test_box_bounds_of_a_paraboloid_are_exact():
    """The surface is 3 x² - 2 y², away from the border, where mirroring changes it."""
    y, x = np.mgrid[0:80, 0:80] * 1e-4
    texture = HeightMap(3.0 * x**2 - 2.0 * y**2, 1e-4)
    boxes = finest_boxes(texture)
    inner = boxes[18:22, 18:22]
    assert is_tight_upper_bound(inner[..., 2], 6.0 * 1e-4, boxes[..., 2].max())
    # Negative curvature is along y only.
    assert is_tight_upper_bound(inner[..., 4], 4.0 * 1e-4, boxes[..., 2].max())
    # Bernstein coefficients of a parabola over a cell: at its ends, and a third above or below.
    corner = 3.0 * x[36, 38] ** 2 - 2.0 * y[36, 38] ** 2
    assert corner <= inner[0, 0, 1] <= corner + 1e-8


@pytest.mark.parametrize("power", [3, 2, 1, 0])
def test_bounds_of_third_derivatives_are_exact(power: int):
    """For x^n y^(3 - n) the bound is the Frobenius norm of the eight third derivatives."""
    y, x = np.mgrid[0:80, 0:80] * np.array([2e-4, 1e-4])[:, None, None]
    boxes = finest_boxes(HeightMap(1e3 * x**power * y ** (3 - power), (1e-4, 2e-4)))
    exact = 1e3 * np.sqrt([36.0, 12.0, 12.0, 36.0][power]) * 1e-8
    assert is_tight_upper_bound(boxes[18:22, 18:22, 3], exact * (1 - 1e-9), boxes[..., 3].max())


def test_bounds_do_not_depend_on_tiles(monkeypatch: pytest.MonkeyPatch):
    texture = MAPS["finite"]
    whole = pyramid.plane_pyramid(texture.coefficients, texture.pitch)
    monkeypatch.setattr(pyramid, "_TILE_ROWS", 4)
    monkeypatch.setattr(pyramid, "_TILE_COLUMNS", 2)
    for part, other in zip(
        pyramid.plane_pyramid(texture.coefficients, texture.pitch), whole, strict=True
    ):
        # Only the rounding margin may differ, as it scales with the maximum of a tile.
        np.testing.assert_allclose(part, other, rtol=0, atol=2e-6 * np.abs(other).max())


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("count", [4, 9, 37])
def test_samples_of_a_profile_are_within_box_bounds(count: int, periodic: bool):
    texture = Profile(1e-4 * RNG.normal(size=count), 2e-4, periodic=periodic, origin=3e-4)
    values, levels = texture.arguments.boxes, texture.arguments.levels
    cells = texture.coefficients.size - 3
    ticks = np.linspace(0.0, 1.0, 33)
    x = texture.origin + texture.pitch * (np.arange(cells)[:, None] + ticks)
    xy = np.column_stack([x.ravel(), np.zeros(x.size)])
    height = texture.height(xy).reshape(cells, -1)
    second = np.abs(texture.hessian(xy)[:, 0, 0]).reshape(cells, -1).max(axis=1)
    crest = (-texture.hessian(xy)[:, 0, 0]).reshape(cells, -1).max(axis=1)
    ends = texture.hessian(xy)[:, 0, 0].reshape(cells, -1)[:, [1, -2]]
    third = np.abs(ends[:, 1] - ends[:, 0]) / (30 * texture.pitch / 32)
    for level, (start, rows, boxes) in enumerate(levels, start=1):
        assert rows == 1
        for n in range(boxes):
            low, high, second_bound, third_bound, crest_bound = values[start + n]
            part = slice(n << level, (n + 1) << level)
            assert low <= height[part].min()
            assert high >= height[part].max()
            assert second_bound >= second[part].max() * texture.pitch * (1 - 1e-12)
            assert third_bound >= third[part].max() * texture.pitch**2 * (1 - 1e-9)
            assert crest_bound >= max(crest[part].max() * texture.pitch * (1 - 1e-12), 0.0)
    # Bounds of two cells are exact, as h'' is linear in each and h''' constant.
    pairs = cells // 2
    for column, exact in ((2, second * texture.pitch), (3, third * texture.pitch**2)):
        bounds = values[:pairs, column].astype(np.float64)
        greatest = exact[: 2 * pairs].reshape(pairs, 2).max(axis=1)
        assert is_tight_upper_bound(bounds, greatest * (1 - 1e-9), bounds.max())

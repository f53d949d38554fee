"""Lists of points: grids in any order, absent points, profiles."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
from tests.helpers.text_files import assert_refused, point_lines, read_text


@pytest.mark.parametrize("seed", [None, 1, 2])
def test_grid_points_in_any_order_are_a_map(tmp_path: Path, seed: int | None) -> None:
    order = list(range(20))
    if seed is not None:
        random.Random(seed).shuffle(order)
    raw = read_text(tmp_path, "x [um] y [um] z [nm]\n" + "\n".join(point_lines(order)))
    assert raw.pitch == pytest.approx((0.5e-6, 1e-6), rel=1e-12)
    expected = [[(10.0 * i + j) * 1e-9 for i in range(5)] for j in range(4)]
    np.testing.assert_allclose(raw.heights, expected, rtol=1e-15)
    assert raw.has_units


def test_absent_grid_point_is_missing(tmp_path: Path) -> None:
    raw = read_text(tmp_path, "x [m] y [m] z [m]\n" + "\n".join(point_lines(left_out=(7,))))
    assert np.argwhere(np.isnan(raw.heights)).tolist() == [[1, 2]]
    assert raw.notes == ()


def test_points_on_one_line_are_a_profile(tmp_path: Path) -> None:
    raw = read_text(tmp_path, "x [m] y [m] z [m]\n0 3 1\n0 1 2\n0 2 5\n0 4 7\n")
    assert raw.heights.tolist() == [2.0, 5.0, 1.0, 7.0]
    assert raw.pitch == (1.0,)


@pytest.mark.parametrize(
    ("rows", "match"),
    [
        (["0 0 1", "1 0.3 2", "2 0.7 3", "3.5 0.9 4", "4 1 5"], "no regular grid"),
        ([*point_lines(), "0.5 2 77"], "same position"),
        (
            [*point_lines(), "2.7 2 1", "2.7 3 1", "2.7 4 1", "2.7 5 1"],
            "not uniform: a step differs by",
        ),
        (["nan 0 1", *point_lines()], "position is missing"),
    ],
)
def test_points_off_a_grid_are_refused(tmp_path: Path, rows: list[str], match: str) -> None:
    assert_refused(tmp_path, "\n".join(["x [m] y [m] z [m]", *rows]) + "\n", match)

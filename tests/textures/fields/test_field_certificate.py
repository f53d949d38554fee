"""The certified gain of a baked field: over all batches, of what is stored."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from asperity.core.processes import run_in_threads
from asperity.kernels import fuse
from asperity.textures.fields import field_certificate
from asperity.textures.fields.field_certificate import curvature_bounds
from asperity.textures.fields.field_grid import FieldGrid
from asperity.textures.fields.field_record import MIRRORED, PERIODIC


def grid(border: int, cells: tuple[int, int] = (40, 4)) -> FieldGrid:
    steps = np.array([[0.1, 0.0], [0.0, 0.2]])
    return FieldGrid(steps, cells, np.array([1e-3, 2e-3]), 6, 0.1, 5.0, 1, border)


@pytest.mark.parametrize("border", [PERIODIC, MIRRORED])
@pytest.mark.parametrize("stiffer", [0, 1])
def test_curvature_bounds_are_the_maximum_over_all_batches(
    border: int, stiffer: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every column is searched once; positive and negative eigenvalues each by their maximum."""
    seen: list[int] = []

    def hull_batch(first: int, last: int, *rest: Any) -> None:
        *_, out, _marks, _field = rest
        seen.extend(range(first, last))
        for side in range(2):
            size = (3.0 if side == stiffer else 1.0) + (1.0 if first == 16 else 0.0)
            out[side] = (size + 0.5, size, first, 0.5, 2.0)

    monkeypatch.setattr(fuse, "fuse_module", lambda *_: SimpleNamespace(hull_batch=hull_batch))
    fitted = grid(border)
    depth = 2.0 - fitted.margin
    arguments = fitted.arguments(np.full(fitted.node_counts, depth, np.float32))
    upper, attained = curvature_bounds(fitted, arguments)
    assert sorted(seen) == list(range(40 if border == PERIODIC else 41))
    rounding = field_certificate._DIFFERENCE_ROUNDING * (2.0 / 0.1) ** 2
    assert rounding > 0.0
    sizes = np.where(np.arange(2) == stiffer, 4.0, 2.0)
    np.testing.assert_array_equal(attained[:, 0], sizes)
    np.testing.assert_allclose(upper, sizes + 0.5 + rounding, rtol=1e-15)
    # The witness is at node (16, ½) and level 2.
    position = (1e-3 + 16 * 0.1, 2e-3 + 0.5 * 0.2, 5.0 + 0.5 * 0.1)
    np.testing.assert_allclose(attained[:, 1:], [position, position])


def test_numbers_are_those_of_the_coefficients_in_single_precision() -> None:
    """Depths that single precision cannot hold have another gain than what is stored.

    S = -z has T = z²/2 with second derivatives of 1; rounded 1000 nodes deep it has others, and the
    certified number covers them.
    """
    fitted = FieldGrid(1e-6 * np.eye(2), (4, 4), np.zeros(2), 1100, 1e-6, -1.0943e-3, 2, PERIODIC)
    z = fitted.height(np.arange(fitted.levels))
    exact = np.broadcast_to(np.maximum(-z, -fitted.margin), fitted.node_counts)
    stored = exact.astype(np.float32)
    upper, attained = curvature_bounds(fitted, fitted.arguments(stored))
    values = (stored[0, 0] + fitted.margin).astype(float) - fitted.margin
    slope, second = np.diff(values) / 1e-6, np.diff(values, 2) / 1e-6**2
    corners = [slope[1:] ** 2 + 0.5 * (values[1:-1] + values[2:]) * second,
               slope[:-1] ** 2 + 0.5 * (values[1:-1] + values[:-2]) * second]  # fmt: skip
    largest = max(part[4:-4].max() for part in corners)
    assert largest > 1.01
    assert largest * (1.0 - 1e-6) <= attained[0, 0] <= upper[0] <= largest * 1.01


@pytest.mark.parametrize("count", [0, 1, 7])
def test_parts_are_run_once_each_and_progress_ends_at_one(count: int) -> None:
    done: list[int] = []
    seen: list[float] = []
    run_in_threads(done.append, range(count), seen.append)
    assert sorted(done) == list(range(count))
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


def test_errors_of_threads_are_raised() -> None:
    def fail(part: int) -> None:
        if part == 3:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run_in_threads(fail, range(5), None)

"""The certified gain of a baked field."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.processes import available_cores
from asperity.textures.fields import field_curvature, field_sampler
from asperity.textures.fields.field_grid import FieldGrid
from asperity.textures.fields.field_sampler import PERIODIC, FieldArguments

Progress = Callable[[float], None]
CurvatureBounds = tuple[FloatArray, FloatArray]

# Rounding of a second difference of coefficients, in units of their size, counted generously.
_DIFFERENCE_ROUNDING = 32.0 * float(np.finfo(np.float64).eps)
_COLUMNS_PER_PART = 16


def curvature_bounds(
    grid: FieldGrid, field: FieldArguments, progress: Progress | None = None
) -> CurvatureBounds:
    """Return certified bounds of the eigenvalues of Hess T over the whole field.

    Returns:
        Two arrays of shape (2,), for Hess T and for -Hess T: upper bounds of the greatest
        eigenvalue; and (2, 4): the greatest one attained, and where, x, y, z [m].
    """
    from asperity.kernels.fuse import fuse_module

    loops = fuse_module(field_curvature, field_sampler)
    width = grid.cells[0] + (0 if grid.border == PERIODIC else 1)
    firsts = range(0, width, _COLUMNS_PER_PART)
    parts = [(first, min(first + _COLUMNS_PER_PART, width)) for first in firsts]
    found = np.zeros((len(parts), 2, 5))

    def search(part: int) -> None:
        loops.hull_batch(*parts[part], found[part], field)

    run_in_threads(search, range(len(parts)), progress)
    largest = float(field.c.max()) if field.c.size else 0.0
    rounding = _DIFFERENCE_ROUNDING * largest / min(grid.spacing) ** 2
    best = found[np.argmax(found[:, :, 1], axis=0), [0, 1]]
    at = grid.positions(best[:, 2 : 2 + len(grid.cells)])
    attained = np.column_stack([best[:, 1], at, grid.height(best[:, 4])])
    return found[:, :, 0].max(axis=0) + rounding, attained


def run_in_threads(
    function: Callable[[Any], None], parts: Sequence[Any], progress: Progress | None
) -> None:
    """Apply a function to the parts in threads; compiled loops release the GIL.

    The first part is computed alone, so that the loop is compiled once.
    """
    if parts:
        function(parts[0])
    with ThreadPoolExecutor(max_workers=available_cores()) as pool:
        rest = [pool.submit(function, part) for part in parts[1:]]
        for done, future in enumerate(as_completed(rest), 2):
            future.result()
            if progress is not None:
                progress(done / len(parts))
    if progress is not None and len(parts) <= 1:
        progress(1.0)

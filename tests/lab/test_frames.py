"""What a frame says of its rows."""

from __future__ import annotations

import numpy as np
import pytest

from asperity.lab.messages import COLUMN_NAMES, step_statistics


def rows(**columns: list[float]) -> np.ndarray:
    table = np.zeros((len(next(iter(columns.values()))), len(COLUMN_NAMES)))
    for name, values in columns.items():
        table[:, COLUMN_NAMES.index(name.replace("_", " "))] = values
    return table


def test_the_greatest_jump_is_found_with_the_way_that_goes_with_it() -> None:
    table = rows(
        x=[0.0, 3e-3, 3e-3],
        z=[0.0, 4e-3, 3e-3],
        commanded_x=[0.0, 1.0, 1.0],
        commanded_z=[0.0, 0.0, -2.0],
    )
    found = step_statistics(table)
    assert found == pytest.approx(
        {"path_length": 6e-3, "squared_steps": 26e-6, "max_force_step": 2.0, "position_step": 1e-3}
    )
    assert step_statistics(table[:1]) == dict.fromkeys(found, 0.0)

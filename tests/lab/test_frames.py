"""What a frame says of its rows."""

from __future__ import annotations

import numpy as np
import pytest

import asperity as asp
from asperity.lab.messages import ANCHOR, COLUMN_NAMES, POSITION, step_statistics


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
        {
            "path_length": 6e-3,
            "squared_steps": 26e-6,
            "max_force_step": 2.0,
            "position_step": 1e-3,
            "anchor_slip": 0.0,
        }
    )
    assert step_statistics(table[:1]) == dict.fromkeys(found, 0.0)


def test_the_slip_of_the_anchor_balances_work_on_its_spring() -> None:
    """κ Σ slip is the work of the probe on the spring less what it stores; sticking loses none."""
    surface = asp.Surface(asp.Sinusoid(2e-4, 2e-3), "W", 500.0, friction=0.4)
    friction = surface.contact_friction
    assert friction is not None
    kappa = friction.presliding_stiffness
    angle = np.linspace(0.0, 2.0 * np.pi, 4001)
    path = 1e-3 * np.column_stack([np.cos(angle), 0.3 * np.sin(angle), 0.5 * np.sin(angle) - 0.7])
    forces = surface.trace(path)
    anchors = path[:, :2] + forces[:, :2] / kappa
    table = np.zeros((len(path), len(COLUMN_NAMES)))
    table[:, POSITION] = path
    table[:, ANCHOR[:2]] = anchors
    slip = step_statistics(table)["anchor_slip"]
    deflection = path[:, :2] - anchors
    middle = deflection[:-1] + 0.5 * (np.diff(path[:, :2], axis=0))
    # The force of the spring on the way of the probe, in each tick before the anchor slides.
    work = kappa * np.sum(middle * np.diff(path[:, :2], axis=0))
    stored = 0.5 * kappa * (np.sum(deflection[-1] ** 2) - np.sum(deflection[0] ** 2))
    assert kappa * slip == pytest.approx(work - stored, rel=1e-9)
    assert kappa * slip > 1e-5
    still = table.copy()
    still[:, ANCHOR[:2]] = anchors[0]
    assert step_statistics(still)["anchor_slip"] == 0.0

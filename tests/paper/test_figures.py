"""The data of figures 2 and 3 agree with the laws."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from asperity.paper.cases import PAPER_LAWS, SCANNING
from asperity.paper.figures import ForceField, LoopEnergy, force_fields, loop_energies


@pytest.fixture(scope="module")
def fields() -> dict[str, ForceField]:
    return {panel.law: panel for panel in force_fields()}


@pytest.fixture(scope="module")
def loops() -> dict[str, LoopEnergy]:
    return {panel.law: panel for panel in loop_energies()}


def _profile(x: np.ndarray) -> np.ndarray:
    return SCANNING.amplitude * np.sin(2.0 * math.pi * x / SCANNING.period)


def test_figure_2_has_a_panel_for_each_law(fields: dict[str, ForceField]) -> None:
    assert "".join(fields) == PAPER_LAWS
    for panel in fields.values():
        assert panel.points.shape == panel.forces.shape
        assert panel.points.shape[-1] == 2
        assert panel.height == pytest.approx(_profile(panel.x))
        json.dumps(panel.to_dict(), allow_nan=False)


def test_forces_act_inside_and_point_outwards(fields: dict[str, ForceField]) -> None:
    for law, panel in fields.items():
        x, z = panel.points[..., 0], panel.points[..., 1]
        level = 0.0 * x if law in "FG" else _profile(x)
        inside = z < level - 1e-9
        assert np.all(panel.forces[~inside] == 0.0)
        assert np.all(panel.forces[inside][:, 1] > 0.0)


def test_lateral_forces_distinguish_the_laws(fields: dict[str, ForceField]) -> None:
    """A and E act along z only; the others also along x, downhill, and F against the motion."""
    for law, panel in fields.items():
        left, right = panel.handle_forces
        if law in "AE":
            assert left[0] == right[0] == 0.0
        elif law == "F":
            assert left[0] < 0.0
            assert right[0] < 0.0
        else:  # the left handle is on a rising flank, with its normal to the left
            assert left[0] < 0.0 < right[0]


def test_figure_3_work_ends_at_the_loop_energy(loops: dict[str, LoopEnergy]) -> None:
    for panel in loops.values():
        assert panel.arc_length.shape == panel.work.shape
        assert panel.work[0] == panel.arc_length[0] == 0.0
        scale = np.abs(panel.work).max()
        assert panel.work[-1] == pytest.approx(panel.energy, abs=1e-4 * scale)
        edges = panel.vertices - np.roll(panel.vertices, 1, axis=0)
        assert panel.arc_length[-1] == pytest.approx(np.hypot(*edges.T).sum())
        json.dumps(panel.to_dict(), allow_nan=False)


def test_loop_energies_agree_with_the_papers_formulas(loops: dict[str, LoopEnergy]) -> None:
    k, amplitude, length = SCANNING.stiffness, SCANNING.amplitude, SCANNING.period
    assert loops["A"].energy == pytest.approx(k * amplitude**2 / 2)
    root = math.hypot(1.0, 2.0 * math.pi * amplitude / length)
    correction = k * length**2 / (4.0 * math.pi**2) * (1.0 - root)
    assert loops["B"].energy == pytest.approx(k * amplitude**2 / 2 + correction)
    for law in "CD":
        assert abs(loops[law].energy) < 1e-6 * k * amplitude**2
    gain = k * SCANNING.friction * SCANNING.deflection * (SCANNING.depth - 0.1e-3) / 2
    assert loops["F"].energy == pytest.approx(gain)
    assert np.all(loops["F"].height == 0.0)
    groove_energy = k * 0.1e-3 * length / math.pi * math.atan(2.0 * math.pi * amplitude / length)
    assert loops["G"].energy == pytest.approx(groove_energy)
    assert loops["E"].energy > 0.0
    assert [loops[law].equation for law in "BFG"] == ["(12)", "(27)", "(29)"]

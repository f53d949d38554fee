"""The report of a sweep: figures by the number of varied numbers, ranges, errors."""

from __future__ import annotations

import math

import numpy as np
import pytest

import asperity as asp
from asperity.report.document.page import Table
from asperity.report.pages.sweep_report import sweep_page
from asperity.report.pictures.loop_pictures import sweep_figure

STIFFNESS = "recommended stiffness [N/m]"
SURFACE = "sinusoid:amplitude=0.1mm"


def panels(result: asp.SweepResult) -> dict[str, object]:
    return {axes.get_label(): axes for axes in sweep_figure(result, STIFFNESS).axes}


def test_one_number_is_drawn_as_lines() -> None:
    vary = {"texture.period": "1mm:4mm:3log", "device": "touch,omega.3"}
    result = asp.sweep(SURFACE, vary, laws="WA", processes=1)
    axes = panels(result)
    assert list(axes) == ["touch", "omega.3"]
    lines = {line.get_label(): line for line in axes["touch"].lines}
    assert list(lines) == ["W", "A"]
    np.testing.assert_allclose(lines["A"].get_xdata(), [1.0, 2.0, 4.0])  # mm
    rows = [r for r in result.table_rows() if r["law"] == "A" and r["device.id"] == "touch"]
    np.testing.assert_array_equal(lines["A"].get_ydata(), [row[STIFFNESS] for row in rows])
    assert axes["touch"].get_xlabel() == "texture.period [mm]"


def test_two_numbers_are_drawn_as_maps() -> None:
    vary = {"texture.amplitude": "0.05mm,0.1mm,0.7mm", "texture.period": "1mm:4mm:4"}
    result = asp.sweep("sinusoid:phase=0deg", vary, laws="AB", processes=1)
    axes = panels(result)
    assert list(axes)[:2] == ["A", "B"]
    values = axes["B"].collections[0].get_array()
    assert values.shape == (4, 3)  # periods over amplitudes
    rows = [row for row in result.table_rows() if row["law"] == "B"]
    np.testing.assert_array_equal(values.T.ravel(), [row[STIFFNESS] for row in rows])
    assert len(set(np.asarray(values).ravel())) > 6


def test_a_design_is_drawn_as_points() -> None:
    vary = {"texture.amplitude": "0.05mm:0.7mm", "texture.period": "1mm:4mm"}
    result = asp.sweep("sinusoid:phase=0deg", vary, laws="A", design="sobol:8", processes=1)
    points = panels(result)["A"].collections[0].get_offsets()
    assert points.shape == (8, 2)


def test_ranges_and_errors_are_tables() -> None:
    vary = {"texture.kind": "sinusoid,cloth", "texture.period": "1mm,2mm"}
    result = asp.sweep(SURFACE, vary, laws="WA", processes=1)
    page = sweep_page(result)
    assert page.answer.endswith("2 cases fail.")
    ranges, errors = (block for block in page.sections[0].blocks if isinstance(block, Table))
    best = max(
        (row for row in result.table_rows() if row["law"] == "A"), key=lambda row: row[STIFFNESS]
    )
    cells = next(row.cells for row in ranges.rows if row.cells[1] == "A")
    assert cells[4] == f"{best[STIFFNESS]:.3g} N/m"
    assert cells[5] == "sinusoid, 2 mm"
    assert [row.cells[:2] for row in errors.rows] == [["2", "2"]]
    assert "is unknown" in errors.rows[0].cells[2]
    assert "Failed cases" in result.to_html()


def test_unbounded_values_are_left_out() -> None:
    result = asp.sweep(SURFACE, {"texture.period": "1mm,2mm"}, "limits", processes=1)
    assert {row["top speed [m/s]"] for row in result.table_rows()} >= {0.8}
    touch = asp.sweep(
        SURFACE, {"texture.period": "1mm,2mm", "device": "touch"}, "limits", processes=1
    )
    assert {row["top speed [m/s]"] for row in touch.table_rows()} == {math.inf}
    (axes,) = sweep_figure(touch, "top speed [m/s]").axes
    assert all(math.isnan(y) for line in axes.lines for y in line.get_ydata())


@pytest.mark.parametrize("vary", [{"device": "touch,omega.3"}, {"texture.period": "1mm"}])
def test_any_keys_are_drawn(vary: dict[str, str]) -> None:
    surface = "sinusoid:amplitude=0.1mm,period=1mm"
    assert panels(asp.sweep(surface, vary, laws="W", processes=1))

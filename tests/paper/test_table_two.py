"""Table II: the printed values against the values of the paper's formulas and of this package."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from asperity.analysis.bounds.bound import Bound
from asperity.paper.table_two import TableTwo, table_two
from asperity.surface import Surface
from asperity.textures import Sinusoid

WAVE = Sinusoid(0.8e-3, 1e-3)


@pytest.fixture(scope="module")
def table() -> TableTwo:
    return table_two()


def test_rows_have_the_printed_values(table: TableTwo) -> None:
    assert [row.law for row in table.rows] == list("ABCDEFG")
    printed = {row.law: (row.printed.number, row.printed.conservative) for row in table.rows}
    assert printed["B"] == printed["G"] == ("No closed-form", "No")
    assert printed["C"] == ("No closed-form", "Yes")
    assert (printed["D"], printed["E"]) == (("1", "Yes"), ("1", "No"))
    assert printed["F"] == ("Appendix I", "Almost")
    conditions = [row.printed.continuous for row in table.rows]
    assert conditions.count("If h continuous") == conditions.count("If h' continuous") == 3
    with pytest.raises(KeyError):
        table.row("W")


def test_agreement_of_each_row(table: TableTwo) -> None:
    """Number, conservativity, continuity and energy are compared separately."""
    verdicts = {
        row.law: (
            row.number_agrees,
            row.conservativity_agrees,
            row.continuity_agrees,
            row.energy_agrees,
        )
        for row in table.rows
    }
    unknown = (None, True, True, True)
    assert verdicts == {
        "A": (True, True, True, True),
        "B": unknown,
        "C": unknown,
        "D": (False, True, True, True),
        "E": (True, True, True, True),
        "F": (False, False, True, True),
        "G": unknown,
    }
    assert [row.law for row in table.rows if row.verdict == "yes"] == ["A", "E"]


def test_numbers_by_brute_force(table: TableTwo) -> None:
    """From the Jacobian at 20 000 phases and full depth, on the paper's surface."""
    xy = WAVE.domain.points(np.arange(20_000)[:, None] / 20_000)
    for law in "ABCG":
        z = -1e-3 if law == "G" else WAVE.height(xy) - 1e-3
        points = np.column_stack([xy, np.broadcast_to(z, len(xy))])
        norms = np.linalg.norm(Surface(WAVE, law).jacobian(points), 2, axis=(1, 2)) / 1000.0
        assert norms.max() == pytest.approx(table.row(law).q.value, rel=1e-6)
    assert table.row("F").q.value == pytest.approx(2.4863, abs=5e-5)
    assert table.row("D").q.value == math.inf
    assert table.row("D").one_sided.value == table.row("E").q.value == 1.0
    for row in table.rows:
        assert row.q.method in {"theorem", "closed form", "certified"}
        assert row.one_sided.value <= row.q.value * (1.0 + 1e-6)


def test_printed_formulas_have_their_printed_values(table: TableTwo) -> None:
    """q_A = 5.1 as in section V.A; the paper's q_F = 8.3 is √2 times the value of its formula."""
    assert table.row("A").printed.value == pytest.approx(5.1, abs=0.05)
    appendix = table.row("F").printed.value
    assert appendix is not None
    matrix = [[1.6 * (1.0 + math.pi * 0.8), 1.6], [0.0, 1.0]]
    assert appendix == pytest.approx(np.linalg.norm(matrix, 2), rel=1e-12)
    assert math.sqrt(2.0) * appendix == pytest.approx(8.3, abs=0.05)
    assert appendix == pytest.approx(5.85, abs=5e-3)


def test_loop_energies_agree_with_closed_forms(table: TableTwo) -> None:
    k, a, length = 1000.0, 0.8e-3, 2e-3
    slope_factor = math.sqrt(1 + 4 * math.pi**2 * a**2 / length**2)
    wave = Sinusoid(a, length)

    def distance(z: float) -> float:
        probe = np.array([[length / 4, 0.0, z]])
        return float(np.linalg.norm(wave.nearest(probe) - probe))

    kink = a - length**2 / (4 * math.pi**2 * a)
    expected = {
        "A": k * a**2 / 2,
        "B": k * a**2 / 2 + k * length**2 / (4 * math.pi**2) * (1 - slope_factor),
        "C": 0.0,
        "D": 0.0,
        "E": k * quad(distance, 0, a, points=[kink], epsabs=1e-18, epsrel=1e-12)[0],
        "F": k * 0.8 * 0.5 * 1e-3 * (1e-3 - 0.1e-3) / 2,
        "G": k * 0.1e-3 * length / math.pi * math.atan(2 * math.pi * a / length),
    }
    for law, energy in expected.items():
        assert table.row(law).energy == pytest.approx(energy, abs=1e-9 * k * a**2)


def test_changes_are_described_with_their_numbers(table: TableTwo) -> None:
    assert "y = 31.58" in table.row("B").change
    assert "0.0316629 mm" in table.row("D").change
    for number in ("8.3", "5.85", "8.27", "2.4863"):
        assert number in table.row("F").change
    header, *cells = table.cells()
    assert len(cells) == 7
    assert {len(row) for row in cells} == {len(header)}
    assert cells[3][2] == "∞ (closed form)"
    assert [row[4] for row in cells] == ["no", "no", "yes", "yes", "no", "no (Almost)", "no"]
    assert [row[5] for row in cells] == ["yes", "yes", "yes", "no", "yes", "yes", "yes"]
    assert [row[-1] for row in cells] == ["yes", "new", "new", "no", "yes", "no", "new"]


def test_changed_values_do_not_agree(table: TableTwo) -> None:
    """Negative controls of each comparison."""
    row = table.row("A")
    assert replace(row, q=Bound(5.13, 5.13, "closed form")).number_agrees is False
    assert not replace(row, conservative=True).conservativity_agrees
    assert not replace(row, continuous=False).continuity_agrees
    assert not replace(row, energy=row.energy * (1.0 + 1e-6)).energy_agrees
    assert replace(row, continuous=False).verdict == "no"
    assert replace(table.row("B"), conservative=True).verdict == "no"
    assert not replace(table.row("E"), energy=0.0).energy_agrees
    assert not replace(table.row("D"), continuous=True).continuity_agrees


def test_json_and_html_of_the_table(table: TableTwo) -> None:
    data = json.loads(json.dumps(table.to_dict(), allow_nan=False))
    assert data["rows"][3]["q"]["value"] == "inf"
    assert data["rows"][5]["number_agrees"] is False
    text = table._repr_html_()
    assert text.count("<tr") == 8
    assert "no (Almost)" in text
    assert "nan" not in text

"""The paper's Table II: printed entries, computed entries and explanations of differences."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.field_energy import loop_work
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.core.display import Displayable
from asperity.core.files import Serializable, read_toml
from asperity.paper.cases import PAPER_CASE, PAPER_LAWS, PASSIVITY, SCANNING, TURNING_DEPTH

_ENERGY_TOLERANCE = 1e-9  # relative to k A²
TABLE_TWO: dict[str, dict[str, str]] = read_toml("table", Path(__file__).with_suffix(".toml"))
"""Rows of ``table_two.toml`` by law, where the entries are explained."""


@dataclass(frozen=True)
class PrintedRow:
    """A row of Table II as the paper prints it.

    Attributes:
        number: the characteristic number as printed.
        value: its value for the parameters of section V.A; ``None`` if no formula is printed.
        conservative: as printed.
        continuous: as printed.
        energy: energy gained around the law's loop by the printed formula, for the parameters of
            section V.B [J]; ``None`` if only its sign is stated.
    """

    number: str
    value: float | None
    conservative: str
    continuous: str
    energy: float | None


@dataclass(frozen=True)
class TableTwoRow(Serializable):
    """A row of Table II, printed and computed.

    Attributes:
        law: letter of the law.
        printed: the printed row.
        q: the characteristic number for the parameters of section V.A.
        one_sided: the one-sided number q⁺.
        formula: closed form of the number; may be empty.
        conservative: whether the field is conservative, by its symbolic curl.
        continuous: whether the force is continuous inside the working region.
        energy: energy gained around the paper's loop for the parameters of section V.B [J].
        change: explanation of the differences.
    """

    serialized_attributes = (
        "law printed q one_sided formula conservative continuous energy number_agrees "
        "conservativity_agrees continuity_agrees energy_agrees change"
    )

    law: str
    printed: PrintedRow
    q: Bound
    one_sided: Bound
    formula: str
    conservative: bool
    continuous: bool
    energy: float
    change: str

    @property
    def number_agrees(self) -> bool | None:
        """Whether the printed formula gives q; ``None`` if none is printed."""
        if self.printed.value is None:
            return None
        return math.isclose(self.printed.value, self.q.value, rel_tol=1e-6)

    @property
    def conservativity_agrees(self) -> bool:
        """Whether the printed entry agrees with the symbolic curl."""
        return self.printed.conservative == ("Yes" if self.conservative else "No")

    @property
    def continuity_agrees(self) -> bool:
        """Whether the printed entry agrees with the force on this smooth surface."""
        return self.printed.continuous.startswith("No") is not self.continuous

    @property
    def energy_agrees(self) -> bool:
        """Whether the energy around the loop agrees with the printed formula, or with its sign."""
        scale = SCANNING.stiffness * SCANNING.amplitude**2
        if self.printed.energy is None:
            return self.energy > _ENERGY_TOLERANCE * scale
        return abs(self.energy - self.printed.energy) <= _ENERGY_TOLERANCE * scale

    @property
    def agrees(self) -> bool:
        """Whether the row is correct as printed."""
        return self.verdict == "yes"

    @property
    def verdict(self) -> str:
        """``"yes"`` if the row is correct, ``"new"`` if only a number is added, else ``"no"``."""
        others = self.conservativity_agrees and self.continuity_agrees and self.energy_agrees
        return {True: "yes", None: "new", False: "no"}[self.number_agrees] if others else "no"


@dataclass(frozen=True)
class TableTwo(Serializable, Displayable):
    """The paper's Table II, printed and computed.

    Attributes:
        rows: laws A to G.
        parameters: parameters of the numbers and of the loops, in words.
    """

    serialized_attributes = "parameters rows"

    rows: tuple[TableTwoRow, ...]
    parameters: str

    def row(self, law: str) -> TableTwoRow:
        """Return the row of a law by its letter.

        Raises:
            KeyError: if the table has no such row.
        """
        return {row.law: row for row in self.rows}[law]

    def cells(self) -> list[list[str]]:
        """Return the cells as text; the first row is the heading."""
        head = ["law", "q printed", "q", "q⁺", "conservative", "continuous", "loop", "stands"]
        return [head, *(_cells(row) for row in self.rows)]

    def __repr__(self) -> str:
        return (
            f"<TableTwo: {sum([row.agrees for row in self.rows])} of {len(self.rows)} rows stand>"
        )


def table_two() -> TableTwo:
    """Return Table II of the paper with every entry computed.

    Numbers for the parameters of the passivity experiment (section V.A), energies for those of the
    conservativity experiment (V.B) on the paths of Fig. 3.

    Returns:
        A :class:`TableTwo`: for each law the printed and the computed entries, whether they agree,
        and an explanation if not.

    Reference:
        The paper's Table II; (10), (12), (21), (27), (29), (31).

    Example:
        >>> table = table_two()
        >>> [row.law for row in table.rows if row.agrees]
        ['A', 'E']
        >>> round(table.row("F").printed.value, 2), round(table.row("F").q.value, 4)
        (5.85, 2.4863)
    """
    parameters = (
        f"q: A = {_format_mm(PASSIVITY.amplitude)}, l = {_format_mm(PASSIVITY.period)}, "
        f"depth and d_max {_format_mm(PASSIVITY.depth)}, μ = {PASSIVITY.friction}; "
        f"loops: k = {SCANNING.stiffness:g} N/m, l = {_format_mm(SCANNING.period)}, "
        f"a = {_format_mm(TURNING_DEPTH)}"
    )
    return TableTwo(tuple(_row(letter) for letter in PAPER_LAWS), parameters)


def _format_mm(length: float) -> str:
    return f"{length * 1e3:g} mm"


def _row(letter: str) -> TableTwoRow:
    surface = PASSIVITY.surface(letter)
    # Law F without texture, as in (27).
    changes = {"modulation_depth": 0.0} if letter == "F" else {}
    looped = SCANNING.surface(letter, **changes)
    q = characteristic_number(surface)
    printed = _printed_rows()[letter]
    return TableTwoRow(
        law=letter,
        printed=printed,
        q=q,
        one_sided=one_sided_number(surface),
        formula=TABLE_TWO[letter].get("formula", ""),
        conservative=surface.facts.conservative,
        continuous=continuity(surface, q).continuous,
        energy=loop_work(looped, SCANNING.loop_path(letter)),
        change=_explain_correction(letter, printed, q),
    )


def _printed_rows() -> dict[str, PrintedRow]:
    """Return the rows as printed, with the values of their formulas."""
    slope = 2.0 * math.pi * PASSIVITY.amplitude / PASSIVITY.period
    case = SCANNING
    k = SCANNING.stiffness
    root = math.hypot(1.0, 2.0 * math.pi * case.amplitude / case.period)
    half = 0.5 * k * case.amplitude**2
    b_energy = half + k * case.period**2 / (4.0 * math.pi**2) * (1.0 - root)
    # (27) with the modulation m = 1/2 of a law without texture, where the paper has m = 0.
    f_energy = 0.5 * k * case.friction * 0.5 * case.deflection * (case.depth - TURNING_DEPTH)
    values = {"A": math.hypot(1.0, slope), "D": 1.0, "E": 1.0, "F": PAPER_CASE.sticking_norm()}
    energies = {"A": half, "B": b_energy, "C": 0.0, "D": 0.0, "F": f_energy}
    cells = {law: (row["conservative"], row["continuous"]) for law, row in TABLE_TWO.items()}
    return {
        law: PrintedRow(row["number"], values.get(law), *cells[law], energies.get(law))
        for law, row in TABLE_TWO.items()
    }


def _explain_correction(law: str, printed: PrintedRow, q: Bound) -> str:
    """Return the explanation of the differences."""
    case = PASSIVITY
    number = printed.value or 0.0
    return TABLE_TWO[law]["change"].format(
        y=4.0 * math.pi**2 * case.amplitude * case.depth / case.period**2,
        radius=1e3 * case.crest_radius,
        printed=number,
        root_two_printed=math.sqrt(2.0) * number,
        q=q.value,
    )


def _cells(row: TableTwoRow) -> list[str]:
    printed = row.printed
    number = printed.number if printed.value is None else f"{printed.number} = {printed.value:.4g}"
    return [
        row.law,
        "1" if printed.number == "1" else number,
        f"{_format_number(row.q)} ({row.q.method})",
        _format_number(row.one_sided),
        _format_fact(row.conservative, printed.conservative, row.conservativity_agrees),
        _format_fact(row.continuous, printed.continuous, row.continuity_agrees),
        f"{row.energy * 1e6 + 0.0:.0f} µJ",
        row.verdict,
    ]


def _format_fact(value: bool, printed: str, agrees: bool) -> str:
    return ("yes" if value else "no") + ("" if agrees else f" ({printed})")


def _format_number(bound: Bound) -> str:
    return f"{bound.value:.4f}" if math.isfinite(bound.value) else "∞"

"""The paper's Table II: printed entries, computed entries and explanations of differences."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.field_energy import loop_work
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.core.display import Displayable
from asperity.core.files import OMITTED, Serializable, written
from asperity.paper.cases import PAPER_CASE, PAPER_LAWS, PASSIVITY, SCANNING, TURNING_DEPTH

_ENERGY_TOLERANCE = 1e-9  # relative to k A²


@dataclass(frozen=True, kw_only=True)
class PrintedRow(Serializable):
    """A row of Table II as the paper prints it, and what has to be changed.

    Attributes:
        number: the characteristic number as printed.
        value: its value for the parameters of section V.A; ``None`` if no formula is printed.
        conservative: as printed.
        continuous: as printed.
        energy: energy gained around the law's loop by the printed formula, for the parameters of
            section V.B [J]; ``None`` if only its sign is stated.
        formula: closed form of the number, with G₁ = 2πA/l and y = 4π²AD/l²; empty without one.
        change: with {y}, {radius} [mm] of the crests, {q} and {printed}, values for the parameters
            of section V.A.
    """

    number: str
    value: float | None = None
    conservative: str
    continuous: str
    energy: float | None = None
    formula: str = field(metadata=OMITTED)
    change: str = field(metadata=OMITTED)


TABLE_TWO = {
    "A": PrintedRow(
        number="√(1 + [2πA/l]²)",
        conservative="No",
        continuous="If h continuous",
        formula="√(1 + G₁²)",
        change="Nothing, but that it is attained at x = 0 modulo l/2.",
    ),
    "B": PrintedRow(
        number="No closed-form",
        conservative="No",
        continuous="If h' continuous",
        formula="max(√(1 + G₁²), y)",
        change="There is a closed form, and it grows with the depth: y = {y:.2f} here.",
    ),
    "C": PrintedRow(
        number="No closed-form",
        conservative="Yes",
        continuous="If h' continuous",
        formula="greatest of 1, y and feasible roots of λ²(λ - 1 - G₁²) = E²(λ - 1)²/4",
        change=(
            "There is a closed form, and it grows with the depth: y = {y:.2f} here. For this "
            "law q⁺ is the number that decides."
        ),
    ),
    "D": PrintedRow(
        number="1",
        conservative="Yes",
        continuous="No. Even if h continuous",
        formula="1 if y <= 1/2, y/(1 - y) if y < 1, else infinite",
        change=(
            "(18) leaves out the curvature of the surface. The crests' radius of curvature is "
            "{radius:g} mm; from that depth on the force jumps and q is infinite. 1 is q⁺."
        ),
    ),
    "E": PrintedRow(
        number="1",
        conservative="No",
        continuous="If h continuous",
        formula="1",
        change="Nothing; (19) and (20) have the wrong sign.",
    ),
    "F": PrintedRow(
        number="Appendix I",
        conservative="Almost",
        continuous="If h continuous",
        formula="",
        change=(
            "The paper uses 8.3. Its own formula gives {printed:.2f}, and √2 times that "
            "{root_two_printed:.2f}: a factor √2/2 was dropped. The formula bounds each entry "
            "by itself, with a factor 2 that 0 <= h <= 1 rules out; the law as defined has "
            "{q:.4f}. 'Almost' is no: the loop of (27) gains energy."
        ),
    ),
    "G": PrintedRow(
        number="No closed-form",
        conservative="No",
        continuous="If h' continuous",
        formula="max(1, y)",
        change="There is a closed form, and it grows with the depth: y = {y:.2f} here.",
    ),
}
"""Rows by law, without the values of their formulas."""


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
    @written
    def number_agrees(self) -> bool | None:
        """Whether the printed formula gives q; ``None`` if none is printed."""
        if self.printed.value is None:
            return None
        return math.isclose(self.printed.value, self.q.value, rel_tol=1e-6)

    @property
    @written
    def conservativity_agrees(self) -> bool:
        """Whether the printed entry agrees with the symbolic curl."""
        return self.printed.conservative == ("Yes" if self.conservative else "No")

    @property
    @written
    def continuity_agrees(self) -> bool:
        """Whether the printed entry agrees with the force on this smooth surface."""
        return self.printed.continuous.startswith("No") is not self.continuous

    @property
    @written
    def energy_agrees(self) -> bool:
        """Whether the energy around the loop agrees with the printed formula, or with its sign."""
        scale = SCANNING.stiffness * SCANNING.amplitude**2
        if self.printed.energy is None:
            return self.energy > _ENERGY_TOLERANCE * scale
        return abs(self.energy - self.printed.energy) <= _ENERGY_TOLERANCE * scale

    @property
    def verdict(self) -> str:
        """``"yes"`` if the row is correct, ``"new"`` if only a number is added, else ``"no"``."""
        facts_agree = self.conservativity_agrees and self.continuity_agrees and self.energy_agrees
        if not facts_agree or self.number_agrees is False:
            return "no"
        return "yes" if self.number_agrees else "new"


@dataclass(frozen=True)
class TableTwo(Serializable, Displayable):
    """The paper's Table II, printed and computed.

    Attributes:
        rows: laws A to G.
        parameters: parameters of the numbers and of the loops, in words.
    """

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
        return [head, *map(_cells, self.rows)]

    def __repr__(self) -> str:
        verdicts = [row.verdict for row in self.rows]
        return f"<TableTwo: {verdicts.count('yes')} of {len(verdicts)} rows stand>"


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
        >>> [row.law for row in table.rows if row.verdict == "yes"]
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
    return TableTwo(tuple(map(_row, PAPER_LAWS)), parameters)


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
        formula=printed.formula,
        conservative=surface.facts.conservative,
        continuous=continuity(surface, q).continuous,
        energy=loop_work(looped, SCANNING.loop_path(letter)),
        change=_explain_correction(printed, q),
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
    return {
        law: replace(row, value=values.get(law), energy=energies.get(law))
        for law, row in TABLE_TWO.items()
    }


def _explain_correction(printed: PrintedRow, q: Bound) -> str:
    """Return the explanation of the differences."""
    case = PASSIVITY
    number = printed.value or 0.0
    return printed.change.format(
        y=4.0 * math.pi**2 * case.amplitude * case.depth / case.period**2,
        radius=1e3 * case.crest_radius,
        printed=number,
        root_two_printed=math.sqrt(2.0) * number,
        q=q.value,
    )


def _cells(row: TableTwoRow) -> list[str]:
    printed = row.printed
    number = printed.number
    if printed.value is not None and number != "1":
        number += f" = {printed.value:.4g}"
    return [
        row.law,
        number,
        f"{_format_number(row.q)} ({row.q.method})",
        _format_number(row.one_sided),
        _format_fact(row.conservative, printed.conservative, row.conservativity_agrees),
        _format_fact(row.continuous, printed.continuous, row.continuity_agrees),
        f"{row.energy * 1e6 + 0.0:.0f} µJ",
        row.verdict,
    ]


def _format_fact(value: bool, printed: str, agrees: bool) -> str:
    fact = "yes" if value else "no"
    return fact if agrees else f"{fact} ({printed})"


def _format_number(bound: Bound) -> str:
    return f"{bound.value:.4f}" if math.isfinite(bound.value) else "∞"

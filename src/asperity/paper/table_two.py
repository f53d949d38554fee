"""The paper's Table II computed: what it prints, what is true, and what changed."""

from __future__ import annotations

import math
from dataclasses import dataclass

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.loops import loop_work
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.display import Displayed
from asperity.files import Record
from asperity.paper.claims_friction import PAPER, norm_of, stick_entries
from asperity.paper.plane import LAWS, PASSIVITY, SCANNING, TURN, path_of

# Relative to k A²: loops that do not agree differ by more.
_SAME_ENERGY = 1e-9


@dataclass(frozen=True)
class Printed:
    """A row of Table II as the paper prints it.

    Attributes:
        number: the characteristic number, in the paper's words.
        value: of it for the parameters of section V.A; ``None`` where no formula is printed.
        conservative: as printed.
        continuous: as printed.
        energy: what the formula of the law's own loop gives for the parameters of section V.B [J];
            ``None`` where only its sign is said.
    """

    number: str
    value: float | None
    conservative: str
    continuous: str
    energy: float | None


@dataclass(frozen=True)
class TableTwoRow(Record):
    """A row of Table II, printed and computed.

    Attributes:
        law: its letter.
        printed: what the paper prints.
        q: the characteristic number for the parameters of section V.A.
        one_sided: the one-sided number q⁺.
        formula: the number as a formula, where there is one.
        conservative: whether the field is, by its symbolic curl.
        continuous: whether the force is, inside the working region.
        energy: what the paper's loop gains, for the parameters of section V.B [J].
        change: what changed, and why.
    """

    written = (
        "law printed q one_sided formula conservative continuous energy number_agrees "
        "conservativity_agrees continuity_agrees energy_agrees change"
    )

    law: str
    printed: Printed
    q: Bound
    one_sided: Bound
    formula: str
    conservative: bool
    continuous: bool
    energy: float
    change: str

    @property
    def number_agrees(self) -> bool | None:
        """Whether the printed formula gives q; ``None`` where none is printed."""
        if self.printed.value is None:
            return None
        return math.isclose(self.printed.value, self.q.value, rel_tol=1e-6)

    @property
    def conservativity_agrees(self) -> bool:
        """Whether the paper prints what the curl says."""
        return self.printed.conservative == ("Yes" if self.conservative else "No")

    @property
    def continuity_agrees(self) -> bool:
        """Whether the paper prints what the force does on this smooth surface."""
        return self.printed.continuous.startswith("No") is not self.continuous

    @property
    def energy_agrees(self) -> bool:
        """Whether the paper's loop gains what its formula says, or has the sign that it says."""
        scale = SCANNING.stiffness * SCANNING.amplitude**2
        if self.printed.energy is None:
            return self.energy > _SAME_ENERGY * scale
        return abs(self.energy - self.printed.energy) <= _SAME_ENERGY * scale

    @property
    def agrees(self) -> bool:
        """Whether the row stands as printed."""
        return self.verdict == "yes"

    @property
    def verdict(self) -> str:
        """``"yes"`` if the row stands, ``"new"`` if only a number is added, else ``"no"``."""
        others = self.conservativity_agrees and self.continuity_agrees and self.energy_agrees
        return {True: "yes", None: "new", False: "no"}[self.number_agrees] if others else "no"


@dataclass(frozen=True)
class TableTwo(Record, Displayed):
    """The paper's Table II, printed and computed.

    Attributes:
        rows: laws A to G.
        parameters: of the numbers and of the loops, in words.
    """

    written = "parameters rows"

    rows: tuple[TableTwoRow, ...]
    parameters: str

    def row(self, law: str) -> TableTwoRow:
        """Return the row of a law by its letter.

        Raises:
            KeyError: for a letter that the table has not.
        """
        return {row.law: row for row in self.rows}[law]

    def cells(self) -> list[list[str]]:
        """Return the table as text, its first row the head."""
        head = ["law", "q printed", "q", "q⁺", "conservative", "continuous", "loop", "stands"]
        return [head, *(_cells(row) for row in self.rows)]

    def __repr__(self) -> str:
        return f"<TableTwo: {sum(row.agrees for row in self.rows)} of {len(self.rows)} rows stand>"


def table_two() -> TableTwo:
    """Return Table II of the paper with every entry computed.

    Numbers for the parameters of the passivity experiment (section V.A), energies for those of the
    conservativity experiment (V.B) on the paths of Fig. 3.

    Returns:
        A :class:`TableTwo`: for each law what is printed, what is computed, whether the two agree,
        and why not.

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
        f"q: A = {_mm(PASSIVITY.amplitude)}, l = {_mm(PASSIVITY.period)}, "
        f"depth and d_max {_mm(PASSIVITY.depth)}, μ = {PASSIVITY.friction}; "
        f"loops: k = {SCANNING.stiffness:g} N/m, l = {_mm(SCANNING.period)}, a = {_mm(TURN)}"
    )
    return TableTwo(tuple(_row(letter) for letter in LAWS), parameters)


def _mm(length: float) -> str:
    return f"{length * 1e3:g} mm"


def _row(letter: str) -> TableTwoRow:
    surface = PASSIVITY.surface(letter)
    # Law F without texture, as in (27).
    changes = {"modulation_depth": 0.0} if letter == "F" else {}
    looped = SCANNING.surface(letter, **changes)
    q, printed = characteristic_number(surface), _printed()[letter]
    return TableTwoRow(
        law=letter,
        printed=printed,
        q=q,
        one_sided=one_sided_number(surface),
        formula=_FORMULAS[letter],
        conservative=surface.facts.conservative,
        continuous=continuity(surface, q).continuous,
        energy=loop_work(looped, path_of(letter, SCANNING)),
        change=_change(letter, printed, q),
    )


_FORMULAS = {
    "A": "√(1 + G₁²)",
    "B": "max(√(1 + G₁²), y)",
    "C": "greatest of 1, y and feasible roots of λ²(λ - 1 - G₁²) = E²(λ - 1)²/4",
    "D": "1 if y <= 1/2, y/(1 - y) if y < 1, else infinite",
    "E": "1",
    "F": "",
    "G": "max(1, y)",
}


def _printed() -> dict[str, Printed]:
    """Return the table as printed, its formulas put in numbers."""
    slope = 2.0 * math.pi * PASSIVITY.amplitude / PASSIVITY.period
    case, k = SCANNING, SCANNING.stiffness
    root = math.hypot(1.0, 2.0 * math.pi * case.amplitude / case.period)
    half = 0.5 * k * case.amplitude**2
    b_energy = half + k * case.period**2 / (4.0 * math.pi**2) * (1.0 - root)
    # (27) with the modulation m = 1/2 of a law without texture, where the paper has m = 0.
    f_energy = 0.5 * k * case.friction * 0.5 * case.deflection * (case.depth - TURN)
    if_height, if_slope = "If h continuous", "If h' continuous"
    return {
        "A": Printed("√(1 + [2πA/l]²)", math.hypot(1.0, slope), "No", if_height, half),
        "B": Printed("No closed-form", None, "No", if_slope, b_energy),
        "C": Printed("No closed-form", None, "Yes", if_slope, 0.0),
        "D": Printed("1", 1.0, "Yes", "No. Even if h continuous", 0.0),
        "E": Printed("1", 1.0, "No", if_height, None),
        "F": Printed("Appendix I", norm_of(*stick_entries(PAPER)), "Almost", if_height, f_energy),
        "G": Printed("No closed-form", None, "No", if_slope, None),
    }


def _change(letter: str, printed: Printed, q: Bound) -> str:
    """Return what changed and why, with its numbers."""
    case = PASSIVITY
    y = 4.0 * math.pi**2 * case.amplitude * case.depth / case.period**2
    radius = _mm(case.depth / y)
    closed = f"There is a closed form, and it grows with the depth: y = {y:.2f} here."
    if letter == "F":
        own = printed.value or 0.0
        return (
            f"The paper uses 8.3. Its own formula gives {own:.2f}, and √2 times that "
            f"{math.sqrt(2.0) * own:.2f}: a factor √2/2 was dropped. The formula bounds each entry "
            "by itself, with a factor 2 that 0 <= h <= 1 rules out; the law as defined has "
            f"{q.value:.4f}. 'Almost' is no: the loop of (27) gains energy."
        )
    return {
        "A": "Nothing, but that it is attained at x = 0 modulo l/2.",
        "B": closed,
        "C": f"{closed} For this law q⁺ is the number that decides.",
        "D": (
            "(18) leaves out the curvature of the surface. The crests' radius of curvature is "
            f"{radius}; from that depth on the force jumps and q is infinite. 1 is q⁺."
        ),
        "E": "Nothing; (19) and (20) have the wrong sign.",
        "G": closed,
    }[letter]


def _cells(row: TableTwoRow) -> list[str]:
    printed = row.printed
    number = printed.number if printed.value is None else f"{printed.number} = {printed.value:.4g}"
    return [
        row.law,
        "1" if printed.number == "1" else number,
        f"{_number(row.q)} ({row.q.method})",
        _number(row.one_sided),
        _said(row.conservative, printed.conservative, row.conservativity_agrees),
        _said(row.continuous, printed.continuous, row.continuity_agrees),
        f"{row.energy * 1e6 + 0.0:.0f} µJ",
        row.verdict,
    ]


def _said(fact: bool, printed: str, agrees: bool) -> str:
    return ("yes" if fact else "no") + ("" if agrees else f" ({printed})")


def _number(bound: Bound) -> str:
    return f"{bound.value:.4f}" if math.isfinite(bound.value) else "∞"

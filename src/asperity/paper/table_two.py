"""The paper's Table II computed: what it prints, what is true, and what changed."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.loops import loop_work
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.analysis.gain.friction import largest_singular_value
from asperity.derive.facts import law_facts
from asperity.files import record
from asperity.surface import Surface
from asperity.textures.sinusoid import Sinusoid

# Section V.A, where the paper uses its numbers.
_STIFFNESS, _AMPLITUDE, _PERIOD, _DEPTH = 2000.0, 0.8e-3, 1e-3, 1e-3
_FRICTION, _DEFLECTION = 0.8, 1e-3
# Section V.B, where it measures energies.
_LOOP_STIFFNESS, _LOOP_PERIOD = 1000.0, 2e-3
# Where the loops of (27) and (29) turn; the paper leaves a open.
_A = 0.1e-3
# Relative to k A²: loops that do not agree differ by more.
_SAME_ENERGY = 1e-9
_ORDER = "ABCDEFG"


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
class TableTwoRow:
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
        scale = _LOOP_STIFFNESS * _AMPLITUDE**2
        if self.printed.energy is None:
            return self.energy > _SAME_ENERGY * scale
        return abs(self.energy - self.printed.energy) <= _SAME_ENERGY * scale

    @property
    def agrees(self) -> bool:
        """Whether the row stands as printed."""
        parts = (self.conservativity_agrees, self.continuity_agrees, self.energy_agrees)
        return self.number_agrees is True and all(parts)

    @property
    def verdict(self) -> str:
        """``"yes"`` if the row stands, ``"new"`` if only a number is added, else ``"no"``."""
        if self.agrees:
            return "yes"
        parts = (self.conservativity_agrees, self.continuity_agrees, self.energy_agrees)
        return "new" if self.number_agrees is None and all(parts) else "no"

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {
            **record(self, without=("change",)),
            **record(self, "number_agrees", "conservativity_agrees"),
            **record(self, "continuity_agrees", "energy_agrees", "change"),
        }


@dataclass(frozen=True)
class TableTwo:
    """The paper's Table II, printed and computed.

    Attributes:
        rows: laws A to G.
        parameters: of the numbers and of the loops, in words.
    """

    rows: tuple[TableTwoRow, ...]
    parameters: str

    def row(self, law: str) -> TableTwoRow:
        """Return the row of a law by its letter.

        Raises:
            KeyError: for a letter that the table has not.
        """
        for row in self.rows:
            if row.law == law:
                return row
        raise KeyError(law)

    def cells(self) -> list[list[str]]:
        """Return the table as text, its first row the head."""
        head = ["law", "q printed", "q", "q⁺", "conservative", "continuous", "loop", "stands"]
        return [head, *(_cells(row) for row in self.rows)]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return record(self, "parameters", "rows")

    def _repr_html_(self) -> str:
        """Return the table for a notebook."""
        head, *rows = (
            [f"<{tag}>{html.escape(cell)}</{tag}>" for cell in row]
            for row, tag in zip(self.cells(), ["th"] + ["td"] * len(self.rows), strict=True)
        )
        body = "".join(f"<tr>{''.join(row)}</tr>" for row in [head, *rows])
        return f"<p>{html.escape(self.parameters)}</p><table>{body}</table>"


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
        f"q: A = {_mm(_AMPLITUDE)}, l = {_mm(_PERIOD)}, depth and d_max {_mm(_DEPTH)}, "
        f"μ = {_FRICTION}; loops: k = {_LOOP_STIFFNESS:g} N/m, l = {_mm(_LOOP_PERIOD)}, "
        f"a = {_mm(_A)}"
    )
    return TableTwo(tuple(_row(letter) for letter in _ORDER), parameters)


def _mm(length: float) -> str:
    return f"{length * 1e3:g} mm"


def _surface(letter: str) -> Surface:
    """Return the surface of section V.A."""
    return Surface(
        Sinusoid(_AMPLITUDE, _PERIOD),
        letter,
        stiffness=_STIFFNESS,
        max_depth=_DEPTH,
        friction=_FRICTION,
        max_deflection=_DEFLECTION,
    )


def _row(letter: str) -> TableTwoRow:
    surface = _surface(letter)
    q, printed = characteristic_number(surface), _printed()[letter]
    return TableTwoRow(
        law=letter,
        printed=printed,
        q=q,
        one_sided=one_sided_number(surface),
        formula=_FORMULAS[letter],
        conservative=law_facts(surface.law).conservative,
        continuous=continuity(surface, q).continuous,
        energy=loop_work(_loop_surface(letter), _path(letter)),
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
    slope = 2.0 * math.pi * _AMPLITUDE / _PERIOD
    k, root = _LOOP_STIFFNESS, math.hypot(1.0, 2.0 * math.pi * _AMPLITUDE / _LOOP_PERIOD)
    half = 0.5 * k * _AMPLITUDE**2
    b_energy = half + k * _LOOP_PERIOD**2 / (4.0 * math.pi**2) * (1.0 - root)
    # (27) with the modulation m = 1/2 of a law without texture, where the paper has m = 0.
    f_energy = 0.5 * k * _FRICTION * 0.5 * _DEFLECTION * (_DEPTH - _A)
    if_height, if_slope = "If h continuous", "If h' continuous"
    return {
        "A": Printed("√(1 + [2πA/l]²)", math.hypot(1.0, slope), "No", if_height, half),
        "B": Printed("No closed-form", None, "No", if_slope, b_energy),
        "C": Printed("No closed-form", None, "Yes", if_slope, 0.0),
        "D": Printed("1", 1.0, "Yes", "No. Even if h continuous", 0.0),
        "E": Printed("1", 1.0, "No", if_height, None),
        "F": Printed("Appendix I", _appendix_one(), "Almost", if_height, f_energy),
        "G": Printed("No closed-form", None, "No", if_slope, None),
    }


def _appendix_one() -> float:
    """The norm of the paper's (26), which its (31) writes out; its h has no dimension."""
    a = 2.0 * _FRICTION * (_DEPTH / _DEFLECTION + math.pi * _AMPLITUDE / _PERIOD)
    return float(largest_singular_value(np.array([a]), np.array([2.0 * _FRICTION]))[0])


def _loop_surface(letter: str) -> Surface:
    """Return the surface of section V.B; law F without texture, as in (27)."""
    return Surface(
        Sinusoid(_AMPLITUDE, _LOOP_PERIOD),
        letter,
        stiffness=_LOOP_STIFFNESS,
        max_depth=_DEPTH,
        friction=_FRICTION,
        max_deflection=_DEFLECTION,
        modulation_depth=0.0,
    )


def _path(letter: str) -> Sequence[Sequence[float]]:
    """Return the path of Fig. 3 on which the paper looks at a law's energy, vertices [m]."""
    quarter = 0.25 * _LOOP_PERIOD
    if letter == "F":
        x, z = _DEFLECTION, -_DEPTH
        turns = [(0.0, 1e-3), (0.0, -_A), (x, -_A), (x, z), (0.0, z)]
    elif letter == "G":
        turns = [(quarter, _A), (quarter, -_A), (3.0 * quarter, -_A), (3.0 * quarter, _A)]
    else:
        turns = [(0.0, 0.0), (quarter, 0.0), (quarter, _AMPLITUDE), (0.0, _AMPLITUDE)]
    return [(x, 0.0, z) for x, z in turns]


def _change(letter: str, printed: Printed, q: Bound) -> str:
    """Return what changed and why, with its numbers."""
    y = 4.0 * math.pi**2 * _AMPLITUDE * _DEPTH / _PERIOD**2
    radius = _mm(_DEPTH / y)
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

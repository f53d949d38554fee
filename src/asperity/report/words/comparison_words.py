"""What a comparison says of each law, in words."""

from __future__ import annotations

from typing import Any

from asperity.analysis.compare import Comparison
from asperity.analysis.row import LawRow
from asperity.arguments import Argument
from asperity.report.words.number_words import (
    SAMPLED,
    holds_text,
    in_one_unit,
    is_sampled,
    law_title,
)
from asperity.textures.catalogue import CATALOGUE
from asperity.units import engineering, rounded_down

SAMPLED_NOTE = (
    "~ found by sampling, not proved: the true q, q⁺ and leak may be larger, "
    "the true safe stiffness smaller."
)
# Of maps and profiles, which are no arguments of a kind.
_LENGTHS = {"pitch", "cutoff"}
_UNSAID = {"kind", "preparation", "phase", "direction", "phases", "wavevectors"}


def stiffness_text(row: LawRow) -> str:
    """Return the stiffness up to which the device renders the law: "995 N/m", or "none"."""
    if row.safe_stiffness <= 0.0:
        return "none"
    mark = SAMPLED if is_sampled(row.limiting) else ""
    return f"{mark}{engineering(rounded_down(row.safe_stiffness), 'N/m')}"


def leak_text(row: LawRow, comparison: Comparison) -> str:
    """Return the energy of the worst loop: "0.64 mJ"; "0" where a proof says so.

    All laws are given in one unit, that of the largest, so that a column can be compared.
    """
    leak = row.leak
    if leak.energy == 0.0 and leak.method == "theorem":
        return "0"
    mark = SAMPLED if leak.method == "sampled" else ""
    energies = [leak.worst, *(other.leak.worst for other in comparison.rows)]
    return f"{mark}{in_one_unit(energies, 'J', digits=2)[0]}"


def strength_has_unit(comparison: Comparison) -> bool:
    """Return whether T carries metres: a surface without a period has no l to divide by."""
    return not comparison.texture.scan_line().periodic


def any_sampled(comparison: Comparison) -> bool:
    """Return whether any number of the table carries the ~."""
    return any(
        is_sampled(row.q) or is_sampled(row.one_sided) or row.leak.method == "sampled"
        for row in comparison.rows
    )


def described(description: dict[str, Any]) -> str:
    """Return the kind of a texture and its plain arguments in words.

    Example:
        >>> described({"kind": "sinusoid", "amplitude": 8e-4, "period": 1e-3, "phase": 0.0})
        'sinusoid: amplitude 0.8 mm, period 1 mm'
    """
    kind = CATALOGUE.get(description["kind"])
    declared = {} if kind is None else {argument.name: argument for argument in kind.arguments}
    parts = []
    for name, value in description.items():
        if name in _UNSAID:
            continue
        values = value if isinstance(value, list) else [value]
        if len(values) > 4:
            parts.append(f"{len(values)} {name}")
            continue
        shown = [_value_text(name, one, declared.get(name)) for one in values]
        parts.append(f"{law_title(name)} {' × '.join(shown)}")
    return f"{description['kind']}: {', '.join(parts)}"


def _value_text(name: str, value: Any, argument: Argument | None) -> str:
    if isinstance(value, bool):
        return holds_text(value)
    if argument is not None:
        return argument.readable(value)
    return engineering(value, "m") if name in _LENGTHS and isinstance(value, float) else f"{value}"

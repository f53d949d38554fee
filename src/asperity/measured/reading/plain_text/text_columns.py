"""The columns of a text file: which are positions, heights, validity or numbers of rows."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import SurfaceFileError
from asperity.measured.reading.plain_text.text_header import BRACKETED, ROLES, WORDS, split_words
from asperity.measured.reading.plain_text.text_table import TextTable
from asperity.measured.reading.reader import mask_missing

_MAX_HEADER_LINE = 1000


def select_columns(table: TextTable) -> tuple[TextTable, list[str], list[str]]:
    """Return a table with the columns x, z or x, y, z only, if the header names columns.

    Heights whose validity is 0 become missing, and a first column that numbers the rows is left
    out.

    Returns:
        The table, the names of its columns (none if the header does not name them), and notes.

    Raises:
        SurfaceFileError: the names contradict a profile or a list of points.
    """
    names = _find_names(table)
    notes = list[str]()
    invalid = np.zeros(len(table.values), bool)
    roles = [_find_role(name) for name in names]
    rest = list(range(len(names)))
    if "valid" in roles and len(rest) > 2:
        rest.remove(roles.index("valid"))
        invalid = _find_invalid(table, roles.index("valid"))
        notes.append(f"{invalid.sum()} of {len(invalid)} points are marked as not valid: missing")
    first = table.values[:, 0]
    if roles[:1] == ["index"] and first[0] in (0.0, 1.0) and np.all(np.diff(first) == 1.0):
        rest.remove(0)
        notes.append("the first column numbers the points: left out")
    order = [rest[k] for k in _find_order([names[k] for k in rest], [roles[k] for k in rest])]
    if order != rest:
        notes.append(f"columns taken: {', '.join(repr(names[k]) for k in order)}")
    table = _take_columns(table, order) if names else table
    table.values[invalid, -1] = np.nan
    return table, [names[k] for k in order] if len(order) <= 3 else [], notes


def _find_names(table: TextTable) -> list[str]:
    """Return the columns that the last header lines name; names and units may be on two lines."""
    lines = [line for line in table.header if line.strip(" \t,;") and len(line) <= _MAX_HEADER_LINE]
    cells = _split_names(lines[-1], table) if lines else []
    if cells and len(lines) > 1 and not any(split_words(cell) for cell in cells):
        above = _split_names(lines[-2], table)
        cells = [f"{name} {unit}" for name, unit in zip(above, cells, strict=False)] or cells
    is_numbers = any(re.search(r"(^|\s)[+-]?\d|[=:]", BRACKETED.sub("", cell)) for cell in cells)
    return [] if is_numbers else cells  # entries and numbers with their units


def _split_names(line: str, table: TextTable) -> list[str]:
    """Return a cell for each column; none if the line does not split into as many."""
    columns = table.values.shape[1]
    splits = [
        table.dialect.cells(line),
        re.split(r"\s*[,;\t]\s*", line.strip(" \t,;\r")),
        re.findall(r"[^\s\[\]()]+\s*[\[(][^\[\]()]*[\])]", line),
        re.findall(r"[^\s\[\]()]+(?:\s*[\[(][^\[\]()]*[\])])?", line),
    ]
    for cells in splits:
        if len(cells) >= columns and not any(cells[columns:]):  # separators at the end of the line
            return [cell.strip("\"' ") for cell in cells[:columns]]
    return []


def _find_role(name: str) -> str:
    if re.search(r"[01]/[01]", name):
        return "valid"
    words = split_words(name)
    if words & WORDS["quantities"]:
        return "other"
    return next((role for role, known in ROLES.items() if words & known), "")


def _find_invalid(table: TextTable, column: int) -> NDArray[np.bool_]:
    valid: FloatArray = table.values[:, column]
    wrong = ~np.isin(valid, (0.0, 1.0))
    if wrong.any():
        line = table.line_numbers[int(np.argmax(wrong))]
        raise SurfaceFileError(f"line {line}: validity must be 0 or 1")
    return np.asarray(valid == 0.0)


def _find_order(names: list[str], roles: list[str]) -> list[int]:
    """Return the columns x, z or x, y, z; all as they are if their names say nothing of that."""
    count = len(roles)
    if count == 2 and "y" in roles:  # the axis of heights in a picture, or the one of positions
        roles = [role.replace("y", "x" if "z" in roles else "z") for role in roles]
    says_nothing = not any(roles) or (count == 2 and roles in (["x", ""], ["", "z"]))
    if count < 2 or says_nothing or (count > 3 and not {"x", "y"} & set(roles)):
        return list(range(count))
    wanted = ["x", "z"] if count == 2 else ["x", "y", "z"]
    if any(roles.count(role) != 1 for role in wanted):
        fault = "are not x and z, or x, y and z: name them so, each once"
        raise SurfaceFileError(f"the columns {', '.join(map(repr, names))[:120]} {fault}")
    return [roles.index(role) for role in wanted]


def _take_columns(table: TextTable, order: Sequence[int]) -> TextTable:
    """Return a table with some of the columns, in this order."""
    rows = [table.dialect.cells(line) for line in table.row_texts]
    texts = [(table.dialect.separator or " ").join(row[k] for k in order) for row in rows]
    return replace(table, values=table.values[:, list(order)], row_texts=texts)


_MIN_POSITIONS = 5  # of a lone row or column in equal steps that is taken for positions


def reject_positions(table: TextTable) -> None:
    """Refuse a matrix with positions, or numbers of rows and columns, around its heights.

    Raises:
        SurfaceFileError: the first row or column rises or falls in equal steps, unlike the rest.
    """
    values = table.values
    if min(values.shape) < 3:
        return
    across = _is_axis(values[:, 1:])
    down = _is_axis(values[1:].T)
    rows, columns = np.array(values.shape) > _MIN_POSITIONS
    if (across and (down or columns)) or (down and rows):
        fault = "the first row or column looks like positions or numbers of the others"
        raise SurfaceFileError(f"{fault}: remove it, and give their distance as pitch (--pitch)")


def _is_axis(values: FloatArray) -> bool:
    """Whether the first row rises or falls in equal steps, and most others do not."""
    steps = np.diff(values, axis=1)
    sizes = np.abs(steps.mean(axis=1))
    is_even = (np.ptp(steps, axis=1) <= 0.1 * sizes) & (sizes > 0.0)
    return bool(steps.shape[1] >= 2 and is_even[0] and 2 * is_even[1:].sum() < len(is_even) - 1)


# --- codes of missing points ---------------------------------------------------------------------

_HUGE_CODES = (1.70141e38, -1.70141e38, 3.402823e38, -3.402823e38, 1e38, -1e38, 1e30, -1e30)
_CODES = (-9999.0, -99999.0, -32768.0, -2147483648.0, *_HUGE_CODES)
_RARE_CODES = (-999.0, 9999.0, 99999.0, 999999.0, -999999.0, 32767.0, 65535.0, 2147483647.0)
_ROUNDING = 1e-5  # codes of many digits are written with few


def mask_codes(values: FloatArray, declared: float | None) -> tuple[FloatArray, tuple[str, ...]]:
    """Return heights with NaN for each missing point, and the notes.

    Args:
        values: the numbers of the file.
        declared: number that the header declares to mark missing points; NaN if none does.

    Raises:
        SurfaceFileError: a number may be a height or a code.

    Example:
        >>> mask_codes(np.array([1.0, 2.5, -32768.0]), None)[0]
        array([1. , 2.5, nan])
    """
    if declared is not None:
        return mask_missing(values, declared)
    notes: tuple[str, ...] = ()
    for code in (*_CODES, *_RARE_CODES):
        found = np.isclose(values, code, rtol=_ROUNDING, atol=0.0)
        rest = values[~found & ~np.isnan(values)]
        if not found.any() or not rest.size:
            continue
        what = f"{int(found.sum())} points hold {code:g}, which"
        if max(rest.min() - code, code - rest.max()) > np.ptp(rest):
            values = np.where(found, np.nan, values)
            notes += (f"{what} marks a missing point",)
        elif code in _CODES:
            remedy = f"declare it in the header ('nodata: {code:g}', or 'nodata: nan' for none)"
            raise SurfaceFileError(f"{what} may be a height or mark a missing point: {remedy}")
    return values, notes

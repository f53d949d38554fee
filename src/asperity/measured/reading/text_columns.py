"""Columns of a table that are no lengths: the number of the point, and whether it is valid."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from asperity.errors import SurfaceFileError
from asperity.measured.reading.text_table import Table

_VALIDITY = {"valid", "validity", "mask", "isvalid", "[1/0]", "[0/1]", "(1/0)", "(0/1)"}
_NUMBERING = {"index", "idx", "no", "no.", "nr", "nr.", "point", "#"}
_MOST_COLUMNS = 6
_LOWEST = 3  # of the header's lines, from the numbers upwards, may name the columns


def lengths_alone(table: Table) -> tuple[Table, list[str]]:
    """Return a table of positions and heights, without a column of validity or of numbering.

    A validity column is one whose header says so ("valid", "[1/0]"): where it is 0 the height, the
    last of the other columns, becomes missing. A numbering column is the first where its header
    says "index" and it counts the rows.

    Args:
        table: as it stands in the file.

    Returns:
        The table, and what was done, one sentence each.

    Raises:
        SurfaceFileError: for a column of validity that holds more than 0 and 1.
    """
    notes = []
    validity = next((k for k, name in _named(table) if name in _VALIDITY), None)
    if validity is not None:
        valid = table.values[:, validity]
        if not np.isin(valid, (0.0, 1.0)).all():
            line = table.lines[int(np.argmin(np.isin(valid, (0.0, 1.0))))]
            raise SurfaceFileError(f"line {line}: validity must be 0 or 1")
        table = _without(table, validity)
        missing = valid == 0.0
        values = table.values.copy()
        values[missing, -1] = np.nan
        table = replace(table, values=values)
        count = int(missing.sum())
        notes.append(f"{count} of {len(valid)} points are marked as not valid: missing")
    numbering = any(k == 0 and name in _NUMBERING for k, name in _named(table))
    if numbering and _counts(table.values[:, 0]):
        table = _without(table, 0)
        notes.append("the first column numbers the points: left out")
    return table, notes


def _named(table: Table) -> Iterator[tuple[int, str]]:
    """Yield the columns with each of their names: those of a list of points, if they have some."""
    columns = table.values.shape[1]
    if not 3 <= columns <= _MOST_COLUMNS:
        return
    lines = [line for line in table.header if line.strip(" \t,;")]
    for line in lines[-_LOWEST:]:
        cells = table.dialect.cells(line[:1000])
        names = [cell.strip("\"' ").lower() for cell in cells]
        if len(cells) == columns:
            yield from enumerate(names)
        elif table.dialect.separator is None:  # "x [um] z [um] valid" has words of its own
            yield columns - 1, names[-1]


def _counts(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> bool:
    return values[0] in (0.0, 1.0) and bool(np.all(np.diff(values) == 1.0))


def _without(table: Table, column: int) -> Table:
    """Return a table without a column, in its lines and its header too."""
    columns = table.values.shape[1]
    header = [_cut(table, line, column, columns) for line in table.header]
    texts = [_cut(table, line, column, columns) for line in table.texts]
    values = np.delete(table.values, column, axis=1)
    return replace(table, values=values, header=header, texts=texts)


def _cut(table: Table, line: str, column: int, columns: int) -> str:
    cells = table.dialect.cells(line)
    if table.dialect.separator is None and cells and cells[-1].lower() in _VALIDITY:
        return " ".join(cells[:-1])
    if len(cells) != columns:
        return line
    return (table.dialect.separator or " ").join(cells[:column] + cells[column + 1 :])

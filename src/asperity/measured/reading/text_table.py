"""Find the table of numbers in a text file, among header, comments and footer."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.errors import SurfaceFileError

_COMMENT = ("#", "%")
_MISSING = frozenset(("", "nan", "na", "n/a", "null", "-", "--", "---", "*", "***"))
_SAMPLE = 400


@dataclass(frozen=True)
class Dialect:
    """How cells are separated (None: any white space) and the decimal sign."""

    separator: str | None
    decimal: str

    def cells(self, line: str) -> list[str]:
        """Split a line into cells without surrounding white space."""
        if self.separator is None:
            return line.split()
        return [cell.strip() for cell in line.strip(" \r").split(self.separator)]


# In order of preference. A comma is a decimal sign only where it cannot be a separator.
_DIALECTS = (
    Dialect("\t", "."),
    Dialect(";", "."),
    Dialect(",", "."),
    Dialect(None, "."),
    Dialect(";", ","),
    Dialect("\t", ","),
    Dialect(None, ","),
)


@dataclass(frozen=True)
class Table:
    """A block of numbers.

    Attributes:
        values: shape (rows, columns), NaN where missing.
        lines: line number of each row, from 1.
        texts: the line of each row.
        header: the lines above, comment signs removed.
        footer: how many lines of text follow.
        dialect: how the lines are split.
    """

    values: NDArray[np.float64]
    lines: list[int]
    texts: list[str]
    header: list[str]
    footer: int
    dialect: Dialect


def find_table(text: str) -> Table:
    """Find the one block of numbers in a text.

    Args:
        text: the whole file.

    Returns:
        The table.

    Raises:
        SurfaceFileError: no numbers, rows of different length, or text between the rows.
    """
    # Some instruments end a line with two carriage returns.
    lines = re.split(r"(?<!\r)\r*\n|\r", text)
    dialect = _dialect(lines)
    entries = _entries(lines, dialect)
    first, last = _longest_run(entries)
    _check_neighbours(entries, first, last)
    _check_text(entries, first, last, dialect)
    rows = [entry for entry in entries[first:last] if entry.row is not None]
    values = _drop_empty_columns(np.array([entry.row for entry in rows]))
    return Table(
        values=values,
        lines=[entry.number for entry in rows],
        texts=[_uncommented(lines[entry.number - 1]) for entry in rows],
        header=[lines[k].lstrip("#% \t") for k in range(entries[first].number - 1)],
        footer=sum(entry.row is None for entry in entries[last:]),
        dialect=dialect,
    )


@dataclass(frozen=True)
class _Entry:
    """A line that is neither blank nor a comment; row is None where it is no row of numbers."""

    number: int
    text: str
    row: NDArray[np.float64] | None


def _uncommented(line: str) -> str:
    return line.partition("#")[0].rstrip()


def _entries(lines: list[str], dialect: Dialect) -> list[_Entry]:
    entries = []
    for number, line in enumerate(lines, 1):
        text = _uncommented(line)
        if text.strip(" \t,;\f\x1a\ufeff") and not text.lstrip().startswith(_COMMENT):
            entries.append(_Entry(number, text, _row(text, dialect)))
    return entries


def _row(text: str, dialect: Dialect) -> NDArray[np.float64] | None:
    """Return the numbers of a line, None where a cell is neither a number nor missing."""
    if "_" in text or not text.isascii():  # Python's float would accept 1_000 and ١
        return None
    if dialect.decimal == ",":
        if "." in text:
            return None
        text = text.replace(",", ".")
    cells = dialect.cells(text)
    try:
        values = [float(cell) for cell in cells]
    except ValueError:
        return _row_with_missing(cells)
    return np.array(values)


def _row_with_missing(cells: list[str]) -> NDArray[np.float64] | None:
    values = np.full(len(cells), np.nan)
    numbers = 0
    for k, cell in enumerate(cells):
        if cell.lower() in _MISSING:
            continue
        try:
            values[k] = float(cell)
        except ValueError:
            return None
        numbers += 1
    return values if numbers else None


def _dialect(lines: list[str]) -> Dialect:
    """Choose the dialect that reads most of a sample as rows of one length."""
    step = max(1, len(lines) // _SAMPLE)
    sample = [_uncommented(line) for line in lines[::step]]
    sample = [line for line in sample if line.strip(" \t,;")]
    best, most = _DIALECTS[0], 0
    for dialect in _DIALECTS:
        rows = (_row(line, dialect) for line in sample)
        widths = Counter(len(row) for row in rows if row is not None)
        count = max(widths.values(), default=0)
        if count > most:
            best, most = dialect, count
    return best


def _longest_run(entries: list[_Entry]) -> tuple[int, int]:
    """Return the longest run of rows of one length, as entries[first:last]."""
    best = (0, 0)
    start = 0
    for k, entry in enumerate(entries):
        if entry.row is None:
            start = k + 1
        elif k > start and not _alike(entry, entries[k - 1]):
            start = k
        if entry.row is not None and k + 1 - start > best[1] - best[0]:
            best = (start, k + 1)
    if best == (0, 0):
        raise SurfaceFileError("no row of numbers")
    return best


def _alike(a: _Entry, b: _Entry) -> bool:
    return a.row is not None and b.row is not None and len(a.row) == len(b.row)


def _check_neighbours(entries: list[_Entry], first: int, last: int) -> None:
    """Refuse what would make the block a part of a longer table."""
    inside = entries[first]
    assert inside.row is not None
    if first > 0:
        before = entries[first - 1]
        if before.row is not None:
            raise _ragged(before, inside)
    for k, entry in enumerate(entries[:first]):
        if _alike(entry, inside) and len(inside.row) > 1:
            text = next(e for e in entries[k:] if e.row is None)
            raise _interrupted(text)
    for k, entry in enumerate(entries[last:], last):
        if entry.row is not None and k == last:
            raise _ragged(entry, inside)
        if entry.row is not None:
            raise _interrupted(entries[last])


def _check_text(entries: list[_Entry], first: int, last: int, dialect: Dialect) -> None:
    """Refuse a damaged first or last row, which would pass for a header or a footer."""
    row = entries[first].row
    assert row is not None
    for k in (first - 1, last):
        if 0 <= k < len(entries) and _is_damaged_row(entries[k].text, dialect, len(row)):
            raise _interrupted(entries[k])


def _is_damaged_row(text: str, dialect: Dialect, width: int) -> bool:
    """Tell "1 2 x 4" and "1.234,5;2" from a column header or a remark."""
    cells = dialect.cells(text)
    if len(cells) != width or not re.search("[0-9]", text):
        return False
    if not re.search(r"[^\W\d_]", text):  # digits without a letter
        return True
    named = [cell for cell in cells if cell]
    numbers = [_row(cell, Dialect(None, dialect.decimal)) is not None for cell in named]
    return numbers[0] and 2 * sum(numbers) >= len(named) > 1


def _ragged(odd: _Entry, usual: _Entry) -> SurfaceFileError:
    assert odd.row is not None
    assert usual.row is not None
    return SurfaceFileError(
        f"line {odd.number} has {len(odd.row)} values where line {usual.number}"
        f" has {len(usual.row)}: every row must have the same number of values"
    )


def _interrupted(entry: _Entry) -> SurfaceFileError:
    text = " ".join(entry.text.split())[:40]
    return SurfaceFileError(f"line {entry.number} ({text!r}) is not a row of numbers")


def _drop_empty_columns(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Drop columns at the right that are empty throughout: separators at the line's end."""
    used = np.flatnonzero(~np.isnan(values).all(axis=0))
    return values[:, : int(used[-1]) + 1] if len(used) else values

"""Find the table of numbers in a text file, among header, comments and footer."""

from __future__ import annotations

import math
import re
from array import array
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from asperity.errors import SurfaceFileError

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
        remarks: comments between the rows, likewise.
        footer: how many lines of text follow.
        dialect: how the lines are split.
    """

    values: NDArray[np.float64]
    lines: list[int]
    texts: list[str]
    header: list[str]
    remarks: list[str]
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
    blocks = _blocks(lines, dialect)
    chosen = _longest(blocks)
    _check_neighbours(blocks, chosen)
    _check_text(blocks, chosen, dialect)
    block = blocks[chosen]
    between = lines[block.numbers[0] : block.numbers[-1]]
    return Table(
        values=_drop_empty_columns(np.array(block.values).reshape(-1, block.width)),
        lines=block.numbers,
        texts=block.texts,
        header=[lines[k].lstrip("#% \t") for k in range(block.numbers[0] - 1)],
        remarks=[line.lstrip("#% \t") for line in between if line.lstrip().startswith(("#", "%"))],
        footer=sum(len(after.numbers) for after in blocks[chosen + 1 :]),
        dialect=dialect,
    )


@dataclass
class _Block:
    """Lines that follow each other, rows of one length or text; neither blank nor comments.

    Attributes:
        width: how many numbers each line has; 0 for text.
        numbers: of the lines, from 1.
        texts: the lines.
        values: the numbers, line by line, NaN where missing.
    """

    width: int
    numbers: list[int] = field(default_factory=list)
    texts: list[str] = field(default_factory=list)
    values: array[float] = field(default_factory=lambda: array("d"))


def _uncommented(line: str) -> str:
    return line.partition("#")[0].rstrip()


def _blocks(lines: list[str], dialect: Dialect) -> list[_Block]:
    blocks: list[_Block] = []
    for number, line in enumerate(lines, 1):
        text = _uncommented(line)
        if not text.strip(" \t,;\f\x1a\ufeff") or text.lstrip().startswith("%"):
            continue
        row = _row(text, dialect)
        if not blocks or blocks[-1].width != len(row):
            blocks.append(_Block(len(row)))
        block = blocks[-1]
        block.numbers.append(number)
        block.texts.append(text)
        block.values.extend(row)
    return blocks


def _row(text: str, dialect: Dialect) -> list[float]:
    """Return the numbers of a line, none where a cell is neither a number nor missing."""
    if "_" in text or not text.isascii():  # Python's float would accept 1_000 and ١
        return []
    if dialect.decimal == ",":
        if "." in text:
            return []
        text = text.replace(",", ".")
    cells = text.split(dialect.separator)
    try:
        return list(map(float, cells))
    except ValueError:
        return _row_with_missing([cell.strip().lower() for cell in cells])


def _row_with_missing(cells: list[str]) -> list[float]:
    if _MISSING.isdisjoint(cells) or _MISSING.issuperset(cells):
        return []
    try:
        return [math.nan if cell in _MISSING else float(cell) for cell in cells]
    except ValueError:
        return []


def _dialect(lines: list[str]) -> Dialect:
    """Choose the dialect that reads most of a sample as rows of one length."""
    step = max(1, len(lines) // _SAMPLE)
    sample = [_uncommented(line) for line in lines[::step]]
    sample = [line for line in sample if line.strip(" \t,;")]
    best, most = _DIALECTS[0], 0
    for dialect in _DIALECTS:
        rows = (_row(line, dialect) for line in sample)
        widths = Counter(len(row) for row in rows if row)
        count = max(widths.values(), default=0)
        if count > most:
            best, most = dialect, count
    return best


def _longest(blocks: list[_Block]) -> int:
    """Return the index of the longest block of numbers."""
    rows = [len(block.numbers) if block.width else 0 for block in blocks]
    if not any(rows):
        raise SurfaceFileError("no row of numbers")
    return rows.index(max(rows))


def _check_neighbours(blocks: list[_Block], chosen: int) -> None:
    """Refuse what would make the block a part of a longer table."""
    inside, after = blocks[chosen], blocks[chosen + 1 :]
    if chosen > 0 and blocks[chosen - 1].width:
        raise _ragged(blocks[chosen - 1], -1, inside)
    for k, block in enumerate(blocks[:chosen]):
        if block.width == inside.width > 1:
            raise _interrupted(next(b for b in blocks[k:] if not b.width), 0)
    if after and after[0].width:
        raise _ragged(after[0], 0, inside)
    if any(block.width for block in after):
        raise _interrupted(after[0], 0)


def _check_text(blocks: list[_Block], chosen: int, dialect: Dialect) -> None:
    """Refuse a damaged first or last row, which would pass for a header or a footer."""
    for k, line in ((chosen - 1, -1), (chosen + 1, 0)):
        if 0 <= k < len(blocks) and _is_damaged_row(
            blocks[k].texts[line], dialect, blocks[chosen].width
        ):
            raise _interrupted(blocks[k], line)


def _is_damaged_row(text: str, dialect: Dialect, width: int) -> bool:
    """Tell "1 2 x 4" and "1.234,5;2" from a column header or a remark."""
    cells = dialect.cells(text)
    if len(cells) != width or not re.search("[0-9]", text):
        return False
    if not re.search(r"[^\W\d_]", text):  # digits without a letter
        return True
    named = [cell for cell in cells if cell]
    numbers = [_row(cell, Dialect(None, dialect.decimal)) != [] for cell in named]
    return numbers[0] and 2 * sum(numbers) >= len(named) > 1


def _ragged(odd: _Block, line: int, usual: _Block) -> SurfaceFileError:
    return SurfaceFileError(
        f"line {odd.numbers[line]} has {odd.width} values where line {usual.numbers[0]}"
        f" has {usual.width}: every row must have the same number of values"
    )


def _interrupted(block: _Block, line: int) -> SurfaceFileError:
    text = " ".join(block.texts[line].split())[:40]
    return SurfaceFileError(f"line {block.numbers[line]} ({text!r}) is not a row of numbers")


def _drop_empty_columns(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Drop columns at the right that are empty throughout: separators at the line's end."""
    used = np.flatnonzero(~np.isnan(values).all(axis=0))
    return values[:, : int(used[-1]) + 1] if len(used) else values

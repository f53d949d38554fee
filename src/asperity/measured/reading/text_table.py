"""Find the table of numbers in a text file between header, comments and footer."""

from __future__ import annotations

import math
import re
from array import array
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import SurfaceFileError

_MISSING_MARKERS = frozenset(("", "nan", "na", "n/a", "null", "-", "--", "---", "*", "***"))
_SAMPLE_LINES = 400


@dataclass(frozen=True)
class Dialect:
    """Separator of the cells (None: any white space) and decimal sign."""

    separator: str | None
    decimal: str

    def cells(self, line: str) -> list[str]:
        """Return the cells of a line without surrounding white space."""
        if self.separator is None:
            return line.split()
        return [cell.strip() for cell in line.strip(" \r").split(self.separator)]


# In order of preference: a comma is a decimal sign only if it cannot be a separator.
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
class TextTable:
    """A block of numbers.

    Attributes:
        values: shape (rows, columns), NaN for missing numbers.
        line_numbers: line number of each row, from 1.
        row_texts: the line of each row.
        header: the lines above, without comment signs.
        comments: comments between the rows, without comment signs.
        n_footer_lines: number of lines of text below.
        dialect: separator and decimal sign.
    """

    values: FloatArray
    line_numbers: list[int]
    row_texts: list[str]
    header: list[str]
    comments: list[str]
    n_footer_lines: int
    dialect: Dialect


def find_table(text: str) -> TextTable:
    """Return the only block of numbers in a text.

    Raises:
        SurfaceFileError: no numbers, rows of different length, text between the rows, or commas
            that may be decimal signs.
    """
    # Some instruments end a line with two carriage returns.
    lines = re.split(r"(?<!\r)\r*\n|\r", text)
    dialect = _detect_dialect(lines)
    blocks = _split_blocks(lines, dialect)
    chosen = max(range(len(blocks)), key=lambda k: blocks[k].row_count, default=0)
    if not blocks or not blocks[chosen].width:
        raise SurfaceFileError("no row of numbers")
    _check_other_blocks(blocks, chosen, dialect)
    block = blocks[chosen]
    if dialect.separator == ",":
        _check_commas(block)
    between = lines[block.line_numbers[0] : block.line_numbers[-1]]
    return TextTable(
        values=_drop_empty_columns(np.array(block.values).reshape(-1, block.width)),
        line_numbers=block.line_numbers,
        row_texts=block.row_texts,
        header=[lines[k].lstrip("#% \t") for k in range(block.line_numbers[0] - 1)],
        comments=[line.lstrip("#% \t") for line in between if line.lstrip().startswith(("#", "%"))],
        n_footer_lines=sum([len(after.line_numbers) for after in blocks[chosen + 1 :]]),
        dialect=dialect,
    )


@dataclass
class _Block:
    """Successive lines, all rows of one length or all text, without blank lines and comments.

    Attributes:
        width: number of numbers in each line; 0 for text.
        line_numbers: line numbers, from 1.
        row_texts: the lines.
        values: the numbers, line by line, NaN for missing ones.
    """

    width: int
    line_numbers: list[int] = field(default_factory=list)
    row_texts: list[str] = field(default_factory=list)
    values: array[float] = field(default_factory=lambda: array("d"))

    @property
    def row_count(self) -> int:
        """Number of rows of numbers; 0 for text."""
        return len(self.line_numbers) * (self.width > 0)


def _strip_comment(line: str) -> str:
    return line.partition("#")[0].rstrip()


def _split_blocks(lines: list[str], dialect: Dialect) -> list[_Block]:
    blocks: list[_Block] = []
    for number, line in enumerate(lines, 1):
        text = _strip_comment(line)
        if not text.strip(" \t,;\f\x1a\ufeff") or text.lstrip().startswith("%"):
            continue
        row = _parse_row(text, dialect)
        if not blocks or blocks[-1].width != len(row):
            blocks.append(_Block(len(row)))
        block = blocks[-1]
        block.line_numbers.append(number)
        block.row_texts.append(text)
        block.values.extend(row)
    return blocks


def _parse_row(text: str, dialect: Dialect) -> list[float]:
    """Return the numbers of a line; none if a cell is neither a number nor missing."""
    if "_" in text or not text.isascii():  # float accepts 1_000 and ١
        return []
    if dialect.decimal == ",":
        if "." in text:
            return []
        text = text.replace(",", ".")
    cells = text.split(dialect.separator)
    with suppress(ValueError):
        return list(map(float, cells))
    cells = [cell.strip().lower() for cell in cells]
    if _MISSING_MARKERS.isdisjoint(cells) or _MISSING_MARKERS.issuperset(cells):
        return []
    with suppress(ValueError):
        return [math.nan if cell in _MISSING_MARKERS else float(cell) for cell in cells]
    return []


def _detect_dialect(lines: list[str]) -> Dialect:
    """Return the dialect that parses most of a sample as rows of one length."""
    step = max(1, len(lines) // _SAMPLE_LINES)
    sample = [_strip_comment(line) for line in lines[::step]]
    sample = [line for line in sample if line.strip(" \t,;")]
    best = _DIALECTS[0]
    best_count = 0
    for dialect in _DIALECTS:
        widths = Counter([len(_parse_row(line, dialect)) for line in sample])
        del widths[0]  # lines of text
        count = max(widths.values(), default=0)
        if count > best_count:
            best = dialect
            best_count = count
    return best


def _check_commas(block: _Block) -> None:
    """Refuse whole numbers between commas of which some begin with 0, as decimals after a comma."""
    for number, text in zip(block.line_numbers, block.row_texts, strict=True):
        if "." not in text and re.search(r"\d, *0\d", text):
            raise SurfaceFileError(
                f"line {number}: commas are decimal signs, or numbers begin with 0: separate "
                "numbers by semicolons or tabs, or write decimal points"
            )


def _check_other_blocks(blocks: list[_Block], index: int, dialect: Dialect) -> None:
    """Refuse a block that is a part of a longer table, or has a damaged first or last row."""
    table = blocks[index]
    before = blocks[:index]
    after = blocks[index + 1 :]
    if before and before[-1].width:
        raise _ragged_error(before[-1], -1, table)
    for k, block in enumerate(before):
        if block.width == table.width > 1:
            texts = [later for later in before[k:] if not later.width]
            raise _interrupted_error(texts[0], 0)
    if after and after[0].width:
        raise _ragged_error(after[0], 0, table)
    if any(block.width for block in after):
        raise _interrupted_error(after[0], 0)
    for block, line in [(block, -1) for block in before[-1:]] + [(block, 0) for block in after[:1]]:
        if _is_damaged_row(block.row_texts[line], dialect, table.width):
            raise _interrupted_error(block, line)


def _is_damaged_row(text: str, dialect: Dialect, width: int) -> bool:
    """Whether a text such as "1 2 x 4" or "1.234,5;2" is neither a column header nor a remark."""
    cells = dialect.cells(text)
    if len(cells) != width or not re.search("[0-9]", text):
        return False
    if not re.search(r"[^\W\d_]", text):  # digits without a letter
        return True
    named = [cell for cell in cells if cell]
    numbers = [_parse_row(cell, Dialect(None, dialect.decimal)) != [] for cell in named]
    return numbers[0] and 2 * sum(numbers) >= len(named) > 1


def _ragged_error(block: _Block, line: int, reference: _Block) -> SurfaceFileError:
    return SurfaceFileError(
        f"line {block.line_numbers[line]} has {block.width} values where line"
        f" {reference.line_numbers[0]} has {reference.width}: every row must have the same"
        " number of values"
    )


def _interrupted_error(block: _Block, line: int) -> SurfaceFileError:
    text = " ".join(block.row_texts[line].split())[:40]
    return SurfaceFileError(f"line {block.line_numbers[line]} ({text!r}) is not a row of numbers")


def _drop_empty_columns(values: FloatArray) -> FloatArray:
    """Return the values without empty columns at the right, from separators at the line's end."""
    used = np.flatnonzero(~np.isnan(values).all(axis=0))
    return values if not len(used) else values[:, : int(used[-1]) + 1]

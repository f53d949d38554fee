"""What the results in a terminal share: tables, lists of pairs, what was assumed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes:
        heading: may have several lines.
        right: whether it is aligned to the right.
        wraps: whether a text goes on in the next line; no character is ever cut there.
        most: its greatest width [characters], where it wraps.
        style: Rich's.
    """

    heading: str
    right: bool = False
    wraps: bool = False
    most: int | None = None
    style: str = ""


def table(
    columns: Sequence[Column],
    rows: Iterable[tuple[Sequence[str | Text], str]],
    *,
    gap: int = 1,
    ruled: bool = True,
) -> Table:
    """Return a table.

    Args:
        columns: its columns.
        rows: the cells of each row, and the style of the row.
        gap: characters between columns.
        ruled: whether a line stands below the headings, if there are any.
    """
    headed = any(column.heading for column in columns)
    made = Table(
        box=box.SIMPLE_HEAD if ruled and headed else None,
        padding=(0, gap, 0, 0), show_edge=False, pad_edge=False, show_header=headed,
    )  # fmt: skip
    for column in columns:
        justify: Literal["left", "right"] = "right" if column.right else "left"
        made.add_column(
            Text(column.heading), justify=justify, no_wrap=not column.wraps,
            overflow="fold" if column.wraps else "ellipsis", max_width=column.most,
            style=column.style,
        )  # fmt: skip
    for cells, style in rows:
        made.add_row(
            *[Text(cell) if isinstance(cell, str) else cell for cell in cells], style=style
        )
    return made


def pairs(rows: Iterable[tuple[str, str]], style: str = "", *, most: int | None = None) -> Table:
    """Return a list of two columns: a short word, and what is said of it.

    Args:
        rows: the pairs.
        style: of both columns.
        most: the greatest width of the words [characters]; by default they are not broken.
    """
    made = Table.grid(padding=(0, 1, 0, 0))
    made.add_column(style=style, max_width=most, no_wrap=most is None)
    made.add_column(style=style, overflow="fold")
    for word, words in rows:
        made.add_row(Text(word), Text(words))
    return made


def say(console: Console, words: str, style: str = "") -> None:
    """Print a text as it is: brackets and numbers in it mean nothing to Rich."""
    console.print(Text(words, style=style))


def head(console: Console, words: str) -> None:
    """Print a heading with an empty line above it."""
    console.print()
    say(console, words, "bold")


def print_assumptions(console: Console, assumptions: Sequence[str]) -> None:
    """Print what was assumed, if anything was."""
    if assumptions:
        head(console, "Assumed:")
        console.print(pairs(("-", sentence) for sentence in assumptions))

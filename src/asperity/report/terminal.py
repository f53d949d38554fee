"""What the results in a terminal share: tables, lists of pairs, what was assumed."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from asperity.report import page


def table(
    shown: page.Table,
    *,
    wraps: Collection[int] = (),
    most: Mapping[int, int] | None = None,
    without: Collection[int] = (),
    styles: Mapping[str, str] | None = None,
    gap: int = 1,
    ruled: bool = True,
) -> Table:
    """Return a table of a page for a terminal.

    Args:
        shown: the table; notes and details of its cells are for the page alone.
        wraps: columns whose texts go on in the next line; no character is ever cut there.
        most: greatest width of columns that wrap [characters].
        without: columns that are left out.
        styles: Rich's, of kinds of cells.
        gap: characters between columns.
        ruled: whether a line stands below the headings, if there are any.
    """
    made = Table(
        box=box.SIMPLE_HEAD if ruled and shown.headings else None, padding=(0, gap, 0, 0),
        show_edge=False, pad_edge=False, show_header=bool(shown.headings),
    )  # fmt: skip
    headings = shown.headings or [""] * len(shown.rows[0].cells)
    columns = [i for i in range(len(headings)) if i not in without]
    for i in columns:
        made.add_column(
            Text(headings[i]), justify="right" if i in shown.numbers else "left",
            no_wrap=i not in wraps, overflow="fold" if i in wraps else "ellipsis",
            max_width=(most or {}).get(i),
        )  # fmt: skip
    for row in shown.rows:
        style = row.style or ("bold" if row.kind == "best" else "")
        made.add_row(*[_text(row.cells[i], styles or {}) for i in columns], style=style)
    return made


def too_wide(shown: page.Table, order: Sequence[int], width: int, gap: int = 2) -> set[int]:
    """Return the columns of a table to leave out so that the others fit, none of them cut.

    Args:
        shown: the table.
        order: the columns that may be left out, the one that is wanted most first.
        width: of the console in characters.
        gap: characters between columns: one more than those of a ruled table.
    """
    cells = [shown.headings, *(row.cells for row in shown.rows)]
    texts = [[cell if isinstance(cell, str) else cell.text for cell in row] for row in cells]
    widths = [
        max(len(line) for text in column for line in text.split("\n")) + gap
        for column in zip(*texts, strict=True)
    ]
    room = width + gap - sum(widths) + sum(widths[i] for i in order)
    left_out = set(order)
    for column in order:
        room -= widths[column]
        if room < 0:
            break
        left_out.discard(column)
    return left_out


def _text(cell: str | page.Cell, styles: Mapping[str, str]) -> Text:
    if isinstance(cell, str):
        return Text(cell)
    text = Text(cell.text, styles.get(cell.kind, ""))
    return text.append(f"\n{cell.below}", "dim") if cell.below else text


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

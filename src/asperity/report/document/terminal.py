"""Pages in a terminal: text, tables and lists, rendered by Rich."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import accumulate

from rich import box
from rich.console import Console, RenderableType
from rich.table import Table as RichTable
from rich.text import Text

from asperity.report.document import page as pages

_KIND_STYLES = {"l": "bold", "good": "green", "part": "yellow", "no": "red", "open": "dim"}
_MAX_NAME_WIDTH = 26  # of a list of pairs [characters]


class _CodeText(Text):
    """A line of code or a path, which a console does not wrap."""


def print_page(page: pages.Page, console: Console) -> None:
    """Print the answer of a page and its sections for a terminal."""
    for part in page_renderables(page, console.width):
        console.print(part, soft_wrap=isinstance(part, _CodeText))


def page_renderables(page: pages.Page, width: int) -> Iterator[RenderableType]:
    """Yield the answer of a page and its sections, for a console of a width [characters]."""
    if page.answer:
        yield Text(page.answer, "bold")
    is_first = not page.answer
    for section in page.sections:
        if pages.Media.TERMINAL not in section.media:
            continue
        parts = list(_section_parts(section, width))
        if parts and not is_first:
            yield Text()
        is_first = is_first and not parts
        yield from parts


def _section_parts(section: pages.Section, width: int) -> Iterator[RenderableType]:
    if pages.Media.HEADING in section.media:
        yield Text(section.title, "bold")
    for block in section.blocks:
        yield from _block_parts(block, width)
    for note in section.notes:
        yield Text(note, "dim")


def _block_parts(block: pages.Block, width: int) -> Iterator[RenderableType]:
    """Yield a block; pictures and cards have no equivalent in a terminal."""
    if isinstance(block, pages.Table):
        yield rich_table(block, width)
        hidden = _hidden_columns(block, width)
        shown = [text for i, text in block.layout.legend.items() if i not in hidden]
        if shown:
            yield Text()
            yield rich_pairs(shown, "dim")
        if block.layout.dropped_note and _dropped_columns(block, width):
            yield Text(block.layout.dropped_note, "dim")
    elif isinstance(block, pages.BulletList):
        yield rich_pairs(("-", sentence) for sentence in block.sentences)
    elif isinstance(block, pages.DefinitionList):
        yield rich_pairs(block.pairs, "dim")
    elif isinstance(block, pages.Paragraph):
        if block.kind in ("code", "mono"):
            yield from (_CodeText(line, overflow="fold") for line in block.text.split("\n"))
        else:
            yield Text(block.text, "dim" if block.kind == "note" else "", overflow="fold")


def _hidden_columns(table: pages.Table, width: int) -> set[int]:
    """Return the columns of a table that a console of a width [characters] does not show."""
    layout = table.layout
    narrow = {i for i, least in layout.min_console.items() if width < least}
    return {*layout.omit, *narrow, *_dropped_columns(table, width)}


def _dropped_columns(table: pages.Table, width: int) -> set[int]:
    """Return the columns of the drop order to leave out, so that the others fit uncut."""
    order = table.layout.drop_order
    gap = table.layout.gap + 1
    if not order:
        return set()
    cells = [table.headings, *(row.cells for row in table.rows)]
    widths = [
        max([len(line) for cell in column for line in _plain_text(cell).split("\n")]) + gap
        for column in zip(*cells, strict=True)
    ]
    room = width + gap - sum(widths) + sum([widths[i] for i in order])
    fitting = sum([total <= room for total in accumulate(widths[i] for i in order)])
    return set(order[fitting:])


def _plain_text(cell: str | pages.Cell) -> str:
    return cell if isinstance(cell, str) else cell.text


def rich_table(table: pages.Table, width: int) -> RichTable:
    """Return a table for a console of a width [characters], without tooltips and details."""
    layout = table.layout
    headings = table.headings or [""] * len(table.rows[0].cells)
    columns = sorted(set(range(len(headings))) - _hidden_columns(table, width))
    is_limited = layout.max_widths_below is None or width < layout.max_widths_below
    result = RichTable(box=None, show_edge=False, pad_edge=False, show_header=bool(table.headings))
    if layout.has_rule and table.headings:
        result.box = box.SIMPLE_HEAD
    result.padding = (0, 0, 0, 0)
    if width >= layout.tight_below:
        result.padding = (0, layout.gap, 0, 0)
    for i in columns:
        result.add_column(
            Text(headings[i]),
            justify="right" if i in table.numeric_columns else "left",
            no_wrap=i not in layout.wrap,
            overflow="fold" if i in layout.wrap else "ellipsis",
            max_width=layout.max_widths.get(i) if is_limited else None,
        )
    for row in table.rows:
        style = "bold" if row.is_best else row.style
        result.add_row(*[_cell_text(row.cells[i]) for i in columns], style=style)
    return result


def _cell_text(cell: str | pages.Cell) -> Text:
    if isinstance(cell, str):
        return Text(cell)
    text = Text(cell.text, _KIND_STYLES.get(cell.kind, ""))
    if cell.subtext:
        text.append(f"\n{cell.subtext}", "dim")
    return text


def rich_pairs(rows: Iterable[tuple[str, str]], style: str = "") -> RichTable:
    """Return a list of two columns, a short name and its text, in a Rich style."""
    grid = RichTable.grid(padding=(0, 1, 0, 0))
    grid.add_column(style=style, max_width=_MAX_NAME_WIDTH)
    grid.add_column(style=style, overflow="fold")
    for name, text in rows:
        grid.add_row(Text(name), Text(text))
    return grid

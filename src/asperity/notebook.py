"""How a notebook shows a result: its answer and its tables."""

from __future__ import annotations

import html
from collections.abc import Sequence


def as_html(answer: str, *tables: tuple[Sequence[str], Sequence[Sequence[str]]]) -> str:
    """Return a paragraph and tables, each its headings and its rows, as HTML.

    Example:
        >>> as_html("a < b", (["x"], [["1"], ["2"]]))
        '<p>a &lt; b</p><table><tr><th>x</th></tr><tr><td>1</td></tr><tr><td>2</td></tr></table>'
    """
    body = "".join(
        f"<table>{_row('th', headings)}{''.join(_row('td', cells) for cells in rows)}</table>"
        for headings, rows in tables
    )
    return f"<p>{html.escape(answer)}</p>{body}"


def _row(tag: str, cells: Sequence[str]) -> str:
    return f"<tr>{''.join(f'<{tag}>{html.escape(cell)}</{tag}>' for cell in cells)}</tr>"

"""A report of pictures and tables as one HTML file that needs no network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import jinja2

import asperity


@dataclass(frozen=True)
class Picture:
    """A picture with its words.

    Attributes:
        title: heading.
        caption: what is to be seen.
        source: data URI.
        notes: paragraphs below it.
    """

    title: str
    caption: str
    source: str
    notes: Sequence[str] = ()


@dataclass(frozen=True)
class Row:
    """A row of a table.

    Attributes:
        cells: texts.
        kinds: of single cells, by column: "no", "good" and "part" are coloured, "l" is bold,
            "open" is faint.
        id: for links to the row; may be empty.
        summary: of the details, which are folded away.
        details: names and values of what stands behind the row.
        details_in: the column that they are folded into.
    """

    cells: Sequence[str]
    kinds: Mapping[int, str] = field(default_factory=dict)
    id: str = ""
    summary: str = "Evidence"
    details: Sequence[tuple[str, str]] = ()
    details_in: int = 0


@dataclass(frozen=True)
class Grid:
    """A table with its words.

    Attributes:
        title: heading.
        caption: what it says.
        headings: of the columns.
        rows: its rows.
        numbers: which columns are numbers, from 0.
        notes: paragraphs below it.
    """

    title: str
    caption: str
    headings: Sequence[str]
    rows: Sequence[Row]
    numbers: Sequence[int] = ()
    notes: Sequence[str] = ()


@dataclass(frozen=True)
class Page:
    """A report.

    Attributes:
        title: of the page.
        answer: one or two sentences.
        facts: names and values of what was asked.
        parts: pictures and tables in order.
        assumptions: sentences.
        footer: where it comes from.
    """

    title: str
    answer: str
    facts: Sequence[tuple[str, str]]
    parts: Sequence[Picture | Grid]
    assumptions: Sequence[str] = ()
    footer: str = ""


def page_html(page: Page) -> str:
    """Return the page as HTML; nothing is loaded from elsewhere; light, dark and print."""
    return _template().render(page=page, version=asperity.__version__)


@lru_cache(maxsize=1)
def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("asperity.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("page.html.j2")

"""Pages: the one description of a result, from which terminal, notebook and HTML are rendered.

:mod:`asperity.report.document.terminal` prints a page, :mod:`asperity.report.document.html` writes
it as an HTML file or as the output of a notebook cell.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import Flag, auto
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from asperity.core.errors import ParameterError
from asperity.report.sentences.texts import figure_text, yes_no_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAPER_CITATION = "after Campion and Hayward, “On the Synthesis of Haptic Textures”"
NO_PERCEPTUAL_TEST = "Not validated by a perceptual test."


class Media(Flag):
    """The media that show a section; ``HEADING`` prints its title in a terminal too."""

    HTML = auto()
    TERMINAL = auto()
    NOTEBOOK = auto()
    HEADING = auto()


SCREEN = Media.HTML | Media.TERMINAL
"""An HTML file, and a terminal without the title of the section."""
HEADED = Media.TERMINAL | Media.HEADING
"""A terminal, below the title of the section."""


@dataclass(frozen=True)
class Paragraph:
    """A paragraph.

    Attributes:
        text: plain text.
        kind: "note" is faint, "mono" is one line of code; "code" keeps its line breaks.
    """

    block_type: ClassVar[str] = "words"
    text: str
    kind: str = ""


@dataclass(frozen=True)
class BulletList:
    """A list of sentences."""

    block_type: ClassVar[str] = "items"
    sentences: Sequence[str]


@dataclass(frozen=True)
class DefinitionList:
    """Terms with their meanings."""

    block_type: ClassVar[str] = "definitions"
    pairs: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Picture:
    """A figure, drawn only by a renderer that shows it.

    Attributes:
        draw: returns the figure.
        description: what the figure shows, in a sentence or two for readers who cannot see it, or
            a function that returns it; the ranges of lines and colours are appended.
        name: namespace of the rendered figure in the cache.
        find_digest: returns the content digest of everything the figure depends on; with a digest
            the rendered figure is cached, and drawn in a helper process if one is available, so
            functions must then be such that can be pickled. ``None``: it depends on more.
        dpi: resolution of the parts drawn as pixels.
    """

    block_type: ClassVar[str] = "picture"
    draw: Callable[[], Figure]
    description: str | Callable[[], str]
    name: str = ""
    find_digest: Callable[[], str | None] | None = None
    dpi: int = 160

    def describe(self) -> str:
        """Return what the figure shows."""
        return self.description() if callable(self.description) else self.description


@dataclass(frozen=True)
class Cell:
    """A cell of a table; a plain string is a cell too.

    Attributes:
        text: the content.
        kind: "no", "good" and "part" are coloured, "l" is bold, "open" is faint, "mono" is code,
            "line" is not broken.
        note: tooltip.
        subtext: a faint line below the text.
        summary: heading of the details.
        details: names and values of the evidence, folded away on a page.
    """

    text: str
    kind: str = ""
    note: str = ""
    subtext: str = ""
    summary: str = "Evidence"
    details: Sequence[tuple[str, str]] = ()


Cells = list[str | Cell]


@dataclass(frozen=True)
class Row:
    """A row of a table.

    Attributes:
        cells: one per column.
        is_best: whether it is tinted, and bold in a terminal.
        id: anchor for links to the row; may be empty.
        style: Rich style in a terminal.
        law: letter of the law that the row belongs to; the row is hidden with that law.
    """

    cells: Sequence[str | Cell]
    is_best: bool = False
    id: str = ""
    style: str = ""
    law: str = ""


@dataclass(frozen=True)
class TableLayout:
    """How a terminal lays out a table; columns are counted from 0.

    Attributes:
        wrap: columns whose text is wrapped; no character of them is cut.
        max_widths: greatest width [characters] of wrapped columns.
        max_widths_below: console width [characters] below which ``max_widths`` applies; ``None``
            for every console.
        min_console: console width [characters] from which a column is shown.
        drop_order: columns that may be dropped on a narrow console, the most important first.
        omit: columns that are never shown.
        legend: heading and meaning of columns, printed below the table for those shown.
        dropped_note: printed below the table if columns were dropped.
        gap: characters between columns.
        tight_below: console width [characters] below which columns are one character apart.
        has_rule: whether a line is drawn below the headings, if there are any.
    """

    wrap: Collection[int] = ()
    max_widths: Mapping[int, int] = field(default_factory=dict)
    max_widths_below: int | None = None
    min_console: Mapping[int, int] = field(default_factory=dict)
    drop_order: Sequence[int] = ()
    omit: Collection[int] = ()
    legend: Mapping[int, tuple[str, str]] = field(default_factory=dict)
    dropped_note: str = ""
    gap: int = 1
    tight_below: int = 0
    has_rule: bool = True


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes:
        headings: of the columns; none for a list of pairs.
        rows: its rows.
        numeric_columns: columns of numbers, aligned to the right.
        layout: in a terminal.
    """

    block_type: ClassVar[str] = "table"
    headings: Sequence[str]
    rows: Sequence[Row]
    numeric_columns: Sequence[int] = ()
    layout: TableLayout = TableLayout()


@dataclass(frozen=True)
class Cards:
    """Sections side by side."""

    block_type: ClassVar[str] = "cards"
    sections: Sequence[Section]


Block = Paragraph | BulletList | DefinitionList | Picture | Table | Cards


@dataclass(frozen=True)
class Section:
    """A heading with the blocks below it.

    Attributes:
        title: heading; may be empty.
        blocks: in order.
        caption: explanation above the blocks, on a page alone.
        notes: faint paragraphs below the blocks.
        level: 2, or 3 for a part of the section before it.
        kind: "assumed" is framed.
        id: anchor for links to the section; may be empty.
        media: where the section is shown.
    """

    title: str
    blocks: Sequence[Block]
    caption: str = ""
    notes: Sequence[str] = ()
    level: int = 2
    kind: str = ""
    id: str = ""
    media: Media = Media.HTML


@dataclass(frozen=True)
class Page:
    """A report.

    Attributes:
        title: heading of the HTML file; empty for a result without one.
        answer: one or two sentences.
        facts: names and values of the given arguments, on a page alone.
        sections: in order.
        footer: origin of the method.
        methods: a paragraph for the methods section of a paper; may be empty.
    """

    title: str
    answer: str
    facts: Sequence[tuple[str, str]] = ()
    sections: Sequence[Section] = ()
    footer: str = ""
    methods: str = ""


def single_line(heading: str) -> str:
    """Return a heading in one line."""
    return heading.replace("-\n", "").replace("\n", " ")


def pairs_table(rows: Sequence[tuple[str, str]]) -> Table:
    """Return a table without headings: a bold name and its value per row."""
    layout = TableLayout(wrap=(0, 1), max_widths={0: 26})
    return Table((), [Row([Cell(name, "l"), text]) for name, text in rows], layout=layout)


def terminal_section(*blocks: Block, notes: Sequence[str] = ()) -> Section:
    """Return a section without a title that only a terminal shows."""
    return Section("", blocks, notes=notes, media=Media.TERMINAL)


def terminal_page(*blocks: Block) -> Page:
    """Return a page of one section that only a terminal shows."""
    return Page("", "", (), [terminal_section(*blocks)])


def notebook_page(answer: str, *blocks: Block) -> Page:
    """Return a page without a title, which only a notebook shows."""
    return Page("", answer, (), [Section("", blocks, media=Media.NOTEBOOK)])


def plot_later(result: Any, picture: str | None = None) -> Callable[[], Figure]:
    """Return a function that draws a figure of a result; see :func:`asperity.report.plot`."""
    return partial(_plot, result, picture)


def _plot(result: Any, picture: str | None) -> Figure:
    from asperity.report.pictures.plotting import plot  # Matplotlib is needed to draw alone

    return plot(result, picture)


def picture_section(
    title: str,
    draw: Callable[[], Figure],
    description: str,
    caption: str = "",
    notes: Sequence[str] = (),
    level: int = 2,
    media: Media = Media.HTML,
) -> Section:
    """Return a section that shows a figure; see :class:`Picture`."""
    return Section(title, [Picture(draw, description)], caption, notes, level, media=media)


def figure_section(
    name: str,
    draw: Callable[[], Figure],
    notes: Sequence[str] = (),
    level: int = 2,
    media: Media = Media.HTML,
    **values: object,
) -> Section:
    """Return a section that shows a figure with its texts.

    Args:
        name: of the texts; see :func:`asperity.report.sentences.texts.figure_text`.
        draw: see :class:`Picture`.
        notes: below the figure.
        level: see :class:`Section`.
        media: where it is shown.
        values: that replace the names in braces in the texts.
    """
    title, caption, description = figure_text(name, **values)
    return picture_section(title, draw, description, caption, notes, level, media)


def facts_section(facts: Sequence[tuple[str, str]]) -> Section:
    """Return the facts of a page for a terminal, one faint line each."""
    return terminal_section(notes=[f"{name}: {value}" for name, value in facts])


def assumption_sections(
    sentences: Sequence[str], *blocks: Block, brief: Sequence[str] | None = None
) -> list[Section]:
    """Return the sections of the assumptions; none without any.

    Args:
        sentences: the assumptions.
        blocks: shown below them on a page.
        brief: those that a terminal shows; ``None`` for all.
    """
    listed = sentences if brief is None else brief
    sections = []
    if sentences:
        sections.append(Section("Assumptions", [BulletList(sentences), *blocks], kind="assumed"))
    if listed:
        sections.append(Section("Assumed:", [BulletList(listed)], media=HEADED))
    return sections


def holds_cell(holds: bool | None) -> Cell:
    """Return yes, no, or ? for a condition that cannot be decided."""
    if holds is None:
        return Cell(yes_no_text(holds), "open")
    return flagged_cell(yes_no_text(holds), not holds)


def flagged_cell(text: str, is_wrong: bool) -> Cell:
    """Return a cell that is coloured if something is wrong."""
    return Cell(text, "no") if is_wrong else Cell(text)


@contextmanager
def default_style() -> Iterator[None]:
    """Draw figures with Matplotlib's defaults, whatever the user's settings, which are restored."""
    import matplotlib

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        yield


FIGURE_SUFFIXES = (".svg", ".png", ".pdf")
"""Suffixes of the files to which figures are written."""


def check_suffix(path: str, other: str) -> str:
    """Return the suffix of the file of a figure, or the other one.

    Raises:
        ParameterError: for another suffix.
    """
    suffix = Path(path).suffix.lower()
    suffixes = (other, *FIGURE_SUFFIXES)
    if suffix not in suffixes:
        raise ParameterError("output", f"must end in {', '.join(suffixes)}", path)
    return suffix


def figure_bytes(result: Any, suffix: str) -> bytes:
    """Return the main figure of a result as the content of a file of a suffix."""
    from asperity.report.pictures.style import to_bytes

    # Without a date, the same result gives the same file.
    metadata = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(suffix)
    with default_style():
        return to_bytes(_plot(result, None), format=suffix[1:], metadata=metadata)

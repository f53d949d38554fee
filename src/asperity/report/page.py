"""A report is values: a page of sections, a section of blocks. One template writes it as HTML."""

from __future__ import annotations

import base64
import hashlib
import os
import re
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, ClassVar

import asperity
from asperity.kept import content_digest, kept
from asperity.report.words.number_words import holds_text

if TYPE_CHECKING:
    import jinja2
    from matplotlib.figure import Figure

PAPER = "after Campion and Hayward, “On the Synthesis of Haptic Textures”"
UNFELT = "No perceptual test stands behind these numbers."


@dataclass(frozen=True)
class Words:
    """A paragraph.

    Attributes:
        text: plain text.
        kind: "note" is faint, "mono" is one line of code; "code" keeps its line breaks.
    """

    form: ClassVar[str] = "words"
    text: str
    kind: str = ""


@dataclass(frozen=True)
class Items:
    """A list of sentences."""

    form: ClassVar[str] = "items"
    sentences: Sequence[str]


@dataclass(frozen=True)
class Definitions:
    """Terms, and what each means."""

    form: ClassVar[str] = "definitions"
    pairs: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Picture:
    """A picture.

    Attributes:
        svg: SVG text of :func:`asperity.report.pictures.svg.svg_text`, which stands in the page as
            it is: never words from elsewhere.
        alt: what is seen, with its numbers, for who does not see it.
        numbers: what it shows as JSON, for the script of the page; "[]" for nothing.
    """

    form: ClassVar[str] = "picture"
    svg: str
    alt: str
    numbers: str = "[]"


@dataclass(frozen=True)
class Cell:
    """A cell of a table; a plain string is one too.

    Attributes:
        text: what it says.
        kind: "no", "good" and "part" are coloured, "l" is bold, "open" is faint, "mono" is code,
            "line" is not broken.
        note: shown when pointed at.
        below: a faint line below the text.
        summary: of the details.
        details: names and values of what stands behind it, folded away.
    """

    text: str
    kind: str = ""
    note: str = ""
    below: str = ""
    summary: str = "Evidence"
    details: Sequence[tuple[str, str]] = ()


Cells = list[str | Cell]


@dataclass(frozen=True)
class Row:
    """A row of a table.

    Attributes:
        cells: as many as the table has columns.
        kind: "best" is tinted, and bold in a terminal.
        id: for links to the row; may be empty.
        style: Rich's, in a terminal.
        law: letter of the law that the row is of, if it can be hidden with it.
    """

    cells: Sequence[str | Cell]
    kind: str = ""
    id: str = ""
    style: str = ""
    law: str = ""


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes:
        headings: of the columns; none for a list of pairs.
        rows: its rows.
        numbers: which columns are numbers, from 0.
    """

    form: ClassVar[str] = "table"
    headings: Sequence[str]
    rows: Sequence[Row]
    numbers: Sequence[int] = ()


@dataclass(frozen=True)
class Cards:
    """Sections side by side."""

    form: ClassVar[str] = "cards"
    sections: Sequence[Section]


Block = Words | Items | Definitions | Picture | Table | Cards


@dataclass(frozen=True)
class Section:
    """A heading and what stands below it.

    Attributes:
        title: heading; may be empty.
        blocks: in order.
        caption: what is to be seen, above the blocks.
        notes: paragraphs below them.
        level: 2, or 3 for a part of the section before it.
        kind: "assumed" stands in a box.
        id: for links to the section; may be empty.
    """

    title: str
    blocks: Sequence[Block]
    caption: str = ""
    notes: Sequence[str] = ()
    level: int = 2
    kind: str = ""
    id: str = ""


@dataclass(frozen=True)
class Page:
    """A report.

    Attributes:
        title: of the page.
        answer: one or two sentences.
        facts: names and values of what was asked.
        sections: in order.
        footer: where it comes from.
    """

    title: str
    answer: str
    facts: Sequence[tuple[str, str]]
    sections: Sequence[Section]
    footer: str = ""


@dataclass(frozen=True)
class Origin:
    """Where a page comes from.

    Attributes:
        command: that made it, as a shell takes it; empty from Python.
        content: digest of the result, see :func:`asperity.files.digest`; may be empty.
    """

    command: str = ""
    content: str = ""


def pairs(rows: Sequence[tuple[str, str]]) -> Table:
    """Return a table without headings: bold words, and what is said of each."""
    return Table((), [Row([Cell(word, "l"), words]) for word, words in rows])


def picture(figure: Figure, seen: str, dpi: int = 160) -> Picture:
    """Return a figure as a picture, with its numbers.

    Args:
        figure: the figure.
        seen: what is seen, in a sentence or two; what the lines and colours range over is added.
        dpi: of what in it is drawn as pixels.
    """
    from asperity.report.pictures.readings import panels_json, panels_of, ranges_text
    from asperity.report.pictures.svg import svg_text

    svg = svg_text(figure, dpi)  # draws it, after which it is known where the panels are
    panels = panels_of(figure)
    return Picture(svg, seen + ranges_text(panels), panels_json(panels))


def pictured(
    title: str,
    figure: Figure,
    seen: str,
    caption: str = "",
    notes: Sequence[str] = (),
    level: int = 2,
) -> Section:
    """Return a section that shows a figure; see :func:`picture`."""
    return Section(title, [picture(figure, seen)], caption, notes, level)


@contextmanager
def own_look() -> Iterator[None]:
    """Let figures look as they should, whatever the user's settings are, which stay."""
    import matplotlib

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        yield


def kept_picture(name: str, content: str | None, make: Callable[[], Picture]) -> Picture:
    """Return a picture from disk, or draw it in its own look and keep it there.

    Args:
        name: of the picture.
        content: a digest of what it shows; ``None`` where that is not known.
        make: draws it.
    """

    def drawn() -> Picture:
        with own_look():
            return make()

    if content is None:
        return drawn()
    return kept(f"picture {name}", content_digest(content, version("matplotlib")), drawn)


def holds_cell(holds: bool | None) -> Cell:
    """Return yes, no, or ? for what cannot be decided."""
    return Cell(holds_text(holds), "open" if holds is None else "" if holds else "no")


def assumed(sentences: Sequence[str], *blocks: Block) -> list[Section]:
    """Return the section that says what was assumed; none where nothing was."""
    if not sentences:
        return []
    return [Section("What was assumed", [Items(sentences), *blocks], kind="assumed")]


# --- sections of one's own ------------------------------------------------------------------------

_ADDED: dict[type, list[Callable[..., Section | None]]] = {}


def add_section(result: type, section: Callable[..., Section | None]) -> None:
    """Add a section to the page of every result of a type, before what was assumed.

    Args:
        result: the type, such as :class:`~asperity.analysis.compare.Comparison`.
        section: called with what the page is made of: a comparison, an analysis, limits; of a run
            its setup and the run. It returns a :class:`Section`, or ``None`` for none.
    """
    added = _ADDED.setdefault(result, [])
    if section not in added:
        added.append(section)


def added_sections(result: type, *arguments: Any) -> list[Section]:
    """Return the sections that were added to the pages of a type of result."""
    sections = _ADDED.get(result, ())
    with own_look() if sections else nullcontext():
        made = [section(*arguments) for section in sections]
    return [section for section in made if section is not None]


# --- HTML -----------------------------------------------------------------------------------------


def page_html(page: Page, origin: Origin | None = None) -> str:
    """Return the page as HTML; nothing is loaded from elsewhere; light, dark and print.

    Args:
        page: what it says.
        origin: of what it says, for its foot.
    """
    # Blanks that mean nothing make no page larger.
    style = re.sub(r"\s*([{};])\s*", r"\1", _file("style.css"))
    script = _file("page.js")
    return (
        environment()
        .get_template("page.html.j2")
        .render(
            page=page, style=style, script=script, allowed=_sha256(script),
            version=asperity.__version__, date=_date(), origin=origin or Origin(),
        )
    )  # fmt: skip


def _file(name: str) -> str:
    return resources.files("asperity.report").joinpath("templates", name).read_text("utf-8")


def _sha256(script: str) -> str:
    """Return the digest by which a content security policy knows the one script of the page."""
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")


def _date() -> str:
    """Return the day (UTC), or that of SOURCE_DATE_EPOCH, so that a page can be made again.

    Reference:
        https://reproducible-builds.org/specs/source-date-epoch
    """
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    seconds = int(epoch) if epoch.isdecimal() and len(epoch) < 12 else time.time()
    return time.strftime("%Y-%m-%d", time.gmtime(seconds))


@lru_cache(maxsize=1)
def environment() -> jinja2.Environment:
    """Return the templates of this room; all words are escaped."""
    import jinja2

    return jinja2.Environment(
        loader=jinja2.PackageLoader("asperity.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )

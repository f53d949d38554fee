"""Rendering of a page model to one HTML document."""

from __future__ import annotations

import pytest
from matplotlib.figure import Figure
from tests.report.report_pages import Reader, check_alone

from asperity.report import html_text
from asperity.report.document.html import render_page
from asperity.report.document.page import (
    BulletList,
    Cards,
    Cell,
    DefinitionList,
    Page,
    Paragraph,
    Picture,
    Row,
    Section,
    Table,
    assumption_sections,
)

HOSTILE = '<script>alert("1")</script>'


def page(*sections: Section) -> Reader:
    return check_alone(render_page(Page("title", "answer", [("name", "value")], sections)))


def all_blocks(text: str) -> list[Section]:
    """Return sections with one block of each type, with the text in every field."""
    cell = Cell(text, "no", note=text, subtext=text, summary=text, details=[(text, text)])
    table = Table((text, "n"), [Row([text, cell], True, id="row")], numeric_columns=(1,))
    blocks = [
        Paragraph(text),
        Paragraph(text, "code"),
        Paragraph(text, "mono"),
        BulletList([text]),
        DefinitionList([(text, text)]),
        Picture(lambda: Figure((1.0, 1.0)), text),
        table,
        Cards([Section(text, [table], level=3, id="card")]),
    ]
    return [Section(text, blocks, text, [text]), *assumption_sections([text], table)]


def test_every_text_of_every_block_is_rendered() -> None:
    reader = page(*all_blocks("word"))
    # 3 paragraphs, 1 list item, 2 in a definition; 7 in each of 3 tables; 5 in the section title,
    # caption, note, card title and assumption.
    assert reader.text.count("word") == 6 + 3 * 7 + 5
    assert reader.loaded == []
    assert reader.alts == ["word"]
    assert reader.tags.count("table") == 3
    assert reader.tags.count("section") == 3


def test_all_texts_are_escaped() -> None:
    text = render_page(Page(HOSTILE, HOSTILE, [(HOSTILE, HOSTILE)], all_blocks(HOSTILE), HOSTILE))
    assert HOSTILE not in text
    assert (
        Reader(text).tags.count("script") == 2
    )  # the script of the page and the data of the picture
    check_alone(text)
    assert 'aria-label="<' not in text


def test_command_in_the_footer_is_escaped() -> None:
    page_ = render_page(Page("title", "answer", [], []), "abc", f"asperity '{HOSTILE}'")
    assert HOSTILE not in page_
    assert "content abc" in check_alone(page_).text


def test_source_date_epoch_sets_the_date(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    text = render_page(Page("title", "answer", [], []))
    assert "1970-01-02" in text
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "soon")
    assert "1970" not in render_page(Page("title", "answer", [], []))


def test_no_assumptions_give_no_section() -> None:
    assert assumption_sections([]) == []


def test_report_of_an_unsupported_object_is_a_type_error() -> None:
    with pytest.raises(TypeError, match="a int has no report"):
        html_text(3)  # wrong type on purpose

"""The page: values in, one HTML text out."""

from __future__ import annotations

import pytest
from matplotlib.figure import Figure
from tests.report.pages import Reader, check_alone

from asperity.report import html_text
from asperity.report.html import Origin, render_page
from asperity.report.page import (
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


def everything(words: str) -> list[Section]:
    """Return one of each block, with the words everywhere."""
    cell = Cell(words, "no", note=words, subtext=words, summary=words, details=[(words, words)])
    table = Table((words, "n"), [Row([words, cell], "best", id="row")], numeric_columns=(1,))
    blocks = [
        Paragraph(words), Paragraph(words, "code"), Paragraph(words, "mono"), BulletList([words]),
        DefinitionList([(words, words)]), Picture(Figure((1.0, 1.0)), words), table,
        Cards([Section(words, [table], level=3, id="card")]),
    ]  # fmt: skip
    return [Section(words, blocks, words, [words]), *assumption_sections([words], table)]


def test_every_word_of_every_block_is_on_the_page() -> None:
    found = page(*everything("word"))
    # 3 paragraphs, an item, 2 of a definition; 3 tables of 7; title, caption and note around them,
    # the title of the card, the sentence assumed.
    assert found.text.count("word") == 6 + 3 * 7 + 5
    assert found.loaded == []
    assert found.alts == ["word"]
    assert found.tags.count("table") == 3
    assert found.tags.count("section") == 3


def test_nothing_is_taken_for_html() -> None:
    text = render_page(Page(HOSTILE, HOSTILE, [(HOSTILE, HOSTILE)], everything(HOSTILE), HOSTILE))
    assert HOSTILE not in text
    assert Reader(text).tags.count("script") == 2  # the page's own, and the picture's numbers
    check_alone(text)
    assert 'aria-label="<' not in text


def test_a_command_is_text() -> None:
    page_ = render_page(Page("title", "answer", [], []), Origin(f"asperity '{HOSTILE}'", "abc"))
    assert HOSTILE not in page_
    assert "content abc" in check_alone(page_).text


def test_a_page_can_be_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    text = render_page(Page("title", "answer", [], []))
    assert "1970-01-02" in text
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "soon")
    assert "1970" not in render_page(Page("title", "answer", [], []))


def test_nothing_assumed_is_no_section() -> None:
    assert assumption_sections([]) == []


def test_no_report_for_anything_else() -> None:
    with pytest.raises(TypeError, match="a int has no report"):
        html_text(3)  # that is the point

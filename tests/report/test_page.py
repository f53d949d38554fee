"""The page: values in, one HTML text out."""

from __future__ import annotations

import pytest
from tests.report.pages import Reader, check_alone

from asperity.report import html_text
from asperity.report.page import (
    Cards,
    Cell,
    Definitions,
    Items,
    Page,
    Picture,
    Row,
    Section,
    Table,
    Words,
    assumed,
    page_html,
)

HOSTILE = '<script>alert("1")</script>'
PIXEL = "data:image/gif;base64,R0lGODlhAQABAAAAACw="


def page(*sections: Section) -> Reader:
    return check_alone(page_html(Page("title", "answer", [("name", "value")], sections)))


def everything(words: str) -> list[Section]:
    """Return one of each block, with the words everywhere."""
    cell = Cell(words, "no", note=words, below=words, summary=words, details=[(words, words)])
    table = Table((words, "n"), [Row([words, cell], "best", id="row")], numbers=(1,))
    blocks = [
        Words(words), Words(words, "code"), Words(words, "mono"), Items([words]),
        Definitions([(words, words)]), Picture(PIXEL, words), table,
        Cards([Section(words, [table], level=3, id="card")]),
    ]  # fmt: skip
    return [Section(words, blocks, words, [words]), *assumed([words], table)]


def test_every_word_of_every_block_is_on_the_page() -> None:
    found = page(*everything("word"))
    # 3 paragraphs, an item, 2 of a definition; 3 tables of 7; title, caption and note around them,
    # the title of the card, the sentence assumed.
    assert found.text.count("word") == 6 + 3 * 7 + 5
    assert found.loaded == [PIXEL]
    assert found.tags.count("table") == 3
    assert found.tags.count("section") == 3


def test_nothing_is_taken_for_html() -> None:
    text = page_html(Page(HOSTILE, HOSTILE, [(HOSTILE, HOSTILE)], everything(HOSTILE), HOSTILE))
    assert HOSTILE not in text
    assert "script" not in Reader(text).tags
    assert 'alt="<' not in text


def test_a_picture_is_called_like_its_section_unless_told_otherwise() -> None:
    blocks = [Picture(PIXEL), Picture(PIXEL, "other")]
    text = page_html(Page("title", "answer", [], [Section("Where", blocks)]))
    assert '<img alt="Where"' in text
    assert '<img alt="other"' in text


def test_nothing_assumed_is_no_section() -> None:
    assert assumed([]) == []


def test_no_report_for_anything_else() -> None:
    with pytest.raises(TypeError, match="no report is known for a int"):
        html_text(3)  # that is the point

"""Code examples of the documentation pages."""

from __future__ import annotations

import re
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def page_example(page: str, heading: str, language: str = "python") -> str:
    """Return the first code block below a heading of a page.

    Args:
        page: path of the page in ``docs``.
        heading: text of the heading, without its marks.
        language: language of the block.
    """
    text = (DOCS / page).read_text("utf-8")
    section = re.search(
        rf"^#+ {re.escape(heading)}\n(.*?)(?=^## |\Z)", text, re.DOTALL | re.MULTILINE
    )
    assert section is not None, f"{page} has no heading {heading!r}"
    block = re.search(rf"```{re.escape(language)}\n(.*?)```", section[1], re.DOTALL)
    assert block is not None, f"{page}, {heading!r}, has no block of {language}"
    return block[1]

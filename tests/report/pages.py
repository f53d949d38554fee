"""What the tests of reports share: a page taken apart, and a result as a terminal shows it."""

from __future__ import annotations

import io
from collections.abc import Callable
from html.parser import HTMLParser
from typing import Any

from rich.console import Console


class Reader(HTMLParser):
    """Collects the tags of a page, what it loads, its text, and the cells of its tables."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.loaded: list[str] = []
        self.cells: list[str] = []
        self.texts: list[str] = []
        self._open: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self._open.append(tag)
        self.loaded += [str(value) for name, value in attrs if name in {"src", "href"}]

    def handle_data(self, data: str) -> None:
        if data.strip():
            self.texts.append(data.strip())
        if self._open and self._open[-1] == "td" and data.strip():
            self.cells.append(data.strip())

    @property
    def text(self) -> str:
        return " ".join(self.texts)


def check_alone(page: str) -> Reader:
    """Assert that a page is one file that loads nothing and suits light, dark and print."""
    reader = Reader(page)
    assert all(source.startswith("data:image/") for source in reader.loaded)
    assert "script" not in reader.tags
    assert not {"url(", "@import"} & {word for word in ("url(", "@import") if word in page}
    assert "prefers-color-scheme: dark" in page
    assert "@media print" in page
    assert len(page) < 3_000_000
    return reader


def terminal(show: Callable[..., None], *arguments: Any, width: int, **how: Any) -> str:
    """Return what a function prints on a console of a width."""
    console = Console(width=width, file=io.StringIO(), force_terminal=False)
    show(*arguments, console, **how)
    return console.file.getvalue()

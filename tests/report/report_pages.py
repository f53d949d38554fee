"""Helpers for the tests of reports: an HTML page parser and terminal output."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
from html.parser import HTMLParser
from typing import Any

from rich.console import Console

from asperity.report.document.page import Page
from asperity.report.document.terminal import print_page


class Reader(HTMLParser):
    """Collects the tags of a page, its external resources, its text and its table cells.

    ``alts`` holds the alternative texts of the pictures, ``numbers`` their embedded data, and
    ``scripts`` the executable scripts.
    """

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.loaded: list[str] = []
        self.cells: list[str] = []
        self.texts: list[str] = []
        self.alts: list[str] = []
        self.numbers: list[Any] = []
        self.scripts: list[str] = []
        self.policy = ""
        self._open: list[str] = []
        self._script: str | None = None
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self._open.append(tag)
        attributes = {name: str(value) for name, value in attrs}
        links = [attributes[name] for name in ("src", "href", "xlink:href") if name in attributes]
        self.loaded += [link for link in links if not link.startswith("#")]
        assert not [name for name in attributes if name.startswith("on")]
        if tag == "script":
            self._script = attributes.get("type", "")
        if tag == "svg":
            assert attributes["role"] == "img"
            self.alts.append(attributes["aria-label"])
        if attributes.get("http-equiv") == "Content-Security-Policy":
            self.policy = attributes["content"]

    def handle_data(self, data: str) -> None:
        if self._script is not None:
            if self._script == "application/json":
                self.numbers.append(json.loads(data))
            else:
                self.scripts.append(data)
            self._script = None
            return
        if data.strip():
            self.texts.append(data.strip())
        if self._open and self._open[-1] == "td" and data.strip():
            self.cells.append(data.strip())

    @property
    def text(self) -> str:
        return " ".join(self.texts)


def check_alone(page: str) -> Reader:
    """Assert that a page is self-contained and has styles for light, dark and print."""
    reader = Reader(page)
    assert all(source.startswith("data:image/png;base64,") for source in reader.loaded)
    assert page.count("url(") == page.count('"url(#')
    assert "@import" not in page
    assert "http" not in re.sub(r"http-equiv|data:image[^\"]*", "", page)
    check_script(reader)
    ids = re.findall(r' id="(p[0-9a-f]{6}-[^"]+)"', page)
    assert len(set(ids)) == len(ids)
    assert "prefers-color-scheme: dark" in page
    assert "@media print" in page
    assert len(page) < 3_000_000
    return reader


def check_script(reader: Reader) -> None:
    """Assert that only the page's own script may run and that all pictures have embedded data."""
    assert len(reader.scripts) == 1
    digest = base64.b64encode(hashlib.sha256(reader.scripts[0].encode()).digest()).decode()
    assert "default-src 'none'" in reader.policy
    assert f"script-src 'sha256-{digest}'" in reader.policy
    assert "svg" not in reader.tags or len(reader.numbers) == len(reader.alts)


def check_alts(reader: Reader, page: str) -> None:
    """Assert that alternative texts contain numbers and differ from the titles of the page.

    The axes of the embedded data have units, except dimensionless ones.
    """
    titles = set(re.findall(r"<h[1-3]>([^<]*)</h[1-3]>", page))
    assert reader.alts
    for alt in reader.alts:
        assert alt.strip()
        assert alt.strip(" .") not in titles
        assert re.search(r"\d", alt), alt
        assert "nan" not in alt.split()
    for panel in [panel for panels in reader.numbers for panel in panels]:
        for name in (panel["x"]["name"], panel["y"]["name"]):
            assert name.endswith("]") or name in {"strength T", "support S"}, name


def terminal(page: Page, width: int) -> str:
    """Return a page as printed on a console of the given width."""
    file = io.StringIO()
    print_page(page, Console(width=width, file=file, force_terminal=False, highlight=False))
    return file.getvalue()

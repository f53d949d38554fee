"""Code that runs when the pages are built: what a page prints is what the package does.

``{run}`` executes Python and shows it with its output; ``{shell}`` does the same for the command
``asperity``. The blocks of a page share their variables and a temporary folder.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from commands import execute, first_paragraphs, run_command
from docutils import nodes
from docutils.parsers.rst import Directive, directives
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

_DPI = 130


@dataclass
class Page:
    """What the blocks of a page share."""

    # Removed when the page is read: pages are read in several processes.
    directory: tempfile.TemporaryDirectory[str] = field(
        default_factory=lambda: tempfile.TemporaryDirectory(prefix="asperity-docs-")
    )
    names: dict[str, Any] = field(default_factory=lambda: {"__name__": "__main__"})
    pictures: int = 0

    @property
    def folder(self) -> str:
        """The folder in which the blocks run."""
        return self.directory.name


_PAGES: dict[str, Page] = {}


class _Block(SphinxDirective):
    has_content = True

    def page(self) -> Page:
        return _PAGES.setdefault(self.env.docname, Page())

    def report_failure(self, error: Exception) -> list[nodes.Node]:
        text = f"{type(error).__name__}: {error}"
        return [self.state_machine.reporter.error(f"block failed: {text}", line=self.lineno)]

    def literal(self, text: str, language: str, css_class: str = "") -> nodes.Node:
        block = nodes.literal_block(text, text, language=language)
        if css_class:
            return nodes.container("", block, classes=[css_class])
        return block


class Run(_Block):
    """Python that runs; ``:hide-code:``, ``:error:``, ``:table:``, ``:figure: what it shows``."""

    option_spec: ClassVar[dict[str, Any]] = {
        "hide-code": directives.flag,
        "error": directives.flag,
        "table": directives.flag,
        "figure": directives.unchanged,
    }

    def run(self) -> list[nodes.Node]:
        """Execute the block and return code, output and picture."""
        page, source = self.page(), "\n".join(self.content)
        try:
            with contextlib.chdir(page.folder):
                printed, value = execute(source, page.names, "error" in self.options)
        except Exception as error:  # the page says which block failed, the build goes on
            return self.report_failure(error)
        result: list[nodes.Node] = []
        if "hide-code" not in self.options:
            result.append(self.literal(source, "python"))
        if printed.strip():
            result.append(self.literal(printed.rstrip(), "text", "output"))
        if "table" in self.options:
            result.append(make_table(value))
        if "figure" in self.options:
            result.append(self.picture(page, value))
        return result

    def picture(self, page: Page, figure: Any) -> nodes.Node:
        """Save a figure and return the node that shows it."""
        page.pictures += 1
        folder = Path(self.env.srcdir) / "_generated"
        folder.mkdir(exist_ok=True)
        name = f"{self.env.docname.replace('/', '-')}-{page.pictures}.png"
        figure.savefig(folder / name, dpi=_DPI)
        image = nodes.image(uri=f"/_generated/{name}", alt=self.options["figure"])
        _relative, path = self.env.relfn2path(image["uri"])
        image["uri"] = os.path.relpath(path, Path(self.env.doc2path(self.env.docname)).parent)
        return image


class Shell(_Block):
    """Commands ``$ asperity ...`` that run.

    ``:exit: 2`` where one must be refused, ``:quiet:``, ``:first: 2`` for so many paragraphs only.
    """

    option_spec: ClassVar[dict[str, Any]] = {
        "exit": directives.nonnegative_int,
        "first": directives.positive_int,
        "quiet": directives.flag,
    }

    def run(self) -> list[nodes.Node]:
        """Execute the commands and return them with their output."""
        page, result = self.page(), []
        for line in self.content:
            try:
                code, text = run_command(line.removeprefix("$").strip(), page.folder)
            except Exception as error:  # a traceback of the command is a fault of the page
                return self.report_failure(error)
            if code != self.options.get("exit", 0):
                return self.report_failure(RuntimeError(f"{line}: exit code {code}: {text[-300:]}"))
            result.append(self.literal(line, "console"))
            if text.strip() and "quiet" not in self.options:
                visible = first_paragraphs(text.strip(), self.options.get("first"))
                result.append(self.literal(visible, "text", "output"))
        return result


def make_table(rows: Sequence[Sequence[str]]) -> nodes.table:
    """Return a table whose first row is the head."""
    group = nodes.tgroup(cols=len(rows[0]))
    group += [nodes.colspec(colwidth=1) for _ in rows[0]]
    head, body = nodes.thead(), nodes.tbody()
    for index, row in enumerate(rows):
        line = nodes.row()
        for cell in row:
            line += nodes.entry("", nodes.paragraph(text=str(cell)))
        if index:
            body += line
        else:
            head += line
    group += [head, body]
    return nodes.table("", group, classes=["numbers"])


def _close_page(app: Sphinx, _doctree: nodes.document) -> None:
    if (page := _PAGES.pop(app.env.docname, None)) is not None:
        page.directory.cleanup()


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives."""
    run: type[Directive] = Run
    app.add_directive("run", run)
    app.add_directive("shell", Shell)
    app.connect("doctree-read", _close_page)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}

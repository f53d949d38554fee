"""Where results go: standard output, or a file that is whole or not there."""

from __future__ import annotations

import functools
import os
import shlex
import sys
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cache import no_cache
from asperity.cli.progress import progress_bar
from asperity.errors import ParameterError, printable
from asperity.files import digest, is_device, json_text, write_text

if TYPE_CHECKING:
    from rich.console import Console

    from asperity.report.page import Page

STANDARD_OUTPUT = "-"


@dataclass(frozen=True)
class Outputs:
    """Where a command writes its result.

    Attributes:
        json: path of the result as JSON, "-" for standard output, ``None`` for nowhere.
        html: path of the report, likewise.
        trace: path of the samples of a run, of the commands that have some.
    """

    json: str | None = None
    html: str | None = None
    trace: str | None = None

    def write(
        self,
        data: Any,
        say: Callable[[Console], None],
        page: Callable[[], Page] | None = None,
        page_words: str = "Report",
        *,
        keeps_pictures: bool = False,
    ) -> None:
        """Write a result where it was asked for, else say it on standard output.

        Args:
            data: the result for JSON, see :func:`asperity.files.plain`.
            say: prints the result for reading.
            page: returns the report, of a command that has one.
            page_words: what the report is called.
            keeps_pictures: whether the page cares for the look of its pictures, which may be kept.
        """
        if self.json is not None:
            write_output("json", self.json, json_text(data))
        if self.html is not None and page is not None:
            from asperity.report.page import Origin, own_look, page_html

            origin = Origin(_command(), digest(json_text(data)))
            # The page looks as it should, whatever the user's settings.
            look = nullcontext() if keeps_pictures else own_look()
            with progress_bar("drawing the report"), look:
                text = page_html(page(), origin)
            write_output("html", self.html, text)
        if STANDARD_OUTPUT in {self.json, self.html}:
            return
        from rich.console import Console

        console = Console(highlight=False)
        say(console)
        for words, path in ((page_words, self.html), ("Trace", self.trace)):
            if path is not None:
                console.print(f"{words}: {printable(path)}", soft_wrap=True, markup=False)


def _command() -> str:
    """Return the command as a shell takes it."""
    return printable(shlex.join(["asperity", *sys.argv[1:]]))


def output_options(
    html: str | None, json: str = "Write the result as JSON; - is standard output."
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that adds ``--json`` and ``--html``.

    The command receives :class:`Outputs` as ``outputs``, checked before any work is done; a
    ``--trace`` of its own goes there too.

    Args:
        html: help of ``--html``; ``None`` for a command without a report.
        json: help of ``--json``.
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(command)
        def run(**values: Any) -> None:
            paths = {name: values.pop(f"{name}_path", None) for name in ("json", "html", "trace")}
            check_outputs(**paths)
            command(outputs=Outputs(**paths), **values)

        if html is not None:
            run = click.option("--html", "html_path", metavar="PATH", help=html)(run)
        run = click.option(
            "--no-cache", is_flag=True, expose_value=False, callback=_without_cache,
            help="Work everything out anew, and keep nothing.",
        )(run)  # fmt: skip
        return click.option("--json", "json_path", metavar="PATH", help=json)(run)

    return decorate


def _without_cache(context: click.Context, _option: click.Parameter, asked: bool) -> None:
    """Let a command work without the cache until it ends."""
    if asked:
        context.with_resource(no_cache())


def check_outputs(**paths: str | None) -> None:
    """Refuse paths of which one cannot be written, or two are the same, before any work is done.

    Args:
        paths: by the names of their options; ``None`` for one that is not given.

    Raises:
        ParameterError: see :func:`check_output`.
    """
    taken: dict[str, str] = {}
    for name, path in paths.items():
        if path is None:
            continue
        target = path if path == STANDARD_OUTPUT else os.path.realpath(path)
        if target in taken:
            place = "go to standard output" if path == STANDARD_OUTPUT else f"be written to {path}"
            raise ParameterError(taken[target], f"and {name} cannot both {place}")
        taken[target] = name
        check_output(name, path)


def check_output(name: str, path: str | None) -> None:
    """Refuse a path that cannot be written, before any work is done.

    Raises:
        ParameterError: if the folder does not exist or is not writable, the path is a folder or a
            link to itself, or a device or a pipe that cannot be written to.
    """
    if path is None or path == STANDARD_OUTPUT:
        return
    if Path(path).is_dir():
        raise ParameterError(name, "must be a file, not a folder", path)
    if is_device(path):
        if not os.access(path, os.W_OK):
            raise ParameterError(name, "must be a file that can be written", path)
        return
    target = Path(os.path.realpath(path))
    if target.is_symlink():
        raise ParameterError(name, "must be a file, not a link to itself", path)
    folder = target.parent
    if not folder.is_dir():
        raise ParameterError(name, f"must lie in a folder that exists, {folder} does not")
    if not os.access(folder, os.W_OK):
        raise ParameterError(name, f"must lie in a folder that can be written, not {folder}")


def write_output(name: str, path: str, text: str) -> None:
    """Write a text to standard output or to a file; see :func:`asperity.files.whole_file`.

    Raises:
        ParameterError: if the file cannot be written.
    """
    if path == STANDARD_OUTPUT:
        click.echo(text, nl=not text.endswith("\n"))
        return
    try:
        write_text(path, text)
    except OSError as error:
        raise ParameterError(name, f"cannot be written: {error.strerror}", path) from None

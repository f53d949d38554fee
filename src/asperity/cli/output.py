"""Output of results to the terminal and to files, and the progress bar on standard error."""

from __future__ import annotations

import functools
import os
import shlex
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from typing import TYPE_CHECKING, Any

import click

from asperity.core.cache import bypass
from asperity.core.errors import ParameterError, escape_unprintable
from asperity.core.files import STANDARD_OUTPUT, check_output, json_text, text_digest, write_bytes

if TYPE_CHECKING:
    from rich.console import Console

    from asperity.report.document.page import Page


class _Steps:
    """A bar, and the step that it shows.

    Attributes:
        name: of the step.
        text: the name, with the part of the step.
        start: when it began [s].
        is_baking: whether the bar is that of a field, with a time of its own.
        fraction: completed before the step.
        size: of a step, as a fraction.
        bar: the bar, with one task.
        task: its id.
    """

    def __init__(self, name: str, size: float) -> None:
        from rich import progress

        self.name = name
        self.text = name
        self.start = time.monotonic()
        self.is_baking = False
        self.fraction = 0.0
        self.size = size
        columns = (
            progress.TextColumn("{task.description:<24}"),
            progress.TextColumn("{task.fields[steps].seconds:.0f} s", "dim"),
            progress.BarColumn(),
            progress.TaskProgressColumn(),
            progress.TimeElapsedColumn(),
            progress.TextColumn("left:"),
            progress.TimeRemainingColumn(),
        )
        # Rich forgets steps after the period [s], and needs two for the time left; some take
        # minutes.
        self.bar = progress.Progress(*columns, speed_estimate_period=1e5)
        self.task = self.bar.add_task(name, total=None, steps=self)  # pulses until some is done

    @property
    def seconds(self) -> float:
        """Time since the step began [s]; it changes while nothing else does."""
        return time.monotonic() - self.start

    def update(self, fraction: float, name: str | None = None) -> None:
        """Show the completed fraction, and the name of the next step."""
        if name not in (None, self.name):
            self.start = time.monotonic()
        self.name = name or self.name
        self.fraction = fraction
        self._show(self.name, fraction)

    def _show(self, text: str, fraction: float, *, is_baking: bool = False) -> None:
        if self.is_baking != is_baking:
            self.bar.reset(self.task)
        self.is_baking = is_baking
        self.text = text
        total = 1.0 if fraction > 0.0 or is_baking else None
        self.bar.update(self.task, total=total, completed=fraction, description=text)

    def report_compilation(self, loop: str) -> None:
        """Show that a function is compiled, or that it has been."""
        text = f"{self.name}: compiling, on a first run only" if loop else self.text
        self.bar.update(self.task, description=text, refresh=True)

    def report_part(self, value: float) -> None:
        """Show a part of the step: see :data:`asperity.core.processes.PROGRESS_CALLBACKS`."""
        from asperity.core.processes import Part

        part = Part(int(value))
        is_baking = part is Part.BAKING
        share = value if is_baking else self.fraction + self.size * value / len(Part)
        self._show(f"{self.name}: {part.name.lower()}", share, is_baking=is_baking)


@contextmanager
def progress_bar(
    description: str, above: Sequence[Any] = (), size: float = 0.0
) -> Iterator[Callable[..., None]]:
    """Show a progress bar with the time left, if standard error is a terminal.

    Args:
        description: description of the task.
        above: what is shown above the bar; the caller may change it meanwhile.
        size: of a step, as a fraction; its parts advance the bar.

    Yields:
        A function of the completed fraction in [0, 1] and, optionally, a new description.
    """
    if not sys.stderr.isatty():
        yield lambda _fraction, _description=None: None
        return
    from rich.console import Console, Group
    from rich.live import Live

    from asperity.core.compiled import COMPILE_CALLBACKS
    from asperity.core.processes import PROGRESS_CALLBACKS

    steps = _Steps(description, size)
    err = Console(stderr=True)
    COMPILE_CALLBACKS.append(steps.report_compilation)
    PROGRESS_CALLBACKS.append(steps.report_part)
    try:
        with Live(
            get_renderable=lambda: Group(*above, steps.bar),
            console=err,
            transient=True,
            refresh_per_second=10,
        ) as steps.bar.live:
            steps.bar.refresh()
            yield steps.update
    finally:
        COMPILE_CALLBACKS.remove(steps.report_compilation)
        PROGRESS_CALLBACKS.remove(steps.report_part)


@contextmanager
def step_bar(
    description: str, steps: int, above: Sequence[Any] = ()
) -> Iterator[Callable[[str], None]]:
    """Show the progress over a number of steps; yield a function to call before each step."""
    with progress_bar(description, above, 1.0 / max(steps, 1)) as update:
        done = count()

        def begin(name: str) -> None:
            index = next(done)
            update(index / steps, f"{name} ({min(index + 1, steps)} of {steps})")

        yield begin


@dataclass(frozen=True)
class Outputs:
    """Output paths of a command.

    Attributes:
        json: path of the result as JSON, "-" for standard output, ``None`` for none.
        html: path of the report, likewise.
        latex: path of the tables and a paragraph as LaTeX, likewise.
        trace: path of the samples of a run, for commands with a trace.
        force: whether existing files are replaced.
    """

    json: str | None = None
    html: str | None = None
    latex: str | None = None
    trace: str | None = None
    force: bool = False

    def write(self, data: Any, page: Page, extra_line: str = "") -> None:
        """Print a result unless it is written to standard output, and write the output files.

        Args:
            data: the result for JSON, see :func:`asperity.core.files.to_plain_data`.
            page: the result for HTML and for the terminal.
            extra_line: printed after the result, if any.
        """
        console = _make_console()
        prints = STANDARD_OUTPUT not in {self.json, self.html, self.latex}
        if prints:  # first, as the files may not fit on the disk
            from asperity.report.document.terminal import print_page

            print_page(page, console)
            if extra_line:
                console.print(extra_line, soft_wrap=True, markup=False)
        self._write_files(data, page)
        for label, path in (("Report", self.html), ("Trace", self.trace)):
            if prints and path is not None:
                console.print(f"{label}: {escape_unprintable(path)}", soft_wrap=True, markup=False)

    def _write_files(self, data: Any, page: Page) -> None:
        if self.json is not None:
            write_output("json", self.json, json_text(data))
        if self.html is not None:
            from asperity.report.document.html import render_page

            command_line = escape_unprintable(shlex.join(["asperity", *sys.argv[1:]]))
            with progress_bar("drawing the report"):
                text = render_page(page, text_digest(json_text(data)), command_line)
            write_output("html", self.html, text)
        if self.latex is not None:
            from asperity.report.document.latex import render_latex

            write_output("latex", self.latex, render_latex(page))


_OUTPUT_PATHS = ("json", "html", "latex", "trace")


def output_options(
    *, html: bool = True, uses_cache: bool = True, keeps: bool = True
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that adds ``--json``, ``--html``, ``--force`` and ``--no-cache``.

    The command receives :class:`Outputs` as ``outputs``, whose paths, including that of a
    ``--trace`` option, are checked before the command runs.

    Args:
        html: whether the command writes a report.
        uses_cache: whether the command computes anything that is cached.
        keeps: whether existing files are kept without ``--force``.
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(command)
        def run(**values: Any) -> None:
            paths = {name: values.pop(f"{name}_path", None) for name in _OUTPUT_PATHS}
            force = values.pop("force") if keeps else True
            check_outputs(force=force, **paths)
            command(outputs=Outputs(**paths, force=force), **values)

        if html:
            text = "Write a report with figures (HTML); - writes to standard output."
            run = click.option("--html", "html_path", metavar="PATH", help=text)(run)
        if uses_cache:
            run = click.option(
                "--no-cache",
                is_flag=True,
                expose_value=False,
                callback=_apply_bypass,
                help="Compute everything without the cache, and store nothing.",
            )(run)
        run = force_option(run) if keeps else run
        text = "Write the result as JSON; - writes to standard output."
        return click.option("--json", "json_path", metavar="PATH", help=text)(run)

    return decorate


force_option = click.option("--force", is_flag=True, help="Replace existing files.")
"""Adds ``--force``."""


def _apply_bypass(context: click.Context, _option: click.Parameter, enabled: bool) -> None:
    """Bypass the cache until the command ends."""
    if enabled:
        context.with_resource(bypass())


def check_outputs(*, force: bool, **paths: str | None) -> None:
    """Check before a computation that all paths can be written and differ from each other.

    Args:
        force: whether existing files are replaced.
        paths: paths by the names of their options; ``None`` for an absent option.

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
        check_output(name, path, force=force)
        if name in _OUTPUT_PATHS:
            _check_no_input(name, path)


def _check_no_input(name: str, path: str) -> None:
    """Refuse to write over a file that the command line names twice: the command reads it."""
    words = [word.partition("=")[2] if word.startswith("--") else word for word in sys.argv[1:]]
    if os.path.exists(path):
        same = [word for word in words if os.path.exists(word) and os.path.samefile(word, path)]
        if len(same) > 1:
            raise ParameterError(name, "must be another file than the command reads", path)


def _make_console() -> Console:
    """Return a console of standard output; a reader that ends is an error, as for other output."""
    from rich.console import Console

    class PipedConsole(Console):
        def on_broken_pipe(self) -> None:
            raise BrokenPipeError

    return PipedConsole(highlight=False)


def is_confirmed(question: str) -> bool:
    """Whether the user confirms on a terminal; without one, nobody does."""
    return sys.stdin.isatty() and click.confirm(question, err=True)


def write_template(name: str, path: str, text: str, command: str, *, force: bool) -> None:
    """Write a TOML file with all settings, and print what to do with it.

    Args:
        name: name of the argument, for messages.
        path: of the file.
        text: its content.
        command: the command to run next, with ``{}`` for the file.
        force: whether an existing file is replaced.

    Raises:
        ParameterError: for a path that is no TOML file, or see :func:`check_output`.
    """
    if not path.lower().endswith(".toml"):
        raise ParameterError(name, "must be a file that ends in .toml", path)
    check_output(name, path, force=force)
    write_output(name, path, text)
    file = escape_unprintable(path)
    click.echo(f"Written: {file}; now: {command.format(file)}")


def write_output(name: str, path: str, text: str) -> None:
    """Write a text to standard output or to a file."""
    if path == STANDARD_OUTPUT:
        click.echo(text, nl=not text.endswith("\n"))
    else:
        write_bytes(name, path, text.encode(errors="replace"))  # names of files may be no text

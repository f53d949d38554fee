"""The one progress bar: on standard error, if that is a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count


@contextmanager
def progress_bar(words: str) -> Iterator[Callable[..., None]]:
    """Show what is being done, how much of it, and the time that is left.

    Args:
        words: what is being done.

    Yields:
        What is told the share that is done, in [0, 1], and, if it changes, what is being done.
    """
    if not sys.stderr.isatty():
        yield lambda _share, _words=None: None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description:<24}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TextColumn("left:"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(words, total=1.0)
        yield lambda share, said=None: bar.update(task, completed=share, description=said)


@contextmanager
def step_bar(words: str, steps: int) -> Iterator[Callable[[str], None]]:
    """Show so many steps; yield what is called with the name of each before it begins."""
    with progress_bar(words) as told:
        done = count()
        yield lambda name: told(next(done) / steps, name)

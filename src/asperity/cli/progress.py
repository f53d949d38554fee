"""The one progress bar: on standard error, if that is a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from itertools import count


@contextmanager
def progress_bar(words: str) -> Iterator[Callable[..., None]]:
    """Show what is being done, how much of it, and the time that is left.

    What is compiled meanwhile is counted beside it: a first run takes longer, and says why.

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
        ProgressColumn,
        Task,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
    )
    from rich.text import Text

    from asperity.compiled import LISTENERS

    class Left(ProgressColumn):
        """The time that is left; rich's own says none before the third step."""

        def render(self, task: Task) -> Text:
            """Return it for a bar."""
            return Text(f"left: {time_left(task.elapsed or 0.0, task.completed)}")

    columns = (
        TextColumn("{task.description:<24}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        Left(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task, loops = bar.add_task(words, total=1.0), count(1)
        doing = [words]

        def compiling(_loop: str) -> None:
            said = f"{doing[0]}: compiling loop {next(loops)}, kept for next time"
            bar.update(task, description=said, refresh=True)

        def told(share: float, said: str | None = None) -> None:
            doing[0] = said or doing[0]
            bar.update(task, completed=share, description=doing[0])

        LISTENERS.append(compiling)
        try:
            yield told
        finally:
            LISTENERS.remove(compiling)


def time_left(elapsed: float, share: float) -> str:
    """Return the time that is left if the rest takes as long as what is done.

    Args:
        elapsed: since the beginning [s].
        share: that is done, in [0, 1].

    Example:
        >>> time_left(30.0, 0.25), time_left(30.0, 0.0)
        ('0:01:30', '-:--:--')
    """
    if share <= 0.0:
        return "-:--:--"
    return str(timedelta(seconds=round(elapsed * (1.0 - share) / share)))


@contextmanager
def step_bar(words: str, steps: int) -> Iterator[Callable[[str], None]]:
    """Show so many steps; yield what is called with the name of each before it begins."""
    with progress_bar(words) as told:
        done = count()
        yield lambda name: told(next(done) / steps, name)

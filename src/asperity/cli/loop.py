"""What the commands that run a closed loop share: options, progress, output."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

import click

from asperity.cli.options import FILE_OPTIONS, LAW_OPTIONS, given, text_options
from asperity.errors import ParameterError

if TYPE_CHECKING:
    from rich.console import Console

    from asperity.scene.setup import Setup

Command = TypeVar("Command", bound=Callable[..., Any])


def loop_options(command: Command) -> Command:
    """Add the options of surface, law and device."""
    command = text_options(FILE_OPTIONS)(command)
    command = text_options(LAW_OPTIONS)(command)
    command = click.option(
        "--device", metavar="ID|FILE", help="Comes before the scene's.  [default: omega.3]"
    )(command)
    return click.option("--law", metavar="LETTER", help="Comes before the scene's.")(command)


def read_setup(
    source: str, values: dict[str, Any], duration: str | None = None, every: str | None = None
) -> Setup:
    """Return the closed loop that a scene file and the options name.

    Raises:
        ParameterError: for what is missing, unknown or wrong.
    """
    from dataclasses import replace

    from asperity.devices import load_device
    from asperity.laws import find_law
    from asperity.scene import FILE_ARGUMENTS, SURFACE_ARGUMENTS, load_scene
    from asperity.scene.readers import whole
    from asperity.scene.setup import make_setup
    from asperity.units import quantity

    if not source.lower().endswith(".toml"):
        words = "must be a scene file (.toml) with [texture], [hand] and [motion]"
        raise ParameterError("scene", words, source)
    device = None if values["device"] is None else load_device(values["device"])
    surface: dict[str, Any] = {} if values["law"] is None else {"law": find_law(values["law"])}
    for name, text in given(values, LAW_OPTIONS).items():
        surface[name] = SURFACE_ARGUMENTS[name](name, text)
    for_file = {
        name: FILE_ARGUMENTS[name](name, text) for name, text in given(values, FILE_OPTIONS).items()
    }
    span = None if duration is None else quantity("duration", duration, "s")
    scene = load_scene(source, for_file)
    setup = make_setup(scene, surface=surface, device=device, duration=span)
    return setup if every is None else replace(setup, every=whole("every", every))


def read_laws(text: str) -> list[str]:
    """Return the letters of laws, each once.

    Raises:
        ParameterError: for an unknown law, or one that is given twice.
    """
    from asperity.laws import find_laws

    return [law.letter for law in find_laws(text)]


def read_list(name: str, text: str, unit: str = "", *, whole: bool = False) -> list[float]:
    """Return the quantities of "a; b; c".

    Raises:
        ParameterError: for none, or one that is not a quantity (or number) of that unit.
    """
    from asperity.scene import readers

    read = readers.whole if whole else readers.in_unit(unit)
    values = [read(name, part) for part in text.replace(",", ";").split(";") if part.strip()]
    if not values:
        raise ParameterError(name, "must be one or several, 'a; b'", text)
    return values


def read_one(name: str, text: str, unit: str = "", *, whole: bool = False) -> float:
    """Return a single quantity.

    Raises:
        ParameterError: for several, or one that is not a quantity (or number) of that unit.
    """
    values = read_list(name, text, unit, whole=whole)
    if len(values) > 1:
        raise ParameterError(name, "must be a single one", text)
    return values[0]


@contextmanager
def progress_bar(words: str) -> Iterator[Callable[[float], None]]:
    """Show how much is done, in [0, 1], on standard error if it is a terminal."""
    if not sys.stderr.isatty():
        yield lambda _share: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(words, total=1.0)
        yield lambda share: bar.update(task, completed=share)


def print_report(
    say: Callable[[Console], None], html_path: str | None, trace_path: str | None = None
) -> None:
    """Print a result and where its files are."""
    from rich.console import Console

    console = Console(highlight=False)
    say(console)
    for name, path in (("Report", html_path), ("Trace", trace_path)):
        if path is not None:
            console.print(f"{name}: {path}", soft_wrap=True, markup=False)

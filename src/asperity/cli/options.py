"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])

# Of the surface, read from a measured file.
FILE_OPTIONS = (
    ("--pitch", "Distance of the points, '5um' or '5um; 8um' for x and y."),
    ("--height-range", "Peak-to-valley height that the heights are scaled to, '0.2mm'."),
    ("--magnify", "Factor of the size, and of the height unless told otherwise."),
    ("--magnify-height", "Factor of the height."),
    ("--cutoff", "Cut-off wavelength of the Gaussian filter, before magnification, '10um'."),
)

# Of the law.
LAW_OPTIONS = (
    ("--stiffness", "Stiffness that you want, '500N/m'.  [default: 1000 N/m]"),
    ("--max-depth", "Depth to press to, '0.5mm'.  [default: peak-to-valley height, at most 1 mm]"),
    ("--friction", "Friction coefficient of law F.  [default: 0.8]"),
    ("--max-deflection", "Greatest deflection of law F's anchor.  [default: 1 mm]"),
    ("--modulation-depth", "Modulation depth of law F, 0 to 1.  [default: 0.8]"),
)


def text_options(options: tuple[tuple[str, str], ...]) -> Callable[[Command], Command]:
    """Return a decorator that adds options whose values are read as quantities later."""

    def decorate(command: Command) -> Command:
        for name, words in reversed(options):
            command = click.option(name, metavar="TEXT", help=words)(command)
        return command

    return decorate


def given(values: dict[str, Any], options: tuple[tuple[str, str], ...]) -> dict[str, str]:
    """Return the values of the options that the user gave, by argument name."""
    names = [name.removeprefix("--").replace("-", "_") for name, _words in options]
    return {name: values[name] for name in names if values[name] is not None}

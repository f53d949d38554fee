"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])

# Of the surface, read from a measured file.
FILE_OPTIONS = (
    ("--channel", "Which data channel of a file that has several, by name or number."),
    ("--unit", "Unit of the heights where the file names none, 'um'."),
    ("--integrate-normals", "Make heights of a normal map."),
    ("--pitch", "Distance of the points, '5um' or '5um; 8um' for x and y."),
    ("--height-range", "Peak-to-valley height that the heights are scaled to, '0.2mm'."),
    ("--outliers", "Replace spikes beyond so many robust standard deviations, '6'."),
    ("--max-missing", "Share of the points that may be missing.  [default: 0.25]"),
    ("--form", "Degree of the polynomial that is subtracted.  [default: 1, levelling]"),
    (
        "--cutoff",
        "Cut-off wavelength of the Gaussian S-filter, before magnification, '10um'."
        "  [default: 4 samples]",
    ),
    ("--l-cutoff", "Cut-off wavelength of the L-filter, which removes longer waves, '0.8mm'."),
    ("--tip-radius", "Radius of the ball that feels the surface, before magnification, '5um'."),
    ("--periodic", "Blend opposite borders so that the surface repeats."),
    ("--blend", "Width of the blended band, '0.1mm'.  [default: a tenth of each side]"),
    ("--magnify", "Factor of the size, and of the height unless told otherwise."),
    ("--magnify-height", "Factor of the height."),
)

# Options that are given without a value.
SWITCHES = frozenset({"--integrate-normals", "--periodic"})

# Of the law.
LAW_OPTIONS = (
    ("--stiffness", "Stiffness that you want, '500N/m'.  [default: 1000 N/m]"),
    ("--max-depth", "Depth to press to, '0.5mm'.  [default: peak-to-valley height, at most 1 mm]"),
    ("--friction", "Friction coefficient of law F.  [default: 0.8]"),
    ("--max-deflection", "Greatest deflection of law F's anchor.  [default: 1 mm]"),
    ("--modulation-depth", "Modulation depth of law F, 0 to 1.  [default: 0.8]"),
    ("--continuity", "c of law H, whose q is max(1, c).  [default: 1]"),
)


def text_options(options: tuple[tuple[str, str], ...]) -> Callable[[Command], Command]:
    """Return a decorator that adds options whose values are read as quantities later."""

    def decorate(command: Command) -> Command:
        for name, words in reversed(options):
            if name in SWITCHES:
                command = click.option(name, is_flag=True, default=None, help=words)(command)
            else:
                command = click.option(name, metavar="TEXT", help=words)(command)
        return command

    return decorate


def given(values: dict[str, Any], options: tuple[tuple[str, str], ...]) -> dict[str, Any]:
    """Return the values of the options that the user gave, by argument name."""
    names = [name.removeprefix("--").replace("-", "_") for name, _words in options]
    return {name: values[name] for name in names if values[name] is not None}

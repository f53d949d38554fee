"""The languages that a surface can be exported to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from asperity.errors import ParameterError, nearest_names
from asperity.export.c99 import c99_files
from asperity.export.order import Order


@dataclass(frozen=True)
class Target:
    """A language to export to.

    Attributes:
        name: by which it is asked for, such as ``c99``.
        words: what it is.
        suffix: of the file that is named, such as ``.h``.
        files: returns the texts of the files by name, the named one first, from what is to be
            exported and the stem of their names.
    """

    name: str
    words: str
    suffix: str
    files: Callable[[Order, str], dict[str, str]]


TARGETS = {"c99": Target("c99", "a C header, or a C library", ".h", c99_files)}
"""The languages by name."""


def register(target: Target) -> Target:
    """Add a language of your own; the command line knows it, too.

    Raises:
        ParameterError: for a name that is taken.
    """
    if TARGETS.setdefault(target.name, target) is not target:
        raise ParameterError("lang", "is registered already", target.name)
    return target


def find_target(name: str) -> Target:
    """Return a language by its name.

    Raises:
        ParameterError: for an unknown one.
    """
    if name.lower() not in TARGETS:
        raise ParameterError("lang", f"is unknown: {name!r}; {nearest_names(name, TARGETS)}")
    return TARGETS[name.lower()]

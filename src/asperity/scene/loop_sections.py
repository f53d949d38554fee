"""Kinds of hand and motion of a scene's loop, which need the simulation; arguments of [run]."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core.arguments import Argument, parse_arguments, read_arguments
from asperity.core.errors import ParameterError, find_named
from asperity.core.files import open_input
from asperity.recording.recording import is_recording, open_recording
from asperity.simulation import BandHand, PrescribedHand, SpringHand, Stationary, Strokes
from asperity.simulation import Waypoints as PathMotion

PATH_COLUMNS = ("time [s]", "x [m]", "y [m]", "z [m]")


def read_path(file: str) -> PathMotion:
    """Return the motion along the positions in a file.

    Args:
        file: a recording, or comma-separated text whose first line names the columns, ``time [s]``,
            ``x [m]``, ``y [m]``, ``z [m]`` among others. The traces of ``asperity simulate`` are
            such files.

    Raises:
        ParameterError: the file cannot be read, or has a missing column, no rows or a wrong number.
    """
    if is_recording(file):
        traced = open_recording(file).to_columns()
        if not len(traced.time):
            raise ParameterError("motion.file", f"{file} has no rows")
        return PathMotion(traced.time, traced.position)
    try:
        with io.TextIOWrapper(open_input(file), "utf-8") as stream:
            names = [name.strip() for name in stream.readline().split(",")]
            columns = [_column(names, name, file) for name in PATH_COLUMNS]
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # about no rows: see below
                table = np.loadtxt(stream, delimiter=",", usecols=columns, ndmin=2)
    except OSError as error:
        reason = error.strerror or str(error)
        raise ParameterError("motion.file", f"{file} cannot be read: {reason}") from None
    except ValueError as error:
        raise ParameterError("motion.file", f"{file} is not a table of numbers: {error}") from None
    if not len(table):
        raise ParameterError("motion.file", f"{file} has no rows")
    return PathMotion(table[:, 0], table[:, 1:])


def _column(names: list[str], name: str, file: str) -> int:
    if name not in names:
        raise ParameterError("motion.file", f"{file} has no column '{name}' in its first line")
    return names.index(name)


@dataclass(frozen=True)
class SectionKind:
    """A kind of hand or motion.

    Attributes:
        description: one line.
        make: returns it from its arguments by name.
        arguments: arguments of the section.
    """

    description: str
    make: Callable[..., Any]
    arguments: tuple[Argument, ...] = ()


def _read(table: str, defaults: type | None = None) -> tuple[Argument, ...]:
    path = Path(__file__).with_name("sections.toml")
    return tuple(read_arguments(path, table, defaults).values())


HANDS: dict[str, SectionKind] = {
    "spring": SectionKind(
        "a spring and a damper from the handle to the moving anchor",
        SpringHand,
        _read("spring", SpringHand),
    ),
    "band": SectionKind(
        "an elastic band that pulls the handle into the wall", BandHand, _read("band", BandHand)
    ),
    "moved": SectionKind("the handle follows the motion, whatever the force", PrescribedHand),
}

MOTIONS: dict[str, SectionKind] = {
    "still": SectionKind("the anchor does not move", Stationary, _read("still", Stationary)),
    "strokes": SectionKind(
        "the anchor moves to and fro at constant speed", Strokes, _read("strokes", Strokes)
    ),
    "path": SectionKind("the anchor follows the positions in a file", read_path, _read("path")),
}

RUN_ARGUMENTS = _read("run")
_RUN = {argument.name: argument for argument in RUN_ARGUMENTS}
DURATION = _RUN["duration"]
BRAKES = _RUN["brakes"]


def build_section(
    section: str, content: Mapping[str, Any], kinds: Mapping[str, SectionKind], folder: Path
) -> Any:
    """Return the hand or the motion of a section.

    Args:
        section: name of the section, for messages.
        content: content of the section, its kind and the arguments of that kind.
        kinds: the kinds by name.
        folder: folder to which paths are relative.

    Raises:
        ParameterError: a kind or key is unknown or missing, or a value is wrong.
    """
    arguments = dict(content)
    kind = arguments.pop("kind", None)
    if not isinstance(kind, str):
        names = " | ".join(f'"{name}"' for name in kinds)
        raise ParameterError(section, f"needs kind = {names}", kind)
    part = find_named(f"{section}.kind", kind, kinds)
    values = parse_arguments(section, arguments, part.arguments, folder)
    for argument in part.arguments:
        if argument.required and argument.name not in values:
            name = f"{section}.{argument.name}"
            if argument.form == "path":
                raise ParameterError(name, f"is missing: a {kind} needs a file of positions")
            raise ParameterError(name, f"is missing: {kind} needs it")
    return part.make(**values)

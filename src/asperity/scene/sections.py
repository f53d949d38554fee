"""What can stand in the sections [texture], [surface], [hand], [motion] and [run] of a scene."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from asperity.arguments import MAX_DEPTH, STIFFNESS, Argument, read_arguments
from asperity.errors import ParameterError, nearest_names
from asperity.files import open_input, plain
from asperity.laws import LAW_ARGUMENTS, Law, known_arguments
from asperity.recording.recording import is_recording, open_recording
from asperity.scene.plant import BRAKES
from asperity.simulation import BandHand, MovedHand, SpringHand, Still, Strokes
from asperity.simulation import Path as PathMotion
from asperity.surface import CLAMP, LAW

PATH_COLUMNS = ("time [s]", "x [m]", "y [m]", "z [m]")


def read_path(file: str) -> PathMotion:
    """Return the motion that a file of positions describes.

    Args:
        file: a recording, or text with a line of names, ``time [s]``, ``x [m]``, ``y [m]``,
            ``z [m]``, and others that are not read; commas between. The traces of ``asperity
            simulate`` are such files.

    Raises:
        ParameterError: for a file that cannot be read, lacks a column, has no rows or a wrong
            number.
    """
    if is_recording(file):
        traced = open_recording(file).traced()
        if not len(traced.time):
            raise ParameterError("motion.file", f"{file} has no rows")
        return PathMotion(traced.time, traced.position)
    try:
        with io.TextIOWrapper(open_input(file), "utf-8") as stream:
            names = [name.strip() for name in stream.readline().split(",")]
            columns = [_column(names, name, file) for name in PATH_COLUMNS]
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of no rows: see below
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


SURFACE = (LAW, STIFFNESS, MAX_DEPTH, CLAMP)
"""What [surface] can say, beside the parameters of its law."""


def surface_arguments() -> tuple[Argument, ...]:
    """Return what [surface] can say: of the surface, and of any law that is known."""
    return (*SURFACE, *known_arguments().values())


def surface_keywords(values: Mapping[str, Any], *laws: Law) -> dict[str, Any]:
    """Return values of a surface as keywords of :class:`~asperity.surface.Surface`.

    Parameters that one of the laws declares, and those that no shipped law knows, become
    ``law_parameters``; a shipped law's parameter is no error beside another law.
    """
    declared = known_arguments(laws)
    names = {argument.name for argument in SURFACE} | (set(LAW_ARGUMENTS) - set(declared))
    keywords = {name: value for name, value in values.items() if name in names}
    rest = {name: value for name, value in values.items() if name not in names}
    return keywords | ({"law_parameters": rest} if rest else {})


@dataclass(frozen=True)
class Part:
    """A kind of hand or motion.

    Attributes:
        words: one line.
        make: makes it from its arguments by name.
        arguments: what the section can say.
    """

    words: str
    make: Callable[..., Any]
    arguments: tuple[Argument, ...] = ()


HANDS: dict[str, Part] = {
    "spring": Part(
        "a spring and a damper from the handle to the anchor that moves",
        SpringHand,
        (
            Argument("stiffness", "one for all axes, or three", "N/m", 0.0, form="axes"),
            Argument("damping", "one for all axes, or three", "N*s/m", 0.0, form="axes"),
            Argument("mass", "of the hand, which moves with the handle", "kg", 0.0),
            Argument("force", "constant, (0, 0, -1) presses with 1 N", "N", form="space"),
        ),
    ),
    "band": Part(
        "an elastic band that pulls the handle into the wall",
        BandHand,
        (
            Argument("stiffness", "of the band", "N/m", BandHand.stiffness, positive=True),
            Argument("tension", "at z = 0", "N", BandHand.tension),
            Argument("length", "at z = 0", "m", BandHand.length, positive=True),
            Argument("damping", "of the band and the hand", "N*s/m", BandHand.damping),
        ),
    ),
    "moved": Part("the handle itself follows the motion, whatever the force", MovedHand),
}

MOTIONS: dict[str, Part] = {
    "still": Part(
        "the anchor stays where it is",
        Still,
        (Argument("point", "where it stays", "m", form="space", required=True),),
    ),
    "strokes": Part(
        "the anchor goes to and fro at constant speed",
        Strokes,
        (
            Argument("start", "where the first stroke begins", "m", form="space", required=True),
            Argument("end", "where it ends", "m", form="space", required=True),
            Argument("speed", "of the anchor", "m/s", required=True, positive=True),
            Argument("count", "number of strokes", default=1, form="integer"),
        ),
    ),
    "path": Part(
        "the anchor follows positions that a file lists against time",
        read_path,
        (Argument("file", "of positions, relative to the scene", form="path", required=True),),
    ),
}

DURATION = Argument(
    "duration", "of the run", "s", default_words="the motion's, else 1 s", positive=True
)
RUN: tuple[Argument, ...] = (
    DURATION,
    Argument("start", "of the handle", "m", form="space", default_words="where the motion begins"),
    Argument("velocity", "of the handle at the start", "m/s", form="space", default_words="rest"),
    Argument("every", "samples from one row of the trace to the next", default=1, form="integer"),
    Argument("velocity_share", "of the last difference in the estimated velocity", high=1.0),
    Argument("centre", "of a five-bar's plane, where the origin is", "m", form="plane"),
    Argument("resonance", "simulate the first structural mode of the device", form="switch"),
    Argument("brakes", "of a five-bar", default="inside", form="text", choices=BRAKES),
)
"""What [run] can say."""


def built(section: str, given: Mapping[str, Any], kinds: Mapping[str, Part], folder: Path) -> Any:
    """Return the hand or the motion of a section.

    Args:
        section: its name, for messages.
        given: what the section says, its kind and the arguments of that kind.
        kinds: what it can be.
        folder: to which files are relative.

    Raises:
        ParameterError: for an unknown kind or key, one that is missing, or a wrong value.
    """
    arguments = dict(given)
    kind = arguments.pop("kind", None)
    if not isinstance(kind, str):
        names = " | ".join(f'"{name}"' for name in kinds)
        raise ParameterError(section, f"needs kind = {names}", kind)
    if kind not in kinds:
        hint = nearest_names(kind, kinds)
        raise ParameterError(f"{section}.kind", f"is unknown: {kind!r}; {hint}")
    part = kinds[kind]
    values = read_arguments(section, arguments, part.arguments, folder)
    for argument in part.arguments:
        if argument.required and argument.name not in values:
            file = argument.form == "path"
            needs = f"a {kind} needs a file of positions" if file else f"{kind} needs it"
            raise ParameterError(f"{section}.{argument.name}", f"is missing: {needs}")
    return part.make(**values)


def written(values: Mapping[str, Any], arguments: Iterable[Argument]) -> dict[str, Any]:
    """Return the values that the arguments declare, as a scene writes them, with their units.

    Args:
        values: by name [SI]; ``None`` for what is not said.
        arguments: that may be among them.
    """
    known = {argument.name: argument for argument in arguments}
    return {
        name: _written(plain(value), known[name].unit)
        for name, value in values.items()
        if name in known and value is not None
    }


def _written(value: Any, unit: str) -> Any:
    if isinstance(value, list):
        return [_written(part, unit) for part in value]
    if isinstance(value, (bool, str)):
        return value
    return f"{value!r} {unit}" if unit else value

"""Exceptions of asperity, and messages to the user."""

from __future__ import annotations

import copyreg
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from typing import ClassVar, TypeVar

_Entry = TypeVar("_Entry")


class AsperityError(Exception):
    """Base class of the exceptions of asperity.

    Attributes:
        exit_code: exit code of the command line; 2 for bad input.
    """

    exit_code: ClassVar[int] = 2


class ParameterError(AsperityError, ValueError):
    """An invalid argument; the message states its name, the requirement and the value.

    Attributes:
        argument: name of the argument.
        requirement: what the argument must be.
        value: the value passed, ``None`` if it is not part of the message.

    Example:
        >>> raise ParameterError("stiffness", "must be positive and finite [N/m]", -3.0)
        Traceback (most recent call last):
        ...
        asperity.core.errors.ParameterError: stiffness must be positive and finite [N/m], got -3.0
    """

    def __init__(self, argument: str, requirement: str, value: object = None) -> None:
        self.argument = argument
        self.requirement = requirement
        self.value = value
        tail = "" if value is None else f", got {value!r}"
        super().__init__(f"{argument} {requirement}{tail}")

    def __reduce__(self) -> tuple[object, ...]:  # by state: subclasses have other arguments
        return copyreg.__newobj__, (type(self), *self.args), self.__dict__  # type: ignore[attr-defined]  # typeshed omits it


class _ReasonError(ParameterError):
    """An invalid argument whose message is the reason alone."""

    _argument: ClassVar[str]

    def __init__(self, reason: str) -> None:
        super().__init__(self._argument, reason)
        self.args = (reason,)

    def __str__(self) -> str:
        return self.requirement


class SurfaceFileError(_ReasonError):
    """A surface file that cannot be read; the argument is ``path``."""

    _argument = "path"


class LawError(_ReasonError):
    """A law whose force cannot be used; the argument is ``law``."""

    _argument = "law"


class InternalError(AsperityError, RuntimeError):
    """A proved bound contradicts an evaluation: no result can be trusted.

    The cause is an error in the code, or in the bounds of a user-defined texture kind.
    """

    exit_code = 70  # as in sysexits.h


def escape_unprintable(text: object) -> str:
    r"""Return a text with control characters escaped: a file name could control the terminal.

    Example:
        >>> escape_unprintable("a\x1b[31m.x3p")
        'a\\x1b[31m.x3p'
    """
    return "".join(sign if sign.isprintable() else repr(sign)[1:-1] for sign in str(text))


def print_message(text: str) -> None:
    """Print a message as one line on standard error."""
    with suppress(OSError, ValueError):
        line = escape_unprintable(" ".join(text.splitlines()))
        print(f"asperity: {line}", file=sys.stderr, flush=True)


def find_named(argument: str, name: str, table: Mapping[str, _Entry]) -> _Entry:
    """Return the entry of a name.

    Raises:
        ParameterError: for an unknown name of an argument, with the nearest.
    """
    if name not in table:
        raise ParameterError(argument, f"is unknown: {name!r}; {suggest_names(name, table)}")
    return table[name]


def suggest_names(name: str, choices: Iterable[str]) -> str:
    """Return a hint for an error message: the nearest names, and all choices.

    Example:
        >>> suggest_names("omega3", ["omega.3", "touch"])
        "did you mean 'omega.3'? known: omega.3, touch"
    """
    choice = sorted(choices)
    return f"{nearest_names(name, choice)}known: {', '.join(choice)}"


def nearest_names(name: str, choices: Iterable[str]) -> str:
    """Return a question with the one or two nearest names; empty if none is near.

    Example:
        >>> nearest_names("--stifness", ["--speed", "--stiffness"])
        "did you mean '--stiffness'? "
    """
    import difflib  # imported for an error only

    lowered = {choice.lower().lstrip("-"): choice for choice in choices}
    near = difflib.get_close_matches(name.lower().lstrip("-"), lowered, n=2, cutoff=0.65)
    return f"did you mean {' or '.join(repr(lowered[one]) for one in near)}? " if near else ""

"""Exceptions of asperity, and messages to the user."""

from __future__ import annotations

import copyreg
import sys
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from typing import ClassVar, TypeVar

_Entry = TypeVar("_Entry")

ArgumentWriter = Callable[[str, object], str]
"""Writes the name of an argument with a value for it, or with ``None`` alone."""


class AsperityError(Exception):
    """Base class of the exceptions of asperity.

    Attributes:
        exit_code: exit code of the command line; 2 for bad input.
    """

    exit_code: ClassVar[int] = 2


class ParameterError(AsperityError, ValueError):
    """An invalid argument; the message states its name, the requirement and the value.

    The message may name other arguments, as ``{force}``, with the values that help: here they are
    written as in Python, on the command line as options.

    Attributes:
        argument: name of the argument.
        requirement: what the argument must be.
        value: the value passed, ``None`` if it is not part of the message.
        template: the requirement with the names of the arguments in braces.
        suggestions: values [SI, or as text] of the arguments that the requirement names in braces;
            ``None`` where the name alone is to be written.

    Example:
        >>> raise ParameterError("stiffness", "must be positive and finite [N/m]", -3.0)
        Traceback (most recent call last):
        ...
        asperity.core.errors.ParameterError: stiffness must be positive and finite [N/m], got -3.0
        >>> print(ParameterError("output", "exists; {force} replaces it", force=True))
        output exists; force=True replaces it
    """

    def __init__(
        self, argument: str, requirement: str, value: object = None, **suggestions: object
    ) -> None:
        self.argument = argument
        self.value = value
        self.suggestions = suggestions
        self.template = requirement
        self.requirement = self.write_requirement(write_keyword)
        super().__init__(self.write_message(write_keyword))

    def write_requirement(self, write_argument: ArgumentWriter) -> str:
        """Return the requirement with the suggestions as a function writes them."""
        text = self.template
        for name, value in self.suggestions.items():
            text = text.replace(f"{{{name}}}", write_argument(name, value))
        return text

    def write_message(self, write_argument: ArgumentWriter) -> str:
        """Return the message with the suggestions as a function of name and value writes them."""
        tail = "" if self.value is None else f", got {self.value!r}"
        return f"{self.argument} {self.write_requirement(write_argument)}{tail}"

    def __reduce__(self) -> tuple[object, ...]:  # by state: subclasses have other arguments
        return copyreg.__newobj__, (type(self), *self.args), self.__dict__  # type: ignore[attr-defined]  # typeshed omits it


def write_keyword(name: str, value: object) -> str:
    """Return an argument as in a call of Python; its name alone if the value is ``None``."""
    if value is None:
        return name
    return f"{name}={value:.6g}" if isinstance(value, float) else f"{name}={value!r}"


class _ReasonError(ParameterError):
    """An invalid argument whose message is the reason alone."""

    _argument: ClassVar[str]

    def __init__(self, reason: str, **suggestions: object) -> None:
        super().__init__(self._argument, reason, **suggestions)

    def write_message(self, write_argument: ArgumentWriter) -> str:
        """Return the reason with the suggestions as a function writes them."""
        return self.write_requirement(write_argument)


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
    characters = list(str(text))
    for index, character in enumerate(characters):
        if not character.isprintable():
            characters[index] = repr(character)[1:-1]
    return "".join(characters)


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
    known = sorted(choices)
    return f"{nearest_names(name, known)}known: {', '.join(known)}"


def nearest_names(name: str, choices: Iterable[str]) -> str:
    """Return a question with the one or two nearest names; empty if none is near.

    Example:
        >>> nearest_names("--stifness", ["--speed", "--stiffness"])
        "did you mean '--stiffness'? "
    """
    import difflib  # imported for an error only

    lowered = {choice.lower().lstrip("-"): choice for choice in choices}
    near = difflib.get_close_matches(name.lower().lstrip("-"), lowered, n=2, cutoff=0.65)
    if not near:
        return ""
    return f"did you mean {' or '.join([repr(lowered[match]) for match in near])}? "

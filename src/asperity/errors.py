"""The few kinds of error that asperity raises on purpose."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from contextlib import suppress
from typing import ClassVar


class AsperityError(Exception):
    """Base of every error that asperity raises on purpose.

    Attributes:
        exit_code: of the program that ends by it; 2 for bad input.
    """

    exit_code: ClassVar[int] = 2


class ParameterError(AsperityError, ValueError):
    """An argument that cannot be used.

    The message names the argument, says what it must be and what was given.

    Attributes:
        argument: name of the argument.

    Example:
        >>> raise ParameterError("stiffness", "must be positive and finite [N/m]", -3.0)
        Traceback (most recent call last):
        ...
        asperity.errors.ParameterError: stiffness must be positive and finite [N/m], got -3.0
    """

    def __init__(self, argument: str, requirement: str, given: object = None) -> None:
        self.argument = argument
        self.requirement = requirement
        self.given = given
        tail = "" if given is None else f", got {given!r}"
        super().__init__(f"{argument} {requirement}{tail}")


class SurfaceFileError(ParameterError):
    """A surface file that cannot be read, with the reason; the argument is ``path``."""

    def __init__(self, reason: str) -> None:
        super().__init__("path", reason)
        self.args = (reason,)

    def __str__(self) -> str:
        return self.requirement


class LawError(ParameterError):
    """A law whose mathematics cannot be used, with the reason; the argument is ``law``."""

    def __init__(self, reason: str) -> None:
        super().__init__("law", reason)
        self.args = (reason,)

    def __str__(self) -> str:
        return self.requirement


class InternalError(AsperityError, RuntimeError):
    """What was proved and what was evaluated contradict each other: no result can be trusted.

    A mistake in the code, or in the bounds that a texture kind of your own claims.
    """


def printable(text: object) -> str:
    r"""Return a text without control characters: those of a file's name could drive a terminal.

    Example:
        >>> printable("a\x1b[31m.x3p")
        'a\\x1b[31m.x3p'
    """
    return "".join(sign if sign.isprintable() else repr(sign)[1:-1] for sign in str(text))


def tell(words: str) -> None:
    """Say something in one line on standard error, if anybody listens."""
    with suppress(OSError, ValueError):
        line = printable(" ".join(words.splitlines()))
        print(f"asperity: {line}", file=sys.stderr, flush=True)


def nearest_names(name: str, known: Iterable[str]) -> str:
    """Return a hint such as ``did you mean 'omega.3'?`` and the full choice.

    Args:
        name: what was given.
        known: the names that exist.

    Returns:
        A phrase for the end of an error message.
    """
    import difflib  # only when something is wrong

    choice = sorted(known)
    lowered = {c.lower(): c for c in choice}
    hits = [lowered[c] for c in difflib.get_close_matches(name.lower(), lowered, n=2, cutoff=0.65)]
    hint = f"did you mean {' or '.join(repr(h) for h in hits)}? " if hits else ""
    return f"{hint}known: {', '.join(choice)}"

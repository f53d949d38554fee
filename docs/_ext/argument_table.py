"""Tables of arguments for the reference pages, made from their declarations."""

from __future__ import annotations

from collections.abc import Iterable

from asperity.core.arguments import Argument

_HEAD = ["key", "unit", "default", "what it is"]
_OPTION_HEAD = ["key", "option", "unit", "default", "what it is"]


def argument_table(arguments: Iterable[Argument], *, options: bool = False) -> list[list[str]]:
    """Return the rows of a table, the head first.

    Args:
        arguments: their declarations.
        options: whether they are options of the command line too.
    """
    rows = [list(_OPTION_HEAD if options else _HEAD)]
    for argument in arguments:
        row = [argument.name, argument.unit, argument.default_text, describe_argument(argument)]
        if options:
            row.insert(1, f"--{argument.name.replace('_', '-')}")
        rows.append(row)
    return rows


def describe_argument(argument: Argument) -> str:
    """Return what an argument is, with the choice for a word and an example."""
    choice = f": {', '.join(argument.choices)}" if argument.choices else ""
    example = f", such as {argument.example}" if argument.example else ""
    return argument.description + choice + example

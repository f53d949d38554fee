"""Commands that hold commands, and refuse what click would take in silence."""

from __future__ import annotations

import click

from asperity.errors import ParameterError


def refuse_repeated(command: click.Command, words: list[str]) -> None:
    """Refuse an option that is given twice: click would take the last and say nothing.

    Raises:
        ParameterError: with the option; those that are made to be repeated count for nothing.
    """
    # A mistake in the words is said where they are parsed for good.
    with click.Context(command, resilient_parsing=True) as trial:
        _, _, given = command.make_parser(trial).parse_args(list(words))
    for option in given:
        if isinstance(option, click.Option) and not option.multiple and given.count(option) > 1:
            several = "; several values are one text, 'a; b'" if option.metavar == "LIST" else ""
            flag = max(option.opts, key=len)
            raise ParameterError(flag.lstrip("-"), f"is given twice: give {flag} once{several}")


class Group(click.Group):
    """Commands of which no option is given twice."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that is asked for, once no option of it is given twice."""
        name, command, rest = super().resolve_command(ctx, args)
        if command is not None:
            refuse_repeated(command, rest)
        return name, command, rest

"""Messages for commands and options that do not exist: one line with the likely correction."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import click

from asperity.core.errors import ParameterError, nearest_names, suggest_names
from asperity.core.files import read_toml

_SYNONYMS = Path(__file__).with_name("synonyms.toml")


def unknown_command_error(name: str, ctx: click.Context) -> ParameterError:
    """Return the error for a name that is no command of the group of a context."""
    usual = read_toml("synonyms", _SYNONYMS).get(str(ctx.info_name), {}).get(name.lower())
    hint = f"did you mean {usual!r}?" if usual else suggest_names(name, _commands_of(ctx))
    return ParameterError("command", f"is unknown: {name!r}; {hint}")


def usage_error_text(error: click.ClickException) -> str:
    """Return what is wrong with a command line, and the likely correction, as one line."""
    ctx: click.Context | None = getattr(error, "ctx", None)
    if ctx is not None and isinstance(error, click.NoSuchOption):
        return _unknown_option_text(error.option_name, ctx)
    text = error.format_message().rstrip(".")
    usage = f"; {ctx.get_usage().replace('Usage', 'usage')}" if ctx is not None else ""
    return f"{text[:1].lower()}{text[1:]}{usage}"


def _unknown_option_text(option: str, ctx: click.Context) -> str:
    """Return the message for an unknown option; it names the commands that have it."""
    pattern = re.compile(rf"-[a-z]*{re.escape(option[1:])}.*")  # -device is parsed as -d
    name = next(filter(pattern.fullmatch, sys.argv), option) if len(option) == 2 else option
    options, commands = _options_of(ctx.command), _commands_of(ctx.find_root())
    usual = read_toml("synonyms", _SYNONYMS)["options"].get(name.lower())
    near = f"did you mean {usual!r}? " if usual in options else nearest_names(name, options)
    having = ", ".join(one for one in commands if name in _options_of(commands[one]))
    taken = f"option of {having}; " if having else ""
    path = ctx.command_path
    return f"{path.split()[-1]} has no option {name}; {near}{taken}see {path} --help"


def _commands_of(ctx: click.Context) -> dict[str, click.Command]:
    group: Any = ctx.command
    return {name: group.get_command(ctx, name) for name in group.list_commands(ctx)}


def _options_of(command: click.Command) -> list[str]:
    return [flag for one in command.params for flag in one.opts if flag.startswith("--")]

"""Questions that ``asperity compare`` asks on a terminal where nothing was typed."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterable
from typing import Any

import click

from asperity.cli.main import HeadedCommand
from asperity.cli.options import option_help, parse_devices
from asperity.core.arguments import MAX_DEPTH
from asperity.core.errors import AsperityError, ParameterError
from asperity.measured.file_arguments import FILE_ARGUMENTS

_FILE_ARGUMENTS = {argument.name: argument for argument in FILE_ARGUMENTS}


class AskingCommand(HeadedCommand):
    """Command that asks for its arguments on a terminal, if there are none."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments, or the answers, which are shown as a command."""
        if not args and sys.stdin.isatty():
            args = ask_arguments()
            click.echo(f"asperity {self.name} {shlex.join(args)}", err=True)
        return super().parse_args(ctx, args)


def ask_arguments() -> list[str]:
    """Return surface, device and depth as typed arguments; each answer is checked at once."""
    from asperity.devices import device_names
    from asperity.textures.catalogue import CATALOGUE

    surface = _ask("Surface: a kind, a name, or a file; ? lists them", "cloth", CATALOGUE, _check)
    arguments = [surface]
    values: dict[str, Any] = {}
    while (missing := _find_missing(surface, values)) is not None:
        argument = _FILE_ARGUMENTS[missing.argument]
        click.echo(str(missing), err=True)
        text = _ask(
            option_help(argument), argument.example or None, argument.choices, argument.parse
        )
        values[argument.name] = argument.parse(text)
        arguments += [f"--{argument.name.replace('_', '-')}", text]
    question = "Device of the catalogue, or a TOML file; ? lists them"
    arguments += ["--device", _ask(question, "omega.3", device_names(), parse_devices)]
    depth = _ask("Greatest depth, such as 0.5mm, or Enter", "", (), _check_depth)
    return [*arguments, "--max-depth", depth] if depth else arguments


def _ask(
    question: str, default: str | None, names: Iterable[str], check: Callable[[str], Any]
) -> str:
    """Return an answer that is accepted; a refusal is explained, and ? lists the names."""
    while True:
        text: str = click.prompt(question, default, show_default=bool(default), err=True)
        if text.strip() == "?":
            click.echo(f"known: {', '.join(names)}", err=True)
            continue
        try:
            check(text)
        except AsperityError as error:
            click.echo(str(error), err=True)
        else:
            return text


def _check(surface: str) -> None:
    """Refuse a surface that cannot be read, except for arguments that are asked for next."""
    _find_missing(surface, {})


def _find_missing(surface: str, values: dict[str, Any]) -> ParameterError | None:
    """Return the error of a surface that lacks an argument of a file; ``None`` for none.

    Raises:
        AsperityError: for a surface that cannot be read at all.
    """
    from asperity.scene import load_scene

    try:
        load_scene(surface, values)
    except ParameterError as error:
        if error.argument not in _FILE_ARGUMENTS:
            raise
        return error
    return None


def _check_depth(text: str) -> None:
    if text:
        MAX_DEPTH.validate(MAX_DEPTH.parse(text))

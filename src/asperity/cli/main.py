"""The command ``asperity``: its commands, their help, and the report of errors."""

from __future__ import annotations

import importlib
import re
import sys
import warnings
from collections.abc import Collection, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NoReturn, cast

import click

import asperity
from asperity.cli.plugins import plugin_error_text
from asperity.core.cache import CacheWarning, size_limit
from asperity.core.errors import (
    ArgumentWriter,
    AsperityError,
    ParameterError,
    nearest_names,
    print_message,
    suggest_names,
    write_keyword,
)
from asperity.core.files import read_toml
from asperity.core.units import format_quantity
from asperity.laws import SHIPPED_LAW_ARGUMENTS
from asperity.measured.file_arguments import FILE_ARGUMENTS

GROUPS = read_toml("commands", Path(__file__).with_name("commands.toml"))
"""Module, summary and example of each command, by group and name."""
COMMANDS = {name: entry for group in GROUPS.values() for name, entry in group.items()}

_FILE_OPTIONS = {argument.name: argument for argument in FILE_ARGUMENTS}
# Options of a measured file that every help shows.
_USUAL = {"unit", "green", "pitch", "height_range", "tip_radius", "magnify"}
_HEADINGS = {
    "Law": {"law", "laws", "clamp", "stiffness", "max_depth", "rendering", *SHIPPED_LAW_ARGUMENTS},
    "Device and hand": {"device", "driver", "speed", "grip", "settings"},
    "Measured surface": set(_FILE_OPTIONS),
    "Output": {
        "output",
        "json_path",
        "html_path",
        "latex_path",
        "trace_path",
        "record",
        "force",
        "no_cache",
    },
}
_HEADING_OF = {name: title for title, names in _HEADINGS.items() for name in names}


def option_flag(option: click.Parameter) -> str:
    """Return the first long form of an option."""
    return next((flag for flag in option.opts if flag.startswith("--")), option.opts[0])


def write_option(name: str, value: object, ctx: click.Context) -> str:
    """Return an argument as an option of the running command, with a value for it.

    A field of a device is a value of ``--set``. What is no option is written as in Python.

    Args:
        name: name of the argument.
        value: a text, a number [SI], ``True`` for a switch, ``None`` for the option alone.
        ctx: context of the command.
    """
    from asperity.devices import FIELD_UNITS

    options = {str(option.name): option for option in ctx.command.params}
    text = str(value)
    if isinstance(value, float) and name in _FILE_OPTIONS:
        text = format_quantity(value, _FILE_OPTIONS[name].unit, digits=6)
    text = text.replace(" ", "").replace("µ", "u")
    if name in FIELD_UNITS and name not in options and "settings" in options:
        return f"--set {name}={text}"
    if name not in options:
        return write_keyword(name, value)
    option = options[name]
    if value is True or (value is None and option.metavar in (None, "TEXT")):
        return option_flag(option)
    if value is None:
        text = str(option.metavar)
    return f"{option_flag(option)} {text}"


def option_writer() -> ArgumentWriter:
    """Return a function that writes arguments as options of the running command."""
    ctx = click.get_current_context()
    return lambda name, value: write_option(name, value, ctx)


def option_message(error: ParameterError, ctx: click.Context) -> str:
    """Return the message of an error with options of the running command for its arguments."""
    message = error.write_message(option_writer())
    if error.argument in _arguments_of_surface(ctx):
        kind = ctx.params["surface"].partition(":")[0]
        return f"{message}; asperity surfaces {kind} shows an example"
    typed = {text.partition("=")[0] for text in ctx.meta["arguments"]}
    for option in ctx.command.params:
        flag = option_flag(option)
        is_absent = typed.isdisjoint(option.opts) and flag not in message
        if option.name == error.argument and flag.startswith("--") and is_absent:
            return f"{message} (option {flag})"
    return message


def _arguments_of_surface(ctx: click.Context) -> set[str]:
    """Return the names of the arguments of a texture kind that the command line names."""
    if not isinstance(ctx.params.get("surface"), str):
        return set()
    from asperity.textures.catalogue import CATALOGUE

    kind = CATALOGUE.get(ctx.params["surface"].partition(":")[0])
    return set() if kind is None else {argument.name for argument in kind.arguments}


def check_not_repeated(parsed: Sequence[click.Parameter]) -> None:
    """Check that no option is given twice, which click accepts silently.

    Args:
        parsed: the parameters in the order in which they were given.

    Raises:
        ParameterError: for an option that is given twice and may not be repeated.
    """
    for option in parsed:
        if isinstance(option, click.Option) and not option.multiple and parsed.count(option) > 1:
            flag = option_flag(option)
            fault = f"is given twice: give {flag} once"
            if option.metavar == "LIST":
                fault += "; several values are one text, 'a; b'"
            raise ParameterError(flag.lstrip("-"), fault)


class OptionCommand(click.Command):
    """Command that refuses repeated options, and whose errors name its options."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments, and keep them for messages and :func:`repeat_options`."""
        ctx.meta["arguments"] = list(args)
        ctx.meta["values"], _rest, parsed = self.make_parser(ctx).parse_args(list(args))
        check_not_repeated(parsed)
        return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        try:
            return super().invoke(ctx)
        except ParameterError as error:
            error.args = (option_message(error, ctx),)
            raise


class HeadedCommand(OptionCommand):
    """Command whose help has options under headings, and an example."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options; the rarer of a measured file only for ``--help-surface``."""
        rows: dict[str, list[tuple[str, str]]] = {title: [] for title in ("Options", *_HEADINGS)}
        has_files = any(option.name == "tip_radius" for option in self.params)
        for option in self.get_params(ctx):
            if option.name in _FILE_OPTIONS.keys() - _USUAL and not ctx.meta.get("shows_files"):
                continue
            record = option.get_help_record(ctx)
            title = _HEADING_OF.get(str(option.name), "Options")
            if title == "Measured surface" and not has_files:
                title = "Options"
            if record is not None:
                rows[title].append(record)
        for title, records in rows.items():
            if records:
                with formatter.section(title):
                    formatter.write_dl(records)

    def get_usage(self, ctx: click.Context) -> str:
        """Return the usage with an example, for messages."""
        return (
            f"{super().get_usage(ctx)}, such as asperity {self.name} {COMMANDS[str(self.name)][2]}"
        )

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002 - click's signature
        """Write the example."""
        with formatter.section("Example"):
            formatter.write_text(f"asperity {self.name} {COMMANDS[str(self.name)][2]}")


declare_command = partial(click.command, cls=HeadedCommand)
"""Decorator of a command by its name."""


def _show_file_options(ctx: click.Context, _option: click.Parameter, requested: bool) -> None:
    if requested:
        ctx.meta["shows_files"] = True
        click.echo(ctx.get_help())
        ctx.exit()


help_surface_option = click.option(
    "--help-surface",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_show_file_options,
    help="Show all options of a measured surface: filters, form, missing points ...",
)
"""Adds ``--help-surface``."""


def repeat_options(
    names: Collection[str], unused: Collection[str] = (), changed: Collection[str] = ()
) -> list[str]:
    """Return the options of the running command with these names, and of its file, as typed.

    Args:
        names: of the options.
        unused: names of values of ``--set`` to leave out.
        changed: names of options to leave out.
    """
    ctx = click.get_current_context()
    parts = []
    for option in ctx.command.params:
        is_repeated = option.name in {*names, *_FILE_OPTIONS} - {*changed}
        if option.name not in ctx.meta["values"] or not is_repeated:
            continue
        value = ctx.meta["values"][option.name]
        if isinstance(value, bool):
            parts.append(option_flag(option))
            continue
        texts = value if isinstance(value, list) else [value]
        for text in texts:
            if text.partition("=")[0].strip().replace("-", "_") not in unused:
                parts += [option_flag(option), text]
    return parts


_SYNONYMS = Path(__file__).with_name("synonyms.toml")


def unknown_command_error(name: str, group: click.Group, ctx: click.Context) -> ParameterError:
    """Return the error for a name that is no command of a group."""
    usual = read_toml("synonyms", _SYNONYMS).get(str(group.name), {}).get(name.lower())
    hint = f"did you mean {usual!r}?"
    if usual is None:
        hint = suggest_names(name, group.list_commands(ctx))
    return ParameterError("command", f"is unknown: {name!r}; {hint}")


def usage_error_text(error: click.ClickException) -> str:
    """Return what is wrong with a command line, and the likely correction, as one line."""
    ctx: click.Context | None = getattr(error, "ctx", None)
    if ctx is not None and isinstance(error, click.NoSuchOption):
        return _unknown_option_text(error.option_name, ctx)
    message = error.format_message().rstrip(".")
    if ctx is None:
        return message
    return f"{message}; {ctx.get_usage().replace('Usage', 'usage')}"


def _unknown_option_text(option: str, ctx: click.Context) -> str:
    """Return the message for an unknown option; it names the commands that have it."""
    name = option
    if len(option) == 2:  # -device is parsed as -d
        pattern = re.compile(rf"-[a-z]*{re.escape(option[1:])}.*")
        name = next(filter(pattern.fullmatch, sys.argv), option)
    options = _options_of(ctx.command)
    group = cast("click.Group", ctx.find_root().command)
    usual = read_toml("synonyms", _SYNONYMS)["options"].get(name.lower())
    hint = f"did you mean {usual!r}? " if usual in options else nearest_names(name, options)
    commands = {command: group.get_command(ctx, command) for command in group.list_commands(ctx)}
    having = [command for command in commands if name in _options_of(commands[command])]
    if having:
        hint += f"option of {', '.join(having)}; "
    path = ctx.command_path
    return f"{path.split()[-1]} has no option {name}; {hint}see {path} --help"


def _options_of(command: click.Command | None) -> list[str]:
    if command is None:
        return []
    return [flag for option in command.params for flag in option.opts if flag.startswith("--")]


class StrictGroup(click.Group):
    """Group of commands that suggests the command for another name."""

    command_class = OptionCommand

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command."""
        if args[0][:1] != "-" and self.get_command(ctx, args[0]) is None:
            raise unknown_command_error(args[0], self, ctx)
        return super().resolve_command(ctx, args)


BAD_INPUT = AsperityError.exit_code


class LazyCommands(StrictGroup):
    """Group that imports a command when it is called, so that the program starts fast."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the names of the commands."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002 - as above
        """Return a command by its name."""
        if cmd_name not in COMMANDS:
            return None
        module = importlib.import_module(f"asperity.cli.{COMMANDS[cmd_name][0]}_commands")
        command: click.Command = getattr(module, f"{cmd_name}_command")
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002 - as above
        """Write the commands by group."""
        for title, group in GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([(f"{name:<9}", entry[1]) for name, entry in group.items()])


@click.group(
    cls=LazyCommands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(asperity.__version__, prog_name="asperity")
def cli() -> None:
    """Render haptic textures: recommend a law and a stiffness, and report what goes wrong.

    Start with: asperity compare sinusoid:amplitude=0.8mm,period=1mm --device omega.3
    """


def _show_warning(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
    """Print a warning of the cache in one line; other warnings are for developers."""
    if issubclass(category, CacheWarning):
        print_message(str(message))


def main() -> None:
    """Run the command line; bad input is one line on standard error and exit code 2."""
    warnings.showwarning = _show_warning
    stdout = sys.stdout
    try:
        size_limit()  # an invalid value is reported first
        cli(prog_name="asperity", standalone_mode=False)
    except click.Abort:
        raise KeyboardInterrupt from None  # reported by asperity.__main__
    except SystemExit:
        if sys.stdout is not stdout:  # click replaces it when its reader has ended
            raise BrokenPipeError from None
        raise
    except click.ClickException as error:
        if isinstance(error, getattr(click.exceptions, "NoArgsIsHelpError", ())):
            error.show()  # the help of a group
            sys.exit(BAD_INPUT)
        _exit_with_message(usage_error_text(error), BAD_INPUT)
    except AsperityError as error:
        _exit_with_message(error, error.exit_code)
    except MemoryError:
        _exit_with_message("the surface is too large for this machine's memory", BAD_INPUT)
    except Exception as error:  # a plugin may raise anything
        message = plugin_error_text(error)
        if message is None:
            raise  # an internal error, or an error of the streams: see asperity.__main__
        _exit_with_message(message, BAD_INPUT)


def _exit_with_message(message: object, code: int) -> NoReturn:
    print_message(str(message))
    sys.exit(code)

"""Questions of ``asperity compare`` on a terminal, and commands to type next."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.main import HeadedCommand, repeat_options, write_option
from asperity.cli.options import option_help, parse_devices
from asperity.core.arguments import MAX_DEPTH
from asperity.core.errors import AsperityError, ParameterError
from asperity.core.units import format_quantity
from asperity.laws import registered_arguments
from asperity.measured.file_arguments import FILE_ARGUMENTS

if TYPE_CHECKING:
    from asperity.analysis.results.compare import Comparison
    from asperity.analysis.results.recommendation import LawRow
    from asperity.envelopes.find_design import Design

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


def why_hint(why: bool) -> str:
    """Return how to see what the terminal does not show; empty if it shows it."""
    return "" if why else "\nWhy, what else to watch, and all that is assumed: --why\n"


def next_commands(surface: str, result: Comparison, why: bool) -> str:
    """Return the commands to type next, for the recommended law or for a texture that is felt."""
    hint = why_hint(why)
    row = result.recommended_row
    if row is None:
        return f"{hint}\nNext:\n  {_remedy_command(surface, result)}"
    changed = {}
    if result.press is not None:
        changed["max_depth"] = format_quantity(row.surface.max_depth, "m", 6)
    return f"{hint}{_use_commands(surface, row, changed)}"


def _use_commands(surface: str, row: LawRow, changed: Mapping[str, str]) -> str:
    """Return the commands that render a law, with the options of the running command.

    Args:
        surface: the surface as typed.
        row: the law at its stiffness.
        changed: texts of options that differ from those of the running command.
    """
    from asperity.report.sentences import texts

    k = texts.limit_text(row.surface.stiffness).replace(" ", "")
    used = {*row.law.arguments, *row.surface.friction_values}
    names = {"device", "plugin", "settings", "max_depth", *used}
    typed = repeat_options(names, registered_arguments().keys() - used, changed)
    has_device = "--device" in typed or surface.endswith(".toml")
    device = [] if has_device else ["--device", row.passivity.loop.device.id]
    rest = shlex.join([surface, "--law", row.law.letter, "--stiffness", k, *device, *typed])
    ctx = click.get_current_context()
    rest = " ".join([rest, *[write_option(name, text, ctx) for name, text in changed.items()]])
    lab, run, export = (f"  asperity {name} {rest}" for name in ("lab", "run", "export"))
    return f"\nNext:\n{lab}\n{run}\n{export} -o texture.h"


def design_commands(surface: str, result: Design) -> str:
    """Return the commands that render a design: its law with parameters, stiffness and size."""
    from asperity.scene.scene_file import read_scene

    typed = click.get_current_context().params
    scene = read_scene(surface)[0].get("texture", {})  # an option replaces what it states
    lateral = typed["magnify"] or float(scene.get("magnify", 1.0))
    upward = typed["magnify_height"] or scene.get("magnify_height")
    is_high = result.comparison.texture.single_wave is not None  # its height alone is scaled
    changed = {}
    if not is_high:
        changed["magnify"] = f"{lateral * result.factor:.10g}"
    if is_high or upward is not None:
        changed["magnify_height"] = f"{float(upward or lateral) * result.factor:.10g}"
    for name, argument in result.row.law.arguments.items():
        if typed.get(name) is not None:
            changed[name] = argument.format_value(result.row.surface.law_parameters[name])
    return _use_commands(surface, result.row, changed)


def _remedy_command(surface: str, result: Comparison) -> str:
    """Return the command of the first change of the options that makes the texture felt.

    Without such a change: what the device renders; for a scene, which may magnify too and have a
    device of its own: what limits it.
    """
    row = result.nearest_row
    remedies = row.perceptibility.remedies if row is not None and row.perceptibility else ()
    values = {remedy.kind: remedy.value for remedy in reversed(remedies)}
    device = repeat_options({"device"})
    if surface.endswith(".toml"):
        return shlex.join(["asperity", "limits", surface, *device])
    if not {"magnify", "speed"} & set(values):
        device = device or ["--device", result.device.id]
        return shlex.join(["asperity", "envelope", *device])
    ctx = click.get_current_context()
    changed = {"speed": format_quantity(values.get("speed", 0.0), "m/s")}
    if "magnify" in values:
        changed = _magnified_options(ctx.params, values["magnify"])
    names = {str(option.name) for option in ctx.command.params} - _NOT_REPEATED
    typed = shlex.join([surface, *repeat_options(names, changed=changed)])
    written = [write_option(name, text, ctx) for name, text in changed.items()]
    return f"asperity compare {typed} {' '.join(written)}"


_NOT_REPEATED = {
    "surface",
    "why",
    "full",
    "json_path",
    "html_path",
    "latex_path",
    "force",
    "no_cache",
}


def _magnified_options(typed: Mapping[str, Any], factor: float) -> dict[str, str]:
    """Return the options for a surface that is magnified further, as in its confirmation.

    A depth on the command line is magnified too.
    """
    changed = {"magnify": f"{(typed['magnify'] or 1.0) * factor:.10g}"}
    if typed["magnify_height"] is not None:
        changed["magnify_height"] = f"{typed['magnify_height'] * factor:.10g}"
    if typed["max_depth"] is not None:
        changed["max_depth"] = format_quantity(typed["max_depth"][0] * factor, "m", 6)
    return changed

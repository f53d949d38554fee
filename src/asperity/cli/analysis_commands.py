"""The commands ``analyze``, ``compare``, ``limits``, ``envelope`` and ``design``."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from asperity.cli import options
from asperity.cli.main import (
    HeadedCommand,
    declare_command,
    option_writer,
    repeat_options,
    write_option,
)
from asperity.cli.options import GRIP, REQUESTED_STIFFNESS, SPEED
from asperity.cli.output import Outputs, check_outputs, output_options, step_bar
from asperity.core.arguments import MAX_DEPTH, Argument
from asperity.core.errors import ParameterError
from asperity.core.units import format_quantity
from asperity.laws import LAWS, REGISTERED_LAWS, registered_arguments

if TYPE_CHECKING:
    from asperity.analysis.results.compare import Comparison
    from asperity.analysis.results.device_comparisons import DeviceComparisons, MissingData
    from asperity.devices import Device
    from asperity.laws import Law
    from asperity.textures import Texture


_BOUND_SEARCH = options.command_arguments("analyze")


def _validated_parser(argument: Argument) -> Callable[[str], Any]:
    """Return a parser that validates a value before a surface is read."""

    def parse(text: str) -> Any:
        value = argument.validate(argument.parse(text))
        return (value, value) if argument.form == "pair" and isinstance(value, float) else value

    return parse


@declare_command("analyze")
@options.surface_options("Law, by letter or name.  [default: the scene's, or the recommended law]")
@options.argument_options(_BOUND_SEARCH, _validated_parser)
@output_options()
def analyze_command(surface: str, device: Device | None, outputs: Outputs, **values: Any) -> None:
    """Analyze one law on SURFACE and a device: bounds, energy, continuity and stability.

    SURFACE is a texture with its arguments (sinusoid:amplitude=0.8mm,period=1mm), a measured file
    or a scene file (TOML).
    """
    from asperity.analysis.results.analyze import STEPS, analyze

    with step_bar("reading the surface", len(STEPS)) as step:
        texture, device, arguments = options.load_surface(surface, device, values)
        search = options.provided_values(values, _BOUND_SEARCH)
        result = analyze(texture, device, progress=step, **search, **arguments)
    code = _texture_code(surface, options.file_values(values), texture)

    from asperity.report.pages.analysis_report import analysis_page

    outputs.write(result, analysis_page(result, code))


def _texture_code(source: str, file_options: Mapping[str, Any], texture: Texture) -> str:
    """Return a Python expression that makes the texture; empty if its ``repr`` is one."""
    if not repr(texture).startswith("<"):
        return ""
    if source.lower().endswith(".toml") or not os.path.exists(source):
        extra = f", {dict(file_options)!r}" if file_options else ""
        return f"load_scene({source!r}{extra}).texture"
    arguments = [repr(source), *[f"{name}={value!r}" for name, value in file_options.items()]]
    return f"asp.load_texture({', '.join(arguments)})"


_STIFFNESS = replace(
    REQUESTED_STIFFNESS, default_description="the recommended stiffness of each law"
)
_MAX_DEPTHS = replace(MAX_DEPTH, form="items", example="0.1mm; 0.5mm")


_COMPARISON = (SPEED, GRIP, *options.command_arguments("compare"))


class _AskingCommand(HeadedCommand):
    """Command that asks for its arguments on a terminal, if there are none."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments, or the answers."""
        if not args and sys.stdin.isatty():
            surface = click.prompt("Surface: a kind, a name such as cloth, or a file")
            device = click.prompt("Device of the catalogue, or a TOML file", "omega.3")
            depth = click.prompt("Greatest depth, such as 0.5mm, or Enter", "", show_default=False)
            args = [surface, "--device", device, *(["--max-depth", depth] if depth else [])]
        return super().parse_args(ctx, args)


@click.command("compare", cls=_AskingCommand)
@click.argument("surface")
@options.device_option(
    "Devices of the catalogue, or TOML files, 'touch,mine.toml'.  [default: omega.3]",
    options.parse_devices,
)
@options.argument_options(_COMPARISON)
@options.laws_option("Laws to compare, 'WAC' or names with commas.  [default: all]")
@options.law_options((_STIFFNESS, _MAX_DEPTHS, *options.LAW_OPTIONS[2:]))
@options.file_options
@click.option(
    "--full",
    is_flag=True,
    help="Show the characteristic numbers q and q⁺, the limits, leaks, strength T and support S.",
)
@click.option("--why", is_flag=True, help="Show the reasons of the answer, and what else to watch.")
@options.jobs_option
@output_options()
def compare_command(
    surface: str,
    device: tuple[Device, ...] | None,
    laws: tuple[Law, ...] | None,
    full: bool,
    why: bool,
    outputs: Outputs,
    **values: Any,
) -> None:
    """Compare all laws on SURFACE and a device, and recommend one with its stiffness.

    SURFACE is a texture with its arguments (sinusoid:amplitude=0.8mm,period=1mm), a measured file
    (X3P, SDF, NPY, text, PNG, TIFF, STL, OBJ ...) or a scene file (TOML). Several devices and
    depths are compared in one table.
    """
    from asperity.analysis.results.device_comparisons import compare_devices

    chosen = laws or tuple(REGISTERED_LAWS.values())
    first, *others = device or (None,)
    cases = (1 + len(others)) * len(values["max_depth"] or [None])
    with step_bar("reading the surface", len(chosen) * cases) as step:
        texture, known, arguments = options.load_surface(surface, first, values, chosen)
        arguments.pop("law", None)  # the law of a scene is for running it
        depths = arguments.pop("max_depth", None)  # a single value in a scene
        result = compare_devices(
            texture,
            [known, *(values["settings"].apply_to(other) for other in others if other)],
            [depths] if isinstance(depths, float) else depths,
            chosen,
            progress=lambda on, _depth, law: step(f"{on.id}, law {law}"),
            **options.provided_values(values, _COMPARISON),
            **arguments,
        )
    _write_comparisons(result, outputs, full, why, surface)


def _next_commands(surface: str, result: Comparison, why: bool) -> str:
    """Return the commands to type next, for the recommended law or for a texture that is felt."""
    from asperity.report.sentences import number_text

    row = result.recommended_row
    if row is None:
        return f"\nNext:\n  {_remedy_command(surface, result)}"
    k = number_text.limit_text(row.surface.stiffness).replace(" ", "")
    used = {*row.law.arguments, *row.surface.friction_values}
    unused = registered_arguments().keys() - used
    names = {"device", "plugin", "settings", "max_depth", *used}
    typed = repeat_options(names, unused)
    has_device = "--device" in typed or surface.endswith(".toml")
    device = [] if has_device else ["--device", result.device.id]
    rest = shlex.join([surface, "--law", row.law.letter, "--stiffness", k, *device, *typed])
    lab, run, export = (f"  asperity {name} {rest}" for name in ("lab", "run", "export"))
    hint = "" if why else "\nWhy, and what else to watch: --why\n"
    return f"{hint}\nNext:\n{lab}\n{run}\n{export} -o texture.h"


def _remedy_command(surface: str, result: Comparison) -> str:
    """Return the command of the first change of the options that makes the texture felt.

    Without such a change, and for a scene, which may magnify too: what the device renders.
    """
    row = result.nearest_row
    found = row.perceptibility.remedies if row is not None and row.perceptibility else ()
    values = {remedy.kind: remedy.value for remedy in reversed(found)}
    if surface.endswith(".toml") or not {"magnify", "speed"} & set(values):
        return shlex.join(["asperity", "envelope", "--device", result.device.id])
    ctx = click.get_current_context()
    changed = {"speed": format_quantity(values.get("speed", 0.0), "m/s")}
    if "magnify" in values:
        changed = _magnified_options(ctx.params, values["magnify"])
    names = {str(option.name) for option in ctx.command.params} - _NOT_REPEATED
    typed = shlex.join([surface, *repeat_options(names, changed=changed)])
    written = [write_option(name, text, ctx) for name, text in changed.items()]
    return f"asperity compare {typed} {' '.join(written)}"


_NOT_REPEATED = {"surface", "why", "full", "json_path", "html_path", "force", "no_cache"}


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


def _write_comparisons(
    result: DeviceComparisons, outputs: Outputs, full: bool, why: bool, surface: str
) -> None:
    """Write a single comparison, or the table of several.

    Raises:
        ParameterError: if the data of no device suffices; the table is written before.
    """
    from asperity.report.pages import comparison_report as report

    if len(result.comparisons) == 1 and not result.missing_data:
        comparison = result.comparisons[0]
        outputs.write(
            comparison,
            report.comparison_page(comparison, full, why, option_writer()),
            extra_line=_next_commands(surface, comparison, why),
        )
        return
    if result.comparisons or len(result.missing_data) > 1:
        remedies = [_missing_data_text(missing) for missing in result.missing_data]
        outputs.write(result, report.comparisons_page(result), extra_line="\n".join(remedies))
    if not result.comparisons:
        reasons = "; ".join(comparison.sentence for comparison in result.missing_data)
        raise ParameterError("device", f"lacks data to compare laws: {reasons}")


def _missing_data_text(missing: MissingData) -> str:
    field = missing.hint.translate(str.maketrans("", "", ' "'))
    return f"{missing.device} can be compared with --set {field}"


_SAMPLING = options.command_arguments("limits")


@declare_command("limits")
@options.surface_options("Law, by letter or name.  [default: the recommended law]")
@options.argument_options((SPEED, GRIP, *_SAMPLING))
@output_options()
def limits_command(surface: str, device: Device | None, outputs: Outputs, **values: Any) -> None:
    """Report which wavelengths of SURFACE are perceptible, and up to which scanning speed.

    SURFACE is a texture with its arguments (sinusoid:amplitude=0.8mm,period=1mm), a measured file
    or a scene file (TOML).
    """
    from asperity.analysis.results.check_limits import limits

    with step_bar("reading the surface", 2) as step:
        step("reading the surface")
        texture, device, arguments = options.load_surface(surface, device, values)
        step("analyzing the waves")
        sampling = options.provided_values(values, (SPEED, GRIP, *_SAMPLING))
        result = limits(texture, device, **sampling, **arguments)

    from asperity.report.pages.limits_report import limits_page

    outputs.write(result, limits_page(result))


_CONDITIONS = (SPEED, *options.command_arguments("envelope"), MAX_DEPTH, GRIP, *_SAMPLING)
_LAW_PARAMETERS = tuple([argument for law in LAWS.values() for argument in law.arguments.values()])


@declare_command("envelope")
@options.device_option(
    "Devices of the catalogue, or TOML files, 'touch,mine.toml'.  [default: omega.3]",
    options.parse_devices,
)
@options.laws_option("Laws, 'HC' or names with commas.  [default: all with a texture]")
@click.option(
    "--surface",
    metavar="SURFACE",
    multiple=True,
    help="Surface whose greatest waves are located on the diagram, such as 'land.x3p'; may be"
    " repeated.",
)
@options.argument_options(_CONDITIONS)
@options.law_options(_LAW_PARAMETERS)
@click.option(
    "-o",
    "--output",
    metavar="PATH",
    multiple=True,
    help="Write the borders (.csv) or the diagram (.svg, .pdf, .png); may be repeated.",
)
@options.jobs_option
@output_options()
def envelope_command(
    device: tuple[Device, ...] | None,
    laws: tuple[Law, ...] | None,
    surface: tuple[str, ...],
    output: tuple[str, ...],
    outputs: Outputs,
    **values: Any,
) -> None:
    """Compute which sinusoids devices render, by law: wavelengths and amplitudes.

    A texture is rendered if the recommended stiffness of the law is at least --min-stiffness and
    the texture is felt at that stiffness on a scan, as in asperity compare.
    """
    from asperity.envelopes.envelope import envelope, textured_laws
    from asperity.report.pages.limits_report import check_suffix, envelope_page, write_envelope

    for path in output:
        check_suffix(path)
    check_outputs(force=outputs.force, **{f"output {i}": path for i, path in enumerate(output, 1)})
    devices = [
        values["settings"].apply_to(entry) for entry in device or options.parse_devices("omega.3")
    ]
    chosen = laws or textured_laws()
    with step_bar("reading the surfaces", len(devices) * len(chosen)) as step:
        result = envelope(
            devices,
            chosen,
            surface=surface or None,
            law_parameters=_law_parameters(values),
            progress=step,
            **options.provided_values(values, _CONDITIONS),
        )
    for path in output:
        write_envelope(result, path)
    outputs.write(result, envelope_page(result))


_TARGET = (*options.command_arguments("design"), *_CONDITIONS[:4])


@declare_command("design")
@click.argument("surface")
@options.device_option()
@options.laws_option("Laws, of which the best is chosen.  [default: all with a texture]")
@options.argument_options(_TARGET)
@options.argument_options(_LAW_PARAMETERS, options.list_parser)
@options.law_options(())
@options.file_options
@options.jobs_option
@output_options()
def design_command(
    surface: str,
    device: Device | None,
    laws: tuple[Law, ...] | None,
    outputs: Outputs,
    **values: Any,
) -> None:
    """Find law, stiffness and size of SURFACE that meet a target with the greatest margin.

    The height of a single sinusoid is scaled; other surfaces are magnified in all directions,
    further than by --magnify. Without a force the largest texture is found that is stable and felt.
    Of several values of a parameter, '1,1.5,2', the best one is chosen.
    """
    from asperity.envelopes.envelope import textured_laws
    from asperity.envelopes.find_design import design
    from asperity.report.pages.comparison_report import design_page
    from asperity.scene import load_scene

    chosen = laws or textured_laws()
    with step_bar("reading the surface", len(chosen) + 4) as step:
        step("reading the surface")
        scene = load_scene(surface, options.file_values(values))
        result = design(
            scene.texture,
            options.select_device(device, scene, values),
            chosen,
            law_parameters=_law_parameters(values),
            progress=step,
            **options.provided_values(values, _TARGET),
        )
    outputs.write(result, design_page(result))


def _law_parameters(values: dict[str, Any]) -> dict[str, Any]:
    return options.provided_values(values, _LAW_PARAMETERS) | dict(values["settings"].law)

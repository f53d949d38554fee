"""The commands ``analyze``, ``compare``, ``limits``, ``envelope`` and ``design``."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from asperity.cli import options
from asperity.cli.guidance import AskingCommand, design_commands, next_commands, why_hint
from asperity.cli.main import declare_command, option_writer
from asperity.cli.options import GRIP, REQUESTED_STIFFNESS, SPEED
from asperity.cli.output import Outputs, check_outputs, output_options, step_bar
from asperity.core.arguments import MAX_DEPTH, Argument
from asperity.core.errors import ParameterError
from asperity.laws import LAWS, REGISTERED_LAWS

if TYPE_CHECKING:
    from asperity.analysis.results.compare import Comparison
    from asperity.analysis.results.device_comparisons import DeviceComparisons, MissingData
    from asperity.devices import Device
    from asperity.laws import Law


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

    from asperity.report.pages.analysis_report import analysis_page

    outputs.write(result, analysis_page(result))


_STIFFNESS = replace(
    REQUESTED_STIFFNESS, default_description="the recommended stiffness of each law"
)
_MAX_DEPTHS = replace(MAX_DEPTH, form="items", example="0.1mm; 0.5mm")


_COMPARISON = (SPEED, GRIP, *options.command_arguments("compare"))


_why_option = click.option(
    "--why", is_flag=True, help="Show reasons of the answer, what else to watch, all assumptions."
)


@click.command("compare", cls=AskingCommand)
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
@_why_option
@click.option(
    "--latex",
    "latex_path",
    metavar="PATH",
    help="Write the table and a paragraph for a methods section (LaTeX); - writes to standard"
    " output.",
)
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
    above: list[Any] = []
    with step_bar("reading the surface", len(chosen) * cases, above) as step:
        texture, known, arguments = options.load_surface(surface, first, values, chosen)
        arguments.pop("law", None)  # the law of a scene is for running it
        depths = arguments.pop("max_depth", None)  # a single value in a scene
        result = compare_devices(
            texture,
            [known, *(values["settings"].apply_to(other) for other in others if other)],
            [depths] if isinstance(depths, float) else depths,
            chosen,
            progress=lambda on, _depth, law: step(f"{on.id}, law {law}"),
            on_row=partial(_show_rows, above) if sys.stderr.isatty() else None,
            **options.provided_values(values, _COMPARISON),
            **arguments,
        )
    _write_comparisons(result, outputs, full, why, surface)


def _show_rows(above: list[Any], comparison: Comparison) -> None:
    """Show the laws that are ready above the progress bar."""
    from asperity.report.pages.comparison_columns import comparison_table

    above[:] = [comparison_table(comparison, shutil.get_terminal_size().columns)]


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
            extra_line=next_commands(surface, comparison, why),
        )
        return
    if result.comparisons or len(result.missing_data) > 1:
        remedies = [_missing_data_text(missing) for missing in result.missing_data]
        page = report.comparisons_page(result, why)
        outputs.write(result, page, extra_line="\n".join([*remedies, why_hint(why)]))
    if not result.comparisons:
        reasons = "; ".join(
            [f"{one.sentence}; {_missing_data_text(one)}" for one in result.missing_data]
        )
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
    from asperity.report.document.page import check_suffix
    from asperity.report.pages.limits_report import TABLE_SUFFIX, envelope_page, write_envelope

    for path in output:
        check_suffix(path, TABLE_SUFFIX)
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
    outputs.write(result, envelope_page(result))
    for path in output:
        write_envelope(result, path)


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
@_why_option
@output_options()
def design_command(
    surface: str,
    device: Device | None,
    laws: tuple[Law, ...] | None,
    why: bool,
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
    commands = design_commands(surface, result)
    outputs.write(result, design_page(result, why), extra_line=f"{why_hint(why)}{commands}")


def _law_parameters(values: dict[str, Any]) -> dict[str, Any]:
    return options.provided_values(values, _LAW_PARAMETERS) | dict(values["settings"].law)

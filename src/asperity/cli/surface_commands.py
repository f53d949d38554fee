"""The commands ``surfaces``, ``show``, ``prepare``, ``bake``, ``maps`` and ``export``."""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli import options
from asperity.cli.main import declare_command
from asperity.cli.output import Outputs, check_outputs, output_options, progress_bar, step_bar
from asperity.core.arguments import MAX_DEPTH, STIFFNESS
from asperity.core.errors import ParameterError, escape_unprintable
from asperity.core.files import check_output, write_bytes
from asperity.laws import SHIPPED_LAW_ARGUMENTS
from asperity.laws.clamps import BACKED

if TYPE_CHECKING:
    from asperity.devices import Device
    from asperity.export.surface_maps import SampledMap
    from asperity.textures.texture import Texture


@declare_command("surfaces")
@click.argument("names", nargs=-1, metavar="[NAME]...")
@options.plugin_option
@output_options()
def surfaces_command(names: tuple[str, ...], outputs: Outputs) -> None:
    """List texture kinds and named surfaces with their arguments, units, defaults and sizes.

    With NAMEs, show details. Other commands accept these names as SURFACE, with arguments after a
    colon: cloth, sandpaper:grit=P60, noise:rms=20um,size=10mm.
    """
    from asperity.report.pages.catalogue_report import find_surfaces, surfaces_page

    surfaces = find_surfaces(names)
    page = surfaces_page(surfaces, detailed=bool(names), command="asperity compare")
    outputs.write({"schema": 2, "surfaces": surfaces}, page)


# What the progress bar shows for the stages of a preparation, in their order.
_STAGE_LABELS = {
    "read": "reading the surface",
    "outliers": "removing outliers",
    "form": "removing the form",
    "fill": "filling missing points",
    "filter": "filtering",
    "tip": "simulating the tip",
    "repeat": "blending the borders",
    "magnify": "magnifying",
    "measure": "computing parameters",
    "write": "writing",
}


@contextmanager
def preparation_progress() -> Iterator[Callable[[str], None]]:
    """Show the stage of a preparation; yield a function to call before each stage."""
    stages = list(_STAGE_LABELS)
    with progress_bar(_STAGE_LABELS["read"]) as update:
        yield lambda stage: update(stages.index(stage) / len(stages), _STAGE_LABELS[stage])


def _check_file(_ctx: click.Context, _argument: click.Parameter, name: str) -> str:
    """Refuse a surface of the catalogue where a file is expected."""
    from asperity.textures.catalogue import CATALOGUE

    kind = name.partition(":")[0].lower()
    if kind in CATALOGUE and not os.path.isfile(name):
        fault = "must be a measured file; this is a surface of the catalogue: asperity surfaces"
        raise ParameterError("file", f"{fault} {kind}", name)
    return name


@declare_command("prepare")
@click.argument("file", callback=_check_file)
@click.option(
    "-o", "--output", metavar="PATH", required=True, help="The file to write, surface.npz."
)
@options.plugin_option
@options.file_options
@output_options(html=False)
def prepare_command(file: str, output: str, outputs: Outputs, **values: Any) -> None:
    """Prepare the measured surface FILE and write it with the history of its preparation.

    The steps are: read, outliers, fill, form, filter, tip, blend, magnify. Every other command
    accepts the result in place of the measured file. Lengths are those of the measured surface,
    before magnification. The parameters of the surface (ISO 25178-2, ISO 21920-2) are printed after
    each step; asperity show prints more of them.
    """
    from asperity.measured.prepared import check_output_path, save_prepared
    from asperity.measured.reading.measured_file import prepare_file

    check_output_path(Path(output), Path(file))
    check_outputs(force=outputs.force, output=output, json=outputs.json)
    with preparation_progress() as start_stage:
        prepared = prepare_file(file, progress=start_stage, **options.file_values(values))
        start_stage("write")
        save_prepared(output, prepared, file)
    from asperity.report.pages.measured_report import preparation_page

    outputs.write(prepared, preparation_page(prepared, output))


_BAKE = options.command_arguments("bake")
_BAKED_LAW = (STIFFNESS, MAX_DEPTH, SHIPPED_LAW_ARGUMENTS["continuity"])


@declare_command("bake")
@click.argument("surface")
@click.option("-o", "--output", metavar="PATH", required=True, help="File to write.")
@click.option("--body", is_flag=True, help="SURFACE is the mesh of a closed body; needs --unit.")
@click.option(
    "--repair", is_flag=True, help="With --body, fill open edges and turn triangles of the mesh."
)
@options.argument_options((*_BAKE, *_BAKED_LAW))
@options.plugin_option
@options.file_options
@output_options()
def bake_command(surface: str, output: str, *, body: bool, outputs: Outputs, **values: Any) -> None:
    """Bake law H of SURFACE as a potential field, and write it to a file.

    The rendered force is the negative gradient of the field. It is conservative and continuous,
    has a certified gain, and needs no search. Other commands accept the file as SURFACE.
    """
    from asperity.rendering import bake, bake_mesh
    from asperity.scene import load_scene
    from asperity.surface import Surface
    from asperity.textures.fields.field_file import save_field

    if (repair := values.pop("repair")) and not body:
        raise ParameterError("repair", "requires --body: only a mesh is repaired")
    if values["texture"] is not None and not body:
        raise ParameterError("texture", "requires --body: it is laid on a mesh")
    if values["press"] is not None and body:
        raise ParameterError(
            "press", "is of surfaces: a body is baked down to {max_depth}", max_depth=None
        )
    check_outputs(force=outputs.force, output=output, json=outputs.json)
    with progress_bar("baking the field") as update:
        law_values = options.provided_values(values, _BAKED_LAW)
        bake_values = options.provided_values(values, _BAKE)
        if body:
            bake_values |= {"repair": repair, **_body_values(options.file_values(values))}
            baked = bake_mesh(surface, progress=update, **law_values, **bake_values)
        else:
            texture = load_scene(surface, options.file_values(values)).texture
            baked = bake(Surface(texture, "H", **law_values), progress=update, **bake_values)
        field = save_field(output, baked.texture)
    from asperity.report.pages.measured_report import field_page

    outputs.write(field.describe(), field_page(field, output))


def _body_values(values: dict[str, Any]) -> dict[str, Any]:
    """Return the options of a file that apply to a mesh: its unit, and the tip that probes it."""
    for name in values.keys() - {"unit", "tip_radius"}:
        raise ParameterError(name, "does not apply to a body")
    return values


@declare_command("show")
@click.argument("file", callback=_check_file)
@options.plugin_option
@options.file_options
@output_options()
def show_command(file: str, outputs: Outputs, **values: Any) -> None:
    """Report the roughness parameters of the measured surface FILE after each preparation step.

    For maps, the parameters are those of ISO 25178-2 (Sq, Sa, Sz, Sdr ...); for profiles, those of
    ISO 21920-2 (Rq, Ra, Rz ...). The report also shows what each step removed and separates form,
    waviness and texture. FILE may also be an output of asperity prepare. Of a baked field, the
    report has its accuracy.
    """
    from asperity.measured.reading.measured_file import show
    from asperity.textures.fields.field_file import is_field

    if is_field(file):
        _show_field(file, outputs, options.file_values(values))
        return
    with preparation_progress() as start_stage:
        summary = show(file, progress=start_stage, **options.file_values(values))

    from asperity.report.pages.measured_report import surface_summary_page

    outputs.write(summary, surface_summary_page(summary))


def _show_field(file: str, outputs: Outputs, values: dict[str, Any]) -> None:
    from asperity.report.pages.measured_report import field_page
    from asperity.textures import load_texture

    field: Any = load_texture(file, **values)
    outputs.write(field.describe(), field_page(field, file))


_LANG, *_REQUEST_ARGUMENTS, _CLAMP = options.command_arguments("export")


@declare_command("export")
@click.option("-o", "--output", metavar="PATH", required=True, help="File to write ('texture.h').")
@click.option(
    "--exact",
    is_flag=True,
    help="Search without an evaluation budget: exact, at unbounded cost per tick.",
)
@click.option("--load", is_flag=True, help="Load the field of law H at run time from a file.")
@click.option("--shared", is_flag=True, help="Write a library: header, source and CMakeLists.txt.")
@click.option("--force", is_flag=True, help="Replace existing files.")
@options.argument_options((_LANG, *_REQUEST_ARGUMENTS, _CLAMP))
@options.surface_options(
    "Law, by letter or name.  [default: the scene's, or the recommended law]",
    replace(options.REQUESTED_STIFFNESS, description="stiffness of the exported force"),
)
def export_command(
    surface: str,
    output: str,
    device: Device | None,
    *,
    exact: bool,
    load: bool,
    shared: bool,
    force: bool,
    **values: Any,
) -> None:
    """Export SURFACE and its law as C code with one function, texture_force(), or for Unity.

    SURFACE is a texture with its arguments (sinusoid:amplitude=0.8mm,period=1mm), a measured file
    or a scene file (TOML).
    """
    from asperity.export import targets
    from asperity.export.surface_functions import ExportRequest
    from asperity.textures.fields.field_file import is_field

    request = options.provided_values(values, _REQUEST_ARGUMENTS)
    if exact:
        if "max_evaluations" in request:
            raise ParameterError("exact", "searches without a budget: leave out --max-evaluations")
        request["max_evaluations"] = math.inf
    target = targets.find_target(values["lang"] or "c99")
    path = Path(output)
    target.check_place(path, force=force)
    target.check(**request, loads_field=load)
    field = None
    if load and not is_field(surface):
        field = path.with_suffix(".field")
        check_output("output", str(field), force=force)
    ExportRequest.validate(**request)

    from asperity.analysis.results.analyze import STEPS, analyze
    from asperity.export.export_surface import export_analysis, fit_analysis

    request |= {"as_library": shared, "loads_field": load}
    clamp = options.provided_values(values, [_CLAMP])
    with step_bar("reading the surface", len(STEPS)) as step:
        texture, device, arguments = options.load_surface(
            surface, device, values, clamp=BACKED.name
        )
        whole = analyze(texture, device, progress=step, **{**arguments, **clamp})
    analysis = fit_analysis(whole, request)
    if analysis is not whole:
        click.echo(f"To fit: {analysis.surface.texture.preparation[-1]}")
    files = export_analysis(analysis, path, target, field, request, force=force)
    click.echo(f"Written: {', '.join(escape_unprintable(file) for file in files)}")
    if target.compiler and shutil.which(target.compiler) is None:
        click.echo(f"Library not built, no {target.compiler} here: README.txt says how")
    for source in [file.name for file in files if file.name.endswith("_data.c")]:
        click.echo(f"To be compiled with the program: {escape_unprintable(source)}")
    click.echo(
        f"{request.get('name', 'texture')}_force() is law {analysis.surface.law}. {analysis.answer}"
    )


_GRID_ARGUMENTS = options.command_arguments("maps")


@declare_command("maps")
@click.argument("surface")
@click.option(
    "-o",
    "--output",
    metavar="PATH",
    required=True,
    help="The file to write: heights as .png (16 bit), .tif (float) or .x3p; normals as .png.",
)
@click.option(
    "--normals", metavar="gltf|chai3d", help="Write normals in this convention instead of heights."
)
@click.option("--force", is_flag=True, help="Replace an existing file.")
@options.argument_options((*_GRID_ARGUMENTS, STIFFNESS))
@options.plugin_option
@options.file_options
def maps_command(
    surface: str, output: str, *, normals: str | None, force: bool, **values: Any
) -> None:
    """Write SURFACE as a height map or a normal map, and report its accuracy.

    Every file contains its physical size. A program that rotates the force of a smooth wall by a
    normal map renders law G; the report describes that law at the given stiffness.
    """
    from asperity.export.surface_maps import HEIGHT_MAPS, find_convention, normal_png, sample_map
    from asperity.scene import load_scene

    path = Path(output)
    suffix = path.suffix.lower()
    suffixes = [".png"] if normals is not None else list(HEIGHT_MAPS)
    if normals is not None:
        find_convention(normals)
    if suffix not in suffixes:
        raise ParameterError("output", f"must end in {', '.join(suffixes)}", output)
    check_output("output", output, force=force)
    with progress_bar("reading the surface"):
        texture = load_scene(surface, options.file_values(values)).texture
        sampled = sample_map(texture, **options.provided_values(values, _GRID_ARGUMENTS))
        content = HEIGHT_MAPS[suffix](sampled) if normals is None else normal_png(sampled, normals)
    write_bytes("output", path, content)
    click.echo(f"Written: {escape_unprintable(output)}")
    for sentence in _describe_map(texture, sampled, suffix, normals, values["stiffness"]):
        click.echo(sentence)


def _describe_map(
    texture: Texture, sampled: SampledMap, suffix: str, normals: str | None, stiffness: float | None
) -> list[str]:
    from asperity.report.sentences import surface_text

    if normals is None:
        return [surface_text.describe_map(sampled), surface_text.describe_heights(sampled, suffix)]
    with progress_bar("analyzing law G"):
        shading = surface_text.describe_shading(texture, stiffness)
    return [
        surface_text.describe_map(sampled),
        surface_text.describe_normals(sampled, normals),
        shading,
    ]

"""The commands ``export`` and ``maps``."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.clamps import BACKED
from asperity.cli import options
from asperity.cli.main import declare_command
from asperity.cli.output import progress_bar, step_bar
from asperity.core.arguments import STIFFNESS
from asperity.core.errors import ParameterError, escape_unprintable
from asperity.core.files import check_output, write_bytes

if TYPE_CHECKING:
    from asperity.devices import Device
    from asperity.export.surface_maps import SampledMap
    from asperity.textures.texture import Texture


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
    """Export SURFACE and its law as C code with one function, texture_force().

    SURFACE is a texture with its arguments (sinusoid:amplitude=0.8mm,period=1mm), a measured file
    or a scene file (TOML).
    """
    from asperity.export import targets
    from asperity.export.export_request import ExportRequest
    from asperity.textures.fields.field_file import is_field

    request = options.provided_values(values, _REQUEST_ARGUMENTS)
    if exact:
        if "max_evaluations" in request:
            raise ParameterError("exact", "searches without a budget: leave out --max-evaluations")
        request["max_evaluations"] = math.inf
    target = targets.find_target(values["lang"] or "c99")
    path = Path(output)
    targets.check_name(path, target)
    check_output("output", output, force=force)
    field = path.with_suffix(".field") if load and not is_field(surface) else None
    check_output("output", str(field) if field else None, force=force)
    ExportRequest.validate(**request)

    from asperity.analysis.results.analyze import STEPS, analyze
    from asperity.export.export_surface import export_analysis

    clamp = {"clamp": values["clamp"]} if values["clamp"] is not None else {}
    with step_bar("reading the surface", len(STEPS)) as step:
        texture, device, arguments = options.load_surface(
            surface, device, values, clamp=BACKED.name
        )
        analysis = analyze(texture, device, progress=step, **{**arguments, **clamp})
    request |= {"as_library": shared, "loads_field": load}
    files = export_analysis(analysis, path, target, field, request, force=force)
    click.echo(f"Written: {', '.join(escape_unprintable(file) for file in files)}")
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
    from asperity.report.sentences import map_text

    if normals is None:
        return [map_text.describe_map(sampled), map_text.describe_heights(sampled, suffix)]
    with progress_bar("analyzing law G"):
        shading = map_text.describe_shading(texture, stiffness)
    return [map_text.describe_map(sampled), map_text.describe_normals(sampled, normals), shading]

"""The commands ``surfaces``, ``prepare`` and ``show``."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from asperity.cli import options
from asperity.cli.main import declare_command
from asperity.cli.output import Outputs, check_outputs, output_options, progress_bar
from asperity.core.arguments import MAX_DEPTH
from asperity.core.errors import ParameterError
from asperity.core.files import read_toml
from asperity.laws import SHIPPED_LAW_ARGUMENTS


@declare_command("surfaces")
@click.argument("names", nargs=-1, metavar="[NAME]...")
@options.plugin_option
@output_options()
def surfaces_command(names: tuple[str, ...], outputs: Outputs) -> None:
    """List texture kinds and named surfaces with their arguments, units, defaults and sizes.

    With NAMEs, show details. Other commands accept these names as SURFACE, with arguments after a
    colon: cloth, sandpaper:grit=P60, noise:rms=20um,size=10mm.
    """
    from asperity.report.surface_gallery import find_surfaces, surfaces_page

    surfaces = find_surfaces(names)
    page = surfaces_page(surfaces, detailed=bool(names))
    outputs.write({"schema": 2, "surfaces": surfaces}, page, "Figures")


_STAGE_LABELS = read_toml("stages", Path(__file__).with_name("preparation_stages.toml"))


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
        words = "must be a measured file; this is a surface of the catalogue: asperity surfaces"
        raise ParameterError("file", f"{words} {kind}", name)
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
    from asperity.measured.measured_file import prepare_file
    from asperity.measured.prepared import check_output_path, save_prepared

    check_output_path(Path(output), Path(file))
    check_outputs(force=outputs.force, output=output, json=outputs.json)
    with preparation_progress() as start_stage:
        prepared = prepare_file(file, progress=start_stage, **options.file_values(values))
        start_stage("write")
        save_prepared(output, prepared, file)
    from asperity.report.measured_report import preparation_page

    outputs.write(prepared, preparation_page(prepared, output))


_BAKE = options.command_arguments("bake")


@declare_command("bake")
@click.argument("surface")
@click.option("-o", "--output", metavar="PATH", required=True, help="File to write.")
@click.option("--body", is_flag=True, help="SURFACE is the mesh of a closed body; needs --unit.")
@click.option(
    "--repair", is_flag=True, help="With --body, fill open edges and turn triangles of the mesh."
)
@options.argument_options((*_BAKE, MAX_DEPTH, SHIPPED_LAW_ARGUMENTS["continuity"]))
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
    check_outputs(force=outputs.force, output=output, json=outputs.json)
    with progress_bar("baking the field") as update:
        given = options.provided_values(values, (MAX_DEPTH, SHIPPED_LAW_ARGUMENTS["continuity"]))
        chosen = options.provided_values(values, _BAKE)
        if body:
            chosen |= {"repair": repair, **options.file_values(values)}
            baked = bake_mesh(surface, progress=update, **given, **chosen)
        else:
            texture = load_scene(surface, options.file_values(values)).texture
            baked = bake(Surface(texture, "H", **given), progress=update, **chosen)
        field = save_field(output, baked.texture)
    from asperity.report.measured_report import field_page

    outputs.write(field.describe(), field_page(field, output))


@declare_command("show")
@click.argument("file", callback=_check_file)
@options.plugin_option
@options.file_options
@output_options()
def show_command(file: str, outputs: Outputs, **values: Any) -> None:
    """Report the roughness parameters of the measured surface FILE after each preparation step.

    For maps, the parameters are those of ISO 25178-2 (Sq, Sa, Sz, Sdr ...); for profiles, those of
    ISO 21920-2 (Rq, Ra, Rz ...). The report also shows what each step removed and separates form,
    waviness and texture. FILE may also be an output of asperity prepare.
    """
    from asperity.measured.measured_file import show

    with preparation_progress() as start_stage:
        summary = show(file, progress=start_stage, **options.file_values(values))

    from asperity.report.measured_report import surface_summary_page

    outputs.write(summary, surface_summary_page(summary))

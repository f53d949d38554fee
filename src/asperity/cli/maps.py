"""``asperity maps``: a surface as a picture for other tools."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.arguments import STIFFNESS, Argument
from asperity.cli.options import file_options, file_values, given, options, own_code_option
from asperity.cli.output import check_output
from asperity.cli.progress import progress_bar
from asperity.errors import ParameterError, printable
from asperity.files import whole_file

if TYPE_CHECKING:
    from asperity.export.sampled import SampledMap
    from asperity.textures.texture import Texture

_GRID = (
    Argument(
        "extent", "of the map, one or two for x and y", "m", form="pair", example="10mm; 5mm",
        default_words="one period, or the whole surface",
    ),
    Argument(
        "spacing", "from point to point, one or two for x and y", "m", form="pair",
        example="20um", default_words="the surface's own, or an eighth of its shortest wave",
    ),
)  # fmt: skip


@click.command("maps")
@click.argument("surface")
@click.option(
    "-o", "--output", metavar="PATH", required=True,
    help="The file to write: heights as .png (16 bit), .tif (float) or .x3p; normals as .png.",
)  # fmt: skip
@click.option(
    "--normals", metavar="gltf|chai3d", help="Write normals, in this convention, not heights."
)
@click.option("--force", is_flag=True, help="Replace a file that is there.")
@options((*_GRID, STIFFNESS))
@own_code_option
@file_options
def command(surface: str, output: str, *, normals: str | None, force: bool, **values: Any) -> None:
    """Write SURFACE as a height map or a normal map, and say what that costs.

    Every file holds its physical size. A program that turns the force by a normal map renders law
    G: what is said of it is about that law, at the stiffness that is named.
    """
    from asperity.export.maps import HEIGHT_MAPS, find_convention, normal_png
    from asperity.export.sampled import sample_map
    from asperity.scene import load_scene

    path = Path(output)
    suffix = path.suffix.lower()
    known = [".png"] if normals is not None else list(HEIGHT_MAPS)
    if normals is not None:
        find_convention(normals)
    if suffix not in known:
        raise ParameterError("output", f"must end in {', '.join(known)}", output)
    check_output("output", output)
    if not force and (path.exists() or path.is_symlink()):
        raise ParameterError("output", f"exists: {printable(output)}; --force replaces it")
    with progress_bar("reading the surface"):
        texture = load_scene(surface, file_values(values)).texture
        sampled = sample_map(texture, **given(values, _GRID))
        made = HEIGHT_MAPS[suffix](sampled) if normals is None else normal_png(sampled, normals)
    try:
        with whole_file(path) as stream:
            stream.write(made)
    except OSError as error:
        raise ParameterError("output", f"cannot be written: {error.strerror}", output) from None
    click.echo(f"Written: {printable(output)}")
    stiffness = values["stiffness"]
    for sentence in _said(texture, sampled, suffix, normals, stiffness):
        click.echo(sentence)


def _said(
    texture: Texture, sampled: SampledMap, suffix: str, normals: str | None,
    stiffness: float | None,
) -> list[str]:  # fmt: skip
    from asperity.report.maps import height_words, map_words, normal_words, shading_words

    if normals is None:
        return [map_words(sampled), height_words(sampled, suffix)]
    with progress_bar("what it costs"):
        shading = shading_words(texture, stiffness)
    return [map_words(sampled), normal_words(sampled, normals), shading]

"""``asperity export``: the analysed law as a C program."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.arguments import OWN_STIFFNESS, Argument
from asperity.cli.options import (
    LAW_OPTIONS,
    device_option,
    file_options,
    given,
    law_option,
    law_options,
    options,
    read_surface,
)
from asperity.cli.output import check_output
from asperity.cli.progress import step_bar
from asperity.errors import ParameterError, printable

if TYPE_CHECKING:
    from asperity.devices import Device

_LANG = Argument("lang", "language", default="c99", form="text")
_NAME = Argument("name", "prefix of all names in the program", default="texture", form="text")
_PRECISION = Argument(
    "precision",
    "of real numbers",
    default="double",
    form="text",
    choices=("double", "float"),
)
_LARGEST = Argument(
    "largest", "data that the program may hold", "B", default_words="64 MB", form="size",
    example="512kB",
)  # fmt: skip
_LOOKS = Argument(
    "looks", "looks at the surface that a search may take in a tick",
    default_words="600 for D and E, 1800 for H", form="integer", low=1, example="1000",
)  # fmt: skip
_CLAMP = Argument(
    "clamp",
    "what holds the depth at max_depth",
    default_words="the scene's, or backed",
    form="text",
    choices=("none", "whole", "lateral", "backed"),
)
_EXPORT = (_LANG, _NAME, _PRECISION, _LARGEST, _LOOKS)


@click.command("export")
@click.argument("surface")
@click.option("-o", "--output", metavar="PATH", required=True, help="The file to write, texture.h.")
@click.option("--exact", is_flag=True, help="Search without a limit of looks.")
@click.option("--shared", is_flag=True, help="Write a library: header, source and CMakeLists.txt.")
@click.option("--force", is_flag=True, help="Replace files that are there.")
@options(_EXPORT)
@options((_CLAMP,))
@law_option("Law, by letter or name.  [default: the scene's, or what compare recommends]")
@device_option()
@law_options((OWN_STIFFNESS, *LAW_OPTIONS[1:]))
@file_options
def command(
    surface: str,
    output: str,
    device: Device | None,
    *,
    exact: bool,
    shared: bool,
    force: bool,
    **values: Any,
) -> None:
    """Write SURFACE with its law as a C program: texture_force(), the force that was analysed.

    SURFACE is a texture with its arguments (sinusoid:amplitude=0.8mm,period=1mm), a measured file
    or a scene file (TOML).
    """
    from asperity.export.order import Order
    from asperity.export.targets import find_target
    from asperity.export.writing import check_name, refuse_existing, write_files

    asked = given(values, _EXPORT)
    if exact:
        if "looks" in asked:
            raise ParameterError("exact", "searches without a limit of looks: leave out --looks")
        asked["looks"] = math.inf
    target, place = find_target(asked.pop("lang", "c99")), Path(output)
    check_name(place, target)
    check_output("output", output)
    if not force:
        refuse_existing(place, {place.name: ""})
    names = asked.get("name", "texture"), asked.get("precision", "double")
    Order.check(*names, asked.get("looks"))

    from asperity.analysis.analyze import STEPS, analyze
    from asperity.export.note import note_text

    clamp = {"clamp": values["clamp"]} if values["clamp"] is not None else {}
    with step_bar("reading the surface", len(STEPS)) as step:
        texture, known, arguments = read_surface(surface, device, values, clamp="backed")
        analysis = analyze(texture, known, progress=step, **{**arguments, **clamp})
    note = note_text(analysis, place.name)
    upper = analysis.q.upper
    order = Order(analysis.surface, note=note, q_upper=upper, shared=shared, **asked)
    files = write_files(place, target, order, force=force)
    click.echo(f"Written: {', '.join(printable(file) for file in files)}")
    sources = [file.name for file in files if file.name.endswith("_data.c")]
    if sources:
        click.echo(f"To be compiled with the program: {printable(sources[0])}")
    click.echo(f"{order.name}_force() is law {analysis.surface.law}. {analysis.answer}")

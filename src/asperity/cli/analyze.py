"""``asperity analyze``: every number of one law, with its pedigree."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import click

from asperity.arguments import OWN_STIFFNESS, Argument
from asperity.cli.options import (
    LAW_OPTIONS,
    device_option,
    file_options,
    file_values,
    given,
    law_option,
    law_options,
    options,
    read_surface,
)
from asperity.cli.output import Outputs, output_options
from asperity.cli.progress import step_bar

if TYPE_CHECKING:
    from asperity.devices import Device
    from asperity.textures import Texture

_SEARCH = (
    Argument(
        "tolerance",
        "relative gap of the bounds",
        default_words="1e-6 for waves, 1e-3 for maps",
        positive=True,
        example="1e-4",
    ),
    Argument(
        "work_limit",
        "greatest number of cells to look at for a number",
        default=20_000_000,
        form="integer",
        low=1,
    ),
    Argument(
        "direction",
        "of the worst loop's vertical plane: x, y, or '1,0.5'",
        default_words="scan line",
        form="direction",
    ),
    Argument(
        "extent",
        "part of the plane that counts, for sums of waves",
        "m",
        form="pair",
        positive=True,
        example="10mm; 5mm",
    ),
)


def _checked(argument: Argument) -> Callable[[str], Any]:
    """Read a value of the search: a wrong one should not cost the reading of a map."""

    def read(text: str) -> Any:
        value = argument.read(text)
        if argument.form == "direction":
            return value
        value = argument.checked(value)
        one_side = argument.form == "pair" and isinstance(value, float)
        return (value, value) if one_side else value

    return read


@click.command("analyze")
@click.argument("surface")
@law_option("Law, by letter or name.  [default: the scene's, or what compare recommends]")
@device_option()
@law_options((OWN_STIFFNESS, *LAW_OPTIONS[1:]))
@options(_SEARCH, _checked)
@file_options
@output_options("Write a report with pictures; - is standard output.")
def command(surface: str, device: Device | None, outputs: Outputs, **values: Any) -> None:
    """Say all that is known of one law on SURFACE and a device, each number with its pedigree.

    SURFACE is a texture with its arguments (sinusoid:amplitude=0.8mm,period=1mm), a measured file
    or a scene file (TOML).
    """
    from asperity.analysis.analyze import STEPS, analyze

    with step_bar("reading the surface", len(STEPS)) as step:
        texture, known, arguments = read_surface(surface, device, values)
        result = analyze(texture, known, progress=step, **given(values, _SEARCH), **arguments)
    code = _texture_code(surface, file_values(values), texture)

    from asperity.report.analysis import analysis_page, print_analysis

    outputs.write(
        result,
        lambda console: print_analysis(result, console, code),
        lambda: analysis_page(result, code),
    )


def _texture_code(source: str, for_file: Mapping[str, Any], texture: Texture) -> str:
    """Return an expression that makes the texture; empty if its own ``repr`` does."""
    if not repr(texture).startswith("<"):
        return ""
    if source.lower().endswith(".toml") or not os.path.exists(source):
        extra = f", {dict(for_file)!r}" if for_file else ""
        return f"load_scene({source!r}{extra}).texture"
    arguments = [repr(source), *[f"{name}={value!r}" for name, value in for_file.items()]]
    return f"asp.load_texture({', '.join(arguments)})"

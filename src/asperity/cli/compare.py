"""``asperity compare``: the main job."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import (
    device_option,
    file_options,
    law_options,
    laws_option,
    read_surface,
)
from asperity.cli.output import Outputs, output_options
from asperity.cli.progress import step_bar
from asperity.laws import KNOWN_LAWS

if TYPE_CHECKING:
    from asperity.devices import Device
    from asperity.laws import Law


@click.command("compare")
@click.argument("surface")
@device_option()
@laws_option("Laws to compare, 'WAC' or names with commas.  [default: all]")
@law_options()
@file_options
@output_options("Write a report with pictures; - is standard output.")
def command(
    surface: str,
    device: Device | None,
    laws: tuple[Law, ...] | None,
    outputs: Outputs,
    **values: Any,
) -> None:
    """Say which law renders SURFACE on a device, at which stiffness, and what will go wrong.

    SURFACE is a texture with its arguments (sinusoid:amplitude=0.8mm,period=1mm), a measured file
    (X3P, NPY, text matrix, two-column profile) or a scene file (TOML).
    """
    from asperity.analysis.compare import compare

    chosen = laws or tuple(KNOWN_LAWS.values())
    with step_bar("reading the surface", len(chosen)) as step:
        texture, known, arguments = read_surface(surface, device, values, chosen)
        arguments.pop("law", None)  # a scene names the law to run; here all are compared
        result = compare(
            texture, known, chosen, progress=lambda law: step(f"law {law}"), **arguments
        )
    from asperity.report.comparison import comparison_page, print_comparison

    outputs.write(result, lambda to: print_comparison(result, to), lambda: comparison_page(result))

"""``asperity surfaces``: which surfaces there are, what they take, how they look."""

from __future__ import annotations

import click

from asperity.cli.options import own_code_option
from asperity.cli.output import Outputs, output_options


@click.command("surfaces")
@click.argument("names", nargs=-1, metavar="[NAME]...")
@own_code_option
@output_options(
    "Write a page with a picture of each; - is standard output.",
    "Write the list as JSON; - is standard output.",
)
def command(names: tuple[str, ...], outputs: Outputs) -> None:
    """List kinds of textures and named surfaces: arguments, units, defaults, size and height.

    Given NAMEs, says more about those. Use them as SURFACE in other commands, with arguments or
    without: cloth or sandpaper:grit=P60 or noise:rms=20um,size=10mm
    """
    from asperity.report.surfaces import listed_surfaces, print_surfaces, surfaces_page

    listed = listed_surfaces(names)
    outputs.write(
        {"schema": 1, "surfaces": listed},
        lambda console: print_surfaces(listed, console, in_detail=bool(names)),
        lambda: surfaces_page(listed),
        "Pictures",
    )

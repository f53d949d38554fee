"""``asperity show``: a measured surface in the words of metrology."""

from __future__ import annotations

from typing import Any

import click

from asperity.cli.options import file_options, file_values
from asperity.cli.output import Outputs, output_options
from asperity.cli.prepare import preparing


@click.command("show")
@click.argument("file")
@file_options
@output_options("Write a page with maps before and after each step; - is standard output.")
def command(file: str, outputs: Outputs, **values: Any) -> None:
    """Say the measured surface FILE in numbers: as read, and after each step of its preparation.

    Maps in parameters of ISO 25178-2 (Sq, Sa, Sz, Sdr ...), profiles in those of ISO 21920-2 (Rq,
    Ra, Rz ...), with what each step took away, and how much of the surface is form, waviness and
    texture. FILE may also be one that asperity prepare has written.
    """
    from asperity.textures.shown import show_file

    with preparing() as begin:
        shown = show_file(file, progress=begin, **file_values(values))

    from asperity.report.show import print_shown, shown_page

    outputs.write(shown, lambda to: print_shown(shown, to), lambda: shown_page(shown))

"""``asperity compare``: the main job."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from asperity.arguments import MAX_DEPTH, OWN_STIFFNESS, SPEED
from asperity.cli.options import (
    LAW_OPTIONS,
    device_option,
    file_options,
    given,
    jobs_option,
    law_options,
    laws_option,
    options,
    read_devices,
    read_surface,
)
from asperity.cli.output import Outputs, output_options
from asperity.cli.progress import step_bar
from asperity.errors import ParameterError
from asperity.laws import KNOWN_LAWS

if TYPE_CHECKING:
    from asperity.analysis.several import Comparisons
    from asperity.devices import Device
    from asperity.laws import Law

_DEPTHS = replace(MAX_DEPTH, form="items", example="0.1mm; 0.5mm")


@click.command("compare")
@click.argument("surface")
@device_option(
    "Devices of the catalogue, or TOML files, 'touch,mine.toml'.  [default: omega.3]", read_devices
)
@options([SPEED])
@laws_option("Laws to compare, 'WAC' or names with commas.  [default: all]")
@law_options((OWN_STIFFNESS, _DEPTHS, *LAW_OPTIONS[2:]))
@file_options
@click.option("--full", is_flag=True, help="Show q, q⁺, limits, leaks, T and S of every law.")
@jobs_option
@output_options("Write a report with pictures; - is standard output.")
def command(
    surface: str,
    device: tuple[Device, ...] | None,
    laws: tuple[Law, ...] | None,
    full: bool,
    outputs: Outputs,
    **values: Any,
) -> None:
    """Say which law renders SURFACE on a device, at which stiffness, and what will go wrong.

    SURFACE is a texture with its arguments (sinusoid:amplitude=0.8mm,period=1mm), a measured file
    (X3P, NPY, text matrix, two-column profile) or a scene file (TOML). Several devices and depths
    are answered in one table.
    """
    from asperity.analysis.several import compare_several

    chosen = laws or tuple(KNOWN_LAWS.values())
    first, *others = device or (None,)
    cases = (1 + len(others)) * len(values["max_depth"] or [None])
    with step_bar("reading the surface", len(chosen) * cases) as step:
        texture, known, arguments = read_surface(surface, first, values, chosen)
        arguments.pop("law", None)  # a scene names the law to run; here all are compared
        depths = arguments.pop("max_depth", None)  # of a scene it is one
        found = compare_several(
            texture,
            [known, *(values["settings"].changed(other) for other in others if other)],
            [depths] if isinstance(depths, float) else depths,
            chosen,
            progress=lambda on, _depth, law: step(f"{on.id}, law {law}"),
            **given(values, [SPEED]),
            **arguments,
        )
    _write(found, outputs, full)


def _write(found: Comparisons, outputs: Outputs, full: bool) -> None:
    """Write the one comparison that was asked for, or the table of several.

    Raises:
        ParameterError: if of no device enough is known, once the table has said what to add.
    """
    if len(found.comparisons) == 1 and not found.lacking:
        from asperity.report.comparison import comparison_page, print_comparison

        one = found.comparisons[0]
        outputs.write(
            one, lambda to: print_comparison(one, to, full), lambda: comparison_page(one),
            keeps_pictures=True,
        )  # fmt: skip
        return
    from asperity.report.several import comparisons_page, print_comparisons

    if found.comparisons or len(found.lacking) > 1:
        outputs.write(
            found, lambda to: print_comparisons(found, to), lambda: comparisons_page(found)
        )
    if not found.comparisons:
        said = "; ".join(one.sentence for one in found.lacking)
        raise ParameterError("device", f"is not known well enough to compare laws: {said}")

"""``asperity limits``: will I feel it?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from asperity.arguments import OWN_STIFFNESS, SPEED, Argument
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
from asperity.cli.output import Outputs, output_options
from asperity.cli.progress import step_bar

if TYPE_CHECKING:
    from asperity.devices import Device

# Samples that a wave, or an amplitude, needs: the paper says 5 to 10.
_SAMPLES = (
    Argument("time_samples", "updates that a wave needs, α", default=5.0),
    Argument("position_samples", "position steps that a wave needs, β", default=5.0),
    Argument("force_steps", "steps of force that an amplitude needs, γ", default=5.0),
)


@click.command("limits")
@click.argument("surface")
@device_option()
@options([SPEED])
@law_option("Law, by letter or name.  [default: the one that compare recommends]")
@options(_SAMPLES)
@law_options((OWN_STIFFNESS, *LAW_OPTIONS[1:]))
@file_options
@output_options("Write a report with a picture; - is standard output.")
def command(surface: str, device: Device | None, outputs: Outputs, **values: Any) -> None:
    """Say whether SURFACE can be felt on a device, wave by wave, and how fast it may be scanned.

    SURFACE is a texture with its arguments (sinusoid:amplitude=0.8mm,period=1mm), a measured file
    or a scene file (TOML).
    """
    from asperity.analysis.check_limits import limits

    with step_bar("reading the surface", 2) as step:
        step("reading the surface")
        texture, known, arguments = read_surface(surface, device, values)
        step("wave by wave")
        result = limits(texture, known, **given(values, (SPEED, *_SAMPLES)), **arguments)

    from asperity.report.limits import limits_page, print_limits

    outputs.write(result, lambda to: print_limits(result, to), lambda: limits_page(result))

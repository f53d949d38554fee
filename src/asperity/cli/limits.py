"""``asperity limits``: will I feel it?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import FILE_OPTIONS, LAW_OPTIONS, given, text_options
from asperity.cli.output import STANDARD_OUTPUT, check_outputs, write_output
from asperity.files import json_text

if TYPE_CHECKING:
    from asperity.analysis.limits.limit_result import Limits

_STIFFNESS = (
    "--stiffness",
    "Stiffness, '500N/m'.  [default: what the device renders of the law, K₀/q]",
)
_LAW_OPTIONS = (_STIFFNESS, *(option for option in LAW_OPTIONS if option[0] != "--stiffness"))

# Samples that a wave, or an amplitude, needs: the paper says 5 to 10.
_SAMPLE_OPTIONS = (
    ("--time-samples", "Updates that a wave needs, α.  [default: 5]"),
    ("--position-samples", "Position steps that a wave needs, β.  [default: 5]"),
    ("--force-steps", "Steps of force that an amplitude needs, γ.  [default: 5]"),
)


@click.command("limits", short_help="Say whether a texture can be felt on a device.")
@click.argument("surface")
@click.option(
    "--device",
    metavar="ID|FILE",
    help="Device of the catalogue, or a TOML file.  [default: omega.3]",
)
@click.option("--speed", metavar="TEXT", help="Scanning speed, '0.1m/s'.  [default: 0.1 m/s]")
@click.option("--law", metavar="LETTER", help="Law, by letter or name.  [default: C]")
@text_options(_SAMPLE_OPTIONS)
@text_options(_LAW_OPTIONS)
@text_options(FILE_OPTIONS)
@click.option(
    "--json", "json_path", metavar="PATH", help="Write the result as JSON; - is standard output."
)
@click.option(
    "--html",
    "html_path",
    metavar="PATH",
    help="Write a report with a picture; - is standard output.",
)
def limits_command(
    surface: str,
    device: str | None,
    speed: str | None,
    law: str | None,
    json_path: str | None,
    html_path: str | None,
    **values: Any,
) -> None:
    """Say whether SURFACE can be felt on a device, wave by wave, and how fast it may be scanned.

    SURFACE is a texture with its arguments (sinusoid:amplitude=0.8mm,period=1mm), a measured file
    or a scene file (TOML).
    """
    check_outputs(json=json_path, html=html_path)
    result = _limits(surface, device, speed, law, values)
    if json_path is not None:
        write_output("json", json_path, json_text(result))
    if html_path is not None:
        from asperity.report.limits_html import limits_html

        write_output("html", html_path, limits_html(result))
    if STANDARD_OUTPUT not in {json_path, html_path}:
        _print(result, html_path)


def _limits(
    surface: str,
    device: str | None,
    speed: str | None,
    law: str | None,
    values: dict[str, Any],
) -> Limits:
    """Return the limits that the arguments ask for."""
    from asperity.analysis.limits.device_limits import DEFAULT_DEVICE, limits
    from asperity.devices import load_device
    from asperity.laws import find_law
    from asperity.scene import FILE_ARGUMENTS, SURFACE_ARGUMENTS, load_scene
    from asperity.units import quantity

    # Cheap arguments first: a misspelt device should not cost the reading of a map.
    known = None if device is None else load_device(device)
    arguments: dict[str, Any] = {} if law is None else {"law": find_law(law)}
    if speed is not None:
        arguments["speed"] = quantity("speed", speed, "m/s")
    for name, text in given(values, _SAMPLE_OPTIONS).items():
        arguments[name] = quantity(name, text, "")
    for name, text in given(values, _LAW_OPTIONS).items():
        arguments[name] = SURFACE_ARGUMENTS[name](name, text)
    for_file = {
        name: FILE_ARGUMENTS[name](name, text) for name, text in given(values, FILE_OPTIONS).items()
    }
    scene = load_scene(surface, for_file)
    chosen = known or scene.device or load_device(DEFAULT_DEVICE)
    return limits(scene.texture, chosen, **{**scene.surface, **arguments})


def _print(result: Limits, html_path: str | None) -> None:
    from rich.console import Console

    from asperity.report.limits_table import print_limits

    console = Console(highlight=False)
    print_limits(result, console)
    if html_path is not None:
        console.print(f"Report: {html_path}", soft_wrap=True, markup=False)

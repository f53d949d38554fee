"""``asperity compare``: the main job."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import FILE_OPTIONS, LAW_OPTIONS, given, text_options
from asperity.cli.output import STANDARD_OUTPUT, check_outputs, write_output
from asperity.files import json_text

if TYPE_CHECKING:
    from asperity.analysis import Comparison


@click.command("compare", short_help="Compare the laws on a surface and a device.")
@click.argument("surface")
@click.option(
    "--device",
    metavar="ID|FILE",
    help="Device of the catalogue, or a TOML file.  [default: omega.3]",
)
@click.option(
    "--laws", metavar="LETTERS", help="Laws to compare, 'WAC' or names with commas.  [default: all]"
)
@text_options(LAW_OPTIONS)
@text_options(FILE_OPTIONS)
@click.option(
    "--json", "json_path", metavar="PATH", help="Write the result as JSON; - is standard output."
)
@click.option(
    "--html",
    "html_path",
    metavar="PATH",
    help="Write a report with pictures; - is standard output.",
)
def compare_command(
    surface: str,
    device: str | None,
    laws: str | None,
    json_path: str | None,
    html_path: str | None,
    **values: Any,
) -> None:
    """Say which law renders SURFACE on a device, at which stiffness, and what will go wrong.

    SURFACE is a texture with its arguments (sinusoid:amplitude=0.8mm,period=1mm), a measured file
    (X3P, NPY, text matrix, two-column profile) or a scene file (TOML).
    """
    check_outputs(json=json_path, html=html_path)
    result = _compare(surface, device, laws, values)
    if json_path is not None:
        write_output("json", json_path, json_text(result))
    if html_path is not None:
        from asperity.report import html_text

        write_output("html", html_path, html_text(result))
    if STANDARD_OUTPUT not in {json_path, html_path}:
        _print(result, html_path)


def _compare(
    surface: str, device: str | None, laws: str | None, values: dict[str, Any]
) -> Comparison:
    """Return the comparison that the arguments ask for."""
    from asperity.analysis.compare import ALL_LAWS, DEFAULT_DEVICE, compare
    from asperity.devices import load_device
    from asperity.laws import find_laws
    from asperity.scene import FILE_ARGUMENTS, SURFACE_ARGUMENTS, load_scene

    # Cheap arguments first: a misspelt device should not cost the reading of a map.
    chosen = find_laws(ALL_LAWS if laws is None else laws)
    known = None if device is None else load_device(device)
    for_law = {
        name: SURFACE_ARGUMENTS[name](name, text)
        for name, text in given(values, LAW_OPTIONS).items()
    }
    for_file = {
        name: FILE_ARGUMENTS[name](name, text) for name, text in given(values, FILE_OPTIONS).items()
    }
    with _progress(len(chosen)) as step:
        scene = load_scene(surface, for_file)
        arguments = {**scene.surface, **for_law}
        arguments.pop("law", None)  # a scene names the law to run; here all are compared
        chosen_device = known or scene.device or load_device(DEFAULT_DEVICE)
        return compare(scene.texture, chosen_device, chosen, progress=step, **arguments)


@contextmanager
def _progress(count: int) -> Iterator[Callable[[str], None]]:
    """Show a progress bar on standard error if it is a terminal."""
    if not sys.stderr.isatty():
        yield lambda _letter: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed}/{task.total}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("reading the surface", total=count, completed=-1)

        def step(letter: str) -> None:
            bar.update(task, description=f"law {letter}", advance=1)

        yield step


def _print(result: Comparison, html_path: str | None) -> None:
    from rich.console import Console

    from asperity.report import print_comparison

    console = Console()
    print_comparison(result, console)
    if html_path is not None:
        console.print(f"Report: {html_path}", soft_wrap=True, markup=False)

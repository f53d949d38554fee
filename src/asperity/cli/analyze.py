"""``asperity analyze``: every number of one law, with its pedigree."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import FILE_OPTIONS, LAW_OPTIONS, given, text_options
from asperity.cli.output import STANDARD_OUTPUT, check_outputs, write_output
from asperity.errors import ParameterError
from asperity.files import json_text

if TYPE_CHECKING:
    from asperity.analysis.analyze import Analysis
    from asperity.textures import Texture

_SEARCH_OPTIONS = (
    (
        "--tolerance",
        "Relative gap of the bounds, '1e-4'.  [default: 1e-6 for waves, 1e-3 for maps]",
    ),
    ("--work-limit", "Greatest number of cells to look at for a number.  [default: 20000000]"),
    ("--direction", "Of the worst loop's vertical plane: x, y, or '1,0.5'.  [default: scan line]"),
    ("--extent", "Part of the plane that counts, for sums of waves: '10mm; 5mm'."),
)


@dataclass(frozen=True)
class Answer:
    """The analysis, and how to make its texture in Python."""

    result: Analysis
    texture: str


@click.command("analyze", short_help="Say all that is known of one law on a surface and a device.")
@click.argument("surface")
@click.option(
    "--law", metavar="LETTER", help="Law, by letter or name; needed unless a scene names it."
)
@click.option(
    "--device",
    metavar="ID|FILE",
    help="Device of the catalogue, or a TOML file.  [default: omega.3]",
)
@text_options(LAW_OPTIONS)
@text_options(_SEARCH_OPTIONS)
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
def analyze_command(
    surface: str,
    law: str | None,
    device: str | None,
    json_path: str | None,
    html_path: str | None,
    **values: Any,
) -> None:
    """Say all that is known of one law on SURFACE and a device, each number with its pedigree.

    SURFACE is a texture with its arguments (sinusoid:amplitude=0.8mm,period=1mm), a measured file
    or a scene file (TOML).
    """
    check_outputs(json=json_path, html=html_path)
    answer = _analyze(surface, law, device, values)
    if json_path is not None:
        write_output("json", json_path, json_text(answer.result))
    if html_path is not None:
        from asperity.report.analysis_html import analysis_html

        write_output("html", html_path, analysis_html(answer.result, answer.texture))
    if STANDARD_OUTPUT not in {json_path, html_path}:
        _print(answer, html_path)


def _analyze(surface: str, law: str | None, device: str | None, values: dict[str, Any]) -> Answer:
    """Return the analysis that the arguments ask for."""
    from asperity.analysis.analyze import STEPS, analyze
    from asperity.analysis.compare import DEFAULT_DEVICE
    from asperity.devices import load_device
    from asperity.laws import find_law
    from asperity.scene import FILE_ARGUMENTS, SURFACE_ARGUMENTS, load_scene
    from asperity.surface import Surface

    # Cheap arguments first: a misspelt device should not cost the reading of a map.
    known = None if device is None else load_device(device)
    arguments: dict[str, Any] = {} if law is None else {"law": find_law(law)}
    for name, text in given(values, LAW_OPTIONS).items():
        arguments[name] = SURFACE_ARGUMENTS[name](name, text)
    search = {name: _READERS[name](text) for name, text in given(values, _SEARCH_OPTIONS).items()}
    for_file = {
        name: FILE_ARGUMENTS[name](name, text) for name, text in given(values, FILE_OPTIONS).items()
    }
    with _progress(len(STEPS)) as step:
        scene = load_scene(surface, for_file)
        merged = {**scene.surface, **arguments}
        if "law" not in merged:
            raise ParameterError("law", "is missing: --law B, or a scene whose [surface] names one")
        chosen = known or scene.device or load_device(DEFAULT_DEVICE)
        result = analyze(Surface(scene.texture, **merged), chosen, progress=step, **search)
    return Answer(result, _texture_code(surface, for_file, scene.texture))


def _texture_code(source: str, for_file: Mapping[str, Any], texture: Texture) -> str:
    """Return an expression that makes the texture; empty if its own ``repr`` does."""
    if not repr(texture).startswith("<"):
        return ""
    if source.lower().endswith(".toml"):
        extra = f", {dict(for_file)!r}" if for_file else ""
        return f"load_scene({source!r}{extra}).texture"
    arguments = [repr(source), *[f"{name}={value!r}" for name, value in for_file.items()]]
    return f"asp.load_texture({', '.join(arguments)})"


def _read_tolerance(text: str) -> float:
    from asperity.checks import positive
    from asperity.units import quantity

    return positive("tolerance", quantity("tolerance", text, ""))


def _read_work_limit(text: str) -> int:
    from asperity.units import quantity

    number = quantity("work_limit", text, "")
    if number < 1.0 or number != round(number):
        raise ParameterError("work_limit", "must be a whole number, at least 1", text)
    return round(number)


def _read_direction(text: str) -> tuple[float, float]:
    from asperity.units import quantity

    axes = {"x": (1.0, 0.0), "y": (0.0, 1.0)}
    if text.strip().lower() in axes:
        return axes[text.strip().lower()]
    parts = text.replace(",", " ").split()
    if len(parts) != 2:
        raise ParameterError("direction", "must be x, y, or two numbers '1,0.5'", text)
    x, y = (quantity("direction", part, "") for part in parts)
    if x == y == 0.0:
        raise ParameterError("direction", "must have a length", text)
    return x, y


def _read_extent(text: str) -> tuple[float, float]:
    from asperity.checks import positive
    from asperity.units import quantity

    parts = [part for part in text.split(";") if part.strip()]
    if len(parts) not in {1, 2}:
        raise ParameterError("extent", "must be one length, or width and depth: '10mm; 5mm'", text)
    sides = [positive("extent", quantity("extent", part, "m"), "m") for part in parts]
    return sides[0], sides[-1]


_READERS: dict[str, Callable[[str], Any]] = {
    "tolerance": _read_tolerance,
    "work_limit": _read_work_limit,
    "direction": _read_direction,
    "extent": _read_extent,
}


@contextmanager
def _progress(count: int) -> Iterator[Callable[[str], None]]:
    """Show a progress bar on standard error if it is a terminal."""
    if not sys.stderr.isatty():
        yield lambda _step: None
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

        def step(name: str) -> None:
            bar.update(task, description=name, advance=1)

        yield step


def _print(answer: Answer, html_path: str | None) -> None:
    from rich.console import Console

    from asperity.report.analysis_table import print_analysis

    console = Console(highlight=False)
    print_analysis(answer.result, console, answer.texture)
    if html_path is not None:
        console.print(f"Report: {html_path}", soft_wrap=True, markup=False)

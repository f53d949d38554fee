"""The command ``certify``."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli import options
from asperity.cli.main import declare_command
from asperity.cli.output import Outputs, output_options, progress_bar, write_output
from asperity.core.errors import ParameterError
from asperity.core.files import check_output, json_text
from asperity.core.units import parse_quantity

if TYPE_CHECKING:
    from asperity.certification.certify import Certification
    from asperity.certification.region import RendererCalls

_ARGUMENTS = options.command_arguments("certify")
_RECORDINGS = (".mcap", ".csv")


@declare_command("certify")
@click.argument("renderers", metavar="RENDERER", nargs=-1)
@options.argument_options(_ARGUMENTS)
@output_options(uses_cache=False)
def certify_command(renderers: tuple[str, ...], outputs: Outputs, **values: Any) -> None:
    """Measure gain, worst loop, jumps and dependence on history of RENDERER by search.

    RENDERER is a shared library (texture.so), a function in a file (mine.py:force), or one or two
    recordings of a loop (run.mcap, or a CSV file with units in its headings). With --pipe it is a
    program that answers a position in a line with a force in a line.

    Everything found is a lower bound with a witness; nothing is proved.
    """
    if values["pipe"] is None and renderers and renderers[0].lower().endswith(_RECORDINGS):
        _certify_recordings(renderers, outputs)
        return
    if len(renderers) != (values["pipe"] is None):
        raise ParameterError("renderer", "must be one: a library, file.py:function, or --pipe")
    from asperity.certification.certify import open_calls, open_renderer, search_renderer

    source = _find_source(renderers, values)
    with open_renderer(source) as renderer, progress_bar("searching") as update:
        if values["replay"] is not None:
            _replay(renderer, values["replay"], outputs)
            return
        calls = open_calls(renderer, _parse_region(values["region"]))
        search = options.provided_values(values, _ARGUMENTS)
        chosen = {name: search[name] for name in ("seconds", "seed") if name in search}
        result = search_renderer(calls, progress=update, **chosen)
        _write_witnesses(calls, result, values, force=outputs.force)
        difference = _handle_baseline(calls, result, values)
    from asperity.devices import load_device
    from asperity.report.pages.certification_report import certification_page

    device = None if values["device"] is None else load_device(values["device"])
    outputs.write(result, certification_page(result, device, difference))
    if difference is not None:
        sys.exit(1)


def _find_source(renderers: tuple[str, ...], values: Mapping[str, Any]) -> Any:
    """Return the source of the renderer."""
    from asperity.certification.certify import parse_source
    from asperity.certification.renderers import RendererSource

    unit = values["unit"] or "m"
    rate = values["rate"] or 0.0
    text = values["text"] or ""
    if values["pipe"] is not None:
        return RendererSource("pipe", values["pipe"], unit=unit, rate=rate)
    return parse_source(renderers[0], name=values["name"], text=text, unit=unit, rate=rate)


def _parse_region(text: str | None) -> Any:
    """Return the three ranges [m] of a text such as ``-1mm:1mm,-1mm:1mm,-1mm:0mm``."""
    if text is None:
        return None
    ranges = [part.split(":") for part in text.split(",")]
    if len(ranges) != 3 or any(len(ends) != 2 for ends in ranges):
        raise ParameterError("region", "must be three ranges, such as -1mm:1mm,-1mm:1mm,-1mm:0mm")
    return [[parse_quantity("region", end, "m") for end in ends] for ends in ranges]


def _write_witnesses(
    calls: RendererCalls, result: Certification, values: Mapping[str, Any], *, force: bool
) -> None:
    from asperity.certification import witnesses

    path = values["witness"]
    if path is not None:
        check_output("witness", path, force=force)
        found = witnesses.walk(calls, witnesses.witness_paths(result))
        write_output("witness", path, witnesses.witness_text(found))


def _handle_baseline(calls: RendererCalls, result: Certification, values: Mapping[str, Any]) -> Any:
    """Write a baseline that does not exist; return the first difference from one that does."""
    from asperity.certification import witnesses

    path = values["baseline"]
    if path is None:
        return None
    if not Path(path).exists():
        write_output("baseline", path, json_text(witnesses.make_baseline(calls, result)))
        return None
    tolerance = values["tolerance"]
    if tolerance is None:
        tolerance = 1e-6 * result.largest_force
    return witnesses.compare_baseline(calls, result, path, tolerance)


def _replay(renderer: Any, path: str, outputs: Outputs) -> None:
    from asperity.certification import witnesses
    from asperity.certification.certify import open_calls
    from asperity.report.pages.certification_report import replay_page

    recorded = witnesses.read_witnesses(path)
    calls = open_calls(renderer, ((-1.0, 1.0),) * 3)
    replayed = witnesses.walk(calls, {witness.name: witness.path for witness in recorded})
    rows = []
    for old, new in zip(recorded, replayed, strict=True):
        rows.append({"witness": old.name, "recorded": old.value, "replayed": new.value})
    outputs.write({"schema": 1, "witnesses": rows}, replay_page(rows))


def _certify_recordings(paths: tuple[str, ...], outputs: Outputs) -> None:
    from asperity.certification.recorded_loop import certify_recording, read_samples
    from asperity.report.pages.certification_report import recordings_page

    results = [certify_recording(read_samples(path)) for path in paths]
    outputs.write({"schema": 1, "recordings": results}, recordings_page(results))

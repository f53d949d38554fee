"""The command ``reproduce``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli import options
from asperity.cli.main import declare_command
from asperity.cli.output import Outputs, check_outputs, output_options, progress_bar, step_bar
from asperity.core.errors import ParameterError, escape_unprintable

if TYPE_CHECKING:
    from asperity.paper import Result
    from asperity.paper.experiments import Experiments
    from asperity.report.paper.paper_figures import FileFormat, PaperFigure
    from asperity.textures import Texture

# Fraction of the progress bar for the claims; the rest is for the experiments.
_CLAIMS_FRACTION = 0.35
(_FORMAT,) = options.command_arguments("reproduce")


@declare_command("reproduce")
@click.option(
    "--claim",
    "names",
    metavar="ID",
    multiple=True,
    help="Report only this claim, or all claims of a figure such as fig-3, with evidence; may be"
    " repeated.",
)
@click.option(
    "--skip-experiments", is_flag=True, help="Skip the simulated experiments, which take long."
)
@click.option(
    "--surface",
    metavar="SURFACE",
    help="Surface on which the last experiment is repeated.  [default: a knurl]",
)
@click.option(
    "--figures",
    "folder",
    metavar="DIR",
    help="Write the figures, or those of the given claims, to this folder.",
)
@options.argument_options([_FORMAT], lambda one: lambda text: one.validate(one.parse(text)))
@options.plugin_option
@options.file_options
@options.jobs_option
@output_options()
def reproduce_command(
    names: tuple[str, ...],
    skip_experiments: bool,
    surface: str | None,
    folder: str | None,
    outputs: Outputs,
    **values: Any,
) -> None:
    """Report which claims of the paper hold, with their evidence, and repeat its experiments.

    Each claim is a function that computes its evidence; the verdict is derived from the computed
    numbers. Without --claim, all claims are listed with their IDs.
    """
    from asperity.paper.claim_registry import find_claims

    for name in names:
        find_claims(name)  # an unknown name is refused before the computation
    measured = _load_measured_texture(surface, values)
    figures: tuple[PaperFigure, ...] = ()
    if folder is not None:
        from asperity.report.paper.paper_figures import create_folder, find_figures

        figures = find_figures(names, include_simulated=not skip_experiments)
        create_folder(folder)
        # The folder may be one of the files.
        check_outputs(force=outputs.force, json=outputs.json, html=outputs.html)
    elif values["format"] is not None:
        raise ParameterError(_FORMAT.name, "applies to figures: give --figures DIR")
    simulates = not (names or skip_experiments)
    results, experiments = _reproduce(names or None, measured, with_experiments=simulates)
    from asperity.report.paper.claims_report import claims_page, evidence_page

    written = ""
    if folder is not None:
        from asperity.report.paper.paper_figures import write_figures

        file_format: FileFormat = values["format"] or "svg"
        with step_bar("drawing the figures", len(figures)) as step:
            paths = write_figures(figures, Path(folder), file_format, experiments, step)
        names_text = ", ".join(path.name for path in paths)
        written = f"Figures in {escape_unprintable(folder)}: {names_text}"

    page = evidence_page(results) if names else claims_page(results, experiments)
    data = {"schema": 1, "claims": results, "experiments": experiments}
    outputs.write(data, page, extra_line=written)


def _load_measured_texture(surface: str | None, values: dict[str, Any]) -> Texture | None:
    from asperity.scene import load_scene

    file_options = options.file_values(values)
    if surface is not None:
        return load_scene(surface, file_options).texture
    for name in file_options:
        raise ParameterError(name, "applies to a measured surface: give --surface")
    return None


def _reproduce(
    names: Sequence[str] | None, measured: Texture | None, *, with_experiments: bool
) -> tuple[tuple[Result, ...], Experiments | None]:
    from asperity.paper import reproduce_claims

    share = _CLAIMS_FRACTION if with_experiments else 1.0
    with progress_bar("computing claims") as update:
        results = reproduce_claims(
            names, progress=lambda _result, done, total: update(share * done / total)
        )
        if not with_experiments:
            return results, None
        from asperity.paper.experiments import run_experiments
        from asperity.paper.experiments.experiment_suite import STEPS

        def step(name: str) -> None:
            update(share + (1.0 - share) * STEPS.index(name) / len(STEPS))

        return results, run_experiments(measured, progress=step)

"""``asperity reproduce``: the paper, claim by claim."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.arguments import Argument
from asperity.cli.options import (
    file_options,
    file_values,
    jobs_option,
    options,
    own_code_option,
)
from asperity.cli.output import Outputs, check_outputs, output_options
from asperity.cli.progress import progress_bar, step_bar
from asperity.errors import ParameterError, printable

if TYPE_CHECKING:
    from rich.console import Console

    from asperity.paper import Result
    from asperity.paper.experiments import Experiments
    from asperity.report.paper_figures import Drawing, Ending
    from asperity.textures import Texture

# Share of the progress bar that the claims take; the rest is the experiments'.
_CLAIMS = 0.35
_FORMAT = Argument(
    "format", "of the figures: svg or png", default="svg", form="text", choices=("svg", "png")
)


@click.command("reproduce")
@click.option(
    "--claim",
    "names",
    metavar="ID",
    multiple=True,
    help="Only this claim, or those of fig-3, with evidence.",
)
@click.option("--skip-experiments", is_flag=True, help="Leave out what is simulated at length.")
@click.option(
    "--surface", metavar="SURFACE", help="Of the last experiment, instead of a drawn knurl."
)
@click.option(
    "--figures",
    "folder",
    metavar="DIR",
    help="Write every figure to a file of its own, of the claims that are named.",
)
@options([_FORMAT], lambda argument: lambda text: argument.checked(argument.read(text)))
@own_code_option
@file_options
@jobs_option
@output_options("Write a report; - is standard output.")
def command(
    names: tuple[str, ...],
    skip_experiments: bool,
    surface: str | None,
    folder: str | None,
    outputs: Outputs,
    **values: Any,
) -> None:
    """Compute every claim of the paper and say whether it holds, and redo its experiments.

    Each claim is code that computes its evidence; the verdict follows from the numbers.
    """
    from asperity.paper.registry import find_claims

    for name in names:
        find_claims(name)  # a misspelt one is refused before anything is computed
    measured = _texture(surface, values)
    alone = bool(names) or skip_experiments
    figures = _Figures.of(folder, values["format"], names, simulated=not skip_experiments)
    if figures is not None:
        check_outputs(json=outputs.json, html=outputs.html)  # one may be the folder's name
    results, experiments = _reproduced(names or None, measured, with_experiments=not alone)
    from asperity.report.reproduce import print_evidence, print_results, reproduce_page

    written = "" if figures is None else figures.write(experiments)

    def say(console: Console) -> None:
        if not names:
            print_results(results, experiments, console)
        for result in results if names else ():
            print_evidence(result, console)
        if written:
            console.print(written, soft_wrap=True, markup=False)

    data = {"schema": 1, "claims": results, "experiments": experiments}
    outputs.write(data, say, lambda: reproduce_page(results, experiments))


@dataclass(frozen=True)
class _Figures:
    """Which figures are written, and where."""

    drawings: tuple[Drawing, ...]
    folder: Path
    ending: Ending

    @classmethod
    def of(
        cls, folder: str | None, ending: Ending | None, names: Sequence[str], *, simulated: bool
    ) -> _Figures | None:
        """Return what the options ask for, checked before anything is computed."""
        if folder is None:
            if ending is not None:
                raise ParameterError(_FORMAT.name, "applies to figures: give --figures DIR")
            return None
        from asperity.report.paper_figures import find_drawings, make_folder

        drawings = find_drawings(names, simulated=simulated)
        return cls(drawings, make_folder(folder), ending or "svg")

    def write(self, experiments: Experiments | None) -> str:
        """Write them and return a line that says so."""
        from asperity.report.paper_figures import write_figures

        with step_bar("drawing the figures", len(self.drawings)) as step:
            paths = write_figures(self.drawings, self.folder, self.ending, experiments, step)
        names = ", ".join(path.name for path in paths)
        return f"Figures in {printable(str(self.folder))}: {names}"


def _texture(surface: str | None, values: dict[str, Any]) -> Texture | None:
    from asperity.scene import load_scene

    for_file = file_values(values)
    if surface is not None:
        return load_scene(surface, for_file).texture
    for name in for_file:
        raise ParameterError(name, "applies to a measured surface: give --surface")
    return None


def _reproduced(
    names: Sequence[str] | None, measured: Texture | None, *, with_experiments: bool
) -> tuple[tuple[Result, ...], Experiments | None]:
    from asperity.paper import reproduce_claims

    share = _CLAIMS if with_experiments else 1.0
    with progress_bar("the paper") as told:
        results = reproduce_claims(
            names, progress=lambda _result, done, total: told(share * done / total)
        )
        if not with_experiments:
            return results, None
        from asperity.paper.experiments import run_experiments
        from asperity.paper.experiments.run import STEPS

        def step(name: str) -> None:
            told(share + (1.0 - share) * STEPS.index(name) / len(STEPS))

        return results, run_experiments(measured, progress=step)

"""``asperity reproduce``: the paper, claim by claim."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.loop import print_report, progress_bar
from asperity.cli.options import FILE_OPTIONS, given, text_options
from asperity.cli.output import STANDARD_OUTPUT, check_outputs, write_output
from asperity.errors import ParameterError
from asperity.files import json_text

if TYPE_CHECKING:
    from rich.console import Console

    from asperity.paper import Result
    from asperity.paper.experiments import Experiments
    from asperity.textures import Texture

# Share of the progress bar that the claims take; the rest is the experiments'.
_CLAIMS = 0.35


@click.command("reproduce", short_help="Redo the paper and judge each of its statements.")
@click.option(
    "--claim", "names", metavar="ID", multiple=True, help="Only this claim, with its evidence."
)
@click.option("--skip-experiments", is_flag=True, help="Leave out what is simulated at length.")
@click.option(
    "--surface", metavar="SURFACE", help="Of the last experiment, instead of a drawn knurl."
)
@text_options(FILE_OPTIONS)
@click.option("--json", "json_path", metavar="PATH", help="Write the result as JSON; - is stdout.")
@click.option("--html", "html_path", metavar="PATH", help="Write a report; - is standard output.")
def reproduce_command(
    names: tuple[str, ...],
    skip_experiments: bool,
    surface: str | None,
    json_path: str | None,
    html_path: str | None,
    **values: Any,
) -> None:
    """Compute every claim of the paper and say whether it holds, and redo its experiments.

    Each claim is code that computes its evidence; the verdict follows from the numbers.
    """
    check_outputs(json=json_path, html=html_path)
    from asperity.paper import claim

    for name in names:
        claim(name)  # a misspelt one is refused before anything is computed
    measured = _texture(surface, values)
    alone = bool(names) or skip_experiments
    results, experiments = _reproduced(names or None, measured, with_experiments=not alone)
    if json_path is not None:
        write_output("json", json_path, as_json(results, experiments))
    if html_path is not None:
        from asperity.report.reproduce_html import reproduce_html

        write_output("html", html_path, reproduce_html(results, experiments))
    if STANDARD_OUTPUT in {json_path, html_path}:
        return
    from asperity.report.reproduce_table import print_evidence, print_results

    def say(console: Console) -> None:
        if not names:
            print_results(results, experiments, console)
        for result in results if names else ():
            print_evidence(result, console)

    print_report(say, html_path)


def _texture(surface: str | None, values: dict[str, Any]) -> Texture | None:
    from asperity.scene import FILE_ARGUMENTS, load_scene

    options = given(values, FILE_OPTIONS)
    if surface is None:
        for name in options:
            raise ParameterError(name, "applies to a measured surface: give --surface")
        return None
    for_file = {name: FILE_ARGUMENTS[name](name, text) for name, text in options.items()}
    return load_scene(surface, for_file).texture


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


def as_json(results: Sequence[Result], experiments: Experiments | None) -> str:
    """Return claims and experiments as JSON text."""
    return json_text({"schema": 1, "claims": list(results), "experiments": experiments})

"""The commands ``reproduce``, for the paper, and ``study``, for perception studies."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli import loop_setup, options, output
from asperity.cli.main import StrictGroup, declare_command
from asperity.cli.output import Outputs, check_outputs, output_options, progress_bar, step_bar
from asperity.cli.servo_commands import announce_page
from asperity.core.errors import ParameterError, escape_unprintable

if TYPE_CHECKING:
    from asperity.paper import Result
    from asperity.paper.experiments import Experiments
    from asperity.report.pages.paper_report import FileFormat, PaperFigure
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
@options.argument_options(
    [_FORMAT], lambda argument: lambda text: argument.validate(argument.parse(text))
)
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
    from asperity.paper.claims import find_claims

    for name in names:
        find_claims(name)  # an unknown name is refused before the computation
    measured = _load_measured_texture(surface, values)
    figures: tuple[PaperFigure, ...] = ()
    if folder is not None:
        from asperity.report.pages.paper_report import create_folder, find_figures

        figures = find_figures(names, include_simulated=not skip_experiments)
        create_folder(folder)
        # The folder may be one of the files.
        check_outputs(force=outputs.force, json=outputs.json, html=outputs.html)
    elif values["format"] is not None:
        raise ParameterError(_FORMAT.name, "applies to figures: give --figures DIR")
    simulates = not (names or skip_experiments)
    results, experiments = _reproduce(names or None, measured, with_experiments=simulates)
    from asperity.report.pages.paper_report import claims_page, evidence_page

    written = ""
    if folder is not None:
        from asperity.report.pages.paper_report import write_figures

        file_format: FileFormat = values["format"] or "svg"
        with step_bar("drawing the figures", len(figures)) as step:
            paths = write_figures(figures, Path(folder), file_format, experiments, step)
        names_text = ", ".join(path.name for path in paths)
        written = f"Figures in {escape_unprintable(folder)}: {names_text}"

    command = "asperity reproduce --claim {}"
    if names:
        page = evidence_page(results, command)
    else:
        page = claims_page(results, experiments, command)
        written = written or f"The evidence of one claim: {command.format('ID')}"
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
        from asperity.paper.experiments import STEPS, run_experiments

        def step(name: str) -> None:
            update(share + (1.0 - share) * STEPS.index(name) / len(STEPS))

        return results, run_experiments(measured, progress=step)


_TEMPLATES = Path(__file__).parents[1] / "studies" / "templates"
_RUN = options.command_arguments("study_run")
_PLAN = options.command_arguments("study_plan")


@click.group("study", cls=StrictGroup)
def study_command() -> None:
    """Prepare, run and report a perception study with participants.

    A study file states stimuli, method and questions. All data stay in one folder of this machine,
    under codes in place of names, and which stimulus a code stands for is written by report alone.
    """


@study_command.command("init", short_help="Write a study file of a kind.")
@click.argument("kind")
@click.argument("file")
@output.force_option
def init_command(kind: str, file: str, *, force: bool) -> None:
    """Write a study FILE (TOML) of a KIND, which runs as it is; all other settings are comments."""
    from asperity.studies.study_file import STUDY_ARGUMENTS

    name = STUDY_ARGUMENTS["kind"].validate(kind)
    text = (_TEMPLATES / f"{name}.toml").read_text("utf-8")
    text = text.replace("{name}", escape_unprintable(file))
    command = "asperity study plan {} --effect 1.5"
    output.write_template("file", file, text, command, force=force)


@study_command.command("run", short_help="Run a session of a participant.")
@click.argument("file")
@click.option("--participant", metavar="CODE", required=True, help="Code, such as P01; no name.")
@click.option("-o", "--output", "folder", metavar="FOLDER", help="Folder.  [default: that of FILE]")
@options.argument_options(_RUN)
@loop_setup.driver_option
@options.plugin_option
def run_command(
    file: str, participant: str, folder: str | None, driver: str, **values: Any
) -> None:
    """Run a session of a participant, as the study FILE describes.

    Each stimulus is analysed before the first trial, and the study is refused if one is above its
    stability limit. Each answer is on the disk before the next trial. The folder of all
    participants is named as the file, without .toml. Answers of simulated observers, and of people
    at a simulated device, are marked, and have folders of their own.
    """
    from asperity.core.units import count_text
    from asperity.studies.design import SIMULATED_DEVICE
    from asperity.studies.live.player import LoopPlayer, Stimuli
    from asperity.studies.live.screens import PageScreen, Terminal
    from asperity.studies.live.trial_session import SessionStopped, StudySession, simulate_session
    from asperity.studies.simulated_participants import find_observer
    from asperity.studies.study_file import load_study
    from asperity.studies.study_store import Participant, check_participant, write_study

    check_participant(participant)
    if driver.startswith(loop_setup.REPLAY_PREFIX):
        raise ParameterError("driver", "must be a device that a participant holds", driver)
    study = load_study(file)
    observer = find_observer(values["simulate"] or "typical")
    is_real = driver != loop_setup.SIMULATED
    simulated = values["simulate"] or ("" if is_real else SIMULATED_DEVICE)
    name = f"{Path(file).stem}-simulated-{simulated}" if simulated else Path(file).stem
    path = Path(folder or name)
    stimuli = Stimuli(study, is_real=is_real)
    with output.progress_bar("analyzing the stimuli") as update:
        first = stimuli.check_all(update)
    player = LoopPlayer(stimuli, first, loop_setup.make_driver(driver, first) if is_real else None)
    write_study(path, study, simulated)
    opened: Terminal | PageScreen | nullcontext[None] = nullcontext()
    if not values["simulate"]:
        noise = study.settings["masking_noise"]
        opened = Terminal() if values["terminal"] else PageScreen(masking_noise=noise)
    is_resumed = bool(values["resume"])
    with opened as screen, Participant(path, study, participant, resume=is_resumed) as person:
        before = person.trial
        if screen is None:
            simulate_session(person, stimuli, observer)
        else:
            if screen.url:
                announce_page("study", screen.url, no_browser=bool(values["no_browser"]))
            with suppress(SessionStopped):
                StudySession(person, player, screen).run()
    state = "done" if person.method.next() is None else "stopped; --resume goes on"
    name = escape_unprintable(path)
    answers = count_text(person.trial - before, "answer")
    click.echo(f"{participant}: {answers} in {name}; {state}")


def _check_study_folder(_ctx: click.Context, _argument: click.Parameter, folder: str) -> str:
    from asperity.studies.study_store import STUDY_FILE

    is_locked = os.path.isdir(folder) and not os.access(folder, os.X_OK)
    if not is_locked and not os.path.lexists(Path(folder) / STUDY_FILE):
        raise ParameterError(
            "folder", "is no folder of a study: asperity study run makes one", folder
        )
    return folder


@study_command.command("report", short_help="Write scores, tables and a page; unblinds.")
@click.argument("folder", callback=_check_study_folder)
@output.output_options(uses_cache=False)
def report_command(folder: str, outputs: output.Outputs) -> None:
    """Write scores with intervals, pictures and tables into FOLDER, with the key of the codes.

    It unblinds the study: write it when all participants are done.
    """
    from asperity.studies.study_report import study_page, study_report, write_report

    with output.progress_bar("analyzing the answers"):
        result = study_report(folder)
        names = ", ".join(write_report(folder, result))
    written = f"Written in {escape_unprintable(folder)}: {names}"
    outputs.write(result, study_page(result), extra_line=written)


@study_command.command("plan", short_help="Compute the power of a study by simulation.")
@click.argument("file")
@click.option("--effect", type=float, required=True, help="Factor of the first condition.")
@options.argument_options(_PLAN)
def plan_command(file: str, effect: float, **values: Any) -> None:
    """Compute how often the study FILE would find an effect, with simulated participants.

    The effect is the factor by which the first condition is stronger at the hand than the others.
    """
    from asperity.studies.live.trial_session import plan_study

    if effect == 1.0:
        raise ParameterError("effect", "must differ from 1", effect)
    with output.progress_bar("simulating studies") as update:
        provided = options.provided_values(values, _PLAN)
        plan = plan_study(file, effect, progress=update, **provided)
    click.echo(plan.text)


@study_command.command("remove", short_help="Delete all data of a participant.")
@click.argument("folder")
@click.argument("participant")
def remove_command(folder: str, participant: str) -> None:
    """Delete all data of PARTICIPANT in FOLDER: answers, recordings, and tables made from them."""
    from asperity.studies.study_store import remove_participant

    names = ", ".join(remove_participant(folder, participant))
    click.echo(escape_unprintable(f"Deleted in {folder}: {names}"))

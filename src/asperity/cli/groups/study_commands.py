"""The command ``study`` with its subcommands."""

from __future__ import annotations

import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli import loop_setup, output
from asperity.cli.main import StrictGroup
from asperity.cli.options import plugin_option
from asperity.core.errors import ParameterError, escape_unprintable, print_message, suggest_names

if TYPE_CHECKING:
    from asperity.studies.live.player import LoopPlayer
    from asperity.studies.live.screens import Screen
    from asperity.studies.study_file import Study

_TEMPLATES = Path(__file__).parents[2] / "studies" / "templates"


@click.group("study", cls=StrictGroup)
def study_command() -> None:
    """Prepare, run and report a perception study with participants.

    A study file states stimuli, method and questions. All data stay in one folder of this machine,
    under codes in place of names, and which stimulus a code stands for is written by report alone.
    """


@study_command.command("init", short_help="Write a study file of a kind.")
@click.argument("kind")
@click.argument("file")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def init_command(kind: str, file: str, *, force: bool) -> None:
    """Write a study FILE (TOML) of a KIND, which runs as it is; all other settings are comments."""
    kinds = sorted(path.stem for path in _TEMPLATES.glob("*.toml"))
    if kind not in kinds:
        raise ParameterError("kind", f"is unknown: {kind!r}; {suggest_names(kind, kinds)}")
    if Path(file).suffix.lower() != ".toml":
        raise ParameterError("file", "must be a file that ends in .toml", file)
    output.check_output("file", file, force=force)
    name = escape_unprintable(file)
    text = (_TEMPLATES / f"{kind}.toml").read_text("utf-8").replace("{name}", name)
    output.write_output("file", file, text)
    click.echo(f"Written: {name}; now: asperity study run {name} --participant P01")


@study_command.command("run", short_help="Run a session of a participant.")
@click.argument("file")
@click.option("--participant", metavar="CODE", required=True, help="Code, such as P01; no name.")
@click.option("--resume", is_flag=True, help="Go on where a session of the participant stopped.")
@click.option(
    "-o", "--output", "folder", metavar="FOLDER",
    help="Folder of all participants.  [default: the study file's name without .toml]",
)  # fmt: skip
@click.option(
    "--driver", metavar="NAME", default=loop_setup.SIMULATED,
    help="As for asperity run.  [default: simulated]",
)  # fmt: skip
@click.option("--terminal", is_flag=True, help="Ask in this terminal, without a page.")
@click.option("--simulate", metavar="OBSERVER", help="Simulated observer in place of a person.")
@click.option("--port", type=int, help="Port of the page.  [default: the first free one]")
@click.option("--no-browser", is_flag=True, help="Print the address without opening a browser.")
@plugin_option
def run_command(
    file: str, participant: str, folder: str | None, *, resume: bool, **values: Any
) -> None:
    """Run a session of a participant, as the study FILE describes.

    Each stimulus is analysed before the first trial, and the study is refused if one is above its
    stability limit. Each answer is on the disk before the next trial.
    """
    from asperity.studies.study_file import load_study
    from asperity.studies.study_store import Participant, check_participant, write_study

    check_participant(participant)
    study = load_study(file)
    path = Path(folder or Path(file).with_suffix("").name)
    if values["simulate"] is None:
        _run_on_device(study, path, participant, resume=resume, **values)
        return
    from asperity.studies.live.stimuli import Stimuli
    from asperity.studies.live.trial_session import simulate_session
    from asperity.studies.methods import METHODS
    from asperity.studies.observers import HandStrength, find_observer

    observer, stimuli = find_observer(values["simulate"]), Stimuli(study)
    stimuli.check_all()
    design = METHODS[study.design.kind].complete(study.design)
    strength = HandStrength(
        design, lambda one: (stimuli.setup(one).surface, stimuli.setup(one).device)
    )
    write_study(path, study)
    with Participant(path, study, participant, resume=resume) as person:
        before = person.trial
        simulate_session(
            person, lambda trial, rng: observer.answer(trial, strength, rng), design.seed
        )
        count = person.trial - before
    _report_end(path, participant, count, is_stopped=False)


def _run_on_device(
    study: Study, path: Path, code: str, *, resume: bool, driver: str, **values: Any
) -> None:
    from asperity.studies.live.trial_session import SessionStopped, StudySession
    from asperity.studies.study_store import Participant, write_study

    player = _make_player(study, driver)
    write_study(path, study)
    with Participant(path, study, code, resume=resume) as person, player:
        before = person.trial
        with _open_screen(study, **values) as screen:
            try:
                StudySession(study, person, player, screen).run()
                is_stopped = False
            except SessionStopped:
                is_stopped = True
        _report_end(path, code, person.trial - before, is_stopped=is_stopped)


def _report_end(path: Path, code: str, count: int, *, is_stopped: bool) -> None:
    words = "stopped; --resume goes on" if is_stopped else "done"
    click.echo(f"{code}: {count} answers in {escape_unprintable(path)}; {words}")


def _make_player(study: Study, driver: str) -> LoopPlayer:
    """Return the player of a study, whose stimuli are all checked."""
    from asperity.studies.live.player import LoopPlayer
    from asperity.studies.live.stimuli import Stimuli

    if driver.startswith(loop_setup.REPLAY_PREFIX):
        raise ParameterError("driver", "must be a device that a participant holds", driver)
    is_real = driver != loop_setup.SIMULATED
    stimuli = Stimuli(study, is_real=is_real)
    with output.progress_bar("analyzing the stimuli") as update:
        first = stimuli.check_all(update)
    real = loop_setup.make_driver(driver, first) if is_real else None
    return LoopPlayer(stimuli, first, real)


@contextmanager
def _open_screen(
    study: Study, *, terminal: bool, port: int | None, no_browser: bool, **_: Any
) -> Iterator[Screen]:
    """Yield the terminal or a page."""
    if terminal:
        from asperity.studies.live.screens import open_terminal

        with open_terminal() as screen:
            yield screen
        return
    from asperity.lab.launch import bind_socket
    from asperity.studies.live.page_screen import PageScreen

    noise = study.settings["masking_noise"]
    with PageScreen(bind_socket(port), masking_noise=noise) as page:
        print_message(f"the study is at {page.url}")
        if not no_browser and not webbrowser.open(page.url):
            print_message("no browser was found: open the address in a browser of this machine")
        yield page


@study_command.command("report", short_help="Write scores, tables and a page; unblinds.")
@click.argument("folder")
@output.output_options(uses_cache=False)
def report_command(folder: str, outputs: output.Outputs) -> None:
    """Write scores with intervals, pictures and tables into FOLDER, with the key of the codes.

    It unblinds the study: write it when all participants are done.
    """
    from asperity.studies.result_page import study_page
    from asperity.studies.study_functions import study_report, write_report

    with output.progress_bar("analyzing the answers"):
        result = study_report(folder)
        names = ", ".join(write_report(folder, result))
    written = f"Written in {escape_unprintable(folder)}: {names}"
    outputs.write(result, study_page(result), extra_line=written)


@study_command.command("plan", short_help="Compute the power of a study by simulation.")
@click.argument("file")
@click.option(
    "--effect", type=float, required=True,
    help="By which factor the first condition is stronger at the hand than the others.",
)  # fmt: skip
@click.option("--participants", type=int, help="Number.  [default: that of the study]")
@click.option("--simulations", type=int, default=200, help="Simulated studies.  [default: 200]")
@click.option(
    "--observer", default="typical",
    help="typical, keen, dull or guessing.  [default: typical]",
)  # fmt: skip
def plan_command(file: str, effect: float, **options: Any) -> None:
    """Compute how often the study FILE would find an effect, with simulated participants."""
    from asperity.studies.study_functions import plan_study

    with output.progress_bar("simulating studies"):
        found = plan_study(file, effect, **options)
    click.echo(found.text)


@study_command.command("remove", short_help="Delete all data of a participant.")
@click.argument("folder")
@click.argument("participant")
def remove_command(folder: str, participant: str) -> None:
    """Delete all data of PARTICIPANT in FOLDER: answers, recordings, and tables made from them."""
    from asperity.studies.study_store import remove_participant

    names = ", ".join(remove_participant(folder, participant))
    click.echo(f"Deleted in {escape_unprintable(folder)}: {names}")

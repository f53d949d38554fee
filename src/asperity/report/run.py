"""A simulated run: in a terminal, and as a page."""

from __future__ import annotations

import math

from rich.console import Console

from asperity.report import page, terminal
from asperity.report.page import PAPER, Page, Row, Section, added_sections, assumed, pictured
from asperity.report.terminal import say
from asperity.report.words.number_words import law_title
from asperity.scene.setup import Setup
from asperity.simulation import Run
from asperity.simulation.judging import CYCLE_SPEED
from asperity.simulation.onset import holds_still
from asperity.surface import Surface
from asperity.units import engineering

FOOTER = f"{PAPER}, section V"
_ENERGIES = ("energy", "x", "y", "z", "sum")


def energy(value: float) -> str:
    """Return an energy with its sign, "+2.97 mJ"."""
    if value == 0.0:
        return "0 J"
    if not math.isfinite(value):
        return "not finite"
    text = engineering(abs(value), "J", digits=3)
    return f"{'+' if value > 0.0 else '-'}{text}"


def work_text(surface: Surface, run: Run) -> str:
    """Return what the texture did to the hand."""
    law = surface.law.letter
    total = run.ledger.total
    verb = "feeds the hand" if total > 0.0 else "takes from the hand"
    work = f"{verb} {engineering(abs(total), 'J', digits=3)}" if total else "does no work"
    if not math.isfinite(total):
        work = "feeds the hand beyond all numbers"
    stiffness = engineering(surface.stiffness, "N/m")
    return f"Law {law} at {stiffness} {work} in {engineering(run.duration, 's')}"


def answer(setup: Setup, run: Run) -> str:
    """Return what happened in one or two sentences."""
    said = work_text(setup.surface, run)
    if run.stopped:
        said = f"{said}. The run stopped: it {run.stopped}"
    if not run.closes:
        said = f"{said}. The energy does not add up: believe no number of this run"
    if run.short:
        said = f"{said}. {uncertainty(run)}"
    if run.stopped:
        return f"{said}."
    return f"{said}. {unrest(setup, run)}."


def uncertainty(run: Run) -> str:
    """Return how far the forces can be wrong where the search had too little time."""
    share = (
        f"In {run.short} of {run.samples} samples the search for the nearest point was cut short"
    )
    if run.surface.law.contact.gap_is_force:
        error = engineering(run.surface.stiffness * run.gap, "N", digits=2)
        return f"{share}: the force was right to {error}"
    return f"{share}: another point was nearer by {engineering(run.gap, 'm', digits=2)} at most"


def unrest(setup: Setup, run: Run) -> str:
    """Return whether the handle came to rest, in words."""
    if not holds_still(setup.motion, run.duration):
        return "The hand was moving to the end"
    if run.ending is None or not run.ending.known:
        return "Too few samples were traced to say whether it came to rest"
    speed = run.ending.restlessness
    cycles = speed > CYCLE_SPEED and run.ending.fed
    kept = "keeps moving: a limit cycle" if cycles else "comes to rest"
    limit = engineering(CYCLE_SPEED, "m/s")
    return (
        f"The handle {kept} (velocity varies by {engineering(speed, 'm/s', digits=3)} in the last "
        f"quarter; above {limit} counts as a cycle)"
    )


def facts_of_loop(setup: Setup) -> list[tuple[str, str]]:
    """Return names and values of the device, its servo, the hand and the surface."""
    servo = setup.servo
    step = servo.position_resolution
    return [
        ("Surface", str(setup.surface.texture.describe()["kind"])),
        ("Device", setup.device.name),
        ("Update period", engineering(servo.period, "s")),
        ("Position resolution", engineering(step, "m") if step else "not limited"),
        ("Hand", str(setup.hand.to_dict()["kind"])),
        ("Motion", str(setup.motion.to_dict()["kind"])),
    ]


def facts(setup: Setup, run: Run) -> list[tuple[str, str]]:
    """Return names and values of what was simulated."""
    surface = setup.surface
    return [
        ("Law", f"{surface.law.letter}, {law_title(surface.law.name)}"),
        ("Stiffness", engineering(surface.stiffness, "N/m")),
        *facts_of_loop(setup),
        ("Delay", f"{setup.servo.delay} sample{'' if setup.servo.delay == 1 else 's'}"),
        ("Simulated", f"{engineering(run.duration, 's')}, {run.samples} samples"),
    ]


def ledger_rows(run: Run) -> list[tuple[str, list[str]]]:
    """Return name and cells (x, y, z, sum) of the energies."""
    ledger = run.ledger

    def axes(values: tuple[float, float, float]) -> list[str]:
        return [*[energy(value) for value in values], energy(sum(values))]

    def single(value: float) -> list[str]:
        return ["", "", "", energy(value)]

    return [
        ("texture, exact", axes(ledger.supplied)),
        ("texture, the paper's sum", axes(ledger.same_sample)),
        ("sampling's part of it", single(ledger.sampling)),
        ("the hand's anchor", single(ledger.hand)),
        ("lost in damping of device and hand", single(-ledger.lost)),
        ("dry friction", single(ledger.friction)),
        ("stored, after less before", single(ledger.after - ledger.before)),
        ("does not add up", single(ledger.closure)),
    ]


def closing_words(run: Run) -> str:
    """Return how well the ledger closes."""
    ledger = run.ledger
    share = abs(ledger.closure) / ledger.exchanged if ledger.exchanged > 0.0 else 0.0
    if not math.isfinite(share):
        return "The run diverged: its energies are beyond all numbers."
    return (
        "Positive feeds the hand. Exact: the held force on the true motion. The paper's sum: the "
        "command and the measured step of one sample. Sampling's part: what holding the force "
        f"adds, ½ Σ (f_k - f_k+1)·(p_k+1 - p_k). The ledger closes to {share:.1g} of the "
        f"{engineering(ledger.exchanged, 'J', digits=3)} that were exchanged."
    )


def ledger_table(run: Run) -> page.Table:
    """Return where the energy went."""
    rows = [Row([name, *cells]) for name, cells in ledger_rows(run)]
    return page.Table(_ENERGIES, rows, numbers=(1, 2, 3, 4))


def print_run(setup: Setup, run: Run, console: Console) -> None:
    """Print answer, ledger and assumptions."""
    say(console, answer(setup, run), "bold")
    console.print()
    console.print(terminal.table(ledger_table(run), wraps=(0,), gap=2, ruled=False))
    say(console, closing_words(run), "dim")
    console.print()
    for name, value in facts(setup, run):
        say(console, f"{name}: {value}", "dim")
    terminal.print_assumptions(console, setup.assumptions)


def run_page(setup: Setup, run: Run) -> Page:
    """Return the report of a run, its trace in memory."""
    return Page(
        title=f"Law {setup.surface.law.letter} in the loop, {setup.device.name}",
        answer=answer(setup, run),
        facts=facts(setup, run),
        sections=[
            *_pictures(run),
            Section("Where the energy went", [ledger_table(run)], caption=closing_words(run)),
            *added_sections(Run, setup, run),
            *assumed(setup.assumptions),
        ],
        footer=FOOTER,
    )


def _pictures(run: Run) -> list[Section]:
    if len(run.time) < 2:
        return []
    from asperity.report.pictures.run_picture import run_figure

    caption, seen = run_caption(run.duration)
    seen += f". In the end the texture has supplied {energy(run.ledger.total)}."
    return [
        pictured(
            "Motion, force, energy, phase",
            run_figure(run, run.surface.texture.height),
            seen,
            caption,
        )
    ]


def run_caption(duration: float) -> tuple[str, str]:
    """Return what stands below the pictures of a loop, and what is seen in them."""
    caption = (
        "Brown: the body, as high as it is below the handle. The exact energy is the work of the "
        "held force on the true motion; the paper's sum multiplies command and step of the same "
        "sample, which turns the sign of what sampling adds."
    )
    seen = f"Height, force and energy over {engineering(duration, 's')}, the path, and two phase"
    return caption, f"{seen} portraits"

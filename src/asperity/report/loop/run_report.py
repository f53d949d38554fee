"""Report of a simulated run."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from asperity.core.units import format_quantity
from asperity.report.page import (
    PAPER_CITATION,
    Media,
    Page,
    Row,
    Section,
    Table,
    TableLayout,
    assumption_sections,
    facts_section,
    picture_section,
    user_sections,
)
from asperity.report.sentences.number_text import readable_name
from asperity.scene.setup import Setup
from asperity.simulation import Run
from asperity.simulation.limit_cycles.onset import is_at_rest
from asperity.simulation.limit_cycles.onset_search import CYCLE_SPEED
from asperity.simulation.trace import load_trace
from asperity.surface import Surface

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOOP_FOOTER = f"{PAPER_CITATION}, section V"
_LEDGER_HEADINGS = ("energy", "x", "y", "z", "sum")


def energy_text(value: float) -> str:
    """Return an energy with its sign: "+2.97 mJ"."""
    if value == 0.0:
        return "0 J"
    if not math.isfinite(value):
        return "not finite"
    text = format_quantity(abs(value), "J", digits=3)
    return f"{'+' if value > 0.0 else '-'}{text}"


def work_text(surface: Surface, run: Run) -> str:
    """Return the work that the texture did on the hand."""
    total = run.ledger.total
    verb = "feeds the hand" if total > 0.0 else "takes from the hand"
    work = f"{verb} {format_quantity(abs(total), 'J', digits=3)}" if total else "does no work"
    if not math.isfinite(total):
        work = "feeds the hand an energy that is not finite"
    stiffness = format_quantity(surface.stiffness, "N/m")
    duration = format_quantity(run.duration, "s")
    return f"Law {surface.law.letter} at {stiffness} {work} in {duration}"


def run_answer(setup: Setup, run: Run) -> str:
    """Return the result of a run in one or two sentences."""
    sentences = [work_text(setup.surface, run)]
    if run.stop_message:
        sentences.append(f"The run stopped: it {run.stop_message}")
    if not run.is_energy_balanced:
        sentences.append("The energy balance does not close: do not rely on this run")
    if run.truncated_ticks:
        sentences.append(search_error_text(run))
    if not run.stop_message:
        sentences.append(rest_text(setup, run))
    return f"{'. '.join(sentences)}."


def search_error_text(run: Run) -> str:
    """Return the error bound of the forces where searches were truncated."""
    share = (
        f"In {run.truncated_ticks} of {run.samples} samples the search for the nearest point was "
        "truncated"
    )
    if run.surface.law.contact.bounds_force_error:
        error = format_quantity(run.surface.stiffness * run.search_error, "N", digits=2)
        return f"{share}: the error of the force was at most {error}"
    distance = format_quantity(run.search_error, "m", digits=2)
    return f"{share}: another point was nearer by at most {distance}"


def rest_text(setup: Setup, run: Run) -> str:
    """Return whether the handle came to rest."""
    if not is_at_rest(setup.motion, run.duration):
        return "The hand was moving to the end"
    if run.tail is None or not run.tail.is_complete:
        return "Too few samples were traced to decide whether the handle came to rest"
    speed = run.tail.velocity_spread
    cycles = speed > CYCLE_SPEED and run.tail.gains_energy
    verdict = "keeps moving: a limit cycle" if cycles else "comes to rest"
    limit, spread = (format_quantity(one, "m/s", digits=3) for one in (CYCLE_SPEED, speed))
    return (
        f"The handle {verdict} (velocity varies by {spread} in the last quarter; above {limit} "
        "counts as a cycle)"
    )


def loop_facts(setup: Setup) -> list[tuple[str, str]]:
    """Return names and values of surface, device, servo, hand and motion."""
    servo = setup.servo
    step = servo.position_resolution
    return [
        ("Surface", str(setup.surface.texture.describe()["kind"])),
        ("Device", setup.device.name),
        ("Update period", format_quantity(servo.period, "s")),
        ("Position resolution", format_quantity(step, "m") if step else "not limited"),
        ("Hand", str(setup.hand.to_dict()["kind"])),
        ("Motion", str(setup.motion.to_dict()["kind"])),
    ]


def run_facts(setup: Setup, run: Run) -> list[tuple[str, str]]:
    """Return names and values of the simulated system."""
    surface = setup.surface
    return [
        ("Law", f"{surface.law.letter}, {readable_name(surface.law.name)}"),
        ("Stiffness", format_quantity(surface.stiffness, "N/m")),
        *loop_facts(setup),
        ("Delay", f"{setup.servo.delay} sample{'' if setup.servo.delay == 1 else 's'}"),
        ("Simulated", f"{format_quantity(run.duration, 's')}, {run.samples} samples"),
    ]


def ledger_rows(run: Run) -> list[tuple[str, list[str]]]:
    """Return name and cells (x, y, z, sum) of each energy."""
    ledger = run.ledger

    def axes(values: tuple[float, float, float]) -> list[str]:
        return [*[energy_text(value) for value in values], energy_text(sum(values))]

    def single(value: float) -> list[str]:
        return ["", "", "", energy_text(value)]

    return [
        ("texture, exact", axes(ledger.supplied)),
        ("texture, the paper's sum", axes(ledger.same_sample)),
        ("of it by sampling", single(ledger.sampling)),
        ("anchor of the hand", single(ledger.hand)),
        ("dissipated by damping of device and hand", single(-ledger.dissipated)),
        ("dry friction", single(ledger.friction)),
        ("stored energy, after minus before", single(ledger.stored_after - ledger.stored_before)),
        ("residual", single(ledger.closure)),
    ]


def closure_text(run: Run) -> str:
    """Return definitions of the energies, and the relative residual."""
    ledger = run.ledger
    share = abs(ledger.closure) / ledger.exchanged if ledger.exchanged > 0.0 else 0.0
    if not math.isfinite(share):
        return "The run diverged: its energies are not finite."
    return (
        "Positive feeds the hand. Exact: the held force on the true motion. The paper's sum: the "
        "command and the measured step of one sample. By sampling: the energy that holding the "
        f"force adds, ½ Σ (f_k - f_k+1)·(p_k+1 - p_k). Residual: {share:.1g} of the "
        f"{format_quantity(ledger.exchanged, 'J', digits=3)} exchanged."
    )


def ledger_table(run: Run) -> Table:
    """Return the energies along each axis and their sum."""
    rows = [Row([name, *cells]) for name, cells in ledger_rows(run)]
    layout = TableLayout(wrap=(0,), gap=2, has_rule=False)
    return Table(_LEDGER_HEADINGS, rows, (1, 2, 3, 4), layout)


def run_page(setup: Setup, run: Run) -> Page:
    """Return the report of a run."""
    caption, ledger = closure_text(run), ledger_table(run)
    return Page(
        title=f"Law {setup.surface.law.letter} in the loop, {setup.device.name}",
        answer=run_answer(setup, run),
        facts=run_facts(setup, run),
        sections=[
            *figure_sections(run),
            Section("Energy ledger", [ledger], caption),
            Section("", [ledger], notes=[caption], media=Media.TERMINAL),
            facts_section(run_facts(setup, run)),
            *user_sections(Run, setup, run),
            *assumption_sections(setup.assumptions),
        ],
        footer=LOOP_FOOTER,
    )


def figure_sections(run: Run) -> list[Section]:
    """Return the figure of a run with its trace; none without one."""
    if not run.path and len(run.time) < 2:
        return []
    caption, text = run_caption(run.duration)
    text += f". At the end the texture has supplied {energy_text(run.ledger.total)}."
    media = Media.HTML | (Media.NOTEBOOK if len(run.time) > 1 else Media.HTML)
    figure = partial(_draw_run, run)
    return [picture_section("Motion, force, energy, phase", figure, text, caption, media=media)]


def _draw_run(run: Run) -> Figure:
    from asperity.report.pictures.loop_pictures import run_figure

    traced = load_trace(run) if run.path else run
    return run_figure(traced, run.surface.texture.height)


def run_caption(duration: float) -> tuple[str, str]:
    """Return caption and description of the figure of a loop."""
    caption = (
        "Brown: the body below the handle. The exact energy is the work of the held force on the "
        "true motion; the paper's sum multiplies command and step of the same sample, which "
        "reverses the sign of the energy that sampling adds."
    )
    span = format_quantity(duration, "s")
    return caption, f"Height, force and energy over {span}, the path, and two phase portraits"

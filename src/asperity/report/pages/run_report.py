"""Reports of a simulated run, of a recording and of its replay."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.files import json_text, text_digest, write_bytes
from asperity.core.units import format_quantity
from asperity.recording.recording import Recording, open_recording
from asperity.recording.replay import Replay
from asperity.report.document import page
from asperity.report.document.html import Origin, render_page
from asperity.report.document.page import SCREEN, Media, Page, Row, Section, Table, TableLayout
from asperity.report.pages.comparison_columns import describe_texture, texture_name
from asperity.report.sentences.number_text import readable_name
from asperity.report.sentences.texts import sentence
from asperity.scene.setup import Setup
from asperity.simulation import Run
from asperity.simulation.onset import is_at_rest
from asperity.simulation.onset_search import felt_speed
from asperity.simulation.trace import MAX_ROWS
from asperity.surface import Surface

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOOP_FOOTER = f"{page.PAPER_CITATION}, section V"
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
    energy = format_quantity(abs(total), "J", digits=3)
    work = f"delivers {energy} to the hand" if total > 0.0 else f"takes {energy} from the hand"
    if not (total and math.isfinite(total)):
        work = "delivers an energy that is not finite" if total else "does no work"
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
    share = sentence("truncated", count=run.truncated_ticks, samples=run.samples)
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
    felt = felt_speed(speed, run.tail.position_spread)
    verdict = "comes to rest"
    if speed > felt and run.tail.gains_energy:
        servo = setup.servo
        has_steps = servo.position_resolution or servo.force_resolution
        verdict = "keeps moving: a limit cycle"
        verdict += ", or the chatter of steps" if has_steps else ""
    limit, spread = (format_quantity(one, "m/s", digits=3) for one in (felt, speed))
    return sentence("rest", verdict=verdict, spread=spread, limit=limit)


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
    exchanged = format_quantity(ledger.exchanged, "J", digits=3)
    return sentence("ledger", share=f"{share:.1g}", exchanged=exchanged)


def ledger_table(run: Run) -> Table:
    """Return the energies along each axis and their sum."""
    rows = [Row([name, *cells]) for name, cells in ledger_rows(run)]
    layout = TableLayout(wrap=(0,), gap=2, has_rule=False)
    return Table(_LEDGER_HEADINGS, rows, (1, 2, 3, 4), layout)


def run_page(setup: Setup, run: Run) -> Page:
    """Return the report of a run."""
    caption = closure_text(run)
    ledger = ledger_table(run)
    surface = setup.surface
    name = setup.device.name
    return Page(
        title=f"{texture_name(surface.texture)}, law {surface.law.letter}, in the loop, {name}",
        answer=run_answer(setup, run),
        facts=run_facts(setup, run),
        sections=[
            *figure_sections(run),
            Section("Energy ledger", [ledger], caption),
            page.terminal_section(ledger, notes=[caption]),
            page.facts_section(run_facts(setup, run)),
            *page.assumption_sections(setup.assumptions),
        ],
        footer=LOOP_FOOTER,
    )


def figure_sections(run: Run) -> list[Section]:
    """Return the figure of a run with its trace; none without one."""
    if not run.path and len(run.time) < 2:
        return []
    end = f". At the end the texture has supplied {energy_text(run.ledger.total)}"
    media = Media.HTML | Media.NOTEBOOK if len(run.time) > 1 else Media.HTML
    return [_motion_section(partial(_draw_run, run), run.duration, end, media)]


def _draw_run(run: Run) -> Figure:
    from asperity.report.pictures.loop_pictures import run_figure

    traced = open_recording(run.path).to_columns(MAX_ROWS) if run.path else run
    return run_figure(traced, run.surface.texture.height)


def _motion_section(
    figure: Callable[[], Figure], duration: float, end: str, media: Media
) -> Section:
    """Return the figure of a loop with its description, which ends in a text."""
    span = format_quantity(duration, "s")
    return page.figure_section("loop.run", figure, media=media, span=span, end=end)


# --- recordings -----------------------------------------------------------------------------------


def recording_answer(recording: Recording) -> str:
    """Return size, surface and completeness of a recording in one or two sentences."""
    period = _row_period(recording.metadata)
    surface = _surface_metadata(recording.metadata)
    rate = f" at {format_quantity(1.0 / period, 'Hz')}" if period else ""
    text = f"{recording.rows} rows, {format_quantity(recording.duration, 's')}{rate}"
    if surface is not None:
        stiffness = format_quantity(float(surface["stiffness"]), "N/m")
        text += f": law {surface['law']} at {stiffness} on {describe_texture(surface['texture'])}"
    return f"{text}. {_truncation_text(recording)}".rstrip()


def _truncation_text(recording: Recording) -> str:
    """Return why samples may be missing; nothing for a complete recording."""
    if recording.is_complete:
        return "" if recording.rows else "Nothing was recorded."
    if not recording.rows:
        return "The recording was not closed, and contains no complete block."
    count = recording.unread_bytes
    lost = f" ({count} bytes after it are an incomplete block)" if count else ""
    return f"The recording was not closed: it ends with the last complete block{lost}."


def _surface_metadata(metadata: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Return the surface of a recording; ``None`` if its description is incomplete."""
    surface = metadata.get("surface")
    names = {"texture", "law", "law_name", "stiffness", "max_depth", "content"}
    if not isinstance(surface, Mapping) or not surface.keys() >= names:
        return None
    has_kind = isinstance(surface["texture"], Mapping) and "kind" in surface["texture"]
    numbers = surface["stiffness"], surface["max_depth"]
    return surface if has_kind and _are_positive_numbers(*numbers) else None


def _row_period(metadata: Mapping[str, Any]) -> float:
    """Return the time from row to row [s]; 0 if it is not recorded."""
    servo = metadata.get("servo")
    every = metadata.get("every", 1)
    period: Any = servo.get("period") if isinstance(servo, Mapping) else None
    return float(period) * every if _are_positive_numbers(period, every) else 0.0


def _are_positive_numbers(*values: Any) -> bool:
    return all(isinstance(value, (int, float)) and value > 0 for value in values)


def recording_facts(recording: Recording) -> list[tuple[str, str]]:
    """Return names and values of surface, device, hand and motion."""
    about = recording.metadata
    surface = _surface_metadata(about)
    device = about.get("device")
    rows = [("Recorded by", f"asperity {recording.version}, {about.get('made_by', 'unknown')}")]
    if surface is not None:
        law = f"{surface['law']}, {readable_name(str(surface['law_name']))}"
        rows += [("Surface", describe_texture(surface["texture"])), ("Law", law)]
        rows += [("Stiffness", format_quantity(float(surface["stiffness"]), "N/m"))]
        rows += [("Pressed to", format_quantity(float(surface["max_depth"]), "m"))]
        rows += [("Content", str(surface["content"]))]
    if isinstance(device, Mapping):
        rows += [("Device", str(device.get("name")))]
    kinds = [(name.capitalize(), about.get(name)) for name in ("hand", "motion")]
    rows += [(name, str(one.get("kind"))) for name, one in kinds if isinstance(one, Mapping)]
    if period := _row_period(about):
        rows += [("From row to row", format_quantity(period, "s"))]
    return rows


def columns_table(recording: Recording, ranges: tuple[FloatArray, FloatArray]) -> Table:
    """Return the columns with their least and greatest values, empty without rows."""
    rows = [
        Row([name, *(f"{one:.6g}" if recording.rows else "" for one in (low, high)), unit])
        for (name, unit), low, high in zip(recording.columns, *ranges, strict=True)
    ]
    headings = ("column", "least", "greatest", "unit")
    return Table(headings, rows, (1, 2), TableLayout(gap=2))


def replay_answer(replay: Replay) -> str:
    """Return the result of a replay in one or two sentences."""
    if replay.first_difference is None:
        return f"All {replay.rows} rows are reproduced bit for bit."
    one = replay.first_difference
    unit = "N" if one.column.startswith("commanded") else "m" if "anchor" in one.column else ""
    values = f"{one.replayed_value!r} instead of {one.recorded_value!r}".replace("'", "")
    where = f"row {one.row}, at {format_quantity(one.time, 's')}"
    first = f"the first is {where}: {one.column} is {values} {unit}".rstrip()
    largest = format_quantity(replay.max_force_difference, "N", digits=3)
    count = f"{replay.differing_rows} of {replay.rows} rows differ"
    return f"{count}; {first}. The largest difference of a force is {largest}."


def replay_page(replay: Replay) -> Page:
    """Return the result of a replay and its notes, for a terminal and a notebook."""
    notes = [page.Paragraph(note) for note in replay.notes]
    media = Media.TERMINAL | Media.NOTEBOOK
    return Page("", replay_answer(replay), (), [Section("", notes, media=media)] if notes else [])


def recording_page(
    recording: Recording, ranges: tuple[FloatArray, FloatArray] | None = None
) -> Page:
    """Return the report of a recording; ``ranges`` of its columns are read from it by default."""
    columns = columns_table(recording, ranges or recording.ranges())
    facts = recording_facts(recording)
    media = Media.HTML | Media.NOTEBOOK
    figure = _motion_section(page.plot_later(recording), recording.duration, "", media)
    return Page(
        title=f"Recording {recording.path.name}",
        answer=recording_answer(recording),
        facts=facts,
        sections=[
            *([figure] if recording.rows > 1 else ()),
            Section("Columns", [columns], media=SCREEN | Media.NOTEBOOK),
            page.facts_section(facts),
            *page.assumption_sections(recording.metadata.get("assumptions", ())),
        ],
    )


def write_recording_report(recording: Recording, path: str) -> None:
    """Write the page of a recording, or its figure alone, by the suffix of the path.

    Raises:
        ParameterError: for another suffix, a recording without enough rows, or a file that cannot
            be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".html", *page.FIGURE_SUFFIXES):
        raise ParameterError(
            "output", f"must end in .html, {', '.join(page.FIGURE_SUFFIXES)}", path
        )
    if suffix == ".html":
        origin = Origin(content=text_digest(json_text(recording)))
        content = render_page(recording_page(recording), origin).encode()
    else:
        content = page.figure_bytes(recording, suffix)
    write_bytes("output", path, content)

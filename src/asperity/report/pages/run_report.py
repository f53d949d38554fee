"""Reports of runs: simulated, recorded and replayed, of a loop on a device and of a calibration."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from asperity.core.checks import FloatArray
from asperity.core.errors import escape_unprintable
from asperity.core.files import json_text, text_digest, write_bytes
from asperity.core.units import count_text, format_quantity
from asperity.devices import Device
from asperity.recording.recording import Recording
from asperity.recording.replay import Replay, omitted_delay, rounded_step
from asperity.report.document.html import render_page
from asperity.report.document.page import (
    PAPER_CITATION,
    SCREEN,
    Media,
    Page,
    Paragraph,
    Row,
    Section,
    Table,
    TableLayout,
    assumption_sections,
    check_suffix,
    facts_section,
    figure_bytes,
    figure_section,
    plot_later,
    terminal_page,
    terminal_section,
)
from asperity.report.sentences.loop_text import (
    CAUSE_TEXT,
    calibration_lines,
    closure_text,
    limited_lines,
    measured_energy_text,
    rate_lines,
    recording_answer,
    replay_answer,
    row_period,
    run_answer,
    surface_metadata,
    timing_lines,
)
from asperity.report.sentences.surface_text import describe_texture, texture_name
from asperity.report.sentences.texts import NOT_AVAILABLE, energy_text, readable_name
from asperity.scene.setup import Setup
from asperity.servo.calibration.calibrator import AxisCalibration, Calibration
from asperity.servo.calibration.measured_device import format_uncertainty
from asperity.servo.loop_memory import EndReason
from asperity.servo.process import ServoProcess
from asperity.simulation import Run

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOOP_FOOTER = f"{PAPER_CITATION}, section V"
_LEDGER_HEADINGS = ("energy", "x", "y", "z", "sum")


def loop_facts(setup: Setup) -> list[tuple[str, str]]:
    """Return names and values of surface, device, servo, hand and motion."""
    servo = setup.servo
    resolution = "not limited"
    if servo.position_resolution:
        resolution = format_quantity(servo.position_resolution, "m")
    return [
        ("Surface", str(setup.surface.texture.describe()["kind"])),
        ("Device", setup.device.name),
        ("Update period", format_quantity(servo.period, "s")),
        ("Position resolution", resolution),
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
        ("Delay", count_text(setup.servo.delay, "sample")),
        ("Simulated", f"{format_quantity(run.duration, 's')}, {run.samples} samples"),
    ]


def ledger_rows(run: Run) -> list[tuple[str, list[str]]]:
    """Return name and cells (x, y, z, sum) of each energy."""
    ledger = run.ledger

    def axes(values: tuple[float, float, float]) -> list[str]:
        return [*[energy_text(value) for value in values], energy_text(sum(values))]

    def single(value: float) -> list[str]:
        return ["", "", "", energy_text(value)]

    friction = []
    if run.surface.contact_friction is not None:
        friction = [
            ("of it taken by friction that slips", single(-run.slipped)),
            ("of it stored in friction at the end", single(-run.deflected)),
        ]
    return [
        ("texture, exact", axes(ledger.supplied)),
        *friction,
        ("texture, the paper's sum", axes(ledger.same_sample)),
        ("of it by sampling", single(ledger.sampling)),
        ("anchor of the hand", single(ledger.hand)),
        ("dissipated by damping of device and hand", single(-ledger.dissipated)),
        ("dry friction", single(ledger.friction)),
        ("stored energy, after minus before", single(ledger.stored_after - ledger.stored_before)),
        ("residual", single(ledger.closure)),
    ]


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
            terminal_section(ledger, notes=[caption]),
            facts_section(run_facts(setup, run)),
            *assumption_sections(setup.assumptions),
        ],
        footer=LOOP_FOOTER,
    )


def figure_sections(run: Run) -> list[Section]:
    """Return the figure of a run with its trace; none without one."""
    if not run.path and len(run.time) < 2:
        return []
    end = f". At the end the texture has supplied {energy_text(run.ledger.total)}"
    media = Media.HTML | Media.NOTEBOOK if len(run.time) > 1 else Media.HTML
    return [_motion_section(plot_later(run), run.duration, end, media)]


def _motion_section(
    figure: Callable[[], Figure], duration: float, end: str, media: Media
) -> Section:
    """Return the figure of a loop with its description, which ends in a text."""
    span = format_quantity(duration, "s")
    return figure_section("loop.run", figure, media=media, span=span, end=end)


# --- recordings -----------------------------------------------------------------------------------


def recording_facts(recording: Recording) -> list[tuple[str, str]]:
    """Return names and values of surface, device, hand and motion."""
    about = recording.metadata
    surface = surface_metadata(about)
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
    for name in ("hand", "motion"):
        part = about.get(name)
        if isinstance(part, Mapping):
            rows += [(name.capitalize(), str(part.get("kind")))]
    period = row_period(about)
    if period:
        rows += [("From row to row", format_quantity(period, "s"))]
    step = rounded_step(recording)
    if step and "supplied" in recording.names:
        steps = format_quantity(step, "m")
        rows += [("Supplied", f"energy to the hand, as measured in encoder steps of {steps}")]
    if omitted_delay(recording):
        rows += [("Applied, supplied", "of the force before the delay, by an early version")]
    return rows


def columns_table(recording: Recording, ranges: tuple[FloatArray, FloatArray]) -> Table:
    """Return the columns with their least and greatest values, empty without rows."""
    rows = []
    for (name, unit), low, high in zip(recording.columns, *ranges, strict=True):
        ends = [f"{low:.6g}", f"{high:.6g}"] if recording.rows else ["", ""]
        rows.append(Row([name, *ends, unit]))
    headings = ("column", "least", "greatest", "unit")
    return Table(headings, rows, (1, 2), TableLayout(gap=2))


def replay_page(replay: Replay) -> Page:
    """Return the result of a replay and its notes, for a terminal and a notebook."""
    notes = [Paragraph(note) for note in replay.notes]
    media = Media.TERMINAL | Media.NOTEBOOK
    return Page("", replay_answer(replay), (), [Section("", notes, media=media)] if notes else [])


def recording_page(
    recording: Recording, ranges: tuple[FloatArray, FloatArray] | None = None
) -> Page:
    """Return the report of a recording; ``ranges`` of its columns are read from it by default."""
    columns = columns_table(recording, ranges or recording.ranges())
    facts = recording_facts(recording)
    media = Media.HTML | Media.NOTEBOOK
    figures = []
    if recording.rows > 1:
        draw = plot_later(recording)
        figures.append(_motion_section(draw, recording.duration, "", media))
    return Page(
        title=f"Recording {recording.path.name}",
        answer=recording_answer(recording),
        facts=facts,
        sections=[
            *figures,
            Section("Columns", [columns], media=SCREEN | Media.NOTEBOOK),
            facts_section(facts),
            *assumption_sections(recording.metadata.get("assumptions", ())),
        ],
    )


def write_recording_report(recording: Recording, path: str) -> None:
    """Write the page of a recording, or its figure alone, by the suffix of the path.

    Raises:
        ParameterError: for another suffix, a recording without enough rows, or a file that cannot
            be written.
    """
    suffix = check_suffix(path, ".html")
    if suffix == ".html":
        digest = text_digest(json_text(recording))
        content = render_page(recording_page(recording), digest).encode()
    else:
        content = figure_bytes(recording, suffix)
    write_bytes("output", path, content)


_CALIBRATION_HEADINGS = ("axis", "wall held", "cycled at", "damping N·s/m", "friction mN", "mass g")
_START_HEADINGS = ("law", "start before", "start now", "change")
_START_NOTE = "start: for q = 1, else divided by q; known damping makes it limit buzz (max_buzz)"


def calibration_page(
    device: Device, calibration: Calibration, path: str, starts: Mapping[str, tuple[float, float]]
) -> Page:
    """Return the measured numbers with their uncertainties, for a terminal.

    Args:
        device: the calibrated device.
        calibration: its calibration.
        path: the device file.
        starts: recommended stiffness [N/m] of each law before and after the calibration, see
            :func:`~asperity.analysis.passivity.recommended_stiffness.unit_starts`.
    """
    force = format_quantity(calibration.max_force, "N")
    axes = "1 axis" if len(calibration.axes) == 1 else f"{len(calibration.axes)} axes"
    rows = [Row(_calibration_cells(axis)) for axis in calibration.axes]
    changes = [Row(_start_cells(law, *pair)) for law, pair in starts.items()]
    numeric = range(1, len(_CALIBRATION_HEADINGS))
    return terminal_page(
        Paragraph(f"{device.name}: {axes}, with up to {force}"),
        Table(_CALIBRATION_HEADINGS, rows, numeric),
        *map(Paragraph, calibration_lines(calibration)),
        Table(_START_HEADINGS, changes, (1, 2, 3)),
        Paragraph(_START_NOTE),
        Paragraph(f"Written: {escape_unprintable(path)}", "code"),
    )


def _start_cells(law: str, before: float, after: float) -> tuple[str, ...]:
    change = NOT_AVAILABLE
    if before and after:
        change = f"{after / before:.2g} times"
    return law, _start_text(before), _start_text(after), change


def _start_text(stiffness: float) -> str:
    return format_quantity(stiffness, "N/m") if stiffness else "none"


def _calibration_cells(axis: AxisCalibration) -> tuple[str, ...]:
    wall = axis.wall
    motion = axis.dynamics
    return (
        axis.name,
        format_quantity(wall.stable_stiffness, "N/m"),
        _start_text(wall.cycling_stiffness or 0.0),
        format_uncertainty(motion.damping),
        format_uncertainty(motion.friction, 1e3),
        format_uncertainty(motion.mass, 1e3),
    )


def device_run_page(setup: Setup, loop: ServoProcess, cause: EndReason, path: str | None) -> Page:
    """Return timing, limits and energy of a loop that has ended, for a terminal."""
    statistics = loop.statistics
    rows = loop.rows(loop.memory.row_count - 1)[0]
    surface = setup.surface
    period = setup.servo.period
    step = setup.servo.position_resolution
    device = setup.device.name
    if not loop.driver.has_moving_handle:
        device += f", {loop.driver.name}"
    span = format_quantity(period * statistics.samples, "s", digits=3)
    lines = [
        f"Law {surface.law.letter}, {readable_name(surface.law.name)}, at "
        f"{format_quantity(surface.stiffness, 'N/m')} on {device}: "
        f"{CAUSE_TEXT[cause]}",
        f"{statistics.samples} samples in {span}, at {format_quantity(1.0 / period, 'Hz')}",
        *timing_lines(statistics),
        *rate_lines(setup.device, period, statistics),
        *limited_lines(statistics, surface.max_depth),
        *[measured_energy_text(float(row[11]), step) for row in rows[-1:]],
        *[f"- {assumption}" for assumption in (*setup.assumptions, *loop.notes)],
    ]
    blocks = [Paragraph(line) for line in lines]
    if path is not None:
        blocks.append(Paragraph(f"Recording: {escape_unprintable(path)}", "code"))
    return terminal_page(*blocks)

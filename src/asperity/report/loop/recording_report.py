"""Reports of a recording and of its replay."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.files import json_text, open_atomic, text_digest, write_text
from asperity.core.units import format_quantity
from asperity.recording.recording import Recording
from asperity.recording.replay import Replay
from asperity.report.comparison_columns import describe_texture
from asperity.report.html import Origin, render_page
from asperity.report.loop.run_report import run_caption
from asperity.report.page import (
    SCREEN,
    Media,
    Page,
    Paragraph,
    Row,
    Section,
    Table,
    TableLayout,
    assumption_sections,
    default_style,
    facts_section,
    picture_section,
    plot_later,
)
from asperity.report.sentences.number_text import readable_name

_MEDIA = Media.HTML | Media.NOTEBOOK
_FIGURE_SUFFIXES = (".svg", ".png", ".pdf")


def recording_answer(recording: Recording) -> str:
    """Return size, surface and completeness of a recording in one or two sentences."""
    period, surface = _row_period(recording.metadata), _surface_metadata(recording.metadata)
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
    servo, every = metadata.get("servo"), metadata.get("every", 1)
    period: Any = servo.get("period") if isinstance(servo, Mapping) else None
    return float(period) * every if _are_positive_numbers(period, every) else 0.0


def _are_positive_numbers(*values: Any) -> bool:
    return all(isinstance(value, (int, float)) and value > 0 for value in values)


def recording_facts(recording: Recording) -> list[tuple[str, str]]:
    """Return names and values of surface, device, hand and motion."""
    about = recording.metadata
    surface, device = _surface_metadata(about), about.get("device")
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
    notes = [Paragraph(note) for note in replay.notes]
    media = Media.TERMINAL | Media.NOTEBOOK
    return Page("", replay_answer(replay), (), [Section("", notes, media=media)] if notes else [])


def recording_page(
    recording: Recording, ranges: tuple[FloatArray, FloatArray] | None = None
) -> Page:
    """Return the report of a recording; ``ranges`` of its columns are read from it by default."""
    caption, text = run_caption(recording.duration)
    columns = columns_table(recording, ranges or recording.ranges())
    facts = recording_facts(recording)
    figure = plot_later(recording)
    picture = picture_section(
        "Motion, force, energy, phase", figure, f"{text}.", caption, media=_MEDIA
    )
    return Page(
        title=f"Recording {recording.path.name}",
        answer=recording_answer(recording),
        facts=facts,
        sections=[
            *([picture] if recording.rows > 1 else ()),
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
    suffix = Path(path).suffix.lower()
    if suffix not in (".html", *_FIGURE_SUFFIXES):
        raise ParameterError("output", f"must end in .html, {', '.join(_FIGURE_SUFFIXES)}", path)
    try:
        if suffix == ".html":
            origin = Origin(content=text_digest(json_text(recording)))
            write_text(path, render_page(recording_page(recording), origin))
            return
        with default_style():
            figure = recording.plot()
            with open_atomic(path) as stream:
                figure.savefig(stream, format=suffix[1:])
    except OSError as error:
        raise ParameterError("output", f"cannot be written: {error.strerror}", path) from None

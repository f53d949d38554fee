"""A recording in a terminal and on a page, and what a replay of it found."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.files import digest, json_text, whole_file, write_text
from asperity.recording.recording import Recording
from asperity.recording.replay import Replay
from asperity.report import page, terminal
from asperity.report.comparison_columns import described
from asperity.report.page import Origin, Page, Row, Section, own_look, page_html, pictured
from asperity.report.pictures.run_picture import recording_figure
from asperity.report.run import run_caption
from asperity.report.terminal import say
from asperity.report.words.number_words import law_title
from asperity.units import engineering

_PICTURES = (".svg", ".png", ".pdf")


def answer(recording: Recording) -> str:
    """Return what a recording holds in one or two sentences."""
    about = recording.about
    rate = f" at {engineering(1.0 / period, 'Hz')}" if (period := _period(about)) else ""
    said = f"{recording.rows} rows, {engineering(recording.duration, 's')}{rate}"
    surface = _surface(about)
    if surface is not None:
        stiffness = engineering(float(surface["stiffness"]), "N/m")
        said += f": law {surface['law']} at {stiffness} on {described(surface['texture'])}"
    return f"{said}. {_ending(recording)}".rstrip()


def _ending(recording: Recording) -> str:
    """Return in a sentence why samples may be missing; nothing if none is."""
    if recording.whole:
        return "" if recording.rows else "Nothing was recorded."
    if not recording.rows:
        return "It was not closed, and no whole block of samples is in it."
    lost = f" ({recording.unread} bytes after it are no whole block)" if recording.unread else ""
    return f"It was not closed: it ends with the last block that was written{lost}."


def _surface(about: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Return what a recording says of its surface; ``None`` if that is not all that is shown."""
    said = about.get("surface")
    names = {"texture", "law", "law_name", "stiffness", "max_depth", "content"}
    if not isinstance(said, Mapping) or not said.keys() >= names:
        return None
    known = isinstance(said["texture"], Mapping) and "kind" in said["texture"]
    return said if known and _are_numbers(said["stiffness"], said["max_depth"]) else None


def _period(about: Mapping[str, Any]) -> float:
    """Return the time from row to row [s]; 0 if it is not said."""
    servo, every = about.get("servo"), about.get("every", 1)
    period: Any = servo.get("period") if isinstance(servo, Mapping) else None
    return float(period) * every if _are_numbers(period, every) else 0.0


def _are_numbers(*values: Any) -> bool:
    return all(isinstance(value, (int, float)) and value > 0 for value in values)


def facts(recording: Recording) -> list[tuple[str, str]]:
    """Return names and values of what was recorded."""
    about = recording.about
    surface, device = _surface(about), about.get("device")
    rows = [("Recorded by", f"asperity {recording.version}, {about.get('made_by', 'unknown')}")]
    if surface is not None:
        law = f"{surface['law']}, {law_title(str(surface['law_name']))}"
        rows += [("Surface", described(surface["texture"])), ("Law", law)]
        rows += [("Stiffness", engineering(float(surface["stiffness"]), "N/m"))]
        rows += [("Pressed to", engineering(float(surface["max_depth"]), "m"))]
        rows += [("Content", str(surface["content"]))]
    if isinstance(device, Mapping):
        rows += [("Device", str(device.get("name")))]
    kinds = [(name.capitalize(), about.get(name)) for name in ("hand", "motion")]
    rows += [(name, str(one.get("kind"))) for name, one in kinds if isinstance(one, Mapping)]
    if period := _period(about):
        rows += [("From row to row", engineering(period, "s"))]
    return rows


def columns_table(recording: Recording, ranges: tuple[FloatArray, FloatArray]) -> page.Table:
    """Return the columns with their least and greatest values, which none has without rows."""
    rows = [
        Row([name, *(f"{one:.6g}" if recording.rows else "" for one in (low, high)), unit])
        for (name, unit), low, high in zip(recording.columns, *ranges, strict=True)
    ]
    return page.Table(["column", "least", "greatest", "unit"], rows, numbers=(1, 2))


def print_recording(
    recording: Recording, ranges: tuple[FloatArray, FloatArray], console: Console
) -> None:
    """Print what a recording holds."""
    say(console, answer(recording), "bold")
    console.print()
    console.print(terminal.table(columns_table(recording, ranges), gap=2))
    console.print()
    for name, value in facts(recording):
        say(console, f"{name}: {value}", "dim")
    terminal.print_assumptions(console, recording.about.get("assumptions", ()))


def replay_answer(found: Replay) -> str:
    """Return what a replay found in one or two sentences."""
    if found.first is None:
        return f"All {found.rows} rows come out the same, bit for bit."
    one = found.first
    unit = "N" if one.column.startswith("commanded") else "m" if "anchor" in one.column else ""
    values = f"{one.replayed!r} instead of {one.recorded!r}".replace("'", "")
    where = f"row {one.row}, at {engineering(one.time, 's')}"
    first = f"the first is {where}: {one.column} is {values} {unit}".rstrip()
    largest = engineering(found.largest, "N", digits=3)
    count = f"{found.differing} of {found.rows} rows differ"
    return f"{count}; {first}. The largest difference of a force is {largest}."


def print_replay(found: Replay, console: Console) -> None:
    """Print what a replay found."""
    say(console, replay_answer(found), "bold")
    for note in found.notes:
        say(console, note)


def recording_page(recording: Recording) -> Page:
    """Return the page of a recording."""
    caption, seen = run_caption(recording.duration)
    figure = recording_figure(recording)
    ranges = columns_table(recording, recording.ranges())
    return Page(
        title=f"Recording {recording.path.name}",
        answer=answer(recording),
        facts=facts(recording),
        sections=[
            pictured("Motion, force, energy, phase", figure, f"{seen}.", caption),
            Section("Columns", [ranges]),
            *page.assumed(recording.about.get("assumptions", ())),
        ],
    )


def save_picture(recording: Recording, path: str) -> None:
    """Write the page of a recording, or its picture alone, by the suffix of the path.

    Raises:
        ParameterError: for another suffix, or a file that cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".html", *_PICTURES):
        raise ParameterError("output", f"must end in .html, {', '.join(_PICTURES)}", path)
    try:
        with own_look():
            if suffix == ".html":
                origin = Origin(content=digest(json_text(recording)))
                write_text(path, page_html(recording_page(recording), origin))
                return
            figure = recording_figure(recording)
            with whole_file(path) as stream:
                figure.savefig(stream, format=suffix[1:])
    except OSError as error:
        raise ParameterError("output", f"cannot be written: {error.strerror}", path) from None

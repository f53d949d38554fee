"""A measured file in numbers: in a terminal, and as a page with what each step took away."""

from __future__ import annotations

from rich.console import Console

from asperity.measured.correlation import MOST_POINTS
from asperity.measured.history import Stage
from asperity.measured.length_words import by_text, lengths_text
from asperity.measured.prepared import Prepared
from asperity.report import page, stages, terminal
from asperity.textures.shown import Shown, thinned
from asperity.units import engineering


def summary(prepared: Prepared) -> str:
    """Return a surface in one line: size, pitch, heights.

    Example:
        >>> import numpy as np
        >>> summary(Prepared(np.array([0.0, 1e-6, 0.0, 1e-6]), (1e-5,), ()))
        '4 points, pitch 10 µm, peak to valley 1 µm, RMS 500 nm'
    """
    heights = prepared.heights
    span = float(heights.max()) - float(heights.min())
    parts = [
        f"{by_text(heights.shape[::-1])} points",
        f"pitch {lengths_text(prepared.pitch)}",
        f"peak to valley {engineering(span, 'm')}",
        f"RMS {engineering(float(heights.std()), 'm')}",
    ]
    if prepared.filled is not None:
        parts.append(f"{100.0 * float(prepared.filled.mean()):.2g} % filled")
    if prepared.periodic:
        parts.append("periodic")
    return ", ".join(parts)


def lay_text(shown: Shown) -> str:
    """Return autocorrelation length and texture aspect ratio in words; empty for a profile."""
    heights, (length, ratio) = shown.prepared.heights, shown.correlation
    if heights.ndim == 1:
        return ""
    if heights.size > MOST_POINTS:
        return f"Sal and Str are computed of at most {MOST_POINTS} points."
    if length is None:
        return "Sal: none; along no direction the correlation falls to 0.2 within half of the map."
    text = f"Sal {engineering(length, 'm')} (autocorrelation length)"
    if ratio is None:
        return f"{text}; Str: none, along some direction the correlation stays above 0.2 (a lay)."
    return f"{text}, Str {ratio:.2g} (texture aspect ratio: 1 alike along all directions, 0 a lay)."


# --- in a terminal --------------------------------------------------------------------------------


def print_shown(shown: Shown, console: Console) -> None:
    """Print the answer, the parameters after each step and the parts of the surface."""
    terminal.say(console, stages.texture_text(shown.parts), "bold")
    terminal.say(console, summary(shown.prepared))
    console.print()
    if shown.prepared.history:
        stages.print_stages(shown.prepared.history, console)
        console.print()
    console.print(terminal.table(stages.parts_table(shown.parts), styles={"l": "bold"}))
    console.print()
    for words in (stages.parts_text(shown.parts), lay_text(shown)):
        if words:
            terminal.say(console, words, "dim")
    print_steps(shown.prepared, console)


def print_steps(prepared: Prepared, console: Console) -> None:
    """Print what was done, in order."""
    terminal.head(console, "What was done:")
    numbered = ((f"{number}", step) for number, step in enumerate(prepared.steps, start=1))
    console.print(terminal.pairs(numbered))


# --- as a page ------------------------------------------------------------------------------------


def shown_page(shown: Shown) -> page.Page:
    """Return the report: parameters, parts, and each step before, after and taken away."""
    history = shown.prepared.history
    numbers = [page.Section("After each step", [stages.stages_table(history)])] if history else []
    defined = (
        [page.Section("What the parameters are", [stages.definitions(history)])] if history else []
    )
    return page.Page(
        title=f"The surface {shown.source} in numbers",
        answer=stages.texture_text(shown.parts),
        facts=[("Surface", summary(shown.prepared))],
        sections=[
            *numbers,
            _parts(shown),
            *_pictures(shown),
            page.Section("What was done", [page.Items(shown.prepared.steps)]),
            *page.added_sections(Shown, shown),
            *defined,
        ],
    )


def _parts(shown: Shown) -> page.Section:
    blocks: list[page.Block] = [stages.parts_table(shown.parts)]
    notes = [words for words in (stages.parts_text(shown.parts), lay_text(shown)) if words]
    return page.Section("What of it is texture", blocks, notes=notes)


def _pictures(shown: Shown) -> list[page.Section]:
    from asperity.report.pictures.step_picture import heights_figure, step_figure

    if not shown.changes:
        figure = heights_figure({"heights": thinned(shown.prepared.heights)}, shown.sides)
        seen = f"The surface as it was prepared: {summary(shown.prepared)}."
        return [page.pictured("The surface", figure, seen, "As it was prepared.")]
    made = []
    for number, change in enumerate(shown.changes):
        words = f"Before, after, and what the step took away: {taken_text(change.stage)}"
        title = change.stage.name[0].upper() + change.stage.name[1:]
        figure = step_figure(change)
        made.append(
            page.pictured(title, figure, f"{title}. {words}.", words, level=3 if number else 2)
        )
    return made


def taken_text(stage: Stage) -> str:
    """Return what a step took, in words: "12.3 nm RMS, range 1.2 µm"."""
    if stage.removed is None:
        return "nothing"
    rms, span = engineering(stage.removed.rms, "m"), engineering(stage.removed.range, "m")
    return f"{rms} RMS, range {span}"

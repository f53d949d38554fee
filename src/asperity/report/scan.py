"""Energy per stroke against speed and depth: in a terminal, and as a page."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rich.console import Console

from asperity.report import page, terminal
from asperity.report.page import Cell, Cells, Page, Row, Section, added_sections, assumed, pictured
from asperity.report.run import FOOTER, facts_of_loop
from asperity.report.terminal import say
from asperity.scene.setup import Setup
from asperity.simulation.scan import Stroke
from asperity.units import engineering

HEADINGS = ("law", "speed", "depth", "x", "y", "z", "sum", "field", "±", "paper's", "lost")
NOTES = (
    "Energies in mJ per stroke: work of the held force on the true motion, mean over whole "
    "turns, there and back, after the first stroke; positive feeds the hand. Field: what the law "
    "itself gives along the true path, without sampling, delay and steps of the encoder, which "
    "make up the rest; ±: from turn to turn, and of its quadrature. Paper's: its sum of force and "
    "step of the same sample. Depth: of the handle below z = 0, on average. Lost: how often per "
    "stroke contact ended.",
)


def milli(value: float, *, sign: bool = True) -> str:
    """Return an energy [J] as text in mJ."""
    size = abs(value)
    digits = 0 if size >= 1.0 else 1 if size >= 0.1 else 2 if size >= 1e-4 else 4
    text = f"{1e3 * value:+.{digits}f}" if sign else f"{1e3 * value:.{digits}f}"
    return "0" if not text.strip("+-0.") else text


def _cells(stroke: Stroke) -> Cells:
    depth = engineering(stroke.reached, "m", digits=2)
    place: Cells = [Cell(stroke.law, "l"), engineering(stroke.speed, "m/s"), depth]
    if stroke.stopped:
        stopped = Cell("stopped", summary="Why", details=[("stopped", stroke.stopped)])
        return [*place, "", "", "", stopped, "", "", "", ""]
    return [
        *place,
        *[milli(value) for value in stroke.energy],
        milli(stroke.total),
        Cell(milli(stroke.field), "no" if stroke.feeds else ""),
        milli(stroke.spread + stroke.error, sign=False),
        milli(sum(stroke.same_sample)),
        f"{stroke.lost_contact:.3g}",
    ]


def _table(found: Sequence[Stroke]) -> page.Table:
    return page.Table(
        HEADINGS, [Row(_cells(one), law=one.law) for one in found], range(1, len(HEADINGS))
    )


def answer(found: Sequence[Stroke]) -> str:
    """Return which laws feed the hand, and which do so by their field, in two sentences."""
    by_all = _grouped(found, lambda stroke: stroke.total > stroke.spread + stroke.error)
    by_field = _grouped(found, lambda stroke: stroke.feeds)
    return f"A stroke feeds the hand: {by_all}. The law's field itself feeds it: {by_field}."


def _grouped(found: Sequence[Stroke], feeds: Callable[[Stroke], bool]) -> str:
    laws = list(dict.fromkeys(stroke.law for stroke in found))
    groups: dict[str, list[str]] = {"always": [], "at times": [], "never": []}
    for law in laws:
        gains = [feeds(stroke) for stroke in found if stroke.law == law]
        groups["always" if all(gains) else "at times" if any(gains) else "never"].append(law)
    return ", ".join(f"{', '.join(laws)} {when}" for when, laws in groups.items() if laws)


def print_scans(setup: Setup, found: Sequence[Stroke], console: Console) -> None:
    """Print answer, table and assumptions."""
    say(console, answer(found), "bold")
    console.print()
    # A number that is too wide goes on in the next line: no digit is ever cut.
    shown = terminal.table(
        _table(found), wraps=range(len(HEADINGS)), without=(HEADINGS.index("y"),),
        styles={"no": "red"}, gap=2, ruled=False,
    )  # fmt: skip
    console.print(shown)
    say(console, f"{' '.join(NOTES)} The y axis: --html, --json.", "dim")
    for reason in sorted({stroke.stopped for stroke in found if stroke.stopped}):
        say(console, f"Stopped: it {reason}", "dim")
    terminal.print_assumptions(console, setup.assumptions)


def scan_page(setup: Setup, found: Sequence[Stroke]) -> Page:
    """Return the report of the strokes."""
    from asperity.report.pictures.sweep_pictures import scan_figure

    caption = (
        "Energy that the texture supplies per stroke: thick the sum, orange along x, blue along z. "
        "Above the line it feeds the hand."
    )
    laws = ", ".join(dict.fromkeys(stroke.law for stroke in found))
    seen = f"Energy of a stroke over its speed, a panel for each of the laws {laws}."
    return Page(
        title=f"What a stroke gains, {setup.device.name}",
        answer=answer(found),
        facts=facts_of_loop(setup),
        sections=[
            pictured("Energy per stroke", scan_figure(found), seen, caption),
            Section("In numbers", [_table(found)], notes=NOTES),
            *added_sections(Stroke, setup, found),
            *assumed(setup.assumptions),
        ],
        footer=FOOTER,
    )

"""Report of a renderer that was searched, and of recordings of a loop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from asperity.certification.certify import Certification
from asperity.certification.loop_search import ClosedLoop
from asperity.certification.recorded_loop import RecordedCertification
from asperity.certification.witnesses import BaselineDifference
from asperity.core.units import format_quantity
from asperity.devices import Device
from asperity.report.document.page import (
    SCREEN,
    Page,
    Paragraph,
    Picture,
    Row,
    Section,
    Table,
    TableLayout,
)
from asperity.report.sentences.certification_sentences import (
    certification_answer,
    device_sentences,
    difference_sentence,
    point_text,
    recording_answer,
    resolution_text,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_FOOTER = "Found by search: every number is a lower bound with a witness, and nothing is proved."
_JUMPS_SHOWN = 10


def certification_page(
    result: Certification,
    device: Device | None = None,
    difference: BaselineDifference | None = None,
) -> Page:
    """Return the report of a renderer that was searched.

    Args:
        result: what was found.
        device: to compare with.
        difference: from a baseline.
    """
    answer = certification_answer(result)
    if difference is not None:
        answer = f"It differs from the baseline. {difference_sentence(difference)} {answer}"
    sections = [Section("What was found", [_findings_table(result)], media=SCREEN)]
    if device is not None:
        texts = [Paragraph(text) for text in device_sentences(result, device)]
        sections.append(Section("On the device", texts, media=SCREEN))
    if result.worst_loop is not None:
        text = "The closed path that gains most energy; the force does work along it."
        picture = Picture(partial(_loop_figure, result.worst_loop), text)
        sections.append(Section("The worst loop", [picture]))
    if result.jumps:
        sections.append(Section("Jumps", [_jumps_table(result)]))
    return Page("Certification of a renderer", answer, (), sections, _FOOTER)


def _findings_table(result: Certification) -> Table:
    gain = format_quantity(result.gain, "N/m", digits=5)
    one_sided = format_quantity(result.one_sided_gain, "N/m", digits=5)
    spread = format_quantity(result.history_spread, "N", digits=3)
    force = format_quantity(result.largest_force, "N", digits=4)
    largest = max((jump.size for jump in result.jumps), default=math.nan)
    jump_places = "–"
    if result.jumps:
        jump_places = f"{len(result.jumps)} places; {point_text(result.jumps[0].at)}"
    rows = [
        ("gain", gain, _gain_place(result.gain_witness)),
        ("one-sided gain", one_sided, _gain_place(result.one_sided_witness)),
        ("worst loop", *_loop_texts(result)),
        ("jumps", _quantity_or_none(largest, "N"), jump_places),
        ("by approach", spread, point_text(result.history.at)),
        ("force", force, point_text(result.largest_at)),
        (
            "contact begins",
            _contact_text(result),
            f"dead zones: {100.0 * result.contact.dead:.2f} %",
        ),
        (
            "not finite",
            "found" if result.invalid_at else "not found",
            point_text(result.invalid_at),
        ),
        ("time of a call", *_cost_texts(result)),
        ("resolution", resolution_text(result), ""),
    ]
    layout = TableLayout(wrap=(1, 2), max_widths={1: 26, 2: 44})
    return Table(("", "at least", "where"), [Row(row) for row in rows], layout=layout)


def _loop_texts(result: Certification) -> tuple[str, str]:
    """Return the energy of the worst loop, and its error, length and held-force work."""
    loop = result.worst_loop
    densest = result.densest_loop
    if loop is None or densest is None:
        return "none found", f"{result.rejected_loops} within their errors"
    energy = format_quantity(loop.energy, "J", digits=4)
    error = format_quantity(loop.error, "J", digits=2)
    length = format_quantity(loop.length, "m", digits=3)
    held = format_quantity(loop.held_energy, "J", digits=3)
    speed = format_quantity(densest.critical_speed(1.0), "m/s", digits=3)
    text = f"± {error}; {length} long; {held} with the force held at 1 kHz and 0.1 m/s; "
    return energy, f"{text}damping of 1 N s/m absorbs all loops found from {speed} on"


def _gain_place(witness: Any) -> str:
    return "–" if witness is None else point_text(witness.start)


def _quantity_or_none(value: float, unit: str) -> str:
    return "none found" if math.isnan(value) else format_quantity(value, unit, digits=4)


def _contact_text(result: Certification) -> str:
    low = format_quantity(result.contact.lowest, "m", digits=4)
    high = format_quantity(result.contact.highest, "m", digits=4)
    return f"{low} to {high}"


def _cost_texts(result: Certification) -> tuple[str, str]:
    cost = result.cost
    high = format_quantity(cost.percentile_999, "s", digits=2)
    largest = format_quantity(cost.largest, "s", digits=2)
    return format_quantity(cost.median, "s", digits=2), f"99.9 %: {high}; longest {largest}"


def _jumps_table(result: Certification) -> Table:
    rows = []
    for jump in result.jumps[:_JUMPS_SHOWN]:
        size = format_quantity(jump.size, "N", digits=3)
        length = format_quantity(jump.length, "m", digits=2)
        rows.append(Row((size, length, point_text(jump.at))))
    return Table(("size", "over", "where"), rows)


def _loop_figure(loop: ClosedLoop) -> Figure:
    from asperity.report.pictures.certification_pictures import loop_figure

    return loop_figure(loop)


def replay_page(rows: Sequence[dict[str, Any]]) -> Page:
    """Return the comparison of replayed witnesses with what was recorded of them."""
    units = {"gain": "N/m", "one-sided gain": "N/m", "loop": "J", "jump": "N"}
    table = []
    for row in rows:
        unit = units[row["witness"]]
        recorded = format_quantity(row["recorded"], unit, digits=6)
        replayed = format_quantity(row["replayed"], unit, digits=6)
        table.append(Row((row["witness"], recorded, replayed)))
    section = Section("", [Table(("witness", "recorded", "replayed"), table)], media=SCREEN)
    return Page("Replay of witnesses", "The witnesses along the same paths.", (), [section])


def recordings_page(results: Sequence[RecordedCertification]) -> Page:
    """Return the report of one or two recordings, side by side."""
    answer = " ".join(recording_answer(result) for result in results)
    rows = [Row((name, *values)) for name, *values in _recording_rows(results)]
    headings = ("", *[result.name for result in results])
    sections = [Section("What they show", [Table(headings, rows)], media=SCREEN)]
    picture = Picture(
        partial(_energy_figure, results), "Energy that the surface gave the hand, along each axis."
    )
    sections.append(Section("Energy", [picture]))
    footer = "after Campion and Hayward, “On the Synthesis of Haptic Textures”, section V.B"
    return Page("Certification of recordings", answer, (), sections, footer)


def _recording_rows(results: Sequence[RecordedCertification]) -> list[tuple[str, ...]]:
    columns = [
        {
            "samples": str(result.samples),
            "period": format_quantity(result.period, "s", digits=4),
            "late, missing": f"{result.late_samples}, {result.missing_samples}",
            "energy, held force": format_quantity(result.energy, "J", digits=4),
            "energy, trapezoidal": format_quantity(result.trapezoidal_energy, "J", digits=4),
            "greatest energy given": format_quantity(result.violation, "J", digits=4),
            "there": point_text(result.violated_at),
            "gain, at least": format_quantity(result.gain, "N/m", digits=4),
            "stiffness in contact": _quantity_or_none(result.stiffness, "N/m"),
            "lag [samples]": str(result.lag),
            "greatest force": format_quantity(result.largest_force, "N", digits=4),
            "greatest step of force": format_quantity(result.largest_force_step, "N", digits=4),
        }
        for result in results
    ]
    return [(name, *[column[name] for column in columns]) for name in columns[0]]


def _energy_figure(results: Sequence[RecordedCertification]) -> Figure:
    from asperity.report.pictures.certification_pictures import energy_figure

    return energy_figure(results)

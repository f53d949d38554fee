"""Report of a measured surface: roughness parameters after each preparation step."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from asperity.core.cache import get_or_compute
from asperity.core.checks import FloatArray
from asperity.core.errors import escape_unprintable
from asperity.core.units import format_quantity
from asperity.measured.form import SurfaceDecomposition, decompose_surface
from asperity.measured.parameters import SurfaceParameter, find_parameter
from asperity.measured.prepared import PreparationStage, PreparedSurface
from asperity.measured.reading.measured_file import MeasurementSummary, StepChange, decimate
from asperity.report.document.page import (
    HEADED,
    SCREEN,
    BulletList,
    Cell,
    Media,
    Page,
    Paragraph,
    Row,
    Section,
    Table,
    TableLayout,
    figure_section,
    pairs_table,
    picture_section,
    terminal_section,
)
from asperity.report.sentences.surface_text import (
    lay_text,
    measurement_answer,
    parts_text,
    removed_text,
    roughness_text,
    surface_summary_text,
    texture_text,
)
from asperity.report.sentences.texts import NOT_AVAILABLE, decimal_text, sentence_case
from asperity.textures.fields.potential_field import PotentialField
from asperity.textures.texture import Texture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_RMS = find_parameter("Sq")
_REMOVED = {"removed, RMS": "rms", "removed, range": "range"}
# Columns of maps and profiles by importance, for narrow consoles.
_PRIORITY = (
    *("Sq", "q", "Sz", "z", "removed, RMS", "Sa", "a", "Sdq", "Sm", "dq", "Sdr", "Ssk", "sk"),
    *("Sku", "ku", "removed, range", "t", "Sp", "p", "Sv", "v"),
)
_LENGTH_UNITS = (("m", 1.0), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9))
_Column = tuple[str, list[Cell]]  # heading and cells
_REMOVED_MEANING = ("removed", "deviation that the step removed: RMS about the mean, and range")


def stages_table(stages: Sequence[PreparationStage]) -> Table:
    """Return the parameters after each step, and what it removed; one unit per column."""
    kinds = "/".join(dict.fromkeys([next(iter(stage.values))[0] for stage in stages]))
    columns = [("after", [Cell(stage.name, "l") for stage in stages])]
    keys = [""]
    legend = {}
    for index, symbol in enumerate(stages[-1].values):
        parameter = find_parameter(symbol)
        name = kinds + symbol[1:]
        numbers = [list(stage.values.values())[index] for stage in stages]
        legend[len(columns)] = (name, parameter.description)
        columns.append(_number_column(name, parameter, numbers))
        keys.append(parameter.symbol)
    for name, attribute in _REMOVED.items():
        values = [getattr(stage.removed, attribute, None) for stage in stages]
        columns.append(_number_column(name, _RMS, values))
    keys += _REMOVED
    layout = TableLayout(
        drop_order=sorted(range(1, len(keys)), key=lambda i: _PRIORITY.index(keys[i])),
        legend={**legend, len(keys): _REMOVED_MEANING},
        dropped_note="More in a wider terminal, and in the JSON.",
    )
    return _columns_table(columns, layout)


def _columns_table(columns: Sequence[_Column], layout: TableLayout) -> Table:
    headings, cells = zip(*columns, strict=True)
    rows = [Row(row) for row in zip(*cells, strict=True)]
    return Table(headings, rows, range(1, len(headings)), layout)


def _number_column(
    name: str, parameter: SurfaceParameter, values: Sequence[float | None]
) -> _Column:
    """Return a column of values in their best unit, its heading broken into lines."""
    unit = ""
    size = 1.0
    if parameter.symbol == "Sdr":
        unit = "%"
        size = 0.01
    elif parameter.unit:
        unit, size = _choose_unit(values)
    texts = [NOT_AVAILABLE if value is None else decimal_text(value / size) for value in values]
    heading = f"{name} [{unit}]" if unit else name
    return heading.replace(", ", ",\n").replace(" [", "\n["), [Cell(text) for text in texts]


def _choose_unit(values: Iterable[float | None]) -> tuple[str, float]:
    greatest = max([abs(value) for value in values if value is not None], default=0.0)
    if greatest == 0.0:
        return "", 1.0
    fitting = [unit for unit in _LENGTH_UNITS if greatest >= unit[1]]
    return fitting[0] if fitting else _LENGTH_UNITS[-1]


def _definition_sections(prepared: PreparedSurface) -> list[Section]:
    """Return symbol, name, formula and standard of each parameter, if there are any."""
    if not prepared.history:
        return []
    rows = []
    for symbol in prepared.history[-1].values:
        parameter = find_parameter(symbol)
        cells = [parameter.description, parameter.formula, parameter.reference]
        rows.append(Row([Cell(symbol, "l"), *cells]))
    table = Table(("symbol", "parameter", "formula", "standard"), rows)
    return [Section("Definitions of the parameters", [table])]


# --- form, waviness, texture ----------------------------------------------------------------------


def parts_table(parts: SurfaceDecomposition) -> Table:
    """Return RMS and range of form, waviness and texture."""
    named = {"form": parts.form, "waviness": parts.waviness, "texture": parts.texture}
    columns = [
        ("part", [Cell(name, "l") for name in named]),
        _number_column("RMS", _RMS, [part.rms for part in named.values()]),
        _number_column("range", _RMS, [part.range for part in named.values()]),
    ]
    return _columns_table(columns, TableLayout())


def measured_sections(texture: Texture) -> list[Section]:
    """Return the section of the parameters of a measured surface; none for other textures."""
    if not texture.history:
        return []
    table = stages_table(texture.history)
    more = "More is in the report of the measured file."
    if text := roughness_text(texture.history):
        return [Section("Surface parameters", [table], text, [more])]
    parts = get_or_compute("parts", texture.digest, lambda: _compute_parts(texture))
    blocks = [table, parts_table(parts)]
    notes = [parts_text(parts), more]
    return [Section("Surface parameters", blocks, texture_text(parts), notes)]


def _compute_parts(texture: Texture) -> SurfaceDecomposition:
    heights, pitch, periodic = texture.samples()
    parts = decompose_surface(heights, pitch, periodic=periodic)
    return replace(parts, heights=np.zeros(0))  # the cache needs the numbers alone


# --- pages ----------------------------------------------------------------------------------------


def surface_summary_page(summary: MeasurementSummary) -> Page:
    """Return the report: parameters, parts, and the surface before and after each step."""
    prepared = summary.prepared
    title = "After each step"
    sections = [
        terminal_section(Paragraph(surface_summary_text(prepared))),
        *_stage_sections(prepared, title),
        *_parts_sections(summary),
        *_figure_sections(summary),
        *_step_sections(prepared),
        *_definition_sections(prepared),
    ]
    return Page(
        title=f"Parameters of the surface {summary.source}",
        answer=measurement_answer(summary),
        facts=[("Surface", surface_summary_text(prepared))],
        sections=sections,
    )


def preparation_page(prepared: PreparedSurface, path: str) -> Page:
    """Return the steps of a preparation, for a terminal: parameters, size and path of the file."""
    blocks = [
        Paragraph(surface_summary_text(prepared), "code"),
        Paragraph(f"Saved: {escape_unprintable(path)}", "code"),
    ]
    last = terminal_section(*blocks)
    return Page("", "", (), [*_step_sections(prepared), *_stage_sections(prepared, ""), last])


def _stage_sections(prepared: PreparedSurface, title: str) -> list[Section]:
    if not prepared.history:
        return []
    return [Section(title, [stages_table(prepared.history)], media=SCREEN)]


def _step_sections(prepared: PreparedSurface) -> list[Section]:
    """Return the preparation steps, numbered in a terminal."""
    numbered = [(f"{number}", step) for number, step in enumerate(prepared.steps, start=1)]
    return [
        Section("Preparation", [BulletList(prepared.steps)]),
        Section("Preparation:", [pairs_table(numbered)], media=HEADED),
    ]


def _parts_sections(summary: MeasurementSummary) -> list[Section]:
    lay = list(filter(None, [lay_text(summary)]))
    media = SCREEN | Media.NOTEBOOK
    if summary.parts is None:
        return [Section("Lay", [], notes=lay, media=media)] if lay else []
    notes = [parts_text(summary.parts), *lay]
    table = parts_table(summary.parts)
    return [Section("Form, waviness and texture", [table], notes=notes, media=media)]


def _figure_sections(summary: MeasurementSummary) -> list[Section]:
    if not summary.changes:
        size = surface_summary_text(summary.prepared)
        description = f"The surface after preparation: {size}."
        heights = {"heights": decimate(summary.prepared.heights)}
        figure = partial(_draw_heights, heights, summary.sides)
        return [picture_section("The surface", figure, description, "After preparation.")]
    first, *others = summary.changes
    return [_change_section(first, 2), *(_change_section(change, 3) for change in others)]


def _change_section(change: StepChange, level: int) -> Section:
    """Return the picture of what a step of the preparation changed."""
    caption = f"Before, after, and what the step removed: {removed_text(change.stage)}"
    title = sentence_case(change.stage.name)
    removed = change.before - change.after
    maps = {"before": change.before, "after": change.after, "removed": removed}
    figure = partial(_draw_heights, maps, change.sides)
    return picture_section(title, figure, f"{title}. {caption}.", caption, level=level)


def _draw_heights(heights_by_title: Mapping[str, FloatArray], sides: tuple[float, ...]) -> Figure:
    from asperity.report.pictures.surface_pictures import heights_figure

    return heights_figure(heights_by_title, sides)


def field_page(field: PotentialField, path: str) -> Page:
    """Return the numbers of a baked field, for a terminal, and the path of its file."""
    lowest = round(max(field.grid.floor, field.extremes[0] - field.max_depth), 12)
    floor = format_quantity(lowest, "m")
    bound = format_quantity(field.accuracy.bound, "m")
    equal = format_quantity(round(field.grid.bounded_floor, 12), "m")
    onset = format_quantity(field.grid.onset_bound(field.passes), "m")
    *others, baked = field.preparation
    texts = (
        *[f"{text}." for text in others],
        f"{baked}; a spline through exact depths differs by at most {bound} times the stiffness"
        f" above z = {equal}, and its contact begins at most {onset} above the surface, proved.",
        f"q⁺ at most {field.one_sided.upper:.4g}. Valid down to z = {floor}. {field.bytes} bytes.",
        f"File: {escape_unprintable(path)}",
    )
    numbers = Section("", [Paragraph(text) for text in texts], media=SCREEN)
    return Page("Baked field", "", (), [numbers, *thin_sections(field)])


def thin_sections(texture: Texture) -> list[Section]:
    """Return the picture of the thin parts of a body; none without any."""
    if texture.thin_map is None:
        return []
    from asperity.report.pictures.surface_pictures import thin_parts_figure

    depth = format_quantity(texture.depth_limit, "m")
    half = format_quantity(texture.thin_regions[0].half_thickness, "m")
    figure = partial(thin_parts_figure, texture, texture.thin_map)
    count = len(texture.thin_regions)
    return [figure_section("field.thin", figure, depth=depth, count=count, half=half)]

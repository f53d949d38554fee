"""A preparation in surface parameters: one row per step, one column per parameter."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from rich.console import Console

from asperity.kept import kept
from asperity.measured.history import Stage
from asperity.measured.parameters import Parameter, declared
from asperity.measured.parts import Parts, texture_part
from asperity.report import page, terminal
from asperity.textures.texture import Texture
from asperity.units import engineering

TOOK = ("took, RMS", "took, range")
_WANTED = (
    "Sq", "q", "Sz", "z", TOOK[0], "Sa", "a", "Sdq", "Sm", "dq", "Sdr", "Ssk", "sk", "Sku", "ku",
    TOOK[1], "t", "Sp", "p", "Sv", "v",
)  # fmt: skip
"""The columns of maps and profiles, by how much they are wanted on a narrow console."""

_UNITS = (("m", 1.0), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9))
_NONE = "–"


def stages_table(stages: Sequence[Stage]) -> page.Table:
    """Return the parameters after each step, and what each took; one unit per column."""
    kinds = list(dict.fromkeys(next(iter(stage.values))[0] for stage in stages))
    headings, columns = ["after"], [[page.Cell(stage.name, "l") for stage in stages]]
    for index, symbol in enumerate(stages[-1].values):
        values = [list(stage.values.values())[index] for stage in stages]
        heading, cells = _column("/".join(kinds) + symbol[1:], declared(symbol), values)
        headings.append(heading)
        columns.append(cells)
    took = [(None, None) if s.removed is None else (s.removed.rms, s.removed.range) for s in stages]
    for name, taken in zip(TOOK, zip(*took, strict=True), strict=True):
        heading, cells = _column(name, declared("Sq"), taken)
        headings.append(heading)
        columns.append(cells)
    rows = [page.Row(cells) for cells in zip(*columns, strict=True)]
    return page.Table(headings, rows, range(1, len(headings)))


def _column(
    heading: str, meaning: Parameter, values: Iterable[float | None]
) -> tuple[str, list[page.Cell]]:
    """Return a heading with its unit, and the values in it."""
    values = list(values)
    if meaning.symbol == "Sdr":
        unit, size = "%", 0.01
    elif meaning.unit:
        unit, size = _unit_of(values)
    else:
        unit, size = "", 1.0
    cells = [_NONE if value is None else plain_number(value / size) for value in values]
    return f"{heading} [{unit}]" if unit else heading, [page.Cell(text) for text in cells]


def _unit_of(values: Iterable[float | None]) -> tuple[str, float]:
    greatest = max((abs(value) for value in values if value is not None), default=0.0)
    if greatest == 0.0:
        return "", 1.0
    return next(((name, size) for name, size in _UNITS if greatest >= size), _UNITS[-1])


def plain_number(value: float) -> str:
    """Return three significant digits without a power of ten, where six places allow it.

    Example:
        >>> [plain_number(value) for value in (1234.5, 12.345, -0.0012345, 1e-9, 0.0)]
        ['1234', '12.3', '-0.00123', '1e-09', '0']
    """
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    places = max(0, 2 - math.floor(math.log10(abs(value))))
    return f"{value:.{places}f}" if places <= 6 else f"{value:.0e}"


def print_stages(stages: Sequence[Stage], console: Console) -> None:
    """Print the table, as many columns of it as fit, and what they mean."""
    table = stages_table(stages)
    meant = [declared(symbol) for symbol in stages[-1].values]
    keys = ["", *(one.symbol for one in meant), *TOOK]
    order = sorted(range(1, len(keys)), key=lambda i: _WANTED.index(keys[i]))
    stacked = [heading.replace(", ", "\n").replace(" [", "\n[") for heading in table.headings]
    shown = replace(table, headings=stacked)
    left_out = terminal.too_wide(shown, order, console.width)
    console.print(terminal.table(shown, without=left_out, styles={"l": "bold"}))
    console.print()
    kept = [i for i in range(1, len(keys)) if i not in left_out and keys[i] not in TOOK]
    meanings = [(table.headings[i].split(" [")[0], meant[i - 1].words) for i in kept]
    meanings.append(("took", "what the step took away: RMS about the mean, and range"))
    console.print(terminal.pairs(meanings, "dim"))
    if left_out:
        terminal.say(console, "More in a wider terminal, and with --json.", "dim")


def definitions(stages: Sequence[Stage]) -> page.Table:
    """Return symbol, name, formula and standard of each parameter."""
    rows = []
    for symbol in stages[-1].values:
        one = declared(symbol)
        rows.append(page.Row([page.Cell(symbol, "l"), one.words, one.formula, one.clause]))
    return page.Table(("symbol", "what it is", "formula", "standard"), rows)


# --- form, waviness, texture ----------------------------------------------------------------------


def parts_table(parts: Parts) -> page.Table:
    """Return RMS and range of form, waviness and texture."""
    named = {"form": parts.form, "waviness": parts.waviness, "texture": parts.texture}
    rms = _column("RMS", declared("Sq"), [part.rms for part in named.values()])
    span = _column("range", declared("Sq"), [part.range for part in named.values()])
    rows = [
        page.Row([page.Cell(name, "l"), a.text, b.text])
        for name, a, b in zip(named, rms[1], span[1], strict=True)
    ]
    return page.Table(("part", rms[0], span[0]), rows, (1, 2))


def surface_sections(texture: Texture) -> list[page.Section]:
    """Return the section that says a measured surface in numbers; none of any other."""
    if not texture.history:
        return []
    parts = kept("parts", texture.content, lambda: _parts(texture))
    blocks = [stages_table(texture.history), parts_table(parts)]
    notes = [parts_text(parts), "More: asperity show."]
    return [page.Section("The surface in numbers", blocks, texture_text(parts), notes)]


def _parts(texture: Texture) -> Parts:
    heights, pitch, periodic = texture.samples()
    parts = texture_part(heights, pitch, periodic=periodic)
    return replace(parts, heights=np.zeros(0))  # nobody looks at them here


def parts_text(parts: Parts) -> str:
    """Return how the parts are told apart, in one sentence."""
    return (
        "Form: the least-squares polynomial of second degree. Waviness: longer than about "
        f"{engineering(parts.nesting, 'm')} (Gaussian L-filter, ISO 16610). Texture: the rest."
    )


def texture_text(parts: Parts) -> str:
    """Return how much of the surface is texture, in one sentence."""
    rms = engineering(parts.texture.rms, "m")
    return (
        f"Texture of {rms} RMS in waves shorter than {engineering(parts.nesting, 'm')}, on a form "
        f"of {engineering(parts.form.rms, 'm')} and a waviness of "
        f"{engineering(parts.waviness.rms, 'm')} RMS."
    )

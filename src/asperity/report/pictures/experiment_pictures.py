"""The simulated experiments of section V as pictures and tables of a report."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.paper.experiments import Experiments
from asperity.paper.experiments.beyond import BeyondExperiment, DeviceOnset
from asperity.paper.experiments.bump import BumpExperiment
from asperity.paper.experiments.passivity import Count, PassivityExperiment
from asperity.paper.experiments.scanning import ScanningExperiment
from asperity.paper.experiments.settings import bump_setup
from asperity.report.onset_report import (
    HEADINGS,
    NOTES,
    NUMBERS,
    cells,
    kinds,
    newton,
    onset_figure,
)
from asperity.report.page import Grid, Picture, Row
from asperity.report.pictures import style
from asperity.report.scan_report import milli
from asperity.units import engineering

_COLOURS = {
    "A": style.ORANGE, "B": style.SOFT, "D": style.BLUE, "E": "#cc79a7", "H": style.GREEN,
}  # fmt: skip


def experiment_parts(found: Experiments) -> list[Picture | Grid]:
    """Return the experiments' pictures and tables in order."""
    return [
        _cycles(found.passivity),
        _onsets(found.passivity),
        _onset_table(found.passivity),
        _energies(found.scanning),
        _strokes(found.scanning),
        _bumps(found.bump),
        _devices(found),
        _device_table(found.beyond),
    ]


# --- section V.A ----------------------------------------------------------------------------------


def _cycles(found: PassivityExperiment) -> Picture:
    lag = found.counts[0].delay
    caption = (
        "Figure 5 in simulation: a rubber band pulls the handle into the wall. Height of the "
        f"handle after the release, one of {found.counts[0].starts} starts, at a loop lag of {lag} "
        "samples. Cycling: still moving after 2 s and not calming down."
    )
    source = style.data_uri(cycles_figure(found))
    return Picture("V.A, who begins to cycle", caption, source, _fitted(found.fitted))


def _fitted(sentences: Sequence[str]) -> list[str]:
    return [f"Not stated by the paper: {'; '.join(sentences)}."]


def cycles_figure(found: PassivityExperiment) -> Figure:
    """Return the height of the handle against time for each wall of figure 5."""
    counts = found.counts
    columns = 3
    rows = math.ceil(len(counts) / columns)
    figure = style.new_figure(10.0, 2.1 * rows + 0.4)
    grid: Any = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    panels = list(grid.ravel())
    for number, axes in enumerate(panels):
        axes.set_visible(number < len(counts))
        if number < len(counts):
            _draw_count(axes, counts[number])
            last_row = number + columns >= len(counts)
            first = number % columns == 0
            style.label(axes, "time [s]" if last_row else "", "z [mm]" if first else "")
    return figure


def _draw_count(axes: Axes, count: Count) -> None:
    style.dress(axes)
    axes.axhspan(-100.0, 0.0, color=style.BODY, alpha=0.5, lw=0.0, zorder=0.0)
    colour = style.ORANGE if count.cycles else style.BLUE
    axes.plot(count.time, 1e3 * count.z, color=colour, lw=0.8)
    axes.set_ylim(-13.0, 6.5)
    name = count.law if count.divisor == 1.0 else f"{count.law}/{count.divisor:g}"
    words = f"{count.cycles} of {count.starts} starts cycle"
    if count.slow:
        words += f", {count.slow} calm down slowly"
    style.entitle(axes, name, engineering(round(count.stiffness), "N/m"), words)


def _onsets(found: PassivityExperiment) -> Picture:
    caption = (
        "Not one lucky parameter set but the stiffness at which the first start cycles, against "
        "the lag that the paper does not state. Solid green: proved for conservative laws and "
        "exact positions."
    )
    source = style.data_uri(onset_figure(found.onsets))
    return Picture("V.A, onset against lag, all laws", caption, source)


def _onset_table(found: PassivityExperiment) -> Grid:
    rows = [Row(cells(one), kinds(one)) for one in found.onsets]
    return Grid("V.A, onsets in numbers", "", HEADINGS, rows, NUMBERS, NOTES)


# --- section V.B ----------------------------------------------------------------------------------


def _energies(found: ScanningExperiment) -> Picture:
    caption = (
        "Figure 6 in simulation: energy that the texture has supplied over one stroke. Solid: work "
        "of the held force on the true motion. Dashed: the paper's sum of command and step of the "
        "same sample. Up feeds the hand; the paper draws it downwards."
    )
    source = style.data_uri(energies_figure(found))
    return Picture("V.B, energy of a stroke", caption, source, _fitted(found.guessed))


def energies_figure(found: ScanningExperiment) -> Figure:
    """Return energy along x and z against time, one panel per law."""
    columns = 3
    rows = math.ceil(len(found.traces) / columns)
    figure = style.new_figure(10.0, 2.3 * rows + 0.4)
    grid: Any = figure.subplots(rows, columns, sharex=True, squeeze=False)
    panels = list(grid.ravel())
    for number, axes in enumerate(panels):
        axes.set_visible(number < len(found.traces))
        if number >= len(found.traces):
            continue
        trace = found.traces[number]
        style.dress(axes)
        for i, (name, colour) in enumerate((("x", style.ORANGE), ("z", style.BLUE))):
            axes.plot(trace.time, 1e3 * trace.exact[:, i], color=colour, lw=1.2, label=name)
            axes.plot(trace.time, 1e3 * trace.paper[:, i], color=colour, lw=0.9, ls="--")
        axes.axhline(0.0, color=style.FAINT, lw=0.8, zorder=0.0)
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, -0.5), max(high, 0.5))
        style.entitle(axes, trace.law, "")
        last_row = number + columns >= len(found.traces)
        first = number % columns == 0
        style.label(axes, "time [s]" if last_row else "", "energy [mJ]" if first else "")
    panels[0].legend(fontsize=style.TICK, frameon=False, labelcolor=style.SOFT)
    return figure


def _strokes(found: ScanningExperiment) -> Grid:
    headings = ("law", "hand", "speed", "x", "z", "sum", "field", "±", "paper's", "lost")
    rows = []
    for one in found.strokes:
        stroke = one.stroke
        texts = [stroke.law, one.hand, engineering(stroke.speed, "m/s")]
        texts += [milli(stroke.energy[0]), milli(stroke.energy[2]), milli(stroke.total)]
        texts += [milli(stroke.field), milli(stroke.spread + stroke.error, sign=False)]
        texts += [milli(stroke.same_sample), f"{stroke.lost_contact:.1f}"]
        rows.append(Row(texts, {0: "l", 6: "no" if stroke.feeds else ""}))
    notes = (
        "Energies in mJ per stroke of 80 mm. Field: what the law itself gives along the true path; "
        "the rest is sampling and steps of the encoder. Coloured: the field feeds the hand.",
    )
    return Grid("V.B, every hand and speed", "", headings, rows, tuple(range(2, 10)), notes)


# --- section V.C ----------------------------------------------------------------------------------


def _bumps(found: BumpExperiment) -> Picture:
    caption = (
        "Figure 7 in simulation: over a bump of 20 mm and back. Left the way of the handle, right "
        "the energy that the texture has supplied. A lifts the hand off and feeds it in jumps; D "
        "and H keep their balance, and hold the hand at the flank instead of lifting it."
    )
    source = style.data_uri(bumps_figure(found))
    return Picture("V.C, the enlarged bump", caption, source, _fitted(found.guessed))


def bumps_figure(found: BumpExperiment) -> Figure:
    """Return way and energy over the bump, one row per entry."""
    entries = list(dict.fromkeys(one.entry for one in found.bumps))
    figure = style.new_figure(10.0, 2.8 * len(entries) + 0.4)
    grid: Any = figure.subplots(len(entries), 2, squeeze=False)
    x = np.linspace(-0.012, 0.014, 400)
    height = bump_setup("A").surface.texture.height(np.column_stack([x, 0.0 * x]))
    for (left, right), entry in zip(grid, entries, strict=True):
        for axes in (left, right):
            style.dress(axes)
        left.fill_between(1e3 * x, 1e3 * height, -25.0, color=style.BODY, alpha=0.7, lw=0.0)
        for one in (bump for bump in found.bumps if bump.entry == entry):
            left.plot(1e3 * one.x, 1e3 * one.z, color=_COLOURS[one.law], lw=0.9, label=one.law)
            right.plot(one.time, 1e3 * one.supplied, color=_COLOURS[one.law], lw=1.2, label=one.law)
        right.axhline(0.0, color=style.FAINT, lw=0.8, zorder=0.0)
        right.legend(fontsize=style.TICK, frameon=False, labelcolor=style.SOFT)
        left.set_ylim(-25.0, 25.0)
        style.entitle(left, "Way", entry)
        style.entitle(right, "Energy", "supplied to the hand")
        style.label(left, "x [mm]", "z [mm]")
        style.label(right, "time [s]", "energy [mJ]")
    return figure


# --- other devices and surfaces -------------------------------------------------------------------


def _devices(found: Experiments) -> Picture:
    caption = (
        "What the paper could not do: stiffnesses that a rule allows, against those at which the "
        "simulation begins to cycle. Below the line the rule was wrong: filled orange. Left K₀/q, "
        "with the K₀ of the catalogue, or with the wall's own onset for the pantograph of section "
        "V.A (crosses). Right the delay rule, for conservative laws a proof if positions are exact."
    )
    skipped = (
        f"Not simulated, their apparent mass being unknown: {', '.join(found.beyond.skipped)}."
    )
    notes = [*_fitted(found.beyond.guessed), skipped]
    return Picture(
        "Predicted and simulated, every device with data", caption,
        style.data_uri(devices_figure(found)), notes,
    )  # fmt: skip


@dataclass(frozen=True)
class _Point:
    """One case: what a rule allows [N/m], from where it cycles [N/m]."""

    allowed: float
    onset: float
    law: str
    marker: str
    missed: bool


def devices_figure(found: Experiments) -> Figure:
    """Return onset against allowed stiffness for two rules, on logarithmic axes."""
    figure = style.new_figure(10.0, 5.2)
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    devices = list(dict.fromkeys(one.device for one in found.beyond.onsets))
    markers = dict(zip(devices, "osD^vP*" * len(devices), strict=False))
    rules: tuple[list[_Point], list[_Point]] = ([], [])
    for one in found.beyond.onsets:
        said, marker = one.prediction, markers[one.device]
        value, law = said.onset.value, said.onset.law
        rules[0].append(_Point(one.allowed, value, law, marker, one.missed))
        if said.conservative:
            rules[1].append(_Point(said.delay_rule, value, law, marker, said.missed))
    for said in found.passivity.onsets:
        value, law = said.onset.value, said.onset.law
        allowed = said.wall_rule or math.nan
        rules[0].append(_Point(allowed, value, law, "X", said.wall_rule_missed))
        if said.conservative:
            rules[1].append(_Point(said.delay_rule, value, law, "X", said.missed))
    names = ("K₀/q", "delay rule")
    for axes, points, name in zip((left, right), rules, names, strict=True):
        _draw_rule(axes, points)
        style.label(axes, f"allowed by {name} [N/m]", "cycles from [N/m]" if axes is left else "")
        missed = sum(point.missed for point in points)
        style.entitle(axes, name, f"{missed} of {len(points)} wrong")
    for device in devices:
        left.plot([], [], markers[device], mfc=style.CARD, mec=style.BLUE, label=device)
    left.plot([], [], "X", mfc=style.CARD, mec=style.BLUE, label="section V.A")
    left.legend(fontsize=style.TICK, frameon=False, labelcolor=style.SOFT)
    return figure


def _draw_rule(axes: Axes, points: Sequence[_Point]) -> None:
    style.dress(axes)
    axes.set_xscale("log")
    axes.set_yscale("log")
    for point in points:
        if not (math.isfinite(point.onset) and math.isfinite(point.allowed) and point.allowed > 0):
            continue
        colour = style.ORANGE if point.missed else style.BLUE
        axes.plot(point.allowed, point.onset, point.marker, ms=5.5, mec=colour, mew=0.9,
                  mfc=style.ORANGE if point.missed else style.CARD)  # fmt: skip
        axes.annotate(point.law, (point.allowed, point.onset), (4, 2), fontsize=7.0,
                      textcoords="offset points", color=style.SOFT)  # fmt: skip
    axes.plot([1.0, 1e5], [1.0, 1e5], color=style.FAINT, lw=1.2, zorder=0.0)


def _device_table(found: BeyondExperiment) -> Grid:
    headings = ("device", "surface", "law", "q", "K₀/q", "delay rule", "cycles", "starts", "depth")
    rows = [Row(_device_cells(one), _device_kinds(one)) for one in found.onsets]
    notes = (
        "Stiffnesses in N/m. q at the depth that the handle got to. Delay rule: with the damping "
        "of the hand, a proof for conservative laws and exact positions, else in brackets.",
    )
    return Grid("Devices in numbers", "", headings, rows, tuple(range(3, 9)), notes)


def _device_cells(one: DeviceOnset) -> list[str]:
    _law, _delay, _quiet, cycling, starts, depth, q, _paper, rule, _wall = cells(one.prediction)
    law = one.prediction.onset.law
    return [one.device, one.surface, law, q, newton(one.allowed), rule, cycling, starts, depth]


def _device_kinds(one: DeviceOnset) -> dict[int, str]:
    marked = {2: "l"}
    if one.missed:
        marked[4] = "no"
    if one.prediction.missed:
        marked[5] = "no"
    return marked

"""The simulated experiments of section V as pictures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.paper.experiments import Experiments
from asperity.paper.experiments.bump import BumpExperiment
from asperity.paper.experiments.passivity import Count, PassivityExperiment
from asperity.paper.experiments.scanning import ScanningExperiment
from asperity.paper.experiments.settings import bump_setup
from asperity.report.pictures import style
from asperity.units import engineering

# Of the laws, in their order.
_COLOURS = (style.ORANGE, style.SOFT, style.BLUE, "#cc79a7", style.GREEN)


# --- section V.A ----------------------------------------------------------------------------------


def cycles_figure(found: PassivityExperiment) -> Figure:
    """Return the height of the handle against time for each wall of figure 5."""
    counts = found.counts
    figure, panels = style.law_panels(len(counts), 2.1, 0.4, x="time [s]", y="z [mm]")
    for axes, count in zip(panels, counts, strict=True):
        _draw_count(axes, count)
    return figure


def _draw_count(axes: Axes, count: Count) -> None:
    axes.axhspan(-100.0, 0.0, color=style.BODY, alpha=0.5, lw=0.0, zorder=0.0)
    colour = style.ORANGE if count.cycles else style.BLUE
    axes.plot(count.time, 1e3 * count.z, color=colour, lw=0.8, label="height")
    axes.set_ylim(-13.0, 6.5)
    name = count.law if count.divisor == 1.0 else f"{count.law}/{count.divisor:g}"
    words = f"{count.cycles} of {count.starts} starts cycle"
    if count.slow:
        words += f", {count.slow} calm down slowly"
    style.of_law(axes, count.law)
    style.entitle(axes, name, engineering(round(count.stiffness), "N/m"), words)


# --- section V.B ----------------------------------------------------------------------------------


def energies_figure(found: ScanningExperiment) -> Figure:
    """Return energy along x and z against time, one panel per law."""
    traces = found.traces
    figure, panels = style.law_panels(
        len(traces), 2.3, 0.4, x="time [s]", y="energy [mJ]", sharey=False
    )
    for axes, trace in zip(panels, traces, strict=True):
        for i, (name, colour) in enumerate((("x", style.ORANGE), ("z", style.BLUE))):
            axes.plot(trace.time, 1e3 * trace.exact[:, i], color=colour, lw=1.2, label=name)
            summed = 1e3 * trace.paper[:, i]
            axes.plot(trace.time, summed, color=colour, lw=0.9, ls="--", label=f"{name}, paper's")
        style.zero_line(axes, 0.5)
        style.entitle(axes, trace.law, "")
        style.of_law(axes, trace.law)
    style.legend(panels[0])
    return figure


# --- section V.C ----------------------------------------------------------------------------------


def bumps_figure(found: BumpExperiment) -> Figure:
    """Return way and energy over the bump, one row per entry."""
    entries = list(dict.fromkeys(one.entry for one in found.bumps))
    laws = dict.fromkeys(one.law for one in found.bumps)
    colours = dict(zip(laws, _COLOURS * len(laws), strict=False))
    figure = style.new_figure(10.0, 2.8 * len(entries) + 0.4)
    grid: Any = figure.subplots(len(entries), 2, squeeze=False)
    x = np.linspace(-0.012, 0.014, 400)
    height = bump_setup("A").surface.texture.height(np.column_stack([x, 0.0 * x]))
    for (left, right), entry in zip(grid, entries, strict=True):
        for axes in (left, right):
            style.dress(axes)
        left.fill_between(1e3 * x, 1e3 * height, -25.0, color=style.BODY, alpha=0.7, lw=0.0)
        runs = [bump for bump in found.bumps if bump.entry == entry]
        for one in runs:
            look: dict[str, Any] = {"color": colours[one.law], "label": one.law}
            drawn = left.plot(1e3 * one.x, 1e3 * one.z, lw=0.9, **look)
            drawn += right.plot(one.time, 1e3 * one.supplied, lw=1.2, **look)
            for line in drawn:
                style.of_law(line, one.law)
        style.zero_line(right)
        style.legend(right)
        left.set_ylim(-25.0, max(25.0, *(1e3 * one.z.max() + 2.0 for one in runs)))
        style.entitle(left, "Way", entry)
        style.entitle(right, "Energy", "supplied to the hand")
        style.label(left, "x [mm]", "z [mm]")
        style.label(right, "time [s]", "energy [mJ]")
    return figure


# --- other devices and surfaces -------------------------------------------------------------------


_OWN = "section V.A"  # in the place of a device


@dataclass(frozen=True)
class _Point:
    """One case: what a rule allows [N/m], from where it cycles [N/m]."""

    allowed: float
    onset: float
    law: str
    device: str
    missed: bool


def devices_figure(found: Experiments) -> Figure:
    """Return onset against allowed stiffness for two rules, on logarithmic axes."""
    figure = style.new_figure(10.0, 5.2)
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    devices = dict.fromkeys(one.device for one in found.beyond.onsets)
    markers = {**dict(zip(devices, "osD^vP*" * len(devices), strict=False)), _OWN: "X"}
    rules: tuple[list[_Point], list[_Point]] = ([], [])
    for one in found.beyond.onsets:
        said = one.prediction
        value, law = said.onset.value, said.onset.law
        rules[0].append(_Point(one.allowed, value, law, one.device, one.missed))
        if said.conservative:
            rules[1].append(_Point(said.delay_rule, value, law, one.device, said.missed))
    for said in found.passivity.onsets:
        value, law = said.onset.value, said.onset.law
        allowed = said.wall_rule or math.nan
        rules[0].append(_Point(allowed, value, law, _OWN, said.wall_rule_missed))
        if said.conservative:
            rules[1].append(_Point(said.delay_rule, value, law, _OWN, said.missed))
    names = ("K₀/q", "delay rule")
    for axes, points, name in zip((left, right), rules, names, strict=True):
        _draw_rule(axes, points, markers)
        style.label(axes, f"allowed by {name} [N/m]", "cycles from [N/m]" if axes is left else "")
        missed = sum(point.missed for point in points)
        style.entitle(axes, name, f"{missed} of {len(points)} wrong")
    for device, marker in markers.items():
        left.plot([], [], marker, mfc=style.CARD, mec=style.BLUE, label=device)
    style.legend(left)
    return figure


def _draw_rule(axes: Axes, points: Sequence[_Point], markers: Mapping[str, str]) -> None:
    style.dress(axes)
    axes.set_xscale("log")
    axes.set_yscale("log")
    named: dict[tuple[int, int], list[_Point]] = {}  # by place, so that letters do not overlap
    for point in points:
        if not (math.isfinite(point.onset) and math.isfinite(point.allowed) and point.allowed > 0):
            continue
        place = round(3.0 * math.log10(point.allowed)), round(8.0 * math.log10(point.onset))
        named.setdefault(place, []).append(point)
        colour = style.ORANGE if point.missed else style.BLUE
        (drawn,) = axes.plot(
            point.allowed, point.onset, markers[point.device], ms=5.5, mec=colour, mew=0.9,
            mfc=style.ORANGE if point.missed else style.CARD, label=f"_{point.law}, {point.device}",
        )  # fmt: skip
        style.of_law(drawn, point.law)
    for near in named.values():
        letters = "".join(dict.fromkeys(point.law for point in near))
        last = max(near, key=lambda point: point.allowed)
        axes.annotate(letters, (last.allowed, last.onset), (5, 3), fontsize=7.0,
                      textcoords="offset points", color=style.SOFT)  # fmt: skip
    axes.plot([1.0, 1e5], [1.0, 1e5], color=style.FAINT, lw=1.2, zorder=0.0)

"""The waves of a texture and the forces they make, with the limits of a device drawn in."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from asperity.analysis.limits.limit_result import Limits
from asperity.analysis.words.felt import speed_text
from asperity.analysis.words.limits import stiffness_text
from asperity.report.pictures import style
from asperity.report.pictures.spectrum_picture import shortest
from asperity.units import engineering

_MILLI = 1e3  # wavelengths are drawn in mm, whatever their size: the axis is logarithmic


def limits_figure(result: Limits) -> Figure:
    """Return amplitude and force against wavelength, the limits drawn in.

    Waves left of a dashed line are too short for the device at this speed; waves below the line
    of the force are too weak. Filled circles meet every limit on waves that can be decided.
    """
    figure = style.new_figure(10.0, 5.6)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[1.15, 1.0])
    for axes in (upper, lower):
        style.dress(axes)
        axes.set_xscale("log")
        axes.set_yscale("log")
    if not result.waves:
        style.note(upper, "flat: no waves", (0.5, 0.5), ha="center")
        return figure
    lengths = np.array([wave.wavelength for wave in result.waves])
    heights = np.array([wave.amplitude for wave in result.waves])
    forces = np.array([wave.force for wave in result.waves])
    met = [all(wave.holds.values()) for wave in result.waves]
    unit, push = style.length_unit(float(heights.max())), style.force_unit(float(forces.max()))
    _draw_waves(upper, lengths, heights * unit.scale, met, result.spectrum.exact)
    _draw_waves(lower, lengths, forces * push.scale, met, result.spectrum.exact)
    least = _draw_shortest(result, (upper, lower))
    _draw_weakest(result, lower, push.scale)
    edges = [*lengths.tolist(), *least]
    span = max(max(edges) / min(edges), 4.0)
    # The words of the last line need a third of the width.
    room = span**0.45 if least and least[-1] > 0.5 * max(edges) else 1.6
    lower.set_xlim(min(edges) * _MILLI / 1.6, max(edges) * _MILLI * room)
    plain = FuncFormatter(lambda value, _place: f"{value:g}")
    for axis in (lower.xaxis, upper.yaxis, lower.yaxis):
        axis.set_major_formatter(plain)
    lower.xaxis.set_minor_formatter(plain if span < 8.0 else NullFormatter())
    style.label(upper, "", f"amplitude [{unit.name}]")
    style.label(lower, "wavelength [mm]", f"force [{push.name}]")
    k = stiffness_text(result)
    law = f"law {result.surface.law.letter} at {k}, {speed_text(result.speed)}"
    style.entitle(upper, "Waves", "and the shortest that the device can render")
    style.entitle(lower, "Force", f"of each wave, {law}")
    return figure


def _draw_waves(
    axes: Axes, lengths: np.ndarray, values: np.ndarray, met: Sequence[bool], exact: bool
) -> None:
    """Draw waves as stems, those of a sum, or as circles on a line, bands."""
    top = float(values.max())
    floor = max(min(float(values[values > 0.0].min(initial=top)), top) / 4.0, top * 1e-7)
    floor = min(floor, top / 30.0)
    shown = values > floor
    if exact:
        axes.vlines(lengths[shown] * _MILLI, floor, values[shown], color=style.BLUE, lw=1.2)
    else:
        axes.plot(lengths[shown] * _MILLI, values[shown], color=style.BLUE, lw=0.9)
    filled = np.array(met)
    for which, face, name in (
        (shown & filled, style.BLUE, "meets every limit"),
        (shown & ~filled, style.CARD, "breaks a limit"),
    ):
        x = lengths[which] * _MILLI
        axes.plot(x, values[which], "o", ms=5.0, mfc=face, mec=style.BLUE, zorder=4.0, label=name)
    axes.set_ylim(floor, top * 4.0)


def _draw_shortest(result: Limits, both: Sequence[Axes]) -> list[float]:
    """Draw the shortest wavelengths in both panels; return them."""
    found = shortest(result.device, result.speed, result.time_samples, result.position_samples)
    for level, (least, number, words) in enumerate(found):
        for axes in both:
            axes.axvline(least * _MILLI, color=style.ORANGE, lw=1.0, ls="--", zorder=1.0)
        style.note(
            both[0], f"{number}: {words}, {engineering(least, 'm')}",
            (least * _MILLI, 0.97 - 0.11 * level), xycoords=("data", "axes fraction"),
            xytext=(4, 0), va="top", color=style.ORANGE,
        )  # fmt: skip
    if found:
        for axes in both:
            axes.axvspan(1e-12, found[-1][0] * _MILLI, color=style.ORANGE, alpha=0.06, lw=0.0)
    return [least for least, _number, _words in found]


def _draw_weakest(result: Limits, axes: Axes, scale: float) -> None:
    """Draw the forces below which a wave is not rendered, or hidden by friction."""
    device = result.device
    step, friction = device.value("force_resolution"), device.value("friction")
    lines = []
    if step is not None:
        words = f"4: {result.force_steps:g} steps of force"
        lines.append((result.force_steps * step, words, style.ORANGE))
    if friction:
        lines.append((friction, "dry friction of the device", style.GREEN))
    for force, words, colour in lines:
        axes.axhline(force * scale, color=colour, lw=1.0, ls="--", zorder=1.0)
        style.note(
            axes, f"{words}, {engineering(force, 'N')}", (0.005, force * scale),
            xycoords=("axes fraction", "data"), xytext=(0, 4), color=colour,
        )  # fmt: skip
    low, high = axes.get_ylim()
    values = [force * scale for force, _words, _colour in lines]
    if values:
        axes.set_ylim(min(low, min(values) / 3.0), max(high, max(values) * 4.0))
    if not lines and math.isfinite(low):
        words = "force steps and friction of the device are not known"
        style.note(axes, words, (0.995, 0.94), ha="right", va="top")

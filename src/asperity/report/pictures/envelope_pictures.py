"""Diagrams of the sinusoids that devices render: amplitude against wavelength, a panel a device."""

from __future__ import annotations

import math
from itertools import groupby
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from asperity.analysis.limits.perceptibility_sentences import speed_text
from asperity.core.units import format_quantity
from asperity.envelopes.envelope import DeviceEnvelope, Envelope, LawEnvelope, SurfacePeaks
from asperity.envelopes.wave_borders import AMPLITUDE_RANGE
from asperity.report.pictures import style

_MILLI = 1e3
_MICRO = 1e6
# Okabe and Ito's palette; laws in the order of the result.
_COLOURS = "#e69f00", "#56b4e9", "#009e73", "#cc79a7", "#0072b2", "#882255", "#8a7a00", "#1d2733"
_MARKERS = "osD^vP"


def envelope_figure(result: Envelope) -> Figure:
    """Return the diagram of an envelope, with devices side by side on the same scales."""
    count = len(result.devices)
    height = (5.6 if count == 1 else 4.8) * math.ceil(count / 3)
    figure = style.new_figure(10.0 if count < 3 else 13.0, height + 0.6)
    panels = style.axes_grid(figure, count, 3, x="wavelength [mm]", y="amplitude [µm]")
    handles: dict[str, Any] = {}
    for index, (axes, one) in enumerate(zip(panels, result.devices, strict=True)):
        _draw_device(axes, one)
        for marker, surface in zip(_MARKERS, result.surfaces, strict=False):
            _draw_peaks(axes, surface, index, marker)
        shown = zip(*axes.get_legend_handles_labels(), strict=True)
        handles |= {label: handle for handle, label in shown}
    ends = [x for one in result.devices for law in one.laws for x in law.borders if x.decades]
    least = min((border.felt_from for border in ends), default=1e-6) / 3.0
    panels[0].set_ylim(least * _MICRO, AMPLITUDE_RANGE[1] * _MICRO)
    labels = sorted(handles)
    options = {"loc": "outside lower left", "ncols": 7}
    style.add_legend(figure, [handles[label] for label in labels], labels, **options)
    stiffness = format_quantity(result.conditions.min_stiffness, "N/m")
    text = (
        f"Rendered, inside the line of a law: its recommended stiffness is at least {stiffness}, "
        f"and the texture is felt at it on a scan at {speed_text(result.conditions.speed)}."
    )
    figure.suptitle(text, x=0.01, ha="left", fontsize=style.TICK, color=style.MUTED)
    return figure


def _draw_device(axes: Axes, one: DeviceEnvelope) -> None:
    lengths = [border.wavelength * _MILLI for border in one.laws[0].borders]
    widest = one.widest
    axes.set(xscale="log", yscale="log", xlim=(lengths[0], lengths[-1]))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _place: f"{value:g}"))
    for colour, law in zip(_COLOURS * len(one.laws), one.laws, strict=False):
        _draw_region(axes, law, colour, is_filled=law is widest)
    for level, limit in enumerate(one.limits):
        x = limit.wavelength * _MILLI
        axes.axvline(x, color=style.ORANGE, lw=1.0, ls="--", zorder=1.0)
        text = f"{limit.number}" if limit.trusted else f"({limit.number})"
        place = {"xycoords": ("data", "axes fraction"), "xytext": (2, 0), "color": style.ORANGE}
        style.add_note(axes, text, (x, 0.02 + 0.05 * level), **place)
    for name, number, dots in (("force_limit", 4, ":"), ("gain_limit", 5, "-.")):
        _draw_amplitude_limit(axes, one, name, f"limit {number}", dots)
    remark = f"filled: law {widest.letter}, {widest.decades:.2g} decades²"
    style.set_panel_title(axes, one.device.name, "", remark)


def _draw_region(axes: Axes, law: LawEnvelope, colour: str, *, is_filled: bool) -> None:
    """Draw the outline of each connected part of the region of a law, open to longer waves."""
    for has_region, group in groupby(law.borders, key=lambda border: border.decades > 0.0):
        part = list(group) if has_region else []
        x = [border.wavelength * _MILLI for border in part]
        low = [border.felt_from * _MICRO for border in part]
        # Above the panel where there is no upper end.
        high = [min(border.felt_up_to, 2.0 * AMPLITUDE_RANGE[1]) * _MICRO for border in part]
        dashes: Any = "-" if law.conservative else (0, (4, 2))
        (line,) = axes.plot([*x[::-1], *x], [*high[::-1], *low], color=colour, lw=1.3, ls=dashes)
        style.mark_law(line, law.letter)
        if part and f"law {law.letter}" not in axes.get_legend_handles_labels()[1]:
            line.set_label(f"law {law.letter}")
        if is_filled:
            axes.fill_between(x, low, high, color=colour, alpha=0.08, lw=0.0)


def _draw_amplitude_limit(
    axes: Axes, one: DeviceEnvelope, name: str, label: str, dots: str
) -> None:
    """Draw a limit on the amplitude of the first law that has it."""
    for law in one.laws:
        found = [border for border in law.borders if math.isfinite(getattr(border, name))]
        if found:
            x = [border.wavelength * _MILLI for border in found]
            y = [getattr(border, name) * _MICRO for border in found]
            text = f"{label} (law {law.letter})"
            axes.plot(x, y, color=style.ORANGE, lw=1.0, ls=dots, label=text, zorder=1.0)
            return


def _draw_peaks(axes: Axes, surface: SurfacePeaks, device: int, marker: str) -> None:
    """Draw the waves of a surface, those that no law renders hollow."""
    label: str | None = surface.name
    for wave, letters in zip(surface.waves, surface.rendered_by[device], strict=True):
        face = style.INK if letters else style.BACKGROUND
        place = wave.wavelength * _MILLI, wave.amplitude * _MICRO
        options: dict[str, Any] = {"mfc": face, "mec": style.INK, "ms": 5.0, "zorder": 5.0}
        axes.plot(*place, marker, ls="", label=label, **options)
        label = None

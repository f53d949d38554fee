"""Figures of what a device renders: spectra, waves with their forces, regions of sinusoids."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from asperity.analysis.energy.straight_scan import parallel_line_points
from asperity.analysis.limits.limit_rules import shortest_wavelengths
from asperity.analysis.results.check_limits import Limits
from asperity.analysis.results.compare import Comparison
from asperity.core.checks import FloatArray
from asperity.core.units import format_quantity
from asperity.devices import Device
from asperity.envelopes.envelope import DeviceEnvelope, Envelope, LawEnvelope, SurfacePeaks
from asperity.envelopes.wave_borders import AMPLITUDE_LIMITS, AMPLITUDE_RANGE
from asperity.report.pictures import style
from asperity.report.sentences.analysis_text import unseen_text
from asperity.report.sentences.limit_sentences import grip_text, speed_text, stiffness_text
from asperity.textures.texture import Texture

_LINE_POINTS = 4096
# Least amplitude in a figure, as a share of the greatest.
_LEAST_SHARE = 1e-4
# Samples per period for a correct reconstruction, 5 to 10 in section II.B of the paper.
_SAMPLES_PER_PERIOD = 5.0
_SCAN_SPEED = 0.1  # of a fast stroke [m/s]


def line_spectrum(texture: Texture) -> tuple[FloatArray, FloatArray]:
    """Return wavelengths [m] and amplitudes [m] along the scan line, averaged over lines.

    The amplitude of a sinusoid is its A. A line that is not periodic is windowed (Hann).
    """
    line = texture.scan_line()
    heights = texture.height(parallel_line_points(texture, line, _LINE_POINTS).reshape(-1, 2))
    rows = heights.reshape(-1, _LINE_POINTS)
    rows = rows - rows.mean(axis=1, keepdims=True)
    window = np.ones(_LINE_POINTS)
    if not line.periodic:
        window = np.hanning(_LINE_POINTS)
    spectrum = 2.0 * np.abs(np.fft.rfft(rows * window, axis=1)) / window.sum()
    amplitude = np.sqrt(np.mean(spectrum**2, axis=0))[1:]
    wavelength = line.length / np.arange(1, len(amplitude) + 1)
    return wavelength, amplitude


def device_wavelength_limits(device: Device) -> list[tuple[float, str]]:
    """Return the wavelengths [m] below which a device renders no texture, and why."""
    limits = []
    for least, number, reason in shortest_wavelengths(
        device, _SCAN_SPEED, _SAMPLES_PER_PERIOD, _SAMPLES_PER_PERIOD
    ):
        text = reason
        if number != 2:  # the only limit that does not depend on the speed
            text += f" at {_SCAN_SPEED:g} m/s"
        limits.append((least, f"{text}: {format_quantity(least, 'm')}"))
    return limits


def spectrum_figure(texture: Texture, device: Device) -> Figure:
    """Return amplitude against wavelength, with the limits of the device."""
    figure, axes = style.new_axes(10.0, 3.4)
    wavelength, amplitude = line_spectrum(texture)
    # Below are aliases of the nodes of a map, not heights.
    shown = amplitude > _LEAST_SHARE * max(float(amplitude.max()), 1e-300)
    unit = style.length_unit(float(amplitude.max()))
    limits = device_wavelength_limits(device)
    x = wavelength[shown] * _MILLI
    y = amplitude[shown] * unit.scale
    if shown.sum() <= 40:
        axes.vlines(x, 0.0, y, color=style.BLUE)
        axes.plot(x, y, "o", color=style.BLUE, label="amplitude")
    else:
        axes.plot(x, y, color=style.BLUE, label="amplitude", lw=1.0)
    axes.set(xscale="log", yscale="log")
    for level, (least, text) in enumerate(limits):
        _draw_wavelength_limit([axes], least, text, 0.96 - 0.1 * level)
    edges = [*wavelength[shown], *[least for least, _text in limits]]
    axes.set_xlim(min(edges) * _MILLI / 1.5, max(edges) * _MILLI * 2.5)
    top = float(amplitude.max()) * unit.scale
    axes.set_ylim(min(top / 300.0, float(y.min()) / 2.0), top * 4.0)
    style.label_log_axes(axes.xaxis, axes.yaxis)
    style.label_axes(axes, "wavelength [mm]", f"amplitude [{unit.name}]")
    return figure


def hand_figure(comparison: Comparison) -> Figure:
    """Return the motion of the held tool against frequency, with the thresholds of the hand.

    Drawn for the recommended law, or for the one that comes nearest to being felt. Hollow waves
    are not resolved by the device.
    """
    figure, axes = style.new_axes(10.0, 3.4)
    row = comparison.recommended_row or comparison.nearest_row
    if row is None or row.perceptibility is None or not len(row.perceptibility.spectrum.motions):
        style.add_note(axes, "no texture at a known stiffness", (0.5, 0.5), ha="center")
        return figure
    perceptibility = row.perceptibility
    waves = perceptibility.spectrum
    frequencies = waves.frequencies
    motions = waves.motions * _MICRO
    span = np.geomspace(min(5.0, frequencies.min() / 1.5), max(600.0, frequencies.max() * 1.5), 300)
    unnoticed, felt = np.array(comparison.grip.threshold(span)) * _MICRO
    felt[~comparison.grip.is_known(span)] = np.nan  # no source has thresholds there
    axes.plot(span, felt, color=style.GREEN, lw=1.2, ls="--", label="felt above")
    axes.plot(span, unnoticed, color=style.GREEN, lw=1.2, ls=":", label="nobody notices below")
    title = f"law {row.law.letter}, {perceptibility.tier}"
    drawn = motions > 1e-3 * unnoticed.min()
    parts = {title: drawn & waves.is_resolved, "beyond the device": drawn & ~waves.is_resolved}
    _draw_marks(axes, frequencies, motions, parts)
    axes.set(xscale="log", yscale="log", xlim=(span[0], span[-1]))
    style.label_log_axes(axes.xaxis, axes.yaxis)
    mass = format_quantity(1e3 * perceptibility.apparent_mass, "g")
    held = f"{comparison.device.name}, {mass}, {grip_text(comparison.grip)}"
    style.set_panel_title(axes, "Motion of the held tool", held)
    style.label_axes(axes, "frequency [Hz]", "amplitude [µm]")
    style.add_legend(axes, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def risk_figure(comparison: Comparison) -> Figure:
    """Return the share of random loops that cycle against the stiffness over K₀/q, by law."""
    figure, axes = style.new_axes(10.0, 3.4)
    rows = [row for row in comparison.rows if row.margin.curve]
    for row, colour in zip(rows, _COLOURS * len(rows), strict=False):
        margin = row.margin
        factors = [point.factor for point in margin.curve]
        shares = [100.0 * point.cycles / margin.curve_loops for point in margin.curve]
        axes.plot(factors, shares, "o-", ms=3.0, lw=1.2, color=colour, label=row.law.letter)
        chosen = 100.0 * margin.cycles / margin.loops
        axes.plot(margin.factor, chosen, "s", ms=8.0, mfc="none", mec=colour, label="_chosen")
    axes.axhline(100.0 * comparison.risk, color=style.ORANGE, lw=1.0, ls="--", zorder=1.0)
    axes.set(xscale="log", xlim=(0.05, 1.1), ylim=(0.0, None))
    style.label_log_axes(axes.xaxis)
    style.label_axes(axes, "stiffness over K₀/q [1]", "loops that cycle [%]")
    if rows:
        style.add_legend(axes, loc="center left", bbox_to_anchor=(1.0, 0.5))
    else:
        style.add_note(axes, "no limit needs a margin", (0.3, 0.5), ha="center")
    return figure


def _draw_marks(
    axes: Axes, x: FloatArray, y: FloatArray, parts: Mapping[str, NDArray[np.bool_]]
) -> None:
    """Draw waves in two parts by name, those of the second hollow."""
    for (name, part), face in zip(parts.items(), (style.BLUE, style.BACKGROUND), strict=True):
        if part.any():
            marks: dict[str, Any] = {"ms": 5.0, "mfc": face, "mec": style.BLUE, "zorder": 4.0}
            axes.plot(x[part], y[part], "o", label=name, **marks)


def _draw_wavelength_limit(
    panels: Sequence[Axes], wavelength: float, text: str, height: float
) -> None:
    """Draw a shortest wavelength [m] in all panels, with a text in the first one."""
    for axes in panels:
        axes.axvline(wavelength * _MILLI, color=style.ORANGE, lw=1.0, ls="--", zorder=1.0)
    place = {"xycoords": ("data", "axes fraction"), "xytext": (4, 0), "va": "top"}
    style.add_note(panels[0], text, (wavelength * _MILLI, height), color=style.ORANGE, **place)


_MICRO = 1e6
_MILLI = 1e3  # wavelengths are in mm: the axis is logarithmic


def limits_figure(result: Limits) -> Figure:
    """Return amplitude and force against wavelength, with the limits.

    Waves to the left of a dashed line are too short for the device at this speed; waves below the
    line of the force are too weak. Filled circles meet every limit that can be decided.
    """
    figure = style.new_figure(10.0, 5.6)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[1.15, 1.0])
    for axes in (upper, lower):
        style.style_axes(axes)
        axes.set(xscale="log", yscale="log")
    if not result.waves:
        style.add_note(upper, "flat: no waves", (0.5, 0.5), ha="center")
        return figure
    waves = np.array([(wave.wavelength, wave.amplitude, wave.force) for wave in result.waves])
    lengths, heights, forces = waves.T
    met = [all(wave.holds.values()) for wave in result.waves]
    unit = style.length_unit(float(heights.max()))
    push = style.force_unit(float(forces.max()))
    _draw_waves(upper, lengths, heights * unit.scale, met, result.spectrum.exact)
    _draw_waves(lower, lengths, forces * push.scale, met, result.spectrum.exact)
    least = _draw_wavelength_limits(result, (upper, lower))
    _draw_force_limits(result, lower, push.scale)
    edges = [*lengths.tolist(), *least]
    span = max(max(edges) / min(edges), 4.0)
    # The text of the last line needs a third of the width.
    room = 1.6
    if least and least[-1] > 0.5 * max(edges):
        room = span**0.45
    lower.set_xlim(min(edges) * _MILLI / 1.6, max(edges) * _MILLI * room)
    style.label_log_axes(lower.xaxis, upper.yaxis, lower.yaxis)
    style.label_axes(upper, "", f"amplitude [{unit.name}]")
    style.label_axes(lower, "wavelength [mm]", f"force [{push.name}]")
    k = stiffness_text(result)
    law = f"law {result.surface.law.letter} at {k}, {speed_text(result.speed)}"
    style.set_panel_title(upper, "Waves", "and the shortest wavelengths of the device")
    style.set_panel_title(lower, "Force", f"of each wave, {law}")
    return figure


def _draw_waves(
    axes: Axes, lengths: np.ndarray, values: np.ndarray, meets_limits: Sequence[bool], exact: bool
) -> None:
    """Draw waves of a sum as stems, and bands as circles on a line."""
    top = float(values.max())
    floor = max(min(float(values[values > 0.0].min(initial=top)), top) / 4.0, top * 1e-7)
    floor = min(floor, top / 30.0)
    shown = values > floor
    if exact:
        axes.vlines(lengths[shown] * _MILLI, floor, values[shown], color=style.BLUE, lw=1.2)
    else:
        axes.plot(lengths[shown] * _MILLI, values[shown], color=style.BLUE, lw=0.9)
    filled = np.array(meets_limits)
    parts = {"meets every limit": shown & filled, "breaks a limit": shown & ~filled}
    _draw_marks(axes, lengths * _MILLI, values, parts)
    axes.set_ylim(floor, top * 4.0)


def _draw_wavelength_limits(result: Limits, panels: Sequence[Axes]) -> list[float]:
    """Draw the shortest wavelengths in both panels; return them."""
    wavelengths = shortest_wavelengths(
        result.device, result.speed, result.time_samples, result.position_samples
    )
    for level, (least, number, reason) in enumerate(wavelengths):
        text = f"{number}: {reason}, {format_quantity(least, 'm')}"
        _draw_wavelength_limit(panels, least, text, 0.97 - 0.11 * level)
    if wavelengths:
        for axes in panels:
            axes.axvspan(1e-12, wavelengths[-1][0] * _MILLI, color=style.ORANGE, alpha=0.06, lw=0.0)
    return [least for least, _number, _reason in wavelengths]


def _draw_force_limits(result: Limits, axes: Axes, scale: float) -> None:
    """Draw the force that each wave needs to be felt, and the force steps of the device."""
    step = result.device.value("force_resolution")
    steps = result.force_steps
    texture = result.perceptibility
    low, high = axes.get_ylim()
    lengths = np.geomspace(*axes.get_xlim(), 200) / _MILLI
    frequencies = result.speed / lengths
    damping = result.device.value("damping") or 0.0
    compliance = result.grip.compliance(
        frequencies, texture.apparent_mass, damping, result.surface.stiffness
    )
    names = "unnoticed below, along the normal", "felt above, along the normal"
    unnoticed, felt = result.grip.threshold(frequencies)
    felt[~result.grip.is_known(frequencies)] = np.nan
    for level, name, line in zip((unnoticed, felt), names, ":-", strict=True):
        needed = level / compliance * scale
        axes.plot(lengths * _MILLI, needed, color=style.GREEN, lw=1.0, ls=line, label=name)
    lines = [line for line in axes.lines if line.get_label() in names]
    style.add_legend(axes, handles=lines, loc="upper left")
    if step is not None:
        axes.axhline(steps * step * scale, color=style.ORANGE, lw=1.0, ls="--", zorder=1.0)
        place = {"xycoords": ("axes fraction", "data"), "xytext": (0, 4), "color": style.ORANGE}
        text = f"4: {steps:g} steps of force, {format_quantity(steps * step, 'N')}"
        style.add_note(axes, text, (0.005, steps * step * scale), **place)
        low = min(low, steps * step * scale / 3.0)
        high = max(high, steps * step * scale * 4.0)
    axes.set_ylim(low, high)


# Okabe and Ito's palette; laws in the order of the result.
_COLOURS = "#e69f00", "#56b4e9", "#009e73", "#cc79a7", "#0072b2", "#882255", "#8a7a00", "#1d2733"
_MARKERS = "osD^vP"


def envelope_figure(result: Envelope) -> Figure:
    """Return the diagram of an envelope, with devices side by side on the same scales."""
    count = len(result.devices)
    height = 5.6 if count == 1 else 4.8
    figure = style.new_figure(10.0, height * math.ceil(count / 2) + 0.6)
    panels = style.axes_grid(figure, count, 2, x="wavelength [mm]", y="amplitude [µm]")
    handles: dict[str, Any] = {}
    for index, (axes, envelope) in enumerate(zip(panels, result.devices, strict=True)):
        _draw_device(axes, envelope)
        for marker, surface in zip(_MARKERS, result.surfaces, strict=False):
            _draw_peaks(axes, surface, index, marker)
        shown = zip(*axes.get_legend_handles_labels(), strict=True)
        handles |= {label: handle for handle, label in shown}
    laws = [law for envelope in result.devices for law in envelope.laws]
    borders = [border for law in laws for border in law.borders]
    ends = [size for border in borders for size in (border.felt_from, border.force_limit)]
    least = min([size for size in ends if size > 0.0], default=1e-6) / 3.0
    panels[0].set_ylim(least * _MICRO, AMPLITUDE_RANGE[1] * _MICRO)
    for axes in panels:
        style.label_log_axes(axes.xaxis, axes.yaxis)
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


def _draw_device(axes: Axes, envelope: DeviceEnvelope) -> None:
    lengths = [border.wavelength * _MILLI for border in envelope.laws[0].borders]
    widest = envelope.widest
    axes.set(xscale="log", yscale="log", xlim=(lengths[0], lengths[-1]))
    for colour, law in zip(_COLOURS * len(envelope.laws), envelope.laws, strict=False):
        _draw_region(axes, law, colour, is_filled=law is widest)
    inside = [limit for limit in envelope.limits if envelope.has_line(limit.number)]
    for level, limit in enumerate(inside):
        x = limit.wavelength * _MILLI
        axes.axvline(x, color=style.ORANGE, lw=1.0, ls="--", zorder=1.0)
        text = f"{limit.number}" if limit.trusted else f"({limit.number})"
        place = {"xycoords": ("data", "axes fraction"), "xytext": (2, 0), "color": style.ORANGE}
        style.add_note(axes, text, (x, 0.02 + 0.05 * level), **place)
    for (number, name), dots in zip(AMPLITUDE_LIMITS.items(), (":", "-."), strict=True):
        _draw_amplitude_limit(axes, envelope, name, f"limit {number}", dots)
    remark = f"filled: law {widest.letter}, {widest.decades:.2f} decades²{unseen_text(envelope)}"
    style.set_panel_title(axes, envelope.device.name, "", remark)


def _draw_region(axes: Axes, law: LawEnvelope, colour: str, *, is_filled: bool) -> None:
    """Draw the outline of each connected part of the region of a law, open to longer waves."""
    for has_region, group in groupby(law.borders, key=lambda border: border.decades > 0.0):
        if not has_region:
            continue
        part = list(group)
        x = [border.wavelength * _MILLI for border in part]
        low = [border.felt_from * _MICRO for border in part]
        # Above the panel where there is no upper end.
        high = [min(border.felt_up_to, 2.0 * AMPLITUDE_RANGE[1]) * _MICRO for border in part]
        dashes: Any = "-" if law.conservative else (0, (4, 2))
        (line,) = axes.plot([*x[::-1], *x], [*high[::-1], *low], color=colour, lw=1.3, ls=dashes)
        style.mark_law(line, law.letter)
        if f"law {law.letter}" not in axes.get_legend_handles_labels()[1]:
            line.set_label(f"law {law.letter}")
        if is_filled:
            axes.fill_between(x, low, high, color=colour, alpha=0.08, lw=0.0)


def _draw_amplitude_limit(
    axes: Axes, one: DeviceEnvelope, name: str, label: str, dots: str
) -> None:
    """Draw a limit on the amplitude of the first law that has it."""
    for law in one.laws:
        borders = [border for border in law.borders if math.isfinite(getattr(border, name))]
        if borders:
            x = [border.wavelength * _MILLI for border in borders]
            y = [getattr(border, name) * _MICRO for border in borders]
            text = f"{label} (law {law.letter})"
            # Above the regions, whose border it may be.
            axes.plot(x, y, color=style.ORANGE, lw=1.5, ls=dots, label=text, zorder=3.0)
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

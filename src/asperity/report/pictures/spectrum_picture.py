"""The spectrum of a surface along its scan line, with what a device can resolve."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from asperity.analysis.energy.merit import parallel_lines
from asperity.checks import FloatArray
from asperity.devices import Device
from asperity.report.pictures import style
from asperity.textures.texture import Texture
from asperity.units import engineering

_POINTS = 4096
# Samples in a period for a correct reconstruction, 5 to 10 in the paper's section II.B.
_SAMPLES_PER_PERIOD = 5.0
_SPEED = 0.1  # [m/s], a brisk stroke


def line_spectrum(texture: Texture) -> tuple[FloatArray, FloatArray]:
    """Return wavelengths [m] and amplitudes [m] along the scan line, averaged over lines.

    The amplitude of a sinusoid is its A. A line that does not repeat is windowed (Hann).
    """
    line = texture.scan_line()
    heights = texture.height(parallel_lines(texture, line, _POINTS).reshape(-1, 2))
    rows = heights.reshape(-1, _POINTS)
    rows = rows - rows.mean(axis=1, keepdims=True)
    window = np.ones(_POINTS) if line.periodic else np.hanning(_POINTS)
    spectrum = 2.0 * np.abs(np.fft.rfft(rows * window, axis=1)) / window.sum()
    amplitude = np.sqrt(np.mean(spectrum**2, axis=0))[1:]
    wavelength = line.length / np.arange(1, len(amplitude) + 1)
    return wavelength, amplitude


def shortest(
    device: Device, speed: float, time_samples: float, position_samples: float
) -> list[tuple[float, int, str]]:
    """Return the wavelengths [m] below which a limit fails at a speed, with number and words.

    Limits 1, 2, 3 and 6 of the paper's section II.B, α v T < l, β δ < l, α δ < l and v/l < F₀; 3
    only where it differs from 2.
    """
    rate, step = device.value("update_rate"), device.value("position_resolution")
    bandwidth = device.value("bandwidth")
    found = []
    if rate is not None:
        found.append((time_samples * speed / rate, 1, f"{time_samples:g} updates"))
    if step is not None:
        found.append((position_samples * step, 2, f"{position_samples:g} position steps"))
        if time_samples != position_samples:
            found.append((time_samples * step, 3, f"{time_samples:g} position steps"))
    if bandwidth is not None:
        found.append((speed / bandwidth, 6, "bandwidth"))
    return sorted(found)


def device_limits(device: Device) -> list[tuple[float, str]]:
    """Return the wavelengths [m] below which a device renders no texture, and why."""
    found = shortest(device, _SPEED, _SAMPLES_PER_PERIOD, _SAMPLES_PER_PERIOD)
    speed = f" at {_SPEED:g} m/s"
    return [
        (least, f"{words}{'' if number == 2 else speed}: {engineering(least, 'm')}")
        for least, number, words in found
    ]


def spectrum_figure(texture: Texture, device: Device) -> Figure:
    """Return amplitude against wavelength, the device's limits drawn in."""
    figure = style.new_figure(10.0, 3.4)
    axes = style.panel(figure)
    wavelength, amplitude = line_spectrum(texture)
    shown = amplitude > 1e-6 * max(float(amplitude.max()), 1e-300)
    unit = style.length_unit(float(amplitude.max()))
    limits = device_limits(device)
    if shown.sum() > 40:
        axes.plot(
            wavelength[shown] * 1e3,
            amplitude[shown] * unit.scale,
            color=style.BLUE,
            lw=1.0,
            label="amplitude",
        )
    else:
        axes.vlines(wavelength[shown] * 1e3, 0.0, amplitude[shown] * unit.scale, color=style.BLUE)
        axes.plot(
            wavelength[shown] * 1e3,
            amplitude[shown] * unit.scale,
            "o",
            color=style.BLUE,
            label="amplitude",
        )
    axes.set_xscale("log")
    axes.set_yscale("log")
    for index, (least, words) in enumerate(sorted(limits)):
        axes.axvline(least * 1e3, color=style.ORANGE, lw=1.0, ls="--")
        axes.annotate(
            words, (least * 1e3, 0.96 - 0.1 * index), xycoords=("data", "axes fraction"),
            xytext=(4, 0), textcoords="offset points", fontsize=style.TICK, color=style.ORANGE,
            va="top",
        )  # fmt: skip
    edges = [*(wavelength[shown]), *(least for least, _ in limits)]
    axes.set_xlim(min(edges) * 1e3 / 1.5, max(edges) * 1e3 * 2.5)
    top = float(amplitude.max()) * unit.scale
    axes.set_ylim(min(top / 300.0, float(amplitude[shown].min()) * unit.scale / 2.0), top * 4.0)
    style.label(axes, "wavelength [mm]", f"amplitude [{unit.name}]")
    return figure

"""Figures of the worst loop of a renderer, and of the energy of recordings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from asperity.certification.loop_search import ClosedLoop
from asperity.certification.recorded_loop import RecordedCertification
from asperity.report.pictures import style

_MAX_POINTS = 4000
_AXIS_COLOURS = (style.ORANGE, style.GREEN, style.BLUE)


def loop_figure(loop: ClosedLoop) -> Figure:
    """Return the worst loop in the plane of its longest horizontal extent and the height."""
    figure, axes = style.new_axes(7.0, 4.0)
    path = np.concatenate([loop.path, loop.path[:1]])
    axis = int(np.argmax(np.ptp(path[:, :2], axis=0)))
    unit = style.length_unit(float(np.ptp(path, axis=0).max()))
    axes.plot(path[:, axis] * unit.scale, path[:, 2] * unit.scale, color=style.ORANGE)
    style.label_axes(axes, f"{'xy'[axis]} [{unit.name}]", f"z [{unit.name}]")
    return figure


def energy_figure(results: Sequence[RecordedCertification]) -> Figure:
    """Return the energy given to the hand against time, along each axis and in all."""
    figure = style.new_figure(9.0, 3.0 * len(results))
    for index, result in enumerate(results):
        axes = figure.add_subplot(len(results), 1, index + 1)
        style.style_axes(axes)
        step = max(1, len(result.times) // _MAX_POINTS)
        times = result.times[::step] - result.times[0]
        energies = 1e3 * result.energy_trace[::step]
        for axis in range(3):
            axes.plot(times, energies[:, axis], color=_AXIS_COLOURS[axis], label="xyz"[axis])
        axes.plot(times, energies.sum(axis=1), color="0.4", label="sum")
        axes.set_title(result.name, fontsize=9)
        style.label_axes(axes, "time [s]", "energy to the hand [mJ]")
        style.add_legend(axes)
    return figure
